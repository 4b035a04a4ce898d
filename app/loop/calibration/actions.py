"""Calibrate, accept the result, and plan the next calibration; pairs are in `pairs`. Lengths in mm.

Every verb locks the machine first: of two simultaneous acceptances one wins, and the other gets a `Conflict` that names
the first.
"""

from collections.abc import Sequence
from datetime import UTC, datetime
from itertools import pairwise, takewhile
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.access.audit.actions import record as audit
from app.access.callers import Caller
from app.core.calibration import (
    Centring,
    Gauge,
    Outcome,
    Ring,
    Section,
    calibrate,
    centre,
    diameter,
    gauge_in_inches,
    ring_in_inches,
    untouched,
)
from app.core.decision.limits import nanometres
from app.core.plausibility import empirical_value_warnings, offset_warnings
from app.core.probing import TouchError
from app.core.warning import CodedWarning, as_stored
from app.db.events import publish
from app.errors import Conflict, FieldError, Invalid
from app.language.i18n import _
from app.loop.alarms import actions as alarms
from app.loop.calibration import queries, wording
from app.loop.calibration.alarm_kinds import OVERDUE, REFUSED
from app.loop.calibration.queries import CalibrationRow, Place
from app.loop.calibration.schemas import CalibrationPlanIn, GaugeIn, RingIn
from app.loop.machines.queries import lock_machines
from app.loop.tables.calibration import CalibrationAcceptance, CalibrationPlan, CalibrationRecord
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Stream
from app.loop.tools import actions as tool_actions
from app.web.created import Created, sent_before


def _must_have(last: int, field: str, number: int) -> None:
    """Raises `Invalid` for a location that the machine does not have."""
    if number > last:
        raise Invalid.at(field, _("this machine has {last} locations").format(last=last))


def calibrate_gauge(session: Session, machine: Machine, given: GaugeIn, caller: Caller) -> Created[CalibrationRow]:
    """Calibrate against a gauge (L92). A refused one is kept as well and changes nothing.

    Raises `NotFound`; `Invalid` for limits out of order or too many touches; `Conflict` for a key that was used otherwise.
    """
    lock_machines(session, [machine.id])
    _must_have(machine.average_locations, "average_memory", given.average_memory)
    _must_have(machine.tool_locations, "tool_memory", given.tool_memory or 1)
    place = Place("average", given.average_memory)
    gauge = _gauge(given)
    settings = given.model_dump(exclude={"touches", "calibrated_at", "key", "average_memory"}, exclude_none=True)
    settings["repeats"] = max(given.repeats or 1, len(given.touches))
    if (before := _sent_before(session, machine, place, given.key, settings, given.touches)) is not None:
        return before
    if given.repeats is not None and given.repeats < len(given.touches):
        raise Invalid.at(
            "touches", wording.missing_touch(given.repeats, len(given.touches)), do=_("Send one touch per repeat.")
        )
    value = queries.value_of(session, machine, place)
    touches = [touch for touch in given.touches if touch is not None]
    if (at := untouched(given.touches, given.repeats)) is not None:
        record = CalibrationRecord(
            kind="gauge",
            outcome=Outcome.NO_TOUCH,
            settings=settings | {"at": at},
            touches=given.touches,
            size=gauge.size,
            value_before=value,
        )
        return _keep(session, machine, place, record, given.calibrated_at, given.key, caller)
    average = queries.running_average(session, machine, place, value)
    done = calibrate(gauge, touches, empirical_value=value, average=average)
    if done.repeat is not None:
        settings["at"] = done.repeat
    warnings = gauge_in_inches(gauge.size, touches, queries.known_sizes(session, machine, place))
    warnings += [] if done.proposed is None else empirical_value_warnings(done.proposed)
    record = CalibrationRecord(
        kind="gauge",
        outcome=done.outcome,
        settings=settings | {"spread": done.spread} | _kept(warnings),
        touches=touches,
        size=done.size,
        measured=done.measured,
        difference=done.difference,
        average=done.average,
        value_before=value,
        proposed=done.proposed,
    )
    return _keep(session, machine, place, record, given.calibrated_at, given.key, caller)


