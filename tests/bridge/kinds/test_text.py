"""Readings in lines of text, by TCP and from a serial port."""

import asyncio
import os
import pty
import time
import tomllib
import tty
from collections.abc import Sequence
from contextlib import AbstractAsyncContextManager
from pathlib import Path
from typing import Any

import pytest

from app.bridge.configuration import ConfigurationError, Machine, configuration_from
from app.bridge.kinds.text import TextLines, TextLink
from app.bridge.links import Misconfigured, Position, Received
from app.bridge.patterns import Patterns, TooSlow
from app.bridge.sources import Source
from app.bridge.store import Store
from app.bridge.unit import Unit
from app.simulators.controls import simulator_named
from app.simulators.controls.model import Feature, Model
from app.simulators.controls.toml_text import toml_of
from tests.bridge.plant import controlled, parts, store_in, until
from tests.loops import run

LINES = (r"^PART +(?P<part>\S+)", r"(?P<characteristic>D\d+) +ACTUAL +(?P<measured>[-\d.]+)")


def machine(corrections: str = "none", **settings: Any) -> Machine:
    table = {
        "kind": "text",
        "unit": "mm",
        "secret": "x",
        "corrections": corrections,
        "interval": 0.02,
        "characteristics": {"D40": "shaft-1", "D20": "bore-1"},
        "text": {"connect": "127.0.0.1:9", "lines": LINES} | settings,
    }
    if corrections != "none":
        table["location"] = [{"tool_memory": 3, "tool": 3, "register": "x", "holds": "length"}]
    content = {"server": {"url": "http://127.0.0.1:1"}, "machine": {"gauge-1": table}}
    return configuration_from(content, Path()).machines[0]


class Canned(Source[Any]):
    """A source of bytes that are given."""

    def __init__(self, link: TextLink, *batches: bytes) -> None:
        self.lines, self.batches = TextLines(link.settings), list(batches)

    async def take(self) -> list[Any]:
        return self.lines.feed(self.batches.pop(0)) if self.batches else []

    def damaged(self) -> int:
        return self.lines.damaged


def printed(*batches: bytes, **settings: Any) -> list[Received]:
    """What the link makes of these bytes, each by a poll."""
    link = TextLink(machine(**settings))
    link._source = Canned(link, *batches)

    async def work() -> list[Received]:
        found: list[Received] = []
        for _ in batches:
            found += (received := await link.fetch(Position()))
            await link.acknowledge(received)
        return found

    return run(work())


def sizes(received: Sequence[Received]) -> list[tuple[Any, ...]]:
    return [tuple(each.body.get(name) for name in ("characteristic", "measured", "part")) for each in received]


def test_lines_become_readings_and_what_stands_above_holds() -> None:
    text = b"PART P7\r\nD40 NOMINAL 40 D40 ACTUAL 40.012\r\nrubbish\rD20 ACTUAL 20.1\nPART P8\nD40 ACT"
    found = printed(text, b"UAL 40.013\n")
    assert sizes(found) == [("shaft-1", 40.012, "P7"), ("bore-1", 20.1, "P7"), ("shaft-1", 40.013, "P8")]
    assert all(each.body["measured_at"] for each in found)


def test_a_line_that_is_printed_again_is_the_same_reading_if_that_can_be_seen() -> None:
    same = printed(b"PART P7\nD40 ACTUAL 40.0\nD40 ACTUAL 40.0\nD40 ACTUAL 40.1\n")
    assert len({each.key for each in same}) == 2
    unnamed = printed(b"D40 ACTUAL 40.0\nD40 ACTUAL 40.0\n")
    assert len({each.key for each in unnamed}) == 2


def test_parity_and_signs_of_a_handshake_are_left_out() -> None:
    seven = bytes(byte | (0x80 if byte.bit_count() % 2 else 0) for byte in b"D40 ACTUAL 40.012\r\n")
    assert sizes(printed(b"\x12" + seven + b"\x14\0")) == [("shaft-1", 40.012, None)]
    assert sizes(printed("Maß\nD40 ACTUAL 40.0\n".encode("cp1252"), encoding="cp1252")) == [("shaft-1", 40.0, None)]


def test_a_temperature_that_is_left_out_is_reported_until_a_good_one_comes() -> None:
    both = r"(?P<characteristic>\w+) (?P<measured>\S+) AT (?P<part_temperature>\S*) OF (?P<machine_temperature>\S*)"
    link = TextLink(machine(lines=[both]))
    part, of_machine = (
        f"{name}_temperature '{value}' is not a number of °C, with decimal = \".\"; left out."
        for name, value in (("part", "21,5"), ("machine", "---"))
    )
    link._source = Canned(
        link,
        b"D40 40.0 AT 21,5 OF ---\n",
        b"D40 40.0 AT  OF 20.5\n",
        b"D40 4-0 AT 21.5 OF x\n",
        b"D40 40.0 AT 21.5 OF 20.5\n",
    )

    async def work() -> None:
        [found] = await link.fetch(Position())
        assert "context" not in found.body
        for remark in (f"{part} {of_machine}", part, part, ""):  # the third line is refused: it holds no reading
            assert link.remark == remark
            await link.fetch(Position())

    run(work())


def test_what_is_wrong_goes_to_the_quarantine_with_its_line() -> None:
    size, name = printed(b"D40 ACTUAL 4-0\nD99 ACTUAL 1.0\n")
    assert "'D40 ACTUAL 4-0': measured '4-0' is not a number" in str(size.fault)
    assert "'D99' is not named in machine.gauge-1.characteristics" in str(name.fault)
    assert printed(b"D99 ACTUAL 1.0\n", others="skip") == []


