"""Times in AQDEF files (K0004): more than thirty spellings of wall-clock times without a zone, and the hour that is there twice."""

import re
from datetime import UTC, datetime, timedelta, timezone
from functools import lru_cache
from typing import cast
from zoneinfo import ZoneInfo

from app.files.formats.cell_values import DayOrder, Unreadable, at_hour, never_was
from app.files.formats.file_times import DEFAULTS, is_zeros
from app.language.i18n import _

_DATE = re.compile(
    r"(\d{1,4})([./-])(\d{1,2})\2(\d{1,4})\.?"
    r"(?:[/ .T]\s*(\d{1,2}):(\d{1,2})(?::(\d{1,2})(?:[.,](\d{1,9}))?)?(?:\s*([AaPp])\.?[Mm]\.?)?"
    r"\s*([Zz]|[+-]\d{2}:?\d{2})?)?/?",
    re.ASCII,
)
_CENTURY = 70  # two digits from here on are of the last century
_YEARS = range(1900, 2200)
_MONTHS = 12


@lru_cache(maxsize=4096)
def time_of(text: str, order: DayOrder | None = None) -> datetime:
    """The time that a text names; without a zone unless it names its offset. Raises `Unreadable`.

    Dots part day, month and year; strokes month, day and year (`order` says otherwise); hyphens year, month and day. Whichever
    of them has four digits at one end is the year there. Two digits are a year from 1970 to 2069.

    >>> time_of("12.08.1999/15:23:45").isoformat(), time_of("8/12/99 3:23 PM").isoformat()
    ('1999-08-12T15:23:45', '1999-08-12T15:23:00')
    >>> time_of("26-11-23.6:05").isoformat(), time_of("2026-11-23T06:05:00.5+01:00").isoformat()
    ('2026-11-23T06:05:00', '2026-11-23T06:05:00.500000+01:00')
    """
    if is_zeros(text):
        return datetime.min  # noqa: DTZ901 - a day of `DEFAULTS`: no time
    match = _DATE.fullmatch(text.strip())
    if match is None:
        raise Unreadable(_("is not a time; AQDEF writes it as 23.11.2026/06:05:00"))
    first, sign, second, third, hour, minute, seconds, fraction, half, offset = match.groups()
    year, month, day = _in_order(first, sign, second, third, order)
    hours = int(hour or 0)
    if half:
        hours = hours % 12 + (12 if half in "pP" else 0)
    try:
        at = at_hour(year, month, day, hours, int(minute or 0), int(seconds or 0), fraction)
    except (ValueError, OverflowError) as error:
        raise Unreadable(_("is not a time: {error}").format(error=error)) from None
    if year not in _YEARS and at.date() not in DEFAULTS:
        raise Unreadable(_("is not a time: nothing was measured in the year {year}").format(year=year))
    return at.replace(tzinfo=_zone(offset))


def _in_order(first: str, sign: str, second: str, third: str, order: DayOrder | None) -> tuple[int, int, int]:
    """Year, month, day."""
    if len(first) > 2 or (sign == "-" and len(third) <= 2):
        return _year(first), int(second), int(third)
    if sign == "/" and order != "day_first" and (order or int(first) <= _MONTHS):
        return _year(third), int(first), int(second)
    return _year(third), int(second), int(first)


def _year(text: str) -> int:
    year = int(text)
    if len(text) > 2:
        return year
    return year + (1900 if year >= _CENTURY else 2000)


def _zone(offset: str | None) -> timezone | None:
    if not offset:
        return None
    if offset in "Zz":
        return UTC
    minutes = int(offset[1:3]) * 60 + int(offset[-2:])
    return timezone(timedelta(minutes=-minutes if offset[0] == "-" else minutes))


def day_order(day_first: bool | None) -> DayOrder | None:
    """The order that a person says."""
    return None if day_first is None else "day_first" if day_first else "month_first"


class WallClock:
    """The moments of wall-clock times in the order of a file.

    When clocks go back an hour is there twice: a time of it that would lie before the one above it is of the second time;
    `twice` counts those of that hour. A time that clocks leave out is refused.
    """

    def __init__(self, zone: ZoneInfo) -> None:
        self._zone = zone
        self._last: datetime | None = None
        self.twice = 0

    def moment(self, local: datetime) -> datetime:
        """The moment with its offset, of a time with or without one. Raises `Unreadable`."""
        at = local if local.tzinfo is not None else self._in_zone(local)
        try:
            self._last = at.astimezone(UTC)
        except OverflowError:
            raise Unreadable(_("lies outside the years 1 to 9999")) from None
        return at

    def _in_zone(self, local: datetime) -> datetime:
        first, second = local.replace(tzinfo=self._zone, fold=0), local.replace(tzinfo=self._zone, fold=1)
        chosen = first
        try:
            if first.astimezone(UTC).astimezone(self._zone).replace(tzinfo=None) != local:
                raise Unreadable(never_was(self._zone))
        except OverflowError:
            raise Unreadable(_("lies outside the years 1 to 9999")) from None
        self.twice += first.utcoffset() != second.utcoffset()
        if first.utcoffset() != second.utcoffset() and self._last is not None:
            early, late = first.astimezone(UTC), second.astimezone(UTC)
            if early < self._last <= late:
                chosen = second
        return local.replace(tzinfo=timezone(cast("timedelta", chosen.utcoffset())))
