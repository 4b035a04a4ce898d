"""JSON route: the chart of compared series."""

from typing import Annotated

from fastapi import Query, Response

from app.access.deps import require
from app.loop.timeline.figures import with_lane
from app.views.compare.chart import course_of, events_of
from app.views.compare.figures import compare_figure
from app.views.compare.series import SeriesBy, compared
from app.web.api import FIGURE, Theme, Width, api_router, chart_answer, problems
from app.web.choice import Chosen
from app.web.deps import FROM_REPLICA, SessionDep
from app.web.fields import Moment

router = api_router("statistics", FROM_REPLICA)
Of = Annotated[list[str], Query(max_length=12, description="Characteristics.", examples=["shaft-d40"])]
Tools = Annotated[
    list[Moment] | None,
    Query(
        max_length=24,
        description="By tool: those that were changed in at these moments (the first: 1900-01-01T00:00:00Z); the last four if left out.",
    ),
]
ByQuery = Annotated[
    SeriesBy,
    Query(
        description="What differs: characteristics, or versions, tools, periods of each, or orders, nests … that their context says."
    ),
]


@router.get("/compare/figure", responses=problems(404) | FIGURE, response_model=None, dependencies=[require("viewer")])
def get_comparison(
    session: SessionDep,
    of: Of,
    choice: Chosen,
    by: ByQuery = SeriesBy.CHARACTERISTIC,
    tool: Tools = None,
    overlaid: Annotated[bool, Query(description="All in one panel, in place of one above the other.")] = False,
    of_tolerance: Annotated[bool, Query(description="As a share of half the tolerance, in place of µm.")] = False,
    own_scale: Annotated[bool, Query(description="Each panel reaches as far as its own readings.")] = False,
    theme: Theme = "light",
    width: Width = 1240,
) -> Response:
    """Readings of several characteristics, or of several versions, tools or periods, on one scale."""
    in_time = by is SeriesBy.CHARACTERISTIC
    series = compared(session, of, by, choice, tool or ())
    courses = [course_of(session, each, in_time=in_time) for each in series]
    figure = compare_figure(courses, overlaid=overlaid, of_tolerance=of_tolerance, own_scale=own_scale)
    events = [event for each in series for event in events_of(session, each, figure, in_time=in_time)]
    return chart_answer(with_lane(figure, events, width), theme)
