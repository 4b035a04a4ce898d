"""Haas over TCP, against the simulator: cuts, a second collector that is noisy on purpose, and every mistake's sentence."""

import asyncio
import random
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

from app.bridge.checking import check
from app.bridge.configuration import Configuration, Machine, Server, configuration_from
from app.bridge.configuration import Store as StoreSettings
from app.bridge.kinds.haas import HaasRegisters, Settings, link
from app.bridge.links import ControlAway, LinkError, Misconfigured, Order, Position
from app.bridge.store import Store
from app.bridge.unit import Unit
from app.core.ring import Register
from app.core.ring import Unit as Length
from app.simulators.controls.haas import FEATURES, HaasSimulator, serve
from app.simulators.controls.model import Feature, Model
from tests.bridge.plant import bridge, controlled, location, machine, parts, store_in, until
from tests.loops import run
from tests.shop import Shop

PLACE = (3, 1, "wear_length")


@asynccontextmanager
async def haas(model: Model | None = None, latency: float = 0.0) -> AsyncIterator[HaasSimulator]:
    simulator = HaasSimulator(model or Model(FEATURES), latency=latency)
    await simulator.start(0)
    try:
        yield simulator
    finally:
        await simulator.stop()


def settled(simulator: HaasSimulator, **other: Any) -> Machine:
    settings = Settings("127.0.0.1", simulator.port, pause=0.0, answer=other.pop("answer", 10.0))
    fields = {"kind": "haas", "settings": settings, "location": (location(simulator.model.features[0]),)}
    return machine(simulator.model, **fields | {"patience": 30.0} | other)


