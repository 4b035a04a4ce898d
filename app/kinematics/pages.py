"""Pages: machines with rotary axes, one of them with its drift and back-ups, a run, two runs in one picture, the protocol."""

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from markupsafe import Markup
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.errors import Conflict, Invalid
from app.kinematics import actions, asking, forms, looking, queries
from app.kinematics.protocol import protocol_of
from app.kinematics.schemas import EnterIn, PlanIn
from app.kinematics.showing import COMMON, ON_PAGE, machine_url, others_of, shown_machine, shown_run
from app.machines.queries import machine_named
from app.paper.content import Picture
from app.paper.drawing import drawing_of, svg
from app.paper.files import MEDIA_TYPES
from app.web.deps import Engineer, FormDep, Operator, SessionDep, Viewer, require
from app.web.fields import LARGEST_ID
from app.web.forms import by_field, parsed, words
from app.web.i18n import _
from app.web.templates import page

router = APIRouter(include_in_schema=False)
Number = Annotated[int | None, Query(ge=0, le=LARGEST_ID)]
Word = Annotated[str | None, Query(max_length=64)]


@router.get("/kinematics", dependencies=[require("viewer")])
def overview(request: Request, session: SessionDep, after: Annotated[str, Query(max_length=64)] = "") -> Response:
    """Every machine that a run was taken of: the last run, and what has drifted."""
    rows = looking.overview(session, after=after, limit=ON_PAGE + 1)
    return page(
        request,
        "kinematics/overview.html",
        rows=rows[:ON_PAGE],
        more=rows[ON_PAGE - 1].machine.key if len(rows) > ON_PAGE else None,
        after=after,
        **COMMON,
    )


@router.get("/kinematics/machines/{machine}")
def machine_page(
    request: Request,
    session: SessionDep,
    caller: Viewer,
    machine: str,
    head: Word = None,
    value: Word = None,
    before: Number = None,
    done: Word = None,
    n: Number = None,
) -> Response:
    """The drift of a machine, its heads, its runs, its back-ups, its limits."""
    said = asking.done(done, n) if done else None
    return shown_machine(request, session, caller, machine, head=head, value=value, before=before, said=said)


@router.post("/kinematics/machines/{machine}")
def plan(request: Request, session: SessionDep, caller: Engineer, machine: str, form: FormDep) -> Response:
    """What the runs are held against."""
    shown = machine_named(session, machine)
    try:
        with session.begin_nested():
            actions.set_plan(session, shown, parsed(PlanIn, forms.plan(form)), caller)
    except Invalid as error:
        return shown_machine(request, session, caller, machine, form=form, error=error)
    return RedirectResponse(machine_url(shown.key, done="plan"), 303)


# --- one run, two runs


@router.get("/kinematics/runs/{run}")
def run_page(request: Request, session: SessionDep, caller: Viewer, run: int, done: Word = None) -> Response:
    """How a run came out, what to enter, diagrams, tables."""
    said = asking.done(done, run) if done else None
    return shown_run(request, session, caller, run, said=said)


@router.get("/kinematics/compare")
def compare_page(
    request: Request,
    session: SessionDep,
    _caller: Viewer,
    run: Annotated[int, Query(ge=1, le=LARGEST_ID)],
    other: Annotated[int | None, Query(alias="with", ge=1, le=LARGEST_ID)] = None,
) -> Response:
    """What moved between two runs, and what to enter on the control; without another, with the one before."""
    row = queries.run(session, run)
    others = others_of(session, row)
    if other is None:
        chosen = looking.earlier(row, others) or next(iter(others), None)
        other = chosen.run.id if chosen else run
    before, after = queries.two_runs(session, run, other)
    changes = looking.changes(before, after)
    return page(
        request,
        "kinematics/compare.html",
        before=before,
        after=after,
        others=sorted([row, *others], key=lambda each: (each.run.measured_at, each.run.id), reverse=True),
        changes=changes,
        rows=sum(each.name.startswith("E") for each in changes),
        moved=[each for each in changes if each.change.moved],
        unknown=any(each.change.moved is None for each in changes if each.name.startswith("E")),
        entering=looking.to_enter(after),
        by_name=looking.to_enter(after, offsets=True),
        unrecorded=", ".join(looking.unrecorded(before.run, after.run)),
        same_head=before.run.head == after.run.head,
        **COMMON,
    )


@router.get("/kinematics/runs/{run}/protocol", dependencies=[require("viewer")])
def protocol_page(request: Request, session: SessionDep, run: int) -> Response:
    """The protocol as it is printed, and its files."""
    row = queries.run(session, run)
    address = f"/api/v1/kinematics/runs/{run}/protocol"
    return page(
        request,
        "kinematics/protocol.html",
        row=row,
        report=protocol_of(row, datetime.now(UTC)),
        picture=picture,
        files=[(each.value, each.value.upper(), f"{address}.{each.value}") for each in MEDIA_TYPES],
        **COMMON,
    )


