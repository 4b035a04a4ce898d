"""Times of measurements, by a control's clock: readings come with a time of day; some controls answer their date as well. Pure."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from itertools import pairwise

from app.bridge.links import Clock, Received
from app.core.printed_line import Printed

DAY = 86_400.0  # s
AHEAD = timedelta(seconds=5)  # more is no delay of a clock that is right
GAINED = 600.0  # s that a clock may have gained, or was set back by, since it was known: no reason for another day
GAINED_UNKNOWN = 7200.0  # s: a clock that is not known may never have been set back from summer time
TOGETHER = 10.0  # s between lines that a program prints at once
DRIFT = 30.0  # s
HELD_UP = 1800.0  # s that a line may lie in a network that was cut; more is a clock that was set
FRESH = 2.0  # polls: when the last one was longer ago, it is not known what came meanwhile
START = 5.0  # s: what comes so soon after a connection may have waited in a buffer


def learn(clock: Clock, time: float, now: datetime) -> None:
    """Note how far the clock is ahead, from a time of day (s) that the control has just written."""
    ahead = time - _time_of_day(now)
    clock.offset = (ahead + DAY / 2) % DAY - DAY / 2 + clock.days * DAY


def learn_date(clock: Clock, shown: datetime, now: datetime) -> None:
    """Note how far the clock is ahead, from the date and time (local, without a zone) that the control shows now."""
    clock.offset = (shown - now.replace(tzinfo=None)).total_seconds()
    clock.days = round(clock.offset / DAY)


def learn_ahead(clock: Clock, received: Iterable[Received], now: datetime) -> None:
    """Note how far the clock is ahead at least, from times with which readings come: one in the past says nothing of the clock."""
    clock.offset, clock.days = None, 0
    for each in received:
        try:
            shown = datetime.fromisoformat(str(each.body.get("measured_at"))).astimezone()
        except (ValueError, OverflowError):
            continue  # it has none, or the server will say what is wrong
        if shown > now + AHEAD and (shown - now).total_seconds() > (clock.offset or 0.0):
            clock.offset = (shown - now).total_seconds()
            clock.days = round(clock.offset / DAY)


def wrong_date(clock: Clock) -> str:
    """A sentence if the control's date is wrong; empty if it is right, or not known."""
    if not clock.days:
        return ""
    days = "a day" if abs(clock.days) == 1 else f"{abs(clock.days)} days"
    return (
        f"The control's clock is {days} {'ahead of' if clock.days > 0 else 'behind'} the clock of the bridge's computer. Compare"
        " both with a watch, and set the date of the one that is wrong."
    )


def measured_at(clock: Clock, time: float | None, now: datetime, *, fresh: bool) -> datetime | None:
    """Time of the measurement: now if it is fresh; else by the control's clock (s of the day), if that is known."""
    if fresh:
        return now
    if time is None or clock.offset is None:
        return None
    return now - timedelta(seconds=_age(time, clock.offset, now, GAINED))


def _age(time: float, offset: float, now: datetime, gained: float) -> float:
    """Seconds since a clock showed this time of day. gained: by so much ahead it is the clock that is wrong, not the day."""
    ahead = (time - _time_of_day(now) - offset) % DAY
    return 0.0 if ahead <= gained else DAY - ahead


def _time_of_day(at: datetime) -> float:
    return (at - at.replace(hour=0, minute=0, second=0, microsecond=0)).total_seconds()


@dataclass(slots=True)
class Prints:
    """Times of lines that come from a control with a time of day each, at once or out of a buffer. The clock is learnt by the way.

    Behind a poll that brought nothing a line that comes alone, or with others of the same seconds, was printed just now, and
    tells how far the clock is ahead; what comes at once with lines of other times was in a buffer, and says nothing of the
    clock. A delay is never negative: a line that is ahead of the clock corrects it; one that is behind was held up,
    unless the next one is behind by as much. interval: s between two polls.
    """

    clock: Clock
    interval: float
    _quiet: float | None = None
    _behind: float | None = None
    _newest: tuple[int, int] | None = None

    def place(
        self, lines: Sequence[Printed], now: datetime, at: float, since: float, written: datetime | None = None
    ) -> list[datetime | None]:
        """The time at which each line of a poll was measured; None where only its arrival is known.

        at: the poll; since: from then on nothing waits any more that came before the connection; both s by one clock. written:
        when the newest line was, at the latest, where that is known.
        """
        quiet, self._quiet = self._quiet, None if lines else at
        live = quiet is not None and quiet >= since and at < quiet + FRESH * self.interval + 1
        if written is not None and not live:
            now = min(now, written)
        epochs = [line.epoch for line in lines]
        order = sorted(range(len(lines)), key=lambda index: (epochs.index(epochs[index]), lines[index].slot.sequence))
        live = live and self._goes_on([(epochs[index], lines[index].slot.sequence) for index in order])
        found: list[datetime | None] = [now if live and len(lines) == 1 else None] * len(lines)
        order = [index for index in order if lines[index].slot.time is not None]
        ages = self._ages([lines[index].slot.time or 0.0 for index in order], now, live=live)
        for index, age in zip(order, ages, strict=True):
            found[index] = now - timedelta(seconds=age)
        return found

    def _goes_on(self, places: Sequence[tuple[int, int]]) -> bool:
        """Tell if the newest of these, epoch and sequence, is newer than all before: a line that is printed again is not."""
        if not places:
            return False
        before, newest = self._newest, places[-1]
        if before is not None and before[0] == newest[0] and newest[1] <= before[1]:
            return False
        self._newest = newest
        return True

    def _ages(self, times: Sequence[float], now: datetime, *, live: bool) -> Sequence[float]:
        """Seconds since each of these times of day, which follow one another."""
        if not times:
            return []
        before = [0.0]  # the newest, from it on backwards
        for earlier, later in reversed(list(pairwise(times))):
            step = (later - earlier) % DAY
            before.append(
                before[-1] + (step if step < DAY - GAINED else 0.0)
            )  # a clock may have been set back a little
        if live and before[-1] <= TOGETHER:
            newest = self._held_up(times[-1], now)
        else:
            known = self.clock.offset is not None
            newest = _age(times[-1], self.clock.offset or 0.0, now, GAINED if known else GAINED_UNKNOWN)
        return [newest + age for age in reversed(before)]

    def _held_up(self, time: float, now: datetime) -> float:
        """Seconds for which a line that comes by itself was held up; the clock learns from it."""
        before, clock = self.clock.offset, self.clock
        learn(clock, time, now)
        if before is None or clock.offset is None:
            return 0.0
        behind = (before - clock.offset + DAY / 2) % DAY - DAY / 2
        again = self._behind is not None and abs(behind - self._behind) <= DRIFT
        self._behind = None
        if -HELD_UP <= behind <= DRIFT or again:
            return 0.0
        self._behind, clock.offset = behind, before
        return behind if 0 < behind <= HELD_UP else 0.0
