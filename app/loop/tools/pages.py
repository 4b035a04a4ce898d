"""Pages: tool memory and average memory of a machine, the corrections that wait, and what people do to them."""

from collections.abc import Mapping
from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Caller, Operator, Viewer, require
from app.core.parameters import MOST_LOCATIONS
from app.errors import Invalid
from app.language.i18n import _
from app.loop.machines import queries as machines
from app.loop.machines.queries import machine_named
from app.loop.tables.tools import OPEN
from app.loop.tools import gain_queries, queries, verbs, wording
from app.loop.tools.verbs import OfAverage, OfCorrection, OfTool
from app.web.deps import FormDep, Number, SessionDep, Word
from app.web.paging import address, part_of
from app.web.templates import page
from app.web.verb import Outcome, add_question_page, carry_out, named

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
        gains=gain_queries.shown_gains(session, machine_row, chosen.tool.number),
        steps=part_of(
            steps,
            STEPS_ON_PAGE,
            before,
            lambda step: step.event.id,
            partial(memory_address, machine_row.key, tool=chosen.tool.number),
        ),
        # Parts that come again show the tool of the first time: which one most likely matters changes by the second.
        here=memory_address(machine_row.key, tool=chosen.tool.number, before=before),
        done=verbs.done(done, n) if done and n else None,
        late=verbs.too_late(session, machine_row, late, n) if late and n else None,
        wording=wording,
        address=memory_address,
        offered=verbs.offered,
    )


def _first(tools: list[queries.ToolRow]) -> queries.ToolRow:
    """The tool that one most likely wants to see."""
    return next((row for row in tools if row.open), None) or next((row for row in tools if row.in_use), tools[0])


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
    name: str | None,
    came_from: str | None,
    form: Mapping[str, str] | None = None,
    error: Invalid | None = None,
) -> Response:
    on = OfCorrection(session, machine_named(session, machine), number, caller)
    row = on.row
    offered = [verb for verb in verbs.offered(row.correction.status) if verb.permits(caller)]
    chosen = next((verb for verb in offered if verb.name == name), None)
    origin = {"from": came_from} if came_from else {}
    return page(
        request,
        "tools/correction.html",
        refusal=error,
        machine=on.machine,
        row=row,
        back=LISTS.get(came_from or "") or memory_address(machine, tool=row.correction.tool_memory),
        question=chosen.question(on, f"/machines/{machine}/corrections/{number}", **origin) if chosen else None,
        form=form or {},
        wording=wording,
        address=memory_address,
        offered=verbs.offered,
    )


@router.post("/machines/{machine}/corrections/{number}")
def decide(
    request: Request, session: SessionDep, caller: Operator, machine: str, number: int, form: FormDep
) -> Response:
    """Approve, release, reject, or confirm that it was applied. A person who comes too late sees the state now."""
    on = OfCorrection(session, machine_named(session, machine), number, caller)
    tool, came_from = on.row.correction.tool_memory, form.get("from")
    verb = named(verbs.CORRECTION, form.get("do", ""), on, _astray())
    try:
        outcome = carry_out(verb, on, form)
    except Invalid as error:
        return _correction(request, session, caller, machine, number, verb.name, came_from, form, error)
    if outcome.kind == "ask":
        return _correction(request, session, caller, machine, number, verb.name, came_from, form)
    said = {outcome.kind: verb.name, "n": number}
    if came_from in LISTS:
        return RedirectResponse(address(LISTS[came_from], at=machine, **said), 303)
    return RedirectResponse(memory_address(machine, tool=tool, **said), 303)


def _tool(session: SessionDep, caller: Operator, machine: str, number: int) -> OfTool:
    return OfTool(session, machine_named(session, machine), number, caller)


def _average(session: SessionDep, caller: Operator, machine: str, location: int) -> OfAverage:
    return OfAverage(session, machine_named(session, machine), location, caller)


def _around(on: OfTool | OfAverage, _verb: Any) -> dict[str, Any]:
    machine, memory = on.machine, memory_address(on.machine.key)
    trail = [(_("Machines"), "/machines"), (machine.name, f"/machines/{machine.key}"), (_("Tool memory"), memory)]
    return {"machine": machine, "trail": trail, "back": memory}


def _after(_request: Request, on: OfTool | OfAverage, _verb: Any, outcome: Outcome) -> Response:
    said = outcome.said
    tool = said.number if isinstance(on, OfTool) else None
    return RedirectResponse(memory_address(on.machine.key, tool=tool, done=said.code, n=said.number), 303)


def _astray() -> str:
    return _("Go back to the tool memory.")


add_question_page(
    router, "/machines/{machine}/tools/{number}/{what}", verbs.TOOL, _tool, around=_around, after=_after, astray=_astray
)
add_question_page(
    router,
    "/machines/{machine}/averages/{location}/edit",
    verbs.AVERAGE,
    _average,
    around=_around,
    after=_after,
    astray=_astray,
)
