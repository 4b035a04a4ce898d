"""JSON routes: tool memory (R10), average memory (R11), and the life of corrections."""

from typing import Annotated

from fastapi import Path, Query, Response

from app.access.deps import AnyCaller, Operator, OperatorOrMachine, require
from app.core.parameters import MOST_LOCATIONS
from app.core.plausibility import offset_warnings
from app.loop.machines.queries import hold_machine, machine_for, machine_named
from app.loop.timeline.figures import MANUAL_EDIT, TOOL_CHANGE
from app.loop.timeline.queries import with_events_of_machine
from app.loop.tools import actions, applying, gain_queries, queries, wording
from app.loop.tools.actions import Decided
from app.loop.tools.figures import OffsetChange, offset_figure
from app.loop.tools.schemas import (
    AverageOut,
    AverageSet,
    CorrectionOut,
    DecisionsIn,
    EmpiricalValueIn,
    OffsetReportIn,
    OffsetReportOut,
    Status,
    ToolChange,
    ToolEdit,
    ToolOut,
    ToolSet,
    average_out,
    average_set,
    correction_out,
    tool_out,
    tool_set,
)
from app.loop.tools.verbs import CORRECTION, OfCorrection
from app.web.api import FIGURE, Limit, MachineKey, SerialAfter, Theme, Width, api_router, chart_answer, problems
from app.web.deps import DoorSessionDep, SessionDep
from app.web.etags import TAGGED, guarded, tagged
from app.web.fields import Page, page_of
from app.web.verb import add_json_route

router = api_router("offsets")
DRAWN = (TOOL_CHANGE, MANUAL_EDIT)  # events of the offset's own chart
R10 = Annotated[int, Path(description="Tool memory location R10, 1 to what the machine has.", examples=[3])]
R11 = Annotated[int, Path(description="Average memory location R11, 1 to what the machine has.", examples=[5])]
Number = Annotated[int, Path(description="Number of the correction; counts per machine.", examples=[18])]


# --- tool memory


@router.get("/machines/{machine}/tools", responses=problems(404))
def list_tools(
    session: DoorSessionDep,
    caller: AnyCaller,
    machine: MachineKey,
    after: SerialAfter = 0,
    limit: Limit = 100,
) -> Page[ToolOut]:
    """The tool memory: every location with its offset, the sum of corrections since the tool was changed, parts cut."""
    machine_row = machine_for(session, caller, machine, "viewer")
    rows = queries.tools(session, machine_row, after=after, limit=limit + 1)
    return page_of([tool_out(row, machine_row.key) for row in rows], limit, lambda tool: tool.tool_memory)


@router.get("/machines/{machine}/tools/{tool}", responses=problems(404) | TAGGED)
@tagged
def get_tool(session: DoorSessionDep, caller: AnyCaller, machine: MachineKey, tool: R10) -> ToolOut:
    """One location of the tool memory."""
    machine_row = machine_for(session, caller, machine, "viewer")
    queries.tool(session, machine_row, tool)
    row = queries.tools(session, machine_row, only=tool)[0]
    return tool_out(row, machine_row.key, gain_queries.shown_gains(session, machine_row, tool))


@router.put("/machines/{machine}/tools/{tool}", responses=problems(404, 412))
@guarded(get_tool, hold_machine)
def edit_tool(
    session: SessionDep, caller: OperatorOrMachine, machine: MachineKey, tool: R10, edit: ToolEdit
) -> ToolSet:
    """Say what the offset was set to by hand.

    Corrections that are still open were computed for the offset before: they are superseded. The running averages of the
    characteristics on this tool begin again at 0, and parts cut before say nothing about the new offset.
    """
    machine_row = machine_for(session, caller, machine, "operator")
    before = queries.tool(session, machine_row, tool).offset
    done = actions.edit_tool(session, machine_row, tool, edit.offset, edit.reason, caller)
    warnings = offset_warnings(before, edit.offset)
    return tool_set(queries.tools(session, machine_row, only=tool)[0], machine_row.key, done.superseded, warnings)


@router.post("/machines/{machine}/tools/{tool}/change", responses=problems(404))
def change_tool(
    session: SessionDep, caller: OperatorOrMachine, machine: MachineKey, tool: R10, change: ToolChange
) -> ToolSet:
    """Say that the tool was changed.

    As a manual edit; besides, its parts and the sum of its corrections begin again at 0. Alarms about the old tool stay
    until somebody acknowledges them.
    """
    machine_row = machine_for(session, caller, machine, "operator")
    before = queries.tool(session, machine_row, tool).offset
    done = actions.change_tool(session, machine_row, tool, change.offset, change.reason, caller)
    warnings = offset_warnings(before, change.offset)
    return tool_set(queries.tools(session, machine_row, only=tool)[0], machine_row.key, done.superseded, warnings)


@router.post("/machines/{machine}/tools/{tool}/reported", responses=problems(404))
def report_offset(
    session: DoorSessionDep, caller: OperatorOrMachine, machine: MachineKey, tool: R10, report: OffsetReportIn
) -> OffsetReportOut:
    """Say what offset the control holds, without confirming a correction.

    Within 0.0005 mm of the known one, or of what pending corrections lead to, nothing happens. Any other raises the alarm
    *offset differs*: open corrections are superseded, and nothing is corrected through this tool until somebody has said
    which offset is true.
    """
    machine_row = machine_for(session, caller, machine, "operator")
    done = applying.report_offset(session, machine_row, tool, report.offset, caller, none_applied=report.none_applied)
    return OffsetReportOut(
        machine=machine_row.key,
        tool_memory=tool,
        offset=done.tool.offset,
        differs=done.differs,
        explained_by=list(done.explained_by),
        superseded=list(done.superseded),
        paused_by=done.tool.paused_by,
        note=done.note,
    )


