"""JSON routes: one report as JSON, PDF, XLSX or CSV."""

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import Depends, Path, Query, Response

from app.characteristics import queries as characteristics
from app.paper.content import Format, Paper, Report
from app.paper.files import MEDIA_TYPES, file_name, file_of
from app.paper.schemas import ReportOut
from app.people.callers import Caller
from app.reports import queries
from app.reports.asking import EVERYTHING, SectionName, Wishes, section_names
from app.web.api import api_router, problems
from app.web.deps import AnyCaller, SessionDep
from app.web.downloads import download
from app.web.fields import Moment

router = api_router("reports")

CharacteristicKey = Annotated[str, Path(description="The key of the characteristic.", examples=["shaft-d40"])]
FILE: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The report as a file",
        "content": {
            media.partition(";")[0]: {"schema": {"type": "string", "format": "binary"}, "example": "(the file)"}
            for media in MEDIA_TYPES.values()
        },
    }
}


def asked(
    start: Annotated[
        Moment | None, Query(alias="from", description="Measured at this moment or later.", examples=[None])
    ] = None,
    end: Annotated[
        Moment | None, Query(alias="to", description="Measured at this moment or earlier.", examples=[None])
    ] = None,
    last: Annotated[
        str | None,
        Query(
            pattern=r"^([1-9][0-9]{0,17}|all)$",
            description="Only of the last so many readings, or of `all`; without any period of the last 1000.",
        ),
    ] = None,
    section: Annotated[
        Sequence[SectionName], Query(description="Only these sections; all of them where none is named.", examples=[[]])
    ] = (),
    paper: Annotated[Paper, Query(description="For the PDF.")] = Paper.A4,
    timezone: Annotated[
        str, Query(max_length=64, description="In which moments are written.", examples=["Europe/Belgrade"])
    ] = "UTC",
) -> Wishes:
    """What a report is to be made of."""
    many = EVERYTHING if last == "all" else int(last) if last else None
    return Wishes(start, end, many, section_names(section), paper, timezone)


Asked = Annotated[Wishes, Depends(asked)]


def made(session: SessionDep, caller: Caller, characteristic: str, wishes: Wishes) -> Report:
    """The report, if the caller may see it."""
    standing = characteristics.characteristic_named(session, characteristic)
    caller.must_at(standing.machine.id, "viewer")
    return queries.report_of(session, standing, wishes, datetime.now(UTC))


@router.get("/characteristics/{characteristic}/report.json", responses=problems(404))
def get_report(session: SessionDep, caller: AnyCaller, characteristic: CharacteristicKey, wishes: Asked) -> ReportOut:
    """A report of a characteristic and a period: numbers, capability, wear, corrections, alarms, parameters, decisions.

    Tables hold the newest rows; `more` says how many are left out.
    """
    return ReportOut.of(made(session, caller, characteristic, wishes))


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
    wishes: Asked,
) -> Response:
    """The same report as a file to print, to work on, or to read by a program (CSV: one line per value)."""
    report = made(session, caller, characteristic, wishes)
    return download(file_of(report, form, wishes.paper), file_name(report, form), MEDIA_TYPES[form])
