"""Page: the causes of alarms by how often they come (Pareto)."""

from typing import Annotated

from fastapi import APIRouter, Depends, Request, Response

from app.access.deps import require
from app.core.period import Period
from app.loop.machines import queries as machines
from app.loop.reactions import queries, wording
from app.web.choice import in_address, period_on_page
from app.web.deps import FROM_REPLICA, SessionDep, Word
from app.web.paging import address
from app.web.templates import page

router = APIRouter(include_in_schema=False, dependencies=[FROM_REPLICA])


@router.get("/alarms/causes", dependencies=[require("viewer")])
def causes_page(
    request: Request,
    session: SessionDep,
    period: Annotated[Period, Depends(period_on_page)],
    machine: Word = None,
) -> Response:
    """Causes of acknowledged alarms, with the time to acknowledge and the time to recover."""
    chosen = machines.machine_named(session, machine) if machine else None
    found = queries.causes_of_alarms(session, machine_id=chosen.id if chosen else None, period=period)

    def link(**changes: str | None) -> str:
        return address("/alarms/causes", **{"machine": machine, **in_address(period), **changes})

    return page(
        request,
        "alarms/causes.html",
        found=found,
        machine=chosen,
        machines=machines.machines(session),
        period=period,
        link=link,
        duration=wording.duration,
        address=address,
    )
