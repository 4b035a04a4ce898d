"""Periodic job: corrections of a tool that the machine does not take raise an alarm, which ends by itself.

Parts go on being cut with the offset of before, and each further correction is decided as if the earlier ones were in it. It
shows by what a bridge says that it holds back, by corrections in a row of one characteristic, or by parts that were measured
long after the correction. What waited while the server itself was unreachable is not held against the machine.
"""

import time
from collections.abc import Callable, Sequence
from datetime import datetime, timedelta
from typing import Any, NamedTuple

from sqlalchemy import ColumnElement, Row, func, or_, select
from sqlalchemy.orm import Session

from app.db.events import publish
from app.jobs.actions import PeriodicJob, Unit
from app.language.i18n import _
from app.loop.alarms import actions as alarms
from app.loop.machines.queries import lock_machines
from app.loop.tables.alarms import Alarm
from app.loop.tables.connections import Connection
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Stream
from app.loop.tables.tools import Correction
from app.loop.tools.alarm_kinds import CORRECTIONS_NOT_TAKEN
from app.loop.tools.events import alarm_raised

NAME = "corrections_not_taken"
ACTOR = "inband"
LATELY = 300.0  # s without a run of the job: the server was unreachable
SETTLES = timedelta(minutes=5)
"""Time that a machine has for corrections in a row: as many may come at once, when a backlog of readings arrives."""


class Untaken(NamedTuple):
    """Pending corrections of a tool. waiting: how many; most: of one characteristic; first, since: the oldest; last: the newest; measured: its last part.

    reason: why its bridge holds them back, if it says so and not because of a hold. said: what it says of the control, and nothing
    of other tools. bridge: the machine has one; carried: which brings corrections.
    """

    machine_id: int
    machine: str
    tool: int
    waiting: int
    most: int
    first: int
    last: int
    since: datetime
    measured: datetime | None
    reason: str | None
    said: str | None
    bridge: bool
    carried: bool
    now: datetime


class Watch:
    """The job. within: s in which a machine that cuts parts has to take a correction; most: in a row, of one characteristic.

    up_for: s since when this server looks without a gap.
    """

    def __init__(self, within: float, most: int, clock: Callable[[], float] = time.monotonic) -> None:
        self.within, self.most, self.clock = timedelta(seconds=within), most, clock
        self.up_for = 0.0
        self._ran: float | None = None

    def job(self) -> PeriodicJob:
        return PeriodicJob(NAME, self.due, self.tell)

    def due(self, session: Session) -> list[Unit]:
        """Alarms to raise, and alarms that are over."""
        now = self.clock()
        since = None if self._ran is None else now - self._ran
        self.up_for = 0.0 if since is None or since > LATELY else self.up_for + since
        self._ran = now
        return [
            Unit(f"tool/{machine}/{tool}", (machine_id, tool, verb), machine_id)
            for machine_id, machine, tool, verb in self._found(session)
        ]

    def tell(self, session: Session, unit: Unit) -> None:
        """Raise one of these alarms, or end it, if it still is due."""
        machine_id, tool, verb = int(unit.key[0]), int(unit.key[1]), unit.key[2]
        lock_machines(session, [machine_id])
        if (machine_id, tool, verb) not in {(at, number, what) for at, _machine, number, what in self._found(session)}:
            return
        machine = session.get_one(Machine, machine_id)
        if verb == "raise":
            [waiting] = [each for each in untaken(session, machine_id) if each.tool == tool]
            raised = alarms.raise_for_tool(session, machine_id, tool, CORRECTIONS_NOT_TAKEN, _values(waiting))
            publish(session, alarm_raised(machine, raised))
        else:
            active = alarms.active_of_tool(session, machine_id, tool, CORRECTIONS_NOT_TAKEN)
            ended = alarms.settle(session, active, ACTOR, _("It is over"), {"code": "corrections_taken"})
            if ended is not None:
                publish(session, alarms.news(machine.key, ended))

    def _found(self, session: Session) -> list[tuple[int, str, int, str]]:
        waiting = untaken(session)
        conditions: list[ColumnElement[bool]] = [Alarm.acknowledged_at.is_(None)]
        if waiting:
            conditions.append(Alarm.raised_at >= min(each.since for each in waiting))
        raised = (
            select(Alarm, Machine.key)
            .join(Machine, Machine.id == Alarm.machine_id)
            .where(Alarm.kind == CORRECTIONS_NOT_TAKEN.name, or_(*conditions))
            .order_by(Alarm.id)
            .execution_options(populate_existing=True)
        )
        recent: dict[tuple[int, int], tuple[Alarm, str]] = {}
        for alarm, machine in session.execute(raised):
            recent[alarm.machine_id, alarm.tool_memory or 0] = alarm, machine
        found = []
        for each in waiting:
            last, _machine = recent.get((each.machine_id, each.tool), (None, ""))
            known = last is not None and (last.acknowledged_at is None or last.raised_at >= each.since)
            if not known and self._is_late(each, each.now - timedelta(seconds=self.up_for)):
                found.append((each.machine_id, each.machine, each.tool, "raise"))
        late = {(each.machine_id, each.tool) for each in waiting if self._is_late(each, each.since)}
        found += [
            (machine_id, machine, tool, "end")
            for (machine_id, tool), (alarm, machine) in recent.items()
            if alarm.acknowledged_at is None and (machine_id, tool) not in late
        ]
        return found

    def _is_late(self, waiting: Untaken, up_since: datetime) -> bool:
        """up_since: what waited before counts from then on."""
        waited = waiting.now - max(waiting.since, up_since)
        cut = waiting.measured is not None and waiting.measured - waiting.since >= self.within
        in_a_row = waiting.most >= self.most and waited >= min(self.within, SETTLES)
        return waiting.reason is not None or in_a_row or (cut and waited >= self.within)


