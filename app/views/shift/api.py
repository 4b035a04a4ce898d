"""JSON route: a shift of the plant."""

from datetime import UTC, datetime
from typing import Annotated

from fastapi import Query

from app.access.deps import require
from app.views.shift import queries
from app.views.shift.schemas import ShiftReportOut
from app.web.api import MachineFilter, api_router, problems
from app.web.deps import FROM_REPLICA, SessionDep
from app.web.fields import Moment

router = api_router("overview", FROM_REPLICA)


@router.get("/shift", responses=problems(404), dependencies=[require("viewer")])
def get_shift(
    session: SessionDep,
    machine: MachineFilter = None,
    at: Annotated[
        Moment | None, Query(description="A moment in the shift; now if left out: the running one.", examples=[None])
    ] = None,
) -> ShiftReportOut:
    """A shift of the plant (INBAND_SHIFTS) by the times of measurement: parts, alarms and how fast they were acknowledged,
    corrections, tool changes, and what needs attention next.
    """
    now = datetime.now(UTC)
    return ShiftReportOut.of(queries.shift(session, at or now, now, machine))
