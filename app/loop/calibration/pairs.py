"""Paired readings against an external gauge, and accepting the empirical value that they suggest. Lengths in mm."""

from collections.abc import Sequence
from datetime import UTC, datetime

from sqlalchemy.orm import Session

from app.access.audit.actions import record as audit
from app.access.callers import Caller
from app.core.calibration import Outcome
from app.core.decision.limits import nanometres
from app.db.events import publish
from app.errors import Conflict, Invalid
from app.language.i18n import _
from app.loop.calibration import queries, wording
from app.loop.calibration.actions import count_again, end_alarms, news, put_into_effect
from app.loop.calibration.queries import CalibrationRow, Place
from app.loop.calibration.schemas import PairIn
from app.loop.machines.queries import lock_machines
from app.loop.readings import queries as readings
from app.loop.tables.calibration import CalibrationRecord, PairedReading
from app.loop.tables.machines import Machine


def add_pairs(
    session: Session, machine: Machine, location: int, given: Sequence[PairIn], caller: Caller
) -> list[PairedReading]:
    """Keep readings of the machine beside what an external gauge says. With a key that was sent before: the pair of then.

    Raises `NotFound`; `Invalid` when the machine's reading is not named or typed rightly; `Conflict` for a used key.
    """
    lock_machines(session, [machine.id])
    queries.value_of(session, machine, Place("average", location))
    stored = [_add(session, machine, location, pair, caller) for pair in given]
    _publish_pairs(session, machine, location)
    return stored


def _add(session: Session, machine: Machine, location: int, given: PairIn, caller: Caller) -> PairedReading:
    machine_value, characteristic_id = _machine_value(session, machine, given)
    before = None if given.key is None else queries.pair_by_key(session, machine, given.key)
    content = (location, machine_value, given.external_value, given.instrument)
    if before is not None:
        if content == (before.location, before.machine_value, before.true_value, before.instrument):
            return before
        raise Conflict(
            _("A pair was sent with the key {key} already, and with other values.").format(key=repr(given.key)),
            _("A key names one pair for ever: use another one."),
        )
    row = PairedReading(
        machine_id=machine.id,
        location=location,
        actor=caller.name,
        key=given.key,
        machine_value=machine_value,
        true_value=given.external_value,
        instrument=given.instrument,
        characteristic_id=characteristic_id,
        sequence=given.sequence,
    )
    session.add(row)
    session.flush()
    return row


def _machine_value(session: Session, machine: Machine, given: PairIn) -> tuple[float, int | None]:
    if given.characteristic is None:
        if given.machine_value is None or given.sequence is not None:
            raise Invalid.at("machine_value", _("say either characteristic and sequence, or machine_value"))
        return given.machine_value, None
    if given.sequence is None or given.machine_value is not None:
        raise Invalid.at("sequence", _("say either characteristic and sequence, or machine_value"))
    entry = readings.entry_of(session, given.characteristic)
    if entry is None or entry.machine_id != machine.id:
        raise Invalid.at(
            "characteristic", _("machine {machine} has no such characteristic").format(machine=machine.key)
        )
    return readings.record_of(session, entry, given.sequence).measured, entry.characteristic_id


def exclude_pair(session: Session, machine: Machine, location: int, number: int, reason: str, caller: Caller) -> None:
    """A pair that does not count: misread, another part. It stays on record. Raises `NotFound`; `Conflict` the second time."""
    lock_machines(session, [machine.id])
    row = queries.pair(session, machine, location, number)
    if row.excluded_at is not None:
        raise Conflict(
            _("{who} excluded this pair already: {why}").format(who=row.excluded_by, why=row.excluded_why),
            _("There is nothing left to do."),
        )
    row.excluded_at, row.excluded_by, row.excluded_why = datetime.now(UTC), caller.name, reason
    audit(session, caller.name, "pair excluded", f"average/{machine.key}/{location}/pair/{number}", None, None, reason)
    _publish_pairs(session, machine, location)


def _publish_pairs(session: Session, machine: Machine, location: int) -> None:
    publish(session, {"kind": "calibration", "machine": machine.key, "average_memory": location})


def accept_suggestion(
    session: Session, machine: Machine, location: int, reason: str, caller: Caller, *, seen: float | None = None
) -> CalibrationRow:
    """The mean difference of the pairs becomes the empirical value; that is a calibration of its own kind.

    seen: the suggestion as the caller saw it. Raises `NotFound`; `Conflict` when nothing is suggested, or something else.
    """
    lock_machines(session, [machine.id])
    place = Place("average", location)
    suggestion = queries.suggestion(session, machine, location)
    compared = suggestion.comparison
    summary = wording.what_pairs_say(compared, suggestion.empirical_value)
    if compared.suggested is None:
        raise Conflict(_("There is no empirical value to accept. {said}").format(said=summary), _("Add pairs."))
    if seen is not None and nanometres(seen - compared.suggested) != 0:
        raise Conflict(
            _("The suggestion is another one by now. {said}").format(said=summary),
            _("Look at the pairs again, then accept."),
            suggested=compared.suggested,
        )
    counted = [pair for pair in suggestion.pairs if pair.counts]
    record = CalibrationRecord(
        machine_id=machine.id,
        number=queries.next_number(session, machine),
        kind="pairs",
        memory=place.memory,
        location=place.location,
        calibrated_at=datetime.now(UTC),
        actor=caller.name,
        outcome=Outcome.PAIRED,
        refused=False,
        settings={
            "pairs": [pair.row.id for pair in counted],
            "instruments": sorted({pair.row.instrument for pair in counted}),
            "deviation": compared.deviation,
            "low": compared.low,
            "high": compared.high,
            "confidence": compared.confidence,
        },
        touches=[[pair.row.machine_value, pair.row.true_value] for pair in counted],
        difference=compared.mean,
        value_before=suggestion.empirical_value,
        proposed=compared.suggested,
    )
    session.add(record)
    session.flush()
    changes = end_alarms(session, machine, record)
    count_again(session, machine, place, record.calibrated_at)
    put_into_effect(session, machine, record, reason, caller)
    publish(session, news(machine, record), *changes)
    return queries.calibration(session, machine, record.number)
