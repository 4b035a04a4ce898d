"""The link to the ring of a model of a control."""

from app.bridge.registers import RegisterLink
from app.simulators.controls.model import Model
from tests.bridge.plant import ModelRegisters, machine

PLACE = (3, 1, "wear_length_1")


def made(model: Model, parts: int = 1) -> None:
    for _ in range(parts):
        for _ in model.part():
            pass


def link_of(model: Model, *, whole: bool = True, **fields: object) -> tuple[RegisterLink, ModelRegisters]:
    registers = ModelRegisters(model, whole=whole)
    return RegisterLink(machine(model, **fields), registers), registers
