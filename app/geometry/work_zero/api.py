"""JSON routes: work zeros and the fixtures they are found in."""

from typing import Annotated

from fastapi import Path, Query, Response
from fastapi.responses import PlainTextResponse

from app.access.deps import AnyCaller, Engineer, Operator, OperatorOrMachine
from app.geometry.work_zero import actions, figures, queries
from app.geometry.work_zero.answers import (
    TEXT,
    FixtureOut,
    ZeroOut,
    fixture_out,
    program_of,
    stop_of,
    zero_out,
    zeros_out,
)
from app.geometry.work_zero.figures import Mark
from app.geometry.work_zero.schemas import FixtureIn, ZeroIn, ZeroRecomputeIn
from app.loop.machines.queries import hold_machine, machine_for, machine_of, only_machine
from app.loop.machines.wording import file_name, no_old_offset, no_such_offset
from app.loop.readings import results_actions as readings
from app.loop.timeline.queries import with_events_of_machine
from app.web.api import (
    FIGURE,
    After,
    Limit,
    MachineFilter,
    MachineKey,
    Theme,
    Width,
    api_router,
    chart_answer,
    plain,
    problems,
    sent_again,
)
from app.web.deps import SessionDep
from app.web.downloads import download
from app.web.etags import TAGGED, guarded, tagged
from app.web.fields import Control, Page, Slug, page_of
from app.web.warnings import WarningsAcknowledgeIn

router = api_router("work zeros")
FixtureKey = Annotated[str, Path(description="The fixture, as work zeros name it.", examples=["vice-left"])]
Number = Annotated[int, Path(description="Number of the work zero.", examples=[12])]
FixtureFilter = Annotated[Slug | None, Query(description="Only of this fixture.", examples=["vice-left"])]


@router.post("/work-zeros", status_code=201, responses=problems(404, 409) | sent_again(ZeroOut))
def find_work_zero(session: SessionDep, caller: OperatorOrMachine, body: ZeroIn, response: Response) -> ZeroOut:
    """Find work zero and size from the touches of an edge finder or probe.

    The answer holds the text that sets it on the machine's control, and how far the fixture has shifted. Touches that make
    no zero are refused with the reason, by their numbers. `characteristics` names what its results become readings of.
    `warnings` names what is hardly plausible: until somebody acknowledges them the text stops the control.
    """
    with readings.pushing(session) as own:
        machine = machine_for(own, caller, body.machine, "operator")
        created = actions.find(own, machine, body, caller)
    response.status_code = 200 if created.again else 201
    return zero_out(session, queries.work_zero(session, created.row.id))


@router.get("/work-zeros", responses=problems(404))
def list_work_zeros(
    session: SessionDep,
    caller: AnyCaller,
    machine: MachineFilter = None,
    fixture: FixtureFilter = None,
    after: After = 0,
    limit: Limit = 100,
) -> Page[ZeroOut]:
    """Work zeros in the order in which they came."""
    only = only_machine(session, caller, machine)
    rows = queries.work_zeros(session, only, fixture, after=after, limit=limit + 1)
    return page_of(zeros_out(session, rows), limit, lambda row: row.id)


@router.get("/work-zeros/fixtures")
def list_fixtures(session: SessionDep, caller: AnyCaller) -> Page[FixtureOut]:
    """Every fixture with its last zero and how far it has shifted."""
    return Page(items=[fixture_out(row) for row in queries.fixtures(session, caller.only_machine)])


@router.get("/work-zeros/fixtures/{machine}/{fixture}", responses=problems(404) | TAGGED)
@tagged
def get_fixture(session: SessionDep, caller: AnyCaller, machine: MachineKey, fixture: FixtureKey) -> FixtureOut:
    """One fixture; its zeros: `GET /work-zeros?machine=…&fixture=…`."""
    machine_for(session, caller, machine, "viewer")
    return fixture_out(queries.fixture_of(session, machine, fixture))


