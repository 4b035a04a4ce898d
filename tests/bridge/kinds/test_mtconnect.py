"""An MTConnect agent as context of readings: started anew, out of range, unavailable, silent, and answering nonsense."""

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx
import pytest

from app.bridge import checking, control_side
from app.bridge.configuration import ConfigurationError, configuration_from
from app.bridge.kinds.mtconnect import AgentError, Context, Settings
from app.bridge.links import Clock, Order, Outcome, Position, Received
from app.bridge.server_side import heartbeat
from app.bridge.unit import Unit
from app.simulators.controls.model import Model
from app.simulators.controls.mtconnect import AgentSimulator
from tests.bridge.plant import machine, store_in, until
from tests.loops import run

BOMB = (
    b'<?xml version="1.0"?><!DOCTYPE lolz [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;">]>'
    b"<lolz>&c;</lolz>"
)


class Probe:
    """A link with the readings that a test puts into it."""

    def __init__(self) -> None:
        self.clock = Clock()
        self.ready: list[Received] = []

    async def connect(self) -> str:
        return "probe"

    async def close(self) -> None:
        pass

    async def fetch(self, stored: Position) -> Sequence[Received]:
        return [self.ready.pop(0)] if self.ready else []

    async def acknowledge(self, received: Sequence[Received]) -> None:
        pass

    async def offer(self, orders: Sequence[Order]) -> None:
        pass

    async def outcomes(self) -> Sequence[Outcome]:
        return []

    async def offsets(self) -> dict[int, float]:
        return {}


@asynccontextmanager
async def agent(**fields: Any) -> AsyncIterator[AgentSimulator]:
    """An agent that observes only what the test tells it."""
    simulator = AgentSimulator(Model(), **fields)
    simulator.look = lambda: None  # type: ignore[method-assign]
    await simulator.start(0)
    try:
        yield simulator
    finally:
        await simulator.stop()


def settings(simulator: AgentSimulator, **other: Any) -> Settings:
    address = {"kind": "mtconnect", "url": f"http://127.0.0.1:{simulator.port}", "device": "SIM-0001"}
    return Settings(**{**address, "every": 30.0, "patience": 20.0, **other})


@asynccontextmanager
async def asking(simulator: AgentSimulator, **other: Any) -> AsyncIterator[tuple[Context, httpx.AsyncClient]]:
    context = Context("lathe-1", settings(simulator, **other))
    async with context.client() as http:
        yield context, http


async def catch_up(context: Context, http: httpx.AsyncClient) -> None:
    while await context.poll(http):
        pass


def now(**before: float) -> str:
    return (datetime.now(UTC) - timedelta(**before)).isoformat()


def reading(key: str, **other: Any) -> Received:
    return Received(key, {"characteristic": "shaft-1", "measured": 40.0, "measured_at": now(), **other})


def test_program_tool_and_part_are_known_as_soon_as_the_agent_tells_them() -> None:
    async def work() -> None:
        async with agent() as simulator, asking(simulator) as (context, http):
            simulator.observe("count", "16")
            simulator.observe("program", "O1000")
            await catch_up(context, http)
            assert context.part_at(now()) == "16"
            simulator.observe("count", "17")
            simulator.observe("target", "500")
            simulator.observe("tool", "3")
            await catch_up(context, http)
            assert context.part_at(now()) == "17"
            assert context.summary() == "MTConnect: part 17, program O1000, tool 3."
            assert any("/SIM-0001/sample?from=" in target for target in simulator.asked)

    run(work())


def test_it_runs_while_the_agent_says_so() -> None:
    async def work() -> None:
        async with agent() as simulator, asking(simulator) as (context, http):
            told = [context.running()]
            for value in ("UNAVAILABLE", "READY", "ACTIVE", "FEED_HOLD", "ACTIVE"):
                simulator.observe("execution", value)
                await catch_up(context, http)
                told.append(context.running())
            assert told == [None, None, False, True, False, True]
            context._until = datetime.now(UTC) - timedelta(minutes=5)
            assert context.running() is None, "it has not answered since"

    run(work())


