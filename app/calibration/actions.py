"""Calibrating, accepting what was found, and planning; pairs are in `comparing`. Lengths in mm.

Every verb locks the machine first: of two who accept at once one wins, and the other is told who it was.
"""

from collections.abc import Sequence
from datetime import UTC, datetime
from itertools import pairwise
from typing import Any, NamedTuple

from sqlalchemy import func, select
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.alarms import actions as alarms
from app.audit.actions import record as audit
from app.calibration import queries, wording
from app.calibration.queries import CalibrationRow, Place
from app.calibration.schemas import GaugeIn, PlanIn, RingIn
from app.calibration.tables import CalibrationAcceptance, CalibrationPlan, CalibrationRecord
from app.core.calibration import Gauge, Outcome, Ring, Section, calibrate, centre
from app.core.probing import TouchError
from app.core.zones import nanometres
from app.db.events import publish
from app.errors import Conflict, FieldError, Invalid
from app.machines.queries import lock_machines
from app.machines.tables import Machine
from app.offsets import actions as offsets
from app.people.callers import Caller
from app.readings.tables import Stream
from app.web.i18n import _

OVERDUE, REFUSED = "calibration_overdue", "calibration_refused"


class Made(NamedTuple):
    """A calibration or a pair; again: it was sent before with the same key, and nothing happened now."""

    row: CalibrationRow
    again: bool = False


def calibrate_gauge(session: Session, machine: Machine, given: GaugeIn, caller: Caller) -> Made:
    """Calibrate against a gauge (L92). A refused one is kept as well and changes nothing.

    Raises `NotFound`; `Invalid` for limits out of order or a wrong count; `Conflict` for a key that was used otherwise.
    """
    lock_machines(session, [machine.id])
    place = Place("average", given.average_memory)
    gauge = _gauge(given)
    settings = given.model_dump(exclude={"touches", "calibrated_at", "key", "average_memory"}, exclude_none=True)
    settings["repeats"] = len(given.touches)
    if (before := _sent_before(session, machine, place, given.key, settings, given.touches)) is not None:
        return before
    if given.repeats is not None and given.repeats != len(given.touches):
        wrong = wording.missing_touch(given.repeats, len(given.touches))
        raise Invalid(f"touches: {wrong}.", _("Send one touch per repeat."), errors=[FieldError("touches", wrong)])
    value = queries.value_of(session, machine, place)
    average = queries.running_average(session, machine, place, value)
    done = calibrate(gauge, given.touches, empirical_value=value, average=average)
    if done.repeat is not None:
        settings["at"] = done.repeat
    made = CalibrationRecord(
        kind="gauge",
        outcome=done.outcome,
        settings=settings | {"spread": done.spread},
        touches=given.touches,
        size=done.size,
        measured=done.measured,
        difference=done.difference,
        average=done.average,
        value_before=value,
        proposed=done.proposed,
    )
    return _keep(session, machine, place, made, given.calibrated_at, given.key, caller)


def _gauge(given: GaugeIn) -> Gauge:
    order = (("R33", "zero_range"), ("R34", "averaging_limit"), ("R36", "confidence_limit"))
    for (low, lower), (high, higher) in pairwise(order):
        if nanometres(getattr(given, lower)) >= nanometres(getattr(given, higher)):
            wrong = _("{high} = {larger} must be larger than {low} = {smaller}").format(
                high=high, larger=f"{getattr(given, higher):g}", low=low, smaller=f"{getattr(given, lower):g}"
            )
            raise Invalid(f"{higher}: {wrong}.", _("R33 < R34 < R36 must hold."), errors=[FieldError(higher, wrong)])
    return Gauge(
        given.gauge_size,
        given.zero_range,
        given.averaging_limit,
        given.confidence_limit,
        given.weighting_factor,
        given.path_factor,
    )


