"""Taking heartbeats, and removing the connection of a machine that has no bridge any more.

A heartbeat takes no lock of the machine and waits for no disk: what a crash loses of it comes again in ten seconds.
"""

from datetime import datetime, timedelta
from typing import Any, NamedTuple

from sqlalchemy import case, delete, func, select, text, update
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.db.events import publish
from app.language.i18n import _
from app.loop.connections import jobs, queries
from app.loop.connections.alarm_kinds import GONE
from app.loop.connections.queries import ServerMark
from app.loop.connections.schemas import HeartbeatIn
from app.loop.connections.touch_tests.actions import abandon
from app.loop.connections.touch_tests.queries import TouchTestRow, open_test
from app.loop.machines.queries import lock_machines, machine_for, machine_named
from app.loop.tables.connections import Connection, MachineRun

GOOD = ("starting", "online")
SAME_RUN = timedelta(minutes=1)
"""Between two heartbeats that say that the control runs: one may be lost, and a part is changed."""
KEPT = timedelta(days=30)
_NO_DISK = text("SELECT set_config('synchronous_commit', 'off', true), now()")


class Beat(NamedTuple):
    """A heartbeat that was taken: when, where the database stands, and the touch test that is open."""

    received_at: datetime
    server: ServerMark
    touch_test: TouchTestRow | None


def take_heartbeat(
    session: Session, machine: str, beat: HeartbeatIn, caller: Caller, *, silent_after: float, backlog_after: float
) -> Beat:
    """Keep what a bridge tells of itself, in place of what it reported before.

    An event is published only when what people look at has changed: the state, the hold, the quarantine, or that it was
    silent or backs up. silent_after, backlog_after: s. Raises `NotFound`; `NotAllowed` for the key of another machine.
    """
    owner = machine_for(session, caller, machine, "operator")
    _off, now = session.execute(_NO_DISK).one()
    known = session.execute(
        select(
            Connection.state,
            Connection.hold_all,
            Connection.quarantined,
            Connection.received_at,
            Connection.backing_up_since,
        ).where(Connection.machine_id == owner.id)
    ).one_or_none()
    values = _values(beat, now, backlog_after)
    row = insert(Connection).values(machine_id=owner.id, **values)
    new = row.excluded
    changed = {name: new[name] for name in values} | {
        "since": case((Connection.state == new.state, Connection.since), else_=new.since),
        "error": func.coalesce(new.error, Connection.error),
        "error_at": func.coalesce(new.error_at, Connection.error_at),
        "backing_up_since": case(
            (new.backing_up_since.is_(None), None),
            else_=func.coalesce(Connection.backing_up_since, new.backing_up_since),
        ),
    }
    session.execute(row.on_conflict_do_update(index_elements=["machine_id"], set_=changed))
    if beat.running:
        _note_run(session, owner.id, now)
    if (
        known is None
        or (known.state, known.hold_all, known.quarantined) != (beat.state, beat.hold_all, beat.quarantined)
        or (known.backing_up_since is None) != (values["backing_up_since"] is None)
        or now - known.received_at > timedelta(seconds=silent_after)
    ):
        publish(session, {"kind": "connection", "machine": owner.key, "state": beat.state})
    return Beat(now, queries.server_mark(session), open_test(session, owner))


def _note_run(session: Session, machine_id: int, now: datetime) -> None:
    """Note that the control runs: the run goes on, or after a pause another begins. What is old goes."""
    of = MachineRun.machine_id == machine_id
    goes_on = update(MachineRun).where(of, MachineRun.until > now - SAME_RUN).values(until=now)
    if not session.execute(goes_on.returning(MachineRun.begin)).first():
        session.execute(delete(MachineRun).where(of, MachineRun.until < now - KEPT))
        session.execute(insert(MachineRun).values(machine_id=machine_id, begin=now, until=now).on_conflict_do_nothing())


def remove_connection(session: Session, machine: str, caller: Caller) -> None:
    """Forget the connection of a machine that has no bridge any more, and end its alarms.

    Harmless if there is none. A bridge that still reports creates it again. Raises `NotFound`.
    """
    owner = machine_named(session, machine)
    lock_machines(session, [owner.id])
    gone = session.scalar(delete(Connection).where(Connection.machine_id == owner.id).returning(Connection.received_at))
    abandon(session, owner, caller)
    for name in GONE:
        jobs.end(session, owner, name, caller.name, _("The machine has no bridge any more"), "connection_removed")
    if gone is not None:
        record(session, caller.name, "connection removed", f"machine/{owner.key}", {"heard": gone.isoformat()}, None)
        publish(session, {"kind": "connection", "machine": owner.key, "state": None})


def _values(beat: HeartbeatIn, now: datetime, backlog_after: float) -> dict[str, Any]:
    """The columns of a heartbeat. The age of the oldest reading is the bridge's; its time here is by the server's clock."""
    oldest = beat.oldest_waiting_at if beat.waiting else None
    if oldest is not None and beat.sent_at is not None:
        oldest = now - (beat.sent_at - oldest)
    late = oldest is not None and now - oldest > timedelta(seconds=backlog_after)
    error = beat.detail or None if beat.state not in GOOD else None
    return {
        "received_at": now,
        "state": beat.state,
        "since": now,
        "detail": beat.detail or None,
        "error": error,
        "error_at": now if error else None,
        "version": beat.version,
        "kind": beat.kind,
        "started_at": beat.started_at,
        "waiting": beat.waiting,
        "oldest_waiting_at": oldest,
        "backing_up_since": now if late or beat.state == "full" else None,
        "quarantined": beat.quarantined,
        "quarantine": [each.model_dump(mode="json") for each in beat.quarantine],
        "clock_offset": beat.clock_offset,
        "mapping": beat.mapping,
        "hold_all": beat.hold_all,
        "identity": beat.identity,
        "locations": [each.model_dump(mode="json") for each in beat.locations],
        "held_back": [each.model_dump(mode="json") for each in beat.held_back],
        "carries_decisions": beat.carries_decisions,
    }
