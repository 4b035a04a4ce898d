"""The register block that an NC program and the bridge share: a ring of readings, and a mailbox for one correction.

A control that cannot speak REST keeps numbers. The NC program writes each reading into one of eight slots and goes on; the
bridge reads the whole block at once, stores what is complete, and acknowledges it. A correction lies in the mailbox as the
absolute value to set, with the value that must be there before; the NC program takes it at a safe point.

Every number is REAL, in the unit and the sense of the control. Registers count from 0, from a first register that the
configuration names. Nothing here knows a protocol.

A check sum forgives nothing. Each number is made whole first (lengths in steps of `STEPS`), on both sides alike, and what was
summed is what counts afterwards: whatever fits is what was written, damaged in no more than digits that nobody uses. The sums
are exact remainders by a prime, so a change of one register fits only if it is a multiple of `MODULUS`. The weights are the primes
from 61 to 97: changes of any two registers by up to 60 each never cancel each other.

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
from math import floor, isfinite
from typing import Final, NamedTuple

SLOTS: Final = 8
SLOT_SIZE: Final = 10
FIRST_SLOT: Final = 16
SIZE: Final = FIRST_SLOT + SLOTS * SLOT_SIZE + 2
"""Registers of the whole block: heads, slots, decision."""
LAYOUT: Final = 2
"""Version of this layout, in register `Register.LAYOUT`; 0 there: the NC program has never set the block up.

1: check sums that forgave differences, so that a damaged tool number passed; lengths with all their digits.
"""
HIGHEST_SEQUENCE: Final = 9_999_999
"""Seven digits: exact on controls that keep eight. After it the NC asks for a new epoch."""
HIGHEST_EPOCH: Final = 999_999
MODULUS: Final = 99_991
"""Of the check sums: the largest prime below 100,000. The largest weight times it has seven digits, which every control keeps."""
SLOT_WEIGHTS: Final = {
    "sequence": 61,
    "measured": 67,
    "part": 71,
    "in_effect": 73,
    "characteristic": 79,
    "tool": 83,
    "status": 89,
    "time": 97,
}
MAIL_WEIGHTS: Final = {"number": 61, "value": 67, "expected": 71, "parameter": 73, "tool": 79, "edge": 83}
LARGEST: Final = 1e12
"""No number of a slot or of the mailbox is as large: what is, or is not a number, was never written."""
INCH: Final = 25.4
"""mm in an inch."""


class Register(IntEnum):
    """Offsets of the registers in the block. Those up to ``UNIT`` but ``ACK`` are the NC's, the mailbox is the bridge's.

    The decision lies behind the slots: ``DECIDED`` is the last sequence that the server has decided, ``ACTION`` (`Told`) what the NC
    has not acted upon yet. The bridge writes the action first, and never lowers it; the NC sets it to 0 when it acts.
    """

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
    DECIDED = 96
    ACTION = 97


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


STEPS: Final = {Unit.MM: 10_000, Unit.INCH: 100_000}
"""Steps of a length in the control's unit: what a slot, the mailbox and a printed line carry, and what their check sums count."""


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


class Told(IntEnum):
    """A decision as the NC finds it. HOLD: a person decides, the machine goes on; STOP: nothing more is cut."""

    NONE = 0
    HOLD = 1
    STOP = 2


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
    """The registers, read at once. mail_fits: the mailbox fits its check sum. slots: the complete ones, oldest first."""

    ack: int
    epoch: int
    written: int
    applied: int
    answered: int
    answer: int
    offset: float
    unit: int
    mail: Mail
    mail_fits: bool
    slots: tuple[Slot, ...]

    @property
    def answer_holds(self) -> bool:
        """Tell if the registers of the answer agree, which have no check sum: what was applied is noted in two of them."""
        applied = self.answer in {Answer.APPLIED, Answer.CHECK_WRONG, Answer.ON_HOLD}
        return not applied or self.applied == self.answered


def in_steps(length: float, unit: Unit) -> float:
    """A length as a ring carries it: whole steps, in the control's unit.

    >>> in_steps(40.01234567, Unit.MM), in_steps(-0.00695, Unit.INCH)
    (40.0123, -0.00695)
    """
    return round(length * STEPS[unit]) / STEPS[unit]


def slot_check(slot: Slot, unit: Unit) -> int:
    """The check sum of a slot: 0 to `MODULUS` - 1. An NC program writes the remainder with the sign of the sum."""
    numbers = {
        "sequence": slot.sequence,
        "measured": round(slot.measured * STEPS[unit]),
        "part": slot.part,
        "in_effect": slot.in_effect,
        "characteristic": slot.characteristic,
        "tool": slot.tool,
        "status": slot.status,
        "time": -1 if slot.time is None else round(slot.time),
    }
    return sum(SLOT_WEIGHTS[name] * number for name, number in numbers.items()) % MODULUS


def mail_check(mail: Mail, unit: Unit) -> int:
    """The check sum of the mailbox: 0 to `MODULUS` - 1."""
    numbers = {
        "number": mail.number,
        "value": round(mail.value * STEPS[unit]),
        "expected": round(mail.expected * STEPS[unit]),
        "parameter": mail.parameter,
        "tool": mail.tool,
        "edge": mail.edge,
    }
    return sum(MAIL_WEIGHTS[name] * number for name, number in numbers.items()) % MODULUS


