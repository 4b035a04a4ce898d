"""Pages: tool memory and average memory of a machine, the corrections that wait, and what people do to them."""

from collections.abc import Mapping
from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Caller, Operator, Viewer, require
from app.core.parameters import MOST_LOCATIONS
from app.core.plausibility import empirical_value_warnings, offset_warnings
from app.errors import Invalid
from app.language.i18n import _
from app.loop.machines import queries as machines
from app.loop.machines.queries import machine_named
from app.loop.tables.tools import OPEN
from app.loop.tools import actions, confirmation, gain_queries, queries, sisters, wording
from app.loop.tools.confirmation import Question
from app.loop.tools.edge_schemas import SisterIn
from app.loop.tools.form_reader import decide_as_typed
from app.loop.tools.schemas import EmpiricalValueIn, ToolChange, ToolEdit
from app.web.deps import FormDep, Number, SessionDep, Word
from app.web.forms import by_field, length, parsed, words
from app.web.paging import address, part_of
from app.web.templates import page

router = APIRouter(include_in_schema=False)
MOST_IN_QUEUE = 50
STEPS_ON_PAGE = 10
LISTS = {"queue": "/corrections", "todo": "/todo"}  # where a decision may have been begun


def memory_address(machine: str, **query: Any) -> str:
    """The page of a machine's memories."""
    return address(f"/machines/{machine}/tools", **query)


@router.get("/machines/{machine}/tools", dependencies=[require("viewer")])
def memories(
    request: Request,
    session: SessionDep,
    machine: str,
    tool: Annotated[int | None, Query(ge=1, le=MOST_LOCATIONS)] = None,
    before: Number = None,
    done: Word = None,
    late: Word = None,
    n: Number = None,
) -> Response:
    """Open corrections, the tool memory, the average memory, and the history of one tool."""
    machine_row = machine_named(session, machine)
    tools = queries.tools(session, machine_row)
    waiting = queries.corrections(session, machine_row, statuses=OPEN, limit=MOST_IN_QUEUE + 1)
    chosen = next((row for row in tools if row.tool.number == tool), None) or _first(tools)
    steps = queries.offset_history(session, machine_row, chosen.tool.number, before=before, limit=STEPS_ON_PAGE + 1)
    return page(
        request,
        "tools/memories.html",
        machine=machine_row,
        machines=machines.machines(session),
        waiting=sorted(waiting[:MOST_IN_QUEUE], key=lambda row: row.correction.status == "pending"),
        more_wait=len(waiting) > MOST_IN_QUEUE,
        tools=tools,
        averages=queries.averages(session, machine_row),
        chosen=chosen,
        gains=gain_queries.gains(session, machine_row, chosen.tool.number),
        steps=part_of(
            steps,
            STEPS_ON_PAGE,
            before,
            lambda step: step.event.id,
            partial(memory_address, machine_row.key, tool=chosen.tool.number),
        ),
        # Parts that come again show the tool of the first time: which one most likely matters changes by the second.
        here=memory_address(machine_row.key, tool=chosen.tool.number, before=before),
        done=confirmation.done(done, n) if done and n else None,
        late=_too_late(session, machine_row.key, late, n) if late and n else None,
        wording=wording,
        address=memory_address,
        offered=confirmation.offered,
    )


def _first(tools: list[queries.ToolRow]) -> queries.ToolRow:
    """The tool that one most likely wants to see."""
    return next((row for row in tools if row.open), None) or next((row for row in tools if row.in_use), tools[0])


def _too_late(session: Session, machine: str, verb: str, number: int) -> list[str]:
    correction = queries.correction(session, machine_named(session, machine), number)
    return list(wording.refused(correction, machine, verb))


@router.get("/machines/{machine}/corrections/{number}")
def correction_page(
    request: Request,
    session: SessionDep,
    caller: Viewer,
    machine: str,
    number: int,
    do: Word = None,
    came_from: Annotated[str | None, Query(alias="from", max_length=40)] = None,
) -> Response:
    """One correction; with ``do`` it asks for the second touch, and goes back to where one came ``from``."""
    return _correction(request, session, caller, machine, number, do, came_from)


def _correction(
    request: Request,
    session: Session,
    caller: Caller,
    machine: str,
    number: int,
    verb: str | None,
    came_from: str | None,
    form: Mapping[str, str] | None = None,
    error: Invalid | None = None,
) -> Response:
    machine_row = machine_named(session, machine)
    row = queries.row_of(session, machine_row, queries.correction(session, machine_row, number))
    confirmed_verb = verb if verb in confirmation.offered(row.correction.status) and caller.may("operator") else None
    return page(
        request,
        "tools/correction.html",
        status=error.status if error else 200,
        machine=machine_row,
        row=row,
        back=LISTS.get(came_from or "") or memory_address(machine, tool=row.correction.tool_memory),
        question=confirmation.about_correction(
            row, confirmed_verb, queries.counting_on(session, machine_row, row.correction), came_from
        )
        if confirmed_verb
        else None,
        form=form or {},
        errors=by_field(error) if error else {},
        wording=wording,
        address=memory_address,
        offered=confirmation.offered,
    )


