"""The control's side alone: the server is away, and what keeps a correction from the control counts all the same."""

import time
from collections.abc import Awaitable, Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from app.bridge import control_side
from app.bridge.configuration import Location
from app.bridge.links import ControlAway, LinkError, Misconfigured, Order, Outcome, Position
from app.bridge.registers import RegisterLink
from app.bridge.unit import Unit
from app.core.ring import Register
from app.simulators.controls.model import Feature, Model
from tests.bridge.plant import ModelRegisters, controlled, parts, store_in, unit_of, until
from tests.loops import run

M = "lathe-1"


async def held_by_command(unit: Unit) -> None:
    await unit.store.note("", "hold_all", "by the command line")


async def held_for_one_machine(unit: Unit) -> None:
    await unit.store.note(M, "hold", "by the command line")


async def too_old(unit: Unit) -> None:
    unit.orders = tuple(replace(order, until=time.monotonic()) for order in unit.orders)


async def held_while_the_store_is_full(unit: Unit) -> None:
    unit.store.largest = 1
    await until(lambda: unit.state == "full", "the store is full")
    await held_by_command(unit)


@pytest.mark.parametrize("event", [held_by_command, held_for_one_machine, too_old, held_while_the_store_is_full])
def test_an_offered_correction_is_withdrawn_while_the_server_is_away(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, event: Callable[[Unit], Awaitable[Any]]
) -> None:
    monkeypatch.setattr(control_side, "FULL_EVERY", 0.05)
    model = Model((Feature(bias=0.0, wear=0.0, noise=0.0),))
    for _ in model.part():
        pass

    async def story() -> None:
        unit = unit_of(model, store_in(tmp_path))
        order = Order(1, 3, 0.0, -0.01)
        await unit.store.intend(M, order, "hash")
        unit.orders = (order,)
        async with controlled(unit):
            await until(lambda: model.registers[Register.MAIL_NUMBER] == 1, "the correction in the mailbox")
            await event(unit)
            await until(lambda: model.registers[Register.MAIL_NUMBER] == 0, "the correction taken back")
        unit.store.close()

    run(story())
    for _ in model.part():  # the NC program finds nothing to apply
        pass
    assert list(model.offsets.values()) == [0.0]


def test_a_correction_that_was_answered_is_not_written_again_while_the_server_is_away(tmp_path: Path) -> None:
    """It was set, then an operator has set the offset of before again, then the line to the control was cut."""
    model = Model((Feature(bias=0.0, wear=0.0, noise=0.0),))
    for _ in model.part():
        pass
    [place] = model.offsets

    async def story() -> None:
        registers = ModelRegisters(model)
        unit = unit_of(model, store_in(tmp_path), registers, corrections="direct")
        order = Order(1, 3, 0.0, -0.01)
        await unit.store.intend(M, order, "hash")
        unit.orders = (order,)

        async def answered() -> bool:
            return bool(await unit.store.intents(M, "answered"))

        async with controlled(unit):
            await until(answered, "the correction is set")
            model.edit(place, 0.0)
            registers.away = True
            await until(lambda: unit.state == "control_away", "the line is cut")
            registers.away = False
            seen = unit.polls
            await until(lambda: unit.polls > seen + 3, "the line is back")
        unit.store.close()

    run(story())
    assert model.offsets[place] == 0.0


def test_an_answer_counts_that_the_bridge_sees_before_it_knows_the_correction(tmp_path: Path) -> None:
    """The computer of the bridge was exchanged, and its store with it: the control has answered what the server offers again."""
    model = Model((Feature(bias=0.0, wear=0.0, noise=0.0),))
    for _ in model.part():
        pass

    async def story() -> None:
        unit = unit_of(model, store_in(tmp_path))
        order = Order(1, 3, 0.0, -0.01)
        await unit.link.connect()
        await unit.link.fetch(Position())
        await unit.link.offer([order])
        for _ in model.part():
            pass

        async def answered() -> bool:
            return [each.outcome for each in await unit.store.intents(M, "answered")] == [Outcome(1, True, -0.01)]

        async with controlled(unit):
            await until(lambda: unit.polls > 1, "the answer is seen")
            await unit.store.intend(M, order, "hash")
            unit.orders = (order,)
            await until(answered, "the answer counts")
        unit.store.close()

    run(story())


class Refusing(ModelRegisters):
    """Registers of a control that does not know its mailbox, or an offset. error: what it says."""

    def __init__(self, model: Model, error: LinkError | None, *, offsets: bool = False) -> None:
        super().__init__(model)
        self.error, self.offsets = error, offsets

    async def write(self, place: int, value: float) -> None:
        if self.error is not None and place == Register.MAIL_TOOL:
            raise self.error
        await super().write(place, value)

    async def read_offset(self, location: Location) -> float | None:
        if self.offsets:
            raise Misconfigured("The control has no such tool.")
        return await super().read_offset(location)


@pytest.mark.parametrize("error", [Misconfigured("It does not know the mailbox."), ControlAway("The mailbox is lost.")])
def test_an_offer_that_fails_holds_up_no_reading(tmp_path: Path, error: LinkError) -> None:
    model = Model((Feature(bias=0.0, wear=0.0, noise=0.0),))

    async def story() -> None:
        await parts(model, 1)
        registers = Refusing(model, error, offsets=True)
        unit = unit_of(model, store_in(tmp_path), registers, offsets_every=0.5)
        order = Order(1, 3, 0.0, -0.01)
        await unit.store.intend(M, order, "hash")
        unit.orders = (order,)
        async with controlled(unit):
            await until(lambda: f"{error} Readings go on." in unit.detail, "the offer has failed")
            await until(lambda: "The control has no such tool. Readings go on." in unit.detail, "the offsets too")
            assert unit.state == "configuration"
            await parts(model, 12)  # more than the ring holds
            await until(lambda: model.registers[Register.ACK] == 13, "all readings")
            registers.error = None
            await until(lambda: model.registers[Register.MAIL_NUMBER] == 1, "the offer once it can be written")
            registers.offsets = False
            await until(lambda: unit.state == "online", "the offsets too")
        unit.store.close()

    run(story())


def test_what_the_bridge_writes_is_tried_out_with_what_is_there(tmp_path: Path) -> None:
    async def story() -> None:
        model = Model((Feature(bias=0.0, wear=0.0, noise=0.0),))
        await parts(model, 1)
        registers = Refusing(model, None)
        link = unit_of(model, store_in(tmp_path), registers).link
        assert isinstance(link, RegisterLink)
        before = list(model.registers)
        await link.connect()
        await link.fetch(Position())
        assert await link.try_out() == []
        assert {place for place, _ in registers.writes} >= {Register.MAIL_NUMBER, Register.MAIL_CHECK, Register.ACK}
        assert model.registers == before
        registers.error = Misconfigured("It does not know the mailbox.")
        assert await link.try_out() == [
            "The bridge could not write what it has to write: It does not know the mailbox."
        ]

    run(story())
