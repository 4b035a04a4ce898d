"""One model of a machine: registers, tool offsets, the NC program, a person at the panel, and power that may fail.

The NC program is a generator that stops after every register it writes: anyone who drives it decides what happens in between – a
bridge that reads half a slot, a power loss, an operator. What the model has measured and applied, it remembers as the truth
that a test compares with. Offsets and sizes are in the control's unit.
"""

import asyncio
import random
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from typing import Final, NamedTuple

from app.core.ring import (
    FIRST_SLOT,
    HIGHEST_EPOCH,
    INCH,
    LAYOUT,
    SIZE,
    SLOT_SIZE,
    SLOTS,
    Answer,
    Field,
    Register,
    Slot,
    Status,
    Told,
    Unit,
    in_steps,
    read_block,
    read_mail,
    slot_of,
    slot_registers,
)

Steps = Iterator[None]
TOLERANCE: Final = 0.0006
"""The NC program takes an offset for the expected one within this, in the control's unit."""


@dataclass(frozen=True, slots=True)
class Feature:
    """A characteristic that the machine cuts and measures.

    number: in the ring. register: the offset it is cut with; parameter: its number in the mailbox. holds: diameter or radius,
    as in a location. wear: growth of the size per part; noise: standard deviation of a measurement. sister: the tool that goes on
    when this one is worn, 0 without one.
    """

    number: int = 1
    nominal: float = 40.0
    tool: int = 3
    edge: int = 1
    register: str = "wear_length_1"
    parameter: int = 1
    holds: str = "diameter"
    sign: int = 1
    bias: float = 0.004
    wear: float = 0.0004
    noise: float = 0.0008
    sister: int = 0


OWNERS: Final = (1, 1, 2, 2, 3, 4, 5, 6)
"""Tool of each characteristic of a machine with six tools."""
UNMAPPED: Final = 6
"""The one of them that no configuration names: nothing corrects it."""
SISTERS: Final = {4: 7}
"""The tool that goes on when this one is worn."""


def on_tool(feature: Feature, tool: int) -> Feature:
    """The characteristic cut with another tool, in the feature's words for the offset: a TNC has a QR parameter for each tool."""
    if feature.register != f"QR{feature.parameter}":
        return replace(feature, tool=tool, sister=SISTERS.get(tool, 0))
    return replace(feature, tool=tool, sister=SISTERS.get(tool, 0), register=f"QR{30 + tool}", parameter=30 + tool)


def six_tools(feature: Feature) -> tuple[Feature, ...]:
    """Eight characteristics on six tools, and a seventh that takes the place of the fourth."""
    return tuple(replace(on_tool(feature, tool), number=number) for number, tool in enumerate(OWNERS, start=1))


class Applied(NamedTuple):
    """A correction that the NC program has put into an offset."""

    number: int
    before: float
    after: float


