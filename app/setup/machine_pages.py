"""Set-up pages: machines and their keys."""

from collections.abc import Mapping
from typing import Any
from urllib.parse import quote

from fastapi import APIRouter, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.characteristics import queries as characteristics
from app.errors import InbandError
from app.machines import actions, queries
from app.machines.actions import MAY_BE_NOTHING, MachineChange, MachineIn
from app.people import actions as people
from app.people import queries as people_queries
from app.setup.frame import setup_page
from app.web.deps import AddressDep, Caller, Engineer, FormDep, SessionDep, Viewer
from app.web.forms import by_field, length, parsed
from app.web.i18n import _

router = APIRouter()
NUMBERS = ("signal_delay", "signal_jitter", "probing_feed", "corrections_expire_after")
SHOWN = ("name", "control", "signal_path", *NUMBERS)


def controls() -> list[tuple[str, str]]:
    return [
        ("sinumerik", "Sinumerik"),
        ("fanuc", "Fanuc"),
        ("heidenhain", "Heidenhain"),
        ("other", _("Other")),
    ]


def signal_paths() -> list[tuple[str, str]]:
    return [("direct", _("Direct to the control")), ("plc", _("Through the PLC"))]


@router.get("/setup/machines")
def machines_page(request: Request, session: SessionDep, caller: Viewer) -> Response:
    counts: dict[int, int] = {}
    for standing in characteristics.characteristics(session, limit=100_000):
        counts[standing.machine.id] = counts.get(standing.machine.id, 0) + 1
    return setup_page(
        request,
        "machines.html",
        caller,
        "machines",
        machines=queries.machines(session, limit=100_000),
        characteristics=counts,
        keys=people_queries.keys_by_machine(session),
        controls=dict(controls()),
    )


@router.get("/setup/machines/new")
def new_machine_page(request: Request, caller: Engineer) -> Response:
    return _new(request, caller, {"control": "sinumerik"}, {})


@router.post("/setup/machines/new")
def send_new_machine(request: Request, session: SessionDep, caller: Engineer, form: FormDep) -> Response:
    try:
        made = actions.add_machine(session, parsed(MachineIn, form), caller.name)
    except InbandError as error:
        if not error.errors:
            raise
        return _new(request, caller, form, by_field(error), error.status)
    return RedirectResponse(f"/setup/machines/{made.key}?done=added", 303)


def _new(
    request: Request, caller: Caller, typed: Mapping[str, str], errors: Mapping[str, str], status: int = 200
) -> Response:
    return setup_page(
        request,
        "machine_new.html",
        caller,
        "machines",
        status=status,
        typed=typed,
        errors=errors,
        controls=controls(),
    )


@router.get("/setup/machines/{machine}")
def machine_page(request: Request, session: SessionDep, caller: Viewer, address: AddressDep, machine: str) -> Response:
    return _machine(request, session, caller, address, machine)


@router.post("/setup/machines/{machine}")
def send_machine(
    request: Request, session: SessionDep, caller: Engineer, address: AddressDep, machine: str, form: FormDep
) -> Response:
    try:
        actions.change_machine(session, machine, _change(form), caller.name)
    except InbandError as error:
        if not error.errors:
            raise
        return _machine(
            request, session, caller, address, machine, status=error.status, typed=form, errors=by_field(error)
        )
    return RedirectResponse(f"/setup/machines/{quote(machine)}?done=changed", 303)


def _change(form: Mapping[str, str]) -> MachineChange:
    """What was typed; an emptied field that may be empty is said as nothing."""
    typed = {name: length(form[name]) for name in NUMBERS if name in form}
    change = parsed(MachineChange, {**form, **typed})
    emptied = [name for name in MAY_BE_NOTHING if name in form and not form[name].strip()]
    return change.model_copy(update=dict.fromkeys(emptied))


@router.post("/setup/machines/{machine}/keys")
def send_machine_key(
    request: Request, session: SessionDep, caller: Engineer, address: AddressDep, machine: str, form: FormDep
) -> Response:
    """The answer shows the secret, this once, so it is no redirect."""
    found = queries.machine_named(session, machine)
    try:
        made = people.add_key(session, name=form.get("name", ""), machine=found.key, actor=caller.name)
    except InbandError as error:
        errors = {f"key_{field}": message for field, message in by_field(error).items()}
        return _machine(request, session, caller, address, machine, status=error.status, errors=errors)
    return _machine(request, session, caller, address, machine, new_key=made)


@router.post("/setup/machines/{machine}/keys/{key}/revoke")
def send_revoke_machine_key(session: SessionDep, caller: Engineer, machine: str, key: int) -> Response:
    found = queries.machine_named(session, machine)
    people.revoke_key(session, key, caller.name, machine=found.key)
    return RedirectResponse(f"/setup/machines/{found.key}?done=revoked", 303)


def _shown(value: Any) -> str:
    """A value as it is typed."""
    return f"{value:g}" if isinstance(value, float) else str(value or "")


def _machine(
    request: Request,
    session: Session,
    caller: Caller,
    address: str,
    key: str,
    *,
    status: int = 200,
    typed: Mapping[str, str] | None = None,
    errors: Mapping[str, str] | None = None,
    new_key: Any = None,
) -> Response:
    machine = queries.machine_named(session, key)
    measured = characteristics.characteristics(session, machine_id=machine.id)
    first = measured[0] if measured else None
    return setup_page(
        request,
        "machine.html",
        caller,
        "machines",
        status=status,
        machine=machine,
        typed=typed or {name: _shown(getattr(machine, name)) for name in SHOWN},
        errors=errors or {},
        controls=controls(),
        signal_paths=signal_paths(),
        keys=people_queries.machine_keys(session, machine.id),
        characteristics=measured,
        new_key=new_key,
        address=address,
        example={
            "characteristic": first.characteristic.key if first else "YOUR-CHARACTERISTIC",
            "measured": first.parameters.target if first else 40.0,
        },
    )
