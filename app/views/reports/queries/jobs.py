"""Reports that were asked for many at once, as they are."""

from collections.abc import Sequence

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.access.callers import Caller
from app.errors import Conflict, NotFound
from app.language.i18n import _
from app.views.reports.tables import OPEN, ReportFile, ReportJob, ReportPart
from app.web.fields import LARGEST_SERIAL


def job(session: Session, number: int) -> ReportJob:
    """One of them. Raises `NotFound`."""
    row = session.get(ReportJob, number, populate_existing=True) if 0 < number <= LARGEST_SERIAL else None
    if row is None:
        raise NotFound(
            _("There are no reports {number}.").format(number=number),
            _("Check the number; finished ones are kept for a week. GET /api/v1/reports lists them."),
        )
    return row


def may_end(job: ReportJob, caller: Caller) -> bool:
    """Tell if the caller may cancel these reports and throw them away: anyone who asked for them, and engineers."""
    if job.person_id is None and job.key_id is None:  # asked for before the numbers were kept
        own = job.asked_by == caller.name
    else:
        own = (job.person_id, job.key_id) == (caller.person_id, caller.key_id)
    return own or caller.may("engineer")


def jobs(session: Session, *, before: int | None = None, limit: int = 100) -> Sequence[ReportJob]:
    """All of them, newest first."""
    query = select(ReportJob).order_by(ReportJob.id.desc()).limit(limit).execution_options(populate_existing=True)
    return session.scalars(query if before is None else query.where(ReportJob.id < before)).all()


def open_jobs(session: Session) -> Sequence[int]:
    """The numbers of those that are not finished, the oldest first."""
    return session.scalars(select(ReportJob.id).where(ReportJob.state.in_(OPEN)).order_by(ReportJob.id).limit(50)).all()


def count_open(session: Session) -> int:
    """Number of unfinished requests."""
    return session.scalar(select(func.count()).select_from(ReportJob).where(ReportJob.state.in_(OPEN))) or 0


def content(session: Session, job: ReportJob) -> bytes:
    """The file. Raises `Conflict` while there is none."""
    whole = session.scalar(select(ReportFile.content).where(ReportFile.job_id == job.id))
    if whole is None:
        raise Conflict(
            _("Reports {number} have no file: they are {state}.").format(number=job.id, state=job.state),
            _("Wait until they are done; GET /api/v1/reports/{number} shows the state.").format(number=job.id),
        )
    return whole


def parts(session: Session, number: int) -> Sequence[ReportPart]:
    """Finished parts of a request, in order."""
    return session.scalars(select(ReportPart).where(ReportPart.job_id == number).order_by(ReportPart.place)).all()


def troubles(session: Session, number: int) -> list[tuple[str, str]]:
    """Characteristics without a report, each with why."""
    rows = session.execute(
        select(ReportPart.characteristic, ReportPart.trouble)
        .where(ReportPart.job_id == number, ReportPart.trouble.is_not(None))
        .order_by(ReportPart.place)
    )
    return [(key, why) for key, why in rows if why is not None]
