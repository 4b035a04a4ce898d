"""JSON routes: control charts in numbers, and their figures."""

from typing import Annotated

from fastapi import Query, Response

from app.access.deps import AnyCaller
from app.charts import Chart as Figure
from app.charts import ThemeName
from app.core.context import ContextField
from app.core.spc.quantity import Quantity
from app.core.spc.shewhart import Chart
from app.language.i18n import _
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries import queries as statistics
from app.loop.timeline import queries as timeline
from app.quality.baselines import queries
from app.quality.baselines.queries import Baseline
from app.quality.baselines.schemas import LARGEST_LIMIT, ChartName, Grouping
from app.quality.chart_signals import queries as signals_queries
from app.quality.control_charts import charts
from app.quality.control_charts.answers import control_out
from app.quality.control_charts.editor import PICKED, EditorChoice, picture_of
from app.quality.control_charts.figures import control_figure
from app.quality.control_charts.schemas import ControlOut
from app.quality.control_charts.strata import distinguished_by
from app.quality.control_charts.view import Marks
from app.web.api import FIGURE, CharacteristicKey, Theme, Width, api_router, chart_answer, problems
from app.web.choice import Chosen
from app.web.deps import FROM_REPLICA, SessionDep
from app.web.fields import LARGEST_ID, LARGEST_SERIAL

router = api_router("control charts", FROM_REPLICA)

Judge = Annotated[
    int | None,
    Query(ge=1, le=LARGEST_SERIAL, alias="baseline", description="Judge by this version, not by the one in force."),
]
Kind = Annotated[
    Chart | None, Query(description="Which chart; individuals or X-bar, whichever the baseline is for, if left out.")
]
GivenLimit = Annotated[
    float | None,
    Query(
        ge=-LARGEST_LIMIT, le=LARGEST_LIMIT, description="Limits given by the customer, mm: see `limits` of a baseline."
    ),
]


def _judge(session: SessionDep, current: CurrentCharacteristic, version: int | None) -> Baseline | None:
    if version is not None:
        return queries.baseline_of(session, current.characteristic, version)
    return queries.baseline_in_force(session, current.characteristic)


@router.get("/characteristics/{characteristic}/control", responses=problems(404))
def get_control(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    choice: Chosen,
    chart: Kind = None,
    version: Judge = None,
) -> ControlOut:
    """A control chart in numbers: points, centre, limits, and signals as runs of points.

    All by the frozen baseline, never by the readings shown. Without a baseline in force: deviations and no limits.
    """
    current = characteristics.characteristic_for(session, caller, characteristic, "viewer")
    window = statistics.window_of(session, current.characteristic, **choice._asdict())
    baseline = _judge(session, current, version)
    if baseline is None:
        return control_out(charts.unjudged(session, current, window), characteristic, None)
    return control_out(charts.view(session, current, baseline, window, chart), characteristic, baseline)


@router.get("/characteristics/{characteristic}/figures/control", responses=problems(404) | FIGURE, response_model=None)
def get_control_chart(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    choice: Chosen,
    chart: Kind = None,
    version: Judge = None,
    signal: Annotated[
        int | None, Query(ge=1, le=LARGEST_ID, description="Mark the run of this signal, not the baseline's period.")
    ] = None,
    by: Annotated[
        ContextField | None,
        Query(description="Split points by this field of their readings' context: colour, shape and legend."),
    ] = None,
    theme: Theme = "light",
    width: Width = 1240,
) -> Response:
    """A control chart as a figure. Of more points than can be drawn the extremes and the signals of each stretch."""
    current = characteristics.characteristic_for(session, caller, characteristic, "viewer")
    window = statistics.window_of(session, current.characteristic, **choice._asdict())
    baseline = _judge(session, current, version)
    if baseline is None:
        view = charts.unjudged(session, current, window)
        figure = distinguished_by(session, current, view, control_figure(view, key=characteristic, width=width), by)
        return _with_events(session, current, figure, width, theme)
    view = charts.view(session, current, baseline, window, chart)
    marked = charts.marked_by(baseline) if signal is None else _run_of(session, current, signal)
    figure = control_figure(view, key=characteristic, marked=marked, width=width)
    figure = distinguished_by(session, current, view, figure, by)
    return _with_events(session, current, figure, width, theme)


def _with_events(
    session: SessionDep, current: CurrentCharacteristic, figure: Figure, width: int, theme: ThemeName
) -> Response:
    """The figure with the events of the characteristic, whose tool changes it marks itself."""
    return chart_answer(timeline.with_events(session, current, figure, width, lines=False), theme)


def _run_of(session: SessionDep, current: CurrentCharacteristic, number: int) -> Marks:
    row = signals_queries.signal(session, number)
    if row.characteristic.key != current.characteristic.key:
        raise signals_queries.unknown(number)
    return Marks(row.signal.first_sequence, row.signal.last_sequence, _("Signal {n}").format(n=number))


@router.get("/characteristics/{characteristic}/figures/baseline", responses=problems(404) | FIGURE, response_model=None)
def get_baseline_editor(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    choice: Chosen,
    quantity: Annotated[Quantity, Query(description="What is charted.")] = Quantity.DEVIATION,
    chart: Annotated[ChartName, Query(description="Single values or subgroups.")] = "individuals",
    grouping: Annotated[Grouping | None, Query(description="How readings become subgroups.")] = None,
    group_size: Annotated[int | None, Query(ge=2, le=1000, description="Readings in a subgroup.")] = None,
    group_pause: Annotated[float | None, Query(gt=0, le=100_000, description="Minutes that end a subgroup.")] = None,
    pooled: Annotated[bool, Query(description="Sigma from the pooled variance inside subgroups.")] = False,
    settle: Annotated[int | None, Query(ge=20, le=10_000, description="Readings in which an edge runs in.")] = None,
    first_sequence: Annotated[int | None, Query(ge=1, le=LARGEST_ID, description="First of the period.")] = None,
    last_sequence: Annotated[int | None, Query(ge=1, le=LARGEST_ID, description="Last of the period.")] = None,
    excluded: Annotated[
        str, Query(pattern=PICKED, max_length=4000, description="Runs of readings that are left out: 640-641,702-702.")
    ] = "",
    centre: GivenLimit = None,
    sigma: GivenLimit = None,
    lower: GivenLimit = None,
    upper: GivenLimit = None,
    theme: Theme = "light",
    width: Width = 1240,
) -> Response:
    """The chart on which a period is chosen: the readings, the period, and the limits that it would give."""
    current = characteristics.characteristic_for(session, caller, characteristic, "viewer")
    window = statistics.window_of(session, current.characteristic, **choice._asdict())
    given = {"centre": centre, "sigma": sigma, "lower": lower, "upper": upper}
    picked = EditorChoice(
        quantity=quantity,
        chart=chart,
        grouping=grouping,
        group_size=group_size,
        group_pause=group_pause,
        pooled=pooled,
        settle=settle,
        first=first_sequence,
        last=last_sequence,
        excluded=excluded,
        limits={name: value for name, value in given.items() if value is not None},
    )
    view, marked = picture_of(session, current, picked, window)
    return chart_answer(control_figure(view, key=characteristic, marked=marked, width=width, picks=True), theme)
