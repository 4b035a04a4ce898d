"""Ring, mailbox and direct writes against the model, with whatever may happen in between."""

import random
import re
from collections.abc import Sequence
from contextlib import suppress
from datetime import datetime
from pathlib import Path

import pytest

from app.bridge import registers as registers_module
from app.bridge.configuration import Location
from app.bridge.links import ControlAway, CountersLost, Decided, Misconfigured, Order, Outcome, Position
from app.bridge.registers import RegisterLink
from app.core.ring import SIZE, Answer, Register, Status, Told, Unit
from app.simulators.controls.model import Feature, Model
from tests.bridge.plant import ModelRegisters, location, machine, store_in
from tests.loops import run

PLACE = (3, 1, "wear_length_1")


def made(model: Model, parts: int = 1) -> None:
    for _ in range(parts):
        for _ in model.part():
            pass


def link_of(model: Model, *, whole: bool = True, **fields: object) -> tuple[RegisterLink, ModelRegisters]:
    registers = ModelRegisters(model, whole=whole)
    return RegisterLink(machine(model, **fields), registers), registers


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


# --- corrections


def test_the_mailbox_brings_a_correction_and_its_answer() -> None:
    model = Model((Feature(holds="radius", sign=-1),))
    made(model)

    async def story() -> None:
        link, _ = link_of(model)
        await link.fetch(Position())
        order = Order(18, 3, 0.0, 0.010)
        await link.offer([order])
        await link.fetch(Position())
        await link.offer([order])
        assert model.offsets[PLACE] == 0.0, "the NC takes it, nobody else"
        made(model)
        await link.fetch(Position())
        assert model.offsets[PLACE] == pytest.approx(-0.005), "half of it, in the other sense"
        assert await link.outcomes() == [Outcome(18, applied=True, offset=0.010)]
        made(model)
        assert len(model.applied) == 1

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


def test_a_correction_that_the_nc_program_holds_is_remarked() -> None:
    model = Model(on_hold=True)
    made(model)

    async def story() -> None:
        link, _ = link_of(model)
        await link.fetch(Position())
        await link.offer([Order(18, 3, 0.0, 0.010)])
        made(model)
        await link.fetch(Position())
        assert link.remark.startswith("Correction 18 waits: the NC program holds corrections (answer 9).")
        model.on_hold = False
        made(model)
        await link.fetch(Position())
        assert link.remark == ""
        assert await link.outcomes() == [Outcome(18, applied=True, offset=0.010)]

    run(story())


@pytest.mark.parametrize("answer", [Answer.CHECK_WRONG, Answer.ON_HOLD])
def test_an_answer_counts_though_the_nc_has_looked_at_mail_behind_it(answer: Answer) -> None:
    """It had applied the correction while the bridge took it back: the number of before with another check sum lay there."""
    model = Model()
    made(model)

    async def story() -> None:
        link, _ = link_of(model)
        await link.fetch(Position())
        await link.offer([Order(18, 3, 0.0, 0.010)])
        await link.fetch(Position())
        made(model)
        await link.offer([])
        model.registers[Register.ANSWER] = answer
        await link.fetch(Position())
        assert await link.outcomes() == [Outcome(18, applied=True)]

    run(story())


def test_an_answer_that_contradicts_itself_is_not_confirmed_and_is_said() -> None:
    """The answer has no check sum; what is applied is said twice."""
    model = Model()
    made(model)
    order = Order(18, 3, 0.0, 0.010)

    async def story() -> None:
        link, _ = link_of(model)
        await link.fetch(Position())
        await link.offer([order])
        model.edit(PLACE, 0.05)
        made(model)
        assert model.registers[Register.ANSWER] == Answer.OFFSET_DIFFERS
        model.registers[Register.ANSWER] = Answer.APPLIED  # one register damaged
        await link.fetch(Position())
        assert await link.outcomes() == []
        await link.offer([order])
        assert link.remark.startswith(
            "The control answers that correction 18 is applied (+4), but names 0 as the last one (+3)"
        )
        model.registers[Register.ANSWER] = Answer.OFFSET_DIFFERS
        await link.fetch(Position())
        assert [(each.number, each.differs) for each in await link.outcomes()] == [(18, True)]
        await link.offer([order])
        assert link.remark == ""

    run(story())


