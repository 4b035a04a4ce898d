"""A control whose registers are read number by number: few queries, and nothing missed."""

from collections.abc import Sequence

import pytest

from app.bridge.links import ControlAway, Order, Position, Received
from app.bridge.registers import HEADS, SLOTS_AT_ONCE, WATCHED, WATCHED_WITH_MAIL, RegisterLink
from app.core.ring import SLOT_SIZE, Answer, Register
from app.simulators.controls.model import Model
from tests.bridge.plant import ModelRegisters, machine
from tests.loops import run


class Counted(ModelRegisters):
    def __init__(self, model: Model) -> None:
        super().__init__(model, whole=False)
        self.asked: list[int] = []

    async def read(self, places: Sequence[int]) -> list[float]:
        self.asked += places
        return await super().read(places)

    def since(self) -> int:
        """Registers read since the last call."""
        number = len(self.asked)
        self.asked.clear()
        return number


def plant(model: Model) -> tuple[Counted, RegisterLink]:
    registers = Counted(model)
    return registers, RegisterLink(machine(model), registers)


def make(model: Model, count: int) -> None:
    for _ in range(count):
        list(model.part())


async def stored(link: RegisterLink, position: Position) -> tuple[Sequence[Received], Position]:
    received = await link.fetch(position)
    await link.acknowledge(received)
    return received, (received[-1].position or position) if received else position


def test_a_poll_reads_few_registers_while_nothing_happens() -> None:
    async def work() -> None:
        model = Model()
        registers, link = plant(model)
        make(model, 1)
        await link.connect()
        _, position = await stored(link, Position())
        registers.since()
        assert await link.fetch(position) == []
        assert registers.since() == len(WATCHED) + 2, "the epoch, and the acknowledgement once"
        assert await link.fetch(position) == []
        assert registers.since() == len(WATCHED) + 1
        make(model, 1)
        [new] = await link.fetch(position)
        assert new.position == Position(position.epoch, 2)
        assert registers.since() == len(WATCHED) + 1 + SLOT_SIZE

    run(work())


def test_an_answer_in_the_mailbox_is_seen() -> None:
    async def work() -> None:
        model = Model()
        registers, link = plant(model)
        make(model, 1)
        await link.connect()
        _, position = await stored(link, Position())
        await link.offer([Order(7, 3, 0.0, 0.01)])
        assert registers.writes[-1] == (Register.MAIL_NUMBER, 7.0)
        assert await link.fetch(position) == []
        assert await link.outcomes() == []
        make(model, 1)
        registers.since()
        await link.fetch(position)
        [outcome] = await link.outcomes()
        assert (outcome.number, outcome.applied, outcome.offset) == (7, True, 0.01)
        assert registers.since() == len(WATCHED) + len(WATCHED_WITH_MAIL) + 1 + len(HEADS) + SLOT_SIZE

    run(work())


def test_a_mailbox_that_the_nc_could_not_read_is_filled_again() -> None:
    """It says so without an answer: the number stays open."""

    async def work() -> None:
        model = Model()
        registers, link = plant(model)
        make(model, 1)
        await link.connect()
        _, position = await stored(link, Position())
        order = Order(7, 3, 0.0, 0.01)
        await link.offer([order])
        model.registers[Register.MAIL_VALUE] = 9.0
        model.registers[Register.ANSWER] = float(Answer.CHECK_WRONG)
        registers.writes.clear()
        for _ in range(2):  # taken back, then filled
            await link.fetch(position)
            await link.offer([order])
        assert model.registers[Register.MAIL_VALUE] == 0.01
        assert registers.writes[-1] == (Register.MAIL_NUMBER, 7.0)

    run(work())


@pytest.mark.parametrize("acknowledged", [0, 5])
def test_a_full_ring_comes_in_several_calls_in_order(acknowledged: int) -> None:
    async def work() -> None:
        model = Model()
        _, link = plant(model)
        make(model, acknowledged)
        model.registers[Register.ACK] = float(acknowledged)
        make(model, 8)
        await link.connect()
        position = Position()
        found: list[Received] = []
        while True:
            received, position = await stored(link, position)
            if not received:
                break
            assert len(received) <= SLOTS_AT_ONCE
            found += received
        numbers = [each.position.sequence for each in found if each.position]
        assert numbers == list(range(acknowledged + 1, acknowledged + 9))

    run(work())


def test_a_register_that_does_not_keep_what_is_written_is_said() -> None:
    class Deaf(Counted):
        async def write(self, place: int, value: float) -> None:
            pass

    async def work() -> None:
        model = Model()
        make(model, 1)
        link = RegisterLink(machine(model), Deaf(model))
        await link.connect()
        _, position = await stored(link, Position())
        with pytest.raises(ControlAway, match=r"Register \+0 \(ack\) holds 0 after 1 was written"):
            await link.fetch(position)

    run(work())
