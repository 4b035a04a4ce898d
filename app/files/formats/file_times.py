"""Times of a whole file: what one line leaves open, the others of the file settle; and lines that have no time.

Which comes first in dates with strokes, day or month, is said by a date that can be read one way only. An empty time among
others, or one that programs write where they have none, is no time.
"""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import date, datetime, time, timedelta
from itertools import pairwise
from types import MappingProxyType
from typing import NamedTuple
from zoneinfo import ZoneInfo

from app.core.number_text import plain
from app.files.formats.cell_values import DayOrder, Slashed, Unreadable, moment, naive, slashed
from app.language.i18n import _

DEFAULTS = frozenset(
    date(*day)
    for day in ((1, 1, 1), (1899, 12, 30), (1899, 12, 31), (1900, 1, 1), (1904, 1, 1), (1970, 1, 1), (1980, 1, 1))
)
"""Days that programs write where they have none, some of them with a time of day; clocks without a battery begin in 1980."""
MIDNIGHTS = frozenset({date(2000, 1, 1)})
"""Days of which only the midnight is one: a clock that was never set begins there."""
FAR = timedelta(days=366)
YEARS = 1900, 2200  # between them is a date that may be one; a form of times without a year says 1900
_LIKE_A_DATE = re.compile(r"\d[-./]\s?\d{1,2}[-./]|[^\W\d_]{3}|\dT\d")
"""In every text that may be a date. Of a wide sheet each cell is looked at."""
_DATE_AND_TIME = re.compile(r"\d{1,4}([-./])\s?\d{1,2}\1\s?\d{1,4}\.?[\sT,]+\d{1,2}:\d{2}")
_NUMBER = re.compile(r"\d{5,14}(?:[.,]\d+)?", re.ASCII)
_COUNTED_YEARS = 2000, 2040  # between them a count is a time
_SECONDS = 946_684_800, 2_000_000_000  # to 2033; from there on numbers of parts such as 2025111801 begin
_DAYS = 36_526, 51_136
_FEWEST_STEPS = 2
_ZEROS = re.compile(r"0{1,4}([./-])0{1,2}\1 ?0{1,4}\.?(?:[/ .,T]+0{1,2}(?::0{1,2}){1,2}(?:[.,]0+)?)?[/Zz]?")


def is_zeros(text: str) -> bool:
    """Tell of a date of nothing but zeros, as databases have it for none.

    >>> is_zeros("00.00.0000"), is_zeros("0000-00-00 00:00:00"), is_zeros("00:00:00")
    (True, True, False)
    """
    return _ZEROS.fullmatch(text.strip()) is not None


def default_of(at: datetime) -> date | None:
    """The day that a program has written for no time; None of a time that may be one."""
    day = at.date()
    return day if day in DEFAULTS or (day in MIDNIGHTS and at.time() == time()) else None


class FileTimes(NamedTuple):
    """Common properties of the times of a file. order: of day and month. dated: there are times at all.

    absent: days of programs that lie far from every time of the file, so that they mean no time. nothing: all that was looked
    at is empty, or such a day.
    """

    order: DayOrder | None = None
    dated: bool = False
    absent: frozenset[date] = frozenset()
    nothing: bool = False

    def moment(self, text: str, zone: ZoneInfo | None, pattern: str | None = None) -> datetime | None:
        """The time in a cell; None where it has none. Raises `Unreadable`."""
        if (self.dated and not text.strip()) or is_zeros(text):
            return None
        if self.settled(naive(text, pattern, self.order)) is None:
            return None
        return moment(text, zone, pattern, order=self.order)

    def settled(self, at: datetime) -> datetime | None:
        """The time, as a file writes it; None where it means none. Raises `Unreadable` where it cannot be determined."""
        day = default_of(at)
        if day is not None and not self.dated and day not in self.absent:
            raise Unreadable(
                _("is what programs write where they have no time; correct it, or leave the column of times out")
            )
        return None if day in self.absent else at

    @property
    def live(self) -> "FileTimes":
        """The same for readings that come in as they are measured: one without a time is measured now."""
        return self if self.dated else LIVE._replace(order=self.order)


LIVE = FileTimes(dated=True, absent=DEFAULTS | MIDNIGHTS)
Read = Callable[[str, DayOrder], datetime]


