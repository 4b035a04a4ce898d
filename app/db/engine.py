"""SQLAlchemy's engine on our connections."""

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic, perf_counter
from typing import TYPE_CHECKING, Any, cast

from psycopg import OperationalError
from sqlalchemy import PoolProxiedConnection, QueuePool, create_engine, event
from sqlalchemy.exc import InvalidatePoolError
from sqlalchemy.orm import Session, sessionmaker
from sqlalchemy.pool import ConnectionPoolEntry

from app.db.connections import LIMITS, Connections, plain_url

if TYPE_CHECKING:
    from psycopg import Connection

LATELY = 1.0
"""Seconds after its last use in which a connection is taken without a question, unless the server has ended it."""

logging.getLogger(f"{__name__}.Pool").setLevel(logging.WARNING)  # SQLAlchemy names what it logs of a pool by its class


class Pool(QueuePool):
    """Connections kept open, which says how long one waits for one of them."""

    waited: Callable[[float], object] | None = None
    _ended = False

    def dispose(self) -> None:
        """Close the connections: those that nobody has now, the others when they are given back."""
        self._ended = True
        super().dispose()

    def _do_return_conn(self, record: ConnectionPoolEntry) -> None:
        record.info["used_at"] = monotonic()
        if self._ended:
            record.close()
        super()._do_return_conn(record)

    def connect(self) -> PoolProxiedConnection:
        """Take a connection that works, once there is one."""
        began = perf_counter()
        try:
            return super().connect()
        finally:
            if self.waited is not None:
                self.waited(perf_counter() - began)


class Database:
    """One PostgreSQL database, seen from one process.

    Not to be carried across a fork: make one per process and ``close()`` it at the end.
    """

    def __init__(
        self,
        url: str,
        *,
        pool_size: int = 10,
        overflow: int | None = None,
        application_name: str = "inband",
        connections: Connections | None = None,
        copy_of: "Database | None" = None,
        waited: Callable[[float], object] | None = None,
    ) -> None:
        """pool_size: connections kept open. overflow: how many more there may be at once; as many again if left out, -1: any.

        connections: those of the process, if they are watched; else some of its own, which are not. copy_of: where what is read
        here is written. waited: gets the seconds after which a caller had a connection, or had none.
        """
        self.dsn = plain_url(url)
        """For psycopg itself and PostgreSQL's programs. Holds the password; not for logs."""
        self.connections = connections or Connections(url)
        self.copy_of = copy_of
        self.engine = create_engine(
            "postgresql+psycopg://",
            creator=lambda: self.connections.connect(options=LIMITS, application_name=application_name),
            poolclass=Pool,
            pool_size=pool_size,
            max_overflow=pool_size if overflow is None else overflow,
        )
        event.listen(self.engine, "checkout", self._try_out)
        cast("Pool", self.engine.pool).waited = waited
        self.sessions = sessionmaker(self.engine, expire_on_commit=False, info={"database": self})

    @contextmanager
    def begin(self) -> Iterator[Session]:
        """One transaction: committed when the block ends, rolled back when it raises.

        ``commit()`` inside gives the connection back for a while; what follows is a transaction of its own.
        """
        with self.sessions() as session:
            yield session
            session.commit()

    def close(self) -> None:
        self.engine.dispose()

    def _try_out(self, connection: Any, record: ConnectionPoolEntry, _proxy: object) -> None:
        """Ask before a connection is taken: a restarted database costs one retry here, not one failed page per connection.

        Of one that was used a moment ago it is enough that nothing came in since, as the end would. A new one is not asked.
        """
        used_at = record.info.get("used_at")
        if used_at is None or (monotonic() - used_at < LATELY and connection.seems_open()):
            return
        try:
            self.engine.dialect.do_ping(connection)
        except OperationalError as error:
            raise InvalidatePoolError from error


def driver_connection(session: Session) -> "Connection[Any]":
    """The driver's own connection of a session, in the same transaction; what the session still holds back is written first."""
    session.flush()
    return cast("Connection[Any]", session.connection().connection.driver_connection)


def database_of(session: Session) -> Database:
    """The database that a session was begun on."""
    info: dict[Any, Any] = session.info
    return cast("Database", info["database"])