def _gauge(given: GaugeIn) -> Gauge:
    order = (("R33", "zero_range"), ("R34", "averaging_limit"), ("R36", "confidence_limit"))
    for (low, lower), (high, higher) in pairwise(order):
        if nanometres(getattr(given, lower)) >= nanometres(getattr(given, higher)):
            raise Invalid.at(
                higher,
                _("{high} = {larger} must be larger than {low} = {smaller}").format(
                    high=high, larger=f"{getattr(given, higher):g}", low=low, smaller=f"{getattr(given, lower):g}"
                ),
                do=_("R33 < R34 < R36 must hold."),
            )
    return Gauge(
        given.gauge_size,
        given.zero_range,
        given.averaging_limit,
        given.confidence_limit,
        given.weighting_factor,
        given.path_factor,
    )


def calibrate_ring(session: Session, machine: Machine, given: RingIn, caller: Caller) -> Created[CalibrationRow]:
    """Calibrate the X offset of a probe in a ring on the spindle. Raises as `calibrate_gauge` does."""
    lock_machines(session, [machine.id])
    _must_have(machine.tool_locations, "tool_memory", given.tool_memory)
    place = Place("tool", given.tool_memory)
    smallest, largest = given.nominal + given.lower_deviation, given.nominal + given.upper_deviation
    if given.lower_deviation > given.upper_deviation:
        raise Invalid.at("upper_deviation", _("ES (#506) must not be smaller than EI (#507)"))
    if given.nominal <= 0:
        raise Invalid.at(
            "nominal",
            _("a ring has a diameter: its nominal size must be larger than 0 mm"),
            do=_("State the size of the ring."),
        )
    settings = given.model_dump(exclude={"sections", "calibrated_at", "key", "tool_memory"})
    settings |= {"smallest": round(smallest, 9), "largest": round(largest, 9)}
    touches = [[section.plus, section.minus] for section in given.sections]
    exchanged = [
        at for at, (plus, minus) in enumerate(touches) if plus is not None and minus is not None and plus < minus
    ]
    if exchanged:
        wrong = _("the touch in +X lies below the one in −X: plus and minus are exchanged")
        fields = [FieldError(f"sections[{at}].plus", wrong) for at in exchanged]
        raise Invalid(
            f"{fields[0].field}: {wrong}.",
            _("In a ring the probe moves to larger X before it touches in +X. Exchange the two values."),
            errors=fields,
        )
    if (before := _sent_before(session, machine, place, given.key, settings, touches)) is not None:
        return before
    value = queries.value_of(session, machine, place)
    sections = [
        Section(plus, minus)
        for plus, minus in takewhile(lambda touched: None not in touched, touches)
        if plus is not None and minus is not None
    ]
    done = _centred(Ring(smallest, largest, given.radius_term), sections, given, caller)
    settings |= {"diameters": list(done.diameters)}
    if done.section is not None:
        settings["at"] = done.section
    moves = done.correction is not None and nanometres(done.correction) != 0
    proposed = round(value + (done.correction or 0.0), 9) if moves else None
    known = queries.known_sizes(session, machine, place)
    warnings = ring_in_inches(given.nominal, given.radius_term, sections, known)
    warnings += [] if proposed is None else offset_warnings(value, proposed)
    record = CalibrationRecord(
        kind="ring",
        outcome=done.outcome,
        settings=settings | _kept(warnings),
        touches=touches,
        size=given.nominal,
        measured=round(sum(done.diameters) / len(done.diameters), 9) if done.diameters else None,
        difference=done.correction,
        value_before=value,
        proposed=proposed,
    )
    return _keep(session, machine, place, record, given.calibrated_at, given.key, caller)


def _centred(ring: Ring, sections: Sequence[Section], given: RingIn, caller: Caller) -> Centring:
    """Compute the result of the sections that were touched on both sides; one that is missing is a refused calibration.

    Raises `Invalid` where a person has typed too few of them.
    """
    try:
        return centre(ring, sections, blocked=given.first_move_triggered)
    except TouchError as error:
        if caller.kind == "person" and len(sections) == len(given.sections):
            raise Invalid.at(
                "sections",
                _("{got} sections came, all inside the ring's limits; {expected} are needed").format(
                    got=error.got, expected=error.expected
                ),
                do=_("Touch the missing sections."),
            ) from None
        measured = tuple(diameter(ring, section) for section in sections)
        return Centring(Outcome.NO_TOUCH, measured, None, len(sections) + 1)


