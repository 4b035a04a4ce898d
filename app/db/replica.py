"""A copy of the database that heavy reading is done on, so that it does not disturb the server that is written to.

Nothing is written on it. It lags behind, so how far it has got is looked at each second, and what a person must see – their
own change, the event that made a page look again – is asked of it before it is read. Where it has not got that, is unreachable, or
lags too far, the server that is written to is read.
"""

import contextlib
import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from sqlalchemy import text
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from app.db.connections import Connections, in_schema
from app.db.engine import Database

if TYPE_CHECKING:
    from app.settings import Settings

EVERY = 1.0
"""Seconds between two looks at how far it has got."""
WAIT = 0.2
"""Seconds that one who must see something waits for it here, before the other server is read."""
REST = 5.0
"""Seconds in which it is not read after it has failed a query."""

_WRITTEN = text("SELECT (pg_current_wal_flush_lsn() - '0/0')::bigint")
# A server that has been promoted meanwhile has everything that is written to it.
_REPLAYED = text(
    "SELECT (CASE WHEN pg_is_in_recovery() THEN pg_last_wal_replay_lsn() ELSE pg_current_wal_flush_lsn() END - '0/0')::bigint"
)
_NEWEST_EVENT = text("SELECT coalesce(max(id), 0) FROM event")

log = logging.getLogger(__name__)


class MustSee(NamedTuple):
    """Needs of a request: the place in the log of the database that its own change ends at, and the number of an event."""

    written: int = 0
    event: int = 0


class Replica:
    """The copy, as one process sees it. behind: seconds that it lags; None if it is not known or away."""

    def __init__(
        self,
        url: str,
        primary: Database,
        *,
        pool_size: int,
        most_behind: float,
        overflow: int | None = None,
        waited: Callable[[float], object] | None = None,
    ) -> None:
        """pool_size, overflow, waited: as of `Database`; most_behind: seconds beyond which it is not read."""
        self.primary = primary
        self.most_behind = most_behind
        self.connections = Connections(url, primary.connections.patience, of_several="prefer-standby")
        self.database = Database(
            url,
            pool_size=pool_size,
            overflow=overflow,
            connections=self.connections,
            copy_of=primary,
            waited=waited,
        )
        self.behind: float | None = None
        self._not_before = 0.0
        self._read: bool | None = None
        self._samples: deque[tuple[float, int]] = deque()
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Begin to look each second."""
        self.connections.start()
        self._thread = threading.Thread(target=self._watch, name="replica watch", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End that, and the connections."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join(self.connections.patience)
        self.database.close()
        self.connections.stop()

    @property
    def usable(self) -> bool:
        """Tell if it may be read."""
        return self.behind is not None and self.behind <= self.most_behind and time.monotonic() >= self._not_before

    def in_words(self) -> str:
        """The state of it, as a short sentence."""
        if self.behind is None:
            return "away; the server that is written to is read"
        return f"{self.behind:.1f} s behind" + ("" if self.usable else "; the server that is written to is read")

    def begin(self, must_see: MustSee) -> Session | None:
        """Begin a session that reads here; None where the server that is written to has to be read."""
        if not self.usable:
            return None
        session = self.database.sessions()
        try:
            deadline = time.monotonic() + WAIT
            while not _has(session, must_see):
                if time.monotonic() > deadline:
                    session.close()
                    return None
                session.rollback()
                time.sleep(WAIT / 8)
        except SQLAlchemyError as error:
            session.close()
            self.failed(error)
            return None
        return session

    def failed(self, error: Exception) -> None:
        """Leave it alone for a while: it is unreachable, or has ended a query because what it read was about to go."""
        self._not_before = time.monotonic() + REST
        self._say(str(getattr(error, "orig", error)).split("\n", 1)[0])

    def written(self) -> int:
        """The place in the log up to which everything has been written by now. Raises what SQLAlchemy raises."""
        with self.primary.begin() as session:
            return int(session.scalar(_WRITTEN) or 0)

    def _watch(self) -> None:
        while not self._ending.wait(EVERY):
            self.look()

    def look(self) -> None:
        """Look how far it has got."""
        with contextlib.suppress(SQLAlchemyError):  # others tell of it; the lag is counted from what is known
            self._samples.append((time.monotonic(), self.written()))
        try:
            with self.database.begin() as session:
                replayed = int(session.scalar(_REPLAYED) or 0)
        except SQLAlchemyError as error:
            self.behind = None
            self._say(str(getattr(error, "orig", error)).split("\n", 1)[0])
            return
        while self._samples and self._samples[0][1] <= replayed:
            self._samples.popleft()
        self.behind = time.monotonic() - self._samples[0][0] if self._samples else 0.0
        self._say(f"it is {self.behind:.0f} s behind")

    def _say(self, why: str) -> None:
        """Log when it begins to be read, and when it ends."""
        if self._read is self.usable:
            return
        if self.usable:
            log.info("charts, reports and searches read the replica: %s", self.connections.place)
        else:
            log.warning("charts, reports and searches read the server that is written to, not the replica: %s", why)
        self._read = self.usable


def replica_of(
    settings: "Settings",
    primary: Database,
    *,
    pool_size: int | None = None,
    waited: Callable[[float], object] | None = None,
) -> Replica | None:
    """The copy that the settings name, not watched yet; None where they name none. pool_size, waited: as of `Database`."""
    if settings.read_database_url is None:
        return None
    url = settings.read_database_url
    return Replica(
        in_schema(url, settings.schema_name) if settings.schema_name is not None else url,
        primary,
        pool_size=pool_size or settings.pool_size,
        overflow=settings.pool_overflow,
        most_behind=settings.read_most_behind,
        waited=waited,
    )


def _has(session: Session, must_see: MustSee) -> bool:
    return int(session.scalar(_REPLAYED) or 0) >= must_see.written and (
        not must_see.event or int(session.scalar(_NEWEST_EVENT) or 0) >= must_see.event
    )
