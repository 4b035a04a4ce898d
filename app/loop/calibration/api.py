"""JSON routes: calibrations, paired readings, suggestions, plans."""

from typing import Annotated

from fastapi import Path, Query, Response

from app.access.deps import AnyCaller, Caller, Engineer, Operator, OperatorOrMachine, require
from app.core.parameters import MOST_LOCATIONS
from app.loop.calibration import actions, figures, pairs, places, queries
from app.loop.calibration.answers import (
    CalibrationOut,
    CalibrationPlanOut,
    PairOut,
    PlaceOut,
    SuggestionOut,
    calibration_out,
    mark_of,
    pair_out,
    place_out,
    plan_out,
    suggestion_out,
)
from app.loop.calibration.queries import Place
from app.loop.calibration.schemas import CalibrationPlanIn, GaugeIn, PairIn, RingIn, SuggestionAcceptIn
from app.loop.machines.queries import hold_machine, machine_for, machine_named
from app.loop.timeline.figures import CALIBRATION
from app.loop.timeline.queries import with_events_of_machine
from app.web.api import (
    FIGURE,
    After,
    Limit,
    MachineKey,
    SerialAfter,
    Theme,
    Width,
    api_router,
    chart_answer,
    problems,
    sent_again,
)
from app.web.deps import SessionDep
from app.web.etags import TAGGED, guarded, tagged
from app.web.fields import Page, ReasonIn, page_of

router = api_router("calibration")
R10 = Annotated[int, Path(description="Tool memory location R10 of the probe.", examples=[32])]
R11 = Annotated[int, Path(description="Average memory location R11.", examples=[5])]
Number = Annotated[int, Path(description="Number of the calibration; counts per machine.", examples=[17])]
PairId = Annotated[int, Path(description="Number of the pair.", examples=[31])]


# --- calibrations


@router.get("/calibration", dependencies=[require("viewer")])
def list_calibration_places(session: SessionDep) -> Page[PlaceOut]:
    """Every place that is calibrated, with what was found last and when the next calibration is due."""
    return Page(items=[place_out(row) for row in places.places(session)])


@router.post(
    "/machines/{machine}/calibrations", status_code=201, responses=problems(404, 409) | sent_again(CalibrationOut)
)
def calibrate_gauge(
    session: SessionDep, caller: OperatorOrMachine, machine: MachineKey, given: GaugeIn, response: Response
) -> CalibrationOut:
    """Calibrate against a gauge of known size, as L92 does; R11 is the location whose empirical value is found.

    From R36 on, and with a touch outside ±a or missing (null), it is refused: that is kept and answered as
    `"status": "refused"`, raises the alarm *calibration refused*, and changes nothing. Its result is applied after approval, or at once where the plan says so.
    """
    machine_row = machine_for(session, caller, machine, "operator")
    stored = actions.calibrate_gauge(session, machine_row, given, caller)
    response.status_code = 200 if stored.again else 201
    return calibration_out(stored.row, machine_row.key)


@router.post(
    "/machines/{machine}/calibrations/ring", status_code=201, responses=problems(404, 409) | sent_again(CalibrationOut)
)
def calibrate_ring(
    session: SessionDep, caller: OperatorOrMachine, machine: MachineKey, given: RingIn, response: Response
) -> CalibrationOut:
    """Calibrate the X offset of a probe in a ring on the spindle: three sections along Z, each touched in +X and −X.

    Refused, kept, and without effect: a section outside the ring's limits or not touched on both sides, or a first move
    along Z that triggered.
    """
    machine_row = machine_for(session, caller, machine, "operator")
    stored = actions.calibrate_ring(session, machine_row, given, caller)
    response.status_code = 200 if stored.again else 201
    return calibration_out(stored.row, machine_row.key)


@router.get("/machines/{machine}/calibrations", responses=problems(404))
def list_calibrations(
    session: SessionDep,
    caller: AnyCaller,
    machine: MachineKey,
    average_memory: Annotated[
        int | None, Query(description="Only of this location R11.", ge=1, le=MOST_LOCATIONS)
    ] = None,
    tool_memory: Annotated[
        int | None, Query(description="Only of the probe in this location R10.", ge=1, le=MOST_LOCATIONS)
    ] = None,
    after: SerialAfter = 0,
    limit: Limit = 100,
) -> Page[CalibrationOut]:
    """Calibrations, oldest first, refused ones too."""
    machine_row = machine_for(session, caller, machine, "viewer")
    place = None
    if average_memory is not None or tool_memory is not None:
        place = Place("average", average_memory) if average_memory is not None else Place("tool", tool_memory or 0)
    rows = queries.calibrations(session, machine_row, place, after=after, limit=limit + 1)
    return page_of([calibration_out(row, machine_row.key) for row in rows], limit, lambda made: made.number)


