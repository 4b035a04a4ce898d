"""JSON routes: alignments, pallets composed with parts."""

from typing import Annotated, Any

from fastapi import Path, Query, Request, Response

from app.alignments import actions, queries
from app.alignments.answers import AlignmentOut, alignment_out
from app.alignments.schemas import AlignmentIn, PalletIn, RecomputeIn
from app.db.engine import Database
from app.machines.queries import machine_named
from app.readings import actions as readings
from app.web.api import api_router, problems
from app.web.deps import AnyCaller, Operator, SessionDep
from app.web.fields import Cursor, Limit, Page, Slug, page_of

router = api_router("alignments")
Number = Annotated[int, Path(description="Number of the alignment.", examples=[7])]
AGAIN: dict[int | str, dict[str, Any]] = {
    200: {"model": AlignmentOut, "description": "It was sent before with the same key; nothing happened now."}
}


@router.post("/alignments", status_code=201, responses=problems(404, 409) | AGAIN)
def align(
    request: Request, session: SessionDep, caller: AnyCaller, given: AlignmentIn, response: Response
) -> AlignmentOut:
    """Find where a part lies: from six touches (3-2-1) or more, two points on a side, or two holes.

    The answer is the frame, how well it is known, which touches do not fit, and the text for the machine's control. Touches
    that leave the part free to move are refused with the reason, and with the touch to move.
    """
    caller.must_somewhere("operator")
    database: Database = request.app.state.database
    with database.begin() as own:
        machine = machine_named(own, given.machine)
        caller.must_at(machine.id, "operator")
        made = actions.align(own, machine, given, caller)
    readings.push_results(database)
    response.status_code = 200 if made.again else 201
    return alignment_out(session, queries.alignment(session, made.alignment.id))


@router.post("/alignments/pallets", status_code=201, responses=problems(404, 409) | AGAIN)
def compose_pallet(session: SessionDep, caller: AnyCaller, given: PalletIn, response: Response) -> AlignmentOut:
    """Compose the error of a pallet with that of a part on it: where the part lies on the machine."""
    caller.must_somewhere("operator")
    made = actions.compose(session, given, caller)
    response.status_code = 200 if made.again else 201
    return alignment_out(session, made.alignment)


@router.get("/alignments", responses=problems(404))
def list_alignments(
    session: SessionDep,
    caller: AnyCaller,
    machine: Annotated[Slug | None, Query(description="Only of this machine.", examples=["mill-1"])] = None,
    after: Annotated[Cursor, Query(description="Cursor: the `next` of the page before.")] = 0,
    limit: Annotated[Limit, Query()] = 100,
) -> Page[AlignmentOut]:
    """Alignments in the order in which they came."""
    only = caller.only_machine
    if machine is not None:
        found = machine_named(session, machine)
        caller.must_at(found.id, "viewer")
        only = found.id
    rows = queries.alignments(session, only, after=after, limit=limit + 1)
    return page_of([alignment_out(session, row) for row in rows], limit, lambda row: row.id)


@router.get("/alignments/{number}", responses=problems(404))
def get_alignment(session: SessionDep, caller: AnyCaller, number: Number) -> AlignmentOut:
    """One alignment with its touches."""
    return alignment_out(session, queries.alignment(session, number, caller.only_machine))


@router.post("/alignments/{number}/recompute", status_code=201, responses=problems(404, 409))
def recompute_alignment(session: SessionDep, caller: Operator, number: Number, given: RecomputeIn) -> AlignmentOut:
    """Compute the same touches once more, by another method or without some of them; the result is another alignment."""
    return alignment_out(session, actions.recompute(session, queries.alignment(session, number), given, caller))
