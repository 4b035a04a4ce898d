"""JSON routes: baselines, and what the next one would be."""

from typing import Annotated

from fastapi import Path, Query, Response

from app.access.deps import AnyCaller, Engineer, require
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.queries import CurrentCharacteristic
from app.quality.baselines import actions, queries
from app.quality.baselines.answers import baseline_out, draft_out
from app.quality.baselines.draft_queries import draft_of
from app.quality.baselines.schemas import BaselineIn, BaselineOut, BaselineWhyIn, DraftAnswer, PeriodIn
from app.web.api import CharacteristicKey, Limit, api_router, problems, sent_again
from app.web.deps import FROM_REPLICA, SessionDep
from app.web.fields import LARGEST_SERIAL, Page, page_of

router = api_router("control charts", FROM_REPLICA)

Version = Annotated[
    int, Path(ge=1, le=LARGEST_SERIAL, description="Version of the baseline; counts per characteristic.", examples=[3])
]


def _in_force(session: SessionDep, current: CurrentCharacteristic) -> int | None:
    baseline = queries.baseline_in_force(session, current.characteristic)
    return None if baseline is None else baseline.version


@router.get("/characteristics/{characteristic}/baselines", responses=problems(404))
def list_baselines(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    after: Annotated[
        int | None, Query(ge=0, le=LARGEST_SERIAL, description="Cursor: the `next` of the page before.")
    ] = None,
    limit: Limit = 100,
) -> Page[BaselineOut]:
    """Every baseline that was frozen, newest first: who, when, why, and its numbers."""
    current = characteristics.characteristic_for(session, caller, characteristic, "viewer")
    rows = queries.baselines(session, current.characteristic, before=after, limit=limit + 1)
    now = _in_force(session, current)
    listed = [baseline_out(row, characteristic, now) for row in rows]
    return page_of(listed, limit, lambda row: row.version)


@router.post(
    "/characteristics/{characteristic}/baselines",
    status_code=201,
    responses=problems(404, 409) | sent_again(BaselineOut),
)
def freeze_baseline(
    session: SessionDep, caller: Engineer, characteristic: CharacteristicKey, given: BaselineIn, response: Response
) -> BaselineOut:
    """Freeze a baseline: readings are judged by it from now on, and it is never estimated again.

    Too few readings, or all of them equal, are refused; the answer says how many are missing.
    """
    current = characteristics.characteristic_named(session, characteristic)
    done = actions.freeze(session, current, given, caller)
    if done.again:
        response.status_code = 200
    return baseline_out(done.row, characteristic, _in_force(session, current))


@router.post(
    "/characteristics/{characteristic}/baselines/preview", responses=problems(404), dependencies=[require("viewer")]
)
def preview_baseline(
    session: SessionDep, caller: AnyCaller, characteristic: CharacteristicKey, given: PeriodIn
) -> DraftAnswer:
    """Preview the baseline of a period, with the cautions that a person should read before freezing it. Nothing is stored."""
    current = characteristics.characteristic_for(session, caller, characteristic, "viewer")
    return draft_out(draft_of(session, current, given), characteristic)


@router.get("/characteristics/{characteristic}/baselines/{version}", responses=problems(404))
def get_baseline(
    session: SessionDep, caller: AnyCaller, characteristic: CharacteristicKey, version: Version
) -> BaselineOut:
    """One baseline."""
    current = characteristics.characteristic_for(session, caller, characteristic, "viewer")
    baseline = queries.baseline_of(session, current.characteristic, version)
    return baseline_out(baseline, characteristic, _in_force(session, current))


@router.post("/characteristics/{characteristic}/baselines/{version}/retire", responses=problems(404, 409))
def retire_baseline(
    session: SessionDep, caller: Engineer, characteristic: CharacteristicKey, version: Version, given: BaselineWhyIn
) -> BaselineOut:
    """Take the baseline out of force: nothing is judged until another is frozen."""
    current = characteristics.characteristic_named(session, characteristic)
    return baseline_out(actions.retire(session, current, version, given.reason, caller), characteristic, None)


@router.post(
    "/characteristics/{characteristic}/baselines/{version}/put-in-force",
    status_code=201,
    responses=problems(404, 409),
)
def put_baseline_in_force(
    session: SessionDep, caller: Engineer, characteristic: CharacteristicKey, version: Version, given: BaselineWhyIn
) -> BaselineOut:
    """Go back to an older baseline: its numbers become a new version, which is in force."""
    current = characteristics.characteristic_named(session, characteristic)
    baseline = actions.put_in_force(session, current, version, given.reason, caller)
    return baseline_out(baseline, characteristic, baseline.version)