@pytest.mark.parametrize("number", [18, 9_999_998])
@pytest.mark.parametrize("place", range(Register.MAIL_TOOL, Register.MAIL_NUMBER + 1))
def test_a_register_of_the_mailbox_that_is_one_off_is_written_again(number: int, place: int) -> None:
    """Of the largest numbers too: two of ten millions used to be taken for the same."""
    model = Model()
    made(model)

    async def story() -> None:
        link, registers = link_of(model)
        order = Order(number, 3, 0.0, 0.010)
        await link.fetch(Position())
        await link.offer([order])
        content = model.registers[Register.MAIL_TOOL : Register.MAIL_NUMBER + 1]
        model.registers[place] += 0.0001 if place in {Register.MAIL_EXPECTED, Register.MAIL_VALUE} else 1
        registers.writes.clear()
        for _ in range(3):
            await link.fetch(Position())
            await link.offer([order])
        assert registers.writes
        assert model.registers[Register.MAIL_TOOL : Register.MAIL_NUMBER + 1] == content

    run(story())


def test_an_acknowledgement_that_is_one_off_is_said() -> None:
    """One more than was fetched would let the NC program write over a reading."""
    model = Model()
    made(model)
    model.registers[Register.WRITTEN] = model.registers[Register.ACK] = 9_999_990.0

    async def story() -> None:
        link, registers = link_of(model)

        async def one_off(place: int, value: float) -> None:
            model.registers[place] = value + 1

        registers.write = one_off  # type: ignore[method-assign]
        made(model)
        epoch = int(model.registers[Register.EPOCH])
        with pytest.raises(ControlAway, match=r"Register \+0 \(ack\) holds"):
            await link.fetch(Position(epoch, 9_999_991))

    run(story())


def test_an_offset_that_was_edited_is_not_overwritten() -> None:
    model = Model()
    made(model)

    async def story() -> None:
        link, _ = link_of(model)
        await link.fetch(Position())
        await link.offer([Order(18, 3, 0.0, 0.010)])
        model.edit(PLACE, 0.05)
        made(model)
        await link.fetch(Position())
        [outcome] = await link.outcomes()
        assert outcome.differs
        assert not outcome.applied
        assert outcome.offset == pytest.approx(0.05)
        assert model.offsets[PLACE] == 0.05

    run(story())


def test_an_order_that_is_no_longer_wanted_is_taken_back() -> None:
    model = Model()
    made(model)

    async def story() -> None:
        link, _ = link_of(model)
        for orders in ([Order(18, 3, 0.0, 0.01)], [Order(19, 3, 0.0, 0.02)], [Order(19, 3, 0.0, 0.02)], []):
            await link.fetch(Position())
            await link.offer(orders)
        await link.fetch(Position())
        made(model)
        assert model.applied == []

    run(story())


@pytest.mark.parametrize("whole", [True, False])
def test_a_correction_that_lies_there_by_another_mapping_is_taken_back_first(*, whole: bool) -> None:
    """The bridge was ended, the sign corrected, and the bridge started again before the NC had looked."""
    model = Model()
    made(model)
    order = Order(18, 3, 0.0, 0.010)

    async def story() -> None:
        wrong, _ = link_of(model, whole=whole, location=(location(Feature(sign=-1)),))
        await wrong.fetch(Position())
        await wrong.offer([order])
        assert model.registers[Register.MAIL_VALUE] == -0.010
        right, _ = link_of(model, whole=whole)
        await right.fetch(Position())
        await right.offer([order])
        assert model.registers[Register.MAIL_NUMBER] == 0
        for _ in range(3):
            await right.fetch(Position())
            await right.offer([order])
        made(model)
        assert model.offsets[PLACE] == pytest.approx(0.010)

    run(story())


def test_a_mailbox_that_was_read_half_written_is_written_again() -> None:
    model = Model()
    made(model)

    async def story() -> None:
        link, _ = link_of(model)
        await link.fetch(Position())
        order = Order(18, 3, 0.0, 0.01)
        await link.offer([order])
        model.registers[Register.MAIL_VALUE] = 0.09  # somebody else's program
        made(model)
        assert model.registers[Register.ANSWER] == Answer.CHECK_WRONG
        assert model.applied == []
        for _ in range(2):
            await link.fetch(Position())
            assert await link.outcomes() == []
            await link.offer([order])
        for _ in range(3):
            await link.fetch(Position())
            await link.offer([order])
            assert model.registers[Register.MAIL_NUMBER] == 18, "it stays until the NC looks"
        made(model)
        assert [each.after for each in model.applied] == [0.01]

    run(story())


