"""Choice of readings: by number, by time, or the last ones; the same fields in every API and page.

What a period means is in `app.core.period`, how it is written in `app.files.formats.periods`.
"""

from contextlib import suppress
from functools import partial
from typing import Annotated, Any, NamedTuple, Self
from zoneinfo import ZoneInfo

from fastapi import Depends, Query, Request
from pydantic import BeforeValidator, Field, ModelWrapValidatorHandler, WithJsonSchema, model_validator
from pydantic_core import PydanticCustomError

from app.core.context import Chosen as ChosenContext
from app.core.context import ContextField
from app.core.period import ALWAYS, Period
from app.errors import FieldError, Invalid
from app.files.formats import cell_values, periods
from app.language.i18n import _
from app.language.times import plant_zone
from app.web.fields import LARGEST_ID, Body, Moment


class Choice(NamedTuple):
    """Chosen readings; `period`: of them those measured in it. context: only of those with these values in their context."""

    last: int | None = None
    first: int | None = None
    through: int | None = None
    period: Period = ALWAYS
    context: ChosenContext = ()

    @property
    def everything(self) -> bool:
        return self._replace(context=()) == Choice()

    @property
    def query(self) -> dict[str, Any]:
        """The choice as an address says it."""
        return self.of_range | self.of_context

    @property
    def of_range(self) -> dict[str, Any]:
        """The choice but for the context, as an address says it."""
        if self.everything:
            return {"last": "all"}
        named = {"last": self.last, "first": self.first, "through": self.through, **in_address(self.period)}
        return {name: value for name, value in named.items() if value is not None}

    @property
    def of_context(self) -> dict[str, str]:
        """The context alone, as an address says it."""
        return context_in_address(self.context)


def _day(value: Any, *, end: bool) -> Any:
    """A day that is written as one; a moment is left as it is."""
    day = cell_values.day(value) if isinstance(value, str) else None
    try:
        return value if day is None else periods.begin_of(day, plant_zone(), 1 if end else 0)
    except cell_values.Unreadable as error:
        raise PydanticCustomError("moment", str(error)) from None


_WRITTEN = WithJsonSchema({"anyOf": [{"type": "string", "format": name} for name in ("date-time", "date")]})
Beginning = Annotated[Moment, BeforeValidator(partial(_day, end=False)), _WRITTEN]
"""Where a period begins: a moment with its offset, or a day of the plant."""
Ending = Annotated[Moment, BeforeValidator(partial(_day, end=True)), _WRITTEN]
"""Where a period ends: before a moment with its offset, or with a day of the plant, itself included."""
BEGINNING = "From this moment on, with its offset; a day such as 2026-03-05 begins at midnight by the plant's clock."
ENDING = "Before this moment, which does not belong to the period itself; a day such as 2026-03-05 does, all of it."


class PeriodBody(Body):
    """A period in a body. Raises `Invalid` for one that runs backwards."""

    start: Beginning | None = Field(default=None, alias="from", description=BEGINNING)
    end: Ending | None = Field(default=None, alias="to", description=ENDING)

    @classmethod
    def zone(cls, _body: dict[str, Any]) -> ZoneInfo:
        """The time zone of the days of a body: the plant's."""
        return plant_zone()

    @model_validator(mode="wrap")
    @classmethod
    def _in_order(cls, body: Any, made_of: ModelWrapValidatorHandler[Self]) -> Self:
        if not isinstance(body, dict):
            return made_of(body)
        said = {name: body[name] for name in periods.NAMES if isinstance(body.get(name), str)}
        days = {name: day for name, text in said.items() if (day := cell_values.day(text)) is not None}
        with suppress(cell_values.Unreadable):  # beyond the calendar, which its field says
            body |= {name: periods.begin_of(day, cls.zone(body), int(name == "to")) for name, day in days.items()}
        made = made_of(body)
        if made.start is not None and made.start == made.end and "to" in days:
            raise periods.backwards(said["from"], said["to"])  # the day after that day
        periods.in_order(made.period)
        return made

    @property
    def period(self) -> Period:
        return Period(self.start, self.end)


