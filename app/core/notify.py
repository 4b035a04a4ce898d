"""Notifications of active alarms, to whom and when: routes, quiet hours, repetition, escalation, one message in place of a flood.

A route names the alarms it is for and steps of receivers. A step begins some minutes after the alarm, or with the step before
where nobody of that can be reached now: failing, away, in quiet hours, or nobody on duty. A receiver gets at most one message in
`GAP`, with everything that is due then; an alarm that stops a machine does not wait for it where the message before had none, so in `GAP` there are two at most.
"""

from collections import defaultdict
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date, datetime, time, timedelta, tzinfo
from itertools import pairwise
from types import MappingProxyType
from typing import NamedTuple

GAP = timedelta(minutes=1)
"""Least time between two messages to one receiver, however many alarms come."""
FIRST_PAUSE, LONGEST_PAUSE = timedelta(seconds=10), timedelta(minutes=10)
"""Before a receiver that could not be reached is tried again: twice the pause before, up to the longest."""
ENOUGH_FAILURES = 4
"""Failures in a row from which a receiver counts as one that fails: for over a minute, longer than a mail server takes to start again."""
NEVER = timedelta(0)
DAY = timedelta(days=1)


@dataclass(frozen=True, slots=True)
class Hours:
    """A part of the week: on these days (1 Monday to 7 Sunday) from `begins` until before `ends`.

    One that ends where it begins, or earlier, ends on the next day.
    """

    days: frozenset[int]
    begins: time
    ends: time

    def hold(self, local: datetime, days_off: Container[date] = ()) -> bool:
        """Tell if a moment of the plant's clock lies in it. days_off: on them it does not begin."""
        return bool(self.begun(local, days_off))

    def begun(self, local: datetime, days_off: Container[date] = ()) -> list[date]:
        """The days on which it began that hold the moment: two where it is longer than a day."""
        begun = [local.date()] if self.begins <= local.time() else []
        if self.ends <= self.begins:
            if local.time() < self.ends:
                begun.append(local.date() - DAY)
        elif local.time() >= self.ends:
            begun.clear()
        return [day for day in begun if day.isoweekday() in self.days and day not in days_off]


@dataclass(frozen=True, slots=True)
class Turn:
    """A part of a rota: these receivers are on duty in these hours, from the first day to the last, as they begin."""

    receivers: tuple[int, ...]
    hours: Hours
    first: date | None = None
    last: date | None = None

    def holds(self, local: datetime) -> bool:
        """Tell if they are on duty at this moment of the plant's clock."""
        return any(
            (self.first is None or self.first <= day) and (self.last is None or day <= self.last)
            for day in self.hours.begun(local)
        )


@dataclass(frozen=True, slots=True)
class Group:
    """Receivers that are named together, and the rota by which some are on duty."""

    members: tuple[int, ...]
    turns: tuple[Turn, ...] = ()

    def on_duty(self, local: datetime) -> tuple[int, ...]:
        """Those on duty at this moment, in the order of the rota; empty: nobody."""
        return tuple(dict.fromkeys(each for turn in self.turns if turn.holds(local) for each in turn.receivers))

    def unattended(self, first: date, days: int) -> list[tuple[datetime, datetime]]:
        """The times of so long from a day on in which nobody is on duty, by the plant's clock; none without a rota.

        >>> early = Turn((1,), Hours(frozenset(range(1, 6)), time(6), time(14)))
        >>> [f"{a:%a %H:%M} to {b:%a %H:%M}" for a, b in Group((1,), (early,)).unattended(date(2026, 11, 27), 3)]
        ['Fri 00:00 to Fri 06:00', 'Fri 14:00 to Mon 00:00']
        """
        if not self.turns:
            return []
        clock = sorted({time.min} | {at for turn in self.turns for at in (turn.hours.begins, turn.hours.ends)})
        begins = [datetime.combine(first + number * DAY, at) for number in range(days) for at in clock]
        found: list[tuple[datetime, datetime]] = []
        for begin, end in pairwise([*begins, datetime.combine(first + days * DAY, time.min)]):
            if not self.on_duty(begin):
                found.append((found.pop()[0] if found and found[-1][1] == begin else begin, end))
        return found


