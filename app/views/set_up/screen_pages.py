"""Set-up page for administrators: wall screens."""

from fastapi import APIRouter, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access import screens
from app.access.deps import Admin, Caller
from app.errors import InbandError
from app.views.set_up.frame import setup_page
from app.web.deps import AddressDep, FormDep, SessionDep
from app.web.forms import by_field

router = APIRouter(include_in_schema=False)


@router.get("/setup/screens")
def screens_page(request: Request, session: SessionDep, caller: Admin) -> Response:
    return _screens(request, session, caller)


@router.post("/setup/screens")
def send_screen(request: Request, session: SessionDep, caller: Admin, address: AddressDep, form: FormDep) -> Response:
    """The answer shows the link, this once, so it is no redirect."""
    try:
        made = screens.add_screen(session, form.get("name", ""), caller.name)
    except InbandError as error:
        return _screens(request, session, caller, error=error, name=form.get("name", ""))
    return _screens(request, session, caller, link=f"{address}/wall#{made.key}")


@router.post("/setup/screens/{screen}/revoke")
def send_revoke_screen(session: SessionDep, caller: Admin, screen: int) -> Response:
    screens.revoke_screen(session, screen, caller.name)
    return RedirectResponse("/setup/screens?done=screen-revoked", 303)


def _screens(
    request: Request,
    session: Session,
    caller: Caller,
    *,
    link: str = "",
    name: str = "",
    error: InbandError | None = None,
) -> Response:
    return setup_page(
        request,
        "screens.html",
        caller,
        "screens",
        refusal=error,
        screens=screens.screens(session),
        link=link,
        name=name,
        errors=(by_field(error) or {"name": error.detail}) if error else {},
    )
