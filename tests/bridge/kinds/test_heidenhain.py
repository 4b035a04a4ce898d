"""A TNC: lines of FN 16 and correction programs by LSV2 file transfer, against a simulated control; and in a folder."""

import asyncio
import random
import re
from collections.abc import AsyncIterator
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from app.bridge.configuration import ConfigurationError, Machine, configuration_from
from app.bridge.kinds.heidenhain import Answered, Settings, TncLink, answer_check, answers_in
from app.bridge.links import ControlAway, LinkError, Order, Outcome, Position
from app.bridge.store import Store
from app.bridge.tnc_program import correction_program
from app.bridge.unit import Unit as Tasks
from app.core.printed_line import Printed, line_of
from app.core.ring import Slot, Unit
from app.simulators.controls.heidenhain import CORRECTIONS, FEATURES, READINGS, TncSimulator, serve
from app.simulators.controls.model import Model
from tests.bridge.plant import controlled, machine, parts, store_in, until
from tests.core.damage import with_neighbours_exchanged, with_one_bit_of_it_changed, with_one_digit_changed
from tests.loops import run

PLACE = (3, 1, "QR31")
ORDER = Order(12, 3, 0.0, -0.02)


@asynccontextmanager
async def control() -> AsyncIterator[TncSimulator]:
    simulator = await serve(Model(FEATURES))
    try:
        yield simulator
    finally:
        await simulator.stop()


def tnc(settings: Settings, **other: Any) -> Machine:
    return machine(Model(FEATURES), **{"kind": "heidenhain", "settings": settings, "interval": 0.05} | other)


def settings(simulator: TncSimulator, **other: Any) -> Settings:
    given: dict[str, Any] = {"address": "127.0.0.1", "port": simulator.port, "answer": 5.0}
    return Settings(**given | other)


def fetching(one: Machine, store: Store) -> AbstractAsyncContextManager[Tasks]:
    return controlled(Tasks(one, TncLink(one), store))


async def stored(store: Store) -> dict[str, float]:
    return {row.key.removeprefix("lathe-1:"): row.body["measured"] for row in await store.waiting("lathe-1", 10_000)}


async def said(one: Machine) -> str:
    """The sentence with which the link refuses."""
    link = TncLink(one)
    with pytest.raises(LinkError) as error:
        await link.connect()
        await link.fetch(Position())
        await link.offer([])
    await link.close()
    return str(error.value)


async def answer(link: TncLink, simulator: TncSimulator) -> Outcome:
    """Make parts until the control has answered."""

    async def answered() -> bool:
        await parts(simulator.model, 1)
        await link.fetch(Position())
        return bool(await link.outcomes())

    await until(answered, "the answer")
    [outcome] = await link.outcomes()
    return outcome


def execute(text: str, registers: dict[str, float]) -> int:
    """Run a correction program as a TNC does; number of answers."""
    lines = [re.sub(r"^\d+ ", "", line).partition(";")[0].strip() for line in text.splitlines()]
    at = answers = 0
    while at < len(lines):
        line = lines[at]
        at += 1
        if jump := re.fullmatch(r"FN (?:9|12): IF \+(\S+) (EQU|LT) \+(\S+) GOTO LBL (\d+)", line):
            left, right = (registers[each] if each in registers else float(each) for each in (jump[1], jump[3]))
            if left == right if jump[2] == "EQU" else left < right:
                at = lines.index(f"LBL {jump[4]}")
        elif difference := re.fullmatch(r"(Q\w+) = ABS \( (QR\d+) - (\S+) \)", line):
            registers[difference[1]] = abs(registers[difference[2]] - float(difference[3]))
        elif assignment := re.fullmatch(r"(Q\w+) = (\S+)", line):
            word = assignment[2]
            registers[assignment[1]] = registers[word] if word in registers else float(word)
        elif line.startswith("CALL PGM"):
            answers += 1
        elif line == "STOP":
            registers["stops"] = registers.get("stops", 0.0) + 1
        else:
            assert re.fullmatch(r"|LBL \d+|(BEGIN|END) PGM CORR MM", line), line
    return answers


def test_no_damaged_answer_counts() -> None:
    """Each digit, each bit, each two neighbours; of numbers that 97 divides too."""
    sizes = [(unit, steps / (10_000 if unit is Unit.MM else 100_000)) for unit in Unit for steps in range(-48, 49)]
    answers = [Answered(number, 0, 31, -0.0123, Unit.MM) for number in (1, 97, 970, 9_999_999)]
    answers += [Answered(18, answer, 97, held, unit) for answer in (0, 1) for unit, held in sizes]
    for one in answers:
        shown = f"{one.held:.{4 if one.unit is Unit.MM else 5}f}"
        line = f"INBANS N{one.number} A{one.answer} R{one.register} V{shown} U{one.unit:d} K{answer_check(one)} FIN"
        assert answers_in(line) == [one]
        for wrong in with_one_digit_changed(line):
            assert answers_in(wrong) == [], wrong
        for damaged in (with_neighbours_exchanged, with_one_bit_of_it_changed):
            for wrong in damaged(line):
                assert answers_in(wrong) in ([], [one]), wrong


