"""Mistakes of people and plants, over each way in: every one ends in the alarm that names tool and cause.

A machine with six tools (`bench.outcome`): two with two characteristics, one with a sister, one without a location.
"""

import random
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple, cast

import pytest

from app.core.ring import Unit
from app.jobs.actions import run_jobs
from app.loop.tools.jobs import JOBS
from app.loop.tools.untaken import Watch
from app.simulators.controls.model import UNMAPPED, Model, Steps
from app.simulators.controls.mqtt import mosquitto
from app.simulators.controls.opcua import Nc
from bench.outcome import TOLERANCE, Play, Process
from tests.bridge.test_outcome import START, applied, play
from tests.loop.connections.test_alarms import gap, later
from tests.loop.tools.test_untaken import age_corrections
from tests.servers import TLS, Server
from tests.shop import Shop

WAYS = ["rest", "haas", "haas direct", "heidenhain", "mqtt", "opcua", "opcua direct"]
INCHES = ["haas", "heidenhain", "opcua direct"]
"""Whose control works in inches as well: it shows, prints and takes them."""
TOOLS = (1, 2, 3, 4, 5)
OUTAGE = range(4, 12)  # parts, within an hour
NOTHING = 20  # parts within which a gain of 0 is reported on every tool
RADIUS = 30  # parts within which a gain of 2 is reported on every tool
RADIUS_BY_REST = 16


class Mistake(NamedTuple):
    """A mistake, and what has to be said of each of these tools: the words of an alarm, by its kind. parts: until then."""

    parts: int
    says: Mapping[str, str]
    begin: Callable[[Play, pytest.MonkeyPatch], None]
    jobs: Callable[[Server, Play], None]
    tools: tuple[int, ...] = TOOLS
    without_server: range = range(0)


def amiss(factor: float, start: float, one: Play, _patch: pytest.MonkeyPatch) -> None:
    """Let corrections do something else at the control than what they say."""
    one.process.amiss, one.process.start = factor, start


def nobody_takes(one: Play, patch: pytest.MonkeyPatch) -> None:
    """The call is missing in the part program; where the bridge writes by itself, the control says that it is at work with tool 3."""

    def never(_process: Process) -> Steps:
        yield

    def busy(process: Process) -> Steps:
        yield from Model.part(process)
        process.running = True

    def at_work(control: Nc) -> None:
        shown(control)
        control.running, control.tool = True, 3

    shown = Nc.copy
    if one.corrections == "direct":
        patch.setattr(Process, "part", busy)
        patch.setattr(Nc, "copy", at_work)
    else:
        patch.setattr(Process, "take_corrections", never)


def an_hour(one: Play, _patch: pytest.MonkeyPatch) -> None:
    """The parts of the outage were cut between 58 and 6 minutes ago, those before it earlier, those behind it now."""
    one.ago = lambda part: (
        62.0 if part < OUTAGE.start else 58 - 6.5 * (part - OUTAGE.start) if part < OUTAGE.stop else 0.0
    )


def gains(server: Server, _one: Play) -> None:
    run_jobs(server.database, JOBS)


def not_taken(server: Server, one: Play) -> None:
    """Corrections have waited for 50 minutes, and the server has looked all the time."""
    age_corrections(server.database.dsn, one.machine, 50)
    clock = iter(range(0, 10_000, 240))
    watch = Watch(1800.0, 5, lambda: float(next(clock)))
    for _ in range(10):
        run_jobs(server.database, [watch.job()])


def as_shop(server: Server, one: Play) -> Shop:
    return cast("Shop", SimpleNamespace(server=server, machine=one.machine, call=one.call, alarms=partial(said, one)))


def was_away(server: Server, one: Play) -> None:
    gap(as_shop(server, one), 60)


MISTAKES = {
    "wrong sign": Mistake(
        8,
        {"opposite_effect": "the wrong way: correction", "tool_worn": "The size went the wrong way: correction"},
        partial(amiss, -1.0, START),
        gains,
    ),
    "radius for diameter": Mistake(
        RADIUS,
        {"unusual_gain": "act too strongly: gain +", "strong_effect": "act too strongly: the gain is +"},
        partial(amiss, 2.0, START),
        gains,
    ),
    "no effect": Mistake(NOTHING, {"unusual_gain": "change nothing: gain"}, partial(amiss, 0.0, START), gains),
    "no location": Mistake(
        6, {"corrections_not_taken": "has no [[machine."}, lambda _one, _patch: None, not_taken, tools=(UNMAPPED,)
    ),
    "nobody takes": Mistake(9, {"corrections_not_taken": "The machine does not take"}, nobody_takes, not_taken),
    "server away": Mistake(
        14,
        {"server_away": "in that time no correction and no stop reached this machine"},
        an_hour,
        was_away,
        tools=(),
        without_server=OUTAGE,
    ),
}


