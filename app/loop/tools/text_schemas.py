"""Corrections fetched as program text, as JSON."""

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, Field

from app.core.programs.corrections import MOST_STEPS
from app.loop.tools.fetching import Fetched
from app.web.fields import LARGEST_SERIAL, Body

Number = Annotated[int, Field(strict=True, ge=1, le=LARGEST_SERIAL)]
Numbers = Annotated[
    list[Number], Field(min_length=1, max_length=MOST_STEPS, description="Which corrections, by their numbers.")
]


class FetchedIn(Body):
    """Corrections that were fetched, and the form of their text."""

    numbers: Numbers
    form: Annotated[
        str | None, Field(max_length=40, description="The form of the text; if left out, the usual one of the control.")
    ] = None


class FetchedOne(BaseModel):
    """A correction that was fetched."""

    number: Annotated[int, Field(description="Number of the correction.")]
    fetched_at: Annotated[datetime, Field(description="When it was first fetched.")]
    fetched_by: Annotated[str, Field(description="Who fetched it.")]
    fetched_as: Annotated[str, Field(description="Form and check sum of the text.")]
    fetched_before: Annotated[
        bool, Field(description="It was fetched earlier already: the same text with the same number.")
    ]


class FetchedOut(BaseModel):
    """Corrections that were marked as fetched."""

    items: list[FetchedOne]


class ConfirmedIn(Body):
    """Corrections that are in the control now."""

    numbers: Numbers


class ConfirmedOut(BaseModel):
    """The result of the confirmation."""

    applied: Annotated[list[int], Field(description="Numbers of corrections that are applied now.")]
    applied_before: Annotated[
        list[int], Field(description="Numbers of those that were confirmed before; nothing happened twice.")
    ]
    must_not_be_in: Annotated[list[int], Field(description="Rejected or superseded meanwhile: take them out again.")]
    note: Annotated[str | None, Field(description="What else is to be said; null: nothing.")]


def fetched_out(marked: list[Fetched]) -> FetchedOut:
    """Fetched corrections as they are answered."""
    return FetchedOut(
        items=[
            FetchedOne(
                number=c.number,
                fetched_at=c.fetched_at,  # type: ignore[arg-type] # it was marked just now, or before
                fetched_by=c.fetched_by or "",
                fetched_as=c.fetched_as or "",
                fetched_before=before,
            )
            for c, before in marked
        ]
    )
