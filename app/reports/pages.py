"""Page: the report of one characteristic, with what it is made of chosen at the top."""

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Annotated, Any
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request, Response
from markupsafe import Markup

from app.characteristics import queries as characteristics
from app.errors import InbandError, Invalid
from app.paper.content import Format, Paper, Picture
from app.paper.drawing import drawing_of, svg
from app.proof import queries as proof
from app.proof import wording as proof_wording
from app.reports import queries
from app.reports.asking import EVERYTHING, LAST, SectionName, Wishes, typed
from app.web.deps import SessionDep, require
from app.web.forms import by_field
from app.web.i18n import _
from app.web.templates import page

router = APIRouter(include_in_schema=False)
RUNS = ("200", "1000", "5000", "all")
FIELDS = ("from", "to", "last", "timezone", "paper")


@router.get("/characteristics/{characteristic}/report", dependencies=[require("viewer")])
def report_page(
    request: Request,
    session: SessionDep,
    characteristic: str,
    section: Annotated[list[str] | None, Query()] = None,
) -> Response:
    """The report as it is printed, and its files."""
    standing = characteristics.characteristic_named(session, characteristic)
    given = {name: request.query_params.get(name, "")[:100] for name in FIELDS}
    try:
        wishes, problem = typed(given, section or ()), None
    except Invalid as error:
        wishes, problem = Wishes(), error
    report = None if problem else queries.report_of(session, standing, wishes, datetime.now(UTC))
    failing = proof.failing()
    return page(
        request,
        "reports/report.html",
        status=problem.status if problem else 200,
        characteristic=standing.characteristic,
        machine=standing.machine,
        report=report,
        wishes=wishes,
        given=given,
        errors=_errors(problem),
        sections=[(name.value, queries.title_of(name), name in wishes.sections) for name in SectionName],
        papers=[(Paper.A4.value, "A4"), (Paper.LETTER.value, "Letter")],
        runs=_runs(standing.characteristic.key, given, wishes),
        files=[
            (
                each.value,
                each.value.upper(),
                f"/api/v1/characteristics/{standing.characteristic.key}/report.{each.value}?{_query(wishes)}",
            )
            for each in Format
        ],
        picture=picture,
        everything=EVERYTHING,
        proof_failing=failing,
        proof_warning=proof_wording.warning(len(failing)),
    )


def picture(found: Picture) -> Markup:
    """A chart of the report, drawn here: the page prints it as the PDF has it."""
    return Markup(svg(drawing_of(found.figure, found.width, found.height), found.says, f"chart-{found.key}"))  # noqa: S704 - svg() escapes


def _errors(problem: InbandError | None) -> Mapping[str, str]:
    return by_field(problem) if problem else {}


def _runs(key: str, given: Mapping[str, str], wishes: Wishes) -> list[tuple[str, str, bool]]:
    """Links to usual periods."""
    kept = {name: given[name] for name in ("timezone", "paper") if given[name]}
    timed = wishes.start is not None or wishes.end is not None
    now = "all" if wishes.last == EVERYTHING else str(wishes.last or LAST)
    return [
        (
            _("All") if run == "all" else run,
            f"/characteristics/{key}/report?{urlencode({'last': run} | kept)}",
            not timed and run == now,
        )
        for run in RUNS
    ]


def _query(wishes: Wishes) -> str:
    """The same wishes as the API takes them."""
    named: dict[str, Any] = {
        "from": wishes.start.isoformat() if wishes.start else None,
        "to": wishes.end.isoformat() if wishes.end else None,
        "last": "all" if wishes.last == EVERYTHING else wishes.last,
        "paper": None if wishes.paper is Paper.A4 else wishes.paper.value,
        "timezone": None if wishes.zone == "UTC" else wishes.zone,
    }
    chosen = [] if len(wishes.sections) == len(SectionName) else [name.value for name in wishes.sections]
    return urlencode(
        {name: value for name, value in named.items() if value is not None} | {"section": chosen}, doseq=True
    )
