"""Set-up pages for administrators: devices that are bound to machines, and the badges of people."""

from typing import Any

from fastapi import APIRouter, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access import devices, identification
from app.access.deps import Admin, Caller
from app.errors import InbandError
from app.loop.machines import queries as machines
from app.views.set_up.frame import setup_page
from app.web.deps import AddressDep, FormDep, SessionDep
from app.web.forms import by_field, whole

router = APIRouter(include_in_schema=False)


@router.get("/setup/stations")
def stations_page(request: Request, session: SessionDep, caller: Admin, address: AddressDep) -> Response:
    return _stations(request, session, caller, address)


@router.post("/setup/stations")
def send_device(request: Request, session: SessionDep, caller: Admin, address: AddressDep, form: FormDep) -> Response:
    """The answer shows the code, this once, so it is no redirect."""
    try:
        code = devices.make_code(session, form.get("machine", ""), form.get("name", ""), caller.name)
    except InbandError as error:
        return _stations(request, session, caller, address, error=error, typed=form)
    return _stations(request, session, caller, address, code=code)


@router.post("/setup/stations/{device}/revoke")
def send_revoke_device(session: SessionDep, caller: Admin, device: int) -> Response:
    devices.revoke(session, device, caller.name)
    return RedirectResponse("/setup/stations?done=unbound", 303)


@router.post("/setup/stations/badges")
def send_badge(request: Request, session: SessionDep, caller: Admin, address: AddressDep, form: FormDep) -> Response:
    person = whole(form.get("person"))
    try:
        identification.add_badge(session, person if isinstance(person, int) else 0, form.get("code", ""), caller.name)
    except InbandError as error:
        return _stations(request, session, caller, address, badge_error=error, typed={"person": form.get("person")})
    return RedirectResponse("/setup/stations?done=badge", 303)


@router.post("/setup/stations/badges/{person}/remove")
def send_remove_badges(session: SessionDep, caller: Admin, person: int) -> Response:
    identification.remove_badges(session, person, caller.name)
    return RedirectResponse("/setup/stations?done=no-badges", 303)


def _stations(
    request: Request,
    session: Session,
    caller: Caller,
    address: str,
    *,
    code: str = "",
    typed: Any = None,
    error: InbandError | None = None,
    badge_error: InbandError | None = None,
) -> Response:
    wrong = error or badge_error
    all_machines = machines.machines(session)
    people = identification.identifiable(session)
    return setup_page(
        request,
        "stations.html",
        caller,
        "stations",
        status=wrong.status if wrong else 200,
        machines=[(row.key, row.name) for row in all_machines],
        machine_of={row.id: row for row in all_machines},
        devices=devices.devices(session),
        people=people,
        names=[(row.person.id, row.person.name) for row in people],
        code=code,
        address=address,
        typed=typed or {},
        errors=by_field(error) if error else {},
        badge_errors=(by_field(badge_error) or {"code": badge_error.detail}) if badge_error else {},
    )
