"""Numbers and times as people's files hold them; what cannot be read is refused in words, never guessed."""

import re
import unicodedata
from datetime import UTC, date, datetime, timedelta, timezone
from enum import Enum
from functools import lru_cache
from typing import Literal, cast
from zoneinfo import ZoneInfo, available_timezones

from app.core.number_text import NotANumber, NumberFault, plain, read_number
from app.language.i18n import _

_DAY_FIRST = re.compile(
    r"(\d{1,2})\.\s*(\d{1,2})\.\s*(\d{4})\.?(?:[\s,T]+(\d{1,2}):(\d{2})(?::(\d{2})(?:[.,](\d{1,6})\d*)?)?)?"
)
_ISO = re.compile(
    r"\d{4}-\d{2}-\d{2}(?:[T ]\d{2}:\d{2}(?::\d{2}(?:[.,]\d{1,9})?)?)?(?:\s?(?:[Zz]|[+-]\d{2}(?::?\d{2})?))?"
)
_STROKES = re.compile(
    r"(\d{1,2})/(\d{1,2})/(\d{4})"
    r"(?:[\s,T]+(\d{1,2}):(\d{2})(?::(\d{2})(?:[.,](\d{1,6})\d*)?)?(?:\s*([AaPp])\.?[Mm]\.?)?)?"
)
_CLOCK = r"(?:[\s,T]+(?P<h>\d{1,2}):(?P<min>\d{2})(?::(?P<s>\d{2})(?:[.,](?P<f>\d{1,6})\d*)?)?(?:\s*(?P<half>[AaPp])\.?[Mm]\.?)?)?"
_ONE_WAY = tuple(
    re.compile(day + clock)
    for day, clock in (
        (r"(?P<y>\d{4})([/.])\s?(?P<m>\d{1,2})\2\s?(?P<d>\d{1,2})\.?", _CLOCK),
        (
            r"(?:[^\W\d_]{2,10}\.?,?\s+)?(?P<d>\d{1,2})\.?[\s-]{0,2}(?P<m>[^\W\d_]{3,9})\.?,?[\s-]{0,2}(?P<y>\d{4})",
            _CLOCK,
        ),
        (r"(?:[^\W\d_]{2,10}\.?,?\s+)?(?P<m>[^\W\d_]{3,9})\.?\s+(?P<d>\d{1,2}),?\s+(?P<y>\d{4})", _CLOCK),
        (
            r"(?P<y>(?:19|20)\d{2})(?P<m>\d{2})(?P<d>\d{2})",  # as milliseconds it would be after the year 2600
            r"[T_ ]?(?P<h>\d{2})(?P<min>\d{2})(?P<s>\d{2})(?:[.,](?P<f>\d{1,6})\d*)?(?P<half>)",
        ),
    )
)
"""Dates that can be read in one way only: the year first, or the month by its name."""
_MONTH_NAMES = (
    "jan",
    "feb",
    "mar mrz",
    "apr",
    "may mai maj",
    "jun",
    "jul",
    "aug avg",
    "sep",
    "oct okt",
    "nov",
    "dec dez dek",
)
_OFFSET = re.compile(r"(.*:\d{2}(?:[.,]\d+)?)\s?([Zz]|[+-]\d{2}(?::?\d{2})?)")
_STROKED_DATE = re.compile(r"(\d{1,2})/(\d{1,2})/\d{2,4}(?!\d)", re.ASCII)
_TWENTY_FOUR = re.compile(r"(?<=[T ])24(?=:00(?::00(?:[.,]0+)?)?(?:\s?(?:[Zz]|[+-]\d{2}(?::?\d{2})?))?$)")
_COUNT = re.compile(
    r"(days|seconds|milliseconds) since (1899-12-30|1904-01-01|1970-01-01)"
)  # spreadsheets, old ones of the Mac, Unix
_UNITS = {
    "days": timedelta(days=1),
    "seconds": timedelta(seconds=1),
    "milliseconds": timedelta(milliseconds=1),
}
_MONTHS, _HOURS = 12, 24
_DIGITS_OF_MILLISECONDS = 12  # before the decimal sign: of seconds it would be after the year 5138
DayOrder = Literal["month_first", "day_first"]
"""Which of the two comes first in dates with strokes."""


class Slashed(Enum):
    """The readings that a date with strokes allows."""

    MONTH_FIRST = 1
    DAY_FIRST = 2
    EITHER = 3
    SAME = 4  # whichever comes first


