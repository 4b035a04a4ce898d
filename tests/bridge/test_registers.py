"""Readings from the ring against the model, with whatever may happen in between."""

import random
import re
from collections.abc import Sequence
from contextlib import suppress
from datetime import datetime
from pathlib import Path

import pytest

from app.bridge import registers as registers_module
from app.bridge.links import ControlAway, CountersLost, Decided, Misconfigured, Position
from app.bridge.registers import RegisterLink
from app.core.ring import SIZE, Register, Status, Told, Unit
from app.simulators.controls.model import Feature, Model
from tests.bridge.plant import ModelRegisters, machine, store_in
from tests.bridge.ring_link import link_of, made
from tests.loops import run


@pytest.mark.parametrize("whole", [True, False])
@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(2, 40))])
def test_every_reading_comes_once_and_in_order_whatever_is_cut(tmp_path: Path, seed: int, *, whole: bool) -> None:
    """The bridge reads half slots, loses acknowledgements, and is killed; the power of the control fails."""
    chance = random.Random(seed)
    model = Model(seed=seed)
    program = iter(model.part())

    def go_on(steps: int) -> None:
        nonlocal program
        for _ in range(steps):
            if next(program, "end") == "end":
                program = iter(model.part())
        if chance.random() < 0.02:
            model.power_loss()
            program = iter(model.part())

    async def story() -> None:
        store = store_in(tmp_path)
        link, registers = link_of(model, whole=whole)
        registers.on_read = lambda: go_on(chance.randrange(4))
        for _ in range(600):
            go_on(chance.randrange(12))
            with suppress(ControlAway, Misconfigured):
                received = await link.fetch(await store.position("lathe-1"))
                if chance.random() < 0.1:
                    link, registers = link_of(model, whole=whole)  # killed before it has stored
                    continue
                await store.add("lathe-1", received)
                if chance.random() < 0.1:
                    continue  # killed before the acknowledgement
                await link.acknowledge(received)
        registers.on_read = None
        for _ in range(3):
            received = await link.fetch(await store.position("lathe-1"))
            await store.add("lathe-1", received)
            await link.acknowledge(received)
        arrived = {
            row.key.removeprefix("lathe-1:"): row.body["measured"] for row in await store.waiting("lathe-1", 10_000)
        }
        assert arrived == model.truth()
        assert list(arrived) == list(model.truth())
        assert len(arrived) > 50

    run(story())


def test_the_ring_waits_for_the_acknowledgement(tmp_path: Path) -> None:
    model = Model(tuple(Feature(number=number) for number in range(1, 13)))
    program = iter(model.part())
    for _ in range(500):
        next(program)
    assert model.registers[Register.WRITTEN] == 8, "the NC waits; nothing is overwritten"

    async def story() -> None:
        link, _ = link_of(model)
        received = await link.fetch(Position())
        await link.acknowledge(received)
        assert [each.position.sequence for each in received if each.position] == list(range(1, 9))
        for _ in program:
            pass
        assert len(await link.fetch(received[-1].position or Position())) == 4

    run(story())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({Register.EPOCH: 5}, "epoch 5"),
        ({Register.WRITTEN: 1, 26: 0, 36: 0}, "went back"),
        ({Register.WRITTEN: 99}, "are lost"),
    ],
)
def test_counters_that_went_back_ask_a_person(change: dict[int, float], words: str) -> None:
    model = Model()
    made(model, 3)

    async def story() -> None:
        link, _ = link_of(model)
        received = await link.fetch(Position())
        for place, value in change.items():
            model.registers[place] = value
        with pytest.raises(CountersLost, match=f"{words}.*accept-counters lathe-1"):
            await link.fetch(received[-1].position or Position())

    run(story())


@pytest.mark.parametrize(
    ("registers", "unit", "words"),
    [([0.0] * SIZE, "mm", "has not set it up"), (None, "inch", "works in mm, the configuration says unit = 'inch'")],
)
def test_a_wrong_block_or_unit_is_said_before_anything_is_fetched(
    registers: Sequence[float] | None, unit: str, words: str
) -> None:
    model = Model()
    made(model)
    if registers is not None:
        model.registers[:] = registers

    async def story() -> None:
        link, found = link_of(model, unit=unit)
        with pytest.raises(Misconfigured, match=words):
            await link.fetch(Position())
        assert found.writes == []

    run(story())


