"""Periodic jobs of the offsets: corrections that nobody applied expire, worn-out edges raise an alarm."""

from datetime import UTC, datetime
from typing import NamedTuple

from sqlalchemy import Select, exists, func, or_, select, true
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.core.tool_life import LifeUse, use_of
from app.db.events import publish
from app.jobs.actions import PeriodicJob, Unit
from app.loop.alarms import actions as alarms
from app.loop.characteristics.correction_queries import correction_changed
from app.loop.machines.queries import lock_machines
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Stream
from app.loop.tables.tools import OUTSTANDING, Correction, Tool
from app.loop.tools import disagreement_queries, gain_queries, wording
from app.loop.tools.alarm_kinds import TOOL_LIFE
from app.loop.tools.effect_alarm_kinds import CHARACTERISTICS_DISAGREE, UNUSUAL_GAIN
from app.loop.tools.events import alarm_raised
from app.loop.tools.lives_queries import plan_of

ACTOR = "inband"
LATELY = 15  # minutes


def expired(session: Session) -> list[Unit]:
    """Corrections that have waited longer than their machine's setting."""
    return [
        Unit(f"correction/{machine.key}/{correction.number}", (machine.id, correction.number), machine.id)
        for correction, machine in session.execute(_overdue())
    ]


def expire_correction(session: Session, unit: Unit) -> None:
    """One correction that has waited too long is superseded: the next reading decides again.

    The time runs from when it was issued, or let go by a person. Held ones wait for their alarm, however long; those that
    were fetched as program text may be in the control by now, and wait for a person to say so.
    """
    machine_id, number = unit.key
    lock_machines(session, [int(machine_id)])
    due = _overdue().where(Correction.machine_id == machine_id, Correction.number == number)
    row = session.execute(due.execution_options(populate_existing=True)).one_or_none()
    if row is None:
        return
    correction, machine = row
    before = correction.status
    correction.status, correction.decided_at, correction.decided_by = "superseded", datetime.now(UTC), None
    correction.reason = f"{wording.EXPIRED} {machine.corrections_expire_after:g}"
    record(
        session,
        ACTOR,
        "correction expired",
        f"correction/{machine.key}/{correction.number}",
        {"status": before},
        {"status": correction.status},
        wording.why(correction),
    )
    publish(session, correction_changed(session, machine, correction))


def _overdue() -> Select[Correction, Machine]:
    waiting_since = func.coalesce(Correction.decided_at, Correction.created_at)
    return (
        select(Correction, Machine)
        .join(Machine, Machine.id == Correction.machine_id)
        .where(
            Correction.status.in_(OUTSTANDING),
            Machine.corrections_expire_after.is_not(None),
            Correction.fetched_at.is_(None),
            waiting_since
            < func.clock_timestamp() - Machine.corrections_expire_after * func.make_interval(0, 0, 0, 0, 1),
        )
        .order_by(Correction.machine_id, Correction.number)
    )


def spent_tools(session: Session) -> list[Unit]:
    """Edges that have reached their planned life, without an alarm yet."""
    return [
        Unit(f"tool/{machine.key}/{tool.number}", (machine.id, tool.number), machine.id)
        for tool, machine, _parts, _use in _spent(session)
    ]


def tell_tool_life(session: Session, unit: Unit) -> None:
    """An edge that has reached its planned life raises *tool life*, once in its life."""
    machine_id, number = (int(part) for part in unit.key)
    lock_machines(session, [machine_id])
    for tool, machine, parts, use in _spent(session, machine_id, number):
        tool.life_alarm_raised = True
        alarm = alarms.raise_for_tool(
            session,
            machine.id,
            tool.number,
            TOOL_LIFE,
            {
                "by": use.spent,
                "parts": parts,
                "total": tool.total,
                "planned_parts": tool.planned_parts,
                "planned_total": tool.planned_total,
                "sister": tool.sister,
            },
        )
        publish(session, alarm_raised(machine, alarm))


class _Spent(NamedTuple):
    """A tool whose planned life is reached, without an alarm yet, and the parts that it has cut."""

    tool: Tool
    machine: Machine
    parts: int
    use: LifeUse


