"""Many reports at once: asked for, taken up by a process, made one by one, finished, cancelled, thrown away."""

from collections.abc import Sequence
from typing import Any

from sqlalchemy import delete, func, select, text, update
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.db.events import publish
from app.errors import Conflict, FieldError, Invalid, NotAllowed, TooManyRequests
from app.jobs.actions import PeriodicJob, whole
from app.language.i18n import _
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.machines import Machine
from app.views.reports import queries
from app.views.reports.bundle import Bundle
from app.views.reports.tables import OPEN, ReportFile, ReportJob, ReportPart

MOST_AT_ONCE = 500  # characteristics
MOST_WAITING = 20  # jobs
KEPT_DAYS = 7
KEPT_BYTES = 2_000_000_000  # of all files together


def ask(session: Session, bundle: Bundle, caller: Caller) -> ReportJob:
    """Put the reports in the queue. Raises `Invalid` for what there is not, `TooManyRequests` where many wait already."""
    keys = _keys(session, bundle)
    if queries.count_open(session) >= MOST_WAITING:
        raise TooManyRequests(
            _("{n} requests for reports are waiting already.").format(n=MOST_WAITING),
            _("Wait a minute, until some of them are done, or cancel some."),
            retry_after=60,
        )
    job = ReportJob(
        asked_by=caller.name,
        person_id=caller.person_id,
        key_id=caller.key_id,
        request=bundle.stored(keys),
        total=len(keys),
    )
    session.add(job)
    session.flush()
    record(
        session,
        caller.name,
        "reports asked for",
        f"reports/{job.id}",
        after={"characteristics": len(keys), "format": bundle.form},
    )
    publish(session, _change(job.id))
    session.refresh(job)
    return job


def _keys(session: Session, bundle: Bundle) -> list[str]:
    """The keys of all characteristics that were named, and of all machines, each once, in order."""
    named, machines = list(dict.fromkeys(bundle.characteristics)), list(dict.fromkeys(bundle.machines))
    existing = set(session.scalars(select(Characteristic.key).where(Characteristic.key.in_(named))))
    known = dict(session.execute(select(Machine.key, Machine.id).where(Machine.key.in_(machines))).all())
    errors = [
        FieldError("characteristics", _("there is no characteristic {key}").format(key=repr(key)))
        for key in named
        if key not in existing
    ]
    errors += [
        FieldError("machines", _("there is no machine {key}").format(key=repr(key)))
        for key in machines
        if key not in known
    ]
    of_machines = session.scalars(
        select(Characteristic.key).where(Characteristic.machine_id.in_(known.values())).order_by(Characteristic.key)
    ).all()
    keys = list(dict.fromkeys([*named, *of_machines]))
    if not errors and not keys:
        errors = [FieldError("characteristics", _("names no characteristic; name some, or machines that have some"))]
    if len(keys) > MOST_AT_ONCE:
        errors = [
            FieldError(
                "characteristics",
                _("these are {n}; at most {most} are taken at once").format(n=len(keys), most=MOST_AT_ONCE),
            )
        ]
    if errors:
        raise Invalid(
            f"{errors[0].field}: {errors[0].message}.",
            _("Correct the named fields and send it again."),
            errors=errors[:50],
        )
    return keys


def cancel(session: Session, number: int, caller: Caller) -> ReportJob:
    """End it, no matter who works on it. Raises `Conflict` when it is finished, `NotAllowed` for those of others."""
    job = queries.job(session, number)
    _must_own(job, caller)
    ended = session.execute(
        update(ReportJob)
        .where(ReportJob.id == number, ReportJob.state.in_(OPEN))
        .values(state="cancelled", finished_at=func.now(), finished_by=caller.name, current=None)
        .returning(ReportJob.id)
    ).one_or_none()
    if ended is None:
        session.refresh(job)
        raise Conflict(
            _("Reports {number} are finished already: {state}.").format(number=number, state=job.state),
            _("There is nothing to cancel."),
        )
    session.execute(delete(ReportPart).where(ReportPart.job_id == number))
    record(session, caller.name, "reports cancelled", f"reports/{number}")
    publish(session, _change(number))
    session.refresh(job)
    return job


# --- what the process that makes them does


