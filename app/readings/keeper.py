"""Storing readings over a connection that may break.

When it breaks, the transaction is done again; when it breaks after the commit was sent, the database is asked whether the
readings are there, so that none is lost or stored twice.
"""

import asyncio
import gc
import logging
from collections.abc import Sequence
from contextlib import suppress
from time import monotonic

import psycopg
from psycopg import AsyncConnection

from app.db.engine import LIMITS
from app.db.pipeline import Pipeline
from app.errors import DatabaseAway, InbandError, OutcomeUnknown
from app.readings.ground import Ground, Verdict
from app.readings.loading import Book
from app.readings.quiet import QuietReadings
from app.readings.records import Entry
from app.readings.schemas import ReadingIn
from app.readings.statements import TELL
from app.readings.transaction import MISTRUST, ROLLBACK, CommitLost, Outcome, new_ones, refuse_all, transact
from app.web.i18n import _

log = logging.getLogger(__name__)

PATIENCE = 5.0  # s that a reading waits for a database that is away, before it is answered 503
SHY = 16  # transactions that load what they need, after one whose memory was not true any more
TELL_EVERY = 0.05  # s; waking everybody costs as much as a commit, and pages look ten times a second at most
MOST_SPARE = 2  # connections kept for batches

# Every statement of the writer finds its rows by an index, however small the tables are when it is first planned; planned
# anew each time, the planning would cost more than the work.
PLANNER = "-c plan_cache_mode=force_generic_plan -c enable_seqscan=off -c enable_sort=off -c enable_hashjoin=off"


async def connect(dsn: str) -> Pipeline:
    """A connection for readings: statements prepared at their first use, transactions by our own word."""
    connection = await AsyncConnection.connect(
        dsn, autocommit=True, options=f"{LIMITS} {PLANNER}", application_name="inband-readings", connect_timeout=5
    )
    return Pipeline(connection)


class Keeper:
    """Stores readings over one connection, and sees to it when the database goes away in the middle."""

    def __init__(self, dsn: str, book: Book) -> None:
        self.dsn = dsn
        self.book = book
        self._ground = Ground()
        self._shy = 0
        self._pipeline: Pipeline | None = None
        self._away_since: float | None = None
        self._told_at = 0.0
        self.untold = False  # readings were stored that nobody has been woken for yet

    async def close(self) -> None:
        """Give the connection back."""
        if self._pipeline is not None:
            await self._pipeline.connection.close()

    async def store(self, wanted: Sequence[tuple[Entry, ReadingIn]], *, all_or_nothing: bool = False) -> list[Outcome]:
        """What becomes of each reading, after the commit. Raises only when it is all or nothing."""
        # Whoever comes while the database has been away for long is not kept waiting once more.
        deadline = (monotonic() if self._away_since is None else self._away_since) + PATIENCE
        pause = 0.02
        trusting = not self._shy
        tell = all_or_nothing or monotonic() > self._told_at + TELL_EVERY
        while True:
            try:
                if self._pipeline is None or self._pipeline.closed:
                    self._pipeline = await connect(self.dsn)
                self._pipeline.look()
                outcomes = await transact(
                    self._pipeline,
                    self.book,
                    self._ground,
                    wanted,
                    all_or_nothing=all_or_nothing,
                    trusting=trusting,
                    tell=tell,
                )
            except CommitLost as lost:
                self._ground = Ground()
                if (settled := await self._settle(lost, deadline)) is not None:
                    return settled
            except psycopg.OperationalError as error:
                await self._roll_back()
                self._away_since = self._away_since or monotonic()
                if monotonic() + pause > deadline:
                    log.warning("readings could not be stored, the database is away: %s", error)
                    return [DatabaseAway()] * len(wanted)
                await asyncio.sleep(pause)
                pause = min(2 * pause, 0.5)
            except InbandError:
                await self._roll_back()
                self._away_since = None
                raise
            except Exception as error:
                await self._roll_back()
                if trusting and isinstance(error, MISTRUST):
                    trusting = False
                    if isinstance(error, psycopg.errors.DivisionByZero):
                        self._shy = SHY
                    continue
                if all_or_nothing:
                    raise
                if len(wanted) == 1:
                    log.exception("a reading of %s could not be stored", wanted[0][0].characteristic)
                    return [_unexpected()]
                log.exception("%s readings together could not be stored; storing them one by one", len(wanted))
                return [(await self.store([item]))[0] for item in wanted]
            else:
                self._away_since = None
                self._shy = max(0, self._shy - 1)
                self.untold = not tell
                if tell:
                    self._told_at = monotonic()
                return outcomes

    async def tell(self) -> None:
        """Wake who listens, if there is something that was not told with its transaction."""
        if self.untold and self._pipeline is not None:
            self.untold, self._told_at = False, monotonic()
            with suppress(psycopg.Error):  # nobody listens to a database that is away
                await self._pipeline.run(((TELL,),))

    async def _roll_back(self) -> None:
        self._ground = Ground()
        if self._pipeline is not None and not self._pipeline.closed and self._pipeline.begun:
            try:
                await self._pipeline.run(ROLLBACK)
            except psycopg.Error:
                await self._pipeline.connection.close()

    async def _settle(self, lost: CommitLost, deadline: float) -> list[Outcome] | None:
        """How the commit ended: its outcomes if it is in the database, None if it must be done again."""
        pause = 0.02
        while True:
            try:
                self._pipeline = await connect(self.dsn)
                return lost.outcomes if await committed(self._pipeline, lost) else None
            except psycopg.OperationalError as error:
                log.warning("how a commit ended cannot be asked yet: %s", error)
            if monotonic() + pause > deadline:
                return [OutcomeUnknown() if isinstance(o, Verdict | QuietReadings) else o for o in lost.outcomes]
            await asyncio.sleep(pause)
            pause = min(2 * pause, 0.5)


