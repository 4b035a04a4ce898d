"""Readings that a control prints: by TCP, by a serial port (a pseudo terminal), into a file; with gaps, cuts and rubbish."""

import asyncio
import os
import random
import termios
import time
from collections.abc import AsyncIterator, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
import serial
from typer.testing import CliRunner

from app.bridge.configuration import Machine, configuration_from
from app.bridge.kinds.dprnt import PrintedLink, Settings
from app.bridge.links import ControlAway, LinkError, Misconfigured, Position, Received
from app.bridge.sources import Source
from app.bridge.store import Store
from app.bridge.unit import Unit as Tasks
from app.cli.bridge import bridge as commands
from app.core.printed_line import LineReader, Printed, line_of
from app.core.ring import Slot, Unit
from app.errors import InbandError
from app.simulators.controls.dprnt import PrintingSimulator, serve
from app.simulators.controls.model import Model
from tests.bridge.plant import bridge, controlled, machine, parts, store_in, until
from tests.loops import in_thread, run
from tests.shop import Shop

SLOT = Slot(1, 1, 40.001, 0, 1, 3, 0, 43_200.0)


@asynccontextmanager
async def printing(model: Model | None = None, *, parity: bool = False) -> AsyncIterator[PrintingSimulator]:
    simulator = PrintingSimulator(model or Model(), parity=parity)
    await simulator.start(0)
    try:
        yield simulator
    finally:
        await simulator.stop()


def printed_machine(settings: Settings, **other: Any) -> Machine:
    return machine(Model(), **{"kind": "dprnt", "settings": settings, "corrections": "none", "location": ()} | other)


def fetching(one: Machine, store: Store) -> AbstractAsyncContextManager[Tasks]:
    return controlled(Tasks(one, PrintedLink(one), store))


async def sizes(store: Store) -> dict[str, float]:
    return {row.key.removeprefix("lathe-1:"): row.body["measured"] for row in await store.waiting("lathe-1", 10_000)}


async def all_stored(store: Store, model: Model) -> None:
    async def met() -> bool:
        return len(await sizes(store)) == len(model.truth())

    await until(met, "every reading in the store")
    found, truth = await sizes(store), model.truth()
    assert found == pytest.approx({key: truth[key] for key in truth}, abs=6e-5)


def lines(*sequences: int, epoch: int = 7, **other: Any) -> bytes:
    printed = [Printed(epoch, Unit.MM, replace(SLOT, sequence=number, **other)) for number in sequences]
    return "".join(f"{line_of(each)}\r\n" for each in printed).encode()


def test_readings_come_by_tcp_and_what_a_cut_has_swallowed_comes_with_the_second_print(tmp_path: Path) -> None:
    async def work() -> None:
        async with printing() as simulator:
            store = store_in(tmp_path)
            one = printed_machine(Settings(connect=f"127.0.0.1:{simulator.port}"))
            async with fetching(one, store) as tasks:
                await until(lambda: simulator.connections, "the connection")
                await parts(simulator.model, 3)
                await all_stored(store, simulator.model)
                simulator.cut()
                await until(lambda: not simulator.connections, "the cut")
                await parts(simulator.model, 2)
                await until(lambda: simulator._printed == 5, "the print")
                await until(lambda: simulator.connections, "the connection")
                await parts(simulator.model, 1)
                await all_stored(store, simulator.model)
                await until(lambda: not tasks.detail, "no gap any more")
                assert tasks.state == "online"
            store.close()

    run(work())


@pytest.mark.parametrize(("framing", "parity"), [("8N1", False), ("8N1", True), ("7E1", False)])
def test_a_serial_port(tmp_path: Path, framing: Any, *, parity: bool) -> None:
    """8N1 at the port while the control sends 7E1 is read as well: the eighth bit is only parity."""

    async def work() -> None:
        async with printing(parity=parity) as simulator:
            store = store_in(tmp_path)
            one = printed_machine(Settings(serial=simulator.device, framing=framing))
            async with fetching(one, store) as tasks:
                await until(lambda: tasks.state == "online", "the port")
                simulator.send(b"\x12%\r\nINBLINE E12 N4\r\n")
                await parts(simulator.model, 4)
                await all_stored(store, simulator.model)
                await until(lambda: "Damaged lines since the start: 1." in tasks.detail, "the damage said")
            store.close()

    run(work())


