"""Pages: everything that waits for a person, and the count of it."""

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from app.access.deps import Viewer, require
from app.loop.machines import queries as machines
from app.views.to_do import queries
from app.web.deps import SessionDep, Word
from app.web.templates import page

router = APIRouter(include_in_schema=False)


@router.get("/todo")
def to_do_page(
    request: Request, session: SessionDep, caller: Viewer, machine: Word = None, mine: Annotated[bool, Query()] = False
) -> Response:
    """All that waits, with its next action; of one machine, or what the role of whoever asks may do."""
    chosen = machines.machine_named(session, machine) if machine else None
    return page(
        request,
        "to_do/to_do.html",
        tasks=queries.tasks(session, chosen, caller if mine else None),
        total=queries.count(session),
        machine=chosen,
        machines=machines.machines(session),
        mine=mine,
    )


@router.get("/todo/count", dependencies=[require("viewer")])
def count(request: Request, session: SessionDep) -> Response:
    """The number beside *To do* in the bar."""
    return page(request, "to_do_count.html", to_do=queries.count(session))