def times_of(texts: Iterable[str], pattern: str | None = None, read: Read | None = None) -> FileTimes:
    """Common properties of these times of a file; what is none is passed over. read: of a format that writes times in its own way.

    >>> times_of(["11/7/2025 6:05", "", "11/18/2025 6:06"]).order
    'month_first'
    >>> [day.year for day in sorted(times_of(["7.5.1999", "1.1.1970 00:00:00"]).absent)]
    [1, 1899, 1899, 1900, 1904, 1970, 1980]
    >>> times_of(["1.1.1970 01:00:00", "", "1.1.1970 01:00:00"]).nothing
    True
    """
    orders: set[DayOrder] = set()
    days: set[date] = set()
    defaults: dict[date, set[time]] = {}
    unread = False
    for text in texts:
        if not text.strip() or is_zeros(text):
            continue
        stroke = None if pattern else slashed(text)
        if stroke in (Slashed.DAY_FIRST, Slashed.MONTH_FIRST):
            orders.add("day_first" if stroke is Slashed.DAY_FIRST else "month_first")
        try:
            order: DayOrder = "month_first" if stroke is Slashed.MONTH_FIRST else "day_first"
            at = naive(text, pattern, order) if read is None else read(text, order)
        except Unreadable:
            unread = True
            continue
        if (default := default_of(at)) is None:
            days.add(at.date())
        else:
            defaults.setdefault(default, set()).add(at.time())
    if not days:
        absent = DEFAULTS - {day for day, times in defaults.items() if len(times) > 1}
        return FileTimes(_only(orders), absent=absent, nothing=not unread and absent >= defaults.keys())
    far = (day for day in DEFAULTS | MIDNIGHTS if not _within(day, min(days), max(days)))
    return FileTimes(_only(orders), dated=True, absent=frozenset(far))


class Unnamed(NamedTuple):
    """Columns that hold times, and whose names do not say so. sure: the one that is taken. doubtful: those of which a person says it.

    counted: columns of numbers that may be times, each with the form that reads them; empty for 20251118060500, which needs none.
    """

    sure: str = ""
    doubtful: tuple[str, ...] = ()
    counted: Mapping[str, str] = MappingProxyType({})


def times_unnamed(
    columns: Mapping[str, Sequence[str]], pattern: str | None = None, days: Sequence[str] = ()
) -> Unnamed:
    """The column among these that holds the times, by their names: the only one with dates and times, in every row.

    days: the cells of the column whose name is that of times, if there is one. Where it holds nothing but days, another one may hold
    the times as well: the only one with a time on the same day in every row. Other times of day, and no dates, are not looked for.

    Where there are more, or rows of it have none, or dates only, a person has to say. A column of one program's default is none.

    >>> times_unnamed({"Stamp": ["18.11.2025 06:05", "18.11.2025 06:06"], "By": ["A", "B"]}).sure
    'Stamp'
    >>> times_unnamed({"Stamp": ["18.11.2025 06:05", ""], "Day": ["18.11.2025", "18.11.2025"]}).doubtful
    ('Stamp',)
    >>> times_unnamed({"Stamp": ["20251118T060500"], "Size": ["40.001"]}).sure
    'Stamp'
    >>> times_unnamed({"Day": ["18.11.2025", "18.11.2025"], "No": ["4711-01-02", "4711-13-02"]}).doubtful
    ('Day',)
    >>> stamps = {"Stamp": ["18.11.2025 06:05", "19.11.2025 06:06"], "Cycle": ["00:01:35", "00:01:36"]}
    >>> times_unnamed(stamps, days=["18.11.2025", "19.11.2025"]).sure, times_unnamed(stamps, days=["18.11.2025", "20.11.2025"]).doubtful
    ('Stamp', ('Stamp',))
    >>> times_unnamed({"Tick": ["1763442300", "1763442393", "1763442481"], "No": ["1700000001", "1700000002", "1700000003"]}).counted
    {'Tick': 'seconds since 1970-01-01'}
    """
    moments: dict[str, int] = {}
    dates: list[str] = []
    for name, cells in columns.items():
        kinds = [_has_date(cell, pattern) for cell in cells]
        if not any(kinds) or (times_of(cells, pattern).nothing and "unread" not in kinds):
            continue
        if 2 * (times := len([kind for kind in kinds if kind in {"time", "unread"}])) >= len(kinds):
            moments[name] = times - len(kinds)
        elif 2 * kinds.count("day") >= len(kinds) and not days:
            dates.append(name)
    if list(moments.values()) == [0] and (
        not days or _same_days(days, next(iter(columns[name] for name in moments)), pattern)
    ):
        return Unnamed(next(iter(moments)))
    if moments or dates:
        return Unnamed(doubtful=tuple(moments or dates))
    forms = (
        {}
        if pattern or days
        else {name: form for name, cells in columns.items() if (form := _count(cells)) is not None}
    )
    return Unnamed(counted=forms)


