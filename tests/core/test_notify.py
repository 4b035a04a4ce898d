"""Who is notified of what, and when: hours, steps, reminders, and never a flood."""

from datetime import UTC, date, datetime, time, timedelta
from itertools import pairwise
from zoneinfo import ZoneInfo

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.notify import (
    GAP,
    Group,
    Hours,
    Maintenance,
    Notice,
    Raised,
    Receiver,
    Record,
    Route,
    Step,
    Turn,
    after_maintenance,
    notices,
)
from tests.chance import examples

NOON = datetime(2026, 11, 26, 12, tzinfo=UTC)  # a Thursday
MINUTE, HOUR = timedelta(minutes=1), timedelta(hours=1)
EVERY_DAY = frozenset(range(1, 8))


def alarm(number: int = 1, at: datetime = NOON, kind: str = "tool_worn", characteristic: str = "shaft") -> Raised:
    return Raised(number, kind, "wear", "lathe", characteristic, 3, at)


def route(*steps: tuple[float, int], **more: object) -> Route:
    made = tuple(Step(timedelta(minutes=after), (receiver,)) for after, receiver in steps or [(0, 1)])
    return Route(made, **more)  # type: ignore[arg-type]


def due(
    routes: list[Route],
    now: datetime,
    alarms: list[Raised] | None = None,
    record: Record | None = None,
    **receiver: object,
) -> list[Notice]:
    receivers = {1: Receiver(1, **receiver), 2: Receiver(2), 3: Receiver(3)}  # type: ignore[arg-type]
    return notices(routes, receivers, [alarm()] if alarms is None else alarms, record or Record(), now, UTC)


def to(found: list[Notice]) -> list[int]:
    return [notice.receiver for notice in found]


class TestHours:
    @pytest.mark.parametrize(
        ("days", "begins", "ends", "at", "inside"),
        [
            ({4}, 6, 14, (26, 12), True),
            ({4}, 6, 14, (26, 14), False),
            ({4}, 6, 14, (26, 6), True),
            ({3}, 6, 14, (26, 12), False),
            ({4}, 22, 6, (26, 23), True),
            ({4}, 22, 6, (27, 5), True),  # the night that begins on Thursday
            ({4}, 22, 6, (26, 5), False),  # the one that began on Wednesday
            ({4}, 22, 6, (27, 6), False),
            ({4}, 6, 6, (27, 5), True),  # all day, from six to six
            ({4}, 0, 0, (26, 0), True),
            ({4}, 0, 0, (27, 0), False),
        ],
    )
    def test_a_part_of_the_week(
        self, days: set[int], begins: int, ends: int, at: tuple[int, int], inside: bool
    ) -> None:
        hours = Hours(frozenset(days), time(begins), time(ends))
        assert hours.hold(datetime(2026, 11, *at, tzinfo=UTC)) is inside

    def test_a_night_that_begins_on_a_day_off_is_off_until_its_end(self) -> None:
        night, off = Hours(EVERY_DAY, time(22), time(6)), {date(2026, 11, 26)}
        assert not night.hold(NOON + 11 * HOUR, off)
        assert not night.hold(NOON + 17 * HOUR, off)
        assert night.hold(NOON - 7 * HOUR, off), "it began on the day before"

    def test_a_route_is_closed_beyond_its_hours_and_on_days_off(self) -> None:
        early = route(hours=(Hours(frozenset({1, 2, 3, 4, 5}), time(6), time(14)),), on_days_off=False)
        assert to(due([early], NOON)) == [1]
        assert due([early], NOON + 2 * HOUR) == []
        assert notices([early], {1: Receiver(1)}, [alarm()], Record(), NOON, UTC, {NOON.date()}) == []
        assert (
            notices([route(on_days_off=False)], {1: Receiver(1)}, [alarm()], Record(), NOON, UTC, {NOON.date()}) == []
        )

    @pytest.mark.parametrize(("month", "day"), [(3, 29), (10, 25)])  # the night before begins on the 28th, the 24th
    def test_quiet_hours_end_by_the_clock_when_it_changes(self, month: int, day: int) -> None:
        plant, night = ZoneInfo("Europe/Belgrade"), Hours(EVERY_DAY, time(22), time(6))
        begin = datetime(2026, month, day - 1, 21, 30, tzinfo=plant).astimezone(UTC)
        looks = [begin + n * 30 * MINUTE for n in range(24)]
        quiet = [at for at in looks if night.hold(at.astimezone(plant))]
        assert quiet[0].astimezone(plant).time() == time(22)
        assert quiet[-1].astimezone(plant).time() == time(5, 30)
        assert len(quiet) == {3: 14, 10: 18}[month], "seven hours in spring, nine in autumn"

    def test_quiet_hours_put_off_what_is_not_urgent(self) -> None:
        quiet = (Hours(EVERY_DAY, time(11), time(13)),)
        assert due([route()], NOON, quiet=quiet) == []
        assert to(due([route()], NOON + HOUR, quiet=quiet)) == [1]
        assert to(due([route(urgent=True)], NOON, quiet=quiet)) == [1]
        assert due([route(urgent=True)], NOON, away_until=NOON + HOUR) == []


