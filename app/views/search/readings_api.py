"""JSON route: the list of readings, of one characteristic or across them."""

from typing import Annotated

from fastapi import Query

from app.access.deps import AnyCaller
from app.core.decision.limits import Zone
from app.core.decision.step import Action
from app.loop.machines.queries import only_machine
from app.loop.readings.answers import ReadingRow
from app.loop.readings.queries import entry_for
from app.views.search import readings
from app.views.search.parts import Part
from app.web.api import Limit, MachineFilter, api_router, problems
from app.web.choice import InContext, InPeriod
from app.web.deps import FROM_REPLICA, SessionDep
from app.web.fields import Page

router = api_router("readings", FROM_REPLICA)
CURSOR = r"^[0-9]{1,19}(-[0-9]{1,19}){0,3}$"


@router.get("/readings", responses=problems(404))
def list_readings(
    session: SessionDep,
    caller: AnyCaller,
    period: InPeriod,
    context: InContext,
    characteristic: Annotated[
        str | None, Query(description="Only of the characteristic with this key.", examples=["shaft-d40"])
    ] = None,
    machine: MachineFilter = None,
    part: Annotated[
        Part | None, Query(description="Only of this part, named exactly so.", examples=["SN-000812"])
    ] = None,
    zone: Annotated[list[Zone], Query(description="Only of this zone; of several if repeated.")] = [],  # noqa: B006 - FastAPI copies it
    action: Annotated[list[Action], Query(description="Only those that asked for this; repeat it for several.")] = [],  # noqa: B006 - as above
    order: Annotated[readings.Order, Query(description="Which come first, by arrival.")] = "oldest",
    after: Annotated[
        str | None,
        Query(
            pattern=CURSOR,
            description="Cursor: the `next` of the page before. Of one characteristic it is the number of a reading.",
        ),
    ] = None,
    limit: Limit = 100,
) -> Page[ReadingRow]:
    """Readings in the order of their arrival, those of one batch by characteristic: of a characteristic, a machine, a part, a
    period, an order or another value of their context, or several of these at once.

    The key of a machine sees those of that machine. A part is found by an index. By any other condition without a characteristic the
    readings are looked through in their order until the page is full: what is rare in millions of them is found faster within a period.
    """
    entry = entry_for(session, caller, characteristic) if characteristic is not None else None
    machine_id = only_machine(session, caller, machine)
    if entry is not None and machine_id not in (None, entry.machine_id):
        return Page(items=[])
    filters = readings.Filters(entry, machine_id, part, period, zone, action, context)
    records = readings.found(session, filters, order, after, limit + 1)
    shown = records[:limit]
    items = [ReadingRow.model_validate(row) for row in readings.answers(session, shown)]
    return Page(items=items, next=readings.cursor_of(shown[-1], filters) if len(records) > limit else None)
