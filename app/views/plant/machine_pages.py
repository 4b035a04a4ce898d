"""Pages: all machines, and the geometry of one of them."""

from functools import partial
from typing import Annotated, NamedTuple

from fastapi import APIRouter, Query, Request, Response
from starlette.responses import RedirectResponse

from app.access.deps import require
from app.language.i18n import _
from app.loop.machines import queries as machines
from app.views.characteristic import state_queries
from app.views.plant import geometry_queries
from app.views.to_do import queries as to_do
from app.web.deps import SessionDep, Sought
from app.web.paging import address, holds, slice_of
from app.web.templates import page

router = APIRouter(include_in_schema=False, dependencies=[require("viewer")])
ON_PAGE = 200


class Geometry(NamedTuple):
    """One kind of geometric results of a machine: how many there are, where they are shown and where one is made."""

    title: str
    explained: str
    results: int
    path: str
    new_path: str


@router.get("/machines")
def machines_page(
    request: Request, session: SessionDep, after: Annotated[int, Query(ge=0, le=1_000_000)] = 0, q: Sought = ""
) -> Response:
    """Every machine with its state."""
    groups = state_queries.plant(session, trends=False)
    groups = [group for group in groups if holds(q, group.machine.name, group.machine.key, group.machine.control)]
    part = slice_of(groups, ON_PAGE, after, partial(address, "/machines", q=q or None))
    return page(request, "machines/list.html", part=part, q=q, last=_last, to_do_at=to_do.count_by_machine(session))


def _last(group: state_queries.Group) -> object:
    """Time of the last reading that was received from the machine."""
    received = [row.stream.last_received_at for row in group.rows if row.stream.last_received_at is not None]
    return max(received, default=None)


@router.get("/tools")
def tool_memories() -> Response:
    """The former list of tool memories: machines have a page of their own."""
    return RedirectResponse("/machines", 308)


@router.get("/machines/{machine}/geometry")
def geometry_page(request: Request, session: SessionDep, machine: str) -> Response:
    """Work zeros, alignments, form and rotary axes of one machine, as far as it has any."""
    chosen = machines.machine_named(session, machine)
    return page(
        request,
        "machines/geometry.html",
        machine=chosen,
        machines=machines.machines(session),
        kinds=_geometry(chosen.key, geometry_queries.results_of(session, chosen.id)),
    )


def _geometry(key: str, counts: list[int]) -> list[Geometry]:
    kinds = [
        (_("Work zero"), _("Origin and size from probed points; shift of each fixture."), "work-zeros?machine={}"),
        (_("Alignment"), _("Position and rotation of a part, pallet or fixture."), "alignments?machine={}"),
        (_("Form"), _("Roundness, straightness, flatness and position of features."), "forms?machine={}"),
        (_("Rotary axes"), _("Position of the axes, drift, back-ups, limits."), "kinematics/machines/{}"),
    ]
    return [
        Geometry(
            title, explained, count, f"/{path.format(key)}", f"/{path.split('?')[0].split('/')[0]}/new?machine={key}"
        )
        for (title, explained, path), count in zip(kinds, counts, strict=True)
    ]
