"""The programs of the ring on a simulated control, and a bridge beside it that stores what it can fetch."""

from functools import cache
from typing import Any

import pytest

from app.core.programs.ring_settings import RingControl
from app.core.ring import (
    Block,
    Mail,
    Register,
    Slot,
    Unit,
    mail_registers,
    read_block,
    to_fetch,
    went_back,
)
from tests.core.programs.ring_machines import Machine, PowerLost, machine

CONTROLS = tuple(RingControl)
every_control = pytest.mark.parametrize("control", CONTROLS)


class Bridge:
    """Stores what it can fetch, and acknowledges it."""

    def __init__(self, control: Machine) -> None:
        self.control, self.epoch = control, read_block(control.registers()).epoch
        self.stored: list[Slot] = []

    def fetch(self) -> None:
        block = read_block(self.control.registers())
        assert went_back(block, len(self.stored), self.epoch) is None
        self.stored += to_fetch(block, len(self.stored))

    def acknowledge(self) -> None:
        self.control.write(Register.ACK, len(self.stored))

    def look(self) -> None:
        self.fetch()
        self.acknowledge()

    def post(self, mail: Mail) -> None:
        for place, value in mail_registers(mail, unit_of(self.control)):
            self.control.write(place, value)


def unit_of(control: Machine) -> Unit:
    return Unit.INCH if control.inch else Unit.MM


@cache
def _set_up(control: RingControl) -> Machine:
    made = machine(control)
    made.set_up()
    return made


def ready(control: RingControl, **of_machine: Any) -> tuple[Machine, Bridge]:
    """A machine with its block set up, and a bridge beside it."""
    made = machine(control, **of_machine)
    if of_machine:
        made.set_up()
    else:
        made.remember(_set_up(control))
    return made, Bridge(made)


def block(control: Machine) -> Block:
    return read_block(control.registers())


def parameter(control: Machine) -> int:
    return control.settings.wears[0].parameter


def mail(control: Machine, number: int, expected: float, value: float, **changed: int) -> Mail:
    whole = {"tool": 3, "edge": 1, "parameter": parameter(control)} | changed
    return Mail(number=number, expected=expected, value=value, **whole)


def cut_off(control: Machine, blocks: int, run: Any) -> bool:
    """Run it until the power goes; tell if it went."""
    control.power = blocks
    try:
        run()
    except PowerLost:
        control.dwells = 0
        if hasattr(control, "limited"):
            control.limited = False  # a reset ends it
        return True
    finally:
        control.power = None
    return False