@asynccontextmanager
async def collector(port: int, *queries: str, pause: float = 0.002) -> AsyncIterator[list[str]]:
    """A second program at the port, that asks and reads all the time. What it has read."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    heard: list[str] = []

    async def ask() -> None:
        while True:
            writer.write("".join(f"{query}\r\n" for query in queries).encode())
            await asyncio.sleep(pause * random.uniform(0.5, 4))

    async def listen() -> None:
        while line := await reader.readline():
            heard.append(line.decode().strip())

    tasks = [asyncio.create_task(ask()), asyncio.create_task(listen())]
    try:
        yield heard
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        writer.close()


async def everything(store: Store, model: Model) -> None:
    """Wait until the store has every reading that was written."""

    async def met() -> bool:
        return len(await store.waiting("lathe-1", 1000)) == len(model.truth())

    await until(met, "every reading in the store")


async def compare(store: Store, model: Model) -> None:
    """Each reading once, in order, with its size."""
    rows = await store.waiting("lathe-1", 1000)
    truth = model.truth()
    assert [row.key for row in rows] == [f"lathe-1:{key}" for key in truth]
    assert [row.body["measured"] for row in rows] == pytest.approx(list(truth.values()), abs=1e-6)


def test_answers_to_others_never_become_values() -> None:
    """A collector reads other variables all the time: what the bridge takes over is right, or it is nothing."""

    async def work() -> None:
        async with haas(latency=0.001) as simulator:
            model = simulator.model
            list(model.part())
            registers = HaasRegisters(settled(simulator))
            async with collector(simulator.port, "?Q600 5041", "?Q500", "?Q600 10802", "?Q100", pause=0.02) as heard:
                await registers.connect()
                places = [Register.ACK, Register.WRITTEN, Register.UNIT, Register.LAYOUT, *range(16, 26)]
                right = 0
                for _ in range(10):
                    with suppress(ControlAway):
                        assert await registers.read(places) == pytest.approx([model.registers[at] for at in places])
                        right += 1
                assert right
                assert any("234.567" in line for line in heard)
                assert heard.count(f">MACRO, {model.registers[Register.EPOCH]:.6f}") > 1  # ours come to it as well
            await registers.close()

    run(work())


def test_a_foreign_answer_at_any_place_of_a_row_is_noticed() -> None:
    """One answer to somebody else, before or behind each of ours in turn."""

    async def work() -> None:
        async with haas() as simulator:
            model = simulator.model
            list(model.part())
            places = list(range(8))
            registers = HaasRegisters(settled(simulator))
            await registers.connect()
            real = simulator.broadcast
            for at in range(12):
                for before in (True, False):
                    count = 0

                    def broadcast(line: str, at: int = at, before: bool = before) -> None:
                        nonlocal count
                        count += 1
                        if count == at + 1 and before:
                            real(">MACRO, 3.000000")
                        real(line)
                        if count == at + 1 and not before:
                            real(">MACRO, 3.000000")

                    simulator.broadcast = broadcast  # type: ignore[method-assign]
                    assert await registers.read(places) == pytest.approx(model.registers[:8]), (at, before)
            await registers.close()

    run(work())


def test_readings_come_once_and_in_order_through_cuts(tmp_path: Path) -> None:
    async def work() -> None:
        async with haas() as simulator:
            model = simulator.model
            store = store_in(tmp_path)
            one = settled(simulator)
            unit = Unit(one, link(one), store)
            chance = random.Random(4)

            async def cuts() -> None:
                for _ in range(6):
                    await asyncio.sleep(chance.uniform(0.02, 0.4))
                    simulator.cut()

            async with controlled(unit), collector(simulator.port, "?Q600 10802", "?Q200", pause=0.3):
                await asyncio.gather(parts(model, 12), cuts())
                await everything(store, model)
            await compare(store, model)
            assert (await store.position("lathe-1")).sequence == 12
            store.close()

    run(work())


@pytest.mark.parametrize("mode", ["control", "direct"])
def test_a_correction_gets_into_the_offset_once_beside_a_collector(tmp_path: Path, mode: str) -> None:
    async def work() -> None:
        async with haas() as simulator:
            model = simulator.model
            store = store_in(tmp_path)
            one = settled(simulator, corrections=mode)
            unit = Unit(one, link(one), store)
            async with controlled(unit), collector(simulator.port, "?Q600 5041", "?Q500", pause=0.1):
                await parts(model, 1)
                await everything(store, model)
                order = Order(1, 3, 0.0, -0.0125)
                await store.intend("lathe-1", order, "mapping")
                unit.orders = (order,)
                if mode == "control":
                    await until(lambda: model.registers[Register.MAIL_NUMBER] == 1, "the mail")
                    await parts(model, 1)

                async def answered() -> bool:
                    return bool(await store.intents("lathe-1", "answered"))

                await until(answered, "the answer")
                await parts(model, 2)
                await everything(store, model)
            [intent] = await store.intents("lathe-1", "answered")
            assert intent.outcome is not None
            assert intent.outcome.applied
            assert intent.outcome.offset == pytest.approx(-0.0125)
            assert model.offsets[PLACE] == pytest.approx(-0.0125)
            assert [offset for *_, offset in model.history] == [-0.0125]
            assert [each.number for each in model.applied] == ([1] if mode == "control" else [])
            in_effect = [row.body["correction_in_effect"] for row in await store.waiting("lathe-1")]
            assert in_effect[0] == 0
            assert in_effect[-1] == 1
            await compare(store, model)
            store.close()

    run(work())


def test_an_edit_by_hand_is_seen(tmp_path: Path) -> None:
    async def work() -> None:
        async with haas() as simulator:
            model = simulator.model
            model.edit(PLACE, 0.25)
            list(model.part())
            store = store_in(tmp_path)
            one = settled(simulator)
            async with controlled(Unit(one, link(one), store)):

                async def seen() -> bool:
                    return (await store.unreported("lathe-1", 0.0005)) == {3: pytest.approx(0.25)}

                await until(seen, "the offset")
            store.close()

    run(work())


def test_nothing_is_written_while_a_program_runs() -> None:
    async def work() -> None:
        async with haas() as simulator:
            simulator.model.running = True
            one = link(settled(simulator, corrections="direct"))
            await one.connect()
            with pytest.raises(ControlAway, match="A program is running"):
                await one.write_offset(3, 0.01)
            simulator.model.running = False
            await one.write_offset(3, 0.01)
            assert await one.read_offset(3) == pytest.approx(0.01)
            await one.close()

    run(work())


async def _fails(one: Machine) -> LinkError:
    """What connecting and one poll raise."""
    connected = link(one)
    try:
        with pytest.raises(LinkError) as error:
            await connected.connect()
            await connected.fetch(Position())
    finally:
        await connected.close()
    return error.value


def test_each_mistake_is_said() -> None:
    async def work() -> None:
        async with haas() as simulator:
            one = settled(simulator, answer=0.3)
            assert "the NC program has not set it up" in str(await _fails(one))
            list(simulator.model.part())
            inch = await _fails(settled(simulator, unit="inch"))
            assert "says that it works in mm" in str(inch)
            elsewhere = Settings("127.0.0.1", simulator.port, first_register=10900, pause=0.0)
            assert "the NC program has not set it up" in str(await _fails(settled(simulator, settings=elsewhere)))
            for wrong, words in (
                (Feature(register="wear_radius"), "register = 'wear_radius' is not known on a Haas"),
                (Feature(register="wear_x", tool=51), "wear_x has tools up to 50, not 51"),
            ):
                error = await _fails(settled(simulator, location=(location(wrong),)))
                assert isinstance(error, Misconfigured)
                assert words in str(error)
            async with collector(simulator.port, "?Q100"), collector(simulator.port, "?Q100"):
                await until(lambda: simulator.connections == 2, "two collectors")
                assert "It serves two programs at most" in str(await _fails(one))
            simulator.answer = lambda _: ">STATUS, BUSY"  # type: ignore[assignment, method-assign]
            assert "does not answer ?Q100 with a serial number" in str(await _fails(one))
        error = await _fails(one)
        assert isinstance(error, ControlAway)
        assert "does setting 143 say" in str(error)

    run(work())


def test_a_control_that_does_not_answer_for_its_date_is_read_all_the_same() -> None:
    async def work() -> None:
        async with haas() as simulator:
            list(simulator.model.part())
            real = simulator.answer
            simulator.answer = lambda text: ">?, UNKNOWN COMMAND" if "3011" in text else real(text)  # type: ignore[method-assign]
            one = link(settled(simulator, answer=0.5))
            assert await one.connect() == simulator.model.serial
            [reading] = await one.fetch(Position())
            assert reading.body["measured"] == pytest.approx(simulator.model.written[0][1].measured, abs=1e-6)
            await one.close()

    run(work())


def test_an_inch_control_and_its_empty_variables() -> None:
    async def work() -> None:
        model = Model(FEATURES, unit=Length.INCH)
        list(model.part())
        async with haas(model) as simulator:
            one = link(settled(simulator))
            await one.connect()
            [reading] = await one.fetch(Position())
            assert reading.body["measured"] == pytest.approx(25.4 * model.written[0][1].measured, abs=1e-5)
            empty = settled(simulator, location=(location(Feature(register="wear_diameter")),))
            registers = HaasRegisters(empty)
            await one.close()
            await registers.connect()
            assert await registers.read_offset(empty.location[0]) is None
            await registers.close()

    run(work())


def test_the_table_of_the_simulator_is_a_configuration(tmp_path: Path) -> None:
    async def work() -> None:
        simulator = await serve(Model(FEATURES), 0)
        try:
            list(simulator.model.part())
            (tmp_path / "machine.key").write_text("secret\n")
            table = simulator.table() | {"haas": {"address": "127.0.0.1", "port": simulator.port, "pause": 0}}
            read = configuration_from({"server": {"url": "http://127.0.0.1:9"}, "machine": {"mill-1": table}}, tmp_path)
            findings = await check(Configuration(Server(url="http://127.0.0.1:9"), StoreSettings(), read.machines))
            words = [str(finding) for finding in findings if finding.good and finding.about == "mill-1"]
            assert words == [
                "✓ mill-1: the control answers as 'SIM-0001'",
                "✓ mill-1: 1 readings can be fetched now",
                "✓ mill-1: tool memory 3 holds 0.0000 mm",
                "✓ mill-1: what the bridge will write there can be written",
            ]
        finally:
            await simulator.stop()

    run(work())


def test_the_loop_closes_through_a_server(shop: Shop, tmp_path: Path) -> None:
    model = Model((Feature(register="wear_length", parameter=2200, bias=0.006, wear=0.0, noise=0.0),))

    async def loop() -> None:
        async with haas(model) as simulator:
            store = store_in(tmp_path)
            one = settled(simulator, key=shop.machine, characteristics={"1": shop.characteristic})
            unit = Unit(one, link(one), store)
            async with bridge(shop, unit):
                await parts(model, 1)
                await until(lambda: model.registers[Register.MAIL_NUMBER], "a correction")
                await parts(model, 2)

                async def all_sent() -> bool:
                    stored = (await store.position(shop.machine)).sequence == 3
                    return stored and not (await store.counts(shop.machine)).waiting

                await until(all_sent, "everything at the server")
            store.close()

    run(loop())
    readings = shop.call("GET", f"/readings?characteristic={shop.characteristic}")["items"]
    assert [reading["action"] for reading in readings] == ["correct", "none", "none"]
