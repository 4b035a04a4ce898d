"""JSON routes: the capability of a characteristic, and its figures."""

from datetime import datetime
from typing import Annotated, Any, Literal, NamedTuple

import msgspec
from fastapi import Depends, Path, Query, Response
from sqlalchemy.orm import Session

from app.capability import queries
from app.capability.figures import Drawn, histogram, probability
from app.capability.queries import CONFIDENCE, USUAL, Side, Study
from app.capability.schemas import CapabilityOut, capability_out
from app.characteristics import queries as characteristics
from app.characteristics.queries import Standing
from app.core.spc.refusal import Refused
from app.errors import FieldError, Invalid
from app.statistics import queries as statistics
from app.web.api import api_router, problems
from app.web.deps import AnyCaller, SessionDep
from app.web.fields import LARGEST_ID, Moment
from app.web.i18n import _
from app.web.theme import ThemeName

router = api_router("statistics")
FIGURE: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "A Plotly figure: `data` and `layout`",
        "content": {"application/json": {"example": {"data": [], "layout": {}}}},
    }
}
CharacteristicKey = Annotated[str, Path(description="The key of the characteristic.", examples=["shaft-d40"])]


class Asked(NamedTuple):
    """Which readings, and beside which limits."""

    last: str | None
    start: datetime | None
    end: datetime | None
    side: Side
    confidence: float


Last = Annotated[
    str | None,
    Query(
        pattern=r"^([1-9][0-9]{0,17}|all)$",
        description="Of the last so many readings, or of `all`; the last 1000 where neither this nor a time is given.",
    ),
]
OneSide = Annotated[Side, Query(description="Both limits, or only one of them.")]
Confidence = Annotated[float, Query(gt=0.5, lt=1, allow_inf_nan=False, description="Of the intervals.")]


def in_order(choice: Asked) -> Asked:
    """The choice, unless it runs backwards. Raises `Invalid`."""
    if choice.start is not None and choice.end is not None and choice.start > choice.end:
        message = _("is later than the end; exchange the two")
        raise Invalid(f"from: {message}.", _("Exchange the two moments."), errors=[FieldError("from", message)])
    return choice


def asked(
    start: Annotated[
        Moment | None, Query(alias="from", description="Measured at this moment or later.", examples=[None])
    ] = None,
    end: Annotated[
        Moment | None, Query(alias="to", description="Measured at this moment or earlier.", examples=[None])
    ] = None,
    last: Last = None,
    side: OneSide = "both",
    confidence: Confidence = CONFIDENCE,
) -> Asked:
    """The choice of readings, the same for API and figures."""
    return in_order(Asked(last, start, end, side, confidence))


AskedDep = Annotated[Asked, Depends(asked)]


def judged(session: Session, standing: Standing, choice: Asked) -> Study:
    """What was asked for."""
    last = choice.last or (str(USUAL) if choice.start is None and choice.end is None else "all")
    window = statistics.window_of(
        session,
        standing.characteristic,
        last=None if last == "all" else min(int(last), LARGEST_ID),
        start=choice.start,
        end=choice.end,
    )
    return queries.capability_of(
        session,
        standing,
        window,
        side=choice.side,
        confidence=choice.confidence,
    )


def drawn(study: Study) -> Drawn:
    """What its figures need."""
    found = None if isinstance(study.found, Refused) else study.found
    by_percentile = None if isinstance(study.by_percentile, Refused) else study.by_percentile
    return Drawn(
        study.values,
        study.limits,
        found.mean if found else None,
        found.overall.value if found else None,
        found.within.value if found and study.potential_allowed else None,
        (by_percentile.low, by_percentile.median, by_percentile.high) if by_percentile else None,
        study.normal or found is None,
    )


@router.get("/characteristics/{characteristic}/capability", responses=problems(404))
def get_capability(
    session: SessionDep, caller: AnyCaller, characteristic: CharacteristicKey, choice: AskedDep
) -> CapabilityOut:
    """Cp, Cpk, Pp, Ppk, Cpm with intervals, percentiles, expected and observed ppm, normality, stability, model in time.

    Of a compensated characteristic also what the tool did without its corrections, and what ideal ones could reach.
    """
    standing = characteristics.characteristic_named(session, characteristic)
    caller.must_at(standing.machine.id, "viewer")
    return capability_out(judged(session, standing, choice))


@router.get(
    "/characteristics/{characteristic}/figures/capability", responses=problems(404) | FIGURE, response_model=None
)
def get_capability_figure(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    choice: AskedDep,
    picture: Annotated[
        Literal["histogram", "probability"], Query(description="Histogram with fitted curve, or probability plot.")
    ] = "histogram",
    theme: Annotated[ThemeName, Query(description="For a light or a dark page.")] = "light",
) -> Response:
    """The histogram with its fitted curve and the limits, or the normal probability plot."""
    standing = characteristics.characteristic_named(session, characteristic)
    caller.must_at(standing.machine.id, "viewer")
    shown = drawn(judged(session, standing, choice))
    figure = (histogram if picture == "histogram" else probability)(shown, theme=theme)
    return Response(msgspec.json.encode(figure), media_type="application/json", headers={"Cache-Control": "no-store"})
