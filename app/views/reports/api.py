"""JSON routes: one report as JSON, PDF, XLSX or CSV."""

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import Depends, Path, Query, Request, Response

from app.access.audit.actions import record
from app.access.callers import Caller
from app.access.deps import AnyCaller
from app.files.documents.content import Format, Paper, Report
from app.files.documents.files import MEDIA_TYPES, file_name, file_of
from app.files.documents.schemas import ReportOut
from app.files.formats import periods
from app.language.times import plant_zone
from app.loop.characteristics import queries as characteristics
from app.quality.capability.kinds import SigmaBy
from app.quality.capability.request import OfSigma
from app.views.reports import queries
from app.views.reports.request import EVERYTHING, ReportRequest, SectionName, section_names, zone_or_plants
from app.web.api import CharacteristicKey, api_router, problems
from app.web.choice import InContext, InPeriod
from app.web.deps import FROM_REPLICA, SessionDep
from app.web.downloads import download

router = api_router("reports", FROM_REPLICA)

FILE: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The report as a file",
        "content": {
            media.partition(";")[0]: {"schema": {"type": "string", "format": "binary"}, "example": "(the file)"}
            for media in MEDIA_TYPES.values()
        },
    }
}


def request_from_query(
    request: Request,
    period: InPeriod,
    context: InContext,
    last: Annotated[
        str | None,
        Query(
            pattern=r"^([1-9][0-9]{0,17}|all)$",
            description="Only of the last N readings, or of `all`; without period and context of the last 1000.",
        ),
    ] = None,
    section: Annotated[
        Sequence[SectionName], Query(description="Only these sections; all of them where none is named.", examples=[[]])
    ] = (),
    paper: Annotated[Paper, Query(description="For the PDF.")] = Paper.A4,
    timezone: Annotated[
        str | None,
        Query(
            max_length=64,
            description="In which moments are written; the plant's if left out.",
            examples=["Europe/Belgrade"],
        ),
    ] = None,
    sigma_by: OfSigma = SigmaBy.NEIGHBOURS,
) -> ReportRequest:
    """Request for a report, from the query; a day is one of the time zone that is named, as in a command."""
    zone = zone_or_plants(timezone)
    if timezone and zone.key == timezone:
        period = periods.period_of(request.query_params, zone)
    many = EVERYTHING if last == "all" else int(last) if last else None
    return ReportRequest(period, many, section_names(section), paper, timezone or plant_zone().key, sigma_by, context)


ReportQuery = Annotated[ReportRequest, Depends(request_from_query)]


def report_for(session: SessionDep, caller: Caller, characteristic: str, report_request: ReportRequest) -> Report:
    """The report, if the caller may see it."""
    current = characteristics.characteristic_for(session, caller, characteristic, "viewer")
    return queries.report_of(session, current, report_request, datetime.now(UTC), caller.name)


@router.get("/characteristics/{characteristic}/report.json", responses=problems(404))
def get_report(
    session: SessionDep, caller: AnyCaller, characteristic: CharacteristicKey, report_request: ReportQuery
) -> ReportOut:
    """A report of a characteristic and a period: numbers, capability, wear, corrections, alarms, parameters, decisions.

    Tables hold the newest rows; `more` says how many are left out.
    """
    return ReportOut.of(report_for(session, caller, characteristic, report_request))


@router.get(
    "/characteristics/{characteristic}/report.{form}",
    responses=problems(404) | FILE,
    response_model=None,
    response_class=Response,
)
def get_report_file(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    form: Annotated[Format, Path(description="How it is written.", examples=["pdf"])],
    report_request: ReportQuery,
) -> Response:
    """The same report as a file to print, to work on, or to read by a program (CSV: one line per value)."""
    report = report_for(session, caller, characteristic, report_request)
    record(session, caller.name, "report written", f"characteristic/{characteristic}", after={"format": form.value})
    return download(file_of(report, form, report_request.paper), file_name(report, form), MEDIA_TYPES[form])
