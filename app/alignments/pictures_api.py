"""JSON routes: pictures of alignments, and their text as a file."""

from typing import Annotated, Any

import numpy as np
from fastapi import Path, Query, Response
from fastapi.responses import PlainTextResponse
from sqlalchemy.orm import Session

from app.alignments import figures, queries, trends
from app.alignments.answers import TEXT, program_of
from app.alignments.tables import Alignment
from app.errors import NotFound
from app.machines.queries import machine_named, machine_of
from app.machines.wording import file_name, no_such_offset
from app.web.api import api_router, plain, problems
from app.web.deps import AnyCaller, SessionDep
from app.web.downloads import download
from app.web.fields import Control
from app.web.i18n import _
from app.web.theme import ThemeName, theme_from

router = api_router("alignments")
Number = Annotated[int, Path(description="Number of the alignment.", examples=[7])]
Theme = Annotated[str | None, Query(description="`light` or `dark`", max_length=20)]
FIGURE: dict[int | str, dict[str, Any]] = {
    200: {"content": {"application/json": {"example": {"data": [], "layout": {}}}}}
}
# Where a set-up that was composed has no touches of its own: a cube of 100 mm shows how it lies.
CUBE = [figures.Drawn(at, at, 0.0) for at in ([50.0, 0.0, 0.0], [0.0, 50.0, 0.0], [0.0, 0.0, 50.0])]


@router.get("/alignments/{number}/figure", responses=problems(404) | FIGURE)
def alignment_figure(session: SessionDep, caller: AnyCaller, number: Number, theme: Theme = None) -> dict[str, Any]:
    """The part as it should lie and as it does as a Plotly figure, with its touches; displacements enlarged."""
    return _drawn(session, queries.alignment(session, number, caller.only_machine), theme_from(theme))


def _drawn(session: Session, found: Alignment, theme: ThemeName) -> dict[str, Any]:
    given, motion = found.given, np.array(found.result["matrix"])
    if found.kind == "points":
        return figures.part_figure(motion, figures.touches_of(given, found.result), theme=theme)
    if found.kind == "two_points":
        nominal, measured = ([pair[name] for pair in given["side"]] for name in ("nominal", "measured"))
        return figures.plane_figure(motion, nominal, measured, theme)
    if found.kind == "two_holes":
        centres = [hole["centre"] for hole in found.result["holes"]]
        return figures.plane_figure(motion, [hole["nominal"] for hole in given["holes"]], centres, theme)
    on_it = None if found.part_id is None else queries.alignment(session, found.part_id)
    if on_it is None or on_it.kind != "points":
        return figures.part_figure(motion, CUBE, theme=theme)
    touches = []
    for each in figures.touches_of(on_it.given, on_it.result):
        moved = (motion @ [*each.place, 1.0])[:3] - each.place
        touches.append(figures.Drawn(each.place, each.normal, float(moved @ np.array(each.normal))))
    return figures.part_figure(motion, touches, theme=theme)


@router.get("/alignments/{number}/program", responses=problems(404) | plain(TEXT), response_class=PlainTextResponse)
def write_alignment(
    session: SessionDep,
    caller: AnyCaller,
    number: Number,
    control: Annotated[
        Control | None, Query(description="For which control; if left out, that of the machine.")
    ] = None,
) -> Response:
    """The text that puts the frame where the part lies, for the machine's control or another. Running it twice changes nothing."""
    found = queries.alignment(session, number, caller.only_machine)
    machine = machine_of(session, found.machine_id)
    text = program_of(found, machine, control)
    if text is None:
        raise no_such_offset(found.given.get("work_offset", ""))
    return download(text, file_name(control or machine.control, f"{machine.key}-alignment-{found.id}"))


@router.get("/machines/{machine}/alignments/figure", responses=problems(404) | FIGURE)
def alignment_trend_figure(
    session: SessionDep,
    caller: AnyCaller,
    machine: Annotated[str, Path(description="The key of the machine.", examples=["mill-1"])],
    name: Annotated[
        str,
        Query(description="The name that alignments were given.", min_length=1, max_length=200, examples=["pallet 4"]),
    ],
    theme: Theme = None,
) -> dict[str, Any]:
    """Shifts and turns of what was aligned under one name over time, as a Plotly figure."""
    shown = machine_named(session, machine)
    caller.must_at(shown.id, "viewer")
    rows = queries.history(session, shown.id, name) if "\0" not in name else []
    if not rows:
        raise NotFound(
            _("Nothing was aligned under the name {name} on this machine.").format(name=repr(name[:60])),
            _("GET /api/v1/alignments lists what was aligned."),
        )
    return trends.trend(
        [
            trends.Mark(
                each.aligned_at, each.id, each.result["shift"], each.result["angles"], bool(each.result.get("misfits"))
            )
            for each in rows
        ],
        theme=theme_from(theme),
    )
