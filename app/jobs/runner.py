"""The periodic background jobs of one process, once a minute.

Of several processes on one database one runs them: the one that holds an advisory lock on a connection of its own. When it
ends, however it ends, another takes over within a minute.
"""

import asyncio
import logging
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import psycopg
from psycopg import AsyncConnection

from app.db.engine import Database
from app.db.outage import Outage
from app.jobs.actions import DatabaseGone, PeriodicJob, run_job

log = logging.getLogger(__name__)

EVERY = 60.0  # s between two runs
_OURS = "SELECT pg_try_advisory_lock(7291, 'job_run'::regclass::oid::int4)"


class JobRunner:
    """Runs periodic jobs, one after the other."""

    def __init__(self, database: Database, jobs: Sequence[PeriodicJob], every: float = EVERY) -> None:
        self._database = database
        self._jobs = jobs
        self._every = every
        self._closing = asyncio.Event()
        self._task: asyncio.Task[None] | None = None
        self._outage = Outage(log, "periodic jobs")

    def start(self) -> None:
        """Begin; call it on the loop that serves requests."""
        self._task = asyncio.get_running_loop().create_task(self._run(), name="periodic jobs")

    async def stop(self) -> None:
        """End after the unit of work that is being done."""
        self._closing.set()
        if self._task is not None:
            await self._task

    async def _run(self) -> None:
        while not self._closing.is_set():
            try:
                await self._run_while_ours()
                self._outage.is_over()
            except (psycopg.Error, DatabaseGone) as error:
                self._outage.goes_on(error)
            except Exception:
                log.exception("unhandled error in the periodic jobs")
            await self._rest()

    async def _run_while_ours(self) -> None:
        async with await self._database.connections.connect_async(application_name="inband-jobs") as conn:
            # Asked again before every run: it is granted again to the connection that has it, and fails with the connection.
            while not self._closing.is_set() and await _granted(conn):
                for job in self._jobs:
                    if self._closing.is_set():
                        return
                    await asyncio.to_thread(run_job, self._database, job, self._closing.is_set)
                self._outage.is_over()
                await self._rest()

    async def _rest(self) -> None:
        with suppress(TimeoutError):
            await asyncio.wait_for(self._closing.wait(), self._every)


async def _granted(conn: AsyncConnection[Any]) -> bool:
    row = await (await conn.execute(_OURS)).fetchone()
    return row is not None and bool(row[0])
