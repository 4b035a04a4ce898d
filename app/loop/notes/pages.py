"""Pages: the notes of a machine or a characteristic, one note, and the form of a new one."""

from collections.abc import Mapping
from functools import partial
from secrets import token_hex
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Caller, Operator, Viewer, require
from app.errors import Conflict, InbandError, Invalid
from app.loop.characteristics.queries import characteristic_named
from app.loop.machines import queries as machines
from app.loop.machines.queries import machine_named
from app.loop.notes import actions, queries
from app.loop.notes.schemas import NoteIn
from app.web.deps import Before, FormDep, Number, SessionDep, Sought, Word
from app.web.fields import LARGEST_ID, Reason
from app.web.forms import typed
from app.web.paging import address, part_of
from app.web.templates import page
from app.web.validation import checked

router = APIRouter(include_in_schema=False)
ON_PAGE = 50
OfReading = Annotated[int | None, Query(ge=1, le=LARGEST_ID)]


@router.get("/notes", dependencies=[require("viewer")])
def notes_page(
    request: Request,
    session: SessionDep,
    machine: Word = None,
    characteristic: Word = None,
    q: Sought = "",
    before: Before = None,
) -> Response:
    """Notes, the last written first: of a characteristic those on its charts, of a machine, or all."""
    current = characteristic_named(session, characteristic) if characteristic else None
    chosen = current.machine if current else machine_named(session, machine) if machine else None
    rows = queries.notes(
        session,
        machine_id=chosen.id if chosen else None,
        characteristic=current.characteristic if current else None,
        holding=q,
        before=before,
        limit=ON_PAGE + 1,
    )
    link = partial(address, "/notes", machine=machine, characteristic=characteristic, q=q or None)
    return page(
        request,
        "notes/list.html",
        part=part_of(rows, ON_PAGE, before, lambda row: row.note.id, link),
        q=q,
        machine=chosen,
        characteristic=current.characteristic if current else None,
        machines=machines.machines(session),
    )


@router.get("/notes/new")
def new_note(
    request: Request,
    session: SessionDep,
    _caller: Operator,
    machine: Word = None,
    characteristic: Word = None,
    sequence: OfReading = None,
) -> Response:
    """The form of a note at a machine, at a characteristic, or at one of its readings."""
    about = {"machine": machine, "characteristic": characteristic, "sequence": sequence, "key": token_hex(8)}
    return _form(request, session, {name: str(value) for name, value in about.items() if value is not None})


def _form(request: Request, session: Session, form: Mapping[str, str], error: InbandError | None = None) -> Response:
    current = characteristic_named(session, form["characteristic"]) if form.get("characteristic") else None
    machine = current.machine if current else machine_named(session, form.get("machine", ""))
    sequence = form.get("sequence", "")
    numbered = current and sequence.isdecimal() and len(sequence) < 19
    reading = queries.reading(session, current.characteristic, int(sequence)) if current and numbered else None
    return page(
        request,
        "notes/new.html",
        refusal=error,
        machine=machine,
        characteristic=current.characteristic if current else None,
        reading=reading,
        form=form,
    )


@router.post("/notes/new")
def write(request: Request, session: SessionDep, caller: Operator, form: FormDep) -> Response:
    """Write the note; then the page of what it is about."""
    try:
        row = actions.write_note(session, typed(NoteIn, form), caller).row
    except (Invalid, Conflict) as error:
        return _form(request, session, form, error)
    return RedirectResponse(f"{row.home}#notes", 303)


@router.get("/notes/{number}")
def note_page(request: Request, session: SessionDep, caller: Viewer, number: int, late: Number = None) -> Response:
    """One note, and the form to withdraw it. late: someone else was first."""
    return _note(request, session, caller, number, late=bool(late))


def _note(
    request: Request,
    session: Session,
    caller: Caller,
    number: int,
    *,
    late: bool = False,
    typed: str = "",
    error: Invalid | None = None,
) -> Response:
    row = queries.note(session, number)
    return page(
        request,
        "notes/note.html",
        refusal=error,
        row=row,
        note=row.note,
        may_withdraw=queries.may_withdraw(row.note, caller),
        late=late,
        typed=typed,
    )


@router.post("/notes/{number}/withdraw")
def withdraw(request: Request, session: SessionDep, caller: Operator, number: int, form: FormDep) -> Response:
    """Withdraw the note. Sent twice, or after someone else, it changes nothing and says so."""
    try:
        actions.withdraw_note(session, number, checked(Reason, form.get("reason", ""), "reason"), caller)
    except Conflict:
        return RedirectResponse(f"/notes/{number}?late=1", 303)
    except Invalid as error:
        return _note(request, session, caller, number, typed=form.get("reason", ""), error=error)
    return RedirectResponse(f"/notes/{number}", 303)
