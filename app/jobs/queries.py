"""Last runs of the periodic jobs, and the units of work that fail. Never writes."""

from collections.abc import Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.jobs.tables import JobFailure, JobRun


def runs(session: Session) -> dict[str, JobRun]:
    """The last run of each job that has run."""
    return {run.job: run for run in session.scalars(select(JobRun))}


def failures(session: Session, limit: int | None = None) -> Sequence[JobFailure]:
    """Units of work that fail, the longest first."""
    return session.scalars(select(JobFailure).order_by(JobFailure.first_at, JobFailure.subject).limit(limit)).all()


def failures_by_characteristic(session: Session, machine_id: int | None = None) -> dict[int, list[JobFailure]]:
    """Failures that concern a characteristic, by its number."""
    query = select(JobFailure).where(JobFailure.characteristic_id.is_not(None)).order_by(JobFailure.first_at)
    if machine_id is not None:
        query = query.where(JobFailure.machine_id == machine_id)
    failing: dict[int, list[JobFailure]] = {}
    for failure in session.scalars(query):
        failing.setdefault(failure.characteristic_id or 0, []).append(failure)
    return failing


def failures_of(session: Session, machine_id: int, characteristic_id: int) -> Sequence[JobFailure]:
    """Failures that concern one characteristic."""
    return session.scalars(
        select(JobFailure)
        .where(JobFailure.machine_id == machine_id, JobFailure.characteristic_id == characteristic_id)
        .order_by(JobFailure.first_at)
    ).all()
