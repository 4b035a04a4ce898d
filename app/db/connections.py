"""Every connection to PostgreSQL that a process makes, and the watch that lets none of them wait for ever.

A database can fall silent without a word: its process is stopped, its host is gone, a firewall swallows the packets. So
one thread asks it for a trifle at short intervals. As long as that is answered, a statement may take the time that
the server's own limits give it. When it is not answered within the patience, the database counts as silent: anyone who waits on
a connection gets an `OperationalError` within a tenth of a second, and nobody waits for a new connection until the
database has been heard again. The same befalls connections to a server that another one has replaced.

Nothing is ever cancelled on the server for that. A commit that waits for its synchronous standby has happened already, and
PostgreSQL reports the end of a wait that is cancelled as success. The connection is closed, and how it ended is asked.
"""

import asyncio
import contextlib
import logging
import select
import threading
import time
from collections.abc import Generator
from typing import Any, Self
from urllib.parse import quote, unquote

import psycopg
from psycopg import AsyncConnection, waiting
from psycopg.abc import RV, PQGen
from psycopg.conninfo import conninfo_to_dict
from psycopg.errors import OperationalError

LIMITS = "-c timezone=UTC -c lock_timeout=10s -c statement_timeout=60s -c idle_in_transaction_session_timeout=60s"
"""A query that hangs must not hold a machine's lock for ever. Work that needs longer says ``SET LOCAL``."""
PATIENCE = 5.0
"""Seconds that a caller waits for a database that does not answer, where no setting says otherwise."""
LOOK = 0.1
"""Seconds between two looks of a caller who waits, at whether the database is still heard."""
TRIFLE = "SELECT pg_postmaster_start_time()"
"""Needs no table, no lock and no disk, and tells a server from the one that has replaced it."""

_HELD_UP = {"55P03", "57014", "40P01"}

log = logging.getLogger(__name__)


def held_up(error: BaseException | None) -> bool:
    """Tell if a lock, the time of a statement or a deadlock has ended it: the database is there, other work holds what was wanted."""
    return getattr(error, "sqlstate", None) in _HELD_UP


def plain_url(url: str) -> str:
    """The address as libpq and its programs read it, whichever of our ways it was written in."""
    scheme, separator, rest = url.partition("://")
    return f"postgresql://{rest}" if separator and scheme in {"postgres", "postgresql+psycopg"} else url


def in_schema(url: str, schema: str) -> str:
    """The address of the same database with its tables in this schema, alone in the search path."""
    head, _mark, query = plain_url(url).partition("?")
    named = [part for part in query.split("&") if part]
    options = [unquote(part.removeprefix("options=")) for part in named if part.startswith("options=")]
    others = [part for part in named if not part.startswith("options=")]
    path = quote(" ".join(dict.fromkeys([*options, f"-c search_path={schema}"])), safe="")
    return f"{head}?{'&'.join([*others, f'options={path}'])}"


def parameters_of(url: str, patience: float = PATIENCE, of_several: str = "read-write") -> dict[str, Any]:
    """The parameters of libpq for an address, with our limits where it sets none itself.

    of_several: `target_session_attrs` where there are several hosts; usually the one that can be written to is taken. Raises
    psycopg's `ProgrammingError`.
    """
    named = conninfo_to_dict(plain_url(url))
    seconds = max(2, round(patience))
    hosts = max(len(str(named.get(name, "")).split(",")) for name in ("host", "hostaddr"))
    usual: dict[str, Any] = {
        "connect_timeout": max(2, int(patience * 4 / 5 / hosts)),  # for each; less than 2 the library does not know
        "keepalives_idle": seconds,
        "keepalives_interval": 2,
        "keepalives_count": 3,
        "tcp_user_timeout": seconds * 1000,  # ms; no wait for the kernel's quarter of an hour
    }
    if hosts > 1:
        usual["target_session_attrs"] = of_several
    return usual | named


