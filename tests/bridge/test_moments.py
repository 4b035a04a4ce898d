"""The clock of a control: by the time of day, by its date, by times in the future."""

from datetime import datetime, timedelta
from pathlib import Path

import pytest

from app.bridge.checking import check
from app.bridge.configuration import configuration_from
from app.bridge.links import Clock, Received
from app.bridge.moments import DAY, Prints, learn, learn_ahead, learn_date, measured_at, wrong_date
from app.core.printed_line import Printed
from app.core.ring import Slot, Unit
from app.simulators.controls import simulator_named
from app.simulators.controls.model import Model
from tests.loops import run

NOW = datetime(2026, 11, 24, 9, 30).astimezone()
TODAY = (9 * 60 + 30) * 60.0  # s
BEHIND = "The control's clock is a day behind the clock of the bridge's computer."


@pytest.mark.parametrize(("days", "words"), [(-1, BEHIND), (1, "a day ahead of"), (-366, "366 days behind"), (0, "")])
def test_a_date_that_is_wrong_is_said_and_times_of_readings_stay_right(days: int, words: str) -> None:
    clock = Clock()
    learn_date(clock, (NOW + timedelta(days=days, seconds=90)).replace(tzinfo=None), NOW)
    assert clock.offset == days * DAY + 90
    assert words in wrong_date(clock)
    assert bool(wrong_date(clock)) == bool(days)
    learn(clock, TODAY + 80, NOW)
    assert clock.offset == days * DAY + 80
    earlier = measured_at(clock, TODAY + 80 - 600, NOW, fresh=False)
    assert earlier == NOW - timedelta(seconds=600)


def test_a_zone_that_is_wrong_is_no_wrong_date() -> None:
    clock = Clock()
    learn_date(clock, (NOW - timedelta(hours=9)).replace(tzinfo=None), NOW)
    assert wrong_date(clock) == ""
    learn(clock, TODAY - 9 * 3600, NOW)
    assert clock.offset == -9 * 3600


def test_a_time_in_the_future_tells_of_the_clock_and_one_in_the_past_does_not() -> None:
    clock = Clock()
    bodies = [{}, {"measured_at": "soon"}, {"measured_at": (NOW - timedelta(days=1)).isoformat()}]
    received = [Received(str(number), dict(body)) for number, body in enumerate(bodies)]
    learn_ahead(clock, received, NOW)
    assert (clock.offset, wrong_date(clock)) == (None, "")
    ahead = Received("ahead", {"measured_at": (NOW + timedelta(days=1)).replace(tzinfo=None).isoformat()})
    learn_ahead(clock, [*received, ahead], NOW)
    assert clock.offset == DAY
    assert "a day ahead of" in wrong_date(clock)
    learn_ahead(clock, received, NOW)
    assert wrong_date(clock) == ""


@pytest.mark.parametrize("kind", ["haas", "opcua"])
def test_the_check_asks_a_control_for_its_date(kind: str, tmp_path: Path) -> None:
    async def said(ahead: float) -> str:
        secure = {"secure": False} if kind == "opcua" else {}
        module = simulator_named(kind)
        features = getattr(module, "FEATURES", Model().features)
        simulator = await module.serve(Model(features, clock_ahead=ahead), 0, **secure)
        try:
            table = simulator.table() | {"secret": "x", "patience": 30.0}
            table.pop("secret_file", None)
            content = {"server": {"url": "http://127.0.0.1:9"}, "machine": {"lathe-1": table}}
            return "\n".join(map(str, await check(configuration_from(content, tmp_path))))
        finally:
            await simulator.stop()

    assert f"✗ lathe-1: {BEHIND}" in run(said(-DAY))
    assert "clock" not in run(said(0.0))


def printed(*ages: float | None, first: int = 1, ahead: float = 0.0, now: datetime = NOW) -> list[Printed]:
    """Lines that were printed so long ago (s), by a clock that is so far ahead."""
    midnight = now.replace(hour=0, minute=0, second=0)
    today = (now - midnight).total_seconds() + ahead
    times = [None if age is None else float(round(today - age) % 86_400) for age in ages]
    return [Printed(7, Unit.MM, Slot(number, 1, 40.0, 0, 1, 3, 0, time)) for number, time in enumerate(times, first)]


def placed(
    prints: Prints, lines: list[Printed], *, at: float = 0.0, now: datetime = NOW, **other: float
) -> list[float | None]:
    """How long before now (s) each was measured."""
    found = prints.place(lines, now, at, other.get("since", 0.0))
    return [None if each is None else (now - each).total_seconds() for each in found]


