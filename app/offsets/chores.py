"""What is done about offsets although nobody asks: corrections that nobody had applied expire, spent edges are told."""

from datetime import UTC, datetime
from typing import NamedTuple

from sqlalchemy import Select, func, or_, select, true
from sqlalchemy.orm import Session

from app.alarms import actions as alarms
from app.audit.actions import record
from app.core.tool_life import Use, use_of
from app.db.events import publish
from app.machines.queries import lock_machines
from app.machines.tables import Machine
from app.offsets import wording
from app.offsets.lives import plan_of
from app.offsets.news import alarm_raised, correction_changed
from app.offsets.tables import OUTSTANDING, Correction, Tool
from app.readings.tables import Stream

ACTOR = "inband"
MOST = 50  # corrections that expire in one transaction: readings of the machine wait until then


def expire_corrections(session: Session) -> bool:
    """Corrections that have waited longer than their machine's setting are superseded: the next reading decides anew.

    The time runs from when a correction was issued, or let go by a person. Held ones wait for their alarm, however long;
    those that were fetched as program text may be in the control by now, and wait for somebody to say so.
    One machine at a time, so that its readings wait for no other: True when there may be more.
    """
    due = _overdue().limit(MOST)
    found = session.scalar(due.with_only_columns(Correction.machine_id).limit(1))
    if found is None:
        return False
    lock_machines(session, [found])
    changes, now = [], datetime.now(UTC)
    of_it = due.where(Correction.machine_id == found).execution_options(populate_existing=True)
    for correction, machine in session.execute(of_it).all():
        hours = f"{machine.corrections_expire_after:g}"
        before = correction.status
        correction.status, correction.decided_at, correction.decided_by = "superseded", now, None
        correction.reason = f"{wording.EXPIRED} {hours}"
        record(
            session,
            ACTOR,
            "correction expired",
            f"correction/{machine.key}/{correction.number}",
            {"status": before},
            {"status": correction.status},
            wording.why(correction),
        )
        changes.append(correction_changed(session, machine, correction))
    if changes:
        publish(session, *changes)
    return True


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


def tell_tool_lives(session: Session) -> bool:
    """An edge that has reached its planned life raises *tool life*, once in its life.

    One machine at a time: True when there may be more.
    """
    spent = _spent(session)
    if not spent:
        return False
    found = spent[0].machine.id
    lock_machines(session, [found])
    changes = []
    for tool, machine, parts, use in _spent(session, found):
        tool.life_told = True
        alarm = alarms.raise_for_tool(
            session,
            machine.id,
            tool.number,
            "tool_life",
            {
                "by": use.spent,
                "parts": parts,
                "total": tool.total,
                "planned_parts": tool.planned_parts,
                "planned_total": tool.planned_total,
                "sister": tool.sister,
            },
        )
        changes.append(alarm_raised(machine, alarm))
    if changes:
        publish(session, *changes)
    return True


class _Spent(NamedTuple):
    """A tool whose planned life is reached and was not told yet, with the parts that it has cut."""

    tool: Tool
    machine: Machine
    parts: int
    use: Use


def _spent(session: Session, machine_id: int | None = None) -> list[_Spent]:
    """Such tools of this machine, or of all. One query: thousands of tools may have a plan."""
    cut = (
        select(func.max(Stream.sequence - Stream.sequence_at_tool_change))
        .where(Stream.machine_id == Tool.machine_id, Stream.tool_memory == Tool.number)
        .correlate(Tool)
        .scalar_subquery()
    )
    planned = session.execute(
        select(Tool, Machine, Tool.parts_kept + func.coalesce(cut, 0))
        .join(Machine, Machine.id == Tool.machine_id)
        .where(or_(Tool.planned_parts.is_not(None), Tool.planned_total.is_not(None)), ~Tool.life_told)
        .where(true() if machine_id is None else Tool.machine_id == machine_id)
        .order_by(Tool.machine_id, Tool.number)
        .execution_options(populate_existing=True)
    ).all()
    judged = [
        _Spent(tool, machine, parts, use_of(plan_of(tool), parts, tool.total)) for tool, machine, parts in planned
    ]
    return [each for each in judged if each.use.spent]
