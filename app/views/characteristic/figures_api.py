"""JSON routes: the figures of a characteristic."""

from typing import Annotated, Literal

from fastapi import Query, Response

from app.access.deps import AnyCaller
from app.core.context import ContextField
from app.core.variants import yielded_by
from app.loop.characteristics import queries
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.characteristics.wording import result_label
from app.loop.summaries import queries as statistics
from app.loop.summaries.queries import Window
from app.loop.timeline import queries as timeline
from app.views.characteristic.chart import at_20_of, chart_of, distinguished, only, results_of, run_of
from app.views.characteristic.figures import counting_edges, histogram_figure, result_figure, run_figure, zone_chart
from app.web.api import FIGURE, CharacteristicKey, Theme, Width, api_router, chart_answer, problems
from app.web.choice import Choice, Chosen
from app.web.deps import FROM_REPLICA, SessionDep
from app.web.fields import LARGEST_ID

router = api_router("characteristics", FROM_REPLICA)

ResultName = Literal["run_out", "out_of_roundness", "taper", "straightness", "repeat_range", "repeat_deviation"]


By = Annotated[
    ContextField | None,
    Query(description="Split single readings by this field of their context: colour, shape and legend."),
]


def _found(
    session: SessionDep, caller: AnyCaller, characteristic: str, choice: Choice
) -> tuple[CurrentCharacteristic, Window]:
    current = queries.characteristic_for(session, caller, characteristic, "viewer")
    return current, statistics.window_of(session, current.characteristic, **choice._asdict())


@router.get("/characteristics/{characteristic}/figures/zones", responses=problems(404) | FIGURE, response_model=None)
def get_zone_chart(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    choice: Chosen,
    scale: Annotated[
        Literal["zones", "true"], Query(description="Each band equally tall, or linear in µm around the tolerance.")
    ] = "zones",
    ringed: Annotated[int | None, Query(ge=1, le=LARGEST_ID, description="The reading with a ring about it.")] = None,
    at_20: Annotated[
        bool, Query(description="With the sizes at 20 °C of single readings that have one, as a second series.")
    ] = False,
    by: By = None,
    theme: Theme = "light",
    width: Width = 1240,
) -> Response:
    """The zone chart: readings in their zones, running average, corrections, tool changes, alarms and other events.

    Of more readings than can be drawn, blocks with their extremes: no extreme is ever thinned away.
    """
    current, window = _found(session, caller, characteristic, choice)
    chart = chart_of(session, current, window)
    figure = zone_chart(
        chart.points,
        current.parameters,
        blocks=chart.blocks,
        steps=chart.steps,
        events=chart.events,
        hands=chart.hands,
        scale=scale,
        sizes=chart.sizes,
        total_before=chart.total_before,
        width=width,
        ringed=ringed or ("newest" if window.reaches_now else None),
        left_out=chart.left_out,
        at_20=at_20_of(session, current, chart.points) if at_20 else None,
    )
    if by is not None:
        figure = distinguished(session, current, figure, "readings", [point.sequence for point in chart.points], by)
    return chart_answer(only(figure, window.context), theme)


@router.get("/characteristics/{characteristic}/figures/run", responses=problems(404) | FIGURE, response_model=None)
def get_run_chart(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    choice: Chosen,
    by: By = None,
    theme: Theme = "light",
    width: Width = 1240,
) -> Response:
    """Sizes over time, corrected by the empirical value of each reading.

    Of more readings than can be drawn, blocks with their extremes: no extreme is ever thinned away.
    """
    current, window = _found(session, caller, characteristic, choice)
    run = run_of(session, current, window)
    figure = run_figure(run.points, current.parameters, sizes=run.sizes, blocks=run.blocks)
    if by is not None:
        figure = distinguished(session, current, figure, "run", [point.sequence for point in run.points], by)
    over = window.first, window.last
    return chart_answer(timeline.with_events(session, current, only(figure, window.context), width, over=over), theme)


@router.get("/characteristics/{characteristic}/figures/results", responses=problems(404) | FIGURE, response_model=None)
def get_result_chart(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    choice: Chosen,
    result: Annotated[
        ResultName | None, Query(description="Which one; what the variant of the characteristic yields if left out.")
    ] = None,
    theme: Theme = "light",
    width: Width = 1240,
) -> Response:
    """Results of the measuring variant beside the value: run-out, out-of-roundness, taper, repeatability.

    Of more readings than can be drawn, blocks with their extremes; of more than 500 000 the last ones.
    """
    current, window = _found(session, caller, characteristic, choice)
    name: str = result or next(iter(yielded_by(current.parameters)), "repeat_range")
    points, ranges = results_of(session, current, window, name)
    figure = result_figure(name, result_label(name), points, ranges)
    return chart_answer(timeline.with_events(session, current, figure, width), theme)


@router.get(
    "/characteristics/{characteristic}/figures/histogram", responses=problems(404) | FIGURE, response_model=None
)
def get_histogram(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    choice: Chosen,
    theme: Theme = "light",
) -> Response:
    """Histogram of the deviations, without excluded readings and probe faults; of more than 100 000 the last 100 000."""
    current, window = _found(session, caller, characteristic, choice)
    parameters = current.parameters
    counts = statistics.histogram_of(session, current.characteristic, window, counting_edges(parameters))
    of = window.count if window.count > statistics.MOST_IN_HISTOGRAM else 0
    return chart_answer(histogram_figure(counts, parameters, of=of), theme)