def test_a_reading_says_what_the_control_knows() -> None:
    model = Model(unit=Unit.INCH, clock_ahead=90.0)
    for _ in model.part():
        pass

    async def story() -> None:
        link, _ = link_of(model)
        [first] = await link.fetch(Position())
        await link.acknowledge([first])
        assert first.body["measured"] == pytest.approx(40.0, abs=0.02), "inches come as millimetres"
        assert (first.body["part"], first.body["correction_in_effect"]) == ("1", 0)
        assert "measured_at" not in first.body, "who knows how long it lay there"
        for _ in model.part():
            pass
        [second] = await link.fetch(first.position or Position())
        assert "measured_at" in second.body
        assert link.clock.offset == pytest.approx(90, abs=3)
        for _ in model.send(1, 0.0, 3, Status.NO_TRIGGER):
            pass
        [missed] = await link.fetch(second.position or Position())
        await link.acknowledge([missed])
        assert missed.fault is None, "the server makes a probe fault of it; in the quarantine nobody would see it"
        assert (missed.body["touches"], "measured" in missed.body) == ([], False)
        second = missed
        for status, words in ((Status.MARKED, "marked"), (9, "not known")):
            for _ in model.send(1, 40.0, 3, status):
                pass
            [faulty] = await link.fetch(second.position or Position())
            await link.acknowledge([faulty])
            assert words in (faulty.fault or "")
            second = faulty
        for _ in model.send(77, 40.0, 3):
            pass
        [unknown] = await link.fetch(second.position or Position())
        assert "characteristic 77" in (unknown.fault or "")

    run(story())


@pytest.mark.parametrize("whole", [True, False])
def test_a_slot_that_stays_unreadable_is_remarked(monkeypatch: pytest.MonkeyPatch, *, whole: bool) -> None:
    """Another program has written in the ring: without a word the NC would wait for a bridge that is online."""
    monkeypatch.setattr(registers_module, "UNREADABLE_AFTER", 0.0)
    model = Model()
    made(model, 3)

    async def story() -> None:
        link, _ = link_of(model, whole=whole)
        [first, *_] = await link.fetch(Position())
        assert first.position is not None
        right, model.registers[28] = model.registers[28], 99.0
        for remark in ("", "Reading 2 lies in the ring and cannot be read: .* registers \\+26 to \\+35"):
            assert await link.fetch(first.position) == []
            assert bool(link.remark) is bool(remark)
            assert re.match(remark, link.remark)
        model.registers[28] = right
        assert len(await link.fetch(first.position)) == 2
        assert link.remark == ""

    run(story())


@pytest.mark.parametrize("error", [ControlAway("The control has not answered ?Q600 3011."), TimeoutError()])
def test_a_control_that_does_not_tell_its_date_is_connected_all_the_same(error: Exception) -> None:
    class Dateless(ModelRegisters):
        async def shown_time(self) -> datetime | None:
            raise error

    model = Model(clock_ahead=-86_400.0)
    link = RegisterLink(machine(model), Dateless(model))
    assert run(link.connect()) == model.serial
    assert (link.clock.offset, link.clock.days) == (None, 0)


@pytest.mark.parametrize("whole", [True, False])
def test_a_decision_is_written_action_first_and_never_lowered(*, whole: bool) -> None:
    model = Model((Feature(),))
    for _ in range(3):
        for _ in model.part():
            pass
    epoch = round(model.registers[Register.EPOCH])

    def decided(sequence: int, action: str, of: int = epoch) -> Decided:
        return Decided(f"lathe-1:{of}:{sequence}", "shaft-1", action)

    async def work() -> None:
        registers = ModelRegisters(model, whole=whole)
        link = RegisterLink(machine(model), registers)
        await link.connect()
        await link.fetch(Position())
        registers.writes.clear()
        await link.decide([decided(1, "none"), decided(9, "stop", epoch + 1)])
        assert registers.writes == [(Register.DECIDED, 1.0)]
        for later in ([decided(2, "stop")], [decided(3, "hold"), decided(1, "stop")]):
            await link.fetch(Position())
            await link.decide(later)
        assert registers.writes[1:] == [(Register.ACTION, 2.0), (Register.DECIDED, 2.0), (Register.DECIDED, 3.0)]

    run(work())
    assert model.registers[Register.ACTION] == Told.STOP
    for _ in model.part():
        pass
    assert (model.told, model.registers[Register.ACTION]) == ([Told.STOP], 0.0)