def alone(prints: Prints, age: float, number: int, at: float, ahead: float = 0.0) -> float | None:
    """The age of a line that comes alone, behind a poll that brought nothing."""
    prints.place([], NOW, at - 0.25, 0.0)
    [found] = placed(prints, printed(age, first=number, ahead=ahead), at=at)
    return found


HOUR = [3600.0 - 300 * number for number in range(12)]


def test_lines_out_of_a_buffer_keep_the_times_that_they_were_printed_at() -> None:
    prints = Prints(Clock(), 0.25)
    lines = printed(*HOUR)
    del lines[5]  # damaged on its way, and printed again at the end
    assert placed(prints, lines + printed(*HOUR)[5:6]) == [*HOUR[:5], *HOUR[6:], HOUR[5]]
    assert prints.clock.offset is None, "they say nothing of the clock"
    assert placed(Prints(Clock(), 0.25), printed(*HOUR, ahead=1200)) == [age - 300 for age in HOUR], "not a day ago"
    assert placed(Prints(Clock(), 0.25), printed(*HOUR, now=(midnight := NOW.replace(hour=0))), now=midnight) == HOUR
    days = [200_000.0, 150_000.0, 70_000.0]
    assert placed(Prints(Clock(), 0.25), printed(*days)) == days
    assert placed(Prints(Clock(), 0.25), printed(60.0, 90.0, 0.0)) == [90.0, 90.0, 0.0], "set back half a minute"


def test_a_line_that_comes_alone_tells_of_the_clock_and_the_first_of_a_connection_does_not() -> None:
    prints = Prints(Clock(), 0.25)
    prints.place([], NOW, 9.8, 10.0)
    assert placed(prints, printed(0.0, ahead=-7200), at=10.0, since=10.0) == [7200.0], "it may have waited"
    assert alone(prints, 0.0, 2, 20.0, ahead=-7200) == 0.0
    assert prints.clock.offset == pytest.approx(-7200, abs=1)
    assert placed(prints, printed(*HOUR, first=3, ahead=-7200), at=21.0) == HOUR
    assert alone(prints, 0.0, 30, 30.0, ahead=-7190) == 0.0
    prints.place([], NOW, 40.0, 0.0)
    assert placed(prints, printed(9.0, 8.0, 7.0, first=31, ahead=-7180), at=40.2) == [2.0, 1.0, 0.0], "printed at once"
    assert alone(prints, 900.0, 20, 50.0, ahead=-7183) == pytest.approx(890, abs=15), "printed again, not just now"
    prints.place([], NOW, 60.0, 0.0)
    assert placed(prints, printed(None, first=34), at=60.2) == [0.0]
    assert placed(prints, printed(None, None, first=35), at=60.4) == [None, None]


def test_a_line_that_was_held_up_does_not_teach_the_clock_and_a_clock_that_was_set_does() -> None:
    prints = Prints(Clock(), 0.25)
    assert alone(prints, 0.0, 1, 10.0) == 0.0
    assert alone(prints, 300.0, 2, 20.0) == 300.0
    assert prints.clock.offset == 0.0
    assert alone(prints, 0.0, 3, 30.0) == 0.0
    assert alone(prints, 0.0, 4, 40.0, ahead=-3600) == 0.0, "the end of summer time"
    assert prints.clock.offset == 0.0
    assert alone(prints, 0.0, 5, 50.0, ahead=-3600) == 0.0
    assert prints.clock.offset == -3600.0
    assert alone(prints, 0.0, 6, 60.0, ahead=0) == 0.0
    assert alone(prints, 0.0, 7, 70.0, ahead=20) == 0.0
    assert prints.clock.offset == 20.0
    assert alone(prints, 0.0, 8, 80.0, ahead=400) == 0.0, "no line comes before it is printed"
    assert prints.clock.offset == 400.0


def test_a_line_some_minutes_ahead_is_not_of_the_day_before() -> None:
    clock = Clock(offset=0.0)
    assert measured_at(clock, TODAY + 590, NOW, fresh=False) == NOW
    assert measured_at(clock, TODAY + 7200, NOW, fresh=False) == NOW - timedelta(hours=22)
    prints = Prints(clock, 0.25)
    assert placed(prints, printed(-590.0)) == [0.0]
    assert prints.place(printed(60.0), NOW, 0.0, 0.0, NOW - timedelta(seconds=86_400 + 30)) == [
        NOW - timedelta(seconds=86_400 + 60)
    ], "the file was last written a day ago"
