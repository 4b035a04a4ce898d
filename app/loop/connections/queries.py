"""Queries of connections. Never writes."""

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import NamedTuple

from sqlalchemy import Interval, Select, func, literal, select, text
from sqlalchemy.orm import Session

from app.db.text import holds_words
from app.errors import NotFound
from app.language.i18n import _
from app.loop.tables.connections import Connection
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Reading

LATE = timedelta(minutes=1)

# Functions beside a table: where Citus is, the node that holds the plant answers. Numbers are given by the sequence, which
# is asked by itself: it lies where Inband is connected to. The journal alone would not do: it keeps some hours.
_SERVER = text("""
SELECT CAST((pg_control_system()).system_identifier AS text),
    CAST('x' || left(pg_walfile_name(pg_current_wal_insert_lsn()), 8) AS bit(32))::int, coalesce(max(id), 0)
FROM event
""")
_NUMBER = text("SELECT coalesce(pg_sequence_last_value('event_id_seq'::regclass), 0)")


class ServerMark(NamedTuple):
    """Mark of a database: PostgreSQL's system identifier, its timeline, the number of the last event."""

    system: str
    timeline: int
    last_event: int


class ConnectionRow(NamedTuple):
    """A connection, its machine, and the database's time at which it was looked at."""

    connection: Connection
    machine: Machine
    now: datetime

    @property
    def age(self) -> float:
        """Seconds since the last heartbeat."""
        return max(0.0, (self.now - self.connection.received_at).total_seconds())

    def silent(self, after: timedelta) -> bool:
        """Tell if nothing was heard for longer than that."""
        return self.now - self.connection.received_at > after

    @property
    def oldest_waiting(self) -> float | None:
        """Age of the oldest reading that waits, s."""
        oldest = self.connection.oldest_waiting_at
        return None if oldest is None else max(0.0, (self.now - oldest).total_seconds())


def server_mark(session: Session) -> ServerMark:
    """Return the mark of the database as it is now, in some hundredths of a millisecond."""
    system, timeline, last_event = session.execute(_SERVER).one()
    return ServerMark(system, timeline, max(last_event, session.scalar(_NUMBER) or 0))


def _rows() -> Select[Connection, Machine, datetime]:
    return (
        select(Connection, Machine, func.clock_timestamp())
        .join(Machine, Machine.id == Connection.machine_id)
        .execution_options(populate_existing=True)
    )


def connections(
    session: Session, after: str = "", limit: int | None = None, only: int | None = None, holding: str = ""
) -> Sequence[ConnectionRow]:
    """The connections by the key of their machine; ``only`` this one for the key of a machine.

    ``holding``: those in whose machine, kind, version or last error these words are found.
    """
    names = (Machine.name, Machine.key, Connection.kind, Connection.version, Connection.error)
    query = _rows().where(*holds_words(holding, *names)).where(Machine.key > after).order_by(Machine.key).limit(limit)
    query = query if only is None else query.where(Machine.id == only)
    return [ConnectionRow(*row) for row in session.execute(query)]


def find_connection(session: Session, machine_id: int) -> ConnectionRow | None:
    """The connection of a machine; None for one that never had a heartbeat."""
    row = session.execute(_rows().where(Machine.id == machine_id)).one_or_none()
    return None if row is None else ConnectionRow(*row)


def connection_of(session: Session, machine: Machine) -> ConnectionRow:
    """The connection of a machine. Raises `NotFound`."""
    row = find_connection(session, machine.id)
    if row is None:
        raise NotFound(
            _("Machine {machine} has no connection: no bridge has sent a heartbeat for it.").format(
                machine=machine.key
            ),
            _("Start the bridge with this machine in its configuration, or look at another machine."),
        )
    return row


def came_late(session: Session, machine_id: int, begin: datetime, end: datetime) -> int:
    """Return how many readings of a machine were measured in this time and came more than a minute later. Imports do not count."""
    late = select(func.count()).where(
        Reading.machine_id == machine_id,
        Reading.received_at >= begin,
        Reading.measured_at.between(begin, end),
        Reading.received_at > Reading.measured_at + literal(LATE, Interval),
        Reading.code != "imported",
    )
    return session.scalars(late).one()
