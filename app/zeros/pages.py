"""Pages: fixtures and zeros, touches typed in, one zero with its picture and text, one fixture with its history."""

from collections.abc import Mapping, Sequence
from functools import partial
from secrets import token_hex
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.db.engine import Database
from app.errors import Conflict, FieldError, InbandError, Invalid, NotFound
from app.machines import queries as machines
from app.machines.queries import machine_named, machine_of
from app.machines.wording import texts_by_control
from app.readings import actions as readings
from app.web.deps import Caller, Engineer, FormDep, Operator, SessionDep, Viewer, require
from app.web.fields import LARGEST_ID
from app.web.forms import parsed
from app.web.templates import page
from app.zeros import actions, forms, pictures, queries, wording
from app.zeros.answers import program_of, zero_out
from app.zeros.schemas import FixtureIn, RecomputeIn, ZeroIn
from app.zeros.tables import WorkZero

router = APIRouter(include_in_schema=False)
ON_PAGE = 25
KINDS = ("bore", "boss", "pocket", "web", "corner")
Word = Annotated[str | None, Query(max_length=64)]
Number = Annotated[int | None, Query(ge=0, le=LARGEST_ID)]


@router.get("/work-zeros", dependencies=[require("viewer")])
def overview(request: Request, session: SessionDep, machine: Word = None, before: Number = None) -> Response:
    """Every fixture with how far it has shifted, and the zeros, newest first."""
    shown = machine_named(session, machine) if machine else None
    only = shown.id if shown else None
    rows = queries.work_zeros(session, only, before=before, newest_first=True, limit=ON_PAGE + 1)
    here = f"/work-zeros?machine={shown.key}" if shown else "/work-zeros?"
    return page(
        request,
        "zeros/overview.html",
        fixtures=queries.fixtures(session, only) if before is None else [],
        zeros=rows[:ON_PAGE],
        keys=machines.machine_keys_by_id(session),
        machine=shown,
        machines=machines.machines(session),
        older=f"{here}&before={rows[ON_PAGE - 1].id}" if len(rows) > ON_PAGE else None,
        newest=here if before is not None else None,
        wording=wording,
    )


# --- touches typed in


@router.get("/work-zeros/new", dependencies=[require("operator")])
def new_page(
    request: Request,
    session: SessionDep,
    kind: Word = None,
    machine: Word = None,
    fixture: Word = None,
    like: Number = None,
) -> Response:
    """The form for one kind; with `like` as another zero was typed, its touches left out."""
    if like is not None:
        zero = queries.work_zero(session, like)
        key = machine_of(session, zero.machine_id).key
        chosen = kind if kind in KINDS else zero.kind
        form = forms.like(
            zero.given if chosen == zero.kind else {},
            chosen,
            kind=chosen,
            machine=key,
            work_offset=zero.work_offset,
            fixture=zero.fixture,
        )
    else:
        chosen = kind if kind in KINDS else "pocket"
        last = queries.work_zeros(session, newest_first=True, limit=1)
        usual = machine_of(session, last[0].machine_id).key if last else ""
        form = forms.blank(chosen) | {"kind": chosen, "machine": machine or usual, "fixture": fixture or ""}
    return _new(request, session, form | {"key": f"page-{token_hex(12)}"}, like=like)


def _new(
    request: Request,
    session: Session,
    form: Mapping[str, str],
    *,
    like: int | None = None,
    error: InbandError | None = None,
    typed_in: Sequence[str] = (),
) -> Response:
    kind = form.get("kind") if form.get("kind") in KINDS else "pocket"
    assert kind is not None
    kept = {name: form.get(name, "") for name in ("machine", "fixture") if form.get(name)} | (
        {"like": str(like)} if like else {}
    )
    return page(
        request,
        "zeros/new.html",
        status=error.status if error else 200,
        form=form,
        kind=kind,
        kinds=KINDS,
        kept=kept,
        errors=forms.at_fields(error, typed_in) if error else {},
        error=error,
        machines=machines.machines(session),
        fixtures=sorted({row.key for row in queries.fixtures(session)}),
        picture=pictures.schematic(kind),
        pictures={each: pictures.schematic(each) for each in KINDS},
        rows=forms.ROWS,
        shown_rows=forms.SHOWN_ROWS,
        results=forms.RESULTS,
        wording=wording,
    )