def untaken(session: Session, machine_id: int | None = None) -> list[Untaken]:
    """Tools with corrections that are pending and that nobody has fetched as program text, of this machine or of all."""
    since = func.min(func.coalesce(Correction.decided_at, Correction.created_at))
    place = (Correction.machine_id, Correction.tool_memory)
    each = (
        select(
            *place,
            func.count().label("waiting"),
            func.min(Correction.number).label("first"),
            func.max(Correction.number).label("last"),
            since.label("since"),
        )
        .where(Correction.status == "pending", Correction.fetched_at.is_(None))
        .group_by(*place, Correction.characteristic_id)
        .subquery()
    )
    tools = (
        select(
            each.c.machine_id,
            each.c.tool_memory,
            func.sum(each.c.waiting).label("waiting"),
            func.max(each.c.waiting).label("most"),
            func.min(each.c.first).label("first"),
            func.max(each.c.last).label("last"),
            func.min(each.c.since).label("since"),
        )
        .group_by(each.c.machine_id, each.c.tool_memory)
        .subquery()
    )
    measured = (
        select(func.max(Stream.last_measured_at))
        .where(Stream.machine_id == tools.c.machine_id, Stream.tool_memory == tools.c.tool_memory)
        .scalar_subquery()
    )
    query = (
        select(tools, Machine.key, measured.label("measured"), Connection.held_back, Connection.hold_all)
        .add_columns(Connection.locations, Connection.detail, func.clock_timestamp().label("now"))
        .join(Machine, Machine.id == tools.c.machine_id)
        .outerjoin(Connection, Connection.machine_id == tools.c.machine_id)
        .order_by(tools.c.machine_id, tools.c.tool_memory)
    )
    if machine_id is not None:
        query = query.where(tools.c.machine_id == machine_id)
    return [_untaken(row) for row in session.execute(query)]


def _untaken(row: Row[Any]) -> Untaken:
    held_back: Sequence[dict[str, Any]] = () if row.hold_all else row.held_back or ()
    reason = next((each["reason"] for each in held_back if each["tool_memory"] == row.tool_memory), None)
    return Untaken(
        machine_id=row.machine_id,
        machine=row.key,
        tool=row.tool_memory,
        waiting=int(row.waiting),
        most=row.most,
        first=row.first,
        last=row.last,
        since=row.since,
        measured=row.measured,
        reason=reason,
        said=_of_this_tool(row),
        bridge=row.hold_all is not None,
        carried=any(place.get("corrected", True) for place in row.locations or ()),
        now=row.now,
    )


def _of_this_tool(row: Row[Any]) -> str | None:
    """Return what the bridge says without why it holds corrections of other tools back."""
    held_back: Sequence[dict[str, Any]] = row.held_back or ()
    own = {each["reason"] for each in held_back if each["tool_memory"] == row.tool_memory}
    said = row.detail or ""
    for of_other in {each["reason"] for each in held_back} - own:
        said = said.replace(of_other, "")
    return " ".join(said.split()) or None


def _values(waiting: Untaken) -> dict[str, Any]:
    return {
        "waiting": waiting.waiting,
        "first": waiting.first,
        "last": waiting.last,
        "since": waiting.since.isoformat(),
        "reason": waiting.reason,
        "said": waiting.said,
        "bridge": waiting.bridge,
        "carried": waiting.carried,
    }