def calibrate_ring(session: Session, machine: Machine, given: RingIn, caller: Caller) -> Made:
    """Calibrate the X offset of a probe in a ring on the spindle. Raises as `calibrate_gauge` does."""
    lock_machines(session, [machine.id])
    place = Place("tool", given.tool_memory)
    smallest, largest = given.nominal + given.lower_deviation, given.nominal + given.upper_deviation
    if given.lower_deviation > given.upper_deviation:
        wrong = _("ES (#506) must not be smaller than EI (#507)")
        raise Invalid(f"upper_deviation: {wrong}.", errors=[FieldError("upper_deviation", wrong)])
    settings = given.model_dump(exclude={"sections", "calibrated_at", "key", "tool_memory"})
    settings |= {"smallest": round(smallest, 9), "largest": round(largest, 9)}
    touches = [[section.plus, section.minus] for section in given.sections]
    if (before := _sent_before(session, machine, place, given.key, settings, touches)) is not None:
        return before
    value = queries.value_of(session, machine, place)
    try:
        done = centre(
            Ring(smallest, largest, given.radius_term),
            [Section(*touched) for touched in touches],
            blocked=given.first_move_triggered,
        )
    except TouchError as error:
        wrong = _("{got} sections came, all inside the ring's limits; {expected} are needed").format(
            got=error.got, expected=error.expected
        )
        raise Invalid(
            f"sections: {wrong}.", _("Touch the missing sections."), errors=[FieldError("sections", wrong)]
        ) from None
    settings |= {"diameters": list(done.diameters)}
    if done.section is not None:
        settings["at"] = done.section
    moves = done.correction is not None and nanometres(done.correction) != 0
    made = CalibrationRecord(
        kind="ring",
        outcome=done.outcome,
        settings=settings,
        touches=touches,
        size=given.nominal,
        measured=round(sum(done.diameters) / len(done.diameters), 9) if done.diameters else None,
        difference=done.correction,
        value_before=value,
        proposed=round(value + (done.correction or 0.0), 9) if moves else None,
    )
    return _keep(session, machine, place, made, given.calibrated_at, given.key, caller)


def _sent_before(
    session: Session, machine: Machine, place: Place, key: str | None, settings: dict[str, Any], touches: Sequence[Any]
) -> Made | None:
    found = None if key is None else queries.by_key(session, machine, key)
    if found is None:
        return None
    same = {name: found.record.settings.get(name) for name in settings} == settings
    if same and found.record.touches == list(touches) and Place(found.record.memory, found.record.location) == place:
        return Made(found, again=True)
    raise Conflict(
        _("Calibration {number} was sent with the key {key} already, and with other values.").format(
            number=found.record.number, key=repr(key)
        ),
        _("A key names one calibration for ever: use another one."),
        number=found.record.number,
    )


def _keep(
    session: Session,
    machine: Machine,
    place: Place,
    made: CalibrationRecord,
    at: datetime | None,
    key: str | None,
    caller: Caller,
) -> Made:
    """Store it; what follows from it follows at once."""
    made.machine_id, made.number = machine.id, queries.next_number(session, machine)
    made.memory, made.location, made.refused = place.memory, place.location, Outcome(made.outcome).refused
    made.calibrated_at, made.key, made.actor = at or datetime.now(UTC), key, caller.name
    session.add(made)
    session.flush()
    changes = [news(machine, made)]
    about = {"memory": place.memory, "location": place.location}
    if made.refused:
        if caller.kind != "person":  # a person sees the refusal; a machine may have nobody beside it
            alarm = alarms.raise_for_place(session, machine.id, REFUSED, about | wording.values_of(made))
            changes.append(alarms.news(machine.key, alarm))
    else:
        changes += end_alarms(session, machine, made)
        count_anew(session, machine, place, made.calibrated_at)
        plan = session.get(CalibrationPlan, (machine.id, *place), populate_existing=True)
        if made.proposed is not None and plan is not None and plan.acceptance == "automatic":
            put_into_effect(session, machine, made, _("by itself, as planned"), caller, automatic=True)
    if caller.kind == "person":
        after = {"outcome": made.outcome, "difference": made.difference, "proposed": made.proposed}
        audit(session, caller.name, "calibrated", f"calibration/{machine.key}/{made.number}", None, after)
    publish(session, *changes)
    return Made(queries.calibration(session, machine, made.number))


