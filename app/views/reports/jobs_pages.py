"""Page: many reports at once – choose, watch, fetch, cancel."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Annotated

from fastapi import APIRouter, Header, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.datastructures import FormData
from starlette.responses import RedirectResponse

from app.access.deps import Caller, Viewer
from app.core.context import Chosen, ContextField
from app.errors import InbandError, Invalid
from app.files.documents.content import Paper
from app.language.i18n import _, current_language
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries.wording import context_form, context_words
from app.quality.proof import queries as proof
from app.quality.proof import wording as proof_wording
from app.views.reports import actions, queries
from app.views.reports.actions import KEPT_DAYS
from app.views.reports.bundle import Bundle
from app.views.reports.jobs_api import Number, report_worker
from app.views.reports.request import SectionName, context_of, typed
from app.web.deps import Before, SessionDep, texts
from app.web.paging import address, part_of
from app.web.templates import page
from app.web.usual_periods import with_preset

router = APIRouter(include_in_schema=False)
SHOWN = 30
MOST_SHOWN = 2_000  # characteristics that are offered


@router.get("/reports")
def reports_page(
    request: Request,
    session: SessionDep,
    caller: Viewer,
    characteristic: Annotated[list[str] | None, Query()] = None,
    before: Before = None,
    x_live_part: Annotated[str | None, Header()] = None,
) -> Response:
    """Requests for reports, and a form for a new one."""
    return _page(request, session, caller, chosen=characteristic or (), before=before, part=x_live_part)


@router.post("/reports")
async def send_request(request: Request, session: SessionDep, caller: Viewer) -> Response:
    """Ask for reports."""
    from starlette.concurrency import run_in_threadpool

    form = await request.form()
    return await run_in_threadpool(_send, request, session, caller, form)


def _send(request: Request, session: Session, caller: Caller, form: FormData) -> Response:
    fields = texts(form)
    fields = with_preset(fields, fields.get("preset"))
    keys = [value for value in form.getlist("characteristic") if isinstance(value, str)]
    try:
        report_request = typed(fields, [value for value in form.getlist("section") if isinstance(value, str)])
        form_of = fields.get("format", "pdf")
        if form_of not in FORMATS:
            raise Invalid(_("There is no such form of report."), _("Choose one of the list."))
        with session.begin_nested():
            actions.ask(session, Bundle(report_request, form_of, keys, (), current_language()), caller)  # type: ignore[arg-type]
    except InbandError as error:
        return _page(request, session, caller, chosen=keys, given=fields, refusal=error)
    report_worker(request).wake()
    return RedirectResponse("/reports#jobs", 303)


@router.post("/reports/{number}/cancel")
def send_cancellation(request: Request, session: SessionDep, caller: Viewer, number: Number) -> Response:
    """Cancel one."""
    return _ended(request, session, caller, number, actions.cancel)


@router.post("/reports/{number}/throw-away")
def send_to_the_bin(request: Request, session: SessionDep, caller: Viewer, number: Number) -> Response:
    """Delete one that is finished."""
    return _ended(request, session, caller, number, actions.throw_away)


def _ended(
    request: Request, session: Session, caller: Caller, number: Number, end: Callable[[Session, int, Caller], object]
) -> Response:
    try:
        with session.begin_nested():
            end(session, number, caller)
    except InbandError as error:
        if error.status == 404:
            raise
        return _page(request, session, caller, refusal=error)
    return RedirectResponse("/reports#jobs", 303)


FORMATS = ("pdf", "xlsx", "csv", "workbook")


def _page(
    request: Request,
    session: Session,
    caller: Caller,
    *,
    chosen: Sequence[str] = (),
    given: dict[str, str] | None = None,
    refusal: InbandError | None = None,
    before: int | None = None,
    part: str | None = None,
) -> Response:
    failing = proof.failing()
    rows = queries.jobs(session, before=before, limit=SHOWN + 1)
    jobs = part_of(rows, SHOWN, before, lambda job: job.id, partial(address, "/reports"))
    return page(
        request,
        "reports/jobs.html",
        refusal=refusal,
        jobs=jobs,
        troubles={job.id: queries.troubles(session, job.id) for job in jobs.rows if job.problems},
        may_cancel=lambda job: queries.may_end(job, caller),
        state_word=state_word,
        of_context=context_form({field: [] for field in ContextField}, _typed_context(given or {})),
        only=lambda job: context_words(context_of(job.request.get("context", {}))),
        wanted=lambda name: part is None or part == name,
        machines=_by_machine(session) if part is None else [],
        chosen=set(chosen),
        given=given or {},
        sections=[(name.value, queries.title_of(name)) for name in SectionName],
        papers=[(Paper.A4.value, "A4"), (Paper.LETTER.value, "Letter")],
        forms=[
            ("pdf", _("PDF for each, in a ZIP")),
            ("xlsx", _("XLSX for each, in a ZIP")),
            ("csv", _("CSV for each, in a ZIP")),
            ("workbook", _("One XLSX with a sheet for each")),
        ],
        kept_days=KEPT_DAYS,
        everything=10**9,  # more readings than a characteristic has
        proof_failing=failing,
        proof_warning=proof_wording.warning(len(failing)),
    )


def _typed_context(given: dict[str, str]) -> Chosen:
    """The context as it was typed, right or wrong."""
    return tuple((field, value) for field in ContextField if (value := given.get(f"context.{field.value}", "")))


def _by_machine(session: Session) -> list[tuple[str, list[CurrentCharacteristic]]]:
    """Characteristics under their machines."""
    by_machine: dict[str, list[CurrentCharacteristic]] = {}
    for current in characteristics.characteristics(session, limit=MOST_SHOWN):
        by_machine.setdefault(current.machine.name, []).append(current)
    return sorted(by_machine.items())


def state_word(state: str) -> str:
    """State of a request in a word."""
    return {
        "queued": _("Waits"),
        "running": _("Being made"),
        "done": _("Done"),
        "failed": _("Failed"),
        "cancelled": _("Cancelled"),
    }.get(state, state)