def test_unavailable_is_not_a_part() -> None:
    async def work() -> None:
        async with agent() as simulator, asking(simulator) as (context, http):
            await catch_up(context, http)
            assert context.part_at(now()) is None
            assert context.summary() == "MTConnect: program, tool and part are unavailable."
            simulator.observe("count", "0")
            await catch_up(context, http)
            assert context.part_at(now()) == "0"
            simulator.observe("count", "UNAVAILABLE")
            await catch_up(context, http)
            assert context.part_at(now()) is None

    run(work())


def test_a_reading_measured_before_the_part_changed_belongs_to_the_part_before() -> None:
    async def work() -> None:
        async with agent() as simulator, asking(simulator) as (context, http):
            simulator.observe("count", "16")
            await catch_up(context, http)
            await asyncio.sleep(0.02)
            then = now()
            await asyncio.sleep(0.02)
            simulator.observe("count", "17")
            await catch_up(context, http)
            assert context.part_at(then) == "16"
            assert context.part_at(now(hours=1)) is None  # before the agent told anything
            assert context.part_at("yesterday") is None

    run(work())


def test_an_agent_started_again_is_read_from_its_first_number() -> None:
    async def work() -> None:
        async with agent() as simulator, asking(simulator) as (context, http):
            for part in range(1, 20):
                simulator.observe("count", str(part))
            await catch_up(context, http)
            simulator.restart()
            simulator.observe("count", "20")
            await asyncio.sleep(0.02)
            between = now()
            await asyncio.sleep(0.02)
            simulator.observe("count", "21")
            await catch_up(context, http)
            assert context.part_at(between) == "20"
            assert context.part_at(now()) == "21"
            assert context.gaps == 1
            assert "restarted" in context.summary()
            assert "/SIM-0001/sample?from=1&count=1000" in simulator.asked

    run(work())


def test_a_buffer_that_went_on_is_a_gap_and_no_error() -> None:
    async def work() -> None:
        async with agent(buffer=8) as simulator, asking(simulator) as (context, http):
            simulator.observe("count", "1")
            await catch_up(context, http)
            for place in range(30):
                simulator.observe("x", str(place))
            simulator.observe("count", "5")
            await catch_up(context, http)
            assert context.gaps == 1
            assert context.trouble is None
            assert "buffer had gone on" in context.summary()
            assert context.part_at(now()) == "5"
            simulator.observe("count", "6")
            await catch_up(context, http)
            assert context.part_at(now()) == "6"
            assert context.gaps == 1

    run(work())


def test_a_part_that_did_not_change_in_a_gap_stays_known() -> None:
    async def work() -> None:
        async with agent(buffer=8) as simulator, asking(simulator) as (context, http):
            simulator.observe("count", "7")
            await catch_up(context, http)
            for place in range(30):
                simulator.observe("x", str(place))
            await catch_up(context, http)
            assert context.gaps == 1
            assert context.part_at(now()) == "7"

    run(work())


def test_what_an_agent_reported_before_it_went_silent_is_not_taken_for_later_readings() -> None:
    async def work() -> None:
        async with agent() as simulator, asking(simulator) as (context, http):
            simulator.observe("count", "7")
            await catch_up(context, http)
            later = (datetime.now(UTC) + timedelta(minutes=5)).isoformat()
            assert context.part_at(later) is None

    run(work())


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (b"<MTConnectStreams><Header instanceId='1'", "cannot be read"),
        (b"", "cannot be read"),
        (b"\xff\xfe\x00nonsense", "cannot be read"),
        (BOMB, "DOCTYPE"),
        (b"<html><body>Printer</body></html>", "is not MTConnect: it begins with 'html'"),
        (b"<MTConnectStreams><Header instanceId='1' nextSequence='many'/></MTConnectStreams>", "cannot be read"),
        (b"<MTConnectStreams/>", "is not MTConnect"),
    ],
)
def test_an_answer_that_is_not_mtconnect_is_said(answer: bytes, words: str) -> None:
    async def work() -> None:
        async with agent() as simulator, asking(simulator) as (context, http):
            simulator.instead = answer
            with pytest.raises(AgentError, match=words):
                await context.poll(http)
            simulator.instead = None
            simulator.observe("count", "3")
            await catch_up(context, http)
            assert context.part_at(now()) == "3"

    run(work())