class TestMaintenance:
    """From noon to one; the alarm comes ten minutes after noon."""

    AT = NOON + 10 * MINUTE

    def left(self, now: datetime, *windows: Maintenance, tone: str = "wear") -> list[Raised]:
        return after_maintenance([Raised(1, "x", tone, "lathe", None, None, self.AT)], windows, now)

    @pytest.mark.parametrize(
        ("machine", "minutes", "tone", "anyway", "withheld"),
        [
            ("lathe", 10, "wear", True, True),
            (None, 10, "wear", True, True),
            ("mill", 10, "wear", True, False),
            ("lathe", 10, "stop", True, False),
            ("lathe", 10, "stop", False, True),
            ("lathe", 59.9, "wear", True, True),
            ("lathe", 60, "wear", True, False),
        ],
    )
    def test_it_withholds(self, machine: str | None, minutes: float, tone: str, anyway: bool, withheld: bool) -> None:
        window = Maintenance(machine, NOON, NOON + HOUR, anyway)
        assert (self.left(NOON + minutes * MINUTE, window, tone=tone) == []) is withheld

    def test_what_is_planned_withholds_nothing_yet(self) -> None:
        window = Maintenance("lathe", NOON + HOUR, NOON + 2 * HOUR)
        assert [each.at for each in self.left(NOON + 59 * MINUTE, window)] == [self.AT]

    def test_its_steps_begin_when_it_has_ended(self) -> None:
        windows = [Maintenance("lathe", NOON, NOON + HOUR), Maintenance(None, NOON + HOUR, NOON + 2 * HOUR)]
        assert self.left(NOON + HOUR, *windows) == []
        steps = [route((0, 1), (10, 2))]
        assert to(due(steps, NOON + 2 * HOUR, self.left(NOON + 2 * HOUR, *windows))) == [1], "nobody is passed over"
        later = NOON + 2 * HOUR + 10 * MINUTE
        assert to(due(steps, later, self.left(later, *windows), Record({(1, 1): NOON + 2 * HOUR}))) == [2]

    def test_what_is_over_before_the_alarm_delays_nothing(self) -> None:
        window = Maintenance("lathe", NOON - HOUR, NOON)
        assert [each.at for each in self.left(self.AT, window)] == [self.AT]


class TestMinute:
    """One message in a minute, and one more where an alarm stops a machine."""

    STOP, WEAR = (Raised(number, "x", tone, "lathe", None, number, NOON) for number, tone in ((1, "stop"), (2, "wear")))

    @pytest.mark.parametrize(
        ("alarms", "spare", "seconds", "sent"),
        [
            ([WEAR], True, 59, False),
            ([WEAR], True, 60, True),
            ([STOP], True, 1, True),
            ([STOP], False, 59, False),
            ([WEAR, STOP], True, 1, True),
        ],
    )
    def test_what_stops_does_not_wait_where_the_message_before_had_none(
        self, alarms: list[Raised], spare: bool, seconds: int, sent: bool
    ) -> None:
        now = NOON + timedelta(seconds=seconds)
        found = due([route()], now, alarms, last_at=NOON, spare=spare)
        assert [notice.alarms for notice in found] == [tuple(sorted(each.id for each in alarms))] * sent

    def test_neither_a_reminder_nor_one_that_is_being_tried_goes_before_its_minute(self) -> None:
        record = Record({(1, 1): NOON - HOUR})
        assert due([route(repeat=MINUTE)], NOON, [self.STOP], record, last_at=NOON - MINUTE / 2, spare=True) == []
        assert due([route()], NOON, [self.STOP], last_at=NOON - MINUTE / 2, spare=True, busy=True) == []


