"""What is done about offsets although nobody asks: corrections that nobody had applied expire, spent edges are told."""

from datetime import UTC, datetime

from sqlalchemy import Select, func, or_, select
from sqlalchemy.orm import Session

from app.alarms import actions as alarms
from app.audit.actions import record
from app.core.tool_life import use_of
from app.db.events import publish
from app.machines.queries import lock_machines
from app.machines.tables import Machine
from app.offsets import queries, wording
from app.offsets.lives import plan_of
from app.offsets.news import alarm_raised, correction_changed
from app.offsets.tables import OUTSTANDING, Correction, Tool

ACTOR = "inband"


def expire_corrections(session: Session) -> None:
    """Corrections that have waited longer than their machine's setting are superseded: the next reading decides anew.

    The time runs from when a correction was issued, or let go by a person. Held ones wait for their alarm, however long;
    those that were fetched as program text may be in the control by now, and wait for somebody to say so.
    """
    due = _overdue()
    machines = set(session.scalars(due.with_only_columns(Correction.machine_id).order_by(None)))
    if not machines:
        return
    lock_machines(session, machines)
    changes, now = [], datetime.now(UTC)
    for correction, machine in session.execute(due.execution_options(populate_existing=True)).all():
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


def tell_tool_lives(session: Session) -> None:
    """An edge that has reached its planned life raises *tool life*, once in its life."""
    spent = _spent(session)
    if not spent:
        return
    lock_machines(session, {tool.machine_id for tool, _machine in spent})
    changes = []
    for tool, machine in _spent(session):
        parts = queries.parts_cut(session, machine.id, tool.number)
        use = use_of(plan_of(tool), parts, tool.total)
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


def _spent(session: Session) -> list[tuple[Tool, Machine]]:
    """The tools whose planned life is reached and was not told yet."""
    planned = session.execute(
        select(Tool, Machine)
        .join(Machine, Machine.id == Tool.machine_id)
        .where(or_(Tool.planned_parts.is_not(None), Tool.planned_total.is_not(None)), ~Tool.life_told)
        .order_by(Tool.machine_id, Tool.number)
        .execution_options(populate_existing=True)
    ).all()
    return [
        (tool, machine)
        for tool, machine in planned
        if use_of(plan_of(tool), queries.parts_cut(session, machine.id, tool.number), tool.total).spent
    ]
