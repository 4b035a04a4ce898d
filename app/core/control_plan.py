"""Control plan of a characteristic: how often it is measured, which measurement is due, and which was missed.

A part counts as cut once another characteristic of it was measured, or once a later number shows it (`Plan.numbered`). The part
that is being worked on is never missed: it counts when a later one was begun. Where nothing tells of parts their number is None:
not known is not missed. Minutes count while the machine runs: between two readings of the same part's characteristics that are at
most `PAUSE` apart, or while the control itself reports that it runs, whichever is more. Times are seconds of one clock.

A tool change or an alarm asks for every part from its moment on: parts that were cut before it are judged by the plan alone.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from math import inf
from typing import NamedTuple

from app.core.affected import names_between
from app.core.context import ContextField

MISSED_ALARM = "measurement_missed"
"""The kind of alarm that asks for no more measurements than the plan itself."""
PAUSE = 15 * 60.0
"""Seconds without a reading of the part, beyond which the machine is not known to have run."""


class By(StrEnum):
    """The rule of a plan by which a measurement is due or was missed."""

    PARTS = "parts"
    MINUTES = "minutes"
    SHIFT = "shift"


class Tightened(StrEnum):
    """The event after which every part is measured for a while."""

    TOOL_CHANGE = "tool_change"
    ALARM = "alarm"


class Due(StrEnum):
    """The next measurement: not planned, not due yet, due with the next part, or missed."""

    NOT_PLANNED = "not_planned"
    LATER = "later"
    DUE = "due"
    MISSED = "missed"


@dataclass(frozen=True, slots=True)
class Plan:
    """The rules by which a characteristic is measured.

    every: 1 in N parts; minutes: at least once in N minutes of running; per_shift: at least once in each shift in
    which the part is made. after_change, after_alarm: every part for N readings. on_the_way: parts that lie between the
    machine and the gauge. numbered: parts are numbered one by one, so that a number that is missing is a part. required_context:
    what the context of every reading must say, however often it is measured.
    """

    every: int | None = None
    minutes: float | None = None
    per_shift: bool = False
    after_change: int = 0
    after_alarm: int = 0
    on_the_way: int = 0
    numbered: bool = False
    required_context: tuple[ContextField, ...] = ()

    @property
    def asks(self) -> bool:
        """Tell if it asks for measurements."""
        return bool(self.counts_parts or self.minutes or self.per_shift)

    @property
    def counts_parts(self) -> bool:
        """Tell if it says of parts which one is to be measured."""
        return bool(self.every or self.after_change or self.after_alarm)


class Moment(NamedTuple):
    """A reading. source: its characteristic; part: its name, if it has one; shift: the begin of the plant's shift it lies in."""

    at: float
    source: int
    part: str | None = None
    shift: float = 0.0


class Run(NamedTuple):
    """A time in which the control reported that it ran."""

    begin: float
    until: float


class Ran(NamedTuple):
    """All that is known of the time since a reading.

    parts: parts cut since and not measured, without the one that is being worked on; None: nothing tells. minutes: that the
    machine ran. shifts: shifts that are over, in which the part was made and not measured. parts_after: as parts, of those
    that were begun after the event for which every part is measured.
    """

    parts: int | None = None
    minutes: float = 0.0
    shifts: int = 0
    parts_after: int | None = None


class Event(NamedTuple):
    """A tool change or an alarm. at: its moment. readings: of the characteristic since then."""

    why: Tightened
    at: float
    readings: int


class Rhythm(NamedTuple):
    """The interval in force: every n-th part, or None where parts do not count. tightened: why it is every part, from `at` on."""

    every: int | None
    tightened: Tightened | None = None
    at: float = -inf


class Judged(NamedTuple):
    """The state of a plan.

    by: the rule that says so. next_in: parts until the one to measure (1: the next); None: not known. every: the interval that
    was not kept, where parts say so.
    """

    due: Due
    by: By | None = None
    next_in: int | None = None
    every: int | None = None


def rhythm(plan: Plan, events: Iterable[Event] = ()) -> Rhythm:
    """The interval in force after tool changes and alarms; of several that hold, every part counts from the first one on.

    >>> change, alarm = Event(Tightened.TOOL_CHANGE, 60.0, 2), Event(Tightened.ALARM, 90.0, 5)
    >>> rhythm(Plan(every=5, after_change=3), [change, alarm]), rhythm(Plan(every=5, after_alarm=5), [change, alarm]).every
    (Rhythm(every=1, tightened=<Tightened.TOOL_CHANGE: 'tool_change'>, at=60.0), 5)
    """
    most = {Tightened.TOOL_CHANGE: plan.after_change, Tightened.ALARM: plan.after_alarm}
    hold = [event for event in events if event.readings < most[event.why]]
    if not hold:
        return Rhythm(plan.every)
    alarm = any(event.why is Tightened.ALARM for event in hold)
    return Rhythm(1, Tightened.ALARM if alarm else Tightened.TOOL_CHANGE, min(event.at for event in hold))