def test_an_unknown_device_and_an_agent_that_is_away_are_said() -> None:
    async def work() -> None:
        async with agent() as simulator:
            async with asking(simulator, device="lathe-9") as (context, http):
                with pytest.raises(AgentError, match=r"NO_DEVICE.*Look at url and device"):
                    await context.poll(http)
            await simulator.stop()
            async with asking(simulator) as (context, http):
                with pytest.raises(AgentError, match="does not answer"):
                    await context.poll(http)

    run(work())


def test_the_data_item_can_be_named_and_a_wrong_name_is_said() -> None:
    async def work() -> None:
        async with agent() as simulator:
            simulator.observe("target", "500")
            async with asking(simulator, part="target") as (context, http):
                await catch_up(context, http)
                assert context.part_at(now()) == "500"
            async with asking(simulator, part="pc9") as (context, http):
                await catch_up(context, http)
                assert context.part_at(now()) is None
                assert "no data item 'pc9'" in context.summary()

    run(work())


def streams(**devices: list[tuple[str, str, str, str]]) -> bytes:
    """A document with these devices: element, id, subtype and value of their data items."""
    content = "".join(
        f'<DeviceStream name="{name}" uuid="{name}"><ComponentStream component="Path" componentId="p"><Events>'
        + "".join(
            f'<{element} dataItemId="{item}" sequence="1" subType="{subtype}" timestamp="{now()}">{value}</{element}>'
            for element, item, subtype, value in items
        )
        + "</Events></ComponentStream></DeviceStream>"
        for name, items in devices.items()
    )
    header = f'<Header creationTime="{now()}" instanceId="7" firstSequence="1" lastSequence="9" nextSequence="10"/>'
    return f"<MTConnectStreams>{header}<Streams>{content}</Streams></MTConnectStreams>".encode()


UNIQUE, COUNT, TOOL = (
    ("PartUniqueId", "u", "", "UNAVAILABLE"),
    ("PartCount", "c", "ALL", "812"),
    ("ToolNumber", "t", "", "3"),
)
MAIN, ACTIVE = ("Program", "p", "MAIN", "O1"), ("Program", "s", "ACTIVE", "O9810")


@pytest.mark.parametrize("items", [[UNIQUE, COUNT, ACTIVE, MAIN, TOOL], [MAIN, ACTIVE, COUNT, TOOL, UNIQUE]])
def test_an_item_that_is_unavailable_leaves_it_to_the_next_until_it_has_a_value(items: list[Any]) -> None:
    async def work() -> None:
        async with agent() as simulator, asking(simulator) as (context, http):
            simulator.instead = streams(Agent=[], mazak=items)
            await context.poll(http)
            assert context.summary() == "MTConnect: part 812, program O1, tool 3."
            assert context.part_at(now()) == "812"
            for unique, part in (("A-17", "A-17"), ("UNAVAILABLE", None)):  # and then it tells the part alone
                simulator.instead = streams(mazak=[("PartUniqueId", "u", "", unique), ("PartCount", "c", "ALL", "813")])
                await context.poll(http)
                assert context.part_at(now()) == part

    run(work())


def test_an_agent_with_several_devices_asks_for_one() -> None:
    async def work() -> None:
        async with agent() as simulator, asking(simulator, device=None) as (context, http):
            simulator.instead = streams(okuma=[TOOL], mazak=[COUNT])
            with pytest.raises(AgentError, match=r"several devices \(mazak, okuma\): name the one of this machine as"):
                await context.poll(http)
            assert context.part_at(now()) is None

    run(work())