@pytest.mark.parametrize(
    ("held", "answered", "after", "answer"), [(0.0, 0, -0.01, 0), (-0.01, 0, -0.01, 0), (0.004, 0, 0.004, 1)]
)
def test_the_correction_program_sets_the_expected_offset_and_no_other(
    held: float, answered: int, after: float, answer: int
) -> None:
    text = correction_program([ORDER], {3: tnc(Settings(folder="x")).location[0]}, "mm", CORRECTIONS)
    registers = {"QR31": held, "QR3": 0.0, "QR4": float(answered), "Q1610": 0.0, "Q1611": 0.0}
    assert execute(text, registers) == 1
    assert (registers["QR31"], registers["Q1611"], registers["QR4"]) == (after, answer, 12)
    assert registers["QR3"] == (12 if answer == 0 else 0)
    registers["QR31"] = 0.0
    assert execute(text, registers) == 0  # answered once
    assert registers["QR31"] == 0.0


def test_one_program_sets_the_offset_of_every_location_and_stops_once() -> None:
    one = tnc(Settings(folder="x")).location[0]
    places = {memory: replace(one, tool_memory=memory, register=f"QR{28 + memory}") for memory in (3, 4, 5)}
    orders = [Order(12, 3, 0.0, -0.02), Order(7, 4, 0.01, 0.03, (5,)), Order(9, 5, 0.0, 0.01)]
    text = correction_program(orders, places, "mm", CORRECTIONS, stop=41)
    names = ("QR3", "QR4", "QR5", "QR31", "QR32", "QR33", "Q1610", "Q1611")
    registers = dict.fromkeys(names, 0.0) | {"QR32": 0.005, "QR33": 0.5}
    assert execute(text, registers) == 3
    assert [registers[f"QR{number}"] for number in (31, 32, 33)] == [-0.01, 0.015, 0.5], "the third was edited by hand"
    assert (registers["QR3"], registers["QR4"], registers["stops"]) == (12, 12, 1)
    assert execute(text, registers) == 0
    assert registers["stops"] == 1


def test_readings_arrive_once_and_in_order_through_cuts(tmp_path: Path) -> None:
    async def work() -> None:
        store = store_in(tmp_path)
        chance = random.Random(3)
        async with control() as simulator, fetching(tnc(settings(simulator)), store) as tasks:
            for _ in range(6):
                await parts(simulator.model, chance.randint(1, 4))
                await asyncio.sleep(chance.random() / 5)
                simulator.run_again()
                simulator.cut()
            truth = {key: round(size, 4) for key, size in simulator.model.truth().items()}

            async def complete() -> bool:
                return len(await stored(store)) >= len(truth)

            await until(complete, "all readings")
            assert list((await stored(store)).items()) == list(truth.items())
            await until(lambda: tasks.state == "online", "the connection")
            assert tasks.identity == "TNC640 SIM-0001"
        store.close()

    run(work())


def test_a_restarted_bridge_goes_on_where_its_store_ends_also_after_the_file_was_emptied(tmp_path: Path) -> None:
    async def work() -> None:
        async with control() as simulator:
            await parts(simulator.model, 3)
            await until(lambda: simulator.files[READINGS].count(b"FIN") == 3, "three lines")
            epoch = simulator.model.written[0][0]
            link = TncLink(tnc(settings(simulator)))
            await link.connect()
            received = await link.fetch(Position(epoch, 2))
            assert [each.position for each in received] == [Position(epoch, 3)]
            await link.acknowledge(received)
            simulator.files[READINGS] = b""
            assert await link.fetch(Position(epoch, 3)) == []
            await parts(simulator.model, 1)
            await until(lambda: b"FIN" in simulator.files[READINGS], "a line")
            received = await link.fetch(Position(epoch, 3))
            assert [each.position for each in received] == [Position(epoch, 4)]
            await link.close()
            await until(lambda: simulator.connections == 0, "the end of the connection")

    run(work())


def test_a_correction_is_applied_once_through_cuts(tmp_path: Path) -> None:
    async def work() -> None:
        async with control() as simulator:
            link = TncLink(tnc(settings(simulator)))
            for _ in range(3):
                await link.connect()
                await link.fetch(Position())
                await link.offer([ORDER])
                await link.offer([ORDER])
                outcome = await answer(link, simulator)
                assert (outcome.number, outcome.applied) == (12, True)
                assert outcome.offset == pytest.approx(-0.02)
                simulator.cut()
                await link.close()
            assert len(simulator.model.applied) == 1
            assert simulator.model.offsets[PLACE] == -0.01  # a radius

    run(work())