def slot_of(sequence: int) -> int:
    """Index of the slot that holds a sequence: 0 to 7."""
    return (sequence - 1) % SLOTS


def slot_registers(slot: Slot, unit: Unit = Unit.MM) -> list[float]:
    """A slot as the NC leaves it."""
    time = -1.0 if slot.time is None else slot.time
    measured = in_steps(slot.measured, unit)
    payload = (slot.characteristic, measured, slot.in_effect, slot.part, slot.tool, slot.status, time)
    return [float(value) for value in (slot.sequence, *payload, slot_check(slot, unit), slot.sequence)]


def mail_registers(mail: Mail, unit: Unit = Unit.MM) -> list[tuple[Register, float]]:
    """Registers of the mailbox with their values, in the order in which the bridge writes them: the number last."""
    return [
        (Register.MAIL_TOOL, float(mail.tool)),
        (Register.MAIL_EDGE, float(mail.edge)),
        (Register.MAIL_PARAMETER, float(mail.parameter)),
        (Register.MAIL_EXPECTED, in_steps(mail.expected, unit)),
        (Register.MAIL_VALUE, in_steps(mail.value, unit)),
        (Register.MAIL_CHECK, float(mail_check(mail, unit))),
        (Register.MAIL_NUMBER, float(mail.number)),
    ]


def _whole(value: float) -> int | None:
    return round(value) if isfinite(value) and abs(value - round(value)) < 1e-4 and value >= 0 else None


def read_slot(registers: Sequence[float], unit: Unit = Unit.MM) -> Slot | None:
    """The reading in a slot's ten registers; None while it is empty, half written, or its check sum does not fit."""
    sequence, again = _whole(registers[Field.SEQ]), _whole(registers[Field.SEQ2])
    if not sequence or sequence != again or not all(abs(value) < LARGEST for value in registers):
        return None
    numbers = [
        _whole(registers[place])
        for place in (Field.CHARACTERISTIC, Field.IN_EFFECT, Field.PART, Field.TOOL, Field.STATUS)
    ]
    time = registers[Field.TIME]
    if any(number is None for number in numbers) or _whole(time + 1) is None:
        return None
    characteristic, in_effect, part, tool, status = (number or 0 for number in numbers)
    slot = Slot(
        sequence,
        characteristic,
        in_steps(registers[Field.MEASURED], unit),
        in_effect,
        part,
        tool,
        status,
        None if time < 0 else float(round(time)),
    )
    return slot if (slot_check(slot, unit) - round(registers[Field.CHECK])) % MODULUS == 0 else None


def read_mail(registers: Sequence[float], unit: Unit = Unit.MM) -> Mail | None:
    """The mail in a block as the NC program takes it: each number made whole; None where the check sum does not fit."""
    whole = (Register.MAIL_NUMBER, Register.MAIL_TOOL, Register.MAIL_EDGE, Register.MAIL_PARAMETER)
    lengths = (Register.MAIL_EXPECTED, Register.MAIL_VALUE)
    if not all(abs(registers[place]) < LARGEST for place in (*whole, *lengths, Register.MAIL_CHECK)):
        return None
    mail = Mail(
        *(floor(registers[place] + 0.5) for place in whole), *(in_steps(registers[place], unit) for place in lengths)
    )
    return mail if (mail_check(mail, unit) - floor(registers[Register.MAIL_CHECK] + 0.5)) % MODULUS == 0 else None


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
    if layout in range(1, LAYOUT):
        raise BlockError(
            f"The ring programs in the control are of an older Inband (layout {layout:g}, this one has {LAYOUT}): their check"
            " sum lets damaged corrections pass. Nothing is fetched or corrected until they are written again and loaded:"
            " Set-up, the characteristic, Program text, For the bridge, or “inband program write CHARACTERISTIC --ring”."
            " How to: docs/how-to/ring-programs.md."
        )
    if layout != LAYOUT:
        raise BlockError(
            f"Register +{Register.LAYOUT} holds {layout:g}, not {LAYOUT}: the first register is wrong, or the NC program"
            " is of a newer Inband than the bridge."
        )
    heads = [_whole(registers[place]) for place in range(Register.UNIT + 1) if place != Register.OFFSET]
    if any(number is None for number in heads):
        raise BlockError("The first registers of the block hold no whole numbers: the first register is wrong.")
    ack, epoch, written, applied, answered, answer, unit = (number or 0 for number in heads)
    known = Unit(unit) if unit in set(Unit) else Unit.MM
    found = [
        read_slot(registers[first : first + SLOT_SIZE], known)
        for first in range(FIRST_SLOT, Register.DECIDED, SLOT_SIZE)
    ]
    slots = sorted((slot for slot in found if slot is not None), key=lambda slot: slot.sequence)
    mail = Mail(
        _whole(registers[Register.MAIL_NUMBER]) or 0,
        _whole(registers[Register.MAIL_TOOL]) or 0,
        _whole(registers[Register.MAIL_EDGE]) or 0,
        _whole(registers[Register.MAIL_PARAMETER]) or 0,
        registers[Register.MAIL_EXPECTED],
        registers[Register.MAIL_VALUE],
    )
    fits, offset = read_mail(registers, known) is not None, registers[Register.OFFSET]
    return Block(ack, epoch, written, applied, answered, answer, offset, unit, mail, fits, tuple(slots))


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
