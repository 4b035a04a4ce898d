"""Periodic job of connections: a bridge that is silent, backs up or has a quarantine raises an alarm, which ends when that is over.

An alarm that a person has acknowledged is not raised again for the same silence or the same backlog.
"""

from datetime import datetime, timedelta
from functools import partial
from typing import Any

from sqlalchemy import ColumnElement, Select, and_, func, select, union_all
from sqlalchemy import literal as value
from sqlalchemy.orm import Session

from app.db.events import publish
from app.jobs import queries as job_runs
from app.jobs.actions import PeriodicJob, Unit
from app.language.i18n import _
from app.loop.alarms import actions as alarms
from app.loop.alarms.kinds import kind_named
from app.loop.connections.alarm_kinds import BRIDGE_BACKING_UP, BRIDGE_QUARANTINE, BRIDGE_SILENT, GONE
from app.loop.connections.queries import came_late
from app.loop.machines.queries import lock_machines
from app.loop.tables.alarms import Alarm
from app.loop.tables.connections import Connection
from app.loop.tables.machines import Machine

NAME = "connections"
ACTOR = "inband"
PLACE = {"memory": "connection", "location": "bridge"}
LATELY = timedelta(minutes=5)


def job(silent_after: float) -> PeriodicJob:
    """The job; silent_after: seconds without a heartbeat after which a bridge counts as silent."""
    return PeriodicJob(
        NAME, partial(due, timedelta(seconds=silent_after)), partial(tell, timedelta(seconds=silent_after))
    )


def due(silent_after: timedelta, session: Session) -> list[Unit]:
    """Alarms to raise and alarms that are over."""
    rows = session.execute(_due(session, silent_after))
    return [Unit(f"connection/{row.machine}/{row.kind}", (row.id, row.kind, row.verb), row.id) for row in rows]


def tell(silent_after: timedelta, session: Session, unit: Unit) -> None:
    """Raise one of these alarms, or end it, if it still is due."""
    machine_id, name, verb = int(unit.key[0]), str(unit.key[1]), unit.key[2]
    lock_machines(session, [machine_id])
    if (machine_id, name, verb) not in {
        (row.id, row.kind, row.verb) for row in session.execute(_due(session, silent_after))
    }:
        return
    machine = session.get_one(Machine, machine_id)
    if verb == "raise":
        raised = alarms.raise_for_place(
            session, machine_id, kind_named(name), PLACE | _values(session.get_one(Connection, machine_id))
        )
        publish(session, alarms.news(machine.key, raised))
    else:
        end(session, machine, name, ACTOR, _("It is over"), GONE[name], **_late(session, machine, name))


def end(session: Session, machine: Machine, name: str, by: str, comment: str, outcome: str, **more: int) -> None:
    """End one of these alarms; the machine is locked. Without one nothing happens. more: numbers that the outcome says."""
    active = alarms.active_of_place(session, machine.id, kind_named(name), PLACE)
    ended = alarms.settle(session, active, by, comment, {"code": outcome, **more})
    if ended is not None:
        publish(session, alarms.news(machine.key, ended))


def _late(session: Session, machine: Machine, name: str) -> dict[str, int]:
    """The readings of a silence that is over: those that have come, and those that the bridge still keeps."""
    active = alarms.active_of_place(session, machine.id, kind_named(name), PLACE)
    connection = session.get(Connection, machine.id)
    if name != BRIDGE_SILENT.name or active is None or connection is None:
        return {}
    since = datetime.fromisoformat(active.data["received_at"])
    return {"late": came_late(session, machine.id, since, connection.received_at) + connection.waiting}


def _values(connection: Connection) -> dict[str, Any]:
    oldest = connection.oldest_waiting_at
    newest = connection.quarantine[0] if connection.quarantine else {}
    return {
        "quarantined": connection.quarantined,
        "newest": newest.get("key"),
        "characteristic": newest.get("characteristic"),
        "reason": newest.get("reason"),
        "received_at": connection.received_at.isoformat(),
        "state": connection.state,
        "waiting": connection.waiting,
        "oldest_waiting_at": oldest and oldest.isoformat(),
    }


def _due(session: Session, silent_after: timedelta) -> Select[Any]:
    """Return the kinds that are to be raised or ended, and at which machine.

    Nothing is said of silence unless this job ran a short while ago and the bridge was not heard since: while the server or
    its database is unreachable, no bridge can be heard.
    """
    run = job_runs.runs(session).get(NAME)
    silent = Connection.received_at < func.clock_timestamp() - silent_after
    heard_since = None if run is None else run.finished_at
    cases: list[Select[int, str, str, str]] = [
        _over(BRIDGE_SILENT.name, ~silent),
        _over(BRIDGE_BACKING_UP.name, Connection.backing_up_since.is_(None)),
        _begun(
            BRIDGE_BACKING_UP.name,
            Connection.backing_up_since.is_not(None),
            _since(Connection.backing_up_since),
        ),
        _over(BRIDGE_QUARANTINE.name, Connection.quarantined == 0),
        _begun(
            BRIDGE_QUARANTINE.name,
            Connection.quarantined > 0,
            Alarm.data["newest"].astext.is_not_distinct_from(Connection.quarantine[0]["key"].astext),
        ),
    ]
    if heard_since is not None:
        lately = func.clock_timestamp() - LATELY < heard_since
        cases.append(
            _begun(
                BRIDGE_SILENT.name,
                and_(silent, lately, Connection.received_at < heard_since),
                _since(Connection.received_at),
            )
        )
    every = union_all(*cases).subquery()
    return select(every).order_by(every.c.id, every.c.kind)


def _since(moment: Any) -> ColumnElement[bool]:
    """An alarm is about what goes on since this moment."""
    since: ColumnElement[bool] = (Alarm.raised_at >= moment) | Alarm.acknowledged_at.is_(None)
    return since


def _begun(name: str, condition: ColumnElement[bool], said: ColumnElement[bool]) -> Select[int, str, str, str]:
    raised = select(Alarm.id).where(
        Alarm.machine_id == Connection.machine_id,
        Alarm.characteristic_id.is_(None),
        Alarm.kind == name,
        said,
    )
    return (
        select(Machine.id, Machine.key.label("machine"), value(name).label("kind"), value("raise").label("verb"))
        .join(Connection, Connection.machine_id == Machine.id)
        .where(condition, ~raised.exists())
    )


def _over(name: str, condition: ColumnElement[bool]) -> Select[int, str, str, str]:
    return (
        select(Machine.id, Machine.key.label("machine"), value(name).label("kind"), value("end").label("verb"))
        .join(Alarm, Alarm.machine_id == Machine.id)
        .outerjoin(Connection, Connection.machine_id == Machine.id)
        .where(Alarm.kind == name, Alarm.acknowledged_at.is_(None), condition | Connection.machine_id.is_(None))
    )
