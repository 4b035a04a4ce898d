"""The register block that an NC program and the bridge share: a ring of readings, and a mailbox for one correction.

A control that cannot speak REST keeps numbers. The NC program writes each reading into one of eight slots and goes on; the
bridge reads the whole block at once, stores what is complete, and acknowledges it. A correction lies in the mailbox as the
absolute value to set, with the value that must be there before; the NC program takes it at a safe point.

Every number is REAL, in the unit and the sense of the control. Registers count from 0, from a first register that the
configuration names. Nothing here knows a protocol.

What makes it safe:

* a slot counts when its two sequence numbers agree and its check sum fits, so that a slot read while it is being written is
  left for the next time (the NC clears ``seq``, writes the payload, ``check``, ``seq2``, and ``seq`` last);
* the NC does not write while all slots wait for the acknowledgement, so that nothing is overwritten unseen;
* the number of a correction is written last, and the NC answers each number once: an offset that is already the wanted one
  counts as set, so that a power loss between setting and answering does no harm.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from math import fmod, isfinite
from typing import Final, NamedTuple

SLOTS: Final = 8
SLOT_SIZE: Final = 10
FIRST_SLOT: Final = 16
SIZE: Final = FIRST_SLOT + SLOTS * SLOT_SIZE
"""Registers of the whole block."""
LAYOUT: Final = 1
"""Version of this layout, in register `Register.LAYOUT`; 0 there: the NC program has never set the block up."""
HIGHEST_SEQUENCE: Final = 9_999_999
"""Seven digits: exact on controls that keep eight. After it the NC asks for a new epoch."""
HIGHEST_EPOCH: Final = 999_999
MODULUS: Final = 9973
"""Of the check sums: the largest prime below 10,000."""
RESOLUTION: Final = 10_000
"""Lengths enter a check sum in steps of 1/10,000 of the control's unit."""
LARGEST: Final = 1e12
"""No number of a slot is as large: what is, or is no number, was never written by the NC program."""
INCH: Final = 25.4
"""mm in an inch."""


class Register(IntEnum):
    """Offsets of the registers in the block. Those up to ``UNIT`` but ``ACK`` are the NC's, the mailbox is the bridge's."""

    ACK = 0
    EPOCH = 1
    WRITTEN = 2
    APPLIED = 3
    ANSWERED = 4
    ANSWER = 5
    OFFSET = 6
    UNIT = 7
    MAIL_TOOL = 8
    MAIL_EDGE = 9
    MAIL_PARAMETER = 10
    MAIL_EXPECTED = 11
    MAIL_VALUE = 12
    MAIL_CHECK = 13
    MAIL_NUMBER = 14
    LAYOUT = 15


class Field(IntEnum):
    """Offsets of the numbers in a slot."""

    SEQ = 0
    CHARACTERISTIC = 1
    MEASURED = 2
    IN_EFFECT = 3
    PART = 4
    TOOL = 5
    STATUS = 6
    TIME = 7
    CHECK = 8
    SEQ2 = 9


class Unit(IntEnum):
    """Unit of length of a control."""

    MM = 1
    INCH = 2


class Answer(IntEnum):
    """The answer of the NC program to a number in the mailbox.

    After ``CHECK_WRONG`` and ``ON_HOLD`` the number stays unanswered: the NC looks at it again the next time.
    """

    APPLIED = 0
    OFFSET_DIFFERS = 1
    CHECK_WRONG = 2
    NOT_POSSIBLE = 3
    STEP_TOO_LARGE = 4
    ON_HOLD = 9


class Status(IntEnum):
    """Outcome of a measurement, in a slot."""

    GOOD = 0
    NO_TRIGGER = 1
    FIRST_MOVE = 2
    MARKED = 3


class BlockError(ValueError):
    """The registers cannot be a block of this layout."""


@dataclass(frozen=True, slots=True)
class Slot:
    """One reading as the NC program wrote it.

    measured: the size, in the control's unit. in_effect: number of the last correction that was in the offset when the part
    was cut. time: seconds of the day by the control's clock, None where the control does not say.
    """

    sequence: int
    characteristic: int
    measured: float
    in_effect: int
    part: int
    tool: int
    status: int
    time: float | None = None


@dataclass(frozen=True, slots=True)
class Mail:
    """One correction for the NC program: the absolute offset to set, and the one that must be there before."""

    number: int
    tool: int
    edge: int
    parameter: int
    expected: float
    value: float


class Block(NamedTuple):
    """The registers, read at once. slots: the complete ones, oldest first."""

    ack: int
    epoch: int
    written: int
    applied: int
    answered: int
    answer: int
    offset: float
    unit: int
    mail: Mail
    mail_check: float
    slots: tuple[Slot, ...]


def slot_check(slot: Slot) -> float:
    """The check sum of a slot: the remainder of a weighted sum by `MODULUS`, with the sign of the sum as FIX gives it."""
    time = -1.0 if slot.time is None else slot.time
    return fmod(
        slot.sequence
        + 3 * slot.characteristic
        + 5 * slot.in_effect
        + 7 * slot.part
        + 11 * slot.tool
        + 13 * slot.status
        + 17 * time
        + round(RESOLUTION * slot.measured),
        MODULUS,
    )


def mail_check(mail: Mail) -> float:
    """The check sum of the mailbox."""
    return fmod(
        3 * mail.tool
        + 5 * mail.edge
        + 7 * mail.parameter
        + round(RESOLUTION * mail.expected)
        + 11 * round(RESOLUTION * mail.value)
        + 13 * mail.number,
        MODULUS,
    )


