"""Measuring form, and computing it again. Lengths in mm.

Nothing here changes what readings are decided by, so no machine is locked: the result becomes a reading at the door of
readings, like any other.
"""

from datetime import UTC, datetime

from sqlalchemy import select
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.access.audit.actions import record as audit
from app.access.callers import Caller
from app.core.geometry.elements import WrongSection
from app.core.geometry.points import Degenerate
from app.core.geometry.relations import DatumRefused
from app.db.events import publish
from app.geometry.geometric_form import queries, wording
from app.geometry.geometric_form.evaluation import EvaluatedForm, find
from app.geometry.geometric_form.queries import FormRow
from app.geometry.geometric_form.schemas import FormIn, stored
from app.geometry.geometric_form.tables import FormEvaluation, FormMeasurement
from app.language.i18n import _
from app.loop.readings import queries as streams
from app.loop.readings import results_actions as readings
from app.loop.tables.machines import Machine
from app.web.created import Created, sent_before

HELD = ("method", "tolerance", "repeatability", "part")  # what makes another measurement of the same touches


def measure_and_push(session: Session, machine: Machine, body: FormIn, caller: Caller) -> Created[FormRow]:
    """Measure, commit, and push the reading that the result becomes; where that cannot be now, a periodic job does it.

    Raises what `measure` raises.
    """
    with readings.pushing(session) as own:
        created = measure(own, machine, body, caller)
    return Created(queries.form(session, created.row.measurement.id), created.again)


def measure(session: Session, machine: Machine, body: FormIn, caller: Caller) -> Created[FormRow]:
    """Evaluate and keep a measurement, and ask for the reading that its result is to become.

    Raises `Invalid` for touches that carry no result, and for a characteristic that the machine has not; `Conflict` for a
    key that was used otherwise.
    """
    if (before := _sent_before(session, machine, body)) is not None:
        return before
    entries = (
        streams.entries_for_results(session, machine.id, {"deviation": body.characteristic}, "characteristic")
        if body.characteristic
        else {}
    )
    entry = entries.get("deviation")
    evaluated = found_in(body.kind, stored(body), body.method, body.tolerance, body.repeatability)
    at = body.measured_at or datetime.now(UTC)
    number = session.scalar(
        insert(FormMeasurement)
        .values(
            machine_id=machine.id,
            feature=body.feature,
            kind=body.kind,
            part=body.part,
            measured_at=at,
            actor=caller.name,
            key=body.key,
            given=stored(body),
            method=body.method,
            tolerance=body.tolerance,
            repeatability=body.repeatability,
            characteristic_id=None if entry is None else entry.characteristic_id,
        )
        .on_conflict_do_nothing()
        .returning(FormMeasurement.id)
    )
    if number is None:  # another request with this key was quicker
        quicker = _sent_before(session, machine, body)
        assert quicker is not None
        return quicker
    session.execute(
        insert(FormEvaluation).values(
            machine_id=machine.id, form_id=number, number=1, actor=caller.name, **evaluated._asdict()
        )
    )
    if entry is not None:
        source = readings.Source(queries.source_key(number), at, body.part)
        readings.ask_for(session, entries, {"deviation": evaluated.value}, source)
    row = queries.form(session, number)
    if caller.kind == "person":
        after = {"feature": body.feature, "kind": body.kind, "value": evaluated.value, "verdict": evaluated.verdict}
        audit(session, caller.name, "form measured", f"form/{machine.key}/{number}", None, after)
    publish(session, {"kind": "form", "machine": machine.key, "feature": body.feature, "number": number})
    return Created(row)


def found_in(
    kind: str,
    inputs: dict[str, object],
    method: str | None,
    tolerance: float | None,
    repeatability: float | None,
) -> EvaluatedForm:
    """Evaluate the inputs. Raises `Invalid` that names the wrong points and the remedy."""
    try:
        evaluated = find(kind, inputs, method, tolerance, repeatability)
    except (Degenerate, WrongSection, DatumRefused) as refusal:
        raise wording.refused(refusal, kind, inputs) from None
    details = evaluated.result["details"]
    sections = [*details.get("sections", ()), *details.get("datum_sections", ())]
    if any(section.get("diameter", 1.0) <= 0 for section in sections):
        raise wording.tip_too_large()
    return evaluated


def _sent_before(session: Session, machine: Machine, body: FormIn) -> Created[FormRow] | None:
    before = None if body.key is None else queries.by_key(session, machine.id, body.key)
    if before is None:
        return None
    measurement = before.measurement
    sent = (body.feature, body.kind, stored(body), *(getattr(body, name) for name in HELD))
    kept = (measurement.feature, measurement.kind, measurement.given, *(getattr(measurement, name) for name in HELD))
    return sent_before(before, body.key, _("form measurement"), same=kept == sent, number=measurement.id)


def recompute(session: Session, number: int, reason: str, caller: Caller) -> FormRow:
    """Evaluate the stored touches again; the evaluations before stay on record. Raises `NotFound`, `Invalid`."""
    before = queries.form(session, number)
    measurement = before.measurement
    evaluated = found_in(
        measurement.kind, measurement.given, measurement.method, measurement.tolerance, measurement.repeatability
    )
    session.scalars(select(FormMeasurement.id).where(FormMeasurement.id == number).with_for_update()).one()
    last = queries.form(session, number).evaluation
    session.execute(
        insert(FormEvaluation).values(
            machine_id=measurement.machine_id,
            form_id=measurement.id,
            number=last.number + 1,
            actor=caller.name,
            **evaluated._asdict(),
        )
    )
    audit(
        session,
        caller.name,
        "form computed again",
        f"form/{before.machine}/{number}",
        {"engine": last.engine, "value": last.value, "verdict": last.verdict},
        {"engine": evaluated.engine, "value": evaluated.value, "verdict": evaluated.verdict},
        reason,
    )
    publish(session, {"kind": "form", "machine": before.machine, "feature": measurement.feature, "number": number})
    return queries.form(session, number)
