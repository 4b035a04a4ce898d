"""The connection of a writer: opened when it is needed, and how long the database has been unreachable."""

import asyncio
from contextlib import suppress
from time import monotonic

import psycopg

from app.db.citus import CITUS
from app.db.connections import LIMITS
from app.db.engine import Database
from app.db.pipeline import Pipeline
from app.loop.readings.writer.transaction import ROLLBACK

LONGEST = 60.0  # s that a batch may take, as long as the database is heard; a single reading has only the patience
GIVE_WAY = 0.1  # s that readings of several machines wait for one that other work holds
HELD = 0.7  # of the patience: as long do the readings of that machine wait for it, alone
STATEMENT = (
    0.8  # of the patience: no statement of single readings takes longer, so a wait has ended before nobody listens
)
LAST_ATTEMPT = 0.2  # of the patience, for the one attempt of the one who comes when it has run out

# Every statement of the writer finds its rows by an index, however small the tables are when it is first planned; planned
# each time, the planning would cost more than the work.
PLANNER = "-c plan_cache_mode=force_generic_plan -c enable_seqscan=off -c enable_sort=off -c enable_hashjoin=off"

# Citus finds the node of a statement by its values, and for a plan for any values none: *could not create distributed plan*.
PLANNER_OF_CITUS = "SET plan_cache_mode = force_custom_plan"

# The node waits for locks, and hears of our patience only what is said within a transaction.
FOR_NODES = "SET citus.propagate_set_commands = 'local'"


async def connect(database: Database, limits: str = LIMITS) -> Pipeline:
    """Open a connection for readings: statements prepared at their first use, transactions by our own word."""
    connections = database.connections
    connection = await connections.connect_async(options=f"{limits} {PLANNER}", application_name="inband-readings")
    distributed = await (await connection.execute(CITUS)).fetchone() is not None
    if distributed:
        await connection.execute(PLANNER_OF_CITUS)
        await connection.execute(FOR_NODES)
    return Pipeline(connection, distributed=distributed)


class WriterConnection:
    """One connection at a time, and since when there has been none that works.

    lock_wait: seconds until PostgreSQL ends a transaction that waits for a lock, so that nothing of it is stored; clearly less
    than the patience. None: of batches, which are waited for longer than any lock.
    """

    def __init__(self, database: Database, lock_wait: float | None = None) -> None:
        self.database = database
        self.patience = database.connections.patience
        self.lock_wait = lock_wait
        self._waits = lock_wait
        self.pipeline: Pipeline | None = None
        self._away_since: float | None = None

    @property
    def lost(self) -> bool:
        """Tell if a connection has to be opened: the server may be another one than before."""
        return self.pipeline is None or self.pipeline.closed

    async def open(self) -> Pipeline:
        """Open a connection in the place of the one before. Raises psycopg's `OperationalError`."""
        limits = LIMITS
        if self.lock_wait is not None:
            limits += f" -c lock_timeout={_ms(self.lock_wait)} -c statement_timeout={_ms(self.patience * STATEMENT)}"
        self.pipeline = await connect(self.database, limits)
        self._waits = self.lock_wait
        self._tell_node()
        return self.pipeline

    async def wait_for_locks(self, seconds: float | None) -> None:
        """Wait so long for each lock from now on. Raises psycopg's errors."""
        if self._waits != seconds and seconds is not None and self.pipeline is not None:
            await self.pipeline.run((("SELECT set_config('lock_timeout', $1, false)", _ms(seconds)),))
            self._waits = seconds
            self._tell_node()

    def _tell_node(self) -> None:
        """Let the transactions of a plant on another node wait there as long for locks."""
        if self.pipeline is not None and self.pipeline.distributed and self._waits is not None:
            self.pipeline.begin = (("BEGIN",), (f"SET LOCAL lock_timeout = {_ms(self._waits)}",))

    async def close(self) -> None:
        """Give the connection back."""
        if self.pipeline is not None:
            await self.pipeline.connection.close()

    async def roll_back(self) -> None:
        """End the transaction that is open, or the connection that cannot."""
        if self.pipeline is not None and not self.pipeline.closed and self.pipeline.begun:
            try:
                await self.pipeline.run(ROLLBACK)
            except psycopg.Error:
                await self.pipeline.connection.close()

    async def send(self, statement: str) -> None:
        """Run one statement that nobody waits for; a database that is unreachable has nobody to read it."""
        if self.pipeline is not None:
            self.answer_by(monotonic(), at_least=self.patience * LAST_ATTEMPT)
            with suppress(psycopg.Error):
                await self.pipeline.run(((statement,),))

    def answer_by(self, deadline: float, *, at_least: float) -> None:
        """Limit the wait for the next answer: until the deadline (`monotonic`), and at least N seconds."""
        assert self.pipeline is not None
        self.pipeline.until = asyncio.get_running_loop().time() + max(deadline - monotonic(), at_least)

    def deadline(self) -> float:
        """Return when patience ends, by `monotonic`. It began when the database was first found away."""
        return (monotonic() if self._away_since is None else self._away_since) + self.patience

    def is_away(self) -> None:
        """Note that the database does not answer."""
        self._away_since = self._away_since or monotonic()

    def is_back(self) -> None:
        """Note that the database answers."""
        self._away_since = None

    @property
    def away_for(self) -> float:
        """Seconds since the database became unreachable; 0 while it is there."""
        return 0.0 if self._away_since is None else monotonic() - self._away_since


def _ms(seconds: float) -> str:
    return str(round(seconds * 1000))


class Attempts:
    """Pauses between attempts, each twice as long as the one before, until the deadline."""

    def __init__(self, connection: WriterConnection, deadline: float) -> None:
        self.deadline = deadline
        self._connections = connection.database.connections
        self._pause = 0.02

    async def another(self, *, silent: bool = False) -> bool:
        """Wait for the next attempt; False, at once, if there is no time for one.

        silent: also where the database counts as silent, which it may not until the deadline.
        """
        if monotonic() + self._pause > self.deadline or (self._connections.silent and not silent):
            return False
        await asyncio.sleep(self._pause)
        self._pause = min(2 * self._pause, 0.5)
        return True
