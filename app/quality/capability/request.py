"""Parameters by which routes choose the readings and limits of a capability study."""

from datetime import datetime
from typing import Annotated, NamedTuple

from fastapi import Depends, Query
from sqlalchemy.orm import Session

from app.errors import Invalid
from app.language.i18n import _
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries import queries as statistics
from app.quality.capability import queries
from app.quality.capability.queries import CONFIDENCE, USUAL, Side, Study
from app.web.fields import LARGEST_ID, Moment


class StudyRequest(NamedTuple):
    """Choice of readings and of the limits that they are judged by."""

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


def in_order(choice: StudyRequest) -> StudyRequest:
    """Return the choice. Raises `Invalid` where its period runs backwards."""
    if choice.start is not None and choice.end is not None and choice.start > choice.end:
        raise Invalid.at("from", _("is later than the end; exchange the two"), do=_("Exchange the two moments."))
    return choice


def study_request(
    start: Annotated[
        Moment | None, Query(alias="from", description="Measured at this moment or later.", examples=[None])
    ] = None,
    end: Annotated[
        Moment | None, Query(alias="to", description="Measured at this moment or earlier.", examples=[None])
    ] = None,
    last: Last = None,
    side: OneSide = "both",
    confidence: Confidence = CONFIDENCE,
) -> StudyRequest:
    """The choice of readings, the same for API and figures."""
    return in_order(StudyRequest(last, start, end, side, confidence))


StudyRequestDep = Annotated[StudyRequest, Depends(study_request)]


def study_of(session: Session, current: CurrentCharacteristic, choice: StudyRequest) -> Study:
    """Return the study of the readings that were chosen."""
    last = choice.last or (str(USUAL) if choice.start is None and choice.end is None else "all")
    window = statistics.window_of(
        session,
        current.characteristic,
        last=None if last == "all" else min(int(last), LARGEST_ID),
        start=choice.start,
        end=choice.end,
        usable=True,
    )
    return queries.capability_of(
        session,
        current,
        window,
        side=choice.side,
        confidence=choice.confidence,
    )