@lru_cache(maxsize=4096)
def slashed(text: str) -> Slashed | None:
    """The readings that a date allows; None where it has no strokes, or begins with the year.

    >>> slashed("3/14/2026 7:08"), slashed("3/4/2026 7:08"), slashed("3.4.2026/7:08")
    (<Slashed.MONTH_FIRST: 1>, <Slashed.EITHER: 3>, None)
    """
    match = _STROKED_DATE.match(text.lstrip())
    if match is None:
        return None
    first, second = int(match[1]), int(match[2])
    if first > _MONTHS:
        return Slashed.DAY_FIRST
    if second > _MONTHS:
        return Slashed.MONTH_FIRST
    return Slashed.SAME if first == second else Slashed.EITHER


_OPENING, _CLOSING = re.compile(r"[\[(<]"), re.compile(r"[\])>]")
LONGEST_NAME = (
    1_000  # characters that are compared: Unicode sorts the accents of a letter in the square of their number
)


class Unreadable(ValueError):
    """A cell that is not what its column should hold; the message says why, and what to do."""


def number(text: str, decimal: str) -> float:
    """A finite number written with this decimal sign ("." or ",").

    >>> number("39,998", ","), number(" -0.5e-3 ", ".")
    (39.998, -0.0005)
    """
    try:
        return read_number(text, decimal)
    except NotANumber as error:
        raise Unreadable(no_number(error.fault, decimal)) from None


def same_number(one: str, other: str) -> bool:
    """Tell if two cells are alike, or hold the same number.

    >>> same_number("40", "40,000"), same_number("X", "X"), same_number("40", "X")
    (True, True, False)
    """
    if one == other:
        return True
    try:
        return read_number(one) == read_number(other)
    except NotANumber:
        return False


def no_number(fault: NumberFault, decimal: str) -> str:
    """Explain why a cell is not a number, and what to do."""
    other = "." if decimal == "," else ","
    return {
        NumberFault.EMPTY: _("is empty; remove the line if the probe measured nothing"),
        NumberFault.DECIMAL: _(
            "has a {other}, but decimals are read with a {decimal}; say so if all are written with a {other}"
        ).format(other=_sign(other), decimal=_sign(decimal)),
        NumberFault.THOUSANDS: _(
            "has separators of thousands, or a point and a comma; write it without a separator of thousands"
        ),
        NumberFault.BLANK: _("has a blank inside; write it without, what was there is unknown"),
        NumberFault.TOO_LARGE: _("is too large to be a number of this world"),
        NumberFault.BRACKETS: _(
            "is in brackets: a reference dimension, or a size below 0 as accountants write it? Write it without brackets and "
            "with its sign, or remove the line"
        ),
        NumberFault.BOUND: _(
            "is a bound, no size: it is beyond what the gauge shows; remove the line, or name it as a mark of a missing value "
            "(--missing, in a bridge missing)"
        ),
        NumberFault.NOT_A_NUMBER: _("is not a number; write it like 39{decimal}9981, without a unit").format(
            decimal=decimal
        ),
    }[fault]


def _sign(character: str) -> str:
    return _("comma") if character == "," else _("point")


def moment(
    text: str,
    zone: ZoneInfo | None,
    pattern: str | None = None,
    *,
    fold: Literal[0, 1] | None = None,
    order: DayOrder | None = None,
) -> datetime:
    """A time with its offset: ISO 8601, day.month.year, or as `pattern` (strptime) says. order: of dates with strokes.

    A time that names no offset is one of `zone`; without a zone it is refused, because an hour more or less would put
    readings in another order. So is a time that is there twice because the clocks went back, unless `fold` says which is
    meant: 0 the earlier, where a period begins; 1 the later, where it ends.

    >>> moment("21.11.2026 08:15:02", ZoneInfo("Europe/Belgrade")).isoformat()
    '2026-11-21T08:15:02+01:00'
    """
    read = naive(text, pattern, order)
    if read.tzinfo is not None:
        return read
    if zone is None:
        raise Unreadable(_("does not say in which time zone; name the time zone, such as Europe/Belgrade"))
    local = read.replace(tzinfo=zone, fold=fold or 0)
    try:
        there = local.astimezone(UTC).astimezone(zone).replace(tzinfo=None)
    except OverflowError:  # the first and the last day that a calendar knows
        raise Unreadable(_("lies outside the years 1 to 9999")) from None
    if there != read:
        raise Unreadable(never_was(zone))
    if fold is None and local.utcoffset() != local.replace(fold=1).utcoffset():
        raise Unreadable(
            _(
                "is there twice in {zone}: the clocks went back in that hour; write it with its offset: {first} or {second}"
            ).format(zone=zone.key, first=local.isoformat(), second=local.replace(fold=1).isoformat())
        )
    # With its offset, not with the zone: moments of one zone are compared by their wall clocks, whatever the offsets are.
    return local.astimezone(timezone(cast("timedelta", local.utcoffset())))