def test_a_port_that_refuses_seven_bits_is_read_with_eight(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened = serial.Serial

    def refusing(device: str, baud: int, **named: Any) -> Any:
        if named["bytesize"] == 7 or baud == 57:
            raise termios.error(22, "Invalid argument")
        return opened(device, baud, **named)

    monkeypatch.setattr(serial, "Serial", refusing)

    async def work() -> None:
        async with printing(parity=True) as simulator:
            store = store_in(tmp_path)
            one = printed_machine(Settings(serial=simulator.device, framing="7E1"))
            async with fetching(one, store) as tasks:
                await until(lambda: tasks.state == "online", "the port")
                await parts(simulator.model, 2)
                await all_stored(store, simulator.model)
                await until(lambda: "refuses 7E1. It is read as 8N1" in tasks.detail, "the remark")
            store.close()
            link = PrintedLink(printed_machine(Settings(serial=simulator.device, baud=57)))
            with pytest.raises(ControlAway, match=r"cannot be opened: Invalid argument\. Is it plugged in"):
                await link.connect()

    run(work())


def test_a_port_that_listens_keeps_connections_apart(tmp_path: Path) -> None:
    async def work() -> None:
        store = store_in(tmp_path)
        server = await asyncio.start_server(lambda *_: None, "127.0.0.1", 0)
        port = server.sockets[0].getsockname()[1]
        server.close()
        await server.wait_closed()
        one = printed_machine(Settings(listen=port, listen_on="127.0.0.1"))
        async with fetching(one, store) as tasks:
            await until(lambda: "Nobody is connected" in tasks.detail, "the port")
            writers = [(await asyncio.open_connection("127.0.0.1", port))[1] for _ in range(2)]
            text = lines(1), lines(2)
            for at in range(0, 80, 5):  # both at once, cut into pieces
                for writer, data in zip(writers, text, strict=True):
                    writer.write(data[at : at + 5])
                    await writer.drain()

            async def both() -> bool:
                return set(await sizes(store)) == {"7:1", "7:2"}

            await until(both, "both lines")
            for writer in writers:
                writer.close()
        store.close()

    run(work())


def test_a_file_that_grows_shrinks_and_is_read_again_after_a_restart(tmp_path: Path) -> None:
    async def work() -> None:
        store = store_in(tmp_path)
        file = tmp_path / "print.txt"
        one = printed_machine(Settings(file=str(file)))

        async def stored(*keys: str) -> None:
            async def met() -> bool:
                return list(await sizes(store)) == list(keys)

            await until(met, str(keys))

        async with fetching(one, store) as tasks:
            await until(lambda: "cannot be read" in tasks.detail, "no file yet")
            half = len(lines(1)) + 20
            file.write_bytes(lines(1, 2)[:half])
            await stored("7:1")
            with file.open("ab") as end:
                end.write(lines(1, 2)[half:])
            await stored("7:1", "7:2")
            file.write_bytes(lines(3))  # a new file under the old name
            await stored("7:1", "7:2", "7:3")
            file.write_bytes(lines(5))  # as long as the one before
            await stored("7:1", "7:2", "7:3", "7:5")
            file.write_bytes(lines(6, 7))  # longer, and read no earlier
            await stored("7:1", "7:2", "7:3", "7:5", "7:6", "7:7")
        async with fetching(one, store):
            with file.open("ab") as end:
                end.write(lines(8))
            await stored("7:1", "7:2", "7:3", "7:5", "7:6", "7:7", "7:8")
        store.close()

    run(work())


class Canned(Source[Printed]):
    """A source of lines that are given."""

    def __init__(self, *batches: bytes) -> None:
        self.batches = list(batches)
        self.reader = LineReader()

    async def take(self) -> list[Printed]:
        return self.reader.feed(self.batches.pop(0)) if self.batches else []

    async def close(self) -> None:
        pass

    def damaged(self) -> int:
        return 0


def canned(*batches: bytes, **other: Any) -> PrintedLink:
    link = PrintedLink(printed_machine(Settings(connect="127.0.0.1:1"), **other))
    link._source = Canned(*batches)
    return link


async def taken(link: PrintedLink, stored: Position = Position()) -> Sequence[Received]:  # noqa: B008 - frozen
    received = await link.fetch(stored)
    await link.acknowledge(received)
    return received


def ages(received: Sequence[Received]) -> list[float]:
    """How many minutes ago each was measured."""
    moments = [datetime.fromisoformat(each.body["measured_at"]) for each in received]
    return [round((datetime.now(UTC) - each).total_seconds() / 60) for each in moments]


def printed_ago(minutes: Sequence[float], first: int = 1) -> bytes:
    now = datetime.now().astimezone()
    today = (now - now.replace(hour=0, minute=0, second=0)).total_seconds()
    times = [float(int(today - 60 * each) % 86_400) for each in minutes]
    return b"".join(lines(number, time=time) for number, time in enumerate(times, first))


def test_what_a_serial_server_has_kept_has_the_times_of_its_lines() -> None:
    async def work() -> None:
        kept = list(range(60, 0, -5))
        damaged = printed_ago(kept).replace(b"N6 C1 V40", b"N6 C1 V39")
        link = canned(damaged + printed_ago([35], 6), b"", printed_ago([0], 13))  # printed again at the end
        received = await taken(link)
        numbers = [int(each.key.rpartition(":")[2]) for each in received]
        assert dict(zip(numbers, ages(received), strict=True)) == dict(enumerate(kept, 1))
        await taken(link)
        assert ages(await taken(link)) == [0]
        assert link.clock.offset == pytest.approx(0, abs=2)

    run(work())


def test_lines_of_a_file_have_their_times_and_teach_the_clock_once_it_is_followed(tmp_path: Path) -> None:
    async def work() -> None:
        file = tmp_path / "print.txt"
        file.write_bytes(printed_ago([90, 60, 30]))
        link = PrintedLink(printed_machine(Settings(file=str(file))))
        await link.connect()
        assert ages(await taken(link)) == [90, 60, 30]
        assert link.clock.offset is None
        assert await taken(link) == []
        with file.open("ab") as end:
            end.write(printed_ago([25], 4))  # by a clock that is wrong
        assert ages(await taken(link)) == [0]
        assert link.clock.offset == pytest.approx(-1500, abs=3)
        os.utime(file, (time.time() - 3 * 86_400,) * 2)
        again = PrintedLink(printed_machine(Settings(file=str(file))))
        await again.connect()
        found = await taken(again)
        assert [age // 1440 for age in ages(found)] == [3, 3, 3, 3], "nothing in it is younger than the file"
        await link.close()
        await again.close()

    run(work())


def test_missing_sequences_are_reported_until_they_come() -> None:
    async def work() -> None:
        link = canned(lines(1, 2, 5), lines(3), lines(1, 2, 3, 4, 5), lines(6), lines(40))
        first = await taken(link)
        assert [each.key for each in first] == ["lathe-1:7:1", "lathe-1:7:2", "lathe-1:7:5"]
        assert "Missing readings: 3, 4." in link.remark
        [healed] = await taken(link)
        assert healed.key == "lathe-1:7:3"
        assert healed.position == Position(7, 5)  # how far it has counted never goes back
        assert "Missing readings: 4." in link.remark
        [healed] = await taken(link)
        assert healed.key == "lathe-1:7:4"
        assert link.remark == ""
        await taken(link)
        await taken(link)
        assert "Readings are missing: 33, the newest are 28, 29" in link.remark

    run(work())


def test_a_gap_over_a_restart_is_reported() -> None:
    async def work() -> None:
        link = canned(lines(12))
        await taken(link, Position(7, 9))
        assert "Missing readings: 10, 11." in link.remark

    run(work())


def test_what_was_not_stored_comes_again() -> None:
    async def work() -> None:
        link = canned(lines(1, 2), lines(3))
        assert len(await link.fetch(Position())) == 2
        again = await link.fetch(Position())  # the disk was full
        assert [each.key for each in again] == ["lathe-1:7:1", "lathe-1:7:2", "lathe-1:7:3"]
        await link.acknowledge(again)
        assert await link.fetch(Position()) == []

    run(work())


def test_contradictions_and_wrong_units_go_to_the_quarantine() -> None:
    async def work() -> None:
        link = canned(lines(1), lines(1, measured=41.0), lines(2, characteristic=9), lines(3, status=3))
        await taken(link)
        for words in (
            "was printed as 40.001 before, and as 41 now",
            "characteristic 9, which machine.lathe-1.characteristics does not name",
            "marked the reading",
        ):
            [received] = await taken(link)
            assert received.fault is not None
            assert words in received.fault
        inch = canned(lines(1), unit="inch")
        [received] = await taken(inch)
        assert received.fault == "The line is in mm, the configuration says unit = 'inch'."
        assert received.body["measured"] == 40.001, "it may be sent from the quarantine"

    run(work())


def test_a_new_epoch_is_reported() -> None:
    async def work() -> None:
        link = canned(lines(8), lines(1, epoch=9))
        await taken(link)
        [received] = await taken(link)
        assert received.key == "lathe-1:9:1"
        assert "The control began to count again: epoch 7 became 9." in link.remark

    run(work())


@pytest.mark.parametrize(("table", "refused"), [({"file": "print.txt"}, True), ({"connect": "127.0.0.1:1"}, False)])
def test_counters_of_a_file_are_not_accepted_as_all_would_come_again(
    tmp_path: Path, table: dict[str, str], *, refused: bool
) -> None:
    [(name, value)] = table.items()
    plant = tmp_path / "plant.toml"
    plant.write_text(
        'server.url = "http://127.0.0.1:1"\n[machine.mill-1]\nkind = "dprnt"\nunit = "mm"\nsecret = "x"\ncorrections = "none"'
        f'\n[machine.mill-1.dprnt]\n{name} = "{value}"\n',
        encoding="utf-8",
    )
    said = in_thread(lambda: CliRunner().invoke(commands, ["accept-counters", "mill-1", "--config", str(plant)]))
    assert isinstance(said.exception, InbandError) == refused
    assert "would come a second time" in str(said.exception) or not refused


def test_each_mistake_is_said(tmp_path: Path) -> None:
    async def fails(settings: Settings, **other: Any) -> LinkError:
        link = PrintedLink(printed_machine(settings, **other))
        with pytest.raises(LinkError) as error:
            await link.connect()
        await link.close()
        return error.value

    async def work() -> None:
        assert "It has none of them" in str(await fails(Settings())).replace("it has", "It has")
        both = await fails(Settings(serial="/dev/ttyS9", file="x"))
        assert isinstance(both, Misconfigured)
        assert "it has serial and file" in str(both)
        assert "is not an address with a port" in str(await fails(Settings(connect="192.0.2.17")))
        away = await fails(Settings(connect="127.0.0.1:9"))
        assert isinstance(away, ControlAway)
        assert "Is the serial server on" in str(away)
        assert "cannot be opened" in str(await fails(Settings(serial=str(tmp_path / "ttyUSB7"))))
        assert 'Set corrections = "none"' in str(await fails(Settings(listen=4001), corrections="control"))

    run(work())


def test_the_table_of_the_simulator_is_a_configuration(tmp_path: Path) -> None:
    async def work() -> None:
        simulator = await serve(Model(), 0)
        (tmp_path / "machine.key").write_text("secret")
        content = {"server": {"url": "http://127.0.0.1:9"}, "machine": {"mill-1": simulator.table()}}
        [read] = configuration_from(content, tmp_path).machines
        assert read.settings == Settings(connect=f"127.0.0.1:{simulator.port}")
        await simulator.stop()

    run(work())


def test_the_server_gets_each_reading_once(shop: Shop, tmp_path: Path) -> None:
    chance = random.Random(1)

    async def work() -> None:
        async with printing() as simulator:
            store = store_in(tmp_path)
            one = printed_machine(
                Settings(connect=f"127.0.0.1:{simulator.port}"),
                key=shop.machine,
                characteristics={"1": shop.characteristic},
            )
            async with bridge(shop, Tasks(one, PrintedLink(one), store)):
                await until(lambda: simulator.connections, "the connection")
                for _ in range(5):
                    simulator.send(chance.randbytes(12))
                    await parts(simulator.model, 1)

                async def all_sent() -> bool:
                    position = await store.position(shop.machine)
                    return position.sequence == 5 and not (await store.counts(shop.machine)).waiting

                await until(all_sent, "everything at the server")
            store.close()
            readings = shop.call("GET", f"/readings?characteristic={shop.characteristic}")["items"]
            truth = list(simulator.model.truth().values())
            assert [reading["measured"] for reading in readings] == pytest.approx(truth, abs=6e-5)

    run(work())
