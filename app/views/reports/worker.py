"""The thread of the server that has reports made which were asked for many at once: one job at a time, in a process of their own.

Anyone who works on a job holds an advisory lock with its number, on a connection of its own: when the server ends, however it
ends, the lock is free, and another server – or the same one, restarted – goes on behind the last characteristic that is ready.
The process is begun when something waits, and ends when nothing has come for a while: in the server it would hold the interpreter that
readings need, and memory that nobody does.
"""

import asyncio
import logging
import os
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import psycopg
from sqlalchemy.exc import OperationalError

import app
from app.db.engine import Database
from app.db.outage import Outage
from app.jobs.actions import DatabaseGone, Unit, note_failure, paused_units
from app.memory import BEHIND
from app.quality.proof import queries as proof
from app.settings import Settings
from app.views.reports import queries
from app.views.reports.maker import NAME, PROVED

log = logging.getLogger(__name__)

EVERY = 2.0  # s between two looks for something to do
KEPT = 30.0  # s that the process waits for more
END_WITHIN = 10.0  # s
PROGRAM = f"""{BEHIND}
from app.memory import reading_modules
with reading_modules():
    from app.views.reports.maker import main
main()"""
LOCK = "'report_job'::regclass::oid::int4, %s"
"""Key of a job's advisory lock. Each plant has a table of its own, and so numbers of its own."""


class ReportWorker:
    """Has reports made for one plant, for one server process."""

    def __init__(self, database: Database, settings: Settings) -> None:
        self._database = database
        self._settings = settings.model_dump_json(include=set(Settings.model_fields))
        self._closing = threading.Event()
        self._wake = threading.Event()
        self._thread: threading.Thread | None = None
        self._maker: subprocess.Popen[str] | None = None
        self._last = 0.0  # when the process has last ended a job
        self._outage = Outage(log, "reports")

    def start(self) -> None:
        """Begin to look for something to do."""
        self._thread = threading.Thread(target=self._go, name="reports", daemon=True)
        self._thread.start()

    def wake(self) -> None:
        """There is something to do now."""
        self._wake.set()

    async def stop(self) -> None:
        """End at once, in the middle of a characteristic: another server, or this one started again, makes it and the rest."""
        self._closing.set()
        self._wake.set()
        if self._maker is not None:
            self._maker.kill()
        if self._thread is not None:
            await asyncio.to_thread(self._thread.join, END_WITHIN)

    def _go(self) -> None:
        while not self._closing.is_set():
            try:
                self._look()
                self._outage.is_over()
            except (psycopg.Error, OperationalError, DatabaseGone) as error:
                self._outage.goes_on(error)
            except Exception:
                log.exception("unhandled error in making reports")
            self._wake.wait(EVERY)
            self._wake.clear()
        self._end()

    def _look(self) -> None:
        with self._database.begin() as session:
            waiting = queries.open_jobs(session)
            paused = paused_units(session, NAME, [Unit(f"reports/{number}") for number in waiting])
        if not waiting:
            if time.monotonic() > self._last + KEPT:
                self._end()
            return
        with self._database.connections.connect(autocommit=True, application_name="inband-reports") as ours:
            for number in waiting:
                if self._closing.is_set():
                    return
                if paused.get(f"reports/{number}") or not _taken(ours, number):
                    continue
                try:
                    self._make(number)
                finally:
                    ours.execute(f"SELECT pg_advisory_unlock({LOCK})", (number,))

    def _make(self, number: int) -> None:
        answer = ""
        with suppress(BrokenPipeError):  # it has ended; so does its answer
            answer = self._asked(number)
        self._last = time.monotonic()
        if self._closing.is_set():
            return
        if not answer:
            ended = RuntimeError(f"the process that makes reports ended with {self._end()}")
            note_failure(self._database, NAME, Unit(f"reports/{number}"), ended)
        elif answer.strip():
            raise DatabaseGone(answer.strip())

    def _asked(self, number: int) -> str:
        if self._maker is None:
            self._maker = self._begun()
            if self._closing.is_set():  # meanwhile: nobody else ends it
                self._end()
                return ""
        assert self._maker.stdin is not None
        assert self._maker.stdout is not None
        self._maker.stdin.write(f"{number}\n")
        self._maker.stdin.flush()
        return self._maker.stdout.readline()

    def _begun(self) -> subprocess.Popen[str]:
        maker = subprocess.Popen(  # noqa: S603 - our own words
            [sys.executable, "-c", PROGRAM, str(os.getpid())],
            env=os.environ | {"PYTHONPATH": str(Path(app.__path__[0]).parent)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            encoding="utf-8",
        )
        assert maker.stdin is not None
        maker.stdin.write(f"{self._settings}\n{PROVED if proof.passed() else ''}\n")
        return maker

    def _end(self) -> int | None:
        """End the process; the code that it ended with, None if there was none."""
        maker, self._maker = self._maker, None
        if maker is None:
            return None
        maker.kill()
        with maker:
            return maker.wait()


def _taken(ours: "psycopg.Connection[tuple[object, ...]]", number: int) -> bool:
    row = ours.execute(f"SELECT pg_try_advisory_lock({LOCK})", (number,)).fetchone()
    return row is not None and bool(row[0])