def never_was(zone: ZoneInfo) -> str:
    """The reason against a time that the clocks of a zone left out, and what to do."""
    return _(
        "does not exist in {zone}: the clocks went forward in that hour. If the machine's clock was not put forward, name the "
        "zone that it shows, such as Etc/GMT-1 for an hour ahead of UTC all year"
    ).format(zone=zone.key)


def naive(text: str, pattern: str | None = None, order: DayOrder | None = None) -> datetime:
    """A time as it is written, without an offset unless it names one. Raises `Unreadable`.

    >>> naive("18.11.2025 24:00:00").isoformat(), naive("11/18/2025 12:06:10 AM").isoformat()
    ('2025-11-19T00:00:00', '2025-11-18T00:06:10')
    >>> [str(naive(text)) for text in ("2025/11/18 6:05", "18-Nov-2025 6:05 PM", "Tue, 18 Nov 2025 06:05", "20251118T060500")]
    ['2025-11-18 06:05:00', '2025-11-18 18:05:00', '2025-11-18 06:05:00', '2025-11-18 06:05:00']
    >>> naive("26.10.2025 02:30:00 +0100").isoformat(), str(naive("Dez. 3, 2025"))
    ('2025-10-26T02:30:00+01:00', '2025-12-03 00:00:00')
    """
    stripped = plain(text)
    if not stripped:
        raise Unreadable(_("is empty; every line needs a time, or none does"))
    return _by_pattern(stripped, pattern) if pattern else _by_shape(stripped, order)


def day(text: str) -> date | None:
    """The day, where nothing but a day is written; None otherwise.

    >>> day("2026-03-05"), day("5. 3. 2026"), day("2026-03-05 00:00")
    (datetime.date(2026, 3, 5), datetime.date(2026, 3, 5), None)
    """
    written = plain(text)
    try:
        if re.fullmatch(r"\d{4}-\d{2}-\d{2}", written):
            return date.fromisoformat(written)
        if (match := _DAY_FIRST.fullmatch(written)) and match[4] is None:
            return date(int(match[3]), int(match[2]), int(match[1]))
    except ValueError:
        pass
    return None


def _by_pattern(text: str, pattern: str) -> datetime:
    if count := _COUNT.fullmatch(pattern):
        return _counted(text, pattern, count)
    try:
        return datetime.strptime(text, pattern)  # noqa: DTZ007 - the zone is seen to by the caller
    except ValueError:
        raise Unreadable(_("does not have the form {pattern}").format(pattern=pattern)) from None


def _counted(text: str, pattern: str, count: re.Match[str]) -> datetime:
    """A time as a count of days of the calendar, or (milli)seconds of UTC, since a date."""
    try:
        milliseconds = round(float(text.replace(",", ".")) * (_UNITS[count[1]] / timedelta(milliseconds=1)))
        read = datetime.fromisoformat(count[2]) + timedelta(milliseconds=milliseconds)
    except (ValueError, OverflowError):
        raise Unreadable(_("does not have the form {pattern}").format(pattern=pattern)) from None
    return read if count[1] == "days" else read.replace(tzinfo=UTC)


def at_hour(year: int, month: int, day: int, hour: int, minute: int, second: int, fraction: str | None) -> datetime:
    """A time of the calendar; 24:00 is the midnight at the end of the day. Raises `ValueError`, `OverflowError`."""
    microsecond = int((fraction or "0")[:6].ljust(6, "0"))
    if hour == _HOURS and not minute and not second and not microsecond:
        return datetime(year, month, day) + timedelta(days=1)  # noqa: DTZ001 - the zone is seen to by the caller
    return datetime(year, month, day, hour, minute, second, microsecond)  # noqa: DTZ001 - as above


