"""JSON routes: keys of wall screens."""

from typing import Annotated

from fastapi import Path, Response

from app.access import screens
from app.access.deps import Admin, require
from app.access.schemas import NewScreenOut, ScreenIn, ScreenOut
from app.web.api import Limit, SerialAfter, api_router, problems
from app.web.deps import AddressDep, SessionDep
from app.web.fields import LARGEST_SERIAL, Page, answer_from, page_of

router = api_router("keys")
ScreenId = Annotated[int, Path(ge=1, le=LARGEST_SERIAL, description="Number of the wall screen.", examples=[1])]


@router.get("/wall-screens", dependencies=[require("admin")])
def list_wall_screens(session: SessionDep, after: SerialAfter = 0, limit: Limit = 100) -> Page[ScreenOut]:
    """Wall screens whose key is valid; never the keys."""
    rows = [answer_from(ScreenOut, row) for row in screens.screens(session, after, limit + 1)]
    return page_of(rows, limit, lambda row: row.id)


@router.post("/wall-screens", status_code=201, responses=problems(409))
def add_wall_screen(session: SessionDep, caller: Admin, address: AddressDep, screen: ScreenIn) -> NewScreenOut:
    """Make a link for a wall screen. Its key opens that screen and nothing else, and is shown only this once."""
    made = screens.add_screen(session, screen.name, caller.name)
    return answer_from(NewScreenOut, made.screen, url=f"{address}/wall#{made.key}")


@router.delete("/wall-screens/{screen}", status_code=204, responses=problems(404))
def revoke_wall_screen(session: SessionDep, caller: Admin, screen: ScreenId) -> Response:
    """Revoke its key: the screen shows nothing from its next look on, within seconds. Revoking twice is harmless."""
    screens.revoke_screen(session, screen, caller.name)
    return Response(status_code=204)
