"""The task that sends notifications: it looks every two seconds for what is due, and delivers it beside everything else.

It holds a connection of the database for moments only, never while it waits for a mail server; a receiver that hangs keeps none
of the others waiting.
"""

import asyncio
import logging
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from contextvars import copy_context
from typing import TypeVar

from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session

from app.db.engine import Database
from app.db.outage import Outage
from app.loop.notifications import sending
from app.loop.notifications.calendar_queries import of_settings
from app.loop.notifications.means import Answer, Job, deliver
from app.settings import Settings

log = logging.getLogger(__name__)

Result = TypeVar("Result")

EVERY = 2.0  # s between two looks
TIDY = 3600.0  # s between two looks for what is old
END_WITHIN = 3.0  # s for what is being delivered when the server ends; it is sent again if that was too short


class Notifier:
    """Sends notifications in one process."""

    def __init__(self, database: Database, settings: Settings, shift_report: sending.ShiftReport) -> None:
        """shift_report: words about a shift, which people may want by mail."""
        self._database = database
        self._shift_report = shift_report
        self._settings = settings
        self._days_off = of_settings(settings)
        self._threads = ThreadPoolExecutor(2, thread_name_prefix="notifications")  # never those of the readings door
        self._closing = asyncio.Event()
        self._task: asyncio.Task[None] | None = None
        self._deliveries: set[asyncio.Task[None]] = set()
        self._outage = Outage(log, "notifications")

    def start(self) -> None:
        """Begin; call it on the loop that serves requests."""
        self._task = asyncio.get_running_loop().create_task(self._run(), name="notifications")

    async def stop(self) -> None:
        """End, with a moment for what is being delivered."""
        self._closing.set()
        if self._task is not None:
            await self._task
        if self._deliveries:
            _done, hanging = await asyncio.wait(self._deliveries, timeout=END_WITHIN)
            for task in hanging:
                task.cancel()
            await asyncio.gather(*hanging, return_exceptions=True)
        await asyncio.to_thread(self._threads.shutdown)  # no transaction outlives the pool of connections

    async def _run(self) -> None:
        tidied = -TIDY
        while not self._closing.is_set():
            try:
                await self.look()
                now = asyncio.get_running_loop().time()
                if now - tidied >= TIDY:
                    tidied = now
                    await self._transaction(sending.forget_old)
                self._outage.is_over()
            except OperationalError as error:
                self._outage.goes_on(error)
            except Exception:
                log.exception("unhandled error in notifications")
            with suppress(TimeoutError):
                await asyncio.wait_for(self._closing.wait(), EVERY)

    async def look(self) -> None:
        """Begin what is due; alarms do not wait for the words about a shift."""
        address = self._settings.address
        self._begin(await self._transaction(lambda session: sending.plan(session, address, self._days_off)))
        self._begin(await self._transaction(lambda session: sending.plan_shifts(session, address, self._shift_report)))

    def _begin(self, jobs: list[Job]) -> None:
        for job in jobs:
            task = asyncio.get_running_loop().create_task(self._deliver(job), name=f"delivery {job.delivery}")
            self._deliveries.add(task)
            task.add_done_callback(self._deliveries.discard)

    async def _deliver(self, job: Job) -> None:
        try:
            answer = await deliver(job, self._settings)
        except Exception as error:
            log.exception("unhandled error in delivery %d", job.delivery)
            answer = Answer(delivered=False, text=type(error).__name__)
        if not answer.delivered:
            log.warning("delivery %d to receiver %d failed: %s", job.delivery, job.receiver, answer.text)
        try:
            await self._transaction(lambda session: sending.end(session, job, answer))
        except OperationalError as error:  # it counts as lost and is sent again
            self._outage.goes_on(error)

    async def _transaction(self, work: Callable[[Session], Result]) -> Result:
        """The result of a transaction in a thread, in this plant's time."""

        def run() -> Result:
            with self._database.begin() as session:
                return work(session)

        return await asyncio.get_running_loop().run_in_executor(self._threads, copy_context().run, run)
