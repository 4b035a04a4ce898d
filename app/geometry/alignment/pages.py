"""Pages: what was aligned, touches typed in, a pallet with its part, one alignment, the history of one set-up."""

from collections.abc import Mapping
from functools import partial
from secrets import token_hex
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Caller, Operator, Viewer, require
from app.errors import Conflict, FieldError, InbandError, Invalid, NotFound
from app.geometry.alignment import actions, form_reader, queries, wording
from app.geometry.alignment.answers import alignment_out, program_of, stop_of
from app.geometry.alignment.schemas import AlignmentIn, AlignmentRecomputeIn
from app.geometry.alignment.tables import Alignment
from app.language.i18n import _
from app.loop.machines import queries as machines
from app.loop.machines.queries import machine_named, machine_of
from app.loop.machines.wording import texts_by_control
from app.loop.readings import results_actions as readings
from app.web.deps import FormDep, Number, SessionDep, Sought, Word
from app.web.forms import parsed, typed, whole
from app.web.paging import address, part_of
from app.web.templates import page
from app.web.warnings import WarningsAcknowledgeIn

router = APIRouter(include_in_schema=False)
ON_PAGE = 25
TO_CHOOSE = 60  # alignments offered for a pallet and its part
Name = Annotated[str, Query(max_length=200)]


def history_url(machine: str, name: str) -> str:
    """The page of what was aligned under one name."""
    return address("/alignments/history", machine=machine, name=name)


@router.get("/alignments", dependencies=[require("viewer")])
def overview(
    request: Request, session: SessionDep, machine: Word = None, q: Sought = "", before: Number = None
) -> Response:
    """Every set-up with where it lay last, and the alignments, newest first."""
    chosen = machine_named(session, machine) if machine else None
    only = chosen.id if chosen else None
    rows = queries.alignments(session, only, holding=q, before=before, newest_first=True, limit=ON_PAGE + 1)
    link = partial(address, "/alignments", machine=machine, q=q or None)
    return page(
        request,
        "alignment/overview.html",
        set_ups=queries.set_ups(session, only) if before is None and not q else [],
        part=part_of(rows, ON_PAGE, before, lambda row: row.id, link),
        q=q,
        keys=machines.machine_keys_by_id(session),
        machine=chosen,
        machines=machines.machines(session),
        history=history_url,
        wording=wording,
    )


@router.get("/alignments/history", dependencies=[require("viewer")])
def history_page(request: Request, session: SessionDep, machine: Annotated[str, Query()], name: Name) -> Response:
    """Position of one set-up over time."""
    machine_row = machine_named(session, machine)
    rows = queries.history(session, machine_row.id, name) if "\0" not in name else []
    if not rows:
        raise NotFound(
            _("There is no alignment with the name {name} on this machine.").format(name=repr(name[:60])),
            _("Alignment lists what was aligned."),
        )
    return page(
        request,
        "alignment/history.html",
        machine=machine_row,
        name=name,
        rows=rows[::-1],
        pushed={row.id: queries.pushed(session, row) for row in rows[-ON_PAGE:]},
        figure=address(f"/api/v1/machines/{machine_row.key}/alignments/figure", name=name),
        wording=wording,
    )


# --- touches typed in


@router.get("/alignments/new", dependencies=[require("operator")])
def new_page(
    request: Request,
    session: SessionDep,
    kind: Word = None,
    machine: Word = None,
    found_as: Word = None,
    like: Number = None,
) -> Response:
    """The form for one kind; with `like` as another alignment was typed, what was found left out."""
    form = form_reader.blank(kind if kind in form_reader.KINDS else "points") | {"machine": machine or ""}
    if like is not None:
        other = queries.alignment(session, like)
        key = machine_of(session, other.machine_id).key
        form = form_reader.like(other.kind if other.kind in form_reader.KINDS else "points", other.given)
        form |= {"machine": key, "name": other.name or "", "method": other.method}
    if found_as is not None:
        form["found"] = found_as
    return _new(request, session, form | {"key": f"page-{token_hex(12)}"})


def _new(
    request: Request,
    session: Session,
    form: Mapping[str, str],
    error: InbandError | None = None,
    lines: list[str] | None = None,
) -> Response:
    return page(
        request,
        "alignment/new.html",
        refusal=error,
        form=form,
        kind=form.get("kind") if form.get("kind") in form_reader.KINDS else "points",
        found=form_reader.found_by(form),
        rows=form_reader.rows_of(form),
        most=form_reader.MOST_ROWS,
        errors=form_reader.at_fields(error, lines or []) if error else {},
        machines=machines.machines(session),
        names=sorted({set_up.newest.name or "" for set_up in queries.set_ups(session)}),
        wording=wording,
    )


