"""Corrections by the mailbox of the ring and by direct writes, against the model: none is applied twice, or to another offset."""

import pytest

from app.bridge.configuration import Location
from app.bridge.links import ControlAway, Order, Outcome, Position
from app.core.ring import Answer, Register, Unit
from app.simulators.controls.model import Feature, Model
from tests.bridge.plant import location
from tests.bridge.ring_link import PLACE, link_of, made
from tests.loops import run


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
