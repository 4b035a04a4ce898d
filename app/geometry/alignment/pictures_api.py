"""JSON routes: pictures of alignments, and their text as a file."""

from typing import Annotated

import numpy as np
from fastapi import Path, Query, Response
from fastapi.responses import PlainTextResponse
from sqlalchemy.orm import Session

from app.access.deps import AnyCaller
from app.charts import Chart
from app.errors import NotFound
from app.geometry.alignment import figures, queries, trends
from app.geometry.alignment.answers import TEXT, program_of, stop_of
from app.geometry.alignment.tables import Alignment
from app.language.i18n import _
from app.loop.machines.queries import machine_for, machine_of
from app.loop.machines.wording import file_name, no_old_offset, no_such_offset
from app.loop.timeline.queries import with_events_of_machine
from app.web.api import FIGURE, MachineKey, Theme, Width, api_router, chart_answer, plain, problems
from app.web.deps import SessionDep
from app.web.downloads import download
from app.web.fields import Control

router = api_router("alignments")
Number = Annotated[int, Path(description="Number of the alignment.", examples=[7])]
# Where a set-up that was composed has no touches of its own: a cube of 100 mm shows how it lies.
CUBE = [figures.DrawnPoint(at, at, 0.0) for at in ([50.0, 0.0, 0.0], [0.0, 50.0, 0.0], [0.0, 0.0, 50.0])]


@router.get("/alignments/{number}/figure", responses=problems(404) | FIGURE)
def alignment_figure(session: SessionDep, caller: AnyCaller, number: Number, theme: Theme = "light") -> Response:
    """The part as it should lie and as it does as a Plotly figure, with its touches; displacements enlarged."""
    return chart_answer(_drawn(session, queries.alignment(session, number, caller.only_machine)), theme)


def _drawn(session: Session, alignment: Alignment) -> Chart:
    inputs, motion = alignment.given, np.array(alignment.result["matrix"])
    if alignment.kind == "points":
        return figures.part_figure(motion, figures.touches_of(inputs, alignment.result))
    if alignment.kind == "two_points":
        nominal, measured = ([pair[name] for pair in inputs["side"]] for name in ("nominal", "measured"))
        return figures.plane_figure(motion, nominal, measured)
    if alignment.kind == "two_holes":
        centres = [hole["centre"] for hole in alignment.result["holes"]]
        return figures.plane_figure(motion, [hole["nominal"] for hole in inputs["holes"]], centres)
    on_it = None if alignment.part_id is None else queries.alignment(session, alignment.part_id)
    if on_it is None or on_it.kind != "points":
        return figures.part_figure(motion, CUBE)
    touches = []
    for point in figures.touches_of(on_it.given, on_it.result):
        moved = (motion @ [*point.place, 1.0])[:3] - point.place
        touches.append(figures.DrawnPoint(point.place, point.normal, float(moved @ np.array(point.normal))))
    return figures.part_figure(motion, touches)


@router.get("/alignments/{number}/program", responses=problems(404) | plain(TEXT), response_class=PlainTextResponse)
def write_alignment(
    session: SessionDep,
    caller: AnyCaller,
    number: Number,
    control: Annotated[
        Control | None, Query(description="For which control; if left out, that of the machine.")
    ] = None,
    restore: Annotated[
        bool, Query(description="The text that sets the work offset back to what it was before; Sinumerik and Fanuc.")
    ] = False,
) -> Response:
    """The text that puts the frame where the part lies, for the machine's control or another. It may run twice: the result is the same.

    Where it sets a work offset again it keeps the old one on the control first (R90 to R96, #600 to #603), and `restore=true`
    is the text that sets it back.

    With warnings that nobody has acknowledged it begins with a block that stops the control.
    """
    alignment = queries.alignment(session, number, caller.only_machine)
    machine = machine_of(session, alignment.machine_id)
    text = program_of(alignment, machine, control, stop=stop_of(session, alignment, machine), restore=restore)
    if text is None:
        raise no_old_offset() if restore else no_such_offset(alignment.given.get("work_offset", ""))
    name = f"{machine.key}-alignment-{alignment.id}" + ("-before" if restore else "")
    return download(text, file_name(control or machine.control, name))


@router.get("/machines/{machine}/alignments/figure", responses=problems(404) | FIGURE)
def alignment_trend_figure(
    session: SessionDep,
    caller: AnyCaller,
    machine: MachineKey,
    name: Annotated[
        str,
        Query(description="The name that alignments were given.", min_length=1, max_length=200, examples=["pallet 4"]),
    ],
    theme: Theme = "light",
    width: Width = 1240,
) -> Response:
    """Shifts and turns of what was aligned under one name over time, as a Plotly figure."""
    machine_row = machine_for(session, caller, machine, "viewer")
    rows = queries.history(session, machine_row.id, name) if "\0" not in name else []
    if not rows:
        raise NotFound(
            _("There is no alignment with the name {name} on this machine.").format(name=repr(name[:60])),
            _("GET /api/v1/alignments lists what was aligned."),
        )
    marks = [
        trends.Mark(row.aligned_at, row.id, row.result["shift"], row.result["angles"], bool(row.result.get("misfits")))
        for row in rows
    ]
    return chart_answer(with_events_of_machine(session, machine_row, trends.trend(marks), width), theme)
