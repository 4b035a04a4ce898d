"""Pages: every connection, and that of one machine with its locations and its quarantine."""

from datetime import datetime, timedelta
from functools import partial
from typing import Any

from fastapi import APIRouter, Request, Response
from starlette.responses import RedirectResponse

from app.access.deps import Admin, require
from app.loop.connections import actions, queries, wording
from app.loop.connections.touch_tests.queries import touch_tests
from app.loop.machines import queries as machines
from app.settings import Settings
from app.web.deps import SessionDep, Sought, Word
from app.web.paging import address, part_of
from app.web.templates import page

router = APIRouter(include_in_schema=False)
ON_PAGE = 200


def _silent_after(request: Request) -> timedelta:
    settings: Settings = request.app.state.settings
    return timedelta(seconds=settings.bridge_silent_after)


@router.get("/connections", dependencies=[require("viewer")])
def connections_page(request: Request, session: SessionDep, after: Word = None, q: Sought = "") -> Response:
    """Every machine that has or had a bridge, and its state."""
    rows = queries.connections(session, after or "", ON_PAGE + 1, holding=q)
    link = partial(address, "/connections", q=q or None)
    return page(
        request,
        "connections/list.html",
        part=part_of(rows, ON_PAGE, after, lambda row: row.machine.key, link, "after"),
        q=q,
        wording=wording,
        silent_after=_silent_after(request),
    )


@router.get("/machines/{machine}/connection", dependencies=[require("viewer")])
def connection_page(request: Request, session: SessionDep, machine: str) -> Response:
    """The connection of one machine."""
    chosen = machines.machine_named(session, machine)
    return page(
        request,
        "connections/connection.html",
        machine=chosen,
        machines=machines.machines(session),
        row=queries.find_connection(session, chosen.id),
        tests=touch_tests(session, chosen),
        wording=wording,
        silent_after=_silent_after(request),
        moment=_moment,
    )


@router.post("/machines/{machine}/connection/remove")
def remove(session: SessionDep, caller: Admin, machine: str) -> Response:
    """Forget the connection of a machine that has no bridge any more."""
    actions.remove_connection(session, machine, caller)
    return RedirectResponse(f"/machines/{machine}/connection", 303)


def _moment(text: Any) -> datetime | None:
    """A time that is stored as JSON."""
    return None if text is None else datetime.fromisoformat(str(text))
