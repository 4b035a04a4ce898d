"""Group commit: readings that arrive together are decided and stored together, and none is answered before the commit.

One writer per process takes what is waiting, without gathering: while one transaction commits, the next readings
collect. A reading that is refused fails alone. The readings of a machine that other work holds leave the others and wait
for it in a queue of their own, in their order, until it is free.
"""

import asyncio
import logging
from collections.abc import Callable, Sequence
from time import monotonic
from typing import Any

from app.db.engine import Database
from app.errors import Busy, DatabaseAway, OutcomeUnknown
from app.language.i18n import _
from app.loop.readings.records import Entry
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.columnar import Outcome
from app.loop.readings.writer.connection import GIVE_WAY, HELD
from app.loop.readings.writer.load import ParametersCache
from app.loop.readings.writer.pending import Stored, Verdict
from app.loop.readings.writer.retry import NOTIFY_EVERY, MachinesHeld, ReadingStore

log = logging.getLogger(__name__)

MOST_AT_ONCE = 256
MOST_WAITING = 20_000
MOST_QUEUES = 8  # machines that are waited for at once, each with a connection; those of others are refused meanwhile
_Waiting = tuple[Entry, ReadingIn, asyncio.Future[Outcome], float]
"""A reading, its outcome, and since when it waits."""


class _Queue:
    """The readings of one machine, as long as other work holds it."""

    def __init__(self) -> None:
        self.waiting: list[_Waiting] = []
        self.task: asyncio.Task[None] | None = None


Refused = Callable[[Entry, dict[str, Any]], object]


class Writer:
    """Stores the single readings of a process, one transaction after the other. refused: is given the place and the touch of a refusal that people have to see."""

    def __init__(self, database: Database, refused: Refused = lambda _place, _touch: None) -> None:
        self.database = database
        self.refused = refused
        self.parameters: ParametersCache = {}
        self.idle: list[ReadingStore] = []
        self._store = ReadingStore(database, self.parameters, lock_wait=GIVE_WAY, gives_way=True)
        self._held: dict[int, _Queue] = {}
        self._patience = database.connections.patience
        self._waiting: list[_Waiting] = []
        self._wake = asyncio.Event()
        self._ending = False
        self._task: asyncio.Task[None] | None = None
        self._notifying: asyncio.TimerHandle | None = None

    def start(self) -> None:
        """Begin to take readings; call it on the loop that serves requests."""
        self._task = asyncio.get_running_loop().create_task(self._run(), name="readings writer")

    async def stop(self) -> None:
        """Store what is waiting, then end."""
        self._ending = True
        self._wake.set()
        if self._task:
            await self._task
        await asyncio.gather(*(queue.task for queue in self._held.values() if queue.task is not None))
        await self._store.notify()
        for store in (self._store, *self.idle):
            await store.close()

    def submit(self, entry: Entry, reading: ReadingIn) -> asyncio.Future[Outcome]:
        """Hand a reading over; the future holds its outcome after the commit."""
        queue = self._held.get(entry.machine_id)
        waiting = self._waiting if queue is None else queue.waiting
        if len(waiting) >= MOST_WAITING:
            raise DatabaseAway(_("Too many readings are waiting to be stored. Nothing of this request was stored."))
        future: asyncio.Future[Outcome] = asyncio.get_running_loop().create_future()
        waiting.append((entry, reading, future, monotonic()))
        if queue is None:
            self._wake.set()
        else:
            self._wait_for(entry.machine_id, queue)
        return future

    async def _run(self) -> None:
        while self._waiting or not self._ending:
            await self._wake.wait()
            batch, self._waiting = self._waiting[:MOST_AT_ONCE], self._waiting[MOST_AT_ONCE:]
            if not self._waiting:
                self._wake.clear()
            if not batch:
                await self._store.notify()
                continue
            if self._store.connection.away_for and (batch := self._not_waited_for_too_long(batch)) == []:
                continue
            try:
                _answer(batch, await _stored(self._store, batch))
            except MachinesHeld as held:
                self._give_way(held.machine_ids, batch)
            if self._store.unnotified and self._notifying is None:
                self._notifying = asyncio.get_running_loop().call_later(NOTIFY_EVERY, self._notify)

    def _give_way(self, machine_ids: set[int], batch: list[_Waiting]) -> None:
        """Put the readings of machines that are held, of this batch and behind it, into queues of their own."""
        everything, self._waiting = batch + self._waiting, []
        for machine_id in machine_ids:
            self._held.setdefault(machine_id, _Queue())
        for item in everything:
            queue = self._held.get(item[0].machine_id)
            (self._waiting if queue is None else queue.waiting).append(item)
        for machine_id in machine_ids:
            self._wait_for(machine_id, self._held[machine_id])
        if self._waiting:
            self._wake.set()

    def _wait_for(self, machine_id: int, queue: _Queue) -> None:
        """See to it that this queue is served; where too many are already, its readings are refused."""
        if queue.task is not None:
            return
        if sum(other.task is not None for other in self._held.values()) >= MOST_QUEUES:
            refused, queue.waiting = queue.waiting, []
            _answer(refused, [Busy(entry.machine) for entry, *_more in refused])
            return
        queue.task = asyncio.get_running_loop().create_task(self._serve(machine_id, queue), name="held machine")

    async def _serve(self, machine_id: int, queue: _Queue) -> None:
        """Store what waits for this machine. Once it has been free, its readings go with the others again."""
        store = ReadingStore(self.database, self.parameters, lock_wait=self._patience * HELD)
        free = True
        while queue.waiting:
            batch, queue.waiting = queue.waiting[:MOST_AT_ONCE], queue.waiting[MOST_AT_ONCE:]
            outcomes = await _stored(store, batch)
            free = not any(isinstance(outcome, Busy) for outcome in outcomes)
            if not free:  # anyone who came behind them is not kept waiting once more
                behind, queue.waiting = queue.waiting, []
                batch, outcomes = batch + behind, [*outcomes, *(Busy(entry.machine) for entry, *_more in behind)]
            _answer(batch, outcomes)
            if not queue.waiting:
                await store.notify()
        queue.task = None
        if free:
            del self._held[machine_id]
        await store.close()

    def _not_waited_for_too_long(self, batch: list[_Waiting]) -> list[_Waiting]:
        """Answer those that have waited behind others for the whole patience; return the rest."""
        oldest = monotonic() - self._patience
        for _entry, _reading, future, since in batch:
            if since < oldest and not future.done():
                future.set_result(DatabaseAway())
        return [item for item in batch if item[3] >= oldest]

    def _notify(self) -> None:
        self._notifying = None
        self._wake.set()


async def _stored(store: ReadingStore, batch: list[_Waiting]) -> list[Outcome]:
    """Return the outcomes of these readings. Raises `MachinesHeld`."""
    try:
        return await store.store([item[:2] for item in batch])
    except MachinesHeld:
        raise
    except Exception:
        log.exception("unhandled error in the readings writer")
        return [OutcomeUnknown()] * len(batch)


def _answer(batch: list[_Waiting], outcomes: Sequence[Outcome]) -> None:
    answered: set[int] = set()
    for (entry, _reading, future, _since), outcome in zip(batch, outcomes, strict=True):
        result = outcome
        if isinstance(outcome, Verdict):
            if id(outcome) in answered:  # the same key, sent at the same time
                result = Stored(entry, outcome.sequence)
            answered.add(id(outcome))
        if not future.done():  # the client may be gone; what it sent is stored all the same
            future.set_result(result)