@pytest.mark.parametrize("after_step", range(12))
def test_a_power_loss_while_a_correction_is_taken_applies_it_once(after_step: int) -> None:
    model = Model()
    made(model)

    async def story() -> None:
        link, _ = link_of(model)
        await link.fetch(Position())
        await link.offer([Order(18, 3, 0.0, 0.010)])
        program = model.part()
        for _ in range(after_step):
            next(program, None)
        model.power_loss()
        made(model)
        await link.fetch(Position())
        assert await link.outcomes() == [Outcome(18, applied=True, offset=0.010)]
        assert model.offsets[PLACE] == pytest.approx(0.010)

    run(story())


def test_a_register_that_does_not_keep_what_is_written_is_said() -> None:
    model = Model()
    made(model)

    async def story() -> None:
        link, registers = link_of(model)
        await link.fetch(Position())

        async def ignored(place: int, value: float) -> None:
            pass

        registers.write = ignored  # type: ignore[method-assign]
        with pytest.raises(ControlAway, match="holds 0 after 3 was written"):
            await link.offer([Order(18, 3, 0.0, 0.010)])

    run(story())


@pytest.mark.parametrize(
    ("held", "applied", "differs", "writes"),
    [(0.0, True, False, 1), (0.010, True, False, 0), (0.004, False, True, 0)],
    ids=["as expected", "written before a crash", "edited by hand"],
)
def test_a_direct_write_is_a_comparison_first(held: float, writes: int, *, applied: bool, differs: bool) -> None:
    model = Model()
    made(model)
    model.offsets[PLACE] = held
    count = 0

    async def story() -> None:
        nonlocal count
        link, registers = link_of(model, corrections="direct")
        write = registers.write_offset

        async def counted(location: Location, value: float) -> None:
            nonlocal count
            count += 1
            await write(location, value)

        registers.write_offset = counted  # type: ignore[method-assign]
        await link.fetch(Position())
        for _ in range(2):
            await link.offer([Order(18, 3, 0.0, 0.010)])
        [outcome] = await link.outcomes()
        assert (outcome.applied, outcome.differs) == (applied, differs)
        assert count == writes

    run(story())


def test_two_offsets_that_differ_are_not_said_with_the_same_digits() -> None:
    """A ten-thousandth of an inch is 2.5 µm."""
    model = Model(unit=Unit.INCH)
    made(model)
    model.offsets[PLACE] = 0.00034

    async def story() -> None:
        link, _ = link_of(model, corrections="direct", unit="inch")
        await link.fetch(Position())
        await link.offer([Order(18, 3, 0.0076, 0.010)])
        [outcome] = await link.outcomes()
        assert outcome.reason == "The control holds 0.00034 inch, expected was 0.00030 inch."

    run(story())


def test_a_direct_write_waits_for_its_gate() -> None:
    model = Model()
    made(model)

    async def story() -> None:
        link, registers = link_of(model, corrections="direct")
        registers.may_write = "The program is running."
        await link.fetch(Position())
        await link.offer([Order(18, 3, 0.0, 0.010)])
        assert await link.outcomes() == []
        assert model.offsets[PLACE] == 0.0
        assert link.remark == "Correction 18 of tool memory 3 waits: The program is running."
        await link.fetch(Position())
        await link.offer([Order(18, 3, 0.0, 0.010), Order(19, 4, 0.0, 0.010)])
        assert link.remark == (
            "Correction 18 of tool memory 3 waits: The program is running."
            " Correction 19 of tool memory 4 waits: Tool memory 4 has no location in the configuration."
        )
        registers.may_write = None
        await link.offer([Order(18, 3, 0.0, 0.010)])
        assert model.offsets[PLACE] == pytest.approx(0.010)

    run(story())


def test_locations_are_known_by_tool_edge_and_register() -> None:
    features = (Feature(number=1), Feature(number=2, edge=2), Feature(number=3, tool=4, holds="radius"))
    model = Model(features)
    made(model)
    model.offsets[4, 1, "wear_length_1"] = 0.003

    async def story() -> None:
        places = tuple(location(feature, memory) for memory, feature in enumerate(features, 1))
        link, _ = link_of(model, location=places)
        assert await link.offsets() == {1: 0.0, 2: 0.0, 3: pytest.approx(0.006)}
        assert await link.read_offset(3) == pytest.approx(0.006)
        await link.write_offset(3, 0.02)
        assert model.offsets[4, 1, "wear_length_1"] == pytest.approx(0.01)

    run(story())


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
