"""Group commit: readings that arrive together are decided and stored together, and none is answered before the commit.

One writer per process takes what is waiting, without gathering: while one transaction commits, the next readings
collect. A reading that is refused fails alone.
"""

import asyncio
import logging

from app.errors import DatabaseAway, OutcomeUnknown
from app.readings.ground import Stored, Verdict
from app.readings.keeper import TELL_EVERY, Keeper
from app.readings.loading import Book
from app.readings.records import Entry
from app.readings.schemas import ReadingIn
from app.readings.transaction import Outcome
from app.web.i18n import _

log = logging.getLogger(__name__)

MOST_AT_ONCE = 256
MOST_WAITING = 20_000


class Writer:
    """The one who stores the single readings of a process."""

    def __init__(self, dsn: str) -> None:
        self.book: Book = {}
        self.spare: list[Keeper] = []
        self._keeper = Keeper(dsn, self.book)
        self._waiting: list[tuple[Entry, ReadingIn, asyncio.Future[Outcome]]] = []
        self._wake = asyncio.Event()
        self._ending = False
        self._task: asyncio.Task[None] | None = None
        self._telling: asyncio.TimerHandle | None = None

    def start(self) -> None:
        """Begin to take readings; call it on the loop that serves requests."""
        self._task = asyncio.get_running_loop().create_task(self._run(), name="readings writer")

    async def stop(self) -> None:
        """Store what is waiting, then end."""
        self._ending = True
        self._wake.set()
        if self._task:
            await self._task
        await self._keeper.tell()
        for keeper in (self._keeper, *self.spare):
            await keeper.close()

    def submit(self, entry: Entry, reading: ReadingIn) -> asyncio.Future[Outcome]:
        """Hand a reading over; the future holds its outcome after the commit."""
        if len(self._waiting) >= MOST_WAITING:
            raise DatabaseAway(_("Too many readings are waiting to be stored. Nothing of this request was stored."))
        future: asyncio.Future[Outcome] = asyncio.get_running_loop().create_future()
        self._waiting.append((entry, reading, future))
        self._wake.set()
        return future

    async def _run(self) -> None:
        while self._waiting or not self._ending:
            await self._wake.wait()
            batch, self._waiting = self._waiting[:MOST_AT_ONCE], self._waiting[MOST_AT_ONCE:]
            if not self._waiting:
                self._wake.clear()
            if not batch:
                await self._keeper.tell()
                continue
            try:
                outcomes = await self._keeper.store([item[:2] for item in batch])
            except Exception:
                log.exception("the writer met what nobody foresaw")
                outcomes = [OutcomeUnknown()] * len(batch)
            answered: set[int] = set()
            for (entry, _reading, future), outcome in zip(batch, outcomes, strict=True):
                told = outcome
                if isinstance(outcome, Verdict):
                    if id(outcome) in answered:  # the same key, sent at the same time
                        told = Stored(entry, outcome.sequence)
                    answered.add(id(outcome))
                if not future.done():  # the client may be gone; what it sent is stored all the same
                    future.set_result(told)
            if self._keeper.untold and self._telling is None:
                self._telling = asyncio.get_running_loop().call_later(TELL_EVERY, self._tell)

    def _tell(self) -> None:
        self._telling = None
        self._wake.set()