@router.put("/work-zeros/fixtures/{machine}/{fixture}", responses=problems(404, 412))
@guarded(get_fixture, hold_machine)
def watch_fixture(
    session: SessionDep, caller: Engineer, machine: MachineKey, fixture: FixtureKey, body: FixtureIn
) -> FixtureOut:
    """Set a fixture's reference, the shift that warns, and the shift that raises the alarm *fixture shifted*."""
    row = queries.fixture_of(session, machine, fixture)
    actions.set_fixture(session, row, body, caller)
    return fixture_out(queries.fixture_of(session, machine, fixture))


@router.get("/work-zeros/fixtures/{machine}/{fixture}/figure", responses=problems(404) | FIGURE)
def fixture_figure(
    session: SessionDep,
    caller: AnyCaller,
    machine: MachineKey,
    fixture: FixtureKey,
    theme: Theme = "light",
    width: Width = 1240,
    limit: Limit = 200,
) -> Response:
    """The shift of a fixture over its last zeros as a Plotly figure."""
    machine_row = machine_for(session, caller, machine, "viewer")
    row = queries.fixture_of(session, machine, fixture)
    marks = [
        Mark(
            comparison.zero.id,
            comparison.zero.touched_at,
            comparison.shifts,
            comparison.state.value,
            comparison.zero.work_offset,
        )
        for comparison in queries.history(session, machine_row, row.key, limit=limit)
    ]
    figure = figures.shift_figure(marks, row.settings.warning, row.settings.alarm)
    return chart_answer(with_events_of_machine(session, machine_row, figure, width), theme)


@router.get("/work-zeros/{number}", responses=problems(404))
def get_work_zero(session: SessionDep, caller: AnyCaller, number: Number) -> ZeroOut:
    """One work zero with its touches."""
    return zero_out(session, queries.work_zero(session, number, caller.only_machine))


@router.get("/work-zeros/{number}/program", responses=problems(404) | plain(TEXT), response_class=PlainTextResponse)
def write_work_zero(
    session: SessionDep,
    caller: AnyCaller,
    number: Number,
    control: Annotated[
        Control | None, Query(description="For which control; if left out, that of the machine.")
    ] = None,
    restore: Annotated[
        bool, Query(description="The text that sets the offset back to what it was before; Sinumerik and Fanuc.")
    ] = False,
) -> Response:
    """The text that sets the work zero, for the machine's control or for another one. It may run twice: the result is the same.

    It keeps the old offset on the control first (R90 to R96, #600 to #603), and `restore=true` is the text that sets it back.

    With warnings that nobody has acknowledged it begins with a block that stops the control.
    """
    zero = queries.work_zero(session, number, caller.only_machine)
    machine = machine_of(session, zero.machine_id)
    text = program_of(zero, machine, control, stop=stop_of(session, zero, machine), restore=restore)
    if text is None:
        raise no_old_offset() if restore else no_such_offset(zero.work_offset)
    name = f"{machine.key}-zero-{zero.id}" + ("-before" if restore else "")
    return download(text, file_name(control or machine.control, name))


@router.post("/work-zeros/{number}/acknowledge", responses=problems(404, 409))
def acknowledge_work_zero(
    session: SessionDep, caller: Operator, number: Number, body: WarningsAcknowledgeIn
) -> ZeroOut:
    """Take it as it is, although there are warnings: from now on its program text runs. Who, when and why is kept.

    409 where there is no warning, or somebody was first.
    """
    zero = queries.work_zero(session, number)
    actions.acknowledge(session, zero, body, caller)
    return zero_out(session, zero)


@router.post("/work-zeros/{number}/recompute", status_code=201, responses=problems(404, 409))
def recompute_work_zero(session: SessionDep, caller: Operator, number: Number, body: ZeroRecomputeIn) -> ZeroOut:
    """Compute the same touches once more, with another tip or without some of them; the result is another work zero.

    It is in place of this one in the history of its fixture; readings that were made of this one stay as they are.
    """
    zero = queries.work_zero(session, number)
    return zero_out(session, actions.recompute(session, zero, body, caller))
