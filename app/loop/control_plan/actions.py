"""Setting a control plan, and keeping it: missed measurements are put on record, raise an alarm, and end."""

from datetime import UTC, datetime
from typing import Any

from sqlalchemy import update
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.core.control_plan import Due, Judged, Plan, Ran
from app.db.events import publish
from app.language.i18n import _
from app.loop.alarms import actions as alarms
from app.loop.characteristics.queries import characteristic_named
from app.loop.control_plan import queries
from app.loop.control_plan.alarm_kinds import CONTEXT_MISSING, MISSED
from app.loop.control_plan.queries import Look
from app.loop.control_plan.schemas import ControlPlanIn
from app.loop.machines.queries import lock_machines
from app.loop.present_context import actions as present_context
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.control_plan import ControlPlan, MissedMeasurement
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Stream

ACTOR = "inband"


def set_plan(session: Session, key: str, given: ControlPlanIn, caller: Caller) -> ControlPlan:
    """Set the plan of a characteristic: it counts from now on, and what was missed under the old one ends. Raises `NotFound`."""
    current = characteristic_named(session, key)
    machine, characteristic = current.machine, current.characteristic
    state = lock_machines(session, [machine.id])[machine.id]
    row = queries.plan_of(session, current)
    before, after = queries.stated(row), given.plan
    if row is not None and before == after:
        state.planned = queries.any_counts_parts(session, machine.id)
        return row
    if row is None:
        row = ControlPlan(machine_id=machine.id, characteristic_id=characteristic.id)
        session.add(row)
    for name, value in _fields(after).items():
        setattr(row, name, value)
    row.changed_by, row.reason, row.since = caller.name, given.reason, datetime.now(UTC)
    row.seen = session.get_one(Stream, (machine.id, characteristic.id), populate_existing=True).sequence
    row.context_seen = row.seen
    session.flush()
    state.planned = queries.any_counts_parts(session, machine.id)
    _end(session, row, machine.key, key, by=caller.name, comment=given.reason, outcome={"code": "plan_changed"})
    _end_context(session, row, machine.key, key, by=caller.name, comment=given.reason, outcome={"code": "plan_changed"})
    old, new = _fields(before), _fields(after)
    changes = {name for name, value in new.items() if value != old[name]}
    record(
        session,
        caller.name,
        "control plan set",
        f"characteristic/{key}",
        {name: old[name] for name in changes},
        {name: new[name] for name in changes},
        given.reason,
    )
    publish(session, {"kind": "characteristic", "machine": machine.key, "characteristic": key})
    return row


def _fields(plan: Plan) -> dict[str, Any]:
    """Its fields as they are stored."""
    fields = {name: getattr(plan, name) for name in Plan.__dataclass_fields__}
    return fields | {"required_context": [field.value for field in plan.required_context]}


def check_plan(session: Session, machine_id: int, characteristic_id: int) -> None:
    """Look at a plan, put on record what was missed, and raise or end the alarm. Done again it changes nothing.

    The machine is locked only where an alarm begins or ends: no reading waits for the rest.
    """
    row = session.get_one(ControlPlan, (machine_id, characteristic_id), populate_existing=True)
    found = queries.look(session, row)
    if _changes_alarm(found):
        lock_machines(session, [machine_id])
        session.expire_all()
        found = queries.look(session, row)
    open_, late = found.open, found.late
    characteristic = session.get_one(Characteristic, (machine_id, characteristic_id))
    machine = session.get_one(Machine, machine_id)
    if open_ is not None and found.sequence > open_.after:
        closing = next((each for each in late if each.after == open_.after), None)
        if closing is not None:
            _known(open_, closing.ran)
            late = [each for each in late if each is not closing]
        measured = closing.until if closing and closing.until else found.sequence
        outcome = {"code": "measured", "sequence": measured}
        _end(session, row, machine.key, characteristic.key, by=ACTOR, comment=_("Measured again"), outcome=outcome)
        open_ = None
    for each in late:
        missed = _missed(row, each.after, each.judged, each.ran)
        missed.until, missed.ended_at = each.until, datetime.now(UTC)
        session.add(missed)
    if open_ is not None:
        _known(open_, found.since)
    elif found.judged.due is Due.MISSED:
        _raise(session, found, machine.key, characteristic.key)
    session.execute(
        update(ControlPlan)
        .where(
            ControlPlan.machine_id == machine_id,
            ControlPlan.characteristic_id == characteristic_id,
            ControlPlan.since == row.since,
        )
        .values(seen=found.seen)
        .execution_options(synchronize_session=False)
    )
    if late:
        publish(session, {"kind": "characteristic", "machine": machine.key, "characteristic": characteristic.key})


