"""Pages: fixtures and zeros, touches typed in, one zero with its picture and text, one fixture with its history."""

from collections.abc import Mapping, Sequence
from functools import partial
from secrets import token_hex
from typing import Any

from fastapi import APIRouter, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Caller, Engineer, Operator, Viewer, require
from app.errors import Conflict, FieldError, InbandError, Invalid, NotFound
from app.geometry.work_zero import actions, form_reader, pictures, queries, wording
from app.geometry.work_zero.answers import program_of, stop_of, zero_out
from app.geometry.work_zero.evaluation import touches_of
from app.geometry.work_zero.schemas import ZeroIn, ZeroRecomputeIn
from app.geometry.work_zero.tables import WorkZero
from app.loop.machines import queries as machines
from app.loop.machines.queries import machine_named, machine_of
from app.loop.machines.wording import texts_by_control
from app.loop.readings import results_actions as readings
from app.web.deps import FormDep, Number, SessionDep, Sought, Word
from app.web.forms import parsed, typed
from app.web.paging import address, part_of
from app.web.templates import page
from app.web.warnings import WarningsAcknowledgeIn

router = APIRouter(include_in_schema=False)
ON_PAGE = 25
KINDS = ("bore", "boss", "pocket", "web", "corner")


@router.get("/work-zeros", dependencies=[require("viewer")])
def overview(
    request: Request, session: SessionDep, machine: Word = None, q: Sought = "", before: Number = None
) -> Response:
    """Every fixture with how far it has shifted, and the zeros, newest first."""
    chosen = machine_named(session, machine) if machine else None
    only = chosen.id if chosen else None
    rows = queries.work_zeros(session, only, holding=q, before=before, newest_first=True, limit=ON_PAGE + 1)
    link = partial(address, "/work-zeros", machine=machine, q=q or None)
    return page(
        request,
        "work_zero/overview.html",
        fixtures=queries.fixtures(session, only) if before is None and not q else [],
        part=part_of(rows, ON_PAGE, before, lambda row: row.id, link),
        q=q,
        keys=machines.machine_keys_by_id(session),
        machine=chosen,
        machines=machines.machines(session),
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
    work_offset: Word = None,
    tip: Word = None,
    feeler: Word = None,
) -> Response:
    """The form for one kind; with `like` as another zero was typed, its touches left out.

    work_offset, tip, feeler: typed in already, as an edge finder's macro says them.
    """
    if like is not None:
        zero = queries.work_zero(session, like)
        key = machine_of(session, zero.machine_id).key
        chosen = kind if kind in KINDS else zero.kind
        form = form_reader.like(
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
        form = form_reader.blank(chosen) | {"kind": chosen, "machine": machine or usual, "fixture": fixture or ""}
    form |= {name: text for name, text in (("work_offset", work_offset), ("tip", tip), ("feeler", feeler)) if text}
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
    chosen = {name: form.get(name, "") for name in ("machine", "fixture") if form.get(name)} | (
        {"like": str(like)} if like else {}
    )
    return page(
        request,
        "work_zero/new.html",
        refusal=error,
        form=form,
        kind=kind,
        kinds=KINDS,
        kept=chosen,
        errors=form_reader.at_fields(error, typed_in) if error else {},
        machines=machines.machines(session),
        fixtures=sorted({row.key for row in queries.fixtures(session)}),
        picture=pictures.schematic(kind),
        pictures={kind_key: pictures.schematic(kind_key) for kind_key in KINDS},
        rows=form_reader.ROWS,
        shown_rows=form_reader.SHOWN_ROWS,
        results=form_reader.RESULTS,
        wording=wording,
    )


@router.post("/work-zeros/new")
def find(request: Request, session: SessionDep, caller: Operator, form: FormDep) -> Response:
    """Find the zero of what was typed and keep it; or show what is wrong, with everything still there."""
    typed_in: list[str] = []
    try:
        fields, typed_in = form_reader.fields(form)
        body = parsed(ZeroIn, fields)
        machine = machine_named(session, body.machine)
        with readings.pushing(session) as own:
            number = actions.find(own, machine, body, caller).row.id
    except (Invalid, Conflict) as error:
        return _new(request, session, form, error=error, typed_in=typed_in)
    except NotFound as error:
        error.errors = [FieldError("machine", error.detail)]
        return _new(request, session, form, error=error)
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
    unacknowledged: InbandError | None = None,
) -> Response:
    machine = machine_of(session, zero.machine_id)
    answer = zero_out(session, zero)
    touches = [touch.model_dump() for touch in answer.touches] or touches_of(zero.kind, zero.given)
    return page(
        request,
        "work_zero/zero.html",
        status=refusal.status if (refusal := error or unacknowledged) else 200,
        zero=zero,
        answer=answer,
        machine=machine,
        touches=touches,
        picture=pictures.draw(zero.kind, touches, answer.model_dump(), answer.tip),
        texts=texts_by_control(
            machine.control,
            partial(program_of, zero, machine, stop=stop_of(session, zero, machine)),
            f"{machine.key}-zero-{zero.id}",
        ),
        unacknowledged=unacknowledged,
        later=queries.recomputed_as(session, zero),
        form=form or {},
        errors=form_reader.at_fields(error) if error else {},
        error=error,
        wording=wording,
        may_measure=caller.may("operator"),
    )


