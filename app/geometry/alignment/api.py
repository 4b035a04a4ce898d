"""JSON routes: alignments, pallets composed with parts."""

from typing import Annotated

from fastapi import Path, Response

from app.access.deps import AnyCaller, Operator, OperatorOrMachine
from app.geometry.alignment import actions, queries
from app.geometry.alignment.answers import AlignmentOut, alignment_out
from app.geometry.alignment.schemas import AlignmentIn, AlignmentRecomputeIn, PalletIn
from app.loop.machines.queries import machine_for, only_machine
from app.loop.readings import results_actions as readings
from app.web.api import After, Limit, MachineFilter, api_router, problems, sent_again
from app.web.deps import SessionDep
from app.web.fields import Page, page_of
from app.web.warnings import WarningsAcknowledgeIn

router = api_router("alignments")
Number = Annotated[int, Path(description="Number of the alignment.", examples=[7])]


@router.post("/alignments", status_code=201, responses=problems(404, 409) | sent_again(AlignmentOut))
def align(session: SessionDep, caller: OperatorOrMachine, body: AlignmentIn, response: Response) -> AlignmentOut:
    """Find where a part lies: from six touches (3-2-1) or more, two points on a side, or two holes.

    The answer is the frame, how well it is known, which touches do not fit, and the text for the machine's control. Touches
    that leave the part free to move are refused with the reason, and with the touch to move. `warnings` names what is hardly
    plausible: until somebody acknowledges them the text stops the control.
    """
    with readings.pushing(session) as own:
        machine = machine_for(own, caller, body.machine, "operator")
        created = actions.align(own, machine, body, caller)
    response.status_code = 200 if created.again else 201
    return alignment_out(session, queries.alignment(session, created.row.id))


@router.post("/alignments/pallets", status_code=201, responses=problems(404, 409) | sent_again(AlignmentOut))
def compose_pallet(session: SessionDep, caller: OperatorOrMachine, body: PalletIn, response: Response) -> AlignmentOut:
    """Compose the error of a pallet with that of a part on it: where the part lies on the machine."""
    created = actions.compose(session, body, caller)
    response.status_code = 200 if created.again else 201
    return alignment_out(session, created.row)


@router.get("/alignments", responses=problems(404))
def list_alignments(
    session: SessionDep,
    caller: AnyCaller,
    machine: MachineFilter = None,
    after: After = 0,
    limit: Limit = 100,
) -> Page[AlignmentOut]:
    """Alignments in the order in which they came."""
    only = only_machine(session, caller, machine)
    rows = queries.alignments(session, only, after=after, limit=limit + 1)
    return page_of([alignment_out(session, row) for row in rows], limit, lambda row: row.id)


@router.get("/alignments/{number}", responses=problems(404))
def get_alignment(session: SessionDep, caller: AnyCaller, number: Number) -> AlignmentOut:
    """One alignment with its touches."""
    return alignment_out(session, queries.alignment(session, number, caller.only_machine))


@router.post("/alignments/{number}/acknowledge", responses=problems(404, 409))
def acknowledge_alignment(
    session: SessionDep, caller: Operator, number: Number, body: WarningsAcknowledgeIn
) -> AlignmentOut:
    """Take it as it is, although there are warnings: from now on its program text runs. Who, when and why is kept.

    409 where there is no warning, or somebody was first.
    """
    alignment = queries.alignment(session, number)
    actions.acknowledge(session, alignment, body, caller)
    return alignment_out(session, alignment)


@router.post("/alignments/{number}/recompute", status_code=201, responses=problems(404, 409))
def recompute_alignment(
    session: SessionDep, caller: Operator, number: Number, body: AlignmentRecomputeIn
) -> AlignmentOut:
    """Compute the same touches once more, by another method or without some of them; the result is another alignment."""
    return alignment_out(session, actions.recompute(session, queries.alignment(session, number), body, caller))
