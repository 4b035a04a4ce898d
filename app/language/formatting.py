"""Numbers, lengths and times written as people read them; numbers that people type are read in `app.core.number_text`.

The minus sign is a minus sign (U+2212); a sign of a deviation is always shown.
Lengths come in mm. Deviations, limits and corrections are read in µm, sizes in the drawing's mm.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from functools import cache
from math import isclose
from zoneinfo import ZoneInfo

from babel.dates import get_month_names
from markupsafe import Markup, escape

from app.language.i18n import _, current_language
from app.language.times import is_twice, local, offset, plant_zone

MINUS = "\N{MINUS SIGN}"
PLUS_MINUS = "\N{PLUS-MINUS SIGN}"
NO_BREAK_SPACE = "\N{NO-BREAK SPACE}"
MOST_MORE = 7
LEVELS = (0.005, 0.01, 0.05, 0.25)
"""Levels of significance in use: normal or not, one in a hundred, one in twenty, an interaction that is pooled (AIAG)."""
NOTHING = "\N{EN DASH}"


def signed(value: float | None, decimals: int = 1) -> str:
    """A number with its sign, zero too: `+0.0`.

    >>> signed(-6.14), signed(-0.01), signed(None)
    ('−6.1', '+0.0', '–')
    """
    if value is None:
        return NOTHING
    rounded = round(value, decimals)
    return f"{MINUS if rounded < 0 else '+'}{abs(rounded):.{decimals}f}"


def fixed(value: float | None, decimals: int) -> str:
    """A number with N decimals, and a sign only where it is negative.

    >>> fixed(-6.096, 2), fixed(-0.0001, 2), fixed(None, 2)
    ('−6.10', '0.00', '–')
    """
    if value is None:
        return NOTHING
    return f"{MINUS if round(value, decimals) < 0 else ''}{abs(value):.{decimals}f}"


def decimals_beside(value: float, decimals: int, *limits: float) -> int:
    """The number of decimals with which the rounded value lies on the same side of each limit as the value: as few as can be, seven more at most."""
    for more in range(decimals, decimals + MOST_MORE):
        rounded = round(value, more)
        if all((rounded > limit) - (rounded < limit) == (value > limit) - (value < limit) for limit in limits):
            return more
    return decimals if any(isclose(value, limit, abs_tol=1e-9) for limit in limits) else decimals + MOST_MORE


def beside(value: float | None, decimals: int, *limits: float) -> str:
    """A number that is read beside limits, never rounded across one: with more decimals where it lies close to it.

    >>> beside(9.96, 1, 10.0), beside(9.94, 1, 10.0), beside(1.329, 2, 1.33), beside(1.33, 2, 1.33), beside(None, 2)
    ('9.96', '9.9', '1.329', '1.33', '–')
    """
    return fixed(value, decimals if value is None else decimals_beside(value, decimals, *limits))


def probability(p: float, equal: str = "") -> str:
    """A p-value as one reads it, never rounded across a level at which something is decided.

    >>> probability(0.0004), probability(0.974), probability(0.974, "= "), probability(0.04996)
    ('< 0.001', '0.974', '= 0.974', '0.04996')
    """
    return "< 0.001" if p < 0.001 else f"{equal}{beside(p, 3, *LEVELS)}"


def short(value: float | None, digits: int = 6) -> str:
    """A number with no more digits than it needs.

    >>> short(5.30), short(-400.0), short(None)
    ('5.3', '−400', '–')
    """
    if value is None:
        return NOTHING
    return f"{MINUS if value < 0 else ''}{abs(value):.{digits}g}"


def deserved(half_mm: float, deviation_mm: float | None = None) -> int:
    """Decimals that a deviation in µm deserves, read from two metres: a tolerance of some µm more, one of a tenth of a mm none.

    half_mm: distance from the target to the tolerance limits; a deviation close to one is never rounded across it.

    >>> deserved(0.002), deserved(0.008), deserved(0.1), deserved(0.1, 0.1004)
    (2, 1, 0, 1)
    """
    usual = 2 if half_mm < 0.0025 else 1 if half_mm < 0.1 else 0
    if deviation_mm is None:
        return usual
    limit = round(half_mm * 1000, 6)
    return decimals_beside(round(deviation_mm * 1000, 6), usual, limit, -limit)


def um(deviation_mm: float | None, decimals: int = 1) -> str:
    r"""A deviation in µm with its sign.

    >>> um(0.0061), um(-0.3, 0), um(None)
    ('+6.1\xa0µm', '−300\xa0µm', '–')
    """
    return NOTHING if deviation_mm is None else f"{in_um(deviation_mm, decimals)}{NO_BREAK_SPACE}µm"


def read_um(deviation_mm: float | None, half_mm: float | None) -> str:
    r"""A deviation in µm with the decimals that its tolerance deserves; one where the tolerance is not known.

    half_mm: as of `deserved`; what is not zero has a decimal rather than be read as zero.

    >>> read_um(-0.406575, 0.3), read_um(0.0061, 0.008), read_um(0.0004, 0.3), read_um(0.0061, None)
    ('−407\xa0µm', '+6.1\xa0µm', '+0.4\xa0µm', '+6.1\xa0µm')
    """
    return NOTHING if deviation_mm is None else f"{read_in_um(deviation_mm, half_mm)}{NO_BREAK_SPACE}µm"


def read_in_um(deviation_mm: float | None, half_mm: float | None) -> str:
    """The same without its unit."""
    if deviation_mm is None or half_mm is None:
        return in_um(deviation_mm)
    decimals = deserved(half_mm, deviation_mm)
    reads_as_zero = round(deviation_mm * 1000, decimals) == 0 < abs(deviation_mm)
    return in_um(deviation_mm, max(decimals, 1) if reads_as_zero else decimals)


def in_um(deviation_mm: float | None, decimals: int = 1) -> str:
    """The same without its unit, which the head of a column names."""
    return signed(None if deviation_mm is None else deviation_mm * 1000, decimals)


def plain_um(length_mm: float | None, decimals: int = 1) -> str:
    r"""A length in µm that has no sign: a scatter, a width.

    >>> plain_um(0.0134), plain_um(None)
    ('13.4\xa0µm', '–')
    """
    return NOTHING if length_mm is None else f"{fixed(length_mm * 1000, decimals)}{NO_BREAK_SPACE}µm"


def um_limit(limit_mm: float, sign: str = PLUS_MINUS, digits: int = 6) -> str:
    r"""A limit in µm, both sides at once and no more digits than it needs, in mm from 1 mm on.

    >>> um_limit(0.0053), um_limit(0.3), um_limit(1.0)
    ('±5.3\xa0µm', '±300\xa0µm', '±1\xa0mm')
    """
    if limit_mm >= 1:
        return f"{sign}{limit_mm:.{digits}g}{NO_BREAK_SPACE}mm"
    return f"{sign}{limit_mm * 1000:.{digits}g}{NO_BREAK_SPACE}µm"


def tolerance_um(half_mm: float, natural: str | None = None) -> str:
    r"""A tolerance about its target: both limits at once, or the one that is judged where the target is a natural limit.

    >>> tolerance_um(0.008), tolerance_um(0.0127, "lower"), tolerance_um(0.1, "upper")
    ('±8\xa0µm', '+12.7\xa0µm', '−100\xa0µm')
    """
    return um_limit(half_mm, {"lower": "+", "upper": MINUS}.get(natural or "", PLUS_MINUS))


def mm(size_mm: float | None, decimals: int = 4) -> str:
    r"""A size in mm.

    >>> mm(39.9981)
    '39.9981\xa0mm'
    """
    return NOTHING if size_mm is None else f"{fixed(size_mm, decimals)}{NO_BREAK_SPACE}mm"


def signed_mm(length_mm: float | None) -> str:
    r"""An offset in mm, or a deviation beside one, with its sign.

    >>> signed_mm(0.012), signed_mm(None)
    ('+0.0120\xa0mm', '–')
    """
    return NOTHING if length_mm is None else f"{signed(length_mm, 4)}{NO_BREAK_SPACE}mm"


def grouped(number: float, decimals: int = 0) -> str:
    """A count, or money, as people read it.

    >>> grouped(9287), grouped(-12), grouped(1234.5, 2)
    ('9\u202f287', '−12', '1\u202f234.50')
    """
    return f"{number:,.{decimals}f}".replace(",", "\N{NARROW NO-BREAK SPACE}").replace("-", MINUS)


def signed_grouped(number: float | None, decimals: int = 0) -> str:
    """The same with its sign: a balance.

    >>> signed_grouped(2614), signed_grouped(-0.5), signed_grouped(None)
    ('+2\u202f614', '+0', '–')
    """
    if number is None:
        return NOTHING
    rounded = round(number, decimals) + 0.0
    return f"{'+' if rounded >= 0 else ''}{grouped(rounded, decimals)}"


def percent(share: float | None, decimals: int = 0) -> str:
    r"""A share of 1 in per cent; what is less than all is not rounded to 100, nor what is more than nothing to 0.

    >>> percent(0.956), percent(0.0314, 1), percent(0.9996), percent(0.0004, 1)
    ('96\xa0%', '3.1\xa0%', '99\xa0%', '<0.1\xa0%')
    """
    return NOTHING if share is None else f"{in_percent(share, decimals)}{NO_BREAK_SPACE}%"


def in_percent(share: float, decimals: int = 0) -> str:
    """The same without its unit."""
    step = 10.0**-decimals
    if 0 < share < 1:
        if round(share * 100, decimals) == 0:
            return f"<{fixed(step, decimals)}"
        share = min(share, 1 - step / 100)
    return fixed(share * 100, decimals)


def as_typed(value: float | None, decimals: int = 9) -> str:
    """A number as one would type it into a field.

    >>> as_typed(0.00530), as_typed(199.852), as_typed(2.0), as_typed(None)
    ('0.0053', '199.852', '2', '')
    """
    return "" if value is None else f"{value:.{decimals}f}".rstrip("0").rstrip(".")


def typed_length(length_mm: float) -> str:
    """A length as one would type it, with at least four decimals and none hidden.

    >>> typed_length(0.009), typed_length(0.0053333)
    ('0.0090', '0.0053333')
    """
    return f"{length_mm:.9f}".rstrip("0").ljust(len(f"{length_mm:.4f}"), "0")


def as_read(moment: datetime, style: str = "seconds", zone: ZoneInfo | None = None) -> str:
    """A moment in this time zone, else that of the plant, as people read it. Style: `seconds`, `minutes`, `date` or `time`.

    >>> as_read(datetime(2026, 11, 9, 15, 50, 28, tzinfo=UTC), zone=ZoneInfo("Europe/Berlin"))
    '9 Nov 2026 16:50:28'
    """
    there = moment.astimezone(zone) if zone else local(moment)
    clock = f"{there:%H:%M:%S}" if style == "seconds" else f"{there:%H:%M}"
    if style != "time":
        day = f"{there.day} {_months(current_language())[there.month]} {there.year}"
    text = clock if style == "time" else day if style == "date" else f"{day} {clock}"
    return f"{text} {offset(there)}" if style != "date" and is_twice(there) else text


@cache
def _months(language: str) -> Mapping[int, str]:
    return get_month_names("abbreviated", locale=language)


def when(moment: datetime | None, style: str = "seconds") -> Markup:
    """The same on a page, where the zone is said when it is pointed at."""
    if moment is None:
        return Markup("–")
    there = local(moment)
    title = f"{plant_zone().key}, {offset(there)}"
    return Markup('<time datetime="{}" title="{}">{}</time>').format(there.isoformat(), title, as_read(moment, style))


def age(seconds: float) -> str:
    """An age as one reads it from two metres away: one unit, no more; times.js says it with the same symbols.

    >>> age(12), age(200), age(90_000)
    ('12 s', '3 min', '25 h')
    """
    whole = max(0, int(seconds))
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min"
    if whole < 2 * 86400:
        return f"{whole // 3600} h"
    return f"{whole // 86400} d"


def ago(moment: datetime | None, now: datetime | None = None) -> Markup:
    """Time since a moment; the browser keeps it up to date (times.js)."""
    if moment is None:
        return Markup("–")
    seconds = ((now or datetime.now(UTC)) - moment).total_seconds()
    return Markup('<time-ago datetime="{}">{}</time-ago>').format(
        moment.astimezone(UTC).isoformat(), escape(_("{age} ago").format(age=age(seconds)))
    )
