"""JSON routes: the wear of a characteristic in numbers, and its curve."""

from typing import Annotated

from fastapi import Query, Response

from app.access.deps import AnyCaller
from app.loop.characteristics import queries as characteristics
from app.loop.summaries import queries as statistics
from app.loop.timeline import queries as timeline
from app.quality.wear import queries
from app.quality.wear.chart import chart_of
from app.quality.wear.figures import wear_figure
from app.quality.wear.schemas import WearOut
from app.web.api import FIGURE, CharacteristicKey, Theme, Width, api_router, chart_answer, problems
from app.web.deps import FROM_REPLICA, SessionDep
from app.web.fields import LARGEST_ID

router = api_router("wear", FROM_REPLICA)


@router.get("/characteristics/{characteristic}/wear", responses=problems(404))
def get_wear(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    last: Annotated[
        int | None, Query(ge=1, le=LARGEST_ID, description="Of the tool's readings only those among the last N.")
    ] = None,
) -> WearOut:
    """Wear per part with its interval, parts left as a forecast, and whether the loop hunts.

    Without `last` of the present tool life. Excluded readings, probe faults and parts cut before the tool change are left out.
    """
    current = characteristics.characteristic_for(session, caller, characteristic, "viewer")
    window = queries.life_of(session, current)
    if last is not None:
        window = statistics.window_of(session, current.characteristic, last=last, first=window.first)
    return WearOut.of(queries.wear_of(session, current, window))


@router.get("/characteristics/{characteristic}/figures/wear", responses=problems(404) | FIGURE, response_model=None)
def get_wear_figure(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    last: Annotated[
        str | None,
        Query(
            pattern=r"^([1-9][0-9]{0,17}|all|tool)$",
            description="The last N readings, `all`, or `tool`: since the tool was changed.",
        ),
    ] = None,
    theme: Theme = "light",
    width: Width = 1240,
) -> Response:
    """The wear curve with its line, what the corrections took out of it, and the forecast to the limits that are near."""
    current = characteristics.characteristic_for(session, caller, characteristic, "viewer")
    wear = queries.wear_of(session, current, queries.shown(session, current, last))
    figure = wear_figure(chart_of(wear), width=width)
    return chart_answer(timeline.with_events(session, current, figure, width, lines=False), theme)
