"""The buttons that let a simulated machine run on an empty plant, and remove it with everything that it has left.

It is of the distribution inband-simulators, which is looked for by name: nothing here needs it.
"""

from importlib import import_module
from importlib.util import find_spec
from types import ModuleType
from typing import Any, cast

from fastapi import APIRouter, Request, Response
from sqlalchemy.orm import Session
from starlette.background import BackgroundTask
from starlette.responses import RedirectResponse

from app.access.deps import Engineer
from app.access.keys import add_key
from app.errors import NotFound
from app.language.i18n import _
from app.loop.characteristics.actions import add_characteristic
from app.loop.characteristics.schemas import CharacteristicIn
from app.loop.machines import keys
from app.loop.machines import simulated_actions as actions
from app.loop.machines.schemas import MachineIn
from app.loop.machines.simulated_actions import may_be_removed, simulated_machine
from app.web.deps import SessionDep

router = APIRouter(include_in_schema=False)
KEY_NAME = "simulated machine"


def simulator() -> ModuleType | None:
    """The simulated machine's program, where inband-simulators is installed."""
    return import_module("app.simulators.trying") if find_spec("app.simulators") is not None else None


def trying(session: Session, *, empty: bool) -> dict[str, Any]:
    """The state of it for the plant's page. offer: `there`, `not installed`, `no right`; simulated: the machine that is there."""
    if empty:
        there = "there" if may_be_removed(session) else "no right"
        return {"offer": there if find_spec("app.simulators") is not None else "not installed", "simulated": None}
    if (machine := simulated_machine(session)) is None:
        return {"simulated": None}
    program = simulator()
    return {"simulated": machine, "runs": program is not None and program.is_running(machine.key)}


@router.post("/simulated")
def start(request: Request, session: SessionDep, caller: Engineer) -> Response:
    """Set the simulated machine up if there is none, and let it run."""
    program = simulator()
    if program is None:
        raise NotFound(
            _("inband-simulators is not installed on this server."),
            _("Install its wheel into the environment of Inband: pip install --no-deps FILE."),
        )
    machine = simulated_machine(session)
    if machine is not None:  # one that another process simulates still ends
        for old in keys.machine_keys(session, machine.id):
            if old.name == KEY_NAME:
                keys.revoke_machine_key(session, machine.key, old.id, caller.name)
    key = _set_up(session, program, caller.name) if machine is None else machine.key
    secret = add_key(session, name=KEY_NAME, machine=key, actor=caller.name).secret
    begin = BackgroundTask(program.start, _own_address(request), request.headers.get("host", "localhost"), secret, key)
    return RedirectResponse("/", 303, background=begin)


def _set_up(session: Session, program: ModuleType, actor: str) -> str:
    spec = program.fresh()
    actions.add_simulated_machine(session, MachineIn(**program.settings(spec)), actor)
    for each in program.characteristics(spec):
        add_characteristic(session, CharacteristicIn(**each), actor)
    return str(spec.key)


def _own_address(request: Request) -> str:
    """The socket that this request came in by, for a caller on the same computer."""
    host, port = cast("tuple[str, int]", request.scope["server"])
    root = request.scope.get("root_path", "")
    return f"http://[{host}]:{port}{root}" if ":" in host else f"http://{host}:{port}{root}"


@router.post("/simulated/remove")
def remove(session: SessionDep, caller: Engineer) -> Response:
    """Remove it, and everything that it has left but the record of changes."""
    machine, program = simulated_machine(session), simulator()
    if machine is not None and program is not None:
        program.stop(machine.key)
    actions.remove_simulated_machine(session, caller.name)
    return RedirectResponse("/?done=removed", 303)
