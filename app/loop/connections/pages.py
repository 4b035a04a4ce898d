"""Pages: every connection, and that of one machine with its locations and its quarantine."""

from datetime import datetime, timedelta
from functools import partial
from typing import Any

from fastapi import APIRouter, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Admin, require
from app.language.times import plant_zone
from app.loop.characteristics import queries as characteristics
from app.loop.connections import actions, bridge_text, queries, wording
from app.loop.connections.bridge_text import Known
from app.loop.connections.touch_tests.queries import touch_tests
from app.loop.machines import queries as machines
from app.settings import Settings
from app.web.deps import AddressDep, SessionDep, Sought, Word
from app.web.paging import address, part_of
from app.web.templates import page

router = APIRouter(include_in_schema=False)
ON_PAGE = 200
MOST_TO_CONNECT = 12


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
        to_connect=[] if rows or q else machines.machines(session)[:MOST_TO_CONNECT],
        wording=wording,
        silent_after=_silent_after(request),
    )


@router.get("/machines/{machine}/connection", dependencies=[require("viewer")])
def connection_page(
    request: Request, session: SessionDep, address_here: AddressDep, machine: str, kind: Word = None
) -> Response:
    """The connection of one machine; of one without a bridge the configuration of one of this kind."""
    chosen = machines.machine_named(session, machine)
    shown_kind = kind if kind in bridge_text.KINDS else bridge_text.KINDS[0]
    return page(
        request,
        "connections/connection.html",
        machine=chosen,
        machines=machines.machines(session),
        row=queries.find_connection(session, chosen.id),
        kind=shown_kind,
        bridge_kinds=bridge_text.kinds(),
        configuration=bridge_text.configuration(shown_kind, _known(session, chosen.id, chosen.key, address_here)),
        tests=touch_tests(session, chosen),
        wording=wording,
        silent_after=_silent_after(request),
        moment=_moment,
    )


def _known(session: Session, machine_id: int, machine: str, server: str) -> Known:
    measured = characteristics.characteristics(session, machine_id=machine_id)
    tools = {each.parameters.tool_memory for each in measured if not each.parameters.measures_only}
    return Known(machine, server, [each.characteristic.key for each in measured], sorted(tools), plant_zone().key)


@router.post("/machines/{machine}/connection/remove")
def remove(session: SessionDep, caller: Admin, machine: str) -> Response:
    """Forget the connection of a machine that has no bridge any more."""
    actions.remove_connection(session, machine, caller)
    return RedirectResponse(f"/machines/{machine}/connection", 303)


def _moment(text: Any) -> datetime | None:
    """A time that is stored as JSON."""
    return None if text is None else datetime.fromisoformat(str(text))
