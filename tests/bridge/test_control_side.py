"""The control's side alone: the server is away, and what keeps a correction from the control counts all the same."""

import time
from collections.abc import Awaitable, Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from app.bridge import control_side
from app.bridge.links import Order, Outcome, Position
from app.bridge.simulators.model import Feature, Model
from app.bridge.unit import Unit
from app.core.ring import Register
from tests.bridge.plant import ModelRegisters, controlled, store_in, unit_of, until
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
