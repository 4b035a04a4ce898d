"""Pages: what was aligned, touches typed in, a pallet with its part, one alignment, the history of one set-up."""

from collections.abc import Mapping
from functools import partial
from secrets import token_hex
from typing import Annotated
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.alignments import actions, asking, queries, wording
from app.alignments.answers import alignment_out, program_of
from app.alignments.schemas import AlignmentIn, PalletIn, RecomputeIn
from app.alignments.tables import Alignment
from app.db.engine import Database
from app.errors import Conflict, FieldError, InbandError, Invalid, NotFound
from app.machines import queries as machines
from app.machines.queries import machine_named, machine_of
from app.machines.wording import texts_by_control
from app.readings import actions as readings
from app.web.deps import Caller, FormDep, Operator, SessionDep, Viewer, require
from app.web.fields import LARGEST_ID
from app.web.forms import parsed
from app.web.i18n import _
from app.web.templates import page

router = APIRouter(include_in_schema=False)
ON_PAGE = 25
TO_CHOOSE = 60  # alignments offered for a pallet and its part
Word = Annotated[str | None, Query(max_length=64)]
Name = Annotated[str, Query(max_length=200)]
Number = Annotated[int | None, Query(ge=0, le=LARGEST_ID)]


def history_url(machine: str, name: str) -> str:
    """The page of what was aligned under one name."""
    return f"/alignments/history?{urlencode({'machine': machine, 'name': name})}"


@router.get("/alignments", dependencies=[require("viewer")])
def overview(request: Request, session: SessionDep, machine: Word = None, before: Number = None) -> Response:
    """Every set-up with where it lay last, and the alignments, newest first."""
    shown = machine_named(session, machine) if machine else None
    only = shown.id if shown else None
    rows = queries.alignments(session, only, before=before, newest_first=True, limit=ON_PAGE + 1)
    here = f"/alignments?machine={shown.key}" if shown else "/alignments?"
    return page(
        request,
        "alignments/overview.html",
        set_ups=queries.set_ups(session, only) if before is None else [],
        rows=rows[:ON_PAGE],
        keys=machines.machine_keys_by_id(session),
        machine=shown,
        machines=machines.machines(session),
        older=f"{here}&before={rows[ON_PAGE - 1].id}" if len(rows) > ON_PAGE else None,
        newest=here if before is not None else None,
        history=history_url,
        wording=wording,
    )


@router.get("/alignments/history", dependencies=[require("viewer")])
def history_page(request: Request, session: SessionDep, machine: Annotated[str, Query()], name: Name) -> Response:
    """Where one set-up lay over time."""
    shown = machine_named(session, machine)
    rows = queries.history(session, shown.id, name) if "\0" not in name else []
    if not rows:
        raise NotFound(
            _("Nothing was aligned under the name {name} on this machine.").format(name=repr(name[:60])),
            _("Alignment lists what was aligned."),
        )
    return page(
        request,
        "alignments/history.html",
        machine=shown,
        name=name,
        rows=rows[::-1],
        pushed={each.id: queries.pushed(session, each) for each in rows[-ON_PAGE:]},
        figure=f"/api/v1/machines/{shown.key}/alignments/figure?{urlencode({'name': name})}",
        wording=wording,
    )


# --- touches typed in


@router.get("/alignments/new", dependencies=[require("operator")])
def new_page(
    request: Request,
    session: SessionDep,
    kind: Word = None,
    machine: Word = None,
    found: Word = None,
    like: Number = None,
) -> Response:
    """The form for one kind; with `like` as another alignment was typed, what was found left out."""
    form = asking.blank(kind if kind in asking.KINDS else "points") | {"machine": machine or ""}
    if like is not None:
        other = queries.alignment(session, like)
        key = machine_of(session, other.machine_id).key
        form = asking.like(other.kind if other.kind in asking.KINDS else "points", other.given)
        form |= {"machine": key, "name": other.name or "", "method": other.method}
    if found is not None:
        form["found"] = found
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
        "alignments/new.html",
        status=error.status if error else 200,
        form=form,
        kind=form.get("kind") if form.get("kind") in asking.KINDS else "points",
        found=asking.found_by(form),
        rows=asking.rows_of(form),
        most=asking.MOST_ROWS,
        errors=asking.at_fields(error, lines or []) if error else {},
        error=error,
        machines=machines.machines(session),
        names=sorted({each.newest.name or "" for each in queries.set_ups(session)}),
        wording=wording,
    )


