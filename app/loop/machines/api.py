"""JSON routes: machines and their keys."""

from fastapi import Response

from app.access.deps import AnyCaller, Engineer
from app.loop.machines import actions, queries
from app.loop.machines.schemas import MachineChange, MachineIn, MachineOut
from app.web.api import KeyAfter, Limit, MachineKey, api_router, problems
from app.web.deps import SessionDep
from app.web.etags import TAGGED, guarded, tagged
from app.web.fields import Page, page_of

router = api_router("machines")


@router.post("/machines", status_code=201, responses=problems(409))
def add_machine(session: SessionDep, caller: Engineer, machine: MachineIn, response: Response) -> MachineOut:
    """Set up a machine, with its empty tool memory (R10) and average memory (R11)."""
    created = actions.add_machine(session, machine, caller.name)
    response.headers["Location"] = f"/api/v1/machines/{created.key}"
    return MachineOut.model_validate(created)


@router.get("/machines")
def list_machines(
    session: SessionDep,
    caller: AnyCaller,
    after: KeyAfter = "",
    limit: Limit = 100,
) -> Page[MachineOut]:
    """All machines by key; for the key of a machine, that machine."""
    if caller.only_machine is None:
        caller.must("viewer")
    rows = queries.machines(session, after, limit + 1, caller.only_machine)
    return page_of([MachineOut.model_validate(row) for row in rows], limit, lambda machine: machine.key)


@router.get("/machines/{machine}", responses=problems(404) | TAGGED)
@tagged
def get_machine(session: SessionDep, caller: AnyCaller, machine: MachineKey) -> MachineOut:
    """One machine."""
    return MachineOut.model_validate(queries.machine_for(session, caller, machine, "viewer"))


@router.patch("/machines/{machine}", responses=problems(404, 412))
@guarded(get_machine, queries.hold_machine)
def change_machine(session: SessionDep, caller: Engineer, machine: MachineKey, change: MachineChange) -> MachineOut:
    """Give it another name or control, another path of the probe's signal, another expiry of corrections, or other limits of
    what is plausible on it.
    """
    return MachineOut.model_validate(actions.change_machine(session, machine, change, caller.name))