@router.post("/alignments/new")
def align(request: Request, session: SessionDep, caller: Operator, form: FormDep) -> Response:
    """Find where the part lies and keep it; or show what is wrong, with everything still there."""
    if form.get("do") == "grid":
        return _new(request, session, dict(form) | {"rows": str(form_reader.rows_of(form) + form_reader.ROWS)})
    lines: list[str] = []
    try:
        fields, lines = form_reader.fields(form)
        body = parsed(AlignmentIn, fields)
        machine = machine_named(session, body.machine)
        with readings.pushing(session) as own:
            number = actions.align(own, machine, body, caller).row.id
    except (Invalid, Conflict) as error:
        return _new(request, session, form, error, lines)
    except NotFound as error:
        error.errors = [FieldError("machine", error.detail)]
        return _new(request, session, form, error)
    return RedirectResponse(f"/alignments/{number}", 303)


# --- a pallet and a part on it


@router.get("/alignments/pallets/new", dependencies=[require("operator")])
def pallet_page(request: Request, session: SessionDep, pallet: Number = None, part: Number = None) -> Response:
    """The form that composes the alignment of a pallet with that of a part on it."""
    form = {"pallet": str(pallet or ""), "part": str(part or ""), "key": f"page-{token_hex(12)}"}
    return _pallet(request, session, form)


def _pallet(request: Request, session: Session, form: Mapping[str, str], error: InbandError | None = None) -> Response:
    keys = machines.machine_keys_by_id(session)
    rows = queries.alignments(session, newest_first=True, limit=TO_CHOOSE)
    known = {row.id for row in rows}
    for name in ("pallet", "part"):
        number = whole(form.get(name, ""))
        if isinstance(number, int) and number not in known:
            try:
                rows.append(queries.alignment(session, number))
            except NotFound:
                continue
            known.add(number)
    choices = [("", "–")] + [
        (str(row.id), f"{row.id} · {row.name or wording.kind_word(row.kind)} · {keys[row.machine_id]}") for row in rows
    ]
    return page(
        request,
        "alignment/pallet.html",
        refusal=error,
        form=form,
        choices=choices,
        errors=form_reader.at_fields(error, []) if error else {},
    )


@router.post("/alignments/pallets/new")
def compose(request: Request, session: SessionDep, caller: Operator, form: FormDep) -> Response:
    """Compose and keep; or show what is wrong."""
    try:
        with session.begin_nested():
            created = actions.compose(session, form_reader.pallet(form), caller)
    except (Invalid, Conflict, NotFound) as error:
        return _pallet(request, session, form, error)
    return RedirectResponse(f"/alignments/{created.row.id}", 303)


# --- one alignment


@router.get("/alignments/{number}")
def alignment_page(request: Request, session: SessionDep, caller: Viewer, number: int) -> Response:
    """One alignment: the frame, how well it is known, its picture, its touches, and the text for the control."""
    return _alignment(request, session, caller, queries.alignment(session, number))


def _alignment(
    request: Request,
    session: Session,
    caller: Caller,
    alignment: Alignment,
    form: Mapping[str, str] | None = None,
    error: InbandError | None = None,
    unacknowledged: InbandError | None = None,
) -> Response:
    machine = machine_of(session, alignment.machine_id)
    answer = alignment_out(session, alignment)
    composed = [
        queries.alignment(session, number) for number in (alignment.pallet_id, alignment.part_id) if number is not None
    ]
    return page(
        request,
        "alignment/alignment.html",
        status=refusal.status if (refusal := error or unacknowledged) else 200,
        alignment=alignment,
        answer=answer,
        unacknowledged=unacknowledged,
        result=alignment.result,
        machine=machine,
        composed=composed,
        texts=texts_by_control(
            machine.control,
            partial(program_of, alignment, machine, stop=stop_of(session, alignment, machine)),
            f"{machine.key}-alignment-{alignment.id}",
        ),
        later=queries.recomputed_as(session, alignment),
        misfits={at for group in answer.misfits for at in group},
        history=history_url(machine.key, alignment.name) if alignment.name else None,
        form=form or {},
        errors=form_reader.at_fields(error, []) if error else {},
        error=error,
        wording=wording,
        face=form_reader.face_word,
        may_align=caller.may("operator"),
    )


@router.post("/alignments/{number}/acknowledge")
def acknowledge(request: Request, session: SessionDep, caller: Operator, number: int, form: FormDep) -> Response:
    """Take it as it is, although there are warnings."""
    alignment = queries.alignment(session, number)
    try:
        with session.begin_nested():
            actions.acknowledge(session, alignment, typed(WarningsAcknowledgeIn, form), caller)
    except (Invalid, Conflict) as error:
        return _alignment(request, session, caller, alignment, unacknowledged=error)
    return RedirectResponse(f"/alignments/{number}", 303)


@router.post("/alignments/{number}/recompute")
def recompute(request: Request, session: SessionDep, caller: Operator, number: int, form: FormDep) -> Response:
    """The same touches once more, by another method or without some of them."""
    alignment = queries.alignment(session, number)
    try:
        with session.begin_nested():
            recomputed = actions.recompute(session, alignment, typed(AlignmentRecomputeIn, form), caller)
    except (Invalid, Conflict) as error:
        return _alignment(request, session, caller, alignment, form, error)
    return RedirectResponse(f"/alignments/{recomputed.id}", 303)