class TestWhom:
    def test_only_the_alarms_that_a_route_names(self) -> None:
        for name, mine, other in (
            ("kinds", "tool_worn", "oversize"),
            ("tones", "wear", "stop"),
            ("machines", "lathe", "mill"),
            ("characteristics", "shaft", "bore"),
        ):
            assert to(due([route(**{name: frozenset({mine})})], NOON)) == [1]
            assert due([route(**{name: frozenset({other})})], NOON) == []

    def test_the_next_step_follows_after_its_minutes(self) -> None:
        steps, told = route((0, 1), (10, 2)), Record({(1, 1): NOON})
        assert due([steps], NOON + 9 * MINUTE, record=told) == []
        assert to(due([steps], NOON + 10 * MINUTE, record=told)) == [2]

    def test_the_next_step_follows_at_once_where_nobody_can_be_reached(self) -> None:
        assert to(due([route((0, 1), (10, 2), (20, 3))], NOON, unreached=True, busy=True)) == [2]

    def test_away_or_in_quiet_hours_nobody_is_reached_either(self) -> None:
        steps, quiet = route((0, 1), (10, 2)), (Hours(EVERY_DAY, time(22), time(13)),)
        assert to(due([steps], NOON, away_until=NOON + HOUR)) == [2]
        assert to(due([steps], NOON, quiet=quiet)) == [2]
        assert to(due([route((0, 1), (10, 2), urgent=True)], NOON, quiet=quiet)) == [1], "it goes through quiet hours"

    def test_a_digest_of_a_step_that_stands_in_ends_with_its_minutes(self) -> None:
        steps = route((0, 1), (30, 2), digest=5 * MINUTE)
        assert due([steps], NOON + 4 * MINUTE, unreached=True, busy=True) == []
        assert to(due([steps], NOON + 5 * MINUTE, unreached=True, busy=True)) == [2]

    def test_a_receiver_that_is_gone_is_passed_over(self) -> None:
        assert to(due([route((0, 9), (10, 2))], NOON)) == [2]

    def test_two_routes_to_one_receiver_are_one_message(self) -> None:
        assert due([route(), route()], NOON) == [Notice(1, (1,), frozenset())]


class TestWhen:
    def test_it_is_repeated_until_acknowledged(self) -> None:
        told = Record({(1, 1): NOON})
        assert due([route(repeat=5 * MINUTE)], NOON + 4 * MINUTE, record=told) == []
        assert due([route(repeat=5 * MINUTE)], NOON + 5 * MINUTE, record=told) == [Notice(1, (1,), frozenset({1}))]
        assert due([route()], NOON + 999 * MINUTE, record=told) == [], "once is enough where nothing is repeated"
        assert due([route(repeat=5 * MINUTE)], NOON + 5 * MINUTE, [], told) == [], "acknowledged"

    def test_a_chattering_alarm_is_one(self) -> None:
        again, told = alarm(2, NOON + MINUTE), Record({}, {(alarm().cause, 1): NOON})
        held = route(hold_off=15 * MINUTE)
        assert due([held], NOON + 2 * MINUTE, [again], told) == []
        assert to(due([held], NOON + 15 * MINUTE, [again], told)) == [1]
        assert to(due([held], NOON + 2 * MINUTE, [alarm(2, characteristic="bore")], told)) == [1]

    def test_a_digest_gathers(self) -> None:
        slow = route(digest=HOUR)
        both = [alarm(), alarm(2, NOON + 50 * MINUTE, characteristic="bore")]
        assert due([slow], NOON + 59 * MINUTE, both) == []
        assert due([slow], NOON + HOUR, both) == [Notice(1, (1, 2), frozenset())]
        assert due([slow], NOON + HOUR, both[1:]) == [], "the first was acknowledged meanwhile"

    def test_a_message_waits_for_the_minute(self) -> None:
        assert due([route()], NOON, last_at=NOON - 59 * timedelta(seconds=1)) == []
        assert to(due([route()], NOON, last_at=NOON - GAP)) == [1]
        assert due([route()], NOON, busy=True) == []


def play(
    routes: list[Route], raised: list[tuple[Raised, datetime | None]], until: datetime
) -> list[tuple[datetime, Notice]]:
    """Every message, looked for every ten seconds. raised: alarms and when each is acknowledged."""
    now, sent = NOON, list[tuple[datetime, Notice]]()
    told: dict[tuple[int, int], datetime] = {}
    causes: dict[tuple[tuple[str, str, str | None, int | None], int], datetime] = {}
    last: dict[int, datetime] = {}
    by_id = {each.id: each for each, _end in raised}
    while now <= until:
        active = [each for each, end in raised if each.at <= now and (end is None or now < end)]
        receivers = {number: Receiver(number, last_at=last.get(number)) for number in (1, 2)}
        for notice in notices(routes, receivers, active, Record(told, causes), now, UTC):
            sent.append((now, notice))
            last[notice.receiver] = now
            for number in notice.alarms:
                told[number, notice.receiver] = now
                causes[by_id[number].cause, notice.receiver] = now
        now += timedelta(seconds=10)
    return sent


