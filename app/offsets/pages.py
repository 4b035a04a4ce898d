"""Pages: tool memory and average memory of a machine, the corrections that wait, and what people do to them."""

from collections.abc import Mapping
from typing import Annotated, Any
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.errors import Conflict, Invalid
from app.machines import queries as machines
from app.machines.queries import machine_named
from app.offsets import actions, asking, confirming, queries, sisters, wording
from app.offsets.asking import Question
from app.offsets.edge_schemas import SisterIn
from app.offsets.schemas import AppliedIn, DecisionIn, EmpiricalValueIn, ToolChange, ToolEdit
from app.offsets.tables import OPEN
from app.web.deps import Caller, FormDep, Operator, SessionDep, Viewer, require
from app.web.fields import LARGEST_ID
from app.web.forms import by_field, length, parsed, words
from app.web.i18n import _
from app.web.templates import page

router = APIRouter(include_in_schema=False)
MOST_IN_QUEUE = 50
STEPS_ON_PAGE = 10
QUEUE, FROM_QUEUE = "/corrections", "queue"  # where a decision may have been begun
Number = Annotated[int | None, Query(ge=0, le=LARGEST_ID)]
Word = Annotated[str | None, Query(max_length=40)]


def memory_address(machine: str, **query: Any) -> str:
    """The page of a machine's memories."""
    given = {name: value for name, value in query.items() if value is not None}
    return f"/machines/{machine}/tools" + (f"?{urlencode(given)}" if given else "")


@router.get("/tools", dependencies=[require("viewer")])
def choose_machine(request: Request, session: SessionDep) -> Response:
    """Whose tool memory? With one machine there is nothing to ask."""
    all_machines = machines.machines(session)
    if len(all_machines) == 1:
        return RedirectResponse(memory_address(all_machines[0].key), 303)
    waiting = queries.open_counts(session)
    return page(request, "offsets/machines.html", machines=[(each, waiting.get(each.id, {})) for each in all_machines])


@router.get("/machines/{machine}/tools", dependencies=[require("viewer")])
def memories(
    request: Request,
    session: SessionDep,
    machine: str,
    tool: Annotated[int | None, Query(ge=1, le=queries.TOOL_LOCATIONS)] = None,
    before: Number = None,
    done: Word = None,
    late: Word = None,
    n: Number = None,
) -> Response:
    """What waits, the tool memory, the average memory, and the history of one tool."""
    shown = machine_named(session, machine)
    tools = queries.tools(session, shown)
    waiting = queries.corrections(session, shown, statuses=OPEN, limit=MOST_IN_QUEUE + 1)
    chosen = next((row for row in tools if row.tool.number == tool), None) or _first(tools)
    steps = queries.steps(session, shown, chosen.tool.number, before=before, limit=STEPS_ON_PAGE + 1)
    return page(
        request,
        "offsets/memories.html",
        machine=shown,
        machines=machines.machines(session),
        waiting=sorted(waiting[:MOST_IN_QUEUE], key=lambda row: row.correction.status == "pending"),
        more_wait=len(waiting) > MOST_IN_QUEUE,
        tools=tools,
        averages=queries.averages(session, shown),
        chosen=chosen,
        steps=steps[:STEPS_ON_PAGE],
        older=memory_address(shown.key, tool=chosen.tool.number, before=steps[STEPS_ON_PAGE - 1].event.id)
        if len(steps) > STEPS_ON_PAGE
        else None,
        newest=memory_address(shown.key, tool=chosen.tool.number) if before else None,
        # Parts that come again show the tool of the first time: which one most likely matters changes by the second.
        here=memory_address(shown.key, tool=chosen.tool.number, before=before),
        done=asking.done(done, n) if done and n else None,
        late=_too_late(session, shown.key, late, n) if late and n else None,
        wording=wording,
        address=memory_address,
        offered=asking.offered,
    )


def _first(tools: list[queries.ToolRow]) -> queries.ToolRow:
    """The tool that one most likely wants to see."""
    return next((row for row in tools if row.open), None) or next((row for row in tools if row.in_use), tools[0])


def _too_late(session: Session, machine: str, verb: str, number: int) -> list[str]:
    found = queries.correction(session, machine_named(session, machine), number)
    return list(wording.refused(found, machine, verb))


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
    shown = machine_named(session, machine)
    row = queries.row_of(session, shown, queries.correction(session, shown, number))
    asked = verb if verb in asking.offered(row.correction.status) and caller.may("operator") else None
    return page(
        request,
        "offsets/correction.html",
        status=error.status if error else 200,
        machine=shown,
        row=row,
        back=QUEUE if came_from == FROM_QUEUE else memory_address(machine, tool=row.correction.tool_memory),
        question=asking.about_correction(row, asked, queries.counting_on(session, shown, row.correction), came_from)
        if asked
        else None,
        form=form or {},
        errors=by_field(error) if error else {},
        wording=wording,
        address=memory_address,
        offered=asking.offered,
    )


