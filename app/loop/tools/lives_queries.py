"""The lives of the edges in one location of the tool memory: parts cut, corrections summed, how long each lasted."""

from datetime import datetime, timedelta
from typing import NamedTuple

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.core.tool_life import LifePlan, LifeUse, use_of, usual_life
from app.loop.characteristics.queries import parts_cut
from app.loop.tables.machines import Machine
from app.loop.tables.tools import Tool, ToolEvent
from app.loop.tools import queries

MOST_LIVES = 50  # that are looked at for what is usual


class Life(NamedTuple):
    """One edge from its tool change to the next. total: sum of its corrections, mm.

    began_at is None where nobody recorded how it came in, ended_at while it is in; who and why are of the end.
    """

    number: int
    began_at: datetime | None
    ended_at: datetime | None
    parts: int
    total: float | None
    edge: str | None
    name: str | None
    actor: str | None = None
    reason: str | None = None

    def lasted(self, now: datetime) -> timedelta | None:
        """Time from tool change to tool change, or to now; None if the change is not known."""
        return None if self.began_at is None else (self.ended_at or now) - self.began_at


class Lives(NamedTuple):
    """Newest first; the first is the present one. usual: median parts of those that ended. use: of the planned life."""

    tool: Tool
    lives: list[Life]
    usual: float | None
    use: LifeUse

    @property
    def present(self) -> Life:
        return self.lives[0]


def plan_of(tool: Tool) -> LifePlan:
    return LifePlan(tool.planned_parts, tool.planned_total)


def lives(session: Session, machine: Machine, number: int, *, limit: int = MOST_LIVES) -> Lives:
    """The present edge of this location and those before it. Raises `NotFound`."""
    tool = queries.tool(session, machine, number)
    parts = parts_cut(session, machine.id, number)
    changes = list(
        session.scalars(
            select(ToolEvent)
            .where(ToolEvent.machine_id == machine.id, ToolEvent.number == number, ToolEvent.kind == "change")
            .order_by(ToolEvent.id.desc())
            .limit(limit + 1)
        )
    )
    ended = changes[:limit]
    began = [*(change.at for change in changes[1:]), None]
    all_lives = [Life(0, tool.changed_at, None, parts, tool.total, tool.edge, tool.name)]
    all_lives += [
        Life(
            number=back,
            began_at=since,
            ended_at=change.at,
            parts=change.parts or 0,
            total=change.total,
            edge=change.edge,
            name=change.name,
            actor=change.actor,
            reason=change.reason,
        )
        for back, (change, since) in enumerate(zip(ended, began, strict=False), start=1)
    ]
    usual = usual_life([life.parts for life in all_lives[1:] if life.parts > 0])
    return Lives(tool, all_lives, usual, use_of(plan_of(tool), parts, tool.total))
