"""Choice of readings: by number, by time, or the last ones; the same fields in every API and page."""

from datetime import datetime
from typing import Annotated, Literal, NamedTuple

from fastapi import Depends, Query

from app.errors import FieldError, Invalid
from app.files.formats import cell_values
from app.language.i18n import _
from app.language.times import plant_zone
from app.web.fields import LARGEST_ID, Moment


class Choice(NamedTuple):
    """Chosen readings."""

    last: int | None
    first: int | None
    through: int | None
    start: datetime | None
    end: datetime | None


def _in_order(
    last: str | None, first: int | None, through: int | None, start: datetime | None, end: datetime | None
) -> Choice:
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


Last = Annotated[
    str | None, Query(pattern=r"^([1-9][0-9]{0,17}|all)$", description="The last so many readings, or `all`.")
]
First = Annotated[int | None, Query(ge=1, le=LARGEST_ID, description="From this reading on.")]
Through = Annotated[int | None, Query(ge=1, le=LARGEST_ID, description="To this reading, itself included.")]


def chosen(
    last: Last = None,
    first: First = None,
    through: Through = None,
    start: Annotated[Moment | None, Query(alias="from", description="Measured at this moment or later.")] = None,
    end: Annotated[Moment | None, Query(alias="to", description="Measured at this moment or earlier.")] = None,
) -> Choice:
    """The readings by number, by time, or the last ones; the last 200 if nothing is said."""
    return _in_order(last, first, through, start, end)


def chosen_on_page(
    last: Last = None,
    first: First = None,
    through: Through = None,
    start: Annotated[str, Query(alias="from", max_length=64)] = "",
    end: Annotated[str, Query(alias="to", max_length=64)] = "",
) -> Choice:
    """The same in the address of a page: a moment without an offset is one of the plant's clock."""
    return _in_order(last, first, through, _moment("from", start, 0), _moment("to", end, 1))


def _moment(name: str, typed: str, fold: Literal[0, 1]) -> datetime | None:
    try:
        return cell_values.moment(typed, plant_zone(), fold=fold) if typed.strip() else None
    except cell_values.Unreadable as error:
        raise Invalid.at(name, str(error), do=_("Correct the named fields and send it again.")) from None


Chosen = Annotated[Choice, Depends(chosen)]
ChosenOnPage = Annotated[Choice, Depends(chosen_on_page)]


def check_order(start: datetime | None, end: datetime | None) -> None:
    """Raises `Invalid` when from … to runs backwards."""
    if start is not None and end is not None and start > end:
        message = _("{start} is later than `to` {end}").format(start=start.isoformat(), end=end.isoformat())
        raise Invalid(
            _("`from` {message}.").format(message=message),
            _("Exchange the two moments."),
            errors=[FieldError("from", message)],
        )
