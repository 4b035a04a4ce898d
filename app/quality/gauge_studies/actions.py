"""Entering gauge studies, taking them from readings, and putting them right. Lengths in mm."""

from typing import Any

from sqlalchemy.orm import Session

from app.access.audit.actions import record as audit
from app.access.callers import Caller
from app.db.events import publish
from app.errors import Conflict, FieldError, Invalid
from app.language.i18n import _
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.machines.queries import lock_machines
from app.loop.tables.machines import Machine
from app.quality.gauge_studies import queries
from app.quality.gauge_studies.evaluation import design
from app.quality.gauge_studies.queries import StudyRow
from app.quality.gauge_studies.schemas import CorrectionIn, FromReadingsIn, SettingsIn, StudyIn
from app.quality.gauge_studies.tables import GaugeStudy, GaugeStudyRevision
from app.web.created import Created, sent_before
from app.web.forms import parsed


def add_study(
    session: Session, machine: Machine, given: StudyIn, caller: Caller, source: dict[str, Any] | None = None
) -> Created[StudyRow]:
    """Keep a study with all its values. source: the readings that it was taken from.

    Raises `NotFound`; `Invalid` for what is no study of its kind; `Conflict` for a key that was used otherwise.
    """
    lock_machines(session, [machine.id])  # of two that send the same key, one waits for the other
    current = _served(session, machine, given.characteristic)
    settings, rows = _settings(given, current, source), [_row(row.model_dump()) for row in given.rows]
    before = None if given.key is None else queries.by_key(session, machine, given.key)
    if before is not None:
        same = _same(before, given.kind, settings, rows)
        return sent_before(before, given.key, _("gauge study"), same=same, id=before.study.id)
    design(given.kind, settings, rows)
    study = GaugeStudy(
        machine_id=machine.id,
        kind=given.kind,
        characteristic_id=None if current is None else current.characteristic.id,
        key=given.key,
        created_by=caller.name,
    )
    session.add(study)
    session.flush()
    _keep(session, study, 1, settings, rows, caller, None)
    subject, values = f"gauge-study/{study.id}", sum(len(row["values"]) for row in rows)
    audit(session, caller.name, "gauge study entered", subject, None, {"kind": given.kind, "values": values})
    publish(session, _news(machine, current, study.id))
    return Created(queries.study(session, study.id))


def take_study(
    session: Session, current: CurrentCharacteristic, given: FromReadingsIn, caller: Caller
) -> Created[StudyRow]:
    """A study of readings that are stored: one part probed again and again, or the repeats of each touch.

    Raises `Invalid` where these readings make no study, `Conflict` for a key that was used otherwise.
    """
    rows = rows_from_readings(session, current, given.kind, given.first, given.through, given.take)
    fields = given.model_dump(exclude={"first", "through", "take", "characteristic"})
    fields["each"] = "touch" if given.take == "touches" else "reading"
    named = {"machine": current.machine.key, "characteristic": current.characteristic.key, "rows": rows}
    study = parsed(StudyIn, fields | named)
    source = source_of(session, current, given.first, given.through, given.take)
    return add_study(session, current.machine, study, caller, source)


def source_of(session: Session, current: CurrentCharacteristic, first: int, through: int, take: str) -> dict[str, Any]:
    """From which readings values are taken, which of them were left out, and the empirical values that were taken off."""
    missing = queries.left_out(session, current, first, through)
    empirical = queries.empirical_values(session, current, first, through)
    source = {"first": first, "through": through, "take": take, "empirical_values": empirical}
    return source | ({"left_out": missing} if missing else {})


def _same(before: StudyRow, kind: str, settings: dict[str, Any], rows: list[dict[str, Any]]) -> bool:
    """Tell if this was sent before. For readings the question counts, whatever became of them since."""
    names = ("first", "through", "take")
    old, new = before.settings, settings
    if "source" in old and "source" in new:
        same = [old["source"][name] for name in names] == [new["source"][name] for name in names]
        old, new = ({k: v for k, v in fields.items() if k != "source"} for fields in (old, new))
        return same and (before.study.kind, old) == (kind, new)
    return (before.study.kind, old, before.revision.rows) == (kind, new, rows)