def said(one: Play) -> list[dict[str, Any]]:
    items: list[dict[str, Any]] = one.call("GET", f"/alarms?state=active&limit=200&machine={one.machine}")["items"]
    return items


def after(
    server: Server,
    folder: Path,
    patch: pytest.MonkeyPatch,
    mistake: str,
    way: str,
    unit: Unit = Unit.MM,
    parts: int | None = None,
) -> Play:
    """The machine after the parts of a mistake, or so many, when the jobs of the server have run. unit: of its control."""
    if way == "mqtt" and mosquitto() is None:
        pytest.skip("mosquitto is not installed")
    made = MISTAKES[mistake]
    one = play(server, way, parts or made.parts)
    one.eventful, one.process.unit = False, unit
    made.begin(one, patch)
    secret = one.set_up()
    if way == "rest":
        one.at_once(without_server=made.without_server, takes=mistake != "nobody takes")
    else:
        one.over_bridge(server.url, secret, folder, TLS, without_server=made.without_server)
    made.jobs(server, one)
    return one


def named(one: Play, mistake: str) -> None:
    """Assert that an alarm names each tool and the cause."""
    made = MISTAKES[mistake]
    says: Mapping[str, str] = made.says
    tools: tuple[int | None, ...] = made.tools or (None,)
    if mistake == "no location" and one.kind == "rest":
        says = {"corrections_not_taken": "The machine does not take"}  # what no bridge carries
    if mistake == "nobody takes" and one.process.running:
        tools = (3,) if one.kind == "opcua" else tools
    for tool in tools:
        texts = [each["text"] for each in said(one) if each["kind"] in says and each["tool_memory"] == tool]
        assert texts, (tool, [(each["kind"], each["tool_memory"]) for each in said(one)])
        for each in said(one):
            if each["kind"] in says and each["tool_memory"] == tool:
                assert says[each["kind"]] in each["text"]
                assert tool is None or f"tool {tool}" in each["text"]


def reported(one: Play) -> None:
    """Assert that the parts that are out are those that the wear alone takes out, and that *oversize* has counted every one."""
    told = {each["characteristic"]: each["count"] for each in said(one) if each["kind"] == "oversize"}
    assert "undersize" not in {each["kind"] for each in said(one)}
    for number in one.judged:
        sizes = one.process.sizes[number]
        out = [part for part, size in enumerate(sizes, 1) if abs(size) > TOLERANCE]
        assert out == worn_out(one, number), "no correction has made it worse"
        assert 15 <= len(out) <= 17, "of twenty: the first is 6 µm off and the fourth 2 µm more"
        assert abs(told[one.keys[number]] - len(out)) <= 1, "a size on the limit is rounded at the control"


def worn_out(one: Play, number: int) -> list[int]:
    """The parts that are out of tolerance where nothing corrects the tool."""
    process = one.process
    feature = next(each for each in process.features if each.number == number)
    scatter = (random.Random(f"{number} {part}").gauss(0.0, feature.noise) for part in range(1, one.parts + 1))
    sizes = (process.start + feature.wear * part + chance for part, chance in enumerate(scatter, 1))
    return [part for part, size in enumerate(sizes, 1) if abs(size) > TOLERANCE]


@pytest.mark.parametrize("mistake", sorted(MISTAKES.keys() - {"no effect"}))  # that takes too many parts
def test_each_mistake_ends_in_the_alarm_that_names_it(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mistake: str
) -> None:
    """By REST, and where it takes a bridge over one; the long test goes over every way."""
    way = "heidenhain" if mistake in {"no location", "nobody takes"} else "rest"
    parts = RADIUS_BY_REST if mistake == "radius for diameter" else None
    named(after(server, tmp_path, monkeypatch, mistake, way, parts=parts), mistake)


@pytest.mark.long
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("mistake", sorted(MISTAKES))
def test_over_each_way_in(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mistake: str, way: str
) -> None:
    one = after(server, tmp_path, monkeypatch, mistake, way)
    named(one, mistake)
    if mistake == "no effect":
        reported(one)
    if mistake == "wrong sign":
        assert max(applied(one).values()) <= 2
    if mistake == "server away":
        [outcome] = later(as_shop(server, one), 5)["outcome"]
        assert f"{len(OUTAGE) * len(one.keys)} readings came late" in outcome["text"]


@pytest.mark.long
@pytest.mark.parametrize("way", INCHES)
@pytest.mark.parametrize("mistake", sorted(MISTAKES))
def test_at_a_control_that_works_in_inches(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mistake: str, way: str
) -> None:
    one = after(server, tmp_path, monkeypatch, mistake, way, Unit.INCH)
    named(one, mistake)
    if mistake == "no effect":
        reported(one)
    if mistake == "wrong sign":
        assert max(applied(one).values()) <= 2