async def committed(pipeline: Pipeline, lost: CommitLost) -> bool:
    """Whether the transaction whose commit was sent has stored its readings; if not, it cannot any more.

    Under the lock of a machine it has either ended or not begun, and moving the version keeps it from beginning.
    """
    first = new_ones(lost.outcomes)[0]
    entry = first.stream.entry
    async with pipeline.connection.transaction():
        await pipeline.connection.execute(
            "UPDATE machine_state SET version = version + 1 WHERE machine_id = %s", (entry.machine_id,)
        )
        cursor = await pipeline.connection.execute(
            "SELECT 1 FROM reading WHERE machine_id = %s AND characteristic_id = %s AND sequence = %s AND received_at = %s",
            (entry.machine_id, entry.characteristic_id, first.sequence, first.received_at),
        )
        return await cursor.fetchone() is not None


def store_batch(
    dsn: str, book: Book, wanted: Sequence[tuple[Entry, ReadingIn]], spare: list[Keeper] | None = None
) -> list[Outcome]:
    """Store a batch, all or nothing, from a thread of its own: it would keep the loop of the single readings waiting.

    spare: where keepers, and with them connections, are taken from and left for the next batch.
    """

    async def stored() -> list[Outcome]:
        keeper = spare.pop() if spare else Keeper(dsn, book)
        try:
            outcomes = await keeper.store(wanted, all_or_nothing=True)
        except BaseException:
            await keeper.close()
            raise
        if spare is None or len(spare) >= MOST_SPARE:
            await keeper.close()
        else:
            spare.append(keeper)
        return outcomes

    # All of a batch lives until it is stored: looking through it for garbage every few hundred objects doubles its time.
    gc.disable()
    try:
        outcomes = asyncio.run(stored())
    finally:
        gc.enable()
    refuse_all(outcomes)
    return outcomes


def _unexpected() -> InbandError:
    return InbandError(
        _("This reading could not be stored because of a fault in the server. It was not stored."),
        _("Keep the reading and tell whoever runs the server; its log names the fault."),
    )
