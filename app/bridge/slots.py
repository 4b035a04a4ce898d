"""Slots of a control's ring as readings for the server, whether registers or printed lines bring them."""

from dataclasses import replace
from datetime import datetime

from app.bridge.configuration import Machine
from app.bridge.links import Position, Received
from app.bridge.store import NUMBER
from app.core.printed_line import Printed
from app.core.ring import INCH, Slot, Status, Unit

FAULTS = {
    Status.MARKED: "The NC program has marked the reading as not valid (status 3).",
}


def reading_of(
    machine: Machine, slot: Slot, position: Position, at: datetime | None, unit: str | None = None
) -> Received:
    """The reading in a slot.

    position: the slot's own, which names the reading for ever. at: when it was measured. unit: of the size, the machine's if
    nothing is said.
    """
    again = f".{position.generation}" if position.generation else ""  # counters that went back name new readings
    key = f"{machine.key}:{position.epoch}{again}:{position.sequence}"
    body = _body(machine, slot, unit or machine.unit)
    if at is not None:
        body["measured_at"] = at.isoformat()
    return Received(key, body, position, _fault(machine, slot))


def printed_reading(
    machine: Machine, printed: Printed, highest: Position, at: datetime | None, known: float | None
) -> Received:
    """The reading on a printed line.

    highest: the position that is stored with it, as lines come again and out of order. known: another size that came under
    the same number before.
    """
    slot = printed.slot
    unit = "mm" if printed.unit is Unit.MM else "inch"  # its own: from the quarantine too no other size is sent
    received = reading_of(machine, slot, Position(printed.epoch, slot.sequence, highest.generation), at, unit)
    key, fault = received.key, received.fault
    if known is not None:
        key = f"{key}:{slot.measured:g}"
        fault = (
            f"Reading {slot.sequence} of epoch {printed.epoch} was printed as {known:g} before, and as {slot.measured:g} now:"
            " one of the two is wrong."
        )
    if unit != machine.unit:
        fault = f"The line is in {unit}, the configuration says unit = {machine.unit!r}."
    return replace(received, key=key, fault=fault, position=highest)


def _body(machine: Machine, slot: Slot, unit: str) -> dict[str, object]:
    number = str(slot.characteristic)
    named = machine.characteristics.get(number)
    body: dict[str, object] = {
        "characteristic": named,
        "measured": round(slot.measured * (INCH if unit == "inch" else 1.0), 9),
        "correction_in_effect": slot.in_effect,
    }
    if named is None:
        body[NUMBER] = number  # by which it gets its name when it is sent from the quarantine
    if slot.part:
        body["part"] = str(slot.part)
    if slot.status == Status.FIRST_MOVE:
        body["first_move_triggered"] = True
    if slot.status == Status.NO_TRIGGER:  # what is there as a size is none; the server makes a probe fault of it
        del body["measured"]
        body["touches"] = []
    return body


def _fault(machine: Machine, slot: Slot) -> str | None:
    if str(slot.characteristic) not in machine.characteristics:
        return (
            f"The control sends characteristic {slot.characteristic}, which machine.{machine.key}.characteristics does not"
            " name."
        )
    if slot.status not in list(Status):
        return f"Status {slot.status} is not known."
    return FAULTS.get(Status(slot.status))