@router.post("/work-zeros/{number}/acknowledge")
def acknowledge(request: Request, session: SessionDep, caller: Operator, number: int, form: FormDep) -> Response:
    """Take it as it is, although there are warnings."""
    zero = queries.work_zero(session, number)
    try:
        with session.begin_nested():
            actions.acknowledge(session, zero, typed(WarningsAcknowledgeIn, form), caller)
    except (Invalid, Conflict) as error:
        return _zero(request, session, caller, zero, unacknowledged=error)
    return RedirectResponse(f"/work-zeros/{number}", 303)


@router.post("/work-zeros/{number}/recompute")
def recompute(request: Request, session: SessionDep, caller: Operator, number: int, form: FormDep) -> Response:
    """The same touches once more, with another tip or without some of them."""
    zero = queries.work_zero(session, number)
    try:
        with session.begin_nested():
            recomputed = actions.recompute(session, zero, typed(ZeroRecomputeIn, form), caller)
    except (Invalid, Conflict) as error:
        return _zero(request, session, caller, zero, form, error)
    return RedirectResponse(f"/work-zeros/{recomputed.id}", 303)


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
    comparisons = queries.history(session, row.machine, row.key, before=before, limit=ON_PAGE + 1)[::-1]
    settings = row.settings
    filled: dict[str, Any] = {
        "basis": settings.basis,
        "reference": settings.reference or "",
        "warning": "" if settings.warning is None else f"{settings.warning * 1000:.6g}",
        "alarm": "" if settings.alarm is None else f"{settings.alarm * 1000:.6g}",
    } | {f"as_{name}": key for name, key in settings.characteristics.items()}
    return page(
        request,
        "work_zero/fixture.html",
        refusal=error,
        row=row,
        here=here,
        part=part_of(comparisons, ON_PAGE, before, lambda each: each.zero.id, partial(address, here)),
        form=filled | dict(form or {}),
        errors=form_reader.at_fields(error) if error else {},
        results=form_reader.RESULTS,
        wording=wording,
        may_watch=caller.may("engineer"),
    )


@router.post("/work-zeros/fixtures/{machine}/{fixture}")
def watch(
    request: Request, session: SessionDep, caller: Engineer, machine: str, fixture: str, form: FormDep
) -> Response:
    """Set a fixture's reference and the limits of its shift."""
    row = queries.fixture_of(session, machine, fixture)
    try:
        with session.begin_nested():
            actions.set_fixture(session, row, form_reader.watch(form), caller)
    except Invalid as error:
        return _fixture(request, session, caller, queries.fixture_of(session, machine, fixture), form=form, error=error)
    return RedirectResponse(f"/work-zeros/fixtures/{row.machine.key}/{row.key}", 303)