@router.get("/machines/{machine}/calibrations/{number}", responses=problems(404))
def get_calibration(session: SessionDep, caller: AnyCaller, machine: MachineKey, number: Number) -> CalibrationOut:
    """One calibration."""
    machine_row = machine_for(session, caller, machine, "viewer")
    return calibration_out(queries.calibration(session, machine_row, number), machine_row.key)


@router.post("/machines/{machine}/calibrations/{number}/accept", responses=problems(404, 409))
def accept_calibration(
    session: SessionDep, caller: Operator, machine: MachineKey, number: Number, given: ReasonIn
) -> CalibrationOut:
    """Put into effect what it proposes: the empirical value is set and M begins again at 0, or the probe's offset is set.

    409 when it was accepted already, has nothing to propose, or was overtaken; says who was first.
    """
    machine_row = machine_named(session, machine)
    return calibration_out(actions.accept(session, machine_row, number, given.reason, caller), machine_row.key)


# --- pairs


@router.post("/machines/{machine}/averages/{location}/pairs", status_code=201, responses=problems(404, 409))
def add_pair(
    session: SessionDep, caller: OperatorOrMachine, machine: MachineKey, location: R11, given: PairIn
) -> PairOut:
    """Keep a reading of the machine beside what an external gauge (micrometer, CMM) says of the same part."""
    machine_row = machine_for(session, caller, machine, "operator")
    (row,) = pairs.add_pairs(session, machine_row, location, [given], caller)
    return pair_out(queries.pairs(session, machine_row, location, only=row.id)[0])


@router.get("/machines/{machine}/averages/{location}/pairs", responses=problems(404))
def list_pairs(
    session: SessionDep,
    caller: AnyCaller,
    machine: MachineKey,
    location: R11,
    after: After = 0,
    limit: Limit = 100,
) -> Page[PairOut]:
    """Paired readings of a location, oldest first."""
    machine_row = machine_for(session, caller, machine, "viewer")
    queries.value_of(session, machine_row, Place("average", location))
    rows = queries.pairs(session, machine_row, location, after=after, limit=limit + 1)
    return page_of([pair_out(pair) for pair in rows], limit, lambda pair: pair.id)


@router.post("/machines/{machine}/averages/{location}/pairs/{pair}/exclude", responses=problems(404, 409))
def exclude_pair(
    session: SessionDep, caller: Operator, machine: MachineKey, location: R11, pair: PairId, given: ReasonIn
) -> PairOut:
    """A pair that does not count: misread, or another part. It stays on record."""
    machine_row = machine_named(session, machine)
    pairs.exclude_pair(session, machine_row, location, pair, given.reason, caller)
    return pair_out(queries.pairs(session, machine_row, location, only=pair)[0])


@router.get("/machines/{machine}/averages/{location}/suggestion", responses=problems(404))
def get_suggestion(
    session: SessionDep,
    caller: AnyCaller,
    machine: MachineKey,
    location: R11,
    confidence: Annotated[float, Query(gt=0.5, lt=1, description="Of the interval.")] = queries.CONFIDENCE,
) -> SuggestionOut:
    """The empirical value that the pairs suggest: their mean difference with its confidence interval."""
    machine_row = machine_for(session, caller, machine, "viewer")
    return suggestion_out(queries.suggestion(session, machine_row, location, confidence), machine_row.key, location)


@router.post("/machines/{machine}/averages/{location}/suggestion/accept", status_code=201, responses=problems(404, 409))
def accept_suggestion(
    session: SessionDep, caller: Operator, machine: MachineKey, location: R11, given: SuggestionAcceptIn
) -> CalibrationOut:
    """The suggested empirical value comes into effect; that is a calibration of the kind `pairs`.

    409 while pairs are missing, when they agree with the value in effect, and when the suggestion is another one by now.
    """
    machine_row = machine_named(session, machine)
    row = pairs.accept_suggestion(session, machine_row, location, given.reason, caller, seen=given.empirical_value)
    return calibration_out(row, machine_row.key)


