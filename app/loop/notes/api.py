"""JSON routes: notes."""

from typing import Annotated

from fastapi import Path, Query, Response

from app.access.deps import AnyCaller, Operator
from app.loop.characteristics.queries import characteristic_for
from app.loop.machines.queries import only_machine
from app.loop.notes import actions, queries
from app.loop.notes.schemas import NoteIn, WrittenNote
from app.web.api import Before, Limit, MachineFilter, api_router, problems
from app.web.choice import InPeriod
from app.web.deps import SessionDep
from app.web.fields import LARGEST_ID, Page, ReasonIn, Slug, page_of

router = api_router("notes")
Number = Annotated[int, Path(ge=1, le=LARGEST_ID, description="Number of the note.", examples=[7])]


@router.post("/notes", status_code=201, responses=problems(404, 409) | {200: {"model": WrittenNote}})
def write_note(session: SessionDep, caller: Operator, note: NoteIn, response: Response) -> WrittenNote:
    """Write a note at a characteristic or at a machine: from then on it is on every chart there, at its moment.

    201; 200 where it was sent before with the same key.
    """
    done = actions.write_note(session, note, caller)
    if done.again:
        response.status_code = 200
    response.headers["Location"] = f"/api/v1/notes/{done.row.note.id}"
    return WrittenNote.of(done.row)


@router.get("/notes", responses=problems(404))
def list_notes(
    session: SessionDep,
    caller: AnyCaller,
    period: InPeriod,
    machine: MachineFilter = None,
    characteristic: Annotated[
        Slug | None, Query(description="Those on the charts of this characteristic: its own, and those of its machine.")
    ] = None,
    withdrawn: Annotated[bool, Query(description="Those that were withdrawn as well.")] = False,
    before: Before = None,
    limit: Limit = 100,
) -> Page[WrittenNote]:
    """Notes, the last written first. The key of a machine sees those of that machine."""
    machine_id = only_machine(session, caller, machine)
    rows = queries.notes(
        session,
        machine_id=machine_id,
        characteristic=characteristic_for(session, caller, characteristic, "viewer").characteristic
        if characteristic
        else None,
        period=period,
        withdrawn=withdrawn,
        before=before,
        limit=limit + 1,
    )
    return page_of([WrittenNote.of(row) for row in rows], limit, lambda note: note.id)


@router.get("/notes/{note}", responses=problems(404))
def get_note(session: SessionDep, caller: AnyCaller, note: Number) -> WrittenNote:
    """One note, withdrawn or not."""
    row = queries.note(session, note)
    caller.must_at(row.machine.id, "viewer")
    return WrittenNote.of(row)


@router.post("/notes/{note}/withdraw", responses=problems(404, 409))
def withdraw_note(session: SessionDep, caller: Operator, note: Number, given: ReasonIn) -> WrittenNote:
    """Withdraw a note: its author, or an engineer. It leaves charts and lists; note and reason stay on record."""
    return WrittenNote.of(actions.withdraw_note(session, note, given.reason, caller))
