"""JSON routes: control plans, which measurements are due, and those that were missed."""

from typing import Annotated

from fastapi import Query

from app.access.deps import AnyCaller, Engineer
from app.loop.characteristics.queries import characteristic_for, hold_characteristic
from app.loop.control_plan import actions, queries
from app.loop.control_plan.schemas import ControlPlanIn, ControlPlanOut, DueOut, MissedOut
from app.loop.machines.queries import only_machine
from app.web.api import Before, CharacteristicKey, KeyAfter, Limit, MachineFilter, api_router, problems
from app.web.choice import InPeriod
from app.web.deps import SessionDep
from app.web.etags import TAGGED, guarded, tagged
from app.web.fields import Page, Slug, page_of

router = api_router("characteristics")
Few = Annotated[int, Query(ge=1, le=100, description="How many items at most: each is looked at now.")]


@router.get("/characteristics/{characteristic}/control-plan", responses=problems(404) | TAGGED)
@tagged
def get_control_plan(session: SessionDep, caller: AnyCaller, characteristic: CharacteristicKey) -> ControlPlanOut:
    """The control plan of a characteristic; without any rule it is not planned."""
    current = characteristic_for(session, caller, characteristic, "viewer")
    return ControlPlanOut.of(characteristic, queries.plan_of(session, current))


@router.put("/characteristics/{characteristic}/control-plan", responses=problems(404, 412))
@guarded(get_control_plan, hold_characteristic)
def set_control_plan(
    session: SessionDep, caller: Engineer, characteristic: CharacteristicKey, given: ControlPlanIn
) -> ControlPlanOut:
    """Set the plan: it counts from now on. An alarm *measurement missed* ends; without any rule nothing is planned any more."""
    row = actions.set_plan(session, characteristic, given, caller)
    session.refresh(row)
    return ControlPlanOut.of(characteristic, row)


@router.get("/due-measurements", responses=problems(404))
def list_due_measurements(
    session: SessionDep, caller: AnyCaller, machine: MachineFilter = None, after: KeyAfter = "", limit: Few = 100
) -> Page[DueOut]:
    """Every characteristic with a control plan, by key: which measurement is due, and which was missed.

    Parts that are not measured are known by readings of other characteristics with the same `part`, and by numbers of parts where the
    plan says that they are numbered one by one. Where nothing tells of them `parts` is null, and not known is not missed: so it is for
    a characteristic without a `part`.
    """
    rows = queries.planned(session, machine_id=only_machine(session, caller, machine), after=after, limit=limit + 1)
    items = [DueOut.of(where.key, at.key, queries.look(session, plan)) for plan, where, at in rows]
    return page_of(items, limit, lambda row: row.characteristic)


@router.get("/missed-measurements", responses=problems(404))
def list_missed_measurements(
    session: SessionDep,
    caller: AnyCaller,
    period: InPeriod,
    machine: MachineFilter = None,
    characteristic: Annotated[Slug | None, Query(description="Only of this characteristic.")] = None,
    before: Before = None,
    limit: Limit = 100,
) -> Page[MissedOut]:
    """Measurements that a plan asked for and that were not made, the last found first; period: when they were found."""
    current = characteristic_for(session, caller, characteristic, "viewer") if characteristic else None
    rows = queries.missed(
        session,
        machine_id=only_machine(session, caller, machine),
        characteristic=current.characteristic if current else None,
        period=period,
        before=before,
        limit=limit + 1,
    )
    return page_of([MissedOut.of(row) for row in rows], limit, lambda row: row.id)
