"""Pages: machines with rotary axes, one of them with its drift and back-ups, a run, two runs in one picture, the protocol."""

from datetime import UTC, datetime
from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from markupsafe import Markup
from starlette.responses import RedirectResponse

from app.access.deps import Engineer, Operator, Viewer, require
from app.charts import svg, to_drawing
from app.errors import Invalid
from app.files.documents.content import Picture
from app.files.documents.files import MEDIA_TYPES
from app.geometry.rotary_axes import actions, form_reader, queries, run_history, verbs
from app.geometry.rotary_axes.protocol import protocol_of
from app.geometry.rotary_axes.result_values import errors_of
from app.geometry.rotary_axes.verbs import OfBackup, OfRun
from app.geometry.rotary_axes.view import COMMON, ON_PAGE, machine_url, others_of, shown_machine, shown_run
from app.language.i18n import _
from app.loop.machines.queries import machine_named
from app.web.deps import FormDep, Number, SessionDep, Word
from app.web.fields import LARGEST_ID
from app.web.paging import address, part_of
from app.web.templates import page
from app.web.verb import Outcome, Verb, add_question_page

router = APIRouter(include_in_schema=False)


@router.get("/kinematics", dependencies=[require("viewer")])
def overview(request: Request, session: SessionDep, after: Annotated[str, Query(max_length=64)] = "") -> Response:
    """Every machine that a run was taken of: the last run, and what has drifted."""
    rows = run_history.overview(session, after=after, limit=ON_PAGE + 1)
    return page(
        request,
        "rotary_axes/overview.html",
        part=part_of(rows, ON_PAGE, after, lambda row: row.machine.key, partial(address, "/kinematics"), "after"),
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
    message = verbs.done(done, n) if done else None
    return shown_machine(request, session, caller, machine, head=head, value=value, before=before, message=message)


@router.post("/kinematics/machines/{machine}")
def plan(request: Request, session: SessionDep, caller: Engineer, machine: str, form: FormDep) -> Response:
    """Set the limits of the runs."""
    machine_row = machine_named(session, machine)
    try:
        with session.begin_nested():
            actions.set_plan(session, machine_row, form_reader.plan(form), caller)
    except Invalid as error:
        return shown_machine(request, session, caller, machine, form=form, error=error)
    return RedirectResponse(machine_url(machine_row.key, done="plan"), 303)


# --- one run, two runs


@router.get("/kinematics/runs/{run}")
def run_page(request: Request, session: SessionDep, caller: Viewer, run: int, done: Word = None) -> Response:
    """Result of a run: values to enter, diagrams, tables."""
    message = verbs.done(done, run) if done else None
    return shown_run(request, session, caller, run, message=message)


@router.get("/kinematics/compare")
def compare_page(
    request: Request,
    session: SessionDep,
    _caller: Viewer,
    run: Annotated[int, Query(ge=1, le=LARGEST_ID)],
    other: Annotated[int | None, Query(alias="with", ge=1, le=LARGEST_ID)] = None,
) -> Response:
    """Changes between two runs, and values to enter on the control; without another, compared with the one before."""
    row = queries.run(session, run)
    others = others_of(session, row)
    if other is None:
        chosen = run_history.earlier(row, others) or next(iter(others), None)
        other = chosen.run.id if chosen else run
    before, after = queries.two_runs(session, run, other)
    changes = run_history.changes(before, after)
    return page(
        request,
        "rotary_axes/compare.html",
        before=before,
        after=after,
        others=sorted([row, *others], key=lambda item: (item.run.measured_at, item.run.id), reverse=True),
        changes=changes,
        rows=sum(item.name.startswith("E") for item in changes),
        moved=[item for item in changes if item.change.moved],
        unknown=any(item.change.moved is None for item in changes if item.name.startswith("E")),
        entering=run_history.to_enter(after),
        by_name=run_history.to_enter(after, offsets=True),
        unrecorded=", ".join(run_history.unrecorded(before.run, after.run)),
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
        "rotary_axes/protocol.html",
        row=row,
        report=protocol_of(row, datetime.now(UTC)),
        picture=picture,
        files=[
            (file_format.value, file_format.value.upper(), f"{address}.{file_format.value}")
            for file_format in MEDIA_TYPES
        ],
        **COMMON,
    )


def picture(chart: Picture) -> Markup:
    """A diagram of the protocol, drawn here: the page prints it as the PDF has it."""
    return Markup(svg(to_drawing(chart.figure, chart.width, chart.height), chart.says, f"chart-{chart.key}"))  # noqa: S704 - svg() escapes


@router.post("/kinematics/runs/{run}/recompute")
def recompute(request: Request, session: SessionDep, caller: Operator, run: int) -> Response:
    """Evaluate it again from what was sent, and say whether that comes to the same; nothing is changed."""
    row, evaluated = actions.recompute(session, run)
    alike = run_history.same(row.run.results, evaluated.results)
    same = _("Computed again from the data sent: the result is the same.")
    other = _("Computed again with the current software: the result is different. The stored result stays.")
    return shown_run(request, session, caller, run, message=same if alike else other)


# --- the second touch


def _run(session: SessionDep, caller: Operator, run: int) -> OfRun:
    return OfRun(session, run, caller)


def _around_run(on: OfRun, verb: Verb[OfRun, Any]) -> dict[str, Any]:
    row, entered = on.row, verb.name == "enter"
    offsets = entered and bool(errors_of(row.run.results)) and any((row.run.results["offsets"] or {}).values())
    return {
        "machine": row.machine,
        "back": f"/kinematics/runs/{on.number}",
        "offsets": offsets,
        "when": entered,
        **COMMON,
    }


def _after_run(request: Request, on: OfRun, verb: Verb[OfRun, Any], outcome: Outcome) -> Response:
    """Anyone who comes too late sees the state now."""
    if outcome.kind == "late":
        return shown_run(request, on.session, on.caller, on.number, message=outcome.refused, late=True)
    return RedirectResponse(f"/kinematics/runs/{on.number}?done={verb.name}", 303)


add_question_page(
    router,
    "/kinematics/runs/{run}/{what}",
    verbs.RUN,
    _run,
    around=_around_run,
    after=_after_run,
    astray=lambda: _("Go back to the rotary axes."),
    reads=form_reader.entry,
    template="rotary_axes/ask.html",
)


def _backup(session: SessionDep, caller: Engineer, machine: str, version: int) -> OfBackup:
    return OfBackup(session, machine_named(session, machine), version, caller)


def _around_backup(on: OfBackup, _verb: Verb[OfBackup, Any]) -> dict[str, Any]:
    return {"machine": on.machine, "back": machine_url(on.machine.key), "offsets": False, "when": False, **COMMON}


def _after_restore(request: Request, on: OfBackup, _verb: Verb[OfBackup, Any], outcome: Outcome) -> Response:
    if outcome.kind == "late":
        return shown_machine(request, on.session, on.caller, on.machine.key, message=outcome.refused, late=True)
    backup = outcome.result
    return RedirectResponse(machine_url(on.machine.key, head=backup.head, done="restore", n=backup.version), 303)


add_question_page(
    router,
    "/kinematics/machines/{machine}/backups/{version}",
    (verbs.RESTORE,),
    _backup,
    around=_around_backup,
    after=_after_restore,
    astray=lambda: _("Go back to the rotary axes."),
    template="rotary_axes/ask.html",
)