@router.post("/work-zeros/new")
def find(request: Request, session: SessionDep, caller: Operator, form: FormDep) -> Response:
    """Find the zero of what was typed and keep it; or show what is wrong, with everything still there."""
    typed_in: list[str] = []
    database: Database = request.app.state.database
    try:
        fields, typed_in = forms.fields(form)
        given = parsed(ZeroIn, fields)
        machine = machine_named(session, given.machine)
        with database.begin() as own:
            number = actions.find(own, machine, given, caller).zero.id
    except (Invalid, Conflict) as error:
        return _new(request, session, form, error=error, typed_in=typed_in)
    except NotFound as error:
        error.errors = [FieldError("machine", error.detail)]
        return _new(request, session, form, error=error)
    readings.push_results(database)
    return RedirectResponse(f"/work-zeros/{number}", 303)


# --- one zero


@router.get("/work-zeros/{number}")
def zero_page(request: Request, session: SessionDep, caller: Viewer, number: int) -> Response:
    """One zero: what it came to, the picture of its touches, and the text for the control."""
    return _zero(request, session, caller, queries.work_zero(session, number))


def _zero(
    request: Request,
    session: Session,
    caller: Caller,
    zero: WorkZero,
    form: Mapping[str, str] | None = None,
    error: InbandError | None = None,
) -> Response:
    machine = machine_of(session, zero.machine_id)
    made = zero_out(session, zero)
    touches = [each.model_dump() for each in made.touches] or actions.touches_of(zero.kind, zero.given)
    return page(
        request,
        "zeros/zero.html",
        status=error.status if error else 200,
        zero=zero,
        made=made,
        machine=machine,
        touches=touches,
        picture=pictures.draw(zero.kind, touches, made.model_dump(), made.tip),
        texts=texts_by_control(machine.control, partial(program_of, zero, machine), f"{machine.key}-zero-{zero.id}"),
        later=queries.recomputed_as(session, zero),
        form=form or {},
        errors=forms.at_fields(error) if error else {},
        error=error,
        wording=wording,
        may_measure=caller.may("operator"),
    )


@router.post("/work-zeros/{number}/recompute")
def recompute(request: Request, session: SessionDep, caller: Operator, number: int, form: FormDep) -> Response:
    """The same touches once more, with another tip or without some of them."""
    zero = queries.work_zero(session, number)
    try:
        with session.begin_nested():
            made = actions.recompute(session, zero, parsed(RecomputeIn, forms.again(form)), caller)
    except (Invalid, Conflict) as error:
        return _zero(request, session, caller, zero, form, error)
    return RedirectResponse(f"/work-zeros/{made.id}", 303)


# --- one fixture


@router.get("/work-zeros/fixtures/{machine}/{fixture}")
def fixture_page(
    request: Request, session: SessionDep, caller: Viewer, machine: str, fixture: str, before: Number = None
) -> Response:
    """One fixture: its zeros over time against the limits, and what they are compared with."""
    return _fixture(request, session, caller, queries.fixture_of(session, machine, fixture), before=before)


def _fixture(
    request: Request,
    session: Session,
    caller: Caller,
    row: queries.FixtureRow,
    *,
    before: int | None = None,
    form: Mapping[str, str] | None = None,
    error: Invalid | None = None,
) -> Response:
    here = f"/work-zeros/fixtures/{row.machine.key}/{row.key}"
    shown = queries.history(session, row.machine, row.key, before=before, limit=ON_PAGE + 1)[::-1]
    settings = row.settings
    filled: dict[str, Any] = {
        "basis": settings.basis,
        "reference": settings.reference or "",
        "warning": "" if settings.warning is None else f"{settings.warning * 1000:.6g}",
        "alarm": "" if settings.alarm is None else f"{settings.alarm * 1000:.6g}",
    } | {f"as_{name}": key for name, key in settings.characteristics.items()}
    return page(
        request,
        "zeros/fixture.html",
        status=error.status if error else 200,
        row=row,
        here=here,
        zeros=shown[:ON_PAGE],
        older=f"{here}?before={shown[ON_PAGE - 1].zero.id}" if len(shown) > ON_PAGE else None,
        newest=here if before is not None else None,
        form=filled | dict(form or {}),
        errors=forms.at_fields(error) if error else {},
        error=error,
        results=forms.RESULTS,
        wording=wording,
        may_watch=caller.may("engineer"),
    )


@router.post("/work-zeros/fixtures/{machine}/{fixture}")
def watch(
    request: Request, session: SessionDep, caller: Engineer, machine: str, fixture: str, form: FormDep
) -> Response:
    """What its zeros are compared with from now on, and how far it may shift."""
    row = queries.fixture_of(session, machine, fixture)
    try:
        with session.begin_nested():
            actions.set_fixture(session, row, parsed(FixtureIn, forms.watch(form)), caller)
    except Invalid as error:
        return _fixture(request, session, caller, queries.fixture_of(session, machine, fixture), form=form, error=error)
    return RedirectResponse(f"/work-zeros/fixtures/{row.machine.key}/{row.key}", 303)