@dataclass(frozen=True, slots=True)
class Step:
    """Those who are notified of an alarm that is still active after this time: receivers, groups, who is on duty in groups."""

    after: timedelta
    receivers: tuple[int, ...]
    groups: tuple[int, ...] = ()
    on_duty: tuple[int, ...] = ()

    def whom(self, groups: Mapping[int, Group], local: datetime) -> list[int]:
        """The receivers at this moment of the plant's clock, each once."""
        found = [*self.receivers]
        found += (each for number in self.groups if number in groups for each in groups[number].members)
        found += (each for number in self.on_duty if number in groups for each in groups[number].on_duty(local))
        return list(dict.fromkeys(found))


@dataclass(frozen=True, slots=True)
class Raised:
    """An active alarm. tone: its urgency, as `app.web.states` has it."""

    id: int
    kind: str
    tone: str
    machine: str
    characteristic: str | None
    tool: int | None
    at: datetime

    @property
    def cause(self) -> tuple[str, str, str | None, int | None]:
        """The same for the same trouble, raised again."""
        return self.kind, self.machine, self.characteristic, self.tool


@dataclass(frozen=True, slots=True)
class Maintenance:
    """A time in which notifications of a machine are withheld; None: of all machines. stopping_anyway: but for those of tone stop."""

    machine: str | None
    begins: datetime
    ends: datetime
    stopping_anyway: bool = True

    def withholds(self, alarm: Raised) -> bool:
        """Tell if it withholds notifications of this alarm while it runs."""
        return self.machine in (None, alarm.machine) and not (self.stopping_anyway and alarm.tone == "stop")


def after_maintenance(alarms: Iterable[Raised], windows: Sequence[Maintenance], now: datetime) -> list[Raised]:
    """The alarms that nothing withholds now. Of one that was withheld the steps begin when the last maintenance has ended."""
    found = []
    for alarm in alarms:
        begun = [each for each in windows if each.begins <= now and each.withholds(alarm)]
        if not any(now < each.ends for each in begun):
            found.append(replace(alarm, at=max(alarm.at, *(each.ends for each in begun))) if begun else alarm)
    return found


@dataclass(frozen=True, slots=True)
class Route:
    """The alarms that go to some receivers, and when.

    kinds, tones, machines, characteristics: the alarms, all where empty. hours: when it is open; always where empty.
    on_days_off: its hours begin on days off too. urgent: through the quiet hours of receivers. repeat: until acknowledged, 0
    not at all. digest: a first message waits so long for others. hold_off: the same trouble raised again within it is not
    announced before it ends. only: numbers of alarms, of those who fit besides; None: all.
    """

    steps: tuple[Step, ...]
    kinds: frozenset[str] = frozenset()
    tones: frozenset[str] = frozenset()
    machines: frozenset[str] = frozenset()
    characteristics: frozenset[str] = frozenset()
    hours: tuple[Hours, ...] = ()
    on_days_off: bool = True
    urgent: bool = False
    repeat: timedelta = NEVER
    digest: timedelta = NEVER
    hold_off: timedelta = NEVER
    only: frozenset[int] | None = None

    def concerns(self, alarm: Raised) -> bool:
        """Tell if it is for this alarm."""
        return (
            (self.only is None or alarm.id in self.only)
            and (not self.kinds or alarm.kind in self.kinds)
            and (not self.tones or alarm.tone in self.tones)
            and (not self.machines or alarm.machine in self.machines)
            and (not self.characteristics or alarm.characteristic in self.characteristics)
        )

    def is_open(self, local: datetime, days_off: Container[date]) -> bool:
        """Tell if it is open at this moment of the plant's clock."""
        off = () if self.on_days_off else days_off
        if not self.hours:
            return local.date() not in off
        return any(hours.hold(local, off) for hours in self.hours)


@dataclass(frozen=True, slots=True)
class Receiver:
    """A person, or something, that is notified. quiet: when not; away_until: not before; last_at: its last message.

    unreached: the last message did not get there. busy: it must not be tried now, for it is being tried or pauses. spare: its
    last message is known to have had no alarm that stops a machine.
    """

    id: int
    quiet: tuple[Hours, ...] = ()
    away_until: datetime | None = None
    last_at: datetime | None = None
    unreached: bool = False
    busy: bool = False
    spare: bool = False

    def may_have_one(self, now: datetime, *, stops: bool) -> bool:
        """Tell if it may be sent a message now. stops: with an alarm in it that stops a machine, and is news to it."""
        waited = self.last_at is None or self.last_at + GAP <= now
        return not self.busy and (waited or (stops and self.spare))

    def listens(self, now: datetime, local: datetime, *, urgent: bool) -> bool:
        """Tell if it takes a message now."""
        if self.away_until is not None and now < self.away_until:
            return False
        return urgent or not any(hours.hold(local) for hours in self.quiet)