def _spent(session: Session, machine_id: int | None = None, number: int | None = None) -> list[_Spent]:
    """Such tools: this one, or all. One query: thousands of tools may have a plan."""
    cut = (
        select(func.max(Stream.sequence - Stream.sequence_at_tool_change))
        .where(Stream.machine_id == Tool.machine_id, Stream.tool_memory == Tool.number)
        .correlate(Tool)
        .scalar_subquery()
    )
    planned = session.execute(
        select(Tool, Machine, Tool.parts_kept + func.coalesce(cut, 0))
        .join(Machine, Machine.id == Tool.machine_id)
        .where(or_(Tool.planned_parts.is_not(None), Tool.planned_total.is_not(None)), ~Tool.life_alarm_raised)
        .where(true() if machine_id is None else Tool.machine_id == machine_id)
        .where(true() if number is None else Tool.number == number)
        .order_by(Tool.machine_id, Tool.number)
        .execution_options(populate_existing=True)
    ).all()
    judged = [
        _Spent(tool, machine, parts, use_of(plan_of(tool), parts, tool.total)) for tool, machine, parts in planned
    ]
    return [tool for tool in judged if tool.use.spent]


def corrected_tools(session: Session) -> list[Unit]:
    """Tools to which a correction was applied lately, with readings since."""
    since = func.clock_timestamp() - func.make_interval(0, 0, 0, 0, 0, LATELY)
    lately = exists().where(
        Correction.machine_id == Stream.machine_id,
        Correction.tool_memory == Stream.tool_memory,
        Correction.status == "applied",
        Correction.applied_at > since,
    )
    found = session.execute(
        select(Machine.key, Stream.machine_id, Stream.tool_memory)
        .join(Machine, Machine.id == Stream.machine_id)
        .where(Stream.tool_memory > 0, Stream.last_received_at > since, lately)
        .distinct()
        .order_by(Stream.machine_id, Stream.tool_memory)
    )
    return [Unit(f"tool/{key}/{number}", (machine_id, number), machine_id) for key, machine_id, number in found]


def tell_gain(session: Session, unit: Unit) -> None:
    """A gain that is credibly nearer to a half or to 2 than to 1 raises *unusual gain*, once until it is answered; not while it pauses the tool."""
    machine_id, number = (int(part) for part in unit.key)
    machine = session.get_one(Machine, machine_id)
    credible = [each for each in gain_queries.gains(session, machine, number) if each.gain and each.gain.verdict]
    if not credible:
        return
    lock_machines(session, [machine_id])
    if gain_queries.paused_for(session, machine_id, number) is not None:
        return
    for characteristic_id, key, factor, gain in credible:
        if gain is None or gain.verdict is None or alarms.active(session, machine_id, characteristic_id, UNUSUAL_GAIN):
            continue
        data = {
            "characteristic": key,
            "factor": factor,
            "verdict": gain.verdict.value,
            "gain": round(gain.value, 3),
            "error": round(gain.half_width, 3),
            "corrections": gain.corrections,
        }
        alarm = alarms.raise_for_characteristic(session, machine_id, characteristic_id, number, UNUSUAL_GAIN, data)
        publish(session, alarm_raised(machine, alarm) | {"characteristic": key})


def tell_disagreement(session: Session, unit: Unit) -> None:
    """Two characteristics that take each other's corrections of a tool back raise *characteristics disagree*, once until it is answered."""
    machine_id, number = (int(part) for part in unit.key)
    machine = session.get_one(Machine, machine_id)
    found = disagreement_queries.disagreement_on(session, machine_id, number)
    if found is None:
        return
    lock_machines(session, [machine_id])
    if alarms.active_of_tool(session, machine_id, number, CHARACTERISTICS_DISAGREE) is None:
        alarm = alarms.raise_for_tool(session, machine_id, number, CHARACTERISTICS_DISAGREE, found)
        publish(session, alarm_raised(machine, alarm))


JOBS = (
    PeriodicJob("gains", corrected_tools, tell_gain),
    PeriodicJob("disagreements", corrected_tools, tell_disagreement),
    PeriodicJob("corrections_expire", expired, expire_correction),
    PeriodicJob("tool_lives", spent_tools, tell_tool_life),
)
