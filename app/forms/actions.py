"""Measuring form, and computing it anew. Lengths in mm.

Nothing here changes what readings are decided by, so no machine is locked: the result becomes a reading at the door of
readings, like any other.
"""

from datetime import UTC, datetime
from typing import NamedTuple

from sqlalchemy import select
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.audit.actions import record as audit
from app.core.geometry.elements import WrongSection
from app.core.geometry.points import Degenerate
from app.core.geometry.relations import DatumRefused
from app.db.engine import Database
from app.db.events import publish
from app.errors import Conflict
from app.forms import queries, wording
from app.forms.evaluating import Found, find
from app.forms.queries import FormRow
from app.forms.schemas import FormIn, stored
from app.forms.tables import FormEvaluation, FormMeasurement
from app.machines.tables import Machine
from app.people.callers import Caller
from app.readings import actions as readings
from app.readings import queries as streams
from app.web.i18n import _

HELD = ("method", "tolerance", "repeatability", "part")  # what makes another measurement of the same touches


class Made(NamedTuple):
    """A measurement; again: it was sent before with the same key, and nothing happened now."""

    row: FormRow
    again: bool = False


def measure_and_push(database: Database, machine: Machine, given: FormIn, caller: Caller) -> Made:
    """Measure, commit, and push the reading that the result becomes; where that cannot be now, a chore does it.

    Raises what `measure` raises.
    """
    with database.begin() as session:
        made = measure(session, machine, given, caller)
        waits = made.row.measurement.characteristic_id is not None
        number = made.row.measurement.id
    if waits:
        readings.push_results(database)
    with database.begin() as session:
        row = queries.form(session, number)
        session.expunge_all()
    return Made(row, made.again)


def measure(session: Session, machine: Machine, given: FormIn, caller: Caller) -> Made:
    """Evaluate and keep a measurement, and ask for the reading that its result is to become.

    Raises `Invalid` for touches that carry no result, and for a characteristic that the machine has not; `Conflict` for a
    key that was used otherwise.
    """
    if (before := _sent_before(session, machine, given)) is not None:
        return before
    entries = (
        streams.entries_for_results(session, machine.id, {"deviation": given.characteristic}, "characteristic")
        if given.characteristic
        else {}
    )
    entry = entries.get("deviation")
    found = found_in(given.kind, stored(given), given.method, given.tolerance, given.repeatability)
    at = given.measured_at or datetime.now(UTC)
    number = session.scalar(
        insert(FormMeasurement)
        .values(
            machine_id=machine.id,
            feature=given.feature,
            kind=given.kind,
            part=given.part,
            measured_at=at,
            actor=caller.name,
            key=given.key,
            given=stored(given),
            method=given.method,
            tolerance=given.tolerance,
            repeatability=given.repeatability,
            characteristic_id=None if entry is None else entry.characteristic_id,
        )
        .on_conflict_do_nothing()
        .returning(FormMeasurement.id)
    )
    if number is None:  # another request with this key was quicker
        quicker = _sent_before(session, machine, given)
        assert quicker is not None
        return quicker
    session.execute(
        insert(FormEvaluation).values(
            machine_id=machine.id, form_id=number, number=1, actor=caller.name, **found._asdict()
        )
    )
    if entry is not None:
        source = readings.Source(queries.source_key(number), at, given.part)
        readings.ask_for(session, entries, {"deviation": found.value}, source)
    row = queries.form(session, number)
    if caller.kind == "person":
        after = {"feature": given.feature, "kind": given.kind, "value": found.value, "verdict": found.verdict}
        audit(session, caller.name, "form measured", f"form/{machine.key}/{number}", None, after)
    publish(session, {"kind": "form", "machine": machine.key, "feature": given.feature, "number": number})
    return Made(row)


def found_in(
    kind: str,
    given: dict[str, object],
    method: str | None,
    tolerance: float | None,
    repeatability: float | None,
) -> Found:
    """What the core finds. Raises `Invalid` with what is wrong with which touches, and what to do."""
    try:
        found = find(kind, given, method, tolerance, repeatability)
    except (Degenerate, WrongSection, DatumRefused) as refusal:
        raise wording.refused(refusal, kind, given) from None
    details = found.result["details"]
    sections = [*details.get("sections", ()), *details.get("datum_sections", ())]
    if any(section.get("diameter", 1.0) <= 0 for section in sections):
        raise wording.tip_too_large()
    return found


def _sent_before(session: Session, machine: Machine, given: FormIn) -> Made | None:
    before = None if given.key is None else queries.by_key(session, machine.id, given.key)
    if before is None:
        return None
    kept = before.measurement
    wanted = (given.feature, given.kind, stored(given), *(getattr(given, name) for name in HELD))
    if (kept.feature, kept.kind, kept.given, *(getattr(kept, name) for name in HELD)) == wanted:
        return Made(before, again=True)
    raise Conflict(
        _("Form measurement {number} was sent with the key {key} already, and with other values.").format(
            number=kept.id, key=repr(given.key)
        ),
        _("A key names one measurement for ever: use another one."),
        number=kept.id,
    )


def recompute(session: Session, number: int, reason: str, caller: Caller) -> FormRow:
    """Evaluate the stored touches anew; the evaluations before stay on record. Raises `NotFound`, `Invalid`."""
    before = queries.form(session, number)
    kept = before.measurement
    found = found_in(kept.kind, kept.given, kept.method, kept.tolerance, kept.repeatability)
    session.scalars(select(FormMeasurement.id).where(FormMeasurement.id == number).with_for_update()).one()
    last = queries.form(session, number).evaluation
    session.execute(
        insert(FormEvaluation).values(
            machine_id=kept.machine_id,
            form_id=kept.id,
            number=last.number + 1,
            actor=caller.name,
            **found._asdict(),
        )
    )
    audit(
        session,
        caller.name,
        "form computed anew",
        f"form/{before.machine}/{number}",
        {"engine": last.engine, "value": last.value, "verdict": last.verdict},
        {"engine": found.engine, "value": found.value, "verdict": found.verdict},
        reason,
    )
    publish(session, {"kind": "form", "machine": before.machine, "feature": kept.feature, "number": number})
    return queries.form(session, number)