@router.get("/machines/{machine}/tools/{tool}/figure", responses=problems(404) | FIGURE)
def tool_figure(
    session: SessionDep,
    caller: AnyCaller,
    machine: MachineKey,
    tool: R10,
    theme: Theme = "light",
    width: Width = 1240,
    limit: Limit = 500,
) -> Response:
    """The history of the offset as a Plotly figure: `{"data", "layout"}`."""
    machine_row = machine_for(session, caller, machine, "viewer")
    queries.tool(session, machine_row, tool)
    steps = reversed(queries.offset_history(session, machine_row, tool, limit=limit))
    changes = [OffsetChange(step.event.at, step.event.offset_after, step.kind, wording.step(step)) for step in steps]
    chart = offset_figure(changes)
    return chart_answer(with_events_of_machine(session, machine_row, chart, width, tool=tool, without=DRAWN), theme)


# --- average memory


@router.get("/machines/{machine}/averages", responses=problems(404))
def list_averages(
    session: SessionDep,
    caller: AnyCaller,
    machine: MachineKey,
    after: SerialAfter = 0,
    limit: Limit = 100,
) -> Page[AverageOut]:
    """The average memory: running average and empirical value of every location."""
    machine_row = machine_for(session, caller, machine, "viewer")
    rows = queries.averages(session, machine_row, after=after, limit=limit + 1)
    return page_of([average_out(row, machine_row.key) for row in rows], limit, lambda average: average.average_memory)


@router.get("/machines/{machine}/averages/{location}", responses=problems(404) | TAGGED)
@tagged
def get_average(session: SessionDep, caller: AnyCaller, machine: MachineKey, location: R11) -> AverageOut:
    """One location of the average memory."""
    machine_row = machine_for(session, caller, machine, "viewer")
    queries.average(session, machine_row, location)
    return average_out(queries.averages(session, machine_row, only=location)[0], machine_row.key)


@router.put("/machines/{machine}/averages/{location}", responses=problems(404, 412))
@guarded(get_average, hold_machine)
def set_empirical_value(
    session: SessionDep, caller: OperatorOrMachine, machine: MachineKey, location: R11, value: EmpiricalValueIn
) -> AverageSet:
    """Set the empirical value; the running average begins again at 0.

    Another one than before supersedes the open corrections of the characteristics that use this location: they were computed
    with it, and the next readings decide again.
    """
    machine_row = machine_for(session, caller, machine, "operator")
    warnings = actions.set_empirical_value(session, machine_row, location, value.empirical_value, value.reason, caller)
    return average_set(queries.averages(session, machine_row, only=location)[0], machine_row.key, warnings)


# --- corrections


@router.get("/machines/{machine}/corrections", responses=problems(404))
def list_corrections(
    session: DoorSessionDep,
    caller: AnyCaller,
    machine: MachineKey,
    status: Annotated[list[Status], Query(description="Only these; may be given several times.")] = [],  # noqa: B006 - FastAPI copies it
    tool_memory: Annotated[
        int | None, Query(description="Only those of this location R10.", ge=1, le=MOST_LOCATIONS)
    ] = None,
    after: SerialAfter = 0,
    limit: Limit = 100,
) -> Page[CorrectionOut]:
    """Corrections, oldest first: the order in which a machine applies the pending ones."""
    machine_row = machine_for(session, caller, machine, "viewer")
    rows = queries.corrections(
        session, machine_row, statuses=status, tool_memory=tool_memory, after=after, limit=limit + 1
    )
    return page_of([correction_out(row) for row in rows], limit, lambda correction: correction.number)


@router.get("/corrections/{machine}/{number}", responses=problems(404))
def get_correction(session: DoorSessionDep, caller: AnyCaller, machine: MachineKey, number: Number) -> CorrectionOut:
    """One correction."""
    machine_row = machine_for(session, caller, machine, "viewer")
    return correction_out(queries.row_of(session, machine_row, queries.correction(session, machine_row, number)))


def _of_machine(session: DoorSessionDep, caller: AnyCaller, machine: MachineKey, number: Number) -> OfCorrection:
    return OfCorrection(session, machine_for(session, caller, machine, "operator"), number, caller)


def _of_person(session: SessionDep, caller: AnyCaller, machine: MachineKey, number: Number) -> OfCorrection:
    return OfCorrection(session, machine_named(session, machine), number, caller)


def _decided(on: OfCorrection, done: Decided) -> CorrectionOut:
    return correction_out(queries.row_of(on.session, on.machine, done.correction), done.note)


for _verb in CORRECTION:
    _subject, _asks = (_of_machine, []) if _verb.by_machine else (_of_person, [require(_verb.role)])
    add_json_route(
        router, f"/corrections/{{machine}}/{{number}}/{_verb.name}", _verb, _subject, _decided, CorrectionOut, _asks
    )


@router.post("/corrections/{machine}/approve", responses=problems(404, 409))
def approve_corrections(
    session: SessionDep, caller: Operator, machine: MachineKey, decision: DecisionsIn
) -> Page[CorrectionOut]:
    """A person approves several corrections together, such as all that wait for one tool.

    All of them or none: if somebody has decided about one meanwhile, the answer is 409 and says who and how.
    """
    machine_row = machine_named(session, machine)
    approved = actions.approve_all(session, machine_row, decision.numbers, decision.reason, caller)
    return Page(items=[correction_out(row) for row in queries.rows_of(session, machine_row, approved)])