@dataclass(frozen=True, slots=True)
class Record:
    """The last notifications of receivers: of alarms by number, and of causes, both with the receiver's number."""

    alarms: Mapping[tuple[int, int], datetime] = field(default_factory=dict)
    causes: Mapping[tuple[tuple[str, str, str | None, int | None], int], datetime] = field(default_factory=dict)


class Notice(NamedTuple):
    """One message to be sent now: to whom, the alarms in it, oldest first, and those of them of which it is a reminder.

    unattended: the groups in which those on duty should have been notified of them, and nobody is.
    """

    receiver: int
    alarms: tuple[int, ...]
    again: frozenset[int]
    unattended: frozenset[int] = frozenset()


def notices(
    routes: Iterable[Route],
    receivers: Mapping[int, Receiver],
    alarms: Sequence[Raised],
    record: Record,
    now: datetime,
    zone: tzinfo,
    days_off: Container[date] = (),
    groups: Mapping[int, Group] = MappingProxyType({}),
) -> list[Notice]:
    """Messages that are due now, at most one for each receiver.

    alarms: the active ones. zone: of the plant, by whose clock hours are meant.
    """
    local = now.astimezone(zone)
    due: dict[int, dict[int, bool]] = defaultdict(
        dict
    )  # by receiver and alarm: whether a message has to leave for it now
    unattended = defaultdict[int, set[int]](set)
    for route in routes:
        if not route.is_open(local, days_off):
            continue
        for alarm in filter(route.concerns, alarms):
            since, empty = _begun(route, receivers, groups, alarm, now, local)
            for number, begun in since.items():
                receiver = receivers[number]
                at = _due_at(route, receiver, alarm, begun, record)
                if at is not None and at <= now and receiver.listens(now, local, urgent=route.urgent):
                    leaves = (alarm.id, number) in record.alarms or at + route.digest <= now
                    due[number][alarm.id] = due[number].get(alarm.id, False) or leaves
                    unattended[number] |= empty
    stopping = {alarm.id for alarm in alarms if alarm.tone == "stop"}
    found = []
    for number, of in sorted(due.items()):
        again = frozenset(each for each in of if (each, number) in record.alarms)
        stops = any(leaves and each in stopping and each not in again for each, leaves in of.items())
        if any(of.values()) and receivers[number].may_have_one(now, stops=stops):
            found.append(Notice(number, tuple(sorted(of)), again, frozenset(unattended[number])))
    return found


def _begun(
    route: Route,
    receivers: Mapping[int, Receiver],
    groups: Mapping[int, Group],
    alarm: Raised,
    now: datetime,
    local: datetime,
) -> tuple[dict[int, datetime], set[int]]:
    """The receivers of the steps that have begun, and since when; a step after such as cannot be reached begins with theirs.

    Of a group in which nobody is on duty there is nobody who can be reached; the second are those groups.
    """
    begun: dict[int, datetime] = {}
    empty: set[int] = set()
    no_one = False
    since = alarm.at
    for step in route.steps:
        if not no_one:
            since = alarm.at + step.after
            if since > now:
                break
        empty |= {number for number in step.on_duty if number in groups and not groups[number].on_duty(local)}
        known = [number for number in step.whom(groups, local) if number in receivers]
        for number in known:
            begun.setdefault(number, since)
        reachable = (receivers[number].listens(now, local, urgent=route.urgent) for number in known)
        no_one = all(receivers[number].unreached or not there for number, there in zip(known, reachable, strict=True))
    return begun, empty


def _due_at(route: Route, receiver: Receiver, alarm: Raised, begun: datetime, record: Record) -> datetime | None:
    """The moment to notify this receiver of this alarm; None: it was notified, and is not reminded."""
    last = record.alarms.get((alarm.id, receiver.id))
    if last is not None:
        return last + route.repeat if route.repeat else None
    before = record.causes.get((alarm.cause, receiver.id))
    return begun if before is None else max(begun, before + route.hold_off)


def pause_after(failures: int) -> timedelta:
    """Time before the next try after N failures in a row, at least one.

    >>> [pause_after(failures).total_seconds() for failures in (1, 2, 3, 99)]
    [10.0, 20.0, 40.0, 600.0]
    """
    return min(FIRST_PAUSE * float(1 << min(failures - 1, 30)), LONGEST_PAUSE)
