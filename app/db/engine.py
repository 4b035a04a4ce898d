"""SQLAlchemy's engine on our connections."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, cast

from sqlalchemy import create_engine
from sqlalchemy.orm import Session, sessionmaker

from app.db.connections import LIMITS, Connections, plain_url

if TYPE_CHECKING:
    from psycopg import Connection


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
    ) -> None:
        """pool_size: connections kept open. overflow: how many more there may be at once; as many again if left out, -1: any.

        connections: those of the process, if they are watched; else some of its own, which are not. copy_of: where what is read
        here is written.
        """
        self.dsn = plain_url(url)
        """For psycopg itself and PostgreSQL's programs. Holds the password; not for logs."""
        self.connections = connections or Connections(url)
        self.copy_of = copy_of
        self.engine = create_engine(
            "postgresql+psycopg://",
            creator=lambda: self.connections.connect(options=LIMITS, application_name=application_name),
            pool_size=pool_size,
            max_overflow=pool_size if overflow is None else overflow,
            pool_pre_ping=True,  # a restarted database costs one retry here, not one failed page per connection
        )
        self.sessions = sessionmaker(self.engine, expire_on_commit=False, info={"database": self})

    @contextmanager
    def begin(self) -> Iterator[Session]:
        """One transaction: committed when the block ends, rolled back when it raises."""
        with self.sessions.begin() as session:
            yield session

    def close(self) -> None:
        self.engine.dispose()


def driver_connection(session: Session) -> "Connection[Any]":
    """The driver's own connection of a session, in the same transaction; what the session still holds back is written first."""
    session.flush()
    return cast("Connection[Any]", session.connection().connection.driver_connection)


def database_of(session: Session) -> Database:
    """The database that a session was begun on."""
    info: dict[Any, Any] = session.info
    return cast("Database", info["database"])