@router.post("/machines/{machine}/corrections/{number}")
def decide(
    request: Request, session: SessionDep, caller: Operator, machine: str, number: int, form: FormDep
) -> Response:
    """Approve, release, reject, or confirm that it was applied. Who comes too late is told how it stands."""
    shown, verb = machine_named(session, machine), form.get("do", "")
    found = queries.correction(session, shown, number)
    said = {"done": verb}
    try:
        if verb == "applied":
            applied = parsed(AppliedIn, {"offset_after": length(form.get("offset_after"))})
            confirming.mark_applied(session, shown, number, caller, offset_after=applied.offset_after)
        else:
            decision = parsed(DecisionIn, {"reason": words(form, "reason")})
            warned = form.get("although_fetched") == "true"
            actions.decide(session, shown, number, asking.verb(verb), decision.reason, caller, although_fetched=warned)
    except Conflict as error:
        session.refresh(found)
        if "fetched_at" in error.more:  # fetched while this was being asked: ask again, with the warning
            return _correction(request, session, caller, machine, number, verb, form.get("from"), form)
        sent_twice = found.decided_by == caller.name and found.status == actions.INTO.get(verb)
        said = {"done": verb} if sent_twice else {"late": verb}
    except Invalid as error:
        return _correction(request, session, caller, machine, number, verb, form.get("from"), form, error)
    if form.get("from") == FROM_QUEUE:
        return RedirectResponse(f"{QUEUE}?{urlencode({'at': machine, 'n': number, **said})}", 303)
    return RedirectResponse(memory_address(machine, tool=found.tool_memory, n=number, **said), 303)


@router.get("/machines/{machine}/tools/{number}/{what}", dependencies=[require("operator")])
def ask_tool(request: Request, session: SessionDep, machine: str, number: int, what: str) -> Response:
    """The forms of a manual edit (`edit`), of a tool change (`change`) and of going on with the sister tool (`sister`)."""
    shown = machine_named(session, machine)
    queries.tool(session, shown, number)
    return _ask(
        request, session, machine, asking.about_tool(queries.tools(session, shown, only=number)[0], shown.key, what)
    )


@router.post("/machines/{machine}/tools/{number}/{what}")
def set_tool(
    request: Request, session: SessionDep, caller: Operator, machine: str, number: int, what: str, form: FormDep
) -> Response:
    """The offset was set by hand, the tool was changed, or its sister goes on."""
    shown = machine_named(session, machine)
    queries.tool(session, shown, number)
    question = asking.about_tool(queries.tools(session, shown, only=number)[0], shown.key, what)
    given = {"offset": length(form.get("offset")), "reason": words(form, "reason")}
    try:
        if what == "edit":
            edit = parsed(ToolEdit, given)
            actions.edit_tool(session, shown, number, edit.offset, edit.reason, caller)
        elif what == "sister":
            why = parsed(SisterIn, {"reason": given["reason"]})
            number = sisters.switch_to_sister(session, shown, number, why.reason, caller).sister
        else:
            change = parsed(ToolChange, given)
            actions.change_tool(session, shown, number, change.offset, change.reason, caller)
    except Invalid as error:
        return _ask(request, session, machine, question, form, error)
    return RedirectResponse(memory_address(machine, tool=number, done=what, n=number), 303)


@router.get("/machines/{machine}/averages/{location}/edit", dependencies=[require("operator")])
def ask_empirical_value(request: Request, session: SessionDep, machine: str, location: int) -> Response:
    """The form of an empirical value."""
    shown = machine_named(session, machine)
    queries.average(session, shown, location)
    row = queries.averages(session, shown, only=location)[0]
    return _ask(request, session, machine, asking.about_average(row, shown.key))


@router.post("/machines/{machine}/averages/{location}/edit")
def set_empirical_value(
    request: Request, session: SessionDep, caller: Operator, machine: str, location: int, form: FormDep
) -> Response:
    """What is taken off every measurement from now on."""
    shown = machine_named(session, machine)
    queries.average(session, shown, location)
    question = asking.about_average(queries.averages(session, shown, only=location)[0], shown.key)
    given = {"empirical_value": length(form.get("empirical_value")), "reason": words(form, "reason")}
    try:
        value = parsed(EmpiricalValueIn, given)
        actions.set_empirical_value(session, shown, location, value.empirical_value, value.reason, caller)
    except Invalid as error:
        return _ask(request, session, machine, question, form, error)
    return RedirectResponse(memory_address(machine, done="average", n=location), 303)


def _ask(
    request: Request,
    session: Session,
    machine: str,
    question: Question,
    form: Mapping[str, str] | None = None,
    error: Invalid | None = None,
) -> Response:
    shown = machine_named(session, machine)
    return page(
        request,
        "offsets/ask.html",
        status=error.status if error else 200,
        machine=shown,
        question=question,
        form=form or {},
        errors=by_field(error) if error else {},
        trail=[(_("Tool memory"), "/tools"), (shown.name, memory_address(machine))],
        back=memory_address(machine),
    )