@router.post("/alignments/new")
def align(request: Request, session: SessionDep, caller: Operator, form: FormDep) -> Response:
    """Find where the part lies and keep it; or show what is wrong, with everything still there."""
    if form.get("do") == "grid":
        return _new(request, session, dict(form) | {"rows": str(asking.rows_of(form) + asking.ROWS)})
    lines: list[str] = []
    database: Database = request.app.state.database
    try:
        fields, lines = asking.fields(form)
        given = parsed(AlignmentIn, fields)
        machine = machine_named(session, given.machine)
        with database.begin() as own:
            number = actions.align(own, machine, given, caller).alignment.id
    except (Invalid, Conflict) as error:
        return _new(request, session, form, error, lines)
    except NotFound as error:
        error.errors = [FieldError("machine", error.detail)]
        return _new(request, session, form, error)
    if given.characteristics:
        readings.push_results(database)
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
    known = {each.id for each in rows}
    for name in ("pallet", "part"):
        number = asking.whole(form.get(name, ""))
        if isinstance(number, int) and number not in known:
            try:
                rows.append(queries.alignment(session, number))
            except NotFound:
                continue
            known.add(number)
    choices = [("", "–")] + [
        (str(each.id), f"{each.id} · {each.name or wording.kind_word(each.kind)} · {keys[each.machine_id]}")
        for each in rows
    ]
    return page(
        request,
        "alignments/pallet.html",
        status=error.status if error else 200,
        form=form,
        choices=choices,
        errors=asking.at_fields(error, []) if error else {},
        error=error,
    )


@router.post("/alignments/pallets/new")
def compose(request: Request, session: SessionDep, caller: Operator, form: FormDep) -> Response:
    """Compose and keep; or show what is wrong."""
    try:
        with session.begin_nested():
            made = actions.compose(session, parsed(PalletIn, asking.pallet(form)), caller)
    except (Invalid, Conflict, NotFound) as error:
        return _pallet(request, session, form, error)
    return RedirectResponse(f"/alignments/{made.alignment.id}", 303)


# --- one alignment


@router.get("/alignments/{number}")
def alignment_page(request: Request, session: SessionDep, caller: Viewer, number: int) -> Response:
    """One alignment: the frame, how well it is known, its picture, its touches, and the text for the control."""
    return _alignment(request, session, caller, queries.alignment(session, number))


def _alignment(
    request: Request,
    session: Session,
    caller: Caller,
    found: Alignment,
    form: Mapping[str, str] | None = None,
    error: InbandError | None = None,
) -> Response:
    machine = machine_of(session, found.machine_id)
    made = alignment_out(session, found)
    composed = [queries.alignment(session, each) for each in (found.pallet_id, found.part_id) if each is not None]
    return page(
        request,
        "alignments/alignment.html",
        status=error.status if error else 200,
        found=found,
        made=made,
        result=found.result,
        machine=machine,
        composed=composed,
        texts=texts_by_control(
            machine.control, partial(program_of, found, machine), f"{machine.key}-alignment-{found.id}"
        ),
        later=queries.recomputed_as(session, found),
        doubted={at for group in made.misfits for at in group},
        history=history_url(machine.key, found.name) if found.name else None,
        form=form or {},
        errors=asking.at_fields(error, []) if error else {},
        error=error,
        wording=wording,
        face=asking.face_word,
        may_align=caller.may("operator"),
    )


@router.post("/alignments/{number}/recompute")
def recompute(request: Request, session: SessionDep, caller: Operator, number: int, form: FormDep) -> Response:
    """The same touches once more, by another method or without some of them."""
    found = queries.alignment(session, number)
    try:
        with session.begin_nested():
            made = actions.recompute(session, found, parsed(RecomputeIn, asking.again(form)), caller)
    except (Invalid, Conflict) as error:
        return _alignment(request, session, caller, found, form, error)
    return RedirectResponse(f"/alignments/{made.id}", 303)
