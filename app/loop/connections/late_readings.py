"""Periodic job: readings of a machine that came late in a bunch raise an alarm: from when to when they were measured, how many.

So it is where the network of a machine fails and the server is there. While a bridge is silent or backs up, or the server was
unreachable, the alarm about that says it. Only what was measured after a reading that came in time counts: a clock that is wrong and
history that is sent as readings are no network that failed.
"""

from datetime import datetime, timedelta
from typing import Any

from sqlalchemy import Interval, Select, func, literal, or_, select
from sqlalchemy.orm import Session, aliased

from app.db.events import publish
from app.jobs.actions import PeriodicJob, Unit
from app.jobs.tables import JobRun
from app.loop.alarms import actions as alarms
from app.loop.connections.alarm_kinds import BRIDGE_BACKING_UP, BRIDGE_SILENT, READINGS_LATE, SERVER_AWAY
from app.loop.connections.jobs import LATELY, PLACE
from app.loop.connections.queries import LATE
from app.loop.machines.queries import lock_machines
from app.loop.tables.alarms import Alarm
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Reading, ReadingContext

NAME = "late_readings"
BUNCH, WITHIN = 2, timedelta(minutes=10)
"""Readings, and the time in which they come: one by one, too, as a network that comes and goes lets them through."""
AT_WORK = timedelta(days=1)
"""Before the first that came late: a reading came in time."""


def due(session: Session) -> list[Unit]:
    """Return the alarms to raise for what has come since the last run, with those just before it that no alarm has counted."""
    last = session.get(JobRun, NAME, populate_existing=True)
    if last is None:
        return []
    found = session.execute(_late(last.finished_at)).all()
    return [
        Unit(f"connection/{machine.key}/{NAME}", (machine.id, begin.isoformat(), end.isoformat(), count), machine.id)
        for machine, begin, end, count in found
        if _came_in_time(session, machine.id, begin) and not _said(session, machine.id, begin)
    ]


def tell(session: Session, unit: Unit) -> None:
    """Raise the alarm of one machine. While one is active, more of them make it longer."""
    machine_id, begin, end, count = int(unit.key[0]), str(unit.key[1]), str(unit.key[2]), int(unit.key[3])
    lock_machines(session, [machine_id])
    machine = session.get_one(Machine, machine_id)
    active = alarms.active_of_place(session, machine_id, READINGS_LATE, PLACE)
    before: dict[str, Any] = {"from": begin, "until": "", "late": 0} if active is None else active.data
    if before["until"] < end:
        data = PLACE | {"from": min(before["from"], begin), "until": end, "late": before["late"] + count}
        publish(session, alarms.news(machine.key, alarms.raise_for_place(session, machine_id, READINGS_LATE, data)))


JOB = PeriodicJob(NAME, due, tell)


def _late(since: datetime) -> Select[Machine, datetime, datetime, int]:
    alarms_of = (Alarm.machine_id == Reading.machine_id, Alarm.kind == READINGS_LATE.name)
    counted = select(func.max(Alarm.last_at)).where(*alarms_of).scalar_subquery()
    active = select(Alarm.id).where(*alarms_of, Alarm.acknowledged_at.is_(None))
    by_hand = select(ReadingContext.sequence).where(
        ReadingContext.machine_id == Reading.machine_id,
        ReadingContext.characteristic_id == Reading.characteristic_id,
        ReadingContext.sequence == Reading.sequence,
        ReadingContext.context["by_hand"].as_boolean(),
    )
    late = (
        select(
            Reading.machine_id,
            func.min(Reading.measured_at).label("begin"),
            func.max(Reading.measured_at).label("end"),
            func.count().label("late"),
        )
        .where(
            Reading.received_at > since - WITHIN,
            Reading.received_at > func.coalesce(counted, since - WITHIN),
            Reading.received_at > Reading.measured_at + literal(LATELY, Interval),
            Reading.code != "imported",
            ~by_hand.exists(),
        )
        .group_by(Reading.machine_id)
        .having(or_(func.count() >= BUNCH, active.exists()), func.max(Reading.received_at) > since)
        .subquery()
    )
    return (
        select(Machine, late.c.begin, late.c.end, late.c.late)
        .join(late, late.c.machine_id == Machine.id)
        .order_by(Machine.key)
    )


def _came_in_time(session: Session, machine_id: int, begin: datetime) -> bool:
    """Tell if a reading came in time before the first that came late."""
    timely = aliased(Reading)
    in_time = select(timely.sequence).where(
        timely.machine_id == machine_id,
        timely.received_at.between(begin - AT_WORK, begin),
        timely.received_at <= timely.measured_at + literal(LATE, Interval),
    )
    return bool(session.scalar(select(in_time.exists())))


def _said(session: Session, machine_id: int, begin: datetime) -> bool:
    """Tell if another alarm says of that time that nothing could come."""
    kinds = [kind.name for kind in (SERVER_AWAY, BRIDGE_SILENT, BRIDGE_BACKING_UP)]
    said = select(Alarm.id).where(Alarm.machine_id == machine_id, Alarm.kind.in_(kinds), Alarm.raised_at >= begin)
    return bool(session.scalar(select(said.exists())))