def rows_from_readings(
    session: Session, current: CurrentCharacteristic, kind: str, first: int, through: int, take: str
) -> list[dict[str, Any]]:
    """The rows of a study that these readings make. Raises `Invalid`."""
    if kind == "grr" and take != "touches":
        raise Invalid.at(
            "take",
            _("a study of parts and operators takes the touches of each reading: a reading alone has no repeats"),
            do=_("Take the touches."),
        )
    sizes = queries.taken(session, current, first, through, take)
    if kind == "grr":
        return [{"part": str(sequence), "operator": "1", "values": values} for sequence, values in sizes]
    return [{"values": [value for _sequence, values in sizes for value in values]}]


def correct_study(session: Session, number: int, given: CorrectionIn, caller: Caller) -> StudyRow:
    """Put a study right, with a reason: a new revision. Nothing that was entered before is lost.

    Raises `NotFound`, `Invalid`; `Conflict` if another revision was made since the one that was seen.
    """
    study = queries.study(session, number)
    lock_machines(session, [study.machine.id])
    study = queries.study(session, number)  # read again under the lock
    if given.seen_revision is not None and given.seen_revision != study.newest:
        wrong = _("{who} has made revision {n} meanwhile: your correction does not contain it").format(
            who=study.revision.actor, n=study.newest
        )
        raise Conflict(
            f"{wrong}.",
            _("Review it. Save yours again to replace it."),
            errors=[FieldError("seen_revision", wrong)],
        )
    current = _served(session, study.machine, study.characteristic)
    settings = _settings(given, current, study.settings.get("source"))
    rows = [_row(row.model_dump()) for row in given.rows]
    if (settings, rows) == (study.settings, study.revision.rows):
        raise Invalid.at(
            "rows",
            _("nothing differs from revision {n}").format(n=study.newest),
            do=_("Change what is wrong, or leave the study as it is."),
        )
    design(study.study.kind, settings, rows)
    _keep(session, study.study, study.newest + 1, settings, rows, caller, given.reason)
    before, after = _changes(study, settings, rows)
    audit(session, caller.name, "gauge study corrected", f"gauge-study/{number}", before, after, given.reason)
    publish(session, _news(study.machine, current, number))
    return queries.study(session, number)


def _served(session: Session, machine: Machine, key: str | None) -> CurrentCharacteristic | None:
    if key is None:
        return None
    current = characteristics.characteristic_named(session, key)
    if current.machine.id != machine.id:
        raise Invalid.at(
            "characteristic",
            _("belongs to machine {machine}").format(machine=current.machine.key),
            do=_("Name one of the same machine."),
        )
    return current


def _settings(
    given: SettingsIn, current: CurrentCharacteristic | None, source: dict[str, Any] | None
) -> dict[str, Any]:
    settings = {name: getattr(given, name) for name in SettingsIn.model_fields}
    if settings["tolerance"] is None and current is not None:
        settings["tolerance"] = current.parameters.tolerance_width
    return settings | ({} if source is None else {"source": source})


def _row(row: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in row.items() if value is not None}


def _keep(
    session: Session,
    made: GaugeStudy,
    revision: int,
    settings: dict[str, Any],
    rows: list[dict[str, Any]],
    caller: Caller,
    reason: str | None,
) -> None:
    session.add(
        GaugeStudyRevision(
            machine_id=made.machine_id,
            study_id=made.id,
            revision=revision,
            actor=caller.name,
            reason=reason,
            settings=settings,
            rows=rows,
        )
    )
    session.flush()


def _changes(
    found: StudyRow, settings: dict[str, Any], rows: list[dict[str, Any]]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Differences for the record of changes: settings, and the rows that are not as they were."""
    names = [name for name in settings if settings[name] != found.settings.get(name)]
    before = {name: found.settings.get(name) for name in names} | {"revision": found.newest}
    after = {name: settings[name] for name in names} | {"revision": found.newest + 1}
    old = [row for row in found.revision.rows if row not in rows]
    new = [row for row in rows if row not in found.revision.rows]
    return before | ({"rows": old[:20]} if old else {}), after | ({"rows": new[:20]} if new else {})


def _news(machine: Machine, current: CurrentCharacteristic | None, number: int) -> dict[str, Any]:
    """Event for live pages."""
    event = {"kind": "gauge_study", "machine": machine.key, "id": number}
    return event if current is None else event | {"characteristic": current.characteristic.key}
