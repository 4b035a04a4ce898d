"""JSON routes: maintenance, in which notifications are withheld."""

from datetime import UTC, datetime
from typing import Annotated

from fastapi import Path, Query, Response

from app.access.deps import AnyCaller, Operator
from app.loop.machines.queries import only_machine
from app.loop.maintenance import actions, queries
from app.loop.maintenance.schemas import MaintenanceIn, MaintenanceOut
from app.loop.maintenance.verbs import END, EXTEND, OfMaintenance
from app.web.api import Before, Limit, MachineFilter, api_router, problems
from app.web.deps import SessionDep
from app.web.fields import LARGEST_ID, Page, page_of
from app.web.verb import add_json_route

router = api_router("notifications")
Number = Annotated[int, Path(ge=1, le=LARGEST_ID, description="Number of the maintenance.", examples=[1])]


@router.get("/maintenance", responses=problems(404))
def list_maintenance(
    session: SessionDep,
    caller: AnyCaller,
    machine: MachineFilter = None,
    ahead: Annotated[bool, Query(description="Only what runs or is planned.")] = False,
    before: Before = None,
    limit: Limit = 100,
) -> Page[MaintenanceOut]:
    """Maintenance, the last entered first; of a machine with that of all machines."""
    machine_id, now = only_machine(session, caller, machine), datetime.now(UTC)
    rows = queries.all_maintenance(session, machine_id=machine_id, ahead=ahead, before=before, limit=limit + 1)
    return page_of([MaintenanceOut.of(row, now) for row in rows], limit, lambda row: row.id)


@router.post("/maintenance", status_code=201, responses=problems(404, 409))
def enter_maintenance(
    session: SessionDep, caller: Operator, given: MaintenanceIn, response: Response
) -> MaintenanceOut:
    """Put a machine, or all, under maintenance: no notifications of their alarms are sent meanwhile. Alarms are raised as ever.

    An operator enters it for one machine, over within 24 hours, with `stopping_anyway`. 409 where other maintenance of the same
    machine overlaps with it. The same from the same sender within 30 s is one, and answered as the first.
    """
    row = actions.enter_maintenance(session, given, caller)
    response.headers["Location"] = f"/api/v1/maintenance/{row.maintenance.id}"
    return MaintenanceOut.of(row, datetime.now(UTC))


@router.get("/maintenance/{maintenance}", responses=problems(404))
def get_maintenance(session: SessionDep, caller: AnyCaller, maintenance: Number) -> MaintenanceOut:
    """Maintenance by its number, over or not."""
    row = queries.maintenance(session, maintenance)
    if row.machine is not None:
        caller.must_at(row.machine.id, "viewer")
    return MaintenanceOut.of(row, datetime.now(UTC))


def _maintenance(session: SessionDep, caller: Operator, maintenance: Number) -> OfMaintenance:
    return OfMaintenance(session, maintenance, caller)


for verb in (EXTEND, END):
    add_json_route(
        router,
        f"/maintenance/{{maintenance}}/{verb.name}",
        verb,
        _maintenance,
        lambda _on, row: MaintenanceOut.of(row, datetime.now(UTC)),
        MaintenanceOut,
    )