@dataclass(slots=True)
class Model:
    """A machine. seed: None for another noise, and another epoch, each time. history: every change of an offset,
    which, before and after, by the NC program or by hand. mail_wait: s that the NC program waits for the next correction after each that it has taken;
    decision_wait: s that it waits for the decision on each reading; told: holds and stops that it has acted upon; idle:
    it waits. worn: tools whose sister cuts in their place.
    """

    features: tuple[Feature, ...] = (Feature(),)
    unit: Unit = Unit.MM
    serial: str = "SIM-0001"
    seed: int | None = 1
    clock_ahead: float = 0.0
    registers: list[float] = field(default_factory=lambda: [0.0] * SIZE)
    offsets: dict[tuple[int, int, str], float] = field(default_factory=dict)
    in_effect: dict[int, int] = field(default_factory=dict)
    parts: int = 0
    running: bool = False
    tool_in_spindle: int = 0
    on_hold: bool = False
    mail_wait: float = 0.0
    decision_wait: float = 0.0
    told: list[Told] = field(default_factory=list)
    idle: bool = False
    worn: set[int] = field(default_factory=set)
    written: list[tuple[int, Slot]] = field(default_factory=list)
    applied: list[Applied] = field(default_factory=list)
    refused: list[tuple[int, Answer]] = field(default_factory=list)
    history: list[tuple[tuple[int, int, str], float, float]] = field(default_factory=list)
    chance: random.Random = field(init=False)

    def __post_init__(self) -> None:
        """Seed the noise, and set every offset to 0."""
        self.chance = random.Random(self.seed)  # noqa: S311 - noise of a measurement
        for feature in self.every:
            self.offsets.setdefault(_place(feature), 0.0)

    @property
    def every(self) -> tuple[Feature, ...]:
        """The characteristics as they are cut with each tool that may cut them."""
        return (*self.features, *(on_tool(each, each.sister) for each in self.features if each.sister))

    @property
    def places(self) -> tuple[Feature, ...]:
        """A feature for each location of the bridge's configuration; one tool of six has none."""
        named = {_place(each): each for each in self.every if len(self.features) < len(OWNERS) or each.tool != UNMAPPED}
        return tuple(named.values())

    # --- the configuration of the bridge

    def table(self, kind: str, reached: dict[str, object], **more: object) -> dict[str, object]:
        """The table of this machine. reached: settings of the kind, by which it is reached."""
        return {
            "kind": kind,
            "unit": "inch" if self.unit == Unit.INCH else "mm",
            "secret_file": "machine.key",
            **more,
            kind: reached,
            "characteristics": {str(each.number): f"characteristic-{each.number}" for each in self.features},
        }

    @property
    def locations(self) -> list[dict[str, object]]:
        """The locations of its tools."""
        return [
            {"tool_memory": each.tool, "tool": each.tool, "register": each.register, "holds": each.holds}
            for each in self.places
        ]

    # --- the NC program

    def part(self) -> Steps:
        """One part: take corrections, cut, measure every characteristic, write the readings."""
        self.running = True
        yield from self.set_up()
        yield from self.take_corrections()
        self.parts += 1
        for each in self.features:
            feature = self.cut_now(each)
            self.tool_in_spindle = feature.tool
            self.in_effect[feature.tool] = round(self.registers[Register.APPLIED])
            yield
            yield from self.send(feature.number, self.size(feature), feature.tool)
        self.tool_in_spindle = 0
        self.running = False

    def cut_now(self, feature: Feature) -> Feature:
        """The characteristic with the tool that cuts it now."""
        return on_tool(feature, feature.sister) if feature.sister and feature.tool in self.worn else feature

    def set_up(self) -> Steps:
        """Begin a new epoch where the counters are 0; the layout is written last."""
        if self.registers[Register.LAYOUT] == LAYOUT:
            return
        for place, value in (
            (Register.EPOCH, self.chance.randint(1, HIGHEST_EPOCH)),
            (Register.UNIT, self.unit),
            (Register.LAYOUT, LAYOUT),
        ):
            self.registers[place] = float(value)
            yield

    def send(self, characteristic: int, measured: float, tool: int, status: int = Status.GOOD) -> Steps:
        """Write a reading into the ring: wait for a free slot, payload, check sum, sequence last."""
        while self.registers[Register.WRITTEN] - self.registers[Register.ACK] >= SLOTS:
            yield
        sequence = round(self.registers[Register.WRITTEN]) + 1
        slot = Slot(
            sequence,
            characteristic,
            in_steps(measured, self.unit),
            self.in_effect.get(tool, 0),
            self.parts,
            tool,
            status,
            self._time_of_day(),
        )
        first = FIRST_SLOT + SLOT_SIZE * slot_of(sequence)
        content = slot_registers(slot, self.unit)
        self.registers[first + Field.SEQ] = 0.0
        yield
        for place in (*range(Field.CHARACTERISTIC, Field.CHECK), Field.CHECK, Field.SEQ2):
            self.registers[first + place] = content[place]
            yield
        self.registers[first + Field.SEQ] = float(sequence)
        yield
        self.written.append((round(self.registers[Register.EPOCH]), slot))
        self.registers[Register.WRITTEN] = float(sequence)
        yield
        until = time.monotonic() + self.decision_wait
        while self.registers[Register.DECIDED] < sequence and time.monotonic() < until:
            self.idle = True
            yield
        self.idle = False
        if action := round(self.registers[Register.ACTION]):
            self.registers[Register.ACTION] = 0.0
            self.told.append(Told(action))

    def take_corrections(self) -> Steps:
        """Take mail until none has come for `mail_wait` seconds after the last one."""
        until = 0.0
        while True:
            answered = self.registers[Register.ANSWERED]
            yield from self.take_correction()
            if self.registers[Register.ANSWERED] != answered:
                until = time.monotonic() + self.mail_wait
            self.idle = time.monotonic() < until
            if not self.idle:
                return
            yield

    def take_correction(self) -> Steps:
        """Take the mailbox at a safe point. Whatever is answered is answered once; the number last."""
        block = read_block(self.registers)
        if block.mail.number in {0, block.answered}:
            return
        yield
        mail = read_mail(self.registers, self.unit)
        if mail is None:
            self.registers[Register.ANSWER] = Answer.CHECK_WRONG
            return
        if self.on_hold:
            self.registers[Register.ANSWER] = Answer.ON_HOLD
            return
        place = self._mailed(mail.tool, mail.edge, mail.parameter)
        if place is None:
            yield from self._answer(mail.number, Answer.NOT_POSSIBLE, 0.0)
            return
        held = self.offsets[place]
        tolerance = TOLERANCE / (INCH if self.unit == Unit.INCH else 1.0)
        if abs(held - mail.expected) > tolerance and abs(held - mail.value) > tolerance:
            yield from self._answer(mail.number, Answer.OFFSET_DIFFERS, held)
            return
        if abs(held - mail.value) > tolerance or not self._has_applied(mail.number):
            self.offsets[place] = mail.value
            self.applied.append(Applied(mail.number, held, mail.value))
            self.history.append((place, held, mail.value))
            yield
        self.registers[Register.APPLIED] = float(mail.number)
        yield
        yield from self._answer(mail.number, Answer.APPLIED, self.offsets[place])

    def _answer(self, number: int, answer: Answer, held: float) -> Steps:
        if answer is not Answer.APPLIED:
            self.refused.append((number, answer))
        self.registers[Register.OFFSET] = held
        yield
        self.registers[Register.ANSWER] = float(answer)
        yield
        self.registers[Register.ANSWERED] = float(number)
        yield

    def _has_applied(self, number: int) -> bool:
        return any(each.number == number for each in self.applied)

    def _mailed(self, tool: int, edge: int, parameter: int) -> tuple[int, int, str] | None:
        for feature in self.every:
            if (feature.tool, feature.edge, feature.parameter) == (tool, edge, parameter):
                return _place(feature)
        return None

    def size(self, feature: Feature) -> float:
        """The size that is cut and measured now, in the control's unit: nominal, wear of the tool, and its offset."""
        scale = INCH if self.unit == Unit.INCH else 1.0
        offset = self.offsets[_place(feature)] * feature.sign * (2.0 if feature.holds == "radius" else 1.0)
        error = feature.bias + feature.wear * self.parts + self.chance.gauss(0.0, feature.noise)
        return feature.nominal / scale + error / scale + offset

    def clock(self) -> datetime:
        """The date and the local time that the control shows."""
        return datetime.now() + timedelta(seconds=self.clock_ahead)  # noqa: DTZ005 - a control knows no zone

    def _time_of_day(self) -> float:
        now = self.clock()
        return float(now.hour * 3600 + now.minute * 60 + now.second)

    # --- what happens to a machine

    def edit(self, place: tuple[int, int, str], offset: float) -> None:
        """Set an offset by hand at the panel."""
        self.history.append((place, self.offsets[place], offset))
        self.offsets[place] = offset

    def power_loss(self, *, battery: bool = True) -> None:
        """Stop the program wherever it is; without a battery every register is 0 afterwards."""
        self.running = False
        self.tool_in_spindle = 0
        if not battery:
            self.registers[:] = [0.0] * SIZE

    def truth(self) -> dict[str, float]:
        """Every reading that was written completely: key in the ring (epoch:sequence) and size."""
        return {f"{epoch}:{slot.sequence}": slot.measured for epoch, slot in self.written}


def _place(feature: Feature) -> tuple[int, int, str]:
    return feature.tool, feature.edge, feature.register


async def live(model: Model, cycle: float) -> None:
    """Make parts, one every ``cycle`` seconds, until cancelled."""
    while True:
        for _ in model.part():
            full = model.registers[Register.WRITTEN] - model.registers[Register.ACK] >= SLOTS
            await asyncio.sleep(0.05 if full or model.idle else 0)
        await asyncio.sleep(cycle)