@router.post("/machines/{machine}/corrections/{number}")
def decide(
    request: Request, session: SessionDep, caller: Operator, machine: str, number: int, form: FormDep
) -> Response:
    """Approve, release, reject, or confirm that it was applied. Who comes too late is told how it stands."""
    machine_row, verb = machine_named(session, machine), form.get("do", "")
    tool = queries.correction(session, machine_row, number).tool_memory
    came_from = form.get("from")
    try:
        outcome = decide_as_typed(session, machine_row, number, form, caller)
    except Invalid as error:
        return _correction(request, session, caller, machine, number, verb, came_from, form, error)
    if outcome == "fetched":
        return _correction(request, session, caller, machine, number, verb, came_from, form)
    if came_from in LISTS:
        return RedirectResponse(address(LISTS[came_from], at=machine, n=number, **{outcome: verb}), 303)
    return RedirectResponse(memory_address(machine, tool=tool, n=number, **{outcome: verb}), 303)


@router.get("/machines/{machine}/tools/{number}/{what}", dependencies=[require("operator")])
def ask_tool(request: Request, session: SessionDep, machine: str, number: int, what: str) -> Response:
    """The forms of a manual edit (`edit`), of a tool change (`change`) and of going on with the sister tool (`sister`)."""
    machine_row = machine_named(session, machine)
    queries.tool(session, machine_row, number)
    return _ask(
        request,
        session,
        machine,
        confirmation.about_tool(queries.tools(session, machine_row, only=number)[0], machine_row.key, what),
    )


@router.post("/machines/{machine}/tools/{number}/{what}")
def set_tool(
    request: Request, session: SessionDep, caller: Operator, machine: str, number: int, what: str, form: FormDep
) -> Response:
    """The offset was set by hand, the tool was changed, or its sister goes on."""
    machine_row = machine_named(session, machine)
    queries.tool(session, machine_row, number)
    question = confirmation.about_tool(queries.tools(session, machine_row, only=number)[0], machine_row.key, what)
    fields = {"offset": length(form.get("offset")), "reason": words(form, "reason")}
    outcome = what
    try:
        if what == "edit":
            edit = parsed(ToolEdit, fields)
            warnings = offset_warnings(queries.tool(session, machine_row, number).offset, edit.offset)
            outcome = next(({"offset_step": "edit-far"}.get(warning.code, "edit-inches") for warning in warnings), what)
            actions.edit_tool(session, machine_row, number, edit.offset, edit.reason, caller)
        elif what == "sister":
            why = parsed(SisterIn, {"reason": fields["reason"]})
            number = sisters.switch_to_sister(session, machine_row, number, why.reason, caller).sister
        else:
            change = parsed(ToolChange, fields)
            actions.change_tool(session, machine_row, number, change.offset, change.reason, caller)
    except Invalid as error:
        return _ask(request, session, machine, question, form, error)
    return RedirectResponse(memory_address(machine, tool=number, done=outcome, n=number), 303)


@router.get("/machines/{machine}/averages/{location}/edit", dependencies=[require("operator")])
def ask_empirical_value(request: Request, session: SessionDep, machine: str, location: int) -> Response:
    """The form of an empirical value."""
    machine_row = machine_named(session, machine)
    queries.average(session, machine_row, location)
    row = queries.averages(session, machine_row, only=location)[0]
    return _ask(request, session, machine, confirmation.about_average(row, machine_row.key))


@router.post("/machines/{machine}/averages/{location}/edit")
def set_empirical_value(
    request: Request, session: SessionDep, caller: Operator, machine: str, location: int, form: FormDep
) -> Response:
    """Set the empirical value of an average memory."""
    machine_row = machine_named(session, machine)
    queries.average(session, machine_row, location)
    question = confirmation.about_average(queries.averages(session, machine_row, only=location)[0], machine_row.key)
    fields = {"empirical_value": length(form.get("empirical_value")), "reason": words(form, "reason")}
    try:
        value = parsed(EmpiricalValueIn, fields)
        actions.set_empirical_value(session, machine_row, location, value.empirical_value, value.reason, caller)
    except Invalid as error:
        return _ask(request, session, machine, question, form, error)
    outcome = "average-large" if empirical_value_warnings(value.empirical_value) else "average"
    return RedirectResponse(memory_address(machine, done=outcome, n=location), 303)


def _ask(
    request: Request,
    session: Session,
    machine: str,
    question: Question,
    form: Mapping[str, str] | None = None,
    error: Invalid | None = None,
) -> Response:
    machine_row = machine_named(session, machine)
    return page(
        request,
        "tools/ask.html",
        status=error.status if error else 200,
        machine=machine_row,
        question=question,
        form=form or {},
        errors=by_field(error) if error else {},
        trail=[
            (_("Machines"), "/machines"),
            (machine_row.name, f"/machines/{machine}"),
            (_("Tool memory"), memory_address(machine)),
        ],
        back=memory_address(machine),
    )
