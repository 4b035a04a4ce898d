"""Store readings, and do it again when the connection breaks or the snapshot was not true any more.

When the connection breaks after the commit was sent, the database is asked if the readings are there, so that none is lost
or stored twice.
"""

import asyncio
import logging
from collections.abc import Sequence
from time import monotonic

import psycopg

from app.db.engine import Database
from app.db.pipeline import Pipeline
from app.errors import DatabaseAway, DiskFull, InbandError, OutcomeUnknown
from app.language.i18n import _
from app.loop.readings.records import Entry
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.columnar import ColumnarReadings, Outcome
from app.loop.readings.writer.connection import LAST_ATTEMPT, LONGEST, Attempts, WriterConnection
from app.loop.readings.writer.load import ParametersCache
from app.loop.readings.writer.pending import Verdict
from app.loop.readings.writer.snapshot import Snapshot
from app.loop.readings.writer.statements import NOTIFY
from app.loop.readings.writer.transaction import STALE, CommitLost, new_verdicts, transact

log = logging.getLogger(__name__)

PESSIMISTIC_FOR = 16  # transactions that load what they need, after one whose snapshot was not true any more
NOTIFY_EVERY = 0.05  # s; waking everybody costs as much as a commit, and pages look ten times a second at most


class ReadingStore:
    """Stores readings over one connection, with the snapshot of the transaction before."""

    def __init__(self, database: Database, parameters: ParametersCache) -> None:
        self.connection = WriterConnection(database)
        self.parameters = parameters
        self._snapshot = Snapshot()
        self._pessimistic_for = 0
        self._notified_at = 0.0
        self.unnotified = False  # readings were stored that nobody has been woken for yet

    async def close(self) -> None:
        """Give the connection back."""
        await self.connection.close()

    async def store(
        self, readings: Sequence[tuple[Entry, ReadingIn]], *, all_or_nothing: bool = False
    ) -> list[Outcome]:
        """Return the outcome of each reading, after the commit. Raises only when it is all or nothing."""
        # Whoever comes while the database has been away for long is not kept waiting once more.
        attempts = Attempts(self.connection, self.connection.deadline())
        optimistic = not self._pessimistic_for
        notify = all_or_nothing or monotonic() > self._notified_at + NOTIFY_EVERY
        while True:
            try:
                pipeline = await self._ready(attempts.deadline, all_or_nothing=all_or_nothing)
                outcomes = await transact(
                    pipeline,
                    self.parameters,
                    self._snapshot,
                    readings,
                    all_or_nothing=all_or_nothing,
                    optimistic=optimistic,
                    notify=notify and not pipeline.distributed,
                )
            except CommitLost as lost:
                self._snapshot = Snapshot()
                self.connection.is_away()
                if (outcomes_now := await self._find_out(lost, attempts.deadline)) is not None:
                    return outcomes_now
            except psycopg.OperationalError as error:
                await self._roll_back()
                self.connection.is_away()
                if not await attempts.another():
                    log.warning("readings could not be stored, the database is away: %s", error)
                    full = isinstance(error, psycopg.errors.DiskFull)
                    return [DiskFull() if full else DatabaseAway()] * len(readings)
            except InbandError:
                await self._roll_back()
                self.connection.is_back()
                raise
            except Exception as error:
                await self._roll_back()
                if optimistic and isinstance(error, STALE):
                    optimistic = False
                    if isinstance(error, psycopg.errors.DivisionByZero):
                        self._pessimistic_for = PESSIMISTIC_FOR
                    continue
                if all_or_nothing:
                    raise
                if len(readings) == 1:
                    log.exception("a reading of %s could not be stored", readings[0][0].characteristic)
                    return [_unexpected()]
                log.exception("%s readings together could not be stored; storing them one by one", len(readings))
                return [(await self.store([item]))[0] for item in readings]
            else:
                self.connection.is_back()
                self._pessimistic_for = max(0, self._pessimistic_for - 1)
                self.unnotified = not notify
                if notify:
                    self._notified_at = monotonic()
                    if pipeline.distributed:
                        await self.connection.send(NOTIFY)
                return outcomes

    async def notify(self) -> None:
        """Wake who listens, if readings were stored without."""
        if self.unnotified and self.connection.pipeline is not None:
            self.unnotified, self._notified_at = False, monotonic()
            await self.connection.send(NOTIFY)

    async def _ready(self, deadline: float, *, all_or_nothing: bool) -> Pipeline:
        """Return a connection that works, as far as can be seen. There is always time for one attempt."""
        connection = self.connection
        if connection.lost:
            # The server may be another one than before, which has not got all that we remember.
            self._snapshot = Snapshot()
            self.parameters.clear()
            await connection.open()
        assert connection.pipeline is not None
        connection.answer_by(deadline, at_least=LONGEST if all_or_nothing else connection.patience * LAST_ATTEMPT)
        connection.pipeline.look()
        return connection.pipeline

    async def _roll_back(self) -> None:
        self._snapshot = Snapshot()
        await self.connection.roll_back()

    async def _find_out(self, lost: CommitLost, deadline: float) -> list[Outcome] | None:
        """Return the outcomes of a commit if it is in the database, None if it must be done again."""
        connection = self.connection
        attempts = Attempts(connection, deadline)
        while True:
            try:
                async with asyncio.timeout(max(deadline - monotonic(), connection.patience * LAST_ATTEMPT)):
                    stored = await committed(await connection.open(), lost)
            except (psycopg.OperationalError, TimeoutError) as error:
                log.warning("how a commit ended cannot be asked yet: %s", str(error) or "no answer")
            else:
                connection.is_back()
                return lost.outcomes if stored else None
            if not await attempts.another():
                return [OutcomeUnknown() if isinstance(o, Verdict | ColumnarReadings) else o for o in lost.outcomes]


async def committed(pipeline: Pipeline, lost: CommitLost) -> bool:
    """Tell if the transaction whose commit was sent has stored its readings; if not, it cannot any more.

    Under the lock of a machine it has either ended or not begun, and moving the version keeps it from beginning.
    """
    first = new_verdicts(lost.outcomes)[0]
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


def _unexpected() -> InbandError:
    return InbandError(
        _("This reading could not be stored because of a fault in the server. It was not stored."),
        _("Keep the reading and tell whoever runs the server; its log names the fault."),
    )
