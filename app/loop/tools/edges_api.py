"""JSON routes: what is in a location of the tool memory, the lives of its edges, its sister tool."""

from fastapi import Response

from app.access.deps import AnyCaller, Operator
from app.loop.machines.queries import hold_machine, machine_for, machine_named
from app.loop.tools import queries
from app.loop.tools.api import R10, get_tool
from app.loop.tools.edge_schemas import LivesOut, SisterIn, SwitchedOut, ToolSettings, lives_out
from app.loop.tools.edges import describe_tool
from app.loop.tools.figures import LifeBar, lives_figure
from app.loop.tools.lives_queries import lives
from app.loop.tools.schemas import ToolOut, tool_out
from app.loop.tools.sister_actions import switch_to_sister
from app.web.api import FIGURE, MachineKey, Theme, api_router, chart_answer, problems
from app.web.deps import SessionDep
from app.web.etags import guarded

router = api_router("offsets")


@router.patch("/machines/{machine}/tools/{tool}", responses=problems(404, 412))
@guarded(get_tool, hold_machine)
def describe(session: SessionDep, caller: Operator, machine: MachineKey, tool: R10, settings: ToolSettings) -> ToolOut:
    """Say what is in the location: edge, name, planned life, sister tool. What is left out stays, null takes it away."""
    machine_row = machine_named(session, machine)
    describe_tool(session, machine_row, tool, settings, caller)
    return tool_out(queries.tools(session, machine_row, only=tool)[0], machine_row.key)


@router.get("/machines/{machine}/tools/{tool}/lives", responses=problems(404))
def tool_lives(session: SessionDep, caller: AnyCaller, machine: MachineKey, tool: R10) -> LivesOut:
    """The edges that were in this location, newest first: parts cut, corrections summed, how long each lasted."""
    machine_row = machine_for(session, caller, machine, "viewer")
    return lives_out(lives(session, machine_row, tool), machine_row.key)


@router.get("/machines/{machine}/tools/{tool}/lives/figure", responses=problems(404) | FIGURE)
def tool_lives_figure(
    session: SessionDep, caller: AnyCaller, machine: MachineKey, tool: R10, theme: Theme = "light"
) -> Response:
    """Parts cut and corrections summed per edge as a Plotly figure: `{"data", "layout"}`."""
    machine_row = machine_for(session, caller, machine, "viewer")
    known = lives(session, machine_row, tool, limit=20)
    bars = [LifeBar(life.parts, life.total, life.ended_at, life.edge) for life in reversed(known.lives)]
    chart = lives_figure(
        bars, usual=known.usual, planned_parts=known.tool.planned_parts, planned_total=known.tool.planned_total
    )
    return chart_answer(chart, theme)


@router.post("/machines/{machine}/tools/{tool}/switch", responses=problems(404, 409))
def switch_tool(session: SessionDep, caller: Operator, machine: MachineKey, tool: R10, why: SisterIn) -> SwitchedOut:
    """Go on with the sister tool: the characteristics of this location correct the sister's offset from now on.

    Each gets a new version of its parameters; open corrections of the old tool are superseded, the averages begin at 0.
    The program of the machine selects the tool.
    """
    machine_row = machine_named(session, machine)
    return SwitchedOut(
        machine=machine_row.key, **switch_to_sister(session, machine_row, tool, why.reason, caller)._asdict()
    )