def only_days(cells: Iterable[str], pattern: str | None = None) -> bool:
    """Tell of cells that hold nothing but days, be it with the midnight that programs write behind one.

    >>> only_days(["18.11.2025", "", "19.11.2025 00:00:00"]), only_days(["18.11.2025 00:00", "18.11.2025 06:05"]), only_days([""])
    (True, False, False)
    """
    written = [cell for cell in cells if cell.strip()]
    return bool(written) and all(_day_of(cell, pattern, midnight=True) is not None for cell in written)


def _same_days(days: Sequence[str], moments: Sequence[str], pattern: str | None) -> bool:
    """Tell if these moments lie on the days beside them."""
    orders = times_of(days, pattern).order, times_of(moments, pattern).order
    pairs = zip(days, moments, strict=True)
    return all(
        not day.strip() or _day_of(day, pattern, orders[0]) == _day_of(at, pattern, orders[1]) is not None
        for day, at in pairs
    )


def _day_of(cell: str, pattern: str | None, order: DayOrder | None = None, *, midnight: bool = False) -> date | None:
    """The day of a moment; None of what is none. midnight: only where nothing else is written."""
    if not _has_date(cell, pattern):
        return None
    try:
        at = naive(
            plain(cell), pattern, order or ("month_first" if slashed(cell) is Slashed.MONTH_FIRST else "day_first")
        )
    except Unreadable:
        return None
    return None if midnight and at.time() != time() else at.date()


def _count(cells: Sequence[str]) -> str | None:
    """The form by which numbers may be times: they go one way, from 2000 on, and not by one as numbers of parts do.

    Days of spreadsheets have a fraction, the time of day, and there are more of them: a size in micrometres is as large.
    """
    if not cells or not all(_NUMBER.fullmatch(plain(cell)) for cell in cells):
        return None
    texts = [plain(cell).replace(",", ".") for cell in cells]
    numbers = [float(text) for text in texts]
    steps = [after - before for before, after in pairwise(numbers) if after != before]
    if len(steps) < _FEWEST_STEPS or not (min(steps) > 0 or max(steps) < 0):
        return None
    least, most = min(numbers), max(numbers)
    if _DAYS[0] <= least and most < _DAYS[1]:
        broken = sum(not number.is_integer() for number in numbers)
        return "days since 1899-12-30" if 2 * broken > len(numbers) and len(steps) > 2 * _FEWEST_STEPS else None
    if 2 * sum(abs(step) == 1 for step in steps) >= len(steps):
        return None
    for form, factor in (("seconds since 1970-01-01", 1), ("milliseconds since 1970-01-01", 1000)):
        if _SECONDS[0] * factor <= least and most < _SECONDS[1] * factor:
            return form
    return "" if all(_compact(text) for text in texts) else None


def _compact(text: str) -> bool:
    """Tell of digits such as 20251118060500."""
    try:
        return _COUNTED_YEARS[0] <= naive(text).year < _COUNTED_YEARS[1]
    except Unreadable:
        return False


def _has_date(cell: str, pattern: str | None) -> str:
    """The part of a time that a cell holds: time, unread (date and time in an unknown form), day, or nothing."""
    text = plain(cell)
    if (not pattern and not _LIKE_A_DATE.search(text)) or text.isdigit() or is_zeros(text):
        return ""
    try:
        at = naive(text, pattern, "month_first" if slashed(text) is Slashed.MONTH_FIRST else "day_first")
    except Unreadable:
        return "unread" if _DATE_AND_TIME.match(text) else ""
    if not YEARS[0] < at.year < YEARS[1]:
        return ""
    return "time" if re.search(r":|\dT\d", text) or (pattern and "H" in pattern.upper()) else "day"


def _only(orders: set[DayOrder]) -> DayOrder | None:
    return next(iter(orders)) if len(orders) == 1 else None


def _within(day: date, earliest: date, latest: date) -> bool:
    """Tell if a day may be one of the file: in its time, or within a year of it."""
    return earliest - day < FAR and day - latest < FAR