def test_readings_get_the_part_and_keep_their_own_and_an_agent_that_hangs_holds_up_none(tmp_path: Path) -> None:
    async def work() -> None:
        store = store_in(tmp_path)
        async with agent() as simulator:
            link = Probe()
            unit = Unit(machine(Model(), location=(), corrections="none"), link, store)
            context = unit.context = Context("lathe-1", settings(simulator, every=0.05, patience=600.0))
            context._trusted = timedelta(minutes=5)  # on a slow machine the last answer is fresh as well
            tasks = [asyncio.create_task(control_side.run(unit)), asyncio.create_task(context.run())]
            try:
                simulator.observe("count", "17")
                await until(lambda: context.values.get("part") == "17", "the part")
                link.ready += [reading("a"), reading("b", part="S-4711"), Received("c", {"measured": 1.0})]
                await until(lambda: not link.ready, "fetching")
                simulator.answering.clear()
                asked = len(simulator.asked)
                await until(lambda: len(simulator.asked) > asked, "a question that hangs")
                link.ready.append(reading("d"))

                async def stored() -> bool:
                    return len(await store.waiting("lathe-1")) == 4

                await until(stored, "four readings")
                bodies = {row.key: row.body for row in await store.waiting("lathe-1")}
                assert bodies["a"]["part"] == "17"
                assert bodies["b"]["part"] == "S-4711"
                assert "part" not in bodies["c"]  # nobody knows when it was measured
                assert (await heartbeat(unit))["detail"] == "MTConnect: part 17."
            finally:
                for task in tasks:
                    task.cancel()
                await asyncio.gather(*tasks, return_exceptions=True)
        store.close()

    run(work())


def test_an_agent_that_hangs_is_said_and_asked_again() -> None:
    async def work() -> None:
        async with agent() as simulator:
            simulator.answering.clear()
            context = Context("lathe-1", settings(simulator, every=0.05, patience=0.3))
            task = asyncio.create_task(context.run())
            try:
                await until(lambda: context.trouble and "has not answered" in context.trouble, "the sentence")
                simulator.observe("count", "2")
                simulator.answering.set()
                await until(lambda: context.values.get("part") == "2" and not context.trouble, "the part")
            finally:
                task.cancel()
                await asyncio.gather(task, return_exceptions=True)

    run(work())


def test_the_simulated_agent_tells_what_its_machine_does() -> None:
    async def work() -> None:
        model = Model()
        simulator = AgentSimulator(model)
        await simulator.start(0)
        try:
            async with asking(simulator) as (context, http):
                list(model.part())
                simulator.look()
                await catch_up(context, http)
                assert context.part_at(now()) == "1"
                assert "program O1000" in context.summary()
                probed = await http.get(f"http://127.0.0.1:{simulator.port}/probe")
                assert 'type="PART_COUNT" subType="TARGET"' in probed.text
        finally:
            await simulator.stop()

    run(work())


def of_file(context: dict[str, Any]) -> Any:
    table = {"kind": "dprnt", "unit": "mm", "secret": "x", "corrections": "none", "dprnt": {"listen": 1}}
    content = {"server": {"url": "http://127.0.0.1:1"}, "machine": {"lathe-1": table | {"context": context}}}
    return configuration_from(content, Path())


@pytest.mark.parametrize(
    ("context", "words"),
    [
        ({"kind": "mtconnect", "url": "192.168.1.20"}, "context.url = '192.168.1.20' is not an address"),
        ({"kind": "mtconnect"}, "machine.lathe-1.context.url is missing"),
        ({"kind": "mtconnect", "url": "http://a:5000", "devise": "x"}, "context.devise is not known"),
        ({"kind": "mtc", "url": "http://a:5000"}, "context.kind"),
    ],
)
def test_mistakes_in_the_table_are_said(context: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigurationError, match=words):
        of_file(context)


def test_the_check_says_what_the_agent_answers() -> None:
    async def work() -> None:
        async with agent() as simulator:
            simulator.observe("count", "17")
            chosen = machine(Model(), context=settings(simulator))
            [found] = [each async for each in checking._context(chosen)]
            assert str(found) == "✓ lathe-1: MTConnect: part 17. UNAVAILABLE now: program, tool."
            simulator.instead = streams(mazak=[TOOL])
            [found] = [each async for each in checking._context(chosen)]
            assert str(found).startswith(
                "✗ lathe-1: MTConnect: tool 3. No data item of the device tells part and program;"
            )
            simulator.instead = b"<html/>"
            [found] = [each async for each in checking._context(chosen)]
            assert not found.good

    run(work())