def _kept(warnings: Sequence[CodedWarning]) -> dict[str, Any]:
    """Return the warnings as a calibration keeps them among its settings."""
    return {"warnings": as_stored(warnings)} if warnings else {}


def _sent_before(
    session: Session, machine: Machine, place: Place, key: str | None, settings: dict[str, Any], touches: Sequence[Any]
) -> Created[CalibrationRow] | None:
    row = None if key is None else queries.by_key(session, machine, key)
    if row is None:
        return None
    same = {name: row.record.settings.get(name) for name in settings} == settings
    same &= row.record.touches == list(touches) and Place(row.record.memory, row.record.location) == place
    return sent_before(row, key, _("calibration"), same=same, number=row.record.number)


def _keep(
    session: Session,
    machine: Machine,
    place: Place,
    made: CalibrationRecord,
    at: datetime | None,
    key: str | None,
    caller: Caller,
) -> Created[CalibrationRow]:
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
        count_again(session, machine, place, made.calibrated_at)
        plan = queries.plan(session, machine, place)
        sure = not made.settings.get("warnings")  # what may be wrong is for a person to accept
        if made.proposed is not None and sure and plan is not None and plan.acceptance == "automatic":
            put_into_effect(session, machine, made, _("applied automatically, as planned"), caller, automatic=True)
    if caller.kind == "person":
        after = {"outcome": made.outcome, "difference": made.difference, "proposed": made.proposed}
        audit(session, caller.name, "calibrated", f"calibration/{machine.key}/{made.number}", None, after)
    publish(session, *changes)
    return Created(queries.calibration(session, machine, made.number))


def end_alarms(session: Session, machine: Machine, made: CalibrationRecord) -> list[dict[str, Any]]:
    """End the alarms that asked for a calibration."""
    about = {"memory": made.memory, "location": made.location}
    comment = _("Calibration {number}").format(number=made.number)
    outcome = {"code": "calibrated", "number": made.number}
    active = [alarms.active_of_place(session, machine.id, kind, about) for kind in (OVERDUE, REFUSED)]
    ended = [alarms.settle(session, alarm, made.actor, comment, outcome) for alarm in active]
    return [alarms.news(machine.key, alarm) for alarm in ended if alarm is not None]


def count_again(session: Session, machine: Machine, place: Place, since: datetime) -> None:
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
        tool_actions.set_empirical_value(session, machine, made.location, made.proposed, why, caller)
    else:
        tool_actions.edit_tool(session, machine, made.location, made.proposed, why, caller)


def accept(session: Session, machine: Machine, number: int, reason: str, caller: Caller) -> CalibrationRow:
    """Put into effect what a calibration proposes: set the empirical value (M = 0), or the probe's offset.

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
    """The event of a calibration for live pages."""
    return {
        "kind": "calibration",
        "machine": machine.key,
        ("average_memory" if made.memory == "average" else "tool"): made.location,
        "number": made.number,
    }


# --- plan


def set_plan(
    session: Session, machine: Machine, place: Place, given: CalibrationPlanIn, caller: Caller
) -> CalibrationPlan:
    """Plan how often to calibrate this place, and if its results are applied automatically. Raises `NotFound`."""
    lock_machines(session, [machine.id])
    plan = queries.plan(session, machine, place)
    settings = given.model_dump()
    if plan is None:
        count_again(session, machine, place, datetime.now(UTC))
        plan = session.get_one(CalibrationPlan, (machine.id, *place), populate_existing=True)
    before = {name: getattr(plan, name) for name in settings}
    for name, value in settings.items():
        setattr(plan, name, value)
    plan.alarm_raised = False
    session.flush()
    subject = f"calibration-plan/{machine.key}/{place.memory}/{place.location}"
    audit(session, caller.name, "calibration planned", subject, before, settings)
    publish(session, {"kind": "calibration", "machine": machine.key})
    return plan
