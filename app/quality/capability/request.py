"""Parameters by which routes choose the readings and limits of a capability study."""

from typing import Annotated, NamedTuple

from fastapi import Depends, Query
from sqlalchemy.orm import Session

from app.core.context import Chosen
from app.core.natural_limit import NaturalLimit
from app.core.period import Period
from app.errors import Invalid
from app.language.i18n import _
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries import queries as statistics
from app.quality.capability import queries
from app.quality.capability.kinds import SigmaBy
from app.quality.capability.queries import CONFIDENCE, COVERAGE, USUAL, Side, Study
from app.web.choice import InContext, InPeriod
from app.web.fields import LARGEST_ID


class StudyRequest(NamedTuple):
    """Choice of readings and of the limits that they are judged by."""

    last: str | None
    period: Period
    side: Side
    confidence: float
    coverage: float = COVERAGE
    sigma_by: SigmaBy = SigmaBy.NEIGHBOURS
    context: Chosen = ()


Last = Annotated[
    str | None,
    Query(
        pattern=r"^([1-9][0-9]{0,17}|all)$",
        description="Of the last N readings, or of `all`; the last 1000 where neither this nor a time is given.",
    ),
]
OneSide = Annotated[
    Side,
    Query(
        description="Both limits, or only one of them. A natural limit is never judged: `both` is the other one alone."
    ),
]
Confidence = Annotated[float, Query(gt=0.5, lt=1, allow_inf_nan=False, description="Of the intervals.")]
Coverage = Annotated[
    float, Query(gt=0.5, lt=1, allow_inf_nan=False, description="Share of all parts that the tolerance interval holds.")
]
OfSigma = Annotated[
    SigmaBy,
    Query(
        description="What sigma within, and with it Cp and Cpk, is made of: the mean moving range of neighbours, or the pooled variance "
        "inside the readings of one part, one shift (as the shifts are set now), or neighbours of one nest (spindle, cavity)."
    ),
]


def study_request(
    period: InPeriod,
    context: InContext,
    last: Last = None,
    side: OneSide = "both",
    confidence: Confidence = CONFIDENCE,
    coverage: Coverage = COVERAGE,
    sigma_by: OfSigma = SigmaBy.NEIGHBOURS,
) -> StudyRequest:
    """The choice of readings, the same for API and figures."""
    return StudyRequest(last, period, side, confidence, coverage, sigma_by, context)


StudyRequestDep = Annotated[StudyRequest, Depends(study_request)]


def study_of(session: Session, current: CurrentCharacteristic, choice: StudyRequest) -> Study:
    """Return the study of the readings that were chosen. Raises `Invalid` for the side of a natural limit."""
    natural = current.parameters.natural_limit
    if natural is not NaturalLimit.NONE and choice.side == natural.value:
        raise Invalid.at(
            "side",
            _("is the side of the natural limit, beyond which no part can be: it carries no index (ISO 22514-2)"),
            do=_("Leave side out, or choose the other limit."),
        )
    last = choice.last or ("all" if choice.period.bounded else str(USUAL))
    window = statistics.window_of(
        session,
        current.characteristic,
        last=None if last == "all" else min(int(last), LARGEST_ID),
        period=choice.period,
        context=choice.context,
        usable=choice.last is None,
    )
    return queries.capability_of(
        session,
        current,
        window,
        side=choice.side,
        confidence=choice.confidence,
        coverage=choice.coverage,
        sigma_by=choice.sigma_by,
    )
