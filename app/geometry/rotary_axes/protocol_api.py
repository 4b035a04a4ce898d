"""JSON routes: the protocol of a run, and its files."""

from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import Path, Query, Response

from app.access.deps import AnyCaller, Caller
from app.files.documents.content import Format, Paper, Report
from app.files.documents.files import MEDIA_TYPES, file_name, file_of
from app.files.documents.schemas import ReportOut
from app.geometry.rotary_axes import queries
from app.geometry.rotary_axes.protocol import protocol_of
from app.web.api import api_router, problems
from app.web.deps import SessionDep
from app.web.downloads import download

router = api_router("kinematics")
RunNumber = Annotated[int, Path(description="Number of the run.", examples=[118])]
FILE: dict[int | str, dict[str, Any]] = {
    200: {"content": {kind: {"example": "(the file)"} for kind in MEDIA_TYPES.values()}}
}


def _protocol(session: SessionDep, caller: Caller, run: int) -> Report:
    row = queries.run(session, run)
    caller.must_at(row.machine.id, "viewer")
    return protocol_of(row, datetime.now(UTC))


@router.get("/kinematics/runs/{run}/protocol.json", responses=problems(404))
def get_kinematics_protocol(session: SessionDep, caller: AnyCaller, run: RunNumber) -> ReportOut:
    """Everything that the control's own protocol has: head, settings, and per axis angles, scatter, errors, places."""
    return ReportOut.of(_protocol(session, caller, run))


@router.get(
    "/kinematics/runs/{run}/protocol.{form}",
    responses=problems(404) | FILE,
    response_model=None,
    response_class=Response,
)
def get_kinematics_protocol_file(
    session: SessionDep,
    caller: AnyCaller,
    run: RunNumber,
    form: Annotated[Format, Path(description="How it is written.", examples=["pdf"])],
    paper: Annotated[Paper, Query(description="Of the PDF.")] = Paper.A4,
) -> Response:
    """The same as a file, with its diagrams: to print, to work on, or to read by a program."""
    report = _protocol(session, caller, run)
    return download(file_of(report, form, paper), file_name(report, form), MEDIA_TYPES[form])
