"""JSON routes: what a machine works at."""

from app.access.deps import AnyCaller, OperatorOrMachine
from app.loop.machines.queries import hold_machine, machine_for
from app.loop.present_context import actions
from app.loop.present_context.queries import present_of
from app.loop.present_context.schemas import PresentContextIn, PresentContextOut
from app.web.api import MachineKey, api_router, problems
from app.web.deps import SessionDep
from app.web.etags import TAGGED, guarded, tagged

router = api_router("machines")


@router.get("/machines/{machine}/context", responses=problems(404) | TAGGED)
@tagged
def get_present_context(session: SessionDep, caller: AnyCaller, machine: MachineKey) -> PresentContextOut:
    """The work of the machine: the context of its readings that bring none but temperatures."""
    row = machine_for(session, caller, machine, "viewer")
    return PresentContextOut.of(machine, present_of(session, row.id))


@router.put("/machines/{machine}/context", responses=problems(404, 412))
@guarded(get_present_context, hold_machine)
def set_present_context(
    session: SessionDep, caller: OperatorOrMachine, machine: MachineKey, given: PresentContextIn
) -> PresentContextOut:
    """Say what the machine works at from now on; `{}`: nothing is known. Readings that were measured before keep what they have.

    It is put within a minute on readings that were measured since and bring no context but temperatures; one that brings any other
    keeps that alone.
    The key of the machine may set it, a bridge or an MES for example.
    """
    row = machine_for(session, caller, machine, "operator")
    return PresentContextOut.of(row.key, actions.set_present(session, row.key, given, caller))
