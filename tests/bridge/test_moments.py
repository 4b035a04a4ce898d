"""The clock of a control: by the time of day, by its date, by times in the future."""

from datetime import datetime, timedelta
from pathlib import Path

import pytest

from app.bridge.checking import check
from app.bridge.configuration import configuration_from
from app.bridge.links import Clock, Received
from app.bridge.moments import DAY, learn, learn_ahead, learn_date, measured_at, wrong_date
from app.bridge.simulators import simulator_named
from app.bridge.simulators.model import Model
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
