"""Running periodic jobs, unit by unit, and keeping a record of what fails."""

import logging
import time
from collections.abc import Callable, Sequence
from datetime import timedelta
from typing import NamedTuple

from sqlalchemy import delete, func, select
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.exc import DBAPIError
from sqlalchemy.orm import Session

from app.db.engine import Database
from app.db.events import publish
from app.errors import InbandError
from app.jobs.tables import JobFailure, JobRun

log = logging.getLogger(__name__)

FIRST_PAUSE, LONGEST_PAUSE = timedelta(minutes=1), timedelta(hours=1)
"""Before a unit that failed is tried again: each pause is twice the one before it, up to the longest."""
MOST = 1000
"""Units of one job that are done in a row; what is left waits for the next minute, so that no job keeps another waiting."""
LONGEST_ERROR = 500  # characters that are kept of an error


class Unit(NamedTuple):
    """One unit of work: what it concerns (`characteristic/shaft-d40`), and its key, whatever the job needs to find it."""

    subject: str
    key: tuple[int | str, ...] = ()
    machine_id: int | None = None
    characteristic_id: int | None = None


WHOLE = Unit("")
"""The unit of a job that is one statement, and of listing what is due."""


def whole(_session: Session) -> list[Unit]:
    """Due units of a job that is done as a whole: one."""
    return [WHOLE]


class PeriodicJob(NamedTuple):
    """A periodic job: work that is looked for once a minute.

    name: stable, as log and metrics have it. due: every unit that has something to do, without a lock; most often there is
    none. do: one unit, in a transaction of its own. What it changes it locks with one call of `lock_machines`, like
    everybody; then it looks again whether it is still due. Done again it changes nothing.
    """

    name: str
    due: Callable[[Session], Sequence[Unit]]
    do: Callable[[Session, Unit], object]


class DatabaseGone(Exception):
    """The database cannot be reached: nothing is wrong with a unit of work."""


def run_jobs(database: Database, jobs: Sequence[PeriodicJob]) -> None:
    """Do every job once."""
    for job in jobs:
        run_job(database, job)


def run_job(database: Database, job: PeriodicJob, stop: Callable[[], bool] = lambda: False) -> None:
    """Do every unit of a job that is due and not paused; those that failed before come last.

    stop: asked before each unit. Raises `DatabaseGone`, nothing else.
    """
    began = time.monotonic()
    try:
        with database.begin() as session:
            units = list(job.due(session))
            paused = paused_units(session, job.name, units)
    except Exception as error:  # noqa: BLE001 - recorded and logged, whatever it is
        note_failure(database, job.name, WHOLE, error)
        return
    done = 0
    for unit in sorted(
        (unit for unit in units if not paused.get(unit.subject)), key=lambda unit: unit.subject in paused
    ):
        if stop() or done >= MOST:
            break
        try:
            with database.begin() as session:
                job.do(session, unit)
                if unit.subject in paused:
                    end_failure(session, job.name, unit)
        except Exception as error:  # noqa: BLE001 - as above
            note_failure(database, job.name, unit, error)
        done += 1
    log.debug("periodic job %s: %d of %d units done in %.3f s", job.name, done, len(units), time.monotonic() - began)
    try:
        with database.begin() as session:
            _note_run(session, job.name, time.monotonic() - began, done)
    except Exception as error:
        raise DatabaseGone(f"{job.name}: {_words(error)}") from error


def paused_units(session: Session, job: str, units: Sequence[Unit]) -> dict[str, bool]:
    """By the subject of what failed before: whether it is not yet to be tried again. What is not due any more has ended."""
    failing = {
        row.subject: bool(row.paused)
        for row in session.execute(
            select(JobFailure.subject, (JobFailure.retry_at > func.now()).label("paused")).where(JobFailure.job == job)
        )
    }
    for gone in failing.keys() - {unit.subject for unit in units}:
        end_failure(session, job, Unit(gone))
    return failing


def note_failure(database: Database, job: str, unit: Unit, error: Exception) -> None:
    """Record and log that a unit of work failed, and when it is tried again. Raises `DatabaseGone`.

    An error that cannot be recorded is one of the database; one that can be is the unit's, whatever it says.
    """
    words = _words(error)
    again = func.least(FIRST_PAUSE * func.power(2.0, JobFailure.failures), LONGEST_PAUSE)
    row = insert(JobFailure).values(
        job=job,
        subject=unit.subject,
        machine_id=unit.machine_id,
        characteristic_id=unit.characteristic_id,
        error=words,
        retry_at=func.now() + FIRST_PAUSE,
    )
    changed = {
        "failures": JobFailure.failures + 1,
        "error": words,
        "last_at": row.excluded.last_at,  # not now(): Citus takes no such function here
        "retry_at": row.excluded.last_at + again,
    }
    upsert = row.on_conflict_do_update(index_elements=["job", "subject"], set_=changed)
    try:
        with database.begin() as session:
            failures, retry_at = session.execute(
                upsert.returning(JobFailure.failures, JobFailure.retry_at).execution_options(synchronize_session=False)
            ).one()
            publish(session, {"kind": "job"})
    except Exception as second:
        raise DatabaseGone(f"{job} at {unit.subject or 'its list'}: {words}") from second
    log.error(
        "periodic job %s failed for %s, %d time(s) in a row, next try at %s: %s",
        job,
        unit.subject or "all",
        failures,
        retry_at.isoformat(timespec="seconds"),
        words,
        exc_info=error,
    )


def end_failure(session: Session, job: str, unit: Unit) -> None:
    """A unit of work succeeded, or is not due any more: its record ends."""
    session.execute(delete(JobFailure).where(JobFailure.job == job, JobFailure.subject == unit.subject))
    publish(session, {"kind": "job"})
    log.info("periodic job %s no longer fails for %s", job, unit.subject or "all")


def _note_run(session: Session, job: str, seconds: float, units: int) -> None:
    values = {"finished_at": func.now(), "seconds": seconds, "units": units}
    row = insert(JobRun).values(job=job, **values)
    again = {name: row.excluded[name] for name in values}
    session.execute(row.on_conflict_do_update(index_elements=["job"], set_=again))


def _words(error: Exception) -> str:
    """The error in short: what the database said of a statement, without its values."""
    if isinstance(error, InbandError):
        words = error.detail
    elif isinstance(error, DBAPIError):
        words = str(error.orig).partition("\n")[0]
    else:
        words = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    return words.replace("\0", "")[:LONGEST_ERROR]