def measure_next(plan: Plan, since: Mapping[Tightened, int | None], *, late: bool, measured: bool) -> int | None:
    """Parts until the one to measure, counted from the part of a reading that comes now (1: the next one).

    None: parts do not count, or it is `late`, measured before a reading that has come already: that one has said it. since:
    readings from an event on, this one included; None: there was none. measured: False of a probe fault, which is no measurement.

    >>> plan = Plan(every=5, after_alarm=2)
    >>> [measure_next(plan, {Tightened.ALARM: since}, late=False, measured=True) for since in (None, 0, 1, 2)]
    [5, 1, 1, 5]
    """
    events = (Event(why, 0.0, readings) for why, readings in since.items() if readings is not None)
    every = rhythm(plan, events).every
    if every is None or late:
        return None
    return every if measured else 1


def in_time(moments: Iterable[tuple[int, Moment]], begin: tuple[int, Moment]) -> list[tuple[int, Moment]]:
    """Numbered readings in the order of their time, from `begin` on. One that comes late, measured before it, is none of them.

    >>> early, late, newest = (1, Moment(60.0, 1)), (2, Moment(50.0, 1)), (3, Moment(70.0, 1))
    >>> [number for number, _moment in in_time([late, newest], early)]
    [1, 3]
    """
    return [begin, *sorted((each for each in moments if each[1].at >= begin[1].at), key=lambda each: each[1].at)]


def ran(
    plan: Plan,
    last: Moment,
    others: Iterable[Moment],
    *,
    now: Moment,
    measured: frozenset[str] = frozenset(),
    runs: Iterable[Run] = (),
    closed: bool = False,
    event: float = -inf,
) -> Ran:
    """All that is known of the time from the reading `last` to `now`.

    others: readings of other characteristics of the same part between them, in any order. closed: `now` is the reading that
    ended it; else it is this moment, and readings of a clock that is ahead of it count too. measured: names of parts that
    were measured, whenever. runs: times in which the control reported that it ran. event: from it on every part was to be measured.

    >>> others = [Moment(60.0, 2, "P8"), Moment(120.0, 2, "P9"), Moment(180.0, 2, "P10")]
    >>> ran(Plan(every=1), Moment(0.0, 1, "P7"), others, now=Moment(200.0, 1))
    Ran(parts=2, minutes=3.0, shifts=0, parts_after=2)
    """
    until = now.at if closed else inf
    signs = sorted((each for each in others if last.at < each.at <= until), key=lambda each: each.at)
    steps = (after.at - before.at for before, after in pairwise([last, *signs]))
    reported = (min(run.until, now.at) - max(run.begin, last.at) for run in runs)
    ended = now.part if closed else None
    parts = parts_after = _parts(plan, last, signs, ended, measured)
    if event > last.at:
        before = [each.part for each in signs if each.at <= event and each.part is not None]
        base = last._replace(part=before[-1] if before else None)
        begun_before = measured | {*before} | ({last.part} if last.part is not None else set())
        parts_after = _parts(plan, base, [each for each in signs if each.at > event], ended, begun_before)
    return Ran(
        parts,
        max(sum(step for step in steps if step <= PAUSE), sum(each for each in reported if each > 0)) / 60,
        len({each.shift for each in signs if last.shift < each.shift < now.shift}),
        parts_after,
    )


def _parts(
    plan: Plan, last: Moment, signs: Sequence[Moment], until: str | None, measured: frozenset[str]
) -> int | None:
    newest = until or next((each.part for each in reversed(signs) if each.part is not None), None)
    counts = []
    if plan.numbered and newest is not None and (names := names_between(last.part, newest)) is not None:
        counts.append(names if isinstance(names, int) else len(set(names) - measured))
    if signs:
        named = {each.part for each in signs if each.part is not None} - measured - {last.part, newest}
        unnamed = Counter(each.source for each in signs if each.part is None)
        counts.append(max(len(named), max(unnamed.values(), default=1) - 1))  # one of these is being worked on
    return max(counts, default=None)


def judged(plan: Plan, interval: Rhythm, since: Ran, *, in_this_shift: bool, closed: bool = False) -> Judged:
    """Judge the time since the last reading. in_this_shift: it lies in the current shift. closed: the next reading has come.

    >>> plan = Plan(every=5)
    >>> [judged(plan, rhythm(plan), Ran(parts), in_this_shift=True).due.value for parts in (3, 4, 5)]
    ['later', 'due', 'missed']
    """
    if not plan.asks:
        return Judged(Due.NOT_PLANNED)
    # A number between two that were measured is late for good.
    under_way = 0 if closed and plan.numbered else plan.on_the_way
    every = interval.every
    known, known_after = (
        None if parts is None else max(0, parts - under_way) for parts in (since.parts, since.parts_after)
    )
    next_in = None if every is None or (known is None and every > 1) else max(1, every - (known or 0))
    if plan.every is not None and known is not None and known >= plan.every:
        return Judged(Due.MISSED, By.PARTS, 1, plan.every)
    if interval.tightened and known_after:
        return Judged(Due.MISSED, By.PARTS, 1, 1)
    if plan.minutes is not None and since.minutes > plan.minutes:
        return Judged(Due.MISSED, By.MINUTES, 1)
    if plan.per_shift and since.shifts:
        return Judged(Due.MISSED, By.SHIFT, 1)
    if closed:
        return Judged(Due.LATER)
    if next_in == 1:
        return Judged(Due.DUE, By.PARTS, 1)
    if plan.per_shift and not in_this_shift:
        return Judged(Due.DUE, By.SHIFT, 1)
    return Judged(Due.LATER, None, next_in)