def end_alarms(session: Session, machine: Machine, made: CalibrationRecord) -> list[dict[str, Any]]:
    """End the alarms that asked for a calibration."""
    about = {"memory": made.memory, "location": made.location}
    comment = _("Calibration {number}").format(number=made.number)
    outcome = {"code": "calibrated", "number": made.number}
    ended = [
        alarms.settle_for_place(session, machine.id, kind, about, made.actor, comment, outcome)
        for kind in (OVERDUE, REFUSED)
    ]
    return [alarms.news(machine.key, alarm) for alarm in ended if alarm is not None]


def count_anew(session: Session, machine: Machine, place: Place, since: datetime) -> None:
    """Parts and days until the next calibration begin at 0."""
    counts = {
        str(row.characteristic_id): row.sequence
        for row in session.execute(
            select(Stream.characteristic_id, Stream.sequence).where(Stream.machine_id == machine.id)
        )
    }
    fresh: dict[str, Any] = {"since": since, "counts": counts, "told": False}
    latest = func.greatest(CalibrationPlan.since, since)  # one that comes in late does not make the last one older
    session.execute(
        insert(CalibrationPlan)
        .values(machine_id=machine.id, memory=place.memory, location=place.location, **fresh)
        .on_conflict_do_update(index_elements=["machine_id", "memory", "location"], set_=fresh | {"since": latest})
    )


def put_into_effect(
    session: Session, machine: Machine, made: CalibrationRecord, reason: str, caller: Caller, *, automatic: bool = False
) -> None:
    """Set the empirical value or the offset to what was proposed, and keep who accepted it and why."""
    assert made.proposed is not None
    session.add(
        CalibrationAcceptance(
            machine_id=machine.id, number=made.number, actor=caller.name, reason=reason, automatic=automatic
        )
    )
    session.flush()
    why = _("Calibration {number}: {reason}").format(number=made.number, reason=reason)
    if made.memory == "average":
        offsets.set_empirical_value(session, machine, made.location, made.proposed, why, caller)
    else:
        offsets.edit_tool(session, machine, made.location, made.proposed, why, caller)


def accept(session: Session, machine: Machine, number: int, reason: str, caller: Caller) -> CalibrationRow:
    """What the calibration proposes comes into effect: the empirical value is set (M = 0), or the probe's offset.

    Raises `NotFound`; `Conflict` when there is nothing to accept (any more), saying who was first.
    """
    lock_machines(session, [machine.id])
    row = queries.calibration(session, machine, number)
    if row.status != "proposed":
        raise Conflict(*wording.cannot_accept(row), calibration_status=row.status)
    put_into_effect(session, machine, row.record, reason, caller)
    publish(session, news(machine, row.record))
    return queries.calibration(session, machine, number)


def news(machine: Machine, made: CalibrationRecord) -> dict[str, Any]:
    """What live pages are told of a calibration."""
    return {
        "kind": "calibration",
        "machine": machine.key,
        ("average_memory" if made.memory == "average" else "tool"): made.location,
        "number": made.number,
    }


# --- plan


def set_plan(session: Session, machine: Machine, place: Place, given: PlanIn, caller: Caller) -> CalibrationPlan:
    """How often to calibrate this place, and whether what is found comes into effect by itself. Raises `NotFound`."""
    lock_machines(session, [machine.id])
    queries.value_of(session, machine, place)
    plan = session.get(CalibrationPlan, (machine.id, *place), populate_existing=True)
    wanted = given.model_dump()
    if plan is None:
        count_anew(session, machine, place, datetime.now(UTC))
        plan = session.get_one(CalibrationPlan, (machine.id, *place), populate_existing=True)
    before = {name: getattr(plan, name) for name in wanted}
    for name, value in wanted.items():
        setattr(plan, name, value)
    plan.told = False
    session.flush()
    subject = f"calibration-plan/{machine.key}/{place.memory}/{place.location}"
    audit(session, caller.name, "calibration planned", subject, before, wanted)
    publish(session, {"kind": "calibration", "machine": machine.key})
    return plan