def picture(found: Picture) -> Markup:
    """A diagram of the protocol, drawn here: the page prints it as the PDF has it."""
    return Markup(svg(drawing_of(found.figure, found.width, found.height), found.says, f"chart-{found.key}"))  # noqa: S704 - svg() escapes


@router.post("/kinematics/runs/{run}/recompute")
def recompute(request: Request, session: SessionDep, caller: Viewer, run: int) -> Response:
    """Evaluate it anew from what was sent, and say whether that comes to the same; nothing is changed."""
    row, found = actions.recompute(session, run)
    alike = looking.same(row.run.results, found.results)
    same = _("Evaluated anew from what was sent, it comes to the same.")
    other = _("Evaluated anew by the present code it comes to something else. What is on record stays as it is.")
    return shown_run(request, session, caller, run, said=same if alike else other)


# --- the second touch


@router.get("/kinematics/runs/{run}/{what}", dependencies=[require("operator")])
def ask(request: Request, session: SessionDep, run: int, what: str) -> Response:
    """The second touch: `confirm` a large change, or it is to `enter`."""
    return _ask_run(request, session, run, what)


def _ask_run(
    request: Request,
    session: Session,
    run: int,
    what: str,
    form: Mapping[str, str] | None = None,
    error: Invalid | None = None,
) -> Response:
    row = queries.run(session, run)
    back = f"/kinematics/runs/{run}"
    return _ask(request, row.machine, asking.about_run(row, what), f"{back}/{what}", back, form, error)


def _ask(
    request: Request,
    machine: Any,
    question: asking.Question,
    here: str,
    back: str,
    form: Mapping[str, str] | None,
    error: Invalid | None,
) -> Response:
    return page(
        request,
        "kinematics/ask.html",
        status=error.status if error else 200,
        machine=machine,
        question=question,
        here=here,
        back=back,
        form=form or {},
        errors=by_field(error) if error else {},
        **COMMON,
    )


@router.post("/kinematics/runs/{run}/{what}")
def decide(request: Request, session: SessionDep, caller: Operator, run: int, what: str, form: FormDep) -> Response:
    """It is done, or who comes too late is told how it stands."""
    try:
        reason = asking.reason(words(form, "reason"))
        if what == "confirm":
            actions.confirm(session, run, reason, caller)
        elif what == "undo":
            caller.must("engineer")
            actions.undo(session, run, reason, caller)
        elif what == "enter":
            given = parsed(EnterIn, forms.entry(form, reason))
            actions.enter(session, run, reason, caller, offsets=given.offsets, at=given.at)
        else:
            raise asking.nothing_here()
    except Conflict as late:
        return shown_run(request, session, caller, run, said=f"{late.detail} {late.what_to_do or ''}", late=True)
    except Invalid as error:
        return _ask_run(request, session, run, what, form, error)
    return RedirectResponse(f"/kinematics/runs/{run}?done={what}", 303)


@router.get("/kinematics/machines/{machine}/backups/{version}", dependencies=[require("engineer")])
def ask_restore(request: Request, session: SessionDep, machine: str, version: int) -> Response:
    """The second touch before a kinematics is put back."""
    return _ask_restore(request, session, machine, version)


def _ask_restore(
    request: Request,
    session: Session,
    machine: str,
    version: int,
    form: Mapping[str, str] | None = None,
    error: Invalid | None = None,
) -> Response:
    shown = machine_named(session, machine)
    old = queries.backup(session, shown, version)
    now = queries.in_effect(session, shown.id, old.head)
    question = asking.about_backup(old, now, queries.version_of(session, shown.id, old.head))
    back = machine_url(shown.key)
    return _ask(request, shown, question, f"{back}/backups/{version}", back, form, error)


@router.post("/kinematics/machines/{machine}/backups/{version}")
def restore(
    request: Request, session: SessionDep, caller: Engineer, machine: str, version: int, form: FormDep
) -> Response:
    """It is put back, as a new version."""
    shown = machine_named(session, machine)
    try:
        reason = asking.reason(words(form, "reason"))
        made = actions.restore(session, shown, version, reason, caller, instead_of=asking.seen(form.get("seen")))
    except Conflict as late:
        said = f"{late.detail} {late.what_to_do or ''}"
        return shown_machine(request, session, caller, machine, said=said, late=True)
    except Invalid as error:
        return _ask_restore(request, session, machine, version, form, error)
    return RedirectResponse(machine_url(shown.key, head=made.head, done="restore", n=made.version), 303)