def take(session: Session, number: int, token: str) -> dict[str, Any] | None:
    """Take it up: from now on only who knows the token writes to it. The request, or None if it is finished."""
    return session.scalar(
        update(ReportJob)
        .where(ReportJob.id == number, ReportJob.state.in_(OPEN))
        .values(state="running", taken_by=token, started_at=func.coalesce(ReportJob.started_at, func.now()))
        .returning(ReportJob.request)
    )


def begin(session: Session, number: int, token: str, key: str) -> bool:
    """Say which characteristic is worked on. False if it was cancelled, or is someone else's by now."""
    return _still_ours(session, number, token, current=key)


def keep(
    session: Session, number: int, token: str, place: int, key: str, content: bytes | None, trouble: str | None
) -> bool:
    """Keep what is ready of one characteristic. False if it is not wanted any more."""
    if not _still_ours(session, number, token, done=place + 1):
        return False
    session.execute(
        insert(ReportPart)
        .values(job_id=number, place=place, characteristic=key, content=content, trouble=trouble)
        .on_conflict_do_nothing()
    )
    return True


def finish(session: Session, number: int, token: str, name: str, content: bytes) -> bool:
    """Keep the file. False if it is not wanted any more."""
    problems = len(queries.troubles(session, number))
    values = {"state": "done", "file_name": name, "size": len(content), "problems": problems}
    if not _still_ours(session, number, token, **values, current=None, finished_at=func.now()):
        return False
    session.execute(insert(ReportFile).values(job_id=number, content=content))
    # Why a characteristic has none stays; what is in the file need not be kept twice.
    session.execute(update(ReportPart).where(ReportPart.job_id == number).values(content=None))
    return True


def fail(session: Session, number: int, token: str, trouble: str) -> None:
    """Give it up."""
    if _still_ours(session, number, token, state="failed", trouble=trouble, current=None, finished_at=func.now()):
        session.execute(update(ReportPart).where(ReportPart.job_id == number).values(content=None))


def _still_ours(session: Session, number: int, token: str, **values: Any) -> bool:
    changed = session.scalar(
        update(ReportJob)
        .where(ReportJob.id == number, ReportJob.state == "running", ReportJob.taken_by == token)
        .values(**values)
        .returning(ReportJob.id)
    )
    if changed is None:
        return False
    publish(session, _change(number))
    return True


def _change(number: int) -> dict[str, Any]:
    return {"kind": "report", "id": number}


def drop_old(session: Session) -> None:
    """Throw away what was finished a week ago, and the oldest files where all together are too large."""
    session.execute(delete(ReportJob).where(ReportJob.finished_at < func.now() - text(f"interval '{KEPT_DAYS} days'")))
    together = func.sum(ReportJob.size).over(order_by=ReportJob.id.desc())
    running = select(ReportJob.id, together.label("bytes")).where(ReportJob.size.is_not(None)).subquery()
    session.execute(delete(ReportJob).where(ReportJob.id.in_(select(running.c.id).where(running.c.bytes > KEPT_BYTES))))


JOB = PeriodicJob("old_reports", whole, lambda session, _unit: drop_old(session))


def throw_away(session: Session, number: int, caller: Caller) -> None:
    """Delete finished reports with their file. Raises `Conflict` while they are made, `NotAllowed` for those of others."""
    job = queries.job(session, number)
    _must_own(job, caller)
    gone = session.scalar(
        delete(ReportJob).where(ReportJob.id == number, ReportJob.state.not_in(OPEN)).returning(ReportJob.id)
    )
    if gone is None:
        raise Conflict(
            _("Reports {number} are not finished yet: {state}.").format(number=number, state=job.state),
            _("Cancel them first."),
        )
    record(session, caller.name, "reports thrown away", f"reports/{number}")
    publish(session, _change(number))


def _must_own(job: ReportJob, caller: Caller) -> None:
    if not queries.may_end(job, caller):
        raise NotAllowed(
            _("{who} requested these reports.").format(who=job.asked_by),
            _("Only the person who requested them, or an engineer, may cancel and delete them."),
        )


def places(parts: Sequence[ReportPart]) -> set[int]:
    """Places of the characteristics of a job that are ready."""
    return {part.place for part in parts}
