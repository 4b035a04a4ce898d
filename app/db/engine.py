"""Connections to PostgreSQL."""

from collections.abc import Iterator
from contextlib import contextmanager

from sqlalchemy import URL, create_engine, make_url
from sqlalchemy.orm import Session, sessionmaker

LIMITS = "-c timezone=UTC -c lock_timeout=10s -c statement_timeout=60s -c idle_in_transaction_session_timeout=60s"
"""A query that hangs must not hold a machine's lock for ever. Work that needs longer says ``SET LOCAL``."""


def psycopg_url(url: str | URL) -> URL:
    """A plain ``postgresql://`` (or ``postgres://``) address, with our driver."""
    if isinstance(url, str) and url.startswith("postgres://"):
        url = "postgresql" + url.removeprefix("postgres")
    return make_url(url).set(drivername="postgresql+psycopg")


class Database:
    """One PostgreSQL database, seen from one process.

    Not to be carried across a fork: make one per process and ``close()`` it at the end.
    """

    def __init__(
        self, url: str | URL, *, pool_size: int = 10, overflow: int | None = None, application_name: str = "inband"
    ) -> None:
        """pool_size: connections kept open. overflow: how many more there may be at once; as many again if left out, -1: any."""
        self.url = psycopg_url(url)
        self.engine = create_engine(
            self.url,
            pool_size=pool_size,
            max_overflow=pool_size if overflow is None else overflow,
            pool_pre_ping=True,  # a restarted database costs one retry here, not one failed page per connection
            connect_args={"options": LIMITS, "connect_timeout": 5, "application_name": application_name},
        )
        self.sessions = sessionmaker(self.engine, expire_on_commit=False)

    @property
    def dsn(self) -> str:
        """For psycopg itself: ``psycopg.connect(database.dsn)``. Holds the password; not for logs."""
        return self.url.set(drivername="postgresql").render_as_string(hide_password=False)

    @contextmanager
    def begin(self) -> Iterator[Session]:
        """One transaction: committed when the block ends, rolled back when it raises."""
        with self.sessions.begin() as session:
            yield session

    def close(self) -> None:
        self.engine.dispose()
