"""JSON routes: the capability of a characteristic, and its figures."""

from typing import Annotated, Literal

from fastapi import Query, Response

from app.access.deps import AnyCaller
from app.core.context import ContextField
from app.core.spc.machine_performance import RUN
from app.loop.characteristics import queries as characteristics
from app.quality.capability.chart import drawn
from app.quality.capability.figures import histogram, index_over_weeks, probability
from app.quality.capability.machine_queries import newest_run
from app.quality.capability.request import StudyRequestDep, study_of
from app.quality.capability.schemas import (
    CapabilityOut,
    MachinePerformanceOut,
    capability_out,
    machine_performance_out,
)
from app.quality.capability.strata_queries import strata_of
from app.quality.capability.strata_schemas import StrataOut, strata_out
from app.quality.capability.verdict_queries import states
from app.quality.capability.weekly import tool_changes, weeks_of
from app.web.api import FIGURE, CharacteristicKey, Theme, api_router, chart_answer, problems
from app.web.deps import FROM_REPLICA, SessionDep

router = api_router("statistics", FROM_REPLICA)


@router.get("/characteristics/{characteristic}/capability", responses=problems(404))
def get_capability(
    session: SessionDep, caller: AnyCaller, characteristic: CharacteristicKey, choice: StudyRequestDep
) -> CapabilityOut:
    """Cp, Cpk, Pp, Ppk, Cpm with intervals, percentiles, expected and observed ppm, normality, stability, model in time.

    Of a compensated characteristic also what the tool did without its corrections, and what ideal ones could reach.
    """
    current = characteristics.characteristic_for(session, caller, characteristic, "viewer")
    return capability_out(study_of(session, current, choice))


@router.get("/characteristics/{characteristic}/strata", responses=problems(404))
def get_strata(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    choice: StudyRequestDep,
    by: Annotated[
        ContextField, Query(description="The field of the context that they are split by.", examples=["nest"])
    ],
) -> StrataOut:
    """The readings of a capability study apart by order, nest, operator …: mean, s and Ppk of each, and whether they differ.

    The test compares neighbours, so that drift between two orders is not taken for a difference of the orders.
    """
    current = characteristics.characteristic_for(session, caller, characteristic, "viewer")
    study = study_of(session, current, choice)
    return strata_out(study, strata_of(session, study, by))


@router.get("/characteristics/{characteristic}/machine-performance", responses=problems(404))
def get_machine_performance(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    choice: StudyRequestDep,
    readings: Annotated[int, Query(ge=RUN, le=1000, description="Parts of the run.")] = RUN,
) -> MachinePerformanceOut:
    """Pm and Pmk of the newest run of parts without a correction, a tool change or a setting in between (ISO 22514-3).

    The run is looked for among the last 5000 readings, of those that are chosen; `side` and `confidence` are those of capability.
    """
    current = characteristics.characteristic_for(session, caller, characteristic, "viewer")
    study = study_of(session, current, choice)
    chosen = choice.last or choice.period.bounded or choice.context
    return machine_performance_out(newest_run(session, study, readings, study.window if chosen else None))


@router.get(
    "/characteristics/{characteristic}/figures/capability", responses=problems(404) | FIGURE, response_model=None
)
def get_capability_figure(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    choice: StudyRequestDep,
    picture: Annotated[
        Literal["histogram", "probability"], Query(description="Histogram with fitted curve, or probability plot.")
    ] = "histogram",
    theme: Theme = "light",
) -> Response:
    """The histogram with its fitted curve and the limits, or the normal probability plot."""
    current = characteristics.characteristic_for(session, caller, characteristic, "viewer")
    chart = drawn(study_of(session, current, choice))
    return chart_answer((histogram if picture == "histogram" else probability)(chart), theme)


@router.get("/characteristics/{characteristic}/figures/weeks", responses=problems(404) | FIGURE, response_model=None)
def get_weeks_figure(
    session: SessionDep, caller: AnyCaller, characteristic: CharacteristicKey, theme: Theme = "light"
) -> Response:
    """The index of each of the last 13 weeks with its interval, and when tools were changed; computed every few minutes."""
    current = characteristics.characteristic_for(session, caller, characteristic, "viewer")
    ((_state, stored),) = states(session, current.machine.id, current.characteristic.id)
    weeks = weeks_of(stored.newest.weeks if stored.newest else None)
    return chart_answer(index_over_weeks(weeks, tool_changes(session, current, weeks)), theme)
