"""Measurements by hand as JSON. Lengths in mm."""

from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, Field

from app.core.parameters import LARGEST_LENGTH
from app.web.fields import Body, Reason

Verdict = Literal["good", "bad"]
HandSize = Annotated[
    float,
    Field(
        strict=True,
        ge=-LARGEST_LENGTH,
        le=LARGEST_LENGTH,
        description="The size that was found by hand, mm.",
    ),
]
HandVerdict = Annotated[Verdict, Field(description="Whether the part is good, by the person's own judgement.")]


class HandMeasurementIn(Body):
    """The result: a size, a verdict, or both."""

    measured: HandSize | None = None
    verdict: HandVerdict | None = None
    comment: Reason | None = None


class HandMeasurementOut(BaseModel):
    """The result of a person, beside the machine's own value."""

    id: int
    sequence: Annotated[int, Field(description="The reading of the same part.")]
    at: datetime
    by: str
    measured: Annotated[float | None, Field(description="Null where only the verdict was given.")]
    verdict: Annotated[Verdict | None, Field(description="Null where only the size was given.")]
    comment: Annotated[str | None, Field(description="Remark of the person.")]
    alarm: Annotated[int | None, Field(description="The alarm at which it was entered, if it was.")]