def period_in_query(
    request: Request,
    start: Annotated[Beginning | None, Query(alias="from", description=BEGINNING, examples=[None])] = None,
    end: Annotated[Ending | None, Query(alias="to", description=ENDING, examples=[None])] = None,
) -> Period:
    """The period that a program asks for."""
    said = request.query_params
    if start is not None and start == end and cell_values.day(said["to"]) is not None:
        raise periods.backwards(said["from"], said["to"])  # the day after that day
    return periods.in_order(Period(start, end))


InPeriod = Annotated[Period, Depends(period_in_query)]


def period_on_page(
    start: Annotated[str, Query(alias="from", max_length=64)] = "",
    end: Annotated[str, Query(alias="to", max_length=64)] = "",
) -> Period:
    """The same in the address of a page: a moment without an offset is one of the plant's clock."""
    return periods.period_of({"from": start, "to": end})


Last = Annotated[str | None, Query(pattern=r"^([1-9][0-9]{0,17}|all)$", description="The last N readings, or `all`.")]
First = Annotated[int | None, Query(ge=1, le=LARGEST_ID, description="From this reading on.")]
Through = Annotated[int | None, Query(ge=1, le=LARGEST_ID, description="To this reading, itself included.")]


def _of(field: ContextField) -> Any:
    pattern = r"^[0-9]{0,6}$" if field is ContextField.NEST else r"^[^\x00-\x1f\x7f]{0,128}$"
    words = f"Only readings with this {field.value} in their context."
    return Query(alias=f"context.{field.value}", pattern=pattern, description=words, examples=[None])


def context_in_query(
    order: Annotated[str | None, _of(ContextField.ORDER)] = None,
    batch: Annotated[str | None, _of(ContextField.BATCH)] = None,
    nest: Annotated[str | None, _of(ContextField.NEST)] = None,
    spindle: Annotated[str | None, _of(ContextField.SPINDLE)] = None,
    fixture: Annotated[str | None, _of(ContextField.FIXTURE)] = None,
    operator: Annotated[str | None, _of(ContextField.OPERATOR)] = None,
    program: Annotated[str | None, _of(ContextField.PROGRAM)] = None,
    gauge: Annotated[str | None, _of(ContextField.GAUGE)] = None,
) -> ChosenContext:
    """The context that is asked for; an empty field of a form asks for nothing."""
    given = (order, batch, nest, spindle, fixture, operator, program, gauge)
    return tuple((field, value) for field, value in zip(ContextField, given, strict=True) if value and value.strip())


InContext = Annotated[ChosenContext, Depends(context_in_query)]


def context_in_address(context: ChosenContext) -> dict[str, str]:
    """The context as an address says it."""
    return {f"context.{field.value}": value for field, value in context}


def _choice(last: str | None, first: int | None, through: int | None, period: Period, context: ChosenContext) -> Choice:
    if first is not None and through is not None and first > through:
        message = _("is beyond the end of the range; exchange the two")
        raise Invalid(
            f"first: {message}",
            _("Correct the named fields and send it again."),
            errors=[FieldError("first", message)],
        )
    if last is None and first is None and through is None and not period.bounded:
        return Choice(200, context=context)
    return Choice(None if last in (None, "all") else int(last), first, through, period, context)


def chosen(
    period: InPeriod, context: InContext, last: Last = None, first: First = None, through: Through = None
) -> Choice:
    """The readings by number, by time, or the last ones; the last 200 if nothing is said."""
    return _choice(last, first, through, period, context)


def chosen_on_page(
    period: Annotated[Period, Depends(period_on_page)],
    context: InContext,
    last: Last = None,
    first: First = None,
    through: Through = None,
) -> Choice:
    """The same in the address of a page."""
    return _choice(last, first, through, period, context)


Chosen = Annotated[Choice, Depends(chosen)]
ChosenOnPage = Annotated[Choice, Depends(chosen_on_page)]


def in_address(period: Period) -> dict[str, str | None]:
    """The period as an address says it."""
    return {
        "from": period.start.isoformat() if period.start else None,
        "to": period.end.isoformat() if period.end else None,
    }
