"""JSON route: the sampling that the readings of a characteristic allow."""

from typing import Annotated

from fastapi import Query

from app.access.deps import AnyCaller
from app.core.sampling import USUAL_PPM
from app.core.spc.refusal import Refused
from app.errors import Invalid
from app.loop.characteristics.queries import characteristic_for
from app.quality.sampling import queries
from app.quality.sampling.schemas import SamplingOut
from app.quality.sampling.wording import too_few
from app.web.api import CharacteristicKey, api_router, problems
from app.web.deps import FROM_REPLICA, SessionDep

router = api_router("statistics", FROM_REPLICA)


@router.get("/characteristics/{characteristic}/sampling", responses=problems(404))
def get_sampling(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    last: Annotated[int, Query(ge=2, le=100_000, description="The newest readings.")] = queries.USUAL,
    most_ppm: Annotated[
        float, Query(gt=0, le=1_000_000, description="Parts per million that may go out of tolerance unmeasured.")
    ] = USUAL_PPM,
    seconds: Annotated[float | None, Query(gt=0, le=100_000, description="That one measurement takes.")] = None,
) -> SamplingOut:
    """Propose to measure 1 in n parts, from stability, wear and capability, with the risk of each n. Nothing is changed by it.

    More than every part only of a stable, capable process whose wear is known; the control plan tightens it by itself after an alarm and
    a tool change.
    """
    current = characteristic_for(session, caller, characteristic, "viewer")
    found = queries.sampling_of(session, current, last, most_ppm)
    if isinstance(found, Refused):
        raise Invalid.at("characteristic", too_few())
    return SamplingOut.of(found, seconds)