def slot_of(sequence: int) -> int:
    """Index of the slot that holds a sequence: 0 to 7."""
    return (sequence - 1) % SLOTS


def slot_registers(slot: Slot) -> list[float]:
    """A slot as the NC leaves it."""
    time = -1.0 if slot.time is None else slot.time
    payload = (slot.characteristic, slot.measured, slot.in_effect, slot.part, slot.tool, slot.status, time)
    return [float(value) for value in (slot.sequence, *payload, slot_check(slot), slot.sequence)]


def mail_registers(mail: Mail) -> list[tuple[Register, float]]:
    """Registers of the mailbox with their values, in the order in which the bridge writes them: the number last."""
    return [
        (Register.MAIL_TOOL, float(mail.tool)),
        (Register.MAIL_EDGE, float(mail.edge)),
        (Register.MAIL_PARAMETER, float(mail.parameter)),
        (Register.MAIL_EXPECTED, mail.expected),
        (Register.MAIL_VALUE, mail.value),
        (Register.MAIL_CHECK, mail_check(mail)),
        (Register.MAIL_NUMBER, float(mail.number)),
    ]


def _whole(value: float) -> int | None:
    return round(value) if isfinite(value) and abs(value - round(value)) < 1e-4 and value >= 0 else None


def read_slot(registers: Sequence[float]) -> Slot | None:
    """The reading in a slot's ten registers; None while it is empty, half written, or its check sum does not fit."""
    sequence, again = _whole(registers[Field.SEQ]), _whole(registers[Field.SEQ2])
    if not sequence or sequence != again or not all(abs(value) < LARGEST for value in registers):
        return None
    numbers = [
        _whole(registers[place])
        for place in (Field.CHARACTERISTIC, Field.IN_EFFECT, Field.PART, Field.TOOL, Field.STATUS)
    ]
    if any(number is None for number in numbers):
        return None
    characteristic, in_effect, part, tool, status = (number or 0 for number in numbers)
    time = registers[Field.TIME]
    slot = Slot(
        sequence,
        characteristic,
        registers[Field.MEASURED],
        in_effect,
        part,
        tool,
        status,
        None if time < 0 else time,
    )
    difference = abs(fmod(slot_check(slot) - registers[Field.CHECK], MODULUS))
    return slot if min(difference, MODULUS - difference) <= 1.5 else None


def read_block(registers: Sequence[float]) -> Block:
    """The whole block.

    Raises `BlockError` where the registers cannot be one: too few, never set up by the NC program, another layout.
    """
    if len(registers) != SIZE:
        raise BlockError(f"The block has {SIZE} registers, but {len(registers)} were read.")
    layout = registers[Register.LAYOUT]
    if layout == 0:
        raise BlockError(
            "The block is empty: the NC program has not set it up yet. Run the program that Inband has written once."
        )
    if layout != LAYOUT:
        raise BlockError(
            f"Register +{Register.LAYOUT} holds {layout:g}, not {LAYOUT}: the first register is wrong, or the NC program"
            " is of another version."
        )
    heads = [_whole(registers[place]) for place in range(Register.UNIT + 1) if place != Register.OFFSET]
    if any(number is None for number in heads):
        raise BlockError("The first registers of the block hold no whole numbers: the first register is wrong.")
    ack, epoch, written, applied, answered, answer, unit = (number or 0 for number in heads)
    found = [read_slot(registers[first : first + SLOT_SIZE]) for first in range(FIRST_SLOT, SIZE, SLOT_SIZE)]
    slots = sorted((slot for slot in found if slot is not None), key=lambda slot: slot.sequence)
    mail = Mail(
        _whole(registers[Register.MAIL_NUMBER]) or 0,
        _whole(registers[Register.MAIL_TOOL]) or 0,
        _whole(registers[Register.MAIL_EDGE]) or 0,
        _whole(registers[Register.MAIL_PARAMETER]) or 0,
        registers[Register.MAIL_EXPECTED],
        registers[Register.MAIL_VALUE],
    )
    check = registers[Register.MAIL_CHECK]
    return Block(
        ack, epoch, written, applied, answered, answer, registers[Register.OFFSET], unit, mail, check, tuple(slots)
    )


def to_fetch(block: Block, stored: int) -> tuple[Slot, ...]:
    """The readings after the last stored one that follow without a gap, oldest first.

    stored: the highest contiguous sequence stored. A slot that is still being written ends the row: it and those after it
    are left for the next time. So is a slot beyond ``written``: after a power loss the NC writes that sequence again.
    """
    later = [slot for slot in block.slots if stored < slot.sequence <= block.written]
    if not later or later[0].sequence != stored + 1:
        return ()
    last = 1
    while last < len(later) and later[last].sequence == later[last - 1].sequence + 1:
        last += 1
    return tuple(later[:last])


def went_back(block: Block, stored: int, epoch: int | None) -> str | None:
    """The reason for which a person has to look before anything else is fetched; None where block and store agree.

    stored: the highest sequence stored in this epoch. epoch: the one that is known, None at the first contact. A complete slot
    counts as written: the power may go before the NC program sets ``written``, which its next run does.
    """
    written = max((block.written, *(slot.sequence for slot in block.slots)))
    if epoch is not None and block.epoch != epoch:
        return (
            f"The control counts in epoch {block.epoch}, the bridge knows epoch {epoch}: its counters were lost or"
            " restored."
        )
    if written < stored:
        return f"The control has written {written} readings, the bridge has stored {stored}: its counters went back."
    if written - stored > SLOTS:
        return (
            f"The control has written reading {written}, the bridge has stored {stored}: more than the ring of"
            f" {SLOTS} holds lie between, and are lost. Did the program go on without waiting?"
        )
    return None