# --- plans and charts


@router.get("/machines/{machine}/averages/{location}/calibration-plan", responses=problems(404) | TAGGED)
@tagged
def get_calibration_plan(
    session: SessionDep, caller: AnyCaller, machine: MachineKey, location: R11
) -> CalibrationPlanOut:
    """The interval of calibration of the probe for this location, and if the results are applied automatically."""
    machine_row = machine_for(session, caller, machine, "viewer")
    return plan_out(queries.plan(session, machine_row, Place("average", location)))


@router.put("/machines/{machine}/averages/{location}/calibration-plan", responses=problems(404, 412))
@guarded(get_calibration_plan, hold_machine)
def plan_calibration(
    session: SessionDep, caller: Engineer, machine: MachineKey, location: R11, given: CalibrationPlanIn
) -> PlaceOut:
    """Plan how often to calibrate the probe for this location, and if the results are applied automatically.

    When it is overdue, the alarm *calibration overdue* is raised once; the next calibration ends it.
    """
    return _planned(session, caller, machine, Place("average", location), given)


@router.get("/machines/{machine}/tools/{tool}/calibration-plan", responses=problems(404) | TAGGED)
@tagged
def get_ring_calibration_plan(
    session: SessionDep, caller: AnyCaller, machine: MachineKey, tool: R10
) -> CalibrationPlanOut:
    """The same for the offset of a probe, which is calibrated in a ring."""
    machine_row = machine_for(session, caller, machine, "viewer")
    return plan_out(queries.plan(session, machine_row, Place("tool", tool)))


@router.put("/machines/{machine}/tools/{tool}/calibration-plan", responses=problems(404, 412))
@guarded(get_ring_calibration_plan, hold_machine)
def plan_ring_calibration(
    session: SessionDep, caller: Engineer, machine: MachineKey, tool: R10, given: CalibrationPlanIn
) -> PlaceOut:
    """The same for the offset of a probe, which is calibrated in a ring."""
    return _planned(session, caller, machine, Place("tool", tool), given)


def _planned(session: SessionDep, caller: Caller, machine: str, place: Place, given: CalibrationPlanIn) -> PlaceOut:
    machine_row = machine_named(session, machine)
    actions.set_plan(session, machine_row, place, given, caller)
    return place_out(places.place_row(session, machine_row, place, queries.value_of(session, machine_row, place)))


@router.get("/machines/{machine}/averages/{location}/calibration-figure", responses=problems(404) | FIGURE)
def calibration_figure(
    session: SessionDep,
    caller: AnyCaller,
    machine: MachineKey,
    location: R11,
    theme: Theme = "light",
    width: Width = 1240,
    limit: Limit = 200,
) -> Response:
    """The history of a location as a Plotly figure: differences, empirical value, limits R33 and R34."""
    machine_row = machine_for(session, caller, machine, "viewer")
    place = Place("average", location)
    value = queries.value_of(session, machine_row, place)
    rows = queries.calibrations(session, machine_row, place, newest_first=True, limit=limit)
    changes = queries.value_changes(session, machine_row, location, limit)
    marks = [mark_of(row) for row in reversed(rows)]
    chart = figures.gauge_figure(marks, sorted((change.since, change.value) for change in changes), value)
    return chart_answer(
        with_events_of_machine(session, machine_row, chart, width, place=place, without=(CALIBRATION,)), theme
    )


@router.get("/machines/{machine}/tools/{tool}/calibration-figure", responses=problems(404) | FIGURE)
def ring_figure(
    session: SessionDep,
    caller: AnyCaller,
    machine: MachineKey,
    tool: R10,
    theme: Theme = "light",
    width: Width = 1240,
    limit: Limit = 200,
) -> Response:
    """The history of a probe in the ring as a Plotly figure: how far it stood beside the spindle, and the diameters."""
    machine_row = machine_for(session, caller, machine, "viewer")
    place = Place("tool", tool)
    queries.value_of(session, machine_row, place)
    rows = queries.calibrations(session, machine_row, place, newest_first=True, limit=limit)
    chart = figures.ring_figure([mark_of(row) for row in reversed(rows)])
    return chart_answer(
        with_events_of_machine(session, machine_row, chart, width, place=place, without=(CALIBRATION,)), theme
    )
