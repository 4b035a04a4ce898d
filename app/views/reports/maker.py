"""The process that makes reports which were asked for many at once: one characteristic after the other.

The server begins it when something waits, gives it one number a line, and reads one line for each: empty when the work is done or
its failure is recorded, else why the database could not be used. It ends with the server, or when nothing more comes. It runs
behind readings: at a lower priority, with an interpreter of its own, and after each characteristic it rests as long as it worked.
What a report shows is read from the standby, where one is named and has everything that was stored when the job was taken up.
"""

import logging
import signal
import sys
import time
from datetime import UTC, datetime
from typing import TextIO
from uuid import uuid4

import psycopg
from sqlalchemy.exc import DBAPIError, OperationalError
from sqlalchemy.orm import Session

from app import __version__, logs
from app.db.connections import Connections
from app.db.engine import Database
from app.db.replica import MustSee, Replica, replica_of
from app.errors import InbandError
from app.files.apart import end_with
from app.files.documents.content import Report
from app.jobs.actions import DatabaseGone, Unit, end_failure, note_failure, paused_units
from app.language.i18n import _, speaking
from app.language.times import use_zone
from app.loop.characteristics import queries as characteristics
from app.quality.proof import queries as proof
from app.settings import Settings
from app.views.reports import actions, queries
from app.views.reports.bundle import MOST_BYTES, Bundle, Part, file_name, packed

log = logging.getLogger(__name__)

LONGEST_REST = 1.0  # s
NAME = "making_reports"  # as periodic jobs have one, where it fails
PROVED = f"proved {__version__}"


class Maker:
    """Makes reports."""

    def __init__(self, database: Database, replica: Replica | None = None) -> None:
        self._database = database
        self._replica = replica

    def do(self, number: int) -> None:
        """Make the reports of this number; a failure is recorded, and they are tried again later. Raises `DatabaseGone`."""
        unit = Unit(f"reports/{number}")
        try:
            self._make(number)
            with self._database.begin() as session:
                if unit.subject in paused_units(session, NAME, [unit]):
                    end_failure(session, NAME, unit)
        except Exception as error:  # noqa: BLE001 - recorded; one takes no other along
            note_failure(self._database, NAME, unit, error)

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
                if not self._one(number, token, bundle, place, key, must_see):
                    return
                time.sleep(min(LONGEST_REST, time.monotonic() - began))
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


def settings_from(words: TextIO) -> Settings:
    """Settings of the server; it says as well if its engine has proved itself, which is this one."""
    settings = Settings.model_validate_json(words.readline())
    if words.readline().strip() == PROVED:
        proof.passed_elsewhere()
    return settings


def main() -> None:
    """Take the settings of the server, then numbers of reports, from standard input."""
    end_with(int(sys.argv[1]))
    answers, sys.stdout = sys.stdout, sys.stderr
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the server ends this process
    settings = settings_from(sys.stdin)
    logs.configure(settings.log_level, settings.log_format)
    use_zone(settings)
    with Connections(settings.database_url or "", settings.database_patience) as connections:
        database = Database(
            settings.database_url or "", pool_size=2, application_name="inband-reports", connections=connections
        )
        replica = replica_of(settings, database, pool_size=1)
        if replica is not None:
            replica.look()
            replica.start()
        maker = Maker(database, replica)
        for line in sys.stdin:
            trouble = ""
            try:
                maker.do(int(line))
            except (psycopg.Error, OperationalError, DatabaseGone) as error:
                trouble = str(error).replace("\n", " ")
            answers.write(f"{trouble}\n")
            answers.flush()