def test_an_offset_that_was_set_by_hand_stays_and_a_withdrawn_correction_is_not_taken(tmp_path: Path) -> None:
    async def work() -> None:
        async with control() as simulator:
            link = TncLink(tnc(settings(simulator)))
            await link.connect()
            await link.fetch(Position())
            await link.offer([ORDER])
            await link.offer([])
            assert b"QR31" not in simulator.files[CORRECTIONS]
            await asyncio.sleep(0.05)
            await parts(simulator.model, 1)
            assert simulator.model.applied == []
            simulator.model.edit(PLACE, 0.005)
            await link.offer([ORDER])
            outcome = await answer(link, simulator)
            assert (outcome.applied, outcome.differs) == (False, True)
            assert outcome.offset == pytest.approx(0.01)
            assert simulator.model.offsets[PLACE] == 0.005
            await link.close()

    run(work())


def test_a_folder_serves_in_place_of_lsv2(tmp_path: Path) -> None:
    async def work() -> None:
        link = TncLink(tnc(Settings(folder=str(tmp_path))))
        assert await link.connect() == str(tmp_path)
        assert await link.fetch(Position()) == []
        first, second = (
            line_of(Printed(7, Unit.MM, Slot(number, 1, 40.001 + number, 0, 1, 3, 0))) for number in (1, 2)
        )
        readings = tmp_path / "readings.txt"
        readings.write_bytes(f"Prüfung\r\n{first}\r\n{second[:20]}".replace(".", ",").encode("cp1252"))
        assert [each.key for each in await link.fetch(Position())] == ["lathe-1:7:1"]
        readings.write_bytes(f"Prüfung\r\n{first}\r\n{second}\r\n".replace(".", ",").encode("cp1252"))
        received = await link.fetch(Position())
        assert [(each.key, each.body["measured"]) for each in received] == [
            ("lathe-1:7:1", 41.001),
            ("lathe-1:7:2", 42.001),
        ]
        changed = line_of(Printed(7, Unit.MM, Slot(2, 1, 43.0, 0, 1, 3, 0)))
        with readings.open("ab") as file:
            file.write(changed.encode())
        assert "one of the two is wrong" in str((await link.fetch(Position()))[-1].fault)
        await link.offer([ORDER])
        assert "QR31 = -0.010000" in (tmp_path / "corr.h").read_text(encoding="cp1252")
        await link.close()

    run(work())


def test_links_in_a_folder_are_neither_read_nor_written_through(tmp_path: Path) -> None:
    async def work() -> None:
        folder = tmp_path / "share"
        folder.mkdir()
        victim = tmp_path / "victim"
        victim.write_text("untouched")
        (folder / "corr.new").symlink_to(victim)
        (folder / "corr.h").symlink_to(victim)
        link = TncLink(tnc(Settings(folder=str(folder))))
        await link.connect()
        await link.offer([ORDER])
        assert "QR31 = -0.010000" in (folder / "corr.h").read_text(encoding="cp1252")
        assert victim.read_text() == "untouched"
        (folder / "readings.txt").symlink_to(victim)
        with pytest.raises(ControlAway, match="is a link"):
            await link.fetch(Position())
        await link.close()

    run(work())


def test_mistakes_are_said(tmp_path: Path) -> None:
    async def work() -> None:
        async with control() as simulator:
            good = settings(simulator)
            assert "by its program only" in await said(tnc(good, corrections="direct"))
            wrong = machine(Model())
            assert "is not a QR parameter" in await said(tnc(good, location=wrong.location))
            assert "Make the directory" in await said(tnc(settings(simulator, corrections="TNC:\\no\\corr.h")))
            simulator.allowed = {"INSPECT"}
            assert "refuses the login FILE" in await said(tnc(good))
            simulator.silent = True
            assert "has not answered for 0.2 s" in await said(tnc(settings(simulator, answer=0.2)))
        assert "Are address and port right" in await said(tnc(good))
        assert "is the share mounted" in await said(tnc(Settings(folder=str(tmp_path / "none"))))
        link = TncLink(tnc(good))
        with pytest.raises(ControlAway, match="not connected"):
            await link.fetch(Position())

    run(work())


def test_the_check_writes_a_program_as_that_of_the_corrections_and_takes_it_away() -> None:
    async def work() -> None:
        async with control() as simulator:
            simulator.files["TNC:\\inband\\corr.h"] = b"0 BEGIN PGM CORR MM"
            before = dict(simulator.files)
            link = TncLink(tnc(settings(simulator)))
            await link.connect()
            assert await link.try_out() == []
            assert simulator.files == before
            await link.close()
            other = TncLink(tnc(settings(simulator, corrections="TNC:\\no\\corr.h")))
            await other.connect()
            [wrong] = await other.try_out()
            assert "Make the directory" in wrong
            await other.close()

    run(work())


def test_the_configuration_needs_an_address_or_a_folder(tmp_path: Path) -> None:
    table = {"kind": "heidenhain", "unit": "mm", "secret": "s", "corrections": "none"}
    with pytest.raises(ConfigurationError, match="needs one of address and folder"):
        configuration_from({"server": {"url": "http://x"}, "machine": {"mill-1": table}}, tmp_path)
