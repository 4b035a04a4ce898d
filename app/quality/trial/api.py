"""JSON routes: the shadow trial of a characteristic, and its end."""

from typing import Annotated

from fastapi import Query

from app.access.deps import AnyCaller, Engineer
from app.core.replay import LONGEST_DELAY
from app.loop.characteristics.queries import characteristic_for, characteristic_named
from app.quality.trial import queries
from app.quality.trial.schemas import StartedOut, TrialOut
from app.quality.trial.verbs import START, OfTrial
from app.web.api import CharacteristicKey, api_router, problems
from app.web.deps import SessionDep
from app.web.verb import add_json_route

router = api_router("what-if")


@router.get("/characteristics/{characteristic}/trial", responses=problems(404, 429))
def get_trial(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    last: Annotated[int, Query(ge=2, le=100_000, description="The newest readings.")] = queries.USUAL,
    delay: Annotated[
        int, Query(ge=0, le=LONGEST_DELAY, description="Parts cut with the old offset after a correction.")
    ] = queries.DELAY,
) -> TrialOut:
    """The readings of a characteristic that only measures, side by side with the same parts in a loop that corrects them.

    Nothing is corrected by it. Settings are proposed from 100 readings on: of those whose Ppk cannot be distinguished from the best the
    ones that correct least.
    """
    current = characteristic_for(session, caller, characteristic, "viewer")
    return TrialOut.of(queries.trial_of(session, current, last, delay))


def _of_trial(session: SessionDep, caller: Engineer, characteristic: CharacteristicKey) -> OfTrial:
    characteristic_named(session, characteristic)
    return OfTrial(session, characteristic, caller)


add_json_route(
    router,
    "/characteristics/{characteristic}/trial/start",
    START,
    _of_trial,
    lambda _on, changed: StartedOut.of(changed),
    StartedOut,
)
