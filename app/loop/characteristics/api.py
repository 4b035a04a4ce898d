"""JSON routes: characteristics and the versions of their parameters."""

from typing import Annotated

from fastapi import Query, Response

from app.access.deps import AnyCaller, Engineer
from app.loop.characteristics import actions, correction_queries, queries
from app.loop.characteristics.schemas import (
    CharacteristicChange,
    CharacteristicIn,
    CharacteristicOut,
    VersionOut,
    characteristic_out,
    version_out,
)
from app.loop.machines import queries as machines
from app.web.api import CharacteristicKey, KeyAfter, Limit, SerialBefore, api_router, problems
from app.web.deps import SessionDep
from app.web.etags import TAGGED, guarded, tagged
from app.web.fields import Page, page_of

router = api_router("characteristics")


@router.post("/characteristics", status_code=201, responses=problems(409))
def add_characteristic(
    session: SessionDep, caller: Engineer, characteristic: CharacteristicIn, response: Response
) -> CharacteristicOut:
    """Set up a characteristic. Parameters outside the control's ranges are accepted with a warning."""
    created = actions.add_characteristic(session, characteristic, caller.name)
    response.headers["Location"] = f"/api/v1/characteristics/{characteristic.key}"
    return characteristic_out(created, given=characteristic.parameters)


@router.get("/characteristics", responses=problems(404))
def list_characteristics(
    session: SessionDep,
    caller: AnyCaller,
    machine: Annotated[str | None, Query(description="Only those of this machine.", examples=["lathe-1"])] = None,
    after: KeyAfter = "",
    limit: Limit = 100,
) -> Page[CharacteristicOut]:
    """Characteristics by key; for the key of a machine, those of that machine."""
    machine_id = machines.only_machine(session, caller, machine)
    rows = queries.characteristics(session, machine_id=machine_id, after=after, limit=limit + 1)
    return page_of([characteristic_out(row) for row in rows], limit, lambda row: row.key)


@router.get("/characteristics/{characteristic}", responses=problems(404) | TAGGED)
@tagged
def get_characteristic(session: SessionDep, caller: AnyCaller, characteristic: CharacteristicKey) -> CharacteristicOut:
    """One characteristic with its parameters in force."""
    current = queries.characteristic_for(session, caller, characteristic, "viewer")
    return characteristic_out(current)


@router.patch("/characteristics/{characteristic}", responses=problems(404, 409, 412))
@guarded(get_characteristic, queries.hold_characteristic)
def change_characteristic(
    session: SessionDep, caller: Engineer, characteristic: CharacteristicKey, change: CharacteristicChange
) -> CharacteristicOut:
    """Change it. `parameters` make a new version and need a `reason`; old readings keep the version they were judged by.

    With another target, factor or tool, and where corrections end or need approval from now on, open corrections of this
    characteristic are superseded; a warning names them.
    """
    current = actions.change_characteristic(session, characteristic, change, caller.name)
    fallen = correction_queries.superseded_with(session, current) if change.parameters else ()
    return characteristic_out(current, queries.target_before(session, current), change.parameters, fallen)


@router.get("/characteristics/{characteristic}/parameters", responses=problems(404))
def list_parameter_versions(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    before: SerialBefore = None,
    limit: Limit = 100,
) -> Page[VersionOut]:
    """Every version of the parameters, newest first: who, when, why."""
    current = queries.characteristic_for(session, caller, characteristic, "viewer")
    rows = queries.versions(session, current.characteristic, before=before, limit=limit + 1)
    return page_of([version_out(row) for row in rows], limit, lambda row: row.version)
