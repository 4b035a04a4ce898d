"""JSON routes: reaction plans, the catalogue of causes and corrective actions, the Pareto of causes."""

from typing import Annotated

from fastapi import Path, Query, Request, Response

from app.access.deps import Engineer, require
from app.loop.alarm_response.reaction_queries import plans_in_force
from app.loop.characteristics.queries import characteristic_named
from app.loop.machines.queries import machine_named
from app.loop.reactions import actions, queries
from app.loop.reactions.schemas import (
    CatalogueEntryChange,
    CatalogueEntryIn,
    CatalogueEntryOut,
    CauseShareOut,
    CausesOut,
    ReactionPictureOut,
    ReactionPlanIn,
    ReactionPlanOut,
)
from app.web.api import After, Limit, MachineFilter, SerialBefore, api_router, problems
from app.web.choice import InPeriod
from app.web.deps import FROM_REPLICA, SessionDep
from app.web.etags import TAGGED, guarded, held, tagged
from app.web.fields import LARGEST_ID, Page, ReasonIn, Slug, Text200, page_of
from app.web.limits import takes
from app.web.pictures import AS_JSON, FILE, DigestPath, PictureIn, decoded, picture_of, served

router = api_router("alarms")
PlanNumber = Annotated[int, Path(ge=1, le=LARGEST_ID, description="Number of the plan.", examples=[1])]
EntryNumber = Annotated[int, Path(ge=1, le=LARGEST_ID, description="Number of the entry.", examples=[1])]
Version = Annotated[int | None, Query(ge=1, le=2_147_483_647, description="Which version; without it the last.")]
VIEWER = [require("viewer")]


@router.get("/reactions/plans", dependencies=VIEWER)
def list_reaction_plans(session: SessionDep, after: After = 0, limit: Limit = 100) -> Page[ReactionPlanOut]:
    """Reaction plans in force, each in its last version.

    Of the plans that fit an alarm the most specific holds: one of its characteristic before one of any, then one of its run
    rule, then one of its kind.
    """
    rows = [ReactionPlanOut.of(row) for row in plans_in_force(session) if row.id > after][: limit + 1]
    return page_of(rows, limit, lambda row: row.id)


@router.post("/reactions/plans", status_code=201, responses=problems(404, 409))
def add_reaction_plan(
    session: SessionDep, caller: Engineer, given: ReactionPlanIn, response: Response
) -> ReactionPlanOut:
    """Write a reaction plan. 409 where another one is for exactly these alarms."""
    row = actions.add_plan(session, given, caller)
    response.headers["Location"] = f"/api/v1/reactions/plans/{row.id}"
    return ReactionPlanOut.of(row)


@router.get("/reactions/plans/{plan}", dependencies=VIEWER, responses=problems(404) | TAGGED)
@tagged
def get_reaction_plan(session: SessionDep, plan: PlanNumber, version: Version = None) -> ReactionPlanOut:
    """A reaction plan in its last version or in any before."""
    return ReactionPlanOut.of(queries.plan(session, plan, version))


@router.get("/reactions/plans/{plan}/versions", dependencies=VIEWER, responses=problems(404))
def list_reaction_plan_versions(
    session: SessionDep, plan: PlanNumber, before: SerialBefore = None, limit: Limit = 100
) -> Page[ReactionPlanOut]:
    """The versions of a plan, the newest first."""
    rows = [ReactionPlanOut.of(row) for row in queries.versions(session, plan, before, limit + 1)]
    return page_of(rows, limit, lambda row: row.version)


@router.put("/reactions/plans/{plan}", responses=problems(404, 409, 412))
@guarded(get_reaction_plan, queries.hold_plans)
def change_reaction_plan(
    session: SessionDep, caller: Engineer, plan: PlanNumber, given: ReactionPlanIn
) -> ReactionPlanOut:
    """Write the next version of a plan. One that was withdrawn is in force again; one that is the same makes no version."""
    return ReactionPlanOut.of(actions.change_plan(session, plan, given, caller))


