"""The rule of control plans: which measurement is due, and which was missed."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.control_plan import (
    PAUSE,
    By,
    Due,
    Event,
    Judged,
    Moment,
    Plan,
    Ran,
    Tightened,
    in_time,
    judged,
    ran,
    rhythm,
)

OWN, OTHER, THIRD = 1, 2, 3
NOW = Moment(10_000.0, OWN)


def state(plan: Plan, since: Ran, change: int | None = None, alarm: int | None = None, *, shift: bool = True) -> Judged:
    return judged(plan, rhythm(plan, events(change, alarm)), since, in_this_shift=shift)


def events(change: int | None, alarm: int | None) -> list[Event]:
    readings = {Tightened.TOOL_CHANGE: change, Tightened.ALARM: alarm}
    return [Event(why, 0.0, count) for why, count in readings.items() if count is not None]


def cuts(*parts: str | None, source: int = OTHER, every: float = 60.0) -> list[Moment]:
    return [Moment(every * (at + 1), source, part) for at, part in enumerate(parts)]


def since(plan: Plan, others: list[Moment], last: str | None = "P1") -> Ran:
    return ran(plan, Moment(0.0, OWN, last), others, now=NOW)


def test_parts_are_known_by_the_other_characteristics_of_the_part() -> None:
    plan = Plan(every=2)
    assert since(plan, []).parts is None, "nothing tells, so nothing is missed"
    assert state(plan, Ran()).due is Due.LATER
    assert since(plan, cuts("P1")).parts == 0, "of the part that was measured itself"
    assert since(plan, cuts("P1", "P2")).parts == 0, "it is being worked on"
    assert since(plan, cuts("P2", "P2", "P3")).parts == 1, "a part counts once, however often it is touched"
    assert since(plan, cuts("P2", "P3", "P4")).parts == 2
    assert [state(plan, Ran(parts)).due for parts in (0, 1, 2)] == [Due.LATER, Due.DUE, Due.MISSED]
    assert state(plan, Ran(2))[1:] == (By.PARTS, 1, 2)


def test_parts_without_names_are_counted_by_the_characteristic_that_is_measured_most() -> None:
    twice = [*cuts(None, None, None), *cuts(None, None, source=THIRD)]
    assert since(Plan(every=2), twice, None).parts == 2


def test_numbers_tell_of_parts_only_where_the_plan_says_so() -> None:
    assert since(Plan(every=2, numbered=True), cuts("P9"), "P1").parts == 7
    assert since(Plan(every=2), cuts("P9"), "P1").parts == 0
    closed = ran(Plan(numbered=True), Moment(0.0, OWN, "P1"), [], now=Moment(9.0, OWN, "P4"), closed=True)
    assert closed.parts == 2
    late = ran(
        Plan(numbered=True),
        Moment(0.0, OWN, "P1"),
        [],
        now=Moment(9.0, OWN, "P4"),
        closed=True,
        measured=frozenset({"P2"}),
    )
    assert late.parts == 1, "that one was measured, in another order"


def test_parts_on_their_way_to_the_gauge_are_not_missed() -> None:
    plan = Plan(every=1, on_the_way=3)
    assert state(plan, Ran(3)).due is Due.DUE
    assert state(plan, Ran(4)).due is Due.MISSED


def test_minutes_count_while_the_machine_runs() -> None:
    plan = Plan(minutes=30)
    steady = since(plan, cuts(*("P",) * 31))
    assert steady.minutes == 31
    assert state(plan, steady) == Judged(Due.MISSED, By.MINUTES, 1)
    break_ = [Moment(60.0, OTHER, "P2"), Moment(60.0 + PAUSE + 1, OTHER, "P3"), Moment(120.0 + PAUSE + 1, OTHER, "P4")]
    assert since(plan, break_).minutes == 2, "nobody knows that it ran during the break"
    assert state(plan, Ran(None, 0.0)).due is Due.LATER


def test_once_in_each_shift_in_which_the_part_is_made() -> None:
    plan, last, now = Plan(per_shift=True), Moment(0.0, OWN, "P1", 0.0), Moment(300.0, OWN, None, 200.0)
    made = [Moment(50.0, OTHER, "P2", 0.0), Moment(250.0, OTHER, "P3", 200.0)]
    assert ran(plan, last, made, now=now).shifts == 0, "nothing was made in the shift between"
    assert state(plan, Ran(), shift=False) == Judged(Due.DUE, By.SHIFT, 1)
    between = [*made, Moment(150.0, OTHER, "P9", 100.0)]
    assert state(plan, ran(plan, last, between, now=now)).by is By.SHIFT


@pytest.mark.parametrize(
    ("change", "alarm", "every", "why"),
    [
        (None, None, 10, None),
        (0, None, 1, Tightened.TOOL_CHANGE),
        (2, None, 1, Tightened.TOOL_CHANGE),
        (3, None, 10, None),
        (3, 4, 1, Tightened.ALARM),
        (3, 5, 10, None),
    ],
)
def test_it_is_tightened_after_a_tool_change_and_an_alarm(
    change: int | None, alarm: int | None, every: int, why: Tightened | None
) -> None:
    plan = Plan(every=10, after_change=3, after_alarm=5)
    assert rhythm(plan, events(change, alarm))[:2] == (every, why)
    assert state(plan, Ran(5, parts_after=5), change, alarm).due is (Due.MISSED if why else Due.LATER)


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("names", [("P2", "P3", "P4", "P5", "P6", "P7", "P8"), (None,) * 7])
@pytest.mark.parametrize("numbered", [False, True])
def test_an_event_asks_for_no_part_that_was_cut_before_it(
    numbered: bool, names: tuple[str | None, ...], closed: bool
) -> None:
    """P1 is measured, P2 … P6 are cut as planned, then the tool is changed."""
    plan = Plan(every=10, after_change=3, numbered=numbered)
    name = names[0] and "P1"
    change = Event(Tightened.TOOL_CHANGE, 330.0, 0)

    def verdict(cut: int) -> Judged:
        others = cuts(*names[:cut])
        now = Moment(9_000.0, OWN, (names[cut - 1] if closed else None))
        found = ran(plan, Moment(0.0, OWN, name), others, now=now, closed=closed, event=change.at)
        return judged(plan, rhythm(plan, [change]), found, in_this_shift=True, closed=closed)

    assert verdict(5).due is not Due.MISSED
    assert verdict(6).due is not Due.MISSED, "the first one after it is being worked on"
    assert verdict(7) == Judged(Due.MISSED, By.PARTS, 1, 1), "it was left out"
    late = [Moment(60.0 * at, OTHER, f"X{at}") for at in range(1, 12)]
    found = ran(plan, Moment(0.0, OWN, name), late, now=NOW, event=change.at)
    assert judged(plan, rhythm(plan, [change]), found, in_this_shift=True).every == 10, (
        "what the plan asks for counts on"
    )


def test_of_several_events_every_part_counts_from_the_first_that_holds() -> None:
    plan = Plan(after_change=3, after_alarm=3)
    both = [Event(Tightened.TOOL_CHANGE, 5.0, 1), Event(Tightened.ALARM, 9.0, 0), Event(Tightened.ALARM, 1.0, 3)]
    assert rhythm(plan, both) == (1, Tightened.ALARM, 5.0)


def test_a_reading_that_comes_late_moves_nothing() -> None:
    begin, late, newest = (4, Moment(300.0, OWN, "P5")), (5, Moment(60.0, OWN, "P1")), (6, Moment(360.0, OWN, "P6"))
    assert in_time([late], begin) == [begin]
    assert in_time([newest, late], begin) == [begin, newest]
    between = (7, Moment(330.0, OWN, "P5b"))
    assert in_time([newest, between], begin) == [begin, between, newest], "by time, not by arrival"


def test_readings_at_the_same_moment_need_no_names() -> None:
    assert since(Plan(every=2), [*cuts("P2"), *cuts(None), *cuts("P3")]).parts == 1


def test_a_clock_that_is_ahead_hides_no_part() -> None:
    plan, last, now = Plan(every=1, per_shift=True), Moment(500.0, OWN, "P1", 0.0), Moment(400.0, OWN, None, 0.0)
    others = [Moment(560.0, OTHER, "P2", 0.0), Moment(620.0, OTHER, "P3", 600.0), Moment(680.0, OTHER, "P4", 600.0)]
    found = ran(plan, last, others, now=now)
    assert (found.parts, found.shifts) == (2, 0), "a shift that has not begun is not over"


def test_without_a_rule_nothing_is_planned() -> None:
    assert state(Plan(on_the_way=3, numbered=True), Ran(100, 1000.0, 4)).due is Due.NOT_PLANNED


@given(
    st.integers(1, 20),
    st.lists(st.tuples(st.integers(1, 60), st.booleans()), max_size=60),
)
def test_it_is_missed_exactly_when_so_many_parts_in_a_row_were_not_measured(
    every: int, parts: list[tuple[int, bool]]
) -> None:
    """Against a plain count: named parts one after the other, of which some are measured."""
    at, last, others, skipped = 0.0, Moment(0.0, OWN, "start"), list[Moment](), 0
    for number, (pause, is_measured) in enumerate(parts):
        at += pause
        others.append(Moment(at, OTHER, f"part {number} x"))
        now = Moment(at, OWN, f"part {number} x")
        found = ran(Plan(every=every), last, others, now=now, closed=is_measured)
        assert found.parts == skipped
        verdict = judged(Plan(every=every), rhythm(Plan(every=every)), found, in_this_shift=True, closed=is_measured)
        assert (verdict.due is Due.MISSED) == (skipped >= every)
        if is_measured:
            last, others, skipped = now, [], 0
        else:
            skipped += 1