class Connections:
    """The way of one process to one database; ``start`` begins the watch, without which nothing ever counts as silent."""

    def __init__(self, url: str, patience: float = PATIENCE, *, of_several: str = "read-write") -> None:
        self.patience = patience
        self.silent = False
        self.age = 0
        """Rises when connections made before are of no use any more."""
        self._parameters = parameters_of(url, patience, of_several)
        self._first: tuple[str, int] | None = None  # host and port of the first connection that was made
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    @property
    def place(self) -> str:
        """Hosts, ports and name of the database, without user and password: for the log."""
        host, port, name = (self._parameters.get(part) or "default" for part in ("host", "port", "dbname"))
        return f"{host} port {port}, database {name}"

    def start(self) -> None:
        """Begin to watch. The first question is put a moment later, so a short command never asks."""
        self._thread = threading.Thread(target=self._watch, name="database watch", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the watch."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join(self.patience)

    def connect(self, *, options: str = "", **more: Any) -> "WatchedConnection":
        """Make a connection that does not wait for a silent database. Raises `OperationalError`, at once if it is silent."""
        age = self._heard()
        connection = WatchedConnection.connect(**self._for(options, more))
        self._first = self._first or (connection.info.host, connection.info.port)
        connection.born(self, age)
        return connection

    async def connect_async(self, *, options: str = "", **more: Any) -> "WatchedAsyncConnection":
        """The same for an event loop; every statement is a transaction of its own unless one is begun."""
        age = self._heard()
        try:
            async with asyncio.timeout(self.patience):
                connection = await WatchedAsyncConnection.connect(autocommit=True, **self._for(options, more))
        except TimeoutError:
            raise OperationalError("no connection to the database could be made in time") from None
        self._first = self._first or (connection.info.host, connection.info.port)
        connection.born(self, age)
        return connection

    def check(self, age: int) -> None:
        """Raise `OperationalError` if a connection of this age is not worth waiting on any more."""
        if age != self.age or self.silent:
            raise OperationalError(f"the database has not answered for {self.patience:g} s or was replaced by another")

    def _heard(self) -> int:
        age = self.age
        self.check(age)
        return age

    def _for(self, options: str, more: dict[str, Any]) -> dict[str, Any]:
        parameters = self._parameters | more
        if options:
            parameters["options"] = f"{parameters.get('options', '')} {options}".strip()
        return parameters

    # --- the watch

    def _watch(self) -> None:
        connection: _Asking | None = None
        server: tuple[str, int, object] | None = None
        pause = interval = self.patience / 5
        while not self._ending.wait(pause):
            since = time.monotonic()
            try:
                if connection is None:
                    connection = _Asking.connect(autocommit=True, application_name="inband-watch", **self._parameters)
                    connection.limit = self.patience * 3 / 5
                row = connection.execute(TRIFLE).fetchone()
            except psycopg.Error as error:
                if connection is not None:
                    connection.pgconn.finish()
                    connection = None
                # What is refused at once needs no protection: everybody hears it for himself.
                self._fell_silent(error, silent=time.monotonic() - since > interval)
                pause = interval / 5
                continue
            answered = (connection.info.host, connection.info.port, row)
            # A host may be gone before it is asked for the first time: connections are waiting for it then.
            replaced = server != answered if server else self._first not in {None, answered[:2]}
            if replaced:
                log.warning("another database server answers now: %s port %s", *answered[:2])
                self.age += 1
            server, pause = answered, interval
            self._prefer(connection.info.host, connection.info.port)
            if self.silent:
                log.warning("the database answers again")
                self.silent = False
        if connection is not None:
            connection.close()

    def _fell_silent(self, error: psycopg.Error, *, silent: bool) -> None:
        if silent and not self.silent:
            log.error(
                "the database does not answer; requests are refused until it does: %s", str(error).split("\n", 1)[0]
            )
            self.age += 1
        self.silent = silent

    def _prefer(self, host: str, port: int) -> None:
        """Of several hosts try the one first that answered last: where another is gone, each attempt at it takes seconds."""
        names = {name: str(self._parameters.get(name, "")).split(",") for name in ("host", "hostaddr", "port")}
        count = max(map(len, names.values()))
        if count == 1:
            return
        lists = {name: values * count if len(values) == 1 else values for name, values in names.items()}
        for at in range(count):
            if host in {lists["host"][at], lists["hostaddr"][at]} and lists["port"][at] in {str(port), ""}:
                order = [at, *(other for other in range(count) if other != at)]
                self._parameters |= {
                    name: ",".join(values[place] for place in order) for name, values in lists.items() if any(values)
                }
                return


class _Asking(psycopg.Connection[Any]):
    """The connection of the watch: no answer takes longer than the limit."""

    limit: float | None = None

    def wait(self, gen: PQGen[RV], interval: float = LOOK, timeout: float | None = None) -> RV:
        """Wait for the answer, for so long."""
        return super().wait(gen, interval, self.limit if timeout is None else timeout)


class _Watched:
    """Common part of connections that do not wait for a silent database."""

    pgconn: psycopg.pq.abc.PGconn
    connections: Connections | None = None
    age = 0

    def born(self, connections: Connections, age: int) -> None:
        """Be under watch from now on."""
        self.connections, self.age = connections, age

    def check(self) -> None:
        """Close the connection and raise `OperationalError` if it is not worth waiting on any more."""
        if self.connections is not None:
            try:
                self.connections.check(self.age)
            except OperationalError:
                self.pgconn.finish()
                raise

    def _guarded(self, gen: PQGen[RV]) -> Generator[Any, Any, RV]:
        """The same generator of psycopg, which looks up whenever there was nothing to read or to write."""
        self.check()
        try:
            event = next(gen)
            while True:
                ready = yield event
                if not ready:
                    self.check()
                event = gen.send(ready)
        except StopIteration as end:
            value: RV = end.value
            return value


class WatchedConnection(_Watched, psycopg.Connection[Any]):
    """A connection for threads."""

    def seems_open(self) -> bool:
        """Tell if nothing has come in since the last answer, as the server's end of it would. False where that cannot be seen."""
        of = self.connections
        if self.closed or not hasattr(select, "poll") or (of is not None and (of.silent or of.age != self.age)):
            return False
        poll = select.poll()
        poll.register(self.pgconn.socket, select.POLLIN)
        return not poll.poll(0)

    def wait(self, gen: PQGen[RV], interval: float = LOOK, timeout: float | None = None) -> RV:
        """Wait as psycopg does, as long as the database is heard."""
        return super().wait(self._guarded(gen), interval, timeout)

    def commit(self) -> None:
        """Commit; only a standby that is unreachable keeps that longer than the patience, and nobody shall wait for it here."""
        if self.connections is None:
            super().commit()
            return
        with self.lock:
            try:
                self.wait(self._commit_gen(), timeout=self.connections.patience)
            except psycopg.errors._WaitTimeout:  # noqa: SLF001 - how psycopg says that the time is up
                self.pgconn.finish()
                raise OperationalError("the commit has taken too long; how it ends is not known") from None


class WatchedAsyncConnection(_Watched, AsyncConnection[Any]):
    """A connection for an event loop."""

    async def wait(self, gen: PQGen[RV], interval: float = LOOK, timeout: float | None = None) -> RV:  # noqa: ASYNC109 - psycopg's own signature
        """Wait as psycopg does, as long as the database is heard. Anyone who is cancelled closes the connection."""
        try:
            return await waiting.wait_async(self._guarded(gen), self.pgconn.socket, interval=interval, timeout=timeout)
        except asyncio.CancelledError:
            # psycopg would cancel the statement on the server: no commit may be ended like that.
            with contextlib.suppress(Exception):
                self.pgconn.finish()
            raise