def check_context(session: Session, machine_id: int, characteristic_id: int) -> None:
    """Look whether the newest readings say what the plan requires of their context; raise the alarm, or end it.

    It ends with readings of which none lacks anything. The machine is locked only where there is an alarm.
    """
    row = session.get_one(ControlPlan, (machine_id, characteristic_id), populate_existing=True)
    lacking = queries.lacking(session, row, row.context_seen)
    if lacking.newest <= row.context_seen:
        return
    if lacking.fields or alarms.active(session, machine_id, characteristic_id, CONTEXT_MISSING):
        lock_machines(
            session, [machine_id]
        )  # no reading comes in any more: those that are there get what the machine works at
        present_context.fill(session, machine_id)
        row = session.get_one(ControlPlan, (machine_id, characteristic_id), populate_existing=True)
        lacking = queries.lacking(session, row, row.context_seen)
    machine, characteristic = (
        session.get_one(Machine, machine_id),
        session.get_one(Characteristic, (machine_id, characteristic_id)),
    )
    if lacking.fields:
        before = alarms.active(session, machine_id, characteristic_id, CONTEXT_MISSING)
        data = lacking.as_data(before.data if before else {})
        alarm = alarms.raise_for_characteristic(session, machine_id, characteristic_id, None, CONTEXT_MISSING, data)
        publish(session, alarms.news(machine.key, alarm) | {"characteristic": characteristic.key})
    else:
        outcome = {"code": "complete", "sequence": lacking.newest}
        _end_context(
            session, row, machine.key, characteristic.key, by=ACTOR, comment=_("Complete again"), outcome=outcome
        )
    row.context_seen = lacking.newest


def _end_context(
    session: Session, row: ControlPlan, machine: str, characteristic: str, *, by: str, comment: str, outcome: Any
) -> None:
    """End the alarm about missing context; without any nothing happens."""
    active = alarms.active(session, row.machine_id, row.characteristic_id, CONTEXT_MISSING)
    ended = alarms.settle(session, active, by, comment, outcome)
    if ended is not None:
        publish(session, alarms.news(machine, ended) | {"characteristic": characteristic})


def _changes_alarm(found: Look) -> bool:
    if found.open is not None:
        return found.sequence > found.open.after
    return found.judged.due is Due.MISSED


def _missed(row: ControlPlan, after: int, verdict: Judged, ran: Ran) -> MissedMeasurement:
    missed = MissedMeasurement(
        machine_id=row.machine_id,
        characteristic_id=row.characteristic_id,
        after=after,
        every=verdict.every,
        by=verdict.by.value if verdict.by else None,
    )
    _known(missed, ran)
    return missed


def _known(missed: MissedMeasurement, ran: Ran) -> None:
    # Minutes that a control reported do not count any more once another part is measured; those of the record stay.
    missed.parts, missed.minutes, missed.shifts = ran.parts, max(ran.minutes, missed.minutes or 0.0), ran.shifts


def _raise(session: Session, found: Look, machine: str, characteristic: str) -> None:
    """Put the missed measurement on record, and raise its alarm; the machine is locked."""
    row = found.row
    missed = _missed(row, found.sequence, found.judged, found.since)
    session.add(missed)
    data = {
        "by": missed.by,
        "every": missed.every,
        "minutes_planned": row.minutes if missed.by == "minutes" else None,
        "parts": missed.parts,
        "minutes": missed.minutes,
        "after": missed.after,
    }
    alarm = alarms.raise_for_characteristic(session, row.machine_id, row.characteristic_id, None, MISSED, data)
    publish(session, alarms.news(machine, alarm) | {"characteristic": characteristic})


def _end(
    session: Session, row: ControlPlan, machine: str, characteristic: str, *, by: str, comment: str, outcome: Any
) -> None:
    """End what is open, and its alarm; the machine is locked. Without any nothing happens."""
    missed = queries.open_of(session, row)
    if missed is not None:
        missed.ended_at, missed.until = datetime.now(UTC), outcome.get("sequence")
        session.flush()
    active = alarms.active(session, row.machine_id, row.characteristic_id, MISSED)
    ended = alarms.settle(session, active, by, comment, outcome)
    if ended is not None:
        publish(session, alarms.news(machine, ended) | {"characteristic": characteristic})
