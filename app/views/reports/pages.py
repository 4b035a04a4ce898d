"""Page: the report of one characteristic, with what it is made of chosen at the top."""

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Annotated, Any
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request, Response
from markupsafe import Markup

from app.access.deps import Viewer
from app.charts import svg, to_drawing
from app.errors import InbandError, Invalid
from app.files.documents.content import Format, Paper, Picture
from app.language.i18n import _
from app.loop.characteristics import queries as characteristics
from app.loop.summaries import queries as summaries
from app.loop.summaries import wording as statistics
from app.quality.proof import queries as proof
from app.quality.proof import wording as proof_wording
from app.views.reports import queries
from app.views.reports.request import EVERYTHING, ReportRequest, SectionName, typed
from app.web.choice import InContext, context_in_address, in_address
from app.web.deps import FROM_REPLICA, SessionDep
from app.web.forms import by_field
from app.web.templates import page
from app.web.usual_periods import with_preset

router = APIRouter(include_in_schema=False, dependencies=[FROM_REPLICA])
RUNS = ("200", "1000", "5000", "all")
FIELDS = ("from", "to", "last", "timezone", "paper")
HANDED_OVER = (
    SectionName.SUMMARY,
    SectionName.NUMBERS,
    SectionName.CAPABILITY,
    SectionName.CHART,
    SectionName.PARAMETERS,
)
"""Sections where none is chosen: the first page, and what it rests on. Lists of what happened are appendices that one chooses."""


@router.get("/characteristics/{characteristic}/report")
def report_page(
    request: Request,
    session: SessionDep,
    caller: Viewer,
    characteristic: str,
    context: InContext,
    section: Annotated[list[str] | None, Query()] = None,
) -> Response:
    """The report as it is printed, and its files."""
    current = characteristics.characteristic_named(session, characteristic)
    tool_since = summaries.tool_since(session, current.characteristic)
    typed_fields = with_preset(
        {name: request.query_params.get(name, "")[:100] for name in FIELDS},
        request.query_params.get("preset"),
        tool_since,
    )
    try:
        report_request, problem = typed(typed_fields, section or HANDED_OVER, context), None
    except Invalid as error:
        report_request, problem = ReportRequest(), error
    report = None if problem else queries.report_of(session, current, report_request, datetime.now(UTC), caller.name)
    failing = proof.failing()
    return page(
        request,
        "reports/report.html",
        status=problem.status if problem else 200,
        characteristic=current.characteristic,
        machine=current.machine,
        report=report,
        report_request=report_request,
        given=typed_fields,
        tool_since=tool_since,
        of_context=statistics.context_form(summaries.offered(session, current.characteristic), context),
        errors=_errors(problem),
        sections=[(name.value, queries.title_of(name), name in report_request.sections) for name in SectionName],
        papers=[(Paper.A4.value, "A4"), (Paper.LETTER.value, "Letter")],
        runs=_runs(current.characteristic.key, typed_fields, report_request),
        files=[
            (
                form.value,
                form.value.upper(),
                f"/api/v1/characteristics/{current.characteristic.key}/report.{form.value}?{_query(report_request)}",
            )
            for form in Format
        ],
        picture=picture,
        everything=EVERYTHING,
        proof_failing=failing,
        proof_warning=proof_wording.warning(len(failing)),
    )


def picture(chart: Picture) -> Markup:
    """A chart of the report, drawn here: the page prints it as the PDF has it."""
    return Markup(svg(to_drawing(chart.figure, chart.width, chart.height), chart.says, f"chart-{chart.key}"))  # noqa: S704 - svg() escapes


def _errors(problem: InbandError | None) -> Mapping[str, str]:
    return by_field(problem) if problem else {}


def _runs(key: str, typed_fields: Mapping[str, str], report_request: ReportRequest) -> list[tuple[str, str, bool]]:
    """Links to usual periods."""
    unchanged = {name: typed_fields[name] for name in ("timezone", "paper") if typed_fields[name]}
    unchanged |= context_in_address(report_request.context)
    timed = report_request.period.bounded
    now = "all" if report_request.newest in (None, EVERYTHING) else str(report_request.newest)
    return [
        (
            _("All") if run == "all" else run,
            f"/characteristics/{key}/report?{urlencode({'last': run} | unchanged)}",
            not timed and run == now,
        )
        for run in RUNS
    ]


def _query(report_request: ReportRequest) -> str:
    """The same request as the API takes them."""
    named: dict[str, Any] = {
        **in_address(report_request.period),
        **context_in_address(report_request.context),
        "last": "all" if report_request.last == EVERYTHING else report_request.last,
        "paper": None if report_request.paper is Paper.A4 else report_request.paper.value,
        "timezone": report_request.zone,
    }
    chosen = (
        [] if len(report_request.sections) == len(SectionName) else [name.value for name in report_request.sections]
    )
    return urlencode(
        {name: value for name, value in named.items() if value is not None} | {"section": chosen}, doseq=True
    )
