"""The thread that makes reports which were asked for many at once: one job at a time, one characteristic at a time.

Anyone who works on a job holds an advisory lock with its number, on a connection of its own: when the process ends, however it
ends, the lock is free, and another process – or the same one, restarted – goes on behind the last characteristic that is ready.
After each characteristic the thread rests as long as it worked: readings come first. What a report shows is read from the
standby, where one is named and has everything that was stored when the job was taken up.
"""

import asyncio
import logging
import threading
import time
from contextvars import copy_context
from datetime import UTC, datetime
from uuid import uuid4

import psycopg
from sqlalchemy.exc import DBAPIError, OperationalError
from sqlalchemy.orm import Session

from app.db.engine import Database
from app.db.outage import Outage
from app.db.replica import MustSee, Replica
from app.errors import InbandError
from app.files.documents.content import Report
from app.jobs.actions import DatabaseGone, Unit, end_failure, note_failure, paused_units
from app.language.i18n import _, speaking
from app.loop.characteristics import queries as characteristics
from app.quality.proof import queries as proof
from app.views.reports import actions, queries
from app.views.reports.bundle import MOST_BYTES, Bundle, Part, file_name, packed

log = logging.getLogger(__name__)

EVERY = 2.0  # s between two looks for something to do
LONGEST_REST = 1.0  # s
NAME = "making_reports"  # as periodic jobs have one, where it fails
LOCK = "'report_job'::regclass::oid::int4, %s"
"""Key of a job's advisory lock. Each plant has a table of its own, and so numbers of its own."""


class ReportWorker:
    """Makes reports in one process."""

    def __init__(self, database: Database, replica: Replica | None = None, every: float = EVERY) -> None:
        self._database = database
        self._replica = replica
        self._every = every
        self._closing = threading.Event()
        self._wake = threading.Event()
        self._thread: threading.Thread | None = None
        self._outage = Outage(log, "reports")

    def start(self) -> None:
        """Begin to look for something to do."""
        self._thread = threading.Thread(target=copy_context().run, args=(self._go,), name="reports", daemon=True)
        self._thread.start()

    def wake(self) -> None:
        """There is something to do now."""
        self._wake.set()

    async def stop(self) -> None:
        """End after the characteristic that is being worked on; the rest is somebody else's, or tomorrow's."""
        self._closing.set()
        self._wake.set()
        if self._thread is not None:
            await asyncio.to_thread(self._thread.join, 10)

    def _go(self) -> None:
        while not self._closing.is_set():
            try:
                self._look()
                self._outage.is_over()
            except (psycopg.Error, OperationalError, DatabaseGone) as error:
                self._outage.goes_on(error)
            except Exception:
                log.exception("unhandled error in making reports")
            self._wake.wait(self._every)
            self._wake.clear()

    def _look(self) -> None:
        with self._database.begin() as session:
            waiting = queries.open_jobs(session)
            paused = paused_units(session, NAME, [Unit(f"reports/{number}") for number in waiting])
        if not waiting:
            return
        with self._database.connections.connect(autocommit=True, application_name="inband-reports") as ours:
            for number in waiting:
                if self._closing.is_set():
                    return
                subject = f"reports/{number}"
                if paused.get(subject) or not _taken(ours, number):
                    continue
                try:
                    self._make(number)
                    if subject in paused:
                        with self._database.begin() as session:
                            end_failure(session, NAME, Unit(subject))
                except Exception as error:  # noqa: BLE001 - recorded; one takes no other along, and is tried again later
                    note_failure(self._database, NAME, Unit(subject), error)
                finally:
                    ours.execute(f"SELECT pg_advisory_unlock({LOCK})", (number,))

    def _make(self, number: int) -> None:
        token = uuid4().hex
        with self._database.begin() as session:
            stored = actions.take(session, number, token)
            ready = actions.places(queries.parts(session, number))
        if stored is None:
            return
        bundle = Bundle.of(stored)
        must_see = MustSee(written=self._replica.written() if self._replica else 0)
        proof.proof()  # what is handed over says it if an example fails; a page does not wait for that, this does
        with speaking(bundle.language):
            for place, key in enumerate(bundle.keys):
                if place in ready:
                    continue
                began = time.monotonic()
                if self._closing.is_set() or not self._one(number, token, bundle, place, key, must_see):
                    return
                self._closing.wait(min(LONGEST_REST, time.monotonic() - began))
            self._pack(number, token, bundle)

    def _one(self, number: int, token: str, bundle: Bundle, place: int, key: str, must_see: MustSee) -> bool:
        """One characteristic; what is wrong with it is written down and spoils no other. False if nobody wants it any more."""
        with self._database.begin() as session:
            if not actions.begin(session, number, token, key):
                return False
            by = queries.job(session, number).asked_by
        content, trouble = None, None
        try:
            content = bundle.part(self._report(bundle, key, by, must_see))
        except InbandError as error:
            trouble = f"{error.detail} {error.what_to_do or ''}".strip()
        except Exception as error:
            if isinstance(error, DBAPIError) and error.connection_invalidated:
                raise
            log.exception("the report of %s could not be made (reports %s)", key, number)
            trouble = _("The report could not be created; the server's log says why.")
        with self._database.begin() as session:
            return actions.keep(session, number, token, place, key, content, trouble)

    def _report(self, bundle: Bundle, key: str, by: str, must_see: MustSee) -> Report:
        """The report of one characteristic, read from the standby if it will do."""
        reading = self._replica.begin(must_see) if self._replica else None
        if self._replica is not None and reading is not None:
            try:
                with reading:
                    return _report_of(reading, bundle, key, by)
            except DBAPIError as error:  # it has ended the query, or is gone
                self._replica.failed(error)
        with self._database.begin() as session:
            return _report_of(session, bundle, key, by)

    def _pack(self, number: int, token: str, bundle: Bundle) -> None:
        with self._database.begin() as session:
            job = queries.job(session, number)
            parts = [Part(part.characteristic, part.content, part.trouble) for part in queries.parts(session, number)]
        size = sum(len(part.content or b"") for part in parts)
        if size > MOST_BYTES:
            trouble = _("The file would be larger than {n} MB: ask for fewer characteristics or sections at once.")
            with self._database.begin() as session:
                actions.fail(session, number, token, trouble.format(n=MOST_BYTES // 1_000_000))
            return
        try:
            whole = packed(bundle.form, parts, job.asked_at)
        except Exception:
            log.exception("the file of reports %s could not be put together", number)
            with self._database.begin() as session:
                actions.fail(session, number, token, _("The file could not be created; the server's log says why."))
            return
        with self._database.begin() as session:
            actions.finish(session, number, token, file_name(number, bundle.form), whole)


def _report_of(session: Session, bundle: Bundle, key: str, by: str) -> Report:
    current = characteristics.characteristic_named(session, key)
    return queries.report_of(session, current, bundle.request, datetime.now(UTC), by)


def _taken(ours: "psycopg.Connection[tuple[object, ...]]", number: int) -> bool:
    row = ours.execute(f"SELECT pg_try_advisory_lock({LOCK})", (number,)).fetchone()
    return row is not None and bool(row[0])