def test_a_thousand_alarms_in_a_minute_are_two_messages() -> None:
    many: list[tuple[Raised, datetime | None]] = [
        (alarm(n, NOON + timedelta(milliseconds=60 * n), characteristic=f"c{n}"), None) for n in range(1000)
    ]
    sent = play([route()], many, NOON + 5 * MINUTE)
    assert [(at - NOON, len(notice.alarms)) for at, notice in sent] == [(timedelta(0), 1), (MINUTE, 999)]


MOMENTS = st.integers(0, 60).map(lambda tens: NOON + timedelta(seconds=10 * tens))
ALARMS = st.lists(st.tuples(MOMENTS, st.none() | st.integers(1, 600), st.sampled_from("abc")), max_size=8)
ROUTES = st.lists(
    st.builds(
        lambda first, second, after, repeat, hold_off, digest: Route(
            (Step(first, (1,)), Step(first + after, (second,))), repeat=repeat, hold_off=hold_off, digest=digest
        ),
        *[st.sampled_from([timedelta(0), 2 * MINUTE]), st.sampled_from([1, 2])],
        *[st.sampled_from([timedelta(0), MINUTE, 5 * MINUTE]) for _each in range(4)],
    ),
    min_size=1,
    max_size=3,
)


@examples(25)
@given(ROUTES, ALARMS)
def test_whatever_comes(routes: list[Route], drawn: list[tuple[datetime, int | None, str]]) -> None:
    raised = [
        (alarm(number, at, characteristic=name), None if lasts is None else at + timedelta(seconds=lasts))
        for number, (at, lasts, name) in enumerate(drawn)
    ]
    end = NOON + timedelta(minutes=25)
    sent = play(routes, raised, end)
    ends = {each.id: until for each, until in raised}
    for receiver in (1, 2):
        times = [at for at, notice in sent if notice.receiver == receiver]
        assert all(later - earlier >= GAP for earlier, later in pairwise(times)), "one a minute"
    for at, notice in sent:
        assert notice.alarms
        for number in notice.alarms:
            ended = ends[number]
            assert ended is None or at < ended, "nothing of what is acknowledged"
            assert at >= raised[number][0].at
    reached = {number for _at, notice in sent if notice.receiver == 1 for number in notice.alarms}
    assert reached >= {number for number, until in ends.items() if until is None}, "what stays active is announced"
    if not any(each.repeat for each in routes):
        told = [(notice.receiver, number) for _at, notice in sent for number in notice.alarms]
        assert len(told) == len(set(told)), "once"


class TestGroups:
    EARLY, LATE = Hours(EVERY_DAY, time(6), time(14)), Hours(EVERY_DAY, time(14), time(22))
    SETTERS = Group((1, 2), (Turn((1,), EARLY), Turn((2,), LATE, first=date(2026, 11, 26))))

    def found(self, now: datetime, *steps: Step, **of_first: object) -> list[Notice]:
        receivers = {1: Receiver(1, **of_first), 2: Receiver(2), 3: Receiver(3)}  # type: ignore[arg-type]
        return notices([Route(steps)], receivers, [alarm()], Record(), now, UTC, groups={7: self.SETTERS})

    def named(self, now: datetime, *steps: Step, **of_first: object) -> list[int]:
        return to(self.found(now, *steps, **of_first))

    def test_a_group_is_all_who_are_in_it(self) -> None:
        assert self.named(NOON, Step(timedelta(0), (3,), groups=(7,))) == [1, 2, 3]

    def test_one_who_is_on_duty_is_notified_alone(self) -> None:
        duty = Step(timedelta(0), (), on_duty=(7,))
        assert self.named(NOON, duty) == [1]
        assert self.named(NOON + 2 * HOUR, duty) == [2], "an alarm that is still active goes to the next shift"

    def test_where_nobody_is_on_duty_or_can_be_reached_the_next_step_begins_at_once(self) -> None:
        steps = Step(timedelta(0), (), on_duty=(7,)), Step(HOUR * 24, (3,))
        assert self.named(NOON, *steps) == [1]
        assert self.named(NOON + 10 * HOUR, *steps) == [3], "22:00: nobody is on duty"
        (late,) = self.found(NOON + 10 * HOUR, *steps)
        assert late.unattended == {7}, "the message says so"
        assert self.named(NOON, *steps, away_until=NOON + HOUR) == [3]

    def test_a_turn_is_kept_from_its_first_day_to_its_last_as_it_begins(self) -> None:
        night = Turn((1,), Hours(EVERY_DAY, time(22), time(6)), date(2026, 11, 26), date(2026, 11, 26))
        days = [datetime(2026, 11, day, hour, tzinfo=UTC) for day, hour in ((26, 5), (26, 23), (27, 5), (27, 23))]
        assert [night.holds(moment) for moment in days] == [False, True, True, False]
