"""JSON route: what needs attention first."""

from typing import Annotated

from fastapi import Query

from app.access.deps import require
from app.views.overview import queries
from app.views.overview.queries import By
from app.views.overview.schemas import Overview
from app.web.api import api_router, problems
from app.web.deps import FROM_REPLICA, SessionDep

router = api_router("overview", FROM_REPLICA)


@router.get("/overview", responses=problems(404), dependencies=[require("viewer")])
def get_overview(
    session: SessionDep,
    machine: Annotated[str | None, Query(description="Only of this machine.", examples=["lathe-1"])] = None,
    by: Annotated[By, Query(description="What they are ranked by.")] = By.ATTENTION,
    reverse: Annotated[
        bool, Query(description="The worst last. What has no value, such as no index, stands at the end either way.")
    ] = False,
    after: Annotated[int, Query(ge=0, le=1_000_000, description="`next` of the page before.")] = 0,
    limit: Annotated[int, Query(ge=1, le=1000, description="How many at most.")] = 100,
) -> Overview:
    """Every characteristic, what needs somebody first at the head, with the reasons.

    The order is of this moment: a characteristic may change its place between two pages.
    """
    return Overview.of(queries.ranking(session, machine=machine, by=by, reverse=reverse), after, limit)
