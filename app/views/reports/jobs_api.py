"""JSON routes: many reports at once, made in the background."""

from typing import Annotated, Any

from fastapi import Path, Request, Response

from app.access.audit.actions import record
from app.access.deps import Viewer, require
from app.views.reports import actions, queries
from app.views.reports.bundle import media_type
from app.views.reports.jobs_schemas import ReportsIn, ReportsOut
from app.views.reports.worker import ReportWorker
from app.web.api import Limit, SerialBefore, api_router, problems
from app.web.deps import SessionDep
from app.web.downloads import download
from app.web.fields import LARGEST_SERIAL, Page, page_of

router = api_router("reports")

Number = Annotated[int, Path(ge=1, le=LARGEST_SERIAL, description="The number of the request for reports.")]
FILE: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The file: a ZIP, or an XLSX workbook",
        "content": {
            media: {"schema": {"type": "string", "format": "binary"}, "example": "(the file)"}
            for media in (media_type("pdf"), media_type("workbook"))
        },
    }
}


def report_worker(request: Request) -> ReportWorker:
    """The thread of this server that has them made."""
    worker: ReportWorker = request.app.state.report_worker
    return worker


@router.post("/reports", status_code=201, responses=problems(429))
def ask_for_reports(request: Request, session: SessionDep, caller: Viewer, given: ReportsIn) -> ReportsOut:
    """Reports of many characteristics in one file. They are made in the background; `GET /reports/{id}` says how far.

    A characteristic whose report cannot be made spoils no other: it is named in the summary with why.
    """
    job = actions.ask(session, given.bundle(), caller)
    report_worker(request).wake()
    return ReportsOut.of(job)


@router.get("/reports", dependencies=[require("viewer")])
def list_reports(
    session: SessionDep,
    before: SerialBefore = None,
    limit: Limit = 100,
) -> Page[ReportsOut]:
    """All requests for reports, newest first; finished ones for a week."""
    page = page_of(queries.jobs(session, before=before, limit=limit + 1), limit, lambda job: job.id)
    return Page(items=[ReportsOut.of(job) for job in page.items], next=page.next)


@router.get("/reports/{number}", dependencies=[require("viewer")], responses=problems(404))
def get_reports(session: SessionDep, number: Number) -> ReportsOut:
    """Progress of one request for reports, and the characteristics without one."""
    return ReportsOut.of(queries.job(session, number), queries.troubles(session, number))


@router.post("/reports/{number}/cancel", responses=problems(404, 409))
def cancel_reports(session: SessionDep, caller: Viewer, number: Number) -> ReportsOut:
    """End it. Anyone who asked for it may, and every engineer. What is ready of it is thrown away."""
    return ReportsOut.of(actions.cancel(session, number, caller))


@router.delete("/reports/{number}", status_code=204, responses=problems(404, 409))
def throw_reports_away(session: SessionDep, caller: Viewer, number: Number) -> None:
    """Delete finished reports with their file, before their time is over."""
    actions.throw_away(session, number, caller)


@router.get(
    "/reports/{number}/file",
    responses=problems(404, 409) | FILE,
    response_model=None,
    response_class=Response,
)
def get_reports_file(session: SessionDep, caller: Viewer, number: Number) -> Response:
    """The file, once they are done."""
    job = queries.job(session, number)
    content = queries.content(session, job)
    record(session, caller.name, "reports fetched", f"reports/{number}")
    return download(content, job.file_name or f"reports-{job.id}", media_type(job.request["format"]))