def _by_shape(text: str, order: DayOrder | None) -> datetime:
    try:
        if _ISO.fullmatch(text):
            iso = text.replace(" +", "+").replace(" -", "-").replace(" Z", "Z")
            midnight, twenty_four = _TWENTY_FOUR.subn("00", iso)
            return datetime.fromisoformat(midnight) + timedelta(days=twenty_four)
        if match := _DAY_FIRST.fullmatch(text):
            day, month, year, hour, minute, second = (int(part or 0) for part in match.groups()[:6])
            return at_hour(year, month, day, hour, minute, second, match[7])
        if match := _STROKES.fullmatch(text):
            return _with_strokes(text, match, order)
        if match := next(filter(None, (each.fullmatch(text) for each in _ONE_WAY)), None):
            return _in_one_way(match.groupdict())
        if match := _OFFSET.fullmatch(text):
            with_offset = datetime.fromisoformat(f"2000-01-01T00:00{match[2].upper()}")
            return _by_shape(match[1], order).replace(tzinfo=with_offset.tzinfo)
    except (ValueError, OverflowError) as error:
        if isinstance(error, Unreadable):
            raise
        raise Unreadable(_("is not a time: {error}").format(error=error)) from None
    if re.fullmatch(r"[0-9.,]+", text):
        if len(re.split("[.,]", text, maxsplit=1)[0]) >= _DIGITS_OF_MILLISECONDS:
            raise Unreadable(
                _("is a count of milliseconds; say from when on by a form of times: milliseconds since 1970-01-01")
            )
        raise Unreadable(
            _(
                "is a count of days or seconds and could mean several times; say which by a form of times: days since 1899-12-30 for "
                "those of spreadsheets, or seconds since 1970-01-01"
            )
        )
    words = _(
        "is not a time; write it as 2026-11-21T08:15:02+01:00 or 21.11.2026 08:15:02, or say the form of times (--time-format), "
        "such as {form}"
    )
    form = "%d.%m.%y %H:%M:%S" if _STROKED_DATE.match(text) is None else "%m/%d/%y %I:%M %p"
    raise Unreadable(words.format(form=form))


def _in_one_way(parts: dict[str, str | None]) -> datetime:
    month = parts["m"] or ""
    if not month.isdigit():
        short = folded(month)[:3]
        month = next((str(at) for at, names in enumerate(_MONTH_NAMES, 1) if short in names.split()), "0")
    hour, minute, second = (int(parts[name] or 0) for name in ("h", "min", "s"))
    hour = _of_day(hour, parts["half"])
    return at_hour(int(parts["y"] or 0), int(month), int(parts["d"] or 0), hour, minute, second, parts["f"])


def _of_day(hour: int, half: str | None) -> int:
    """The hour of the day. half: the first letter of AM or PM. Raises `Unreadable`."""
    if not half:
        return hour
    if not 1 <= hour <= _MONTHS:
        raise Unreadable(_("is not a time: there is no hour {hour} with AM or PM").format(hour=hour))
    return hour % 12 + (12 if half in "pP" else 0)


def _with_strokes(text: str, match: re.Match[str], order: DayOrder | None) -> datetime:
    readings = slashed(text)
    if readings is Slashed.EITHER and order is None:
        raise Unreadable(_("could be day/month or month/day; say which by a form of times such as %d/%m/%Y %H:%M:%S"))
    first, second, year, hour, minute, seconds = (int(part or 0) for part in match.groups()[:6])
    alone = {Slashed.DAY_FIRST: "day_first", Slashed.MONTH_FIRST: "month_first"}.get(readings or Slashed.SAME)
    if alone and order and alone != order:
        raise Unreadable(
            _("has no month {month}, and other dates of the file begin with the other of day and month").format(
                month=first if alone == "day_first" else second
            )
        )
    hour = _of_day(hour, match[8])
    month, day = (second, first) if (alone or order) == "day_first" else (first, second)
    return at_hour(year, month, day, hour, minute, seconds, match[7])


@lru_cache
def zone_named(name: str) -> ZoneInfo:
    """The time zone. Raises `Unreadable`."""
    if name not in available_timezones():
        raise Unreadable(_("There is no time zone {name}; name it like Europe/Belgrade.").format(name=repr(name)))
    return ZoneInfo(name)


def folded(text: str) -> str:
    """For comparing names: lower case, no accents, single blanks, no unit in brackets.

    >>> folded("Izmerjena  vrednost [mm]"), folded("Čas_meritve")
    ('izmerjena vrednost', 'cas meritve')
    """
    text = _without_brackets(text[:LONGEST_NAME]).replace("_", " ").replace("-", " ").replace(".", " ")
    decomposed = unicodedata.normalize("NFD", text.casefold().replace("đ", "d"))
    return " ".join("".join(c for c in decomposed if unicodedata.category(c) != "Mn").split())


def _without_brackets(text: str) -> str:
    """The text with a blank for each bracket and what is in it, up to the first sign that closes one."""
    kept, end = [], 0
    while (opened := _OPENING.search(text, end)) and (closed := _CLOSING.search(text, opened.end())):
        kept += [text[end : opened.start()], " "]
        end = closed.end()
    return "".join([*kept, text[end:]])
