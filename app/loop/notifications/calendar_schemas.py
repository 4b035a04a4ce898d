"""Days off of the plant as JSON."""

from datetime import date
from typing import Annotated

from pydantic import BaseModel, Field

from app.web.fields import Body


class CalendarIn(Body):
    """Days on which the plant does not work."""

    country: Annotated[
        str | None,
        Field(
            pattern="^[A-Z]{2}$", description="Its public holidays are days off; two letters (ISO 3166), such as DE."
        ),
    ] = None
    subdivision: Annotated[
        str | None, Field(min_length=1, max_length=50, description="Those of a part of the country, such as BY.")
    ] = None
    days: Annotated[list[date], Field(max_length=1000, description="Days off of the plant itself.")] = Field(
        default_factory=list
    )


class DayOffOut(BaseModel):
    """A day off."""

    day: Annotated[date, Field(description="By the plant's clock.")]
    name: Annotated[str, Field(description="Of a public holiday; empty for a day of the plant itself.")]


class CalendarOut(CalendarIn):
    """The days off of the plant as an administrator has set them."""


class ComingOut(BaseModel):
    """Days off from today on."""

    days: Annotated[list[DayOffOut], Field(description="For a year, those of INBAND_DAYS_OFF too.")]
