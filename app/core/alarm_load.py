"""Load of an operator by alarms: rate in ten minutes, floods, alarms that chatter or stay, and those that make the most noise.

The numbers are those of ANSI/ISA-18.2-2016, table 7 (IEC 62682 has the same), per operator position: about 1 alarm in ten minutes
is very likely acceptable, about 2 the most that can be managed; ten minutes with more than 10 are a flood, and less than about 1 % of
all ten minutes should be; fewer than 5 stale alarms, active for more than 24 h; no chattering ones; the ten most frequent alarms make 1 to 5 % of
all. ISA-TR18.2.5 lets a flood begin with ten minutes of more than 10 alarms, and end with the first of fewer than 5. For chattering
the standard has no number; three in a minute is what is usual. It asks for 30 days of data at least (`DAYS`).
"""

from collections import Counter
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import StrEnum
from typing import NamedTuple

INTERVAL = timedelta(minutes=10)
ACCEPTABLE, MANAGEABLE = 1.0, 2.0
"""Alarms in ten minutes, on average."""
FLOOD, FLOOD_ENDS = 10, 5
"""A flood begins with more alarms than the first in ten minutes, and ends with fewer than the second."""
MOST_IN_FLOOD = 0.01
"""Share of all ten minutes."""
STALE, MOST_STALE = timedelta(hours=24), 5
CHATTER, CHATTERS_WITHIN = 3, timedelta(minutes=1)
TOP = 10
DAYS = 30


class LoadVerdict(StrEnum):
    """The mean rate against the standard."""

    ACCEPTABLE = "acceptable"
    MANAGEABLE = "manageable"
    TOO_MANY = "too_many"


class Annunciation(NamedTuple):
    """An alarm that was raised. happened: how often it has happened while it was active, at `at` first and at `last_at` last.

    cause: the same for the same trouble, raised again. ended: acknowledged, or ended by itself; None while it is active.
    """

    cause: Hashable
    at: datetime
    ended: datetime | None = None
    happened: int = 1
    last_at: datetime | None = None


class Flood(NamedTuple):
    """A flood: from the first ten minutes with more than `FLOOD` alarms until before the first with fewer than `FLOOD_ENDS`."""

    begin: datetime
    end: datetime
    alarms: int


@dataclass(frozen=True, slots=True)
class Load:
    """The load of a position. mean: alarms in ten minutes; most: in the worst; over: ten minutes with more than `FLOOD`."""

    alarms: int
    intervals: int
    mean: float
    most: int
    over: int
    floods: tuple[Flood, ...]
    in_flood: float

    @property
    def verdict(self) -> LoadVerdict:
        """The mean rate against the standard.

        >>> Load(3, 3, 1.0, 1, 0, (), 0.0).verdict, Load(5, 2, 2.5, 3, 0, (), 0.0).verdict
        (<LoadVerdict.ACCEPTABLE: 'acceptable'>, <LoadVerdict.TOO_MANY: 'too_many'>)
        """
        if self.mean <= ACCEPTABLE:
            return LoadVerdict.ACCEPTABLE
        return LoadVerdict.MANAGEABLE if self.mean <= MANAGEABLE else LoadVerdict.TOO_MANY


class Noise(NamedTuple):
    """A cause of alarms: how many it has raised, their share of all, and whether it chatters."""

    cause: Hashable
    alarms: int
    share: float
    chatters: bool


def counts(moments: Iterable[datetime], begin: datetime, end: datetime) -> list[int]:
    """Moments in each ten minutes from `begin` on, the quiet ones too; the last may be shorter. Those outside are left out.

    >>> noon = datetime(2026, 3, 5, 12)
    >>> counts([noon, noon + timedelta(minutes=9.9), noon + timedelta(minutes=10)], noon, noon + timedelta(minutes=25))
    [2, 1, 0]
    """
    made = [0] * max(0, -((begin - end) // INTERVAL))
    for moment in moments:
        if begin <= moment < end:
            made[(moment - begin) // INTERVAL] += 1
    return made


def floods(rates: Sequence[int], begin: datetime) -> list[Flood]:
    """Floods among counts in ten minutes each, the first of which begins at `begin`; one that goes on ends with the last of them.

    >>> [(flood.alarms, (flood.end - flood.begin) / INTERVAL) for flood in floods([1, 11, 7, 5, 4, 10, 12], datetime(2026, 3, 5))]
    [(23, 3.0), (12, 1.0)]
    """
    found: list[Flood] = []
    first: int | None = None
    for at, rate in enumerate([*rates, 0]):
        if first is None and rate > FLOOD:
            first = at
        elif first is not None and rate < FLOOD_ENDS:
            found.append(Flood(begin + first * INTERVAL, begin + at * INTERVAL, sum(rates[first:at])))
            first = None
    return found


def load(moments: Iterable[datetime], begin: datetime, end: datetime) -> Load:
    """The load by alarms raised at these moments. mean = alarms / (time / 10 min); in_flood = time in floods / time."""
    rates = counts(moments, begin, end)
    found = floods(rates, begin)
    time = (end - begin) / INTERVAL
    flooded = sum(((min(flood.end, end) - flood.begin) / INTERVAL for flood in found), 0.0)
    return Load(
        alarms=sum(rates),
        intervals=len(rates),
        mean=sum(rates) / time if time > 0 else 0.0,
        most=max(rates, default=0),
        over=sum(rate > FLOOD for rate in rates),
        floods=tuple(found),
        in_flood=flooded / time if time > 0 else 0.0,
    )


def chattering(alarms: Iterable[Annunciation]) -> set[Hashable]:
    """Causes that have happened three times or more in a minute.

    Raised three times in a minute; or happened so often while active that it must be: of n times in a span there are (n - 1) // 2
    runs of three that share no more than their ends, so the shortest lasts at most span / ((n - 1) // 2).
    """
    raised: dict[Hashable, list[datetime]] = {}
    found: set[Hashable] = set()
    for alarm in alarms:
        raised.setdefault(alarm.cause, []).append(alarm.at)
        runs = (alarm.happened - 1) // 2
        if runs and ((alarm.last_at or alarm.at) - alarm.at) / runs <= CHATTERS_WITHIN:
            found.add(alarm.cause)
    for cause, moments in raised.items():
        ordered = sorted(moments)
        spans = (last - first for first, last in zip(ordered, ordered[CHATTER - 1 :], strict=False))
        if any(span <= CHATTERS_WITHIN for span in spans):
            found.add(cause)
    return found


def noisiest(alarms: Sequence[Annunciation], most: int = TOP) -> list[Noise]:
    """The causes that have raised the most alarms, the noisiest first, with their share of all."""
    chatters = chattering(alarms)
    raised = Counter(alarm.cause for alarm in alarms)
    top = sorted(raised.items(), key=lambda each: (-each[1], str(each[0])))[:most]
    return [Noise(cause, number, number / len(alarms), cause in chatters) for cause, number in top]
