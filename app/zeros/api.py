"""JSON routes: work zeros and the fixtures they are found in."""

from typing import Annotated, Any

from fastapi import Path, Query, Request, Response
from fastapi.responses import PlainTextResponse

from app.db.engine import Database
from app.machines.queries import machine_named, machine_of
from app.machines.wording import file_name, no_such_offset
from app.readings import actions as readings
from app.web.api import api_router, plain, problems
from app.web.deps import AnyCaller, Engineer, Operator, SessionDep
from app.web.downloads import download
from app.web.fields import Control, Cursor, Limit, Page, Slug, page_of
from app.web.theme import theme_from
from app.zeros import actions, figures, queries
from app.zeros.answers import TEXT, FixtureOut, ZeroOut, fixture_out, program_of, zero_out, zeros_out
from app.zeros.figures import Mark
from app.zeros.schemas import FixtureIn, RecomputeIn, ZeroIn

router = api_router("work zeros")
MachineKey = Annotated[str, Path(description="The key of the machine.", examples=["mill-1"])]
FixtureKey = Annotated[str, Path(description="The fixture, as work zeros name it.", examples=["vice-left"])]
Number = Annotated[int, Path(description="Number of the work zero.", examples=[12])]
MachineFilter = Annotated[Slug | None, Query(description="Only of this machine.", examples=["mill-1"])]
FixtureFilter = Annotated[Slug | None, Query(description="Only of this fixture.", examples=["vice-left"])]
Theme = Annotated[str | None, Query(description="`light` or `dark`", max_length=20)]
FIGURE: dict[int | str, dict[str, Any]] = {
    200: {"content": {"application/json": {"example": {"data": [], "layout": {}}}}}
}
AGAIN: dict[int | str, dict[str, Any]] = {
    200: {"model": ZeroOut, "description": "It was sent before with the same key; nothing happened now."}
}


@router.post("/work-zeros", status_code=201, responses=problems(404, 409) | AGAIN)
def find_work_zero(
    request: Request, session: SessionDep, caller: AnyCaller, given: ZeroIn, response: Response
) -> ZeroOut:
    """Find work zero and size from the touches of an edge finder or probe.

    The answer holds the text that sets it on the machine's control, and how far the fixture has shifted. Touches that make
    no zero are refused with the reason, by their numbers. `characteristics` names what its results become readings of.
    """
    caller.must_somewhere("operator")
    database: Database = request.app.state.database
    with database.begin() as own:
        machine = machine_named(own, given.machine)
        caller.must_at(machine.id, "operator")
        made = actions.find(own, machine, given, caller)
    readings.push_results(database)
    response.status_code = 200 if made.again else 201
    return zero_out(session, queries.work_zero(session, made.zero.id))


@router.get("/work-zeros", responses=problems(404))
def list_work_zeros(
    session: SessionDep,
    caller: AnyCaller,
    machine: MachineFilter = None,
    fixture: FixtureFilter = None,
    after: Annotated[Cursor, Query(description="Cursor: the `next` of the page before.")] = 0,
    limit: Annotated[Limit, Query()] = 100,
) -> Page[ZeroOut]:
    """Work zeros in the order in which they came."""
    only = caller.only_machine
    if machine is not None:
        found = machine_named(session, machine)
        caller.must_at(found.id, "viewer")
        only = found.id
    rows = queries.work_zeros(session, only, fixture, after=after, limit=limit + 1)
    return page_of(zeros_out(session, rows), limit, lambda row: row.id)


@router.get("/work-zeros/fixtures")
def list_fixtures(session: SessionDep, caller: AnyCaller) -> Page[FixtureOut]:
    """Every fixture with its last zero and how far it has shifted."""
    return Page(items=[fixture_out(row) for row in queries.fixtures(session, caller.only_machine)])


@router.get("/work-zeros/fixtures/{machine}/{fixture}", responses=problems(404))
def get_fixture(session: SessionDep, caller: AnyCaller, machine: MachineKey, fixture: FixtureKey) -> FixtureOut:
    """One fixture; its zeros: `GET /work-zeros?machine=…&fixture=…`."""
    caller.must_at(machine_named(session, machine).id, "viewer")
    return fixture_out(queries.fixture_of(session, machine, fixture))


@router.put("/work-zeros/fixtures/{machine}/{fixture}", responses=problems(404))
def watch_fixture(
    session: SessionDep, caller: Engineer, machine: MachineKey, fixture: FixtureKey, given: FixtureIn
) -> FixtureOut:
    """What its zeros are compared with, from which shift on it warns, and from which the alarm *fixture shifted* is raised."""
    row = queries.fixture_of(session, machine, fixture)
    actions.set_fixture(session, row, given, caller)
    return fixture_out(queries.fixture_of(session, machine, fixture))


@router.get("/work-zeros/fixtures/{machine}/{fixture}/figure", responses=problems(404) | FIGURE)
def fixture_figure(
    session: SessionDep,
    caller: AnyCaller,
    machine: MachineKey,
    fixture: FixtureKey,
    theme: Theme = None,
    limit: Annotated[Limit, Query()] = 200,
) -> dict[str, Any]:
    """The shift of a fixture over its last zeros as a Plotly figure."""
    found = machine_named(session, machine)
    caller.must_at(found.id, "viewer")
    row = queries.fixture_of(session, machine, fixture)
    marks = [
        Mark(each.zero.id, each.zero.touched_at, each.shifts, each.state.value, each.zero.work_offset)
        for each in queries.history(session, found, row.key, limit=limit)
    ]
    return figures.shift_figure(marks, row.settings.warning, row.settings.alarm, theme=theme_from(theme))


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
) -> Response:
    """The text that sets the work zero, for the machine's control or for another one. Running it twice changes nothing."""
    zero = queries.work_zero(session, number, caller.only_machine)
    machine = machine_of(session, zero.machine_id)
    text = program_of(zero, machine, control)
    if text is None:
        raise no_such_offset(zero.work_offset)
    return download(text, file_name(control or machine.control, f"{machine.key}-zero-{zero.id}"))


@router.post("/work-zeros/{number}/recompute", status_code=201, responses=problems(404, 409))
def recompute_work_zero(session: SessionDep, caller: Operator, number: Number, given: RecomputeIn) -> ZeroOut:
    """Compute the same touches once more, with another tip or without some of them; the result is another work zero.

    It stands in place of this one in the history of its fixture; readings that were made of this one stay as they are.
    """
    zero = queries.work_zero(session, number)
    return zero_out(session, actions.recompute(session, zero, given, caller))
