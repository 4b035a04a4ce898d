"""Store readings, and do it again when the connection breaks or the snapshot was not true any more.

When the connection breaks after the commit was sent, the database is asked if the readings are there, so that none is lost
or stored twice. A lock that other work holds is not an absent database: PostgreSQL itself ends the wait for it, before
anybody's patience does, and nothing was stored.
"""

import asyncio
import logging
from collections.abc import Sequence
from contextlib import suppress
from time import monotonic

import psycopg

from app.db.connections import LOOK
from app.db.engine import Database
from app.db.pipeline import Pipeline
from app.errors import Busy, DatabaseAway, DiskFull, InbandError, NotFound, OutcomeUnknown
from app.language.i18n import _
from app.loop.readings.records import Entry
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.columnar import ColumnarReadings, Outcome
from app.loop.readings.writer.connection import HELD, LAST_ATTEMPT, LONGEST, Attempts, WriterConnection
from app.loop.readings.writer.load import ParametersCache
from app.loop.readings.writer.pending import Verdict
from app.loop.readings.writer.snapshot import Snapshot
from app.loop.readings.writer.statements import FREE, NOTIFY, THERE, array
from app.loop.readings.writer.transaction import STALE, CommitLost, new_verdicts, transact

log = logging.getLogger(__name__)

PESSIMISTIC_FOR = 16  # transactions that load what they need, after one whose snapshot was not true any more
NOTIFY_EVERY = 0.05  # s; waking everybody costs as much as a commit, and pages look ten times a second at most


HELD_UP = (psycopg.errors.LockNotAvailable, psycopg.errors.QueryCanceled)
"""PostgreSQL has ended the transaction because it waited for too long; nothing of it is stored."""


class MachinesHeld(Exception):
    """Nothing was stored, because other work holds these machines."""

    def __init__(self, machine_ids: set[int]) -> None:
        super().__init__(machine_ids)
        self.machine_ids = machine_ids


