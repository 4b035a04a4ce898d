"""Page: the sampling that the readings of a characteristic allow."""

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from app.access.deps import require
from app.core.sampling import USUAL_PPM, saved
from app.core.spc.refusal import Refused
from app.loop.characteristics.queries import characteristic_named
from app.quality.sampling import queries, wording
from app.web.deps import FROM_REPLICA, SessionDep
from app.web.forms import length
from app.web.templates import page

router = APIRouter(include_in_schema=False, dependencies=[FROM_REPLICA])
Typed = Annotated[str, Query(max_length=40)]


@router.get("/characteristics/{characteristic}/sampling", dependencies=[require("viewer")])
def sampling_page(
    request: Request, session: SessionDep, characteristic: str, most_ppm: Typed = "", seconds: Typed = ""
) -> Response:
    """The proposal, why it is not larger, and the risk of each choice. What is typed wrongly counts as not typed."""
    current = characteristic_named(session, characteristic)
    found = queries.sampling_of(session, current, most_ppm=_positive(most_ppm) or USUAL_PPM)
    return page(
        request,
        "sampling/sampling.html",
        characteristic=current.characteristic,
        found=None if isinstance(found, Refused) else found,
        seconds=_positive(seconds),
        typed={"most_ppm": most_ppm or f"{USUAL_PPM:g}", "seconds": seconds},
        saved=saved,
        words=wording,
        usual=queries.USUAL,
    )


def _positive(text: str) -> float | None:
    value = length(text)
    return value if isinstance(value, float) and 0 < value <= 1e6 else None
