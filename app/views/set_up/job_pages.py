"""Set-up page: periodic background jobs, when each last ran, and what of them fails."""

from fastapi import APIRouter, Request, Response

from app.access.deps import Engineer
from app.jobs import queries
from app.jobs.wording import job_word, link_of
from app.views.set_up.frame import setup_page
from app.web.deps import SessionDep

router = APIRouter(include_in_schema=False)


@router.get("/setup/jobs")
def jobs_page(request: Request, session: SessionDep, caller: Engineer) -> Response:
    failing = queries.failures(session)
    runs = sorted(queries.runs(session).values(), key=lambda run: job_word(run.job))
    return setup_page(
        request,
        "jobs.html",
        caller,
        "jobs",
        failing=[(failure, job_word(failure.job), link_of(failure.subject)) for failure in failing],
        runs=[(run, job_word(run.job), sum(failure.job == run.job for failure in failing)) for run in runs],
    )
