"""Choice of readings: by number, by time, or the last ones; the same fields in every API and page."""

from datetime import datetime
from typing import Annotated, NamedTuple

from fastapi import Depends, Query

from app.errors import FieldError, Invalid
from app.language.i18n import _
from app.web.fields import LARGEST_ID, Moment


class Choice(NamedTuple):
    """Chosen readings."""

    last: int | None
    first: int | None
    through: int | None
    start: datetime | None
    end: datetime | None


def chosen(
    last: Annotated[
        str | None, Query(pattern=r"^([1-9][0-9]{0,17}|all)$", description="The last so many readings, or `all`.")
    ] = None,
    first: Annotated[int | None, Query(ge=1, le=LARGEST_ID, description="From this reading on.")] = None,
    through: Annotated[int | None, Query(ge=1, le=LARGEST_ID, description="To this reading, itself included.")] = None,
    start: Annotated[Moment | None, Query(alias="from", description="Measured at this moment or later.")] = None,
    end: Annotated[Moment | None, Query(alias="to", description="Measured at this moment or earlier.")] = None,
) -> Choice:
    """The readings by number, by time, or the last ones; the last 200 if nothing is said."""
    for name, low, high in (("first", first, through), ("from", start, end)):
        if low is not None and high is not None and low > high:  # type: ignore[operator]
            message = _("is beyond the end of the range; exchange the two")
            raise Invalid(
                f"{name}: {message}",
                _("Correct the named fields and send it again."),
                errors=[FieldError(name, message)],
            )
    if last is None and all(value is None for value in (first, through, start, end)):
        return Choice(200, None, None, None, None)
    return Choice(None if last in (None, "all") else int(last), first, through, start, end)


Chosen = Annotated[Choice, Depends(chosen)]
