"""Set-up pages: machines and their keys."""

from collections.abc import Mapping
from typing import Any
from urllib.parse import quote

from fastapi import APIRouter, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Caller, Engineer, Viewer
from app.access.keys import add_key
from app.core.parameters import AVERAGE_LOCATIONS, MOST_LOCATIONS, TOOL_LOCATIONS
from app.errors import InbandError
from app.language.i18n import _
from app.loop.characteristics import many_actions
from app.loop.characteristics import queries as characteristics
from app.loop.machines import actions, keys, queries
from app.loop.machines.actions import MAY_BE_NOTHING, MachineChange, MachineIn
from app.views.set_up.frame import setup_page
from app.web.deps import AddressDep, FormDep, SessionDep
from app.web.fields import slug_of
from app.web.forms import by_field, length, parsed, whole

router = APIRouter(include_in_schema=False)
NUMBERS = (
    "signal_delay",
    "signal_jitter",
    "probing_feed",
    "corrections_expire_after",
    "plausible_turn",
    "plausible_shift",
    "plausible_axis_turn",
    "plausible_axis_shift",
)
COUNTS = ("tool_locations", "average_locations")
SHOWN = ("name", "control", "type", "signal_path", *COUNTS, *NUMBERS)


def controls() -> list[tuple[str, str]]:
    return [
        ("sinumerik", "Sinumerik"),
        ("fanuc", "Fanuc"),
        ("heidenhain", "Heidenhain"),
        ("other", _("Other")),
    ]


def types() -> list[tuple[str, str]]:
    return [
        ("lathe", _("Lathe")),
        ("mill", _("Milling machine, machining centre")),
        ("mill_turn", _("Turning and milling centre")),
        ("grinder", _("Grinding machine")),
        ("other", _("Other, or not said")),
    ]


def stopping() -> str:
    """The sentence about the ways on which `stop` and `hold` reach a machine, and those on which they do not."""
    return _(
        "Stops reach a machine that speaks REST, and by a bridge of kind opcua, haas, heidenhain or mqtt, or folder with a file of "
        "decisions. A bridge of kind dprnt or text, or folder without that file, cannot stop it: a stop is an alarm there, and "
        "nothing more."
    )


def signal_paths() -> list[tuple[str, str]]:
    return [("direct", _("Direct to the control")), ("plc", _("Through the PLC"))]


@router.get("/setup/machines")
def machines_page(request: Request, session: SessionDep, caller: Viewer) -> Response:
    counts: dict[int, int] = {}
    for current in characteristics.characteristics(session):
        counts[current.machine.id] = counts.get(current.machine.id, 0) + 1
    return setup_page(
        request,
        "machines.html",
        caller,
        "machines",
        machines=queries.machines(session),
        characteristics=counts,
        keys=keys.keys_by_machine(session),
        controls=dict(controls()),
        types=dict(types()),
    )


@router.get("/setup/machines/new")
def new_machine_page(request: Request, session: SessionDep, caller: Engineer, like: str = "") -> Response:
    if like:
        return _new(request, caller, _typed_like(session, like))
    return _new(request, caller, {"control": "sinumerik", "type": "lathe"} | _usual_counts())


@router.post("/setup/machines/new")
def send_new_machine(request: Request, session: SessionDep, caller: Engineer, form: FormDep) -> Response:
    try:
        typed = {name: text for name, text in form.items() if name not in {"like", "characteristics"}}
        typed["key"] = typed.get("key", "").strip() or slug_of(typed.get("name", ""))
        given = parsed(MachineIn, {**typed, **_counts(form)})
        if like := form.get("like"):
            keys = many_actions.copied_keys(form.get("characteristics", ""))
            new_machine = many_actions.copy_machine(
                session, queries.machine_named(session, like), given, keys, caller.name
            )
        else:
            new_machine = actions.add_machine(session, given, caller.name)
    except InbandError as error:
        if not error.errors:
            raise
        return _new(request, caller, form, error)
    return RedirectResponse(f"/setup/machines/{new_machine.key}?done=added", 303)


def _new(request: Request, caller: Caller, typed: Mapping[str, str], refusal: InbandError | None = None) -> Response:
    return setup_page(
        request,
        "machine_new.html",
        caller,
        "machines",
        refusal=refusal,
        typed=typed,
        controls=controls(),
        stopping=stopping(),
        types=types(),
        most_locations=MOST_LOCATIONS,
    )


def _typed_like(session: Session, like: str) -> dict[str, str]:
    """The form of a copy: the next number in its keys, which stay for good."""
    source = queries.machine_named(session, like)
    number, key = many_actions.next_number(source.key, [machine.key for machine in queries.machines(session)])
    there = [current.characteristic.key for current in characteristics.characteristics(session, machine_id=source.id)]
    lines = [f"{each} = {many_actions.key_like(each, source.key, key, number)}" for each in there]
    settings = {name: _shown(getattr(source, name)) for name in ("control", "type", *COUNTS)}
    return settings | {"key": key, "like": source.key, "characteristics": "\n".join(lines)}


def _usual_counts() -> dict[str, str]:
    return {"tool_locations": str(TOOL_LOCATIONS), "average_locations": str(AVERAGE_LOCATIONS)}


def _counts(form: Mapping[str, str]) -> dict[str, int | str | None]:
    return {name: whole(form[name]) for name in COUNTS if name in form}


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
        return _machine(request, session, caller, address, machine, typed=form, refusal=error)
    return RedirectResponse(f"/setup/machines/{quote(machine)}?done=changed", 303)


def _change(form: Mapping[str, str]) -> MachineChange:
    """Change as typed; an emptied field that may be empty becomes None."""
    typed = {name: length(form[name]) for name in NUMBERS if name in form}
    change = parsed(MachineChange, {**form, **typed, **_counts(form)})
    emptied = [name for name in MAY_BE_NOTHING if name in form and not form[name].strip()]
    return change.model_copy(update=dict.fromkeys(emptied))


@router.post("/setup/machines/{machine}/keys")
def send_machine_key(
    request: Request, session: SessionDep, caller: Engineer, address: AddressDep, machine: str, form: FormDep
) -> Response:
    """The answer shows the secret, this once, so it is no redirect."""
    try:
        new_key = add_key(
            session, machine=queries.machine_named(session, machine).key, name=form.get("name", ""), actor=caller.name
        )
    except InbandError as error:
        errors = by_field(error, lambda field, message: (f"key_{field}", message))
        return _machine(request, session, caller, address, machine, refusal=error, errors=errors)
    return _machine(request, session, caller, address, machine, new_key=new_key)


@router.post("/setup/machines/{machine}/keys/{key}/revoke")
def send_revoke_machine_key(session: SessionDep, caller: Engineer, machine: str, key: int) -> Response:
    keys.revoke_machine_key(session, machine, key, caller.name)
    return RedirectResponse(f"/setup/machines/{machine}?done=revoked", 303)


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
    typed: Mapping[str, str] | None = None,
    refusal: InbandError | None = None,
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
        refusal=refusal,
        errors=errors,
        machine=machine,
        machines=queries.machines(session),
        typed=typed or {name: _shown(getattr(machine, name)) for name in SHOWN},
        controls=controls(),
        stopping=stopping(),
        types=types(),
        most_locations=MOST_LOCATIONS,
        signal_paths=signal_paths(),
        keys=keys.machine_keys(session, machine.id),
        characteristics=measured,
        new_key=new_key,
        address=address,
        example={
            "characteristic": first.characteristic.key if first else "YOUR-CHARACTERISTIC",
            "measured": first.parameters.target if first else 40.0,
        },
    )
