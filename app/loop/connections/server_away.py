"""Periodic job: a server that was unreachable says so at each machine that was at work then, and how many readings came late.

No bridge can be heard while the server or its database is unreachable, so nothing is said of silence then (`jobs`). This job runs once
a minute: a gap between two of its runs is that time. The alarm ends by itself when what was measured meanwhile has arrived.
"""

from datetime import datetime, timedelta
from typing import Any

from sqlalchemy import ColumnElement, and_, func, or_, select
from sqlalchemy.orm import Session

from app.db.events import publish
from app.jobs.actions import PeriodicJob, Unit
from app.jobs.tables import JobRun
from app.language.i18n import _
from app.loop.alarms import actions as alarms
from app.loop.connections.alarm_kinds import SERVER_AWAY
from app.loop.connections.jobs import ACTOR, LATELY, PLACE
from app.loop.connections.queries import came_late
from app.loop.machines.queries import lock_machines
from app.loop.tables.alarms import Alarm
from app.loop.tables.connections import Connection
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Stream

NAME = "server_away"
AT_WORK = timedelta(hours=1)
"""Before the gap: a machine of which nothing was measured for longer was not at work. Behind it: a machine without a bridge that
has sent nothing by then sends nothing of that time."""
SETTLES = timedelta(minutes=2)
"""Behind the gap: bridges reconnect and send what they have kept."""


def due(session: Session) -> list[Unit]:
    """Return the alarms to raise for the time since the last run, and those that are over."""
    now: datetime = session.scalars(select(func.clock_timestamp())).one()
    ended = [_unit(machine, "end") for machine in session.scalars(_over(now))]
    last = session.get(JobRun, NAME, populate_existing=True)
    if last is None or now - last.finished_at <= LATELY or _busy(session, last.finished_at, now):
        return ended
    working = select(Stream.machine_id).where(Stream.last_measured_at > last.finished_at - AT_WORK)
    between = (last.finished_at.isoformat(), now.isoformat())
    at_work = select(Machine).where(Machine.id.in_(working)).order_by(Machine.key)
    return [*ended, *(_unit(machine, "raise", *between) for machine in session.scalars(at_work))]


def tell(session: Session, unit: Unit) -> None:
    """Raise the alarm of one machine, or end it. While one is active, another gap makes it longer."""
    machine_id, verb = int(unit.key[0]), unit.key[1]
    lock_machines(session, [machine_id])
    machine = session.get_one(Machine, machine_id)
    active = alarms.active_of_place(session, machine_id, SERVER_AWAY, PLACE)
    if verb == "raise":
        begin, end = map(str, unit.key[2:])
        data = PLACE | {"from": active.data["from"] if active else begin, "until": end}
        if active is None or active.data["until"] != end:
            publish(session, alarms.news(machine.key, alarms.raise_for_place(session, machine_id, SERVER_AWAY, data)))
    elif active is not None:
        period = [datetime.fromisoformat(active.data[name]) for name in ("from", "until")]
        outcome: dict[str, Any] = {"code": "server_back", "late": came_late(session, machine_id, *period)}
        ended = alarms.settle(session, active, ACTOR, _("It is over"), outcome)
        if ended is not None:
            publish(session, alarms.news(machine.key, ended))


JOB = PeriodicJob(NAME, due, tell)


def _unit(machine: Machine, verb: str, *more: str) -> Unit:
    return Unit(f"connection/{machine.key}/{NAME}/{verb}", (machine.id, verb, *more), machine.id)


def _busy(session: Session, since: datetime, now: datetime) -> bool:
    """Tell if the other jobs alone took that long: then the server was there."""
    seconds = select(func.coalesce(func.sum(JobRun.seconds), 0.0)).where(JobRun.finished_at > since)
    return bool(session.scalars(seconds).one() > (now - since).total_seconds() / 2)


def _over(now: datetime) -> Any:
    """Machines whose alarm is over: the bridge is heard and nothing waits in it; without one, a reading was sent since."""
    until = func.cast(Alarm.data["until"].astext, Alarm.raised_at.type)
    sent = select(Stream.machine_id).where(Stream.machine_id == Machine.id, Stream.last_received_at > until)
    over: ColumnElement[bool] = or_(
        and_(Connection.received_at > until, Connection.waiting == 0),
        and_(Connection.machine_id.is_(None), or_(sent.exists(), until < now - AT_WORK)),
    )
    return (
        select(Machine)
        .join(Alarm, Alarm.machine_id == Machine.id)
        .outerjoin(Connection, Connection.machine_id == Machine.id)
        .where(Alarm.kind == SERVER_AWAY.name, Alarm.acknowledged_at.is_(None), until < now - SETTLES, over)
        .order_by(Machine.key)
    )