class ReadingStore:
    """Stores readings over one connection, with the snapshot of the transaction before.

    lock_wait: as of `WriterConnection`. gives_way: raise `MachinesHeld` after that, so that others need not wait.
    """

    def __init__(
        self,
        database: Database,
        parameters: ParametersCache,
        *,
        lock_wait: float | None = None,
        gives_way: bool = False,
    ) -> None:
        self.connection = WriterConnection(database, lock_wait)
        self.gives_way = gives_way
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
        """Return the outcome of each reading, after the commit. Raises only when it is all or nothing, or `MachinesHeld`."""
        # Anyone who comes while the database has been unreachable for long is not kept waiting once more.
        attempts = Attempts(self.connection, self.connection.deadline())
        optimistic = not self._pessimistic_for
        lock_wait: float | None = self.connection.lock_wait
        notify = all_or_nothing or monotonic() > self._notified_at + NOTIFY_EVERY
        while True:
            try:
                pipeline = await self._ready(attempts.deadline, all_or_nothing=all_or_nothing)
                await self.connection.wait_for_locks(lock_wait)
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
            except HELD_UP as error:
                await self._roll_back()
                self.connection.is_back()
                lock_wait = await self._wait_again(error, readings, attempts, lock_wait) if self.gives_way else None
                if lock_wait is None:
                    busy = _busy(readings)
                    log.warning("readings could not be stored: %s (%s)", busy.detail, error)
                    return [busy] * len(readings)
            except psycopg.OperationalError as error:
                await self._roll_back()
                self.connection.is_away()
                if not await attempts.another():
                    log.warning("readings could not be stored, the database is unreachable: %s", error)
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
                removed = await self._removed(readings) if all_or_nothing or len(readings) == 1 else None
                if removed:
                    if all_or_nothing:
                        raise removed from error
                    return [removed]
                if all_or_nothing:
                    raise
                if len(readings) == 1:
                    log.exception("a reading of %s could not be stored", readings[0][0].characteristic)
                    return [_unexpected()]
                log.exception("%s readings together could not be stored; storing them one by one", len(readings))
                return [await self._alone(item) for item in readings]
            else:
                self.connection.is_back()
                self._pessimistic_for = max(0, self._pessimistic_for - 1)
                self.unnotified = not notify
                if notify:
                    self._notified_at = monotonic()
                    if pipeline.distributed:
                        await self.connection.send(NOTIFY)
                return outcomes

    async def _removed(self, readings: Sequence[tuple[Entry, ReadingIn]]) -> NotFound | None:
        """The answer where a machine was removed, as a simulated one may be, since its characteristics were looked up."""
        machine_ids, pipeline = {entry.machine_id for entry, _reading in readings}, self.connection.pipeline
        there = machine_ids
        with suppress(psycopg.Error):
            if pipeline is not None and not pipeline.closed:
                (rows,) = await pipeline.run(((THERE, array(machine_ids)),))
                there = {int(machine_id or 0) for (machine_id,) in rows}
        return next((_removed(entry) for entry, _reading in readings if entry.machine_id not in there), None)

    async def _alone(self, item: tuple[Entry, ReadingIn]) -> Outcome:
        try:
            return (await self.store([item]))[0]
        except MachinesHeld:
            return _busy([item])

    async def _wait_again(
        self,
        error: psycopg.Error,
        readings: Sequence[tuple[Entry, ReadingIn]],
        attempts: Attempts,
        waited: float | None,
    ) -> float | None:
        """Seconds to wait for locks in another attempt, None for no other. Raises `MachinesHeld`."""
        pipeline = self.connection.pipeline
        if pipeline is None or pipeline.closed or not isinstance(error, psycopg.errors.LockNotAvailable):
            return None
        machine_ids = {entry.machine_id for entry, _reading in readings}
        with suppress(psycopg.Error):
            (free,) = await pipeline.run(((FREE, array(machine_ids)),))
            if held := machine_ids - {int(machine_id or 0) for (machine_id,) in free}:
                raise MachinesHeld(held)
        if "machine_state" in (error.diag.context or ""):  # and is free again
            return waited if await attempts.another() else None
        # No machine is held, but what all of them need.
        patient = self.connection.patience * HELD
        return patient if waited != patient and monotonic() + patient < attempts.deadline else None

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
        """Return the outcomes of a commit if it is in the database, None if it must be done again.

        It is asked until the deadline, and at least for the time of one attempt, whether the database is silent or other work
        holds the machine.
        """
        connection = self.connection
        attempts = Attempts(connection, max(deadline, monotonic() + connection.patience * LAST_ATTEMPT))
        while True:
            rest = max(attempts.deadline - monotonic(), LOOK)
            try:
                async with asyncio.timeout(rest):
                    pipeline = connection.pipeline
                    if pipeline is None or pipeline.closed:
                        pipeline = await connection.open()
                    stored = await committed(pipeline, lost, rest)
            except (psycopg.OperationalError, TimeoutError) as error:
                log.warning("how a commit ended cannot be asked yet: %s", str(error) or "no answer")
            else:
                connection.is_back()
                return lost.outcomes if stored else None
            if not await attempts.another(silent=True):
                return [OutcomeUnknown() if isinstance(o, Verdict | ColumnarReadings) else o for o in lost.outcomes]


async def committed(pipeline: Pipeline, lost: CommitLost, seconds: float) -> bool:
    """Tell if the transaction whose commit was sent has stored its readings; if not, it cannot any more.

    seconds: as long may it wait for a lock.

    Under the lock of a machine it has either ended or not begun, and moving the version keeps it from beginning.
    """
    first = new_verdicts(lost.outcomes)[0]
    entry = first.stream.entry
    async with pipeline.connection.transaction():
        limit = f"{round(seconds * 1000)}ms"
        await pipeline.connection.execute(
            "SELECT set_config('lock_timeout', %s, true), set_config('statement_timeout', %s, true)", (limit, limit)
        )
        await pipeline.connection.execute(
            "UPDATE machine_state SET version = version + 1 WHERE machine_id = %s", (entry.machine_id,)
        )
        cursor = await pipeline.connection.execute(
            "SELECT 1 FROM reading WHERE machine_id = %s AND characteristic_id = %s AND sequence = %s AND received_at = %s",
            (entry.machine_id, entry.characteristic_id, first.sequence, first.received_at),
        )
        return await cursor.fetchone() is not None


def _busy(readings: Sequence[tuple[Entry, ReadingIn]]) -> Busy:
    machines = {entry.machine for entry, _reading in readings}
    return Busy(machines.pop() if len(machines) == 1 else None)


def _removed(entry: Entry) -> NotFound:
    return NotFound(
        _("There is no characteristic {key} any more: its machine was simulated, and is removed.").format(
            key=repr(entry.characteristic)
        ),
        _("Check the key under Set-up."),
    )


def _unexpected() -> InbandError:
    return InbandError(
        _("This reading could not be stored because of a fault in the server. It was not stored."),
        _("Keep the reading and inform the administrator of the server; its log names the fault."),
    )
