"""Group commit: readings that arrive together are decided and stored together, and none is answered before the commit.

One writer per process takes what is waiting, without gathering: while one transaction commits, the next readings
collect. A reading that is refused fails alone.
"""

import asyncio
import logging
from time import monotonic

from app.db.engine import Database
from app.errors import DatabaseAway, OutcomeUnknown
from app.language.i18n import _
from app.loop.readings.records import Entry
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.columnar import Outcome
from app.loop.readings.writer.load import ParametersCache
from app.loop.readings.writer.pending import Stored, Verdict
from app.loop.readings.writer.retry import NOTIFY_EVERY, ReadingStore

log = logging.getLogger(__name__)

MOST_AT_ONCE = 256
MOST_WAITING = 20_000
_Waiting = tuple[Entry, ReadingIn, asyncio.Future[Outcome], float]
"""A reading, its outcome, and since when it waits."""


class Writer:
    """Stores the single readings of a process, one transaction after the other."""

    def __init__(self, database: Database) -> None:
        self.parameters: ParametersCache = {}
        self.idle: list[ReadingStore] = []
        self._store = ReadingStore(database, self.parameters)
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
        await self._store.notify()
        for store in (self._store, *self.idle):
            await store.close()

    def submit(self, entry: Entry, reading: ReadingIn) -> asyncio.Future[Outcome]:
        """Hand a reading over; the future holds its outcome after the commit."""
        if len(self._waiting) >= MOST_WAITING:
            raise DatabaseAway(_("Too many readings are waiting to be stored. Nothing of this request was stored."))
        future: asyncio.Future[Outcome] = asyncio.get_running_loop().create_future()
        self._waiting.append((entry, reading, future, monotonic()))
        self._wake.set()
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
                outcomes = await self._store.store([item[:2] for item in batch])
            except Exception:
                log.exception("unhandled error in the readings writer")
                outcomes = [OutcomeUnknown()] * len(batch)
            answered: set[int] = set()
            for (entry, _reading, future, _since), outcome in zip(batch, outcomes, strict=True):
                result = outcome
                if isinstance(outcome, Verdict):
                    if id(outcome) in answered:  # the same key, sent at the same time
                        result = Stored(entry, outcome.sequence)
                    answered.add(id(outcome))
                if not future.done():  # the client may be gone; what it sent is stored all the same
                    future.set_result(result)
            if self._store.unnotified and self._notifying is None:
                self._notifying = asyncio.get_running_loop().call_later(NOTIFY_EVERY, self._notify)

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