@pytest.mark.parametrize(
    ("line", "expression", "number"),
    [
        (b"D40 ACTUAL 40,001", r"ACTUAL +(?P<measured>[-\d.]+)", "'40' out of '40,001'"),
        (b"D40 ACTUAL 40.001", r"ACTUAL +(?P<measured>\d+\.\d\d)", "'40.00' out of '40.001'"),
        (b"D40 ACTUAL 40.001", r"ACTUAL.*(?P<measured>\d+\.\d+)", "'0.001' out of '40.001'"),
        (b"D40 ACTUAL 4.0E+01", r"ACTUAL +(?P<measured>[-\d.]+)", "'4.0' out of '4.0E+01'"),
    ],
)
def test_a_part_of_a_number_is_no_size(line: bytes, expression: str, number: str) -> None:
    [found] = printed(line + b"\n", lines=(expression,))
    assert number in str(found.fault)


def test_what_an_expression_names_beside_the_size_is_no_part_of_it() -> None:
    columns = Patterns((r"^(?P<part>\d{4})(?P<measured>\d+\.\d+)", r"^\w+;(?P<measured>[\d.]+),"))
    assert [
        each["measured"] for line in ("000140.001", "D;40.001,40.008", "D;40,1") for each in columns.find(line)
    ] == [
        "40.001",
        "40.001",
        "40",
    ]
    assert Patterns((r"(?P<measured>[\d.]+)",)).find("40.001,40.008")[0]["measured"] == "40.001"


def test_an_expression_that_takes_for_ever_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.bridge.patterns.LONGEST_SEARCH", 0.05)
    slow = (r"^(?P<measured>(?:\d|\d\d)+)$",)
    began = time.thread_time()
    with pytest.raises(TooSlow, match="make it simpler"):
        Patterns(slow).find("1" * 60 + "!")
    [found] = printed(b"1" * 60 + b"!\n", lines=slow)
    assert "takes longer than" in str(found.fault)
    assert time.thread_time() - began < 5, "seconds of the processor"


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"lines": ("(",)}, "is no regular expression"),
        ({"lines": ("x",)}, "one expression needs the group"),
        ({"encoding": "utf-9"}, "is not known"),
    ],
)
def test_mistakes_are_said(settings: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigurationError, match=words):
        machine(**settings)


def test_a_source_has_to_be_named_and_corrections_do_not_go() -> None:
    async def fails(chosen: Machine) -> str:
        with pytest.raises(Misconfigured) as error:
            await TextLink(chosen).connect()
        return str(error.value)

    async def work() -> None:
        assert "text needs one of serial, connect and listen; it has none" in await fails(machine(connect=None))
        assert 'Set corrections = "none"' in await fails(machine(corrections="control"))

    run(work())


def fetching(chosen: Machine, store: Store) -> AbstractAsyncContextManager[Unit]:
    return controlled(Unit(chosen, TextLink(chosen), store))


async def stored(store: Store, count: int) -> None:
    async def met() -> bool:
        return len(await store.waiting("gauge-1")) == count

    await until(met, "the readings")


@pytest.mark.parametrize("system", ["any", "Windows"])
def test_readings_come_by_tcp_and_from_a_serial_port(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, system: str
) -> None:
    if system == "Windows":  # where no loop waits for a serial port

        async def refused(*_: Any) -> None:
            raise NotImplementedError

        monkeypatch.setattr(asyncio.SelectorEventLoop, "connect_read_pipe", refused)

    async def work() -> None:
        store = store_in(tmp_path)

        async def print_one(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            writer.write(b"PART P1\r\nD40 ACTUAL 40.012\r\n")
            writers.append(writer)

        writers: list[asyncio.StreamWriter] = []
        server = await asyncio.start_server(print_one, "127.0.0.1", 0)
        async with fetching(machine(connect=f"127.0.0.1:{server.sockets[0].getsockname()[1]}"), store):
            await stored(store, 1)
        for writer in writers:
            writer.close()
            await writer.wait_closed()
        server.close()
        await server.wait_closed()
        ours, theirs = pty.openpty()
        tty.setraw(theirs)
        async with fetching(machine(connect=None, serial=os.ttyname(theirs), framing="8N1"), store) as unit:
            await until(lambda: unit.state == "online", "the port")
            os.write(ours, b"PART P2\r\nD20 ACTUAL 20.0\r\n")
            await stored(store, 2)
        os.close(ours)
        os.close(theirs)
        store.close()

    run(work())


def test_the_simulated_machine_prints_what_its_table_finds(tmp_path: Path) -> None:
    """The table goes into a configuration as it is printed; each reading has the size that was measured, and its part."""

    async def work() -> None:
        model, store = Model(tuple(Feature(number) for number in (1, 2))), store_in(tmp_path)
        simulator = await simulator_named("text").serve(model)
        table = toml_of("gauge-1", simulator.table()).replace('secret_file = "machine.key"', 'secret = "x"')
        content = {"server": {"url": "http://127.0.0.1:1"}, **tomllib.loads(table)}
        [chosen] = configuration_from(content, tmp_path).machines
        async with fetching(chosen, store):
            await until(lambda: simulator.connections, "the bridge is connected")
            await parts(model, 3)
            await stored(store, 6)
        rows = [row.body for row in await store.waiting("gauge-1")]
        assert [(row["characteristic"], row["part"]) for row in rows] == [
            (f"characteristic-{number}", f"00000{part}") for part in (1, 2, 3) for number in (1, 2)
        ]
        assert [row["measured"] for row in rows] == list(model.truth().values())
        await simulator.stop()
        store.close()

    run(work())
