"""Periods as people and programs write them, the same at every door: in an address, a form, a command, JSON.

A day written as a day is that whole day by the clock of the plant (or of the zone that is named), wherever it is: as the end it
is included. A moment is that moment: readings at the end itself belong to the next period. A moment that the clock shows
twice is the earlier one where a period begins, and the later one where it ends.
"""

from collections.abc import Mapping
from datetime import UTC, date, datetime, time, timedelta, timezone
from typing import cast
from zoneinfo import ZoneInfo

from app.core.period import Period
from app.errors import FieldError, Invalid
from app.files.formats import cell_values
from app.language.i18n import _
from app.language.times import plant_zone

NAMES = ("from", "to")


def begin_of(day: date, zone: ZoneInfo, days: int = 0) -> datetime:
    """The first moment of the day, or of the one N days later. Raises `Unreadable` beyond the calendar."""
    try:
        at = datetime.combine(day + timedelta(days), time(), zone)
        # By way of UTC: where the clocks go forward at midnight, the day begins at one o'clock.
        there = at.astimezone(UTC).astimezone(zone)
    except OverflowError:
        raise cell_values.Unreadable(_("lies outside the years 1 to 9999")) from None
    return there.astimezone(timezone(cast("timedelta", there.utcoffset())))


def bound(text: str, zone: ZoneInfo, *, end: bool) -> datetime | None:
    """The moment at which a period begins or ends; None where nothing is written. Raises `Unreadable`.

    >>> bound("2026-03-05", ZoneInfo("Europe/Belgrade"), end=True).isoformat()
    '2026-03-06T00:00:00+01:00'
    """
    if not text.strip():
        return None
    if (day := cell_values.day(text)) is not None:
        return begin_of(day, zone, 1 if end else 0)
    return cell_values.moment(text, zone, fold=1 if end else 0)


def period_of(fields: Mapping[str, str], zone: ZoneInfo | None = None) -> Period:
    """The period that `from` and `to` of these fields name; without a zone in the plant's. Raises `Invalid` by field."""
    bounds: dict[str, datetime | None] = {}
    errors: list[FieldError] = []
    for name in NAMES:
        try:
            bounds[name] = bound(fields.get(name, ""), zone or plant_zone(), end=name == "to")
        except cell_values.Unreadable as error:
            errors.append(FieldError(name, str(error)))
    if errors:
        raise Invalid.of(errors, _("Correct the named fields and send it again."))
    period = Period(bounds["from"], bounds["to"])
    if period.bounded and period.start == period.end and cell_values.day(fields["to"]) is not None:
        raise backwards(fields["from"], fields["to"])  # the day after that day
    return in_order(period)


def in_order(period: Period) -> Period:
    """The period. Raises `Invalid` for one that runs backwards."""
    if period.backwards:
        assert period.start is not None
        assert period.end is not None
        raise backwards(period.start.isoformat(), period.end.isoformat())
    return period


def backwards(start: str, end: str) -> Invalid:
    """The refusal of a period that is written so."""
    message = _("{start} is later than `to` {end}; exchange the two").format(start=start, end=end)
    return Invalid.at("from", message, do=_("Exchange the two moments."))