@router.post("/reactions/plans/{plan}/withdraw", responses=problems(404, 409))
def withdraw_reaction_plan(session: SessionDep, caller: Engineer, plan: PlanNumber, given: ReasonIn) -> ReactionPlanOut:
    """Take a plan out of force. Its versions stay, and alarms go on to show the one that they were handled with."""
    return ReactionPlanOut.of(actions.withdraw_plan(session, plan, given.reason, caller))


@router.post(
    "/reactions/pictures", status_code=201, responses=problems(409, 413) | {200: {"model": ReactionPictureOut}}
)
@takes(AS_JSON, by="engineer", pictures=True)
def add_reaction_picture(
    session: SessionDep, caller: Engineer, given: PictureIn, response: Response
) -> ReactionPictureOut:
    """Send a picture, which steps of plans name by its digest. 201; 200 where it is there already.

    A picture is never changed, and stays as long as the versions that show it: for ever.
    """
    session.commit()  # nothing is kept open while the picture is read
    done = actions.add_picture(session, picture_of(decoded(given.content)), caller)
    if done.again:
        response.status_code = 200
    response.headers["Location"] = f"/api/v1/reactions/pictures/{done.row.digest}"
    return ReactionPictureOut.of(done.row)


@router.get(
    "/reactions/pictures/{picture}",
    dependencies=VIEWER,
    responses=problems(404) | FILE,
    response_model=None,
    response_class=Response,
)
def get_reaction_picture(request: Request, session: SessionDep, picture: DigestPath) -> Response:
    """A picture of a step, with its digest as `ETag`."""
    return served(request, queries.picture(session, picture), "max-age=31536000, immutable")


@router.get("/reactions/catalogue", dependencies=VIEWER)
def list_catalogue(session: SessionDep, after: After = 0, limit: Limit = 100) -> Page[CatalogueEntryOut]:
    """Causes and corrective actions of the plant, retired ones too."""
    rows = [CatalogueEntryOut.of(row) for row in queries.catalogue(session, after, limit + 1)]
    return page_of(rows, limit, lambda row: row.id)


@router.post("/reactions/catalogue", status_code=201, responses=problems(409))
def add_catalogue_entry(session: SessionDep, caller: Engineer, given: CatalogueEntryIn) -> CatalogueEntryOut:
    """Add a cause or a corrective action. Its name stays for ever, for alarms name it."""
    return CatalogueEntryOut.of(actions.add_entry(session, given, caller))


@router.get("/reactions/catalogue/{entry}", dependencies=VIEWER, responses=problems(404) | TAGGED)
@tagged
def get_catalogue_entry(session: SessionDep, entry: EntryNumber) -> CatalogueEntryOut:
    """One cause or corrective action."""
    return CatalogueEntryOut.of(queries.entry(session, entry))


@router.patch("/reactions/catalogue/{entry}", responses=problems(404, 412))
@guarded(get_catalogue_entry, held(queries.entry, "entry"))
def change_catalogue_entry(
    session: SessionDep, caller: Engineer, entry: EntryNumber, change: CatalogueEntryChange
) -> CatalogueEntryOut:
    """Offer an entry no more, or again."""
    return CatalogueEntryOut.of(actions.retire_entry(session, entry, change.retired, caller))


@router.get("/reactions/causes", dependencies=[*VIEWER, FROM_REPLICA], responses=problems(404))
def get_causes_of_alarms(
    session: SessionDep,
    period: InPeriod,
    machine: MachineFilter = None,
    characteristic: Annotated[Slug | None, Query(description="Only of this characteristic.")] = None,
    kind: Annotated[Text200 | None, Query(description="Only this kind of alarm.", examples=["tool_worn"])] = None,
) -> CausesOut:
    """Pareto of causes: acknowledged alarms by cause, with the time to acknowledge and the time to recover.

    Alarms that ended by themselves are not counted. At most the newest 5000 of the period.
    """
    current = characteristic_named(session, characteristic) if characteristic else None
    machine_id = machine_named(session, machine).id if machine else None
    found = queries.causes_of_alarms(
        session,
        machine_id=current.machine.id if current and machine_id is None else machine_id,
        characteristic_id=current.characteristic.id if current else None,
        kind=kind,
        period=period,
    )
    causes = [CauseShareOut.of(share, found.names.get(share.cause or 0)) for share in found.shares]
    return CausesOut(alarms=found.alarms, more=found.more, causes=causes)
