"""Everything that is read of readings."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from sqlalchemy import ColumnElement, func, select, tuple_
from sqlalchemy.dialects.postgresql import array
from sqlalchemy.orm import Session

from app.access.callers import Caller
from app.core.decision.limits import Zone
from app.core.decision.step import Code
from app.core.plausibility import uncorrected
from app.core.probing import Touches
from app.core.variants import Results
from app.errors import FieldError, Invalid, NotFound
from app.language.i18n import _
from app.loop.characteristics import queries as characteristics
from app.loop.expansion.queries import at_20, expansion_of
from app.loop.readings.answers import AtTwenty, answer
from app.loop.readings.by_hand import queries as by_hand
from app.loop.readings.by_hand.wording import as_json as in_json
from app.loop.readings.records import Entry, Record
from app.loop.readings.wording import as_read, reason
from app.loop.tables.alarms import Alarm
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.machines import Machine
from app.loop.tables.readings import (
    Exclusion,
    HandMeasurement,
    Reading,
    ReadingContext,
    ReadingNext,
    ReadingResults,
    ReadingTouches,
    ResultReading,
    Stream,
)
from app.loop.tables.tools import Correction
from app.web.fields import is_slug

COLUMNS = [getattr(Reading, name) for name in Record.__struct_fields__]
_RESULTS = [getattr(ReadingResults, name) for name in Results._fields]


def entry_of(session: Session, characteristic: str) -> Entry | None:
    """Return the place of a characteristic, by its key."""
    if not is_slug(characteristic):
        return None
    row = session.execute(
        select(Characteristic.machine_id, Machine.key, Characteristic.id, Characteristic.key)
        .join(Machine, Machine.id == Characteristic.machine_id)
        .where(Characteristic.key == characteristic)
    ).one_or_none()
    return Entry(*row) if row else None


def entry_named(session: Session, characteristic: str) -> Entry:
    """The place of the characteristic with this key. Raises `NotFound`."""
    entry = entry_of(session, characteristic)
    if entry is None:
        raise NotFound(
            _("There is no characteristic {key}.").format(key=repr(characteristic[:64])),
            _("Check the key under Set-up; GET /api/v1/characteristics lists them all."),
        )
    return entry


def entry_by_id(session: Session, machine_id: int, characteristic_id: int) -> Entry:
    """Return the place of a characteristic that is known to be there."""
    row = session.execute(
        select(Characteristic.machine_id, Machine.key, Characteristic.id, Characteristic.key)
        .join(Machine, Machine.id == Characteristic.machine_id)
        .where(Characteristic.machine_id == machine_id, Characteristic.id == characteristic_id)
    ).one()
    return Entry(*row)


def count_of(session: Session, characteristic: Characteristic) -> int:
    """Number of its readings."""
    return session.get_one(Stream, (characteristic.machine_id, characteristic.id)).sequence


def entries_for_results(
    session: Session, machine_id: int, named: Mapping[str, str], field: str = "characteristics.{result}"
) -> dict[str, Entry]:
    """The characteristics that results are to become, by result. Raises `Invalid` for one that this machine has not.

    field: where a result's characteristic is in what was sent.
    """
    entries: dict[str, Entry] = {}
    errors = []
    for result, characteristic in named.items():
        entry = entry_of(session, characteristic)
        if entry is None or entry.machine_id != machine_id:
            wrong = _("there is no characteristic {key} on this machine").format(key=repr(characteristic[:64]))
            errors.append(FieldError(field.format(result=result), wrong))
        else:
            entries[result] = entry
    if errors:
        raise Invalid(f"{errors[0].field}: {errors[0].message}.", _("Set the characteristic up first."), errors=errors)
    return entries


class PushedResult(NamedTuple):
    """A result that is, or becomes, a reading. sequence: its number; refused: the reason for refusal."""

    result: str
    characteristic: str
    sequence: int | None
    refused: str | None


def pushed_results(session: Session, sources: Iterable[str], results: Sequence[str]) -> dict[str, list[PushedResult]]:
    """The results of measurements that are, or become, readings, by the key of the measurement (`work-zero:12`)."""
    pushed: dict[str, list[PushedResult]] = {source: [] for source in sources}
    keys = [f"{source}:{result}" for source in pushed for result in results]
    rows = {row.key: row for row in session.scalars(select(ResultReading).where(ResultReading.key.in_(keys)))}
    for key in keys:
        if key in rows:
            (source, _colon, result), row = key.rpartition(":"), rows[key]
            characteristic = entry_by_id(session, row.machine_id, row.characteristic_id).characteristic
            pushed[source].append(PushedResult(result, characteristic, row.sequence, row.refused))
    return pushed


def answers(session: Session, entry: Entry, records: list[Record]) -> list[dict[str, Any]]:
    """The stored readings as they were answered, with what has been said about them since (excluded).

    Their reason has two texts: `text` as it was answered, exact, and `as_read` for a page.
    """
    if not records:
        return []
    numbers = [record.correction for record in records if record.correction is not None]
    corrections: dict[int, tuple[int, float]] = {}
    if numbers:
        rows = session.execute(
            select(Correction.number, Correction.tool_memory, Correction.amount).where(
                Correction.machine_id == entry.machine_id, Correction.number.in_(numbers)
            )
        )
        corrections = {number: (tool, amount) for number, tool, amount in rows}
    alarm_ids = {number for record in records for number in record.alarms or ()}
    kinds: dict[int, str] = {}
    if alarm_ids:
        found = session.execute(
            select(Alarm.id, Alarm.kind).where(Alarm.machine_id == entry.machine_id, Alarm.id.in_(alarm_ids))
        )
        kinds = {row.id: row.kind for row in found}
    excluded = {
        sequence: {"at": at, "by": actor, "reason": reason}
        for sequence, at, actor, reason in session.execute(
            select(Exclusion.sequence, Exclusion.at, Exclusion.actor, Exclusion.reason).where(
                Exclusion.machine_id == entry.machine_id,
                Exclusion.characteristic_id == entry.characteristic_id,
                Exclusion.sequence.in_([record.sequence for record in records]),
            )
        )
    }
    results = _results(session, entry, [record.sequence for record in records])
    following = _measure_next(session, entry, [record.sequence for record in records])
    touches = touches_of(session, entry, [record.sequence for record in records if record.code == Code.TOUCH_FAULT])
    found_answers = []
    for record in records:
        limits = characteristics.parameters_of(
            session, entry.machine_id, entry.characteristic_id, record.parameters_version
        )
        correction = None if record.correction is None else corrections.get(record.correction)
        touched = touches.get(record.sequence)
        first = answer(
            entry.characteristic,
            record,
            limits,
            correction=correction,
            alarms=[(number, kinds[number]) for number in record.alarms or () if number in kinds],
            results=results.get(record.sequence),
            measure_next=following.get(record.sequence),
            touches=touched,
        )
        first["reason"]["as_read"] = as_read(record, limits, correction[1] if correction else None, touched)
        found_answers.append(first | {"excluded": excluded.get(record.sequence)})
    return found_answers


def _results(session: Session, entry: Entry, sequences: list[int]) -> dict[int, Results]:
    """Return the results of the variants of these readings beside the value, of those that have anything."""
    rows = session.execute(
        select(ReadingResults.sequence, *_RESULTS).where(
            ReadingResults.machine_id == entry.machine_id,
            ReadingResults.characteristic_id == entry.characteristic_id,
            ReadingResults.sequence.in_(sequences),
        )
    )
    return {sequence: Results(*found) for sequence, *found in rows}


def _measure_next(session: Session, entry: Entry, sequences: list[int]) -> dict[int, int]:
    """Return the parts until the next measurement as these readings were answered, of those that a control plan counts parts for."""
    rows = session.execute(
        select(ReadingNext.sequence, ReadingNext.measure_next).where(
            ReadingNext.machine_id == entry.machine_id,
            ReadingNext.characteristic_id == entry.characteristic_id,
            ReadingNext.sequence.in_(sequences),
        )
    )
    return {sequence: parts for sequence, parts in rows}  # noqa: C416 - rows are no pairs to mypy


def touches_of(session: Session, entry: Entry, sequences: Sequence[int]) -> dict[int, Touches]:
    """Return the touches of these readings, of those that came as touches."""
    if not sequences:
        return {}
    rows = session.execute(
        select(ReadingTouches.sequence, ReadingTouches.touches).where(
            ReadingTouches.machine_id == entry.machine_id,
            ReadingTouches.characteristic_id == entry.characteristic_id,
            ReadingTouches.sequence.in_(sequences),
        )
    )
    return {sequence: touches for sequence, touches in rows}  # noqa: C416 - rows are no pairs to mypy


def record_of(session: Session, entry: Entry, sequence: int) -> Record:
    """One stored reading. Raises `NotFound`."""
    row = session.execute(
        select(*COLUMNS).where(
            Reading.machine_id == entry.machine_id,
            Reading.characteristic_id == entry.characteristic_id,
            Reading.sequence == sequence,
        )
    ).one_or_none()
    if row is None:
        raise NotFound(
            _("Characteristic %(key)s has no reading %(sequence)s.")
            % {"key": entry.characteristic, "sequence": sequence},
            _("Readings are numbered 1, 2, 3 … without gaps; look at the list for the last one."),
        )
    return Record(*row)


def uncorrected_of(session: Session, machine_id: int, characteristic_id: int, sequence: int) -> float | None:
    """Return the deviation of a reading without the corrections its part was cut with, mm; None if it is not known."""
    row = session.execute(
        select(Reading.deviation, Reading.compensated, Reading.parameters_version).where(
            Reading.machine_id == machine_id,
            Reading.characteristic_id == characteristic_id,
            Reading.sequence == sequence,
        )
    ).one_or_none()
    if row is None or row.compensated is None:
        return None
    parameters = characteristics.parameters_of(session, machine_id, characteristic_id, row.parameters_version)
    return uncorrected(row.deviation, row.compensated, parameters.factor)


def within_wear_since(session: Session, machine_id: int, characteristic_id: int, sequence: int) -> bool:
    """Tell if a reading after this one, of a part cut with the same tool, lies within the wear limit R37."""
    found = session.scalar(
        select(Reading.sequence)
        .where(
            Reading.machine_id == machine_id,
            Reading.characteristic_id == characteristic_id,
            Reading.sequence > sequence,
            Reading.late.is_(False),
            Reading.zone.not_in((Zone.WEAR, Zone.PROBE_FAULT)),
            Reading.code.not_in((Code.BEFORE_TOOL_CHANGE, Code.IMPORTED)),
        )
        .limit(1)
    )
    return found is not None


def course_of(session: Session, machine_id: int, characteristic_id: int, factor: float, limit: int) -> list[float]:
    """The last deviations on this tool as they would be without corrections, oldest first, mm; excluded ones left out."""
    rows = session.execute(
        select(Reading.deviation, Reading.compensated)
        .join(
            Stream,
            (Stream.machine_id == Reading.machine_id) & (Stream.characteristic_id == Reading.characteristic_id),
        )
        .outerjoin(
            Exclusion,
            (Exclusion.machine_id == Reading.machine_id)
            & (Exclusion.characteristic_id == Reading.characteristic_id)
            & (Exclusion.sequence == Reading.sequence),
        )
        .where(
            Reading.machine_id == machine_id,
            Reading.characteristic_id == characteristic_id,
            Reading.sequence > func.greatest(Stream.sequence_at_tool_change, Stream.sequence - limit),
            Reading.compensated.is_not(None),
            Reading.code != Code.IMPLAUSIBLE,
            Reading.zone != Zone.PROBE_FAULT,
            Exclusion.sequence.is_(None),
        )
        .order_by(Reading.sequence)
    )
    return [uncorrected(deviation, compensated or 0.0, factor) for deviation, compensated in rows]


def first_answers(session: Session, entry: Entry, sequences: Iterable[int]) -> dict[int, dict[str, Any]]:
    """The answers that these readings were given when they came, by sequence."""
    rows = session.execute(
        select(*COLUMNS).where(
            Reading.machine_id == entry.machine_id,
            Reading.characteristic_id == entry.characteristic_id,
            Reading.sequence.in_(sequences),
        )
    )
    answers_by_sequence = {
        first["sequence"]: first for first in answers(session, entry, [Record(*row) for row in rows])
    }
    for first in answers_by_sequence.values():
        del first["excluded"], first["reason"]["as_read"]  # the first answer could not know one and had not the other
    return answers_by_sequence


def detail(session: Session, entry: Entry, sequence: int) -> dict[str, Any]:
    """One reading with its touches and the full reason."""
    record = record_of(session, entry, sequence)
    context = session.scalar(
        select(ReadingContext.context).where(
            ReadingContext.machine_id == entry.machine_id,
            ReadingContext.characteristic_id == entry.characteristic_id,
            ReadingContext.sequence == sequence,
        )
    )
    measurements = by_hand.of_readings(session, entry.machine_id, entry.characteristic_id, [sequence])
    (found,) = with_at_20(session, entry, answers(session, entry, [record]))
    return found | {
        "by_hand": [in_json(measurement) for measurement in measurements.get(sequence, ())],
        "touches": touches_of(session, entry, [sequence]).get(sequence),
        "machined_at": record.machined_at,
        "correction_in_effect": record.correction_in_effect,
        "context": context,
    }


def with_at_20(session: Session, entry: Entry, found: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """These answers with their sizes at 20 °C; None of a probe fault, and where no temperature was sent."""
    here = (ReadingContext.machine_id == entry.machine_id, ReadingContext.characteristic_id == entry.characteristic_id)
    measured = [answer["sequence"] for answer in found if answer["zone"] != Zone.PROBE_FAULT]
    rows = session.execute(
        select(ReadingContext.sequence, ReadingContext.context).where(
            *here,
            ReadingContext.sequence.in_(measured),
            ReadingContext.context.has_any(array(["part_temperature", "machine_temperature"])),
        )
    )
    contexts = {sequence: context for sequence, context in rows}  # noqa: C416 - rows are no pairs to mypy
    if not contexts:  # of nearly all
        return [answer | {"at_20": None} for answer in found]
    expansion = expansion_of(session, entry.machine_id, entry.characteristic_id)
    return [
        answer | {"at_20": AtTwenty.of(at_20(answer["size"], contexts.get(answer["sequence"]), expansion))}
        for answer in found
    ]


def hand_measurements(
    session: Session, machine_id: int, characteristic_id: int, first: int, last: int, limit: int
) -> list[HandMeasurement]:
    """Return what was measured by hand on the parts of these readings; of more than `limit` the newest."""
    return by_hand.between(session, machine_id, characteristic_id, first, last, limit)


def latest(
    session: Session, entry: Entry, before: int | None, limit: int, *of_those: ColumnElement[bool]
) -> list[Record]:
    """Readings before a sequence number (or the last ones), of those for which all of this holds; newest first."""
    query = select(*COLUMNS).where(
        Reading.machine_id == entry.machine_id, Reading.characteristic_id == entry.characteristic_id, *of_those
    )
    if before is not None:
        query = query.where(Reading.sequence < before)
    return [Record(*row) for row in session.execute(query.order_by(Reading.sequence.desc()).limit(limit))]


def reasons(
    session: Session, machine_id: int, asked: Iterable[tuple[int, int, float]]
) -> dict[tuple[int, int], tuple[dict[str, Any], float]]:
    """Return the reasons of corrections: those of the readings (characteristic id, sequence, amount in mm) behind them.

    Beside each the half tolerance by which it was judged, mm.
    """
    amounts = {(characteristic_id, sequence): amount for characteristic_id, sequence, amount in asked}
    rows = session.execute(
        select(*COLUMNS).where(
            Reading.machine_id == machine_id, tuple_(Reading.characteristic_id, Reading.sequence).in_(amounts)
        )
    )
    reasons_by_key = {}
    for record in (Record(*row) for row in rows):
        at = (record.characteristic_id, record.sequence)
        parameters = characteristics.parameters_of(session, machine_id, at[0], record.parameters_version)
        said = reason(record, parameters, amounts[at])
        reasons_by_key[at] = said | {"as_read": as_read(record, parameters, amounts[at])}, parameters.half
    return reasons_by_key


def entry_for(session: Session, caller: Caller, characteristic: str) -> Entry:
    """The place of a characteristic, for a person who may look at it. Raises `NotFound`, `NotAllowed`."""
    entry = entry_named(session, characteristic)
    caller.must_at(entry.machine_id, "viewer")
    return entry
