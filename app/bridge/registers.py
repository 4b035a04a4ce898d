"""Ring, mailbox and direct writes, for every control whose registers and tool offsets can be read and written."""

import asyncio
import time
from collections.abc import Sequence
from contextlib import suppress
from datetime import datetime
from math import isfinite
from typing import Protocol

from app.bridge.configuration import Location, Machine
from app.bridge.guards import location_of
from app.bridge.links import (
    Clock,
    ControlAway,
    CountersLost,
    Decided,
    LinkError,
    Misconfigured,
    NotNow,
    Order,
    Outcome,
    Position,
    Received,
)
from app.bridge.moments import learn, learn_date, measured_at
from app.bridge.slots import reading_of
from app.core.ring import (
    FIRST_SLOT,
    SIZE,
    SLOT_SIZE,
    SLOTS,
    STEPS,
    Answer,
    Block,
    BlockError,
    Mail,
    Register,
    Slot,
    Told,
    Unit,
    in_steps,
    mail_registers,
    read_block,
    slot_of,
    to_fetch,
    went_back,
)

HEADS = tuple(range(FIRST_SLOT))
WHOLE = range(SIZE)
WATCHED = (Register.WRITTEN,)
"""What a poll looks at where registers are read one by one; beside the epoch; the other heads change only with these, or by the bridge."""
WATCHED_WITH_MAIL = (Register.ANSWERED, Register.ANSWER)
"""And while a correction waits: the NC may say of it that its check sum is wrong without having answered it."""
HEADS_EVERY = 10.0  # s: all heads are read again at the latest
UNREADABLE_AFTER = 5.0  # s: no NC program writes that long at a slot which it has counted
SLOTS_AT_ONCE = 4  # where registers are read one by one, so that a call does not take too long
MAILBOX = tuple(place for place, _ in mail_registers(Mail(0, 0, 0, 0, 0.0, 0.0)))
TOLD = {"hold": Told.HOLD, "stop": Told.STOP}
UNITS = {"mm": Unit.MM, "inch": Unit.INCH}
HALF_A_STEP = 0.5 / max(STEPS.values())
FRESH = 2.0  # polls: a reading that was not there so long ago was measured just now
REFUSALS = {
    Answer.OFFSET_DIFFERS: "The control holds another offset than expected.",
    Answer.NOT_POSSIBLE: "The control has no such tool, edge or offset (answer 3).",
    Answer.STEP_TOO_LARGE: "The step is larger than the NC program allows (answer 4).",
}


class Registers(Protocol):
    """A control's registers. Places count from 0, from the block's first register; values are the control's own."""

    whole: bool
    """Whether one read brings the whole block; else only what is needed is read."""

    async def connect(self) -> str:
        """Connect, and answer the control's identity. Raises `LinkError`, as all do."""

    async def close(self) -> None:
        """Disconnect; never raises."""

    async def shown_time(self) -> datetime | None:
        """The date and the local time that the control shows; None where it does not say."""

    async def read(self, places: Sequence[int]) -> list[float]:
        """Registers of the block, in the order of the places."""

    async def write(self, place: int, value: float) -> None:
        """Write one register of the block. A control may show it only after its next sampling tick."""

    async def shown(self, place: int, value: float) -> None:
        """Wait until the control shows what was written, or for as long as that may take."""

    async def read_offset(self, location: Location) -> float | None:
        """The control's offset of a location, in its own unit and sense; None where it cannot be read."""

    async def write_offset(self, location: Location, value: float) -> None:
        """Set the control's offset of a location."""

    async def against_writing(self, location: Location) -> str | None:
        """A reason why the offset must not be written now (program running, tool in use); None if it may be."""


class _NotNow(Exception):
    """An offset must not be written now; the text says why."""


class RegisterLink:
    """A control with a register block: a `Link` and an `OffsetAccess`."""

    def __init__(self, machine: Machine, registers: Registers) -> None:
        self.machine = machine
        self.registers = registers
        self.clock = Clock()
        self._block: Block | None = None
        self._numbers: list[float] = []  # those that the block was made of
        self._polled: tuple[datetime, int] | None = None
        self._direct: dict[int, Outcome] = {}
        self._heads: list[float] = []
        self._heads_at = 0.0
        self._acknowledged = False  # since the last poll
        self.remark = ""
        self._unreadable_since: float | None = None

    async def connect(self) -> str:
        """Connect, and answer the control's identity."""
        self._block = self._polled = None
        self._direct = {}
        self._heads = []
        identity = await self.registers.connect()
        with suppress(LinkError, TimeoutError):  # a control that does not tell its date works all the same
            async with asyncio.timeout(self.machine.patience / 4):
                if shown := await self.registers.shown_time():
                    learn_date(self.clock, shown, datetime.now().astimezone())
        return identity

    async def close(self) -> None:
        """Disconnect."""
        await self.registers.close()

    # --- readings

    async def fetch(self, stored: Position) -> Sequence[Received]:
        """The readings in the ring that follow the last stored one."""
        now = datetime.now().astimezone()
        known = stored.epoch is not None
        block = self._block = await self._read(stored.sequence if known else None)
        if not known:  # the first contact: what is acknowledged was fetched by someone before
            first = max(min(block.ack, block.written), block.written - SLOTS)
            stored = Position(block.epoch, first, stored.generation)
        if reason := went_back(block, stored.sequence, stored.epoch):
            raise CountersLost(
                f"{reason} Look at the control, then run “inband bridge accept-counters {self.machine.key}”."
            )
        slots = to_fetch(block, stored.sequence)
        self._look_at_next(stored.sequence + 1, waits=not slots and block.written > stored.sequence)
        if not self.remark and block.answer == Answer.ON_HOLD and block.mail.number not in {0, block.answered}:
            self.remark = f"Correction {block.mail.number} waits: the NC program holds corrections (answer 9). Release them there."
        fresh = (
            self._polled is not None
            and (now - self._polled[0]).total_seconds() < FRESH * self.machine.interval + 1
            and block.written - self._polled[1] <= 1
        )
        received = [self._received(slot, stored, now, fresh=fresh) for slot in slots]
        self._polled = (now, slots[-1].sequence if slots else stored.sequence)
        accepted = known or stored.generation > 0  # a first look changes nothing
        if accepted and not slots and block.ack != stored.sequence:
            await self._write(Register.ACK, stored.sequence)  # the acknowledgement was lost, or is of another epoch
        return received

    def _look_at_next(self, sequence: int, *, waits: bool) -> None:
        """Remark on a slot that is counted and stays unreadable: nothing behind it is fetched, and the NC waits in the end."""
        now = time.monotonic()
        if not waits:
            self._unreadable_since = None
        elif self._unreadable_since is None:
            self._unreadable_since = now
        self.remark = ""
        if self._unreadable_since is not None and now > self._unreadable_since + UNREADABLE_AFTER:
            first = FIRST_SLOT + SLOT_SIZE * slot_of(sequence)
            self.remark = (
                f"Reading {sequence} lies in the ring and cannot be read: its two numbers differ, or its check sum is wrong."
                f" Does another program write registers +{first} to +{first + SLOT_SIZE - 1}? Nothing is fetched before it."
            )

    async def acknowledge(self, received: Sequence[Received]) -> None:
        """Write the highest stored sequence where the NC waits for it.

        The next poll reads it back; if it is not there, `fetch` writes it again.
        """
        if received and (last := received[-1].position):
            await self.registers.write(Register.ACK, float(last.sequence))
            if self._heads:
                self._heads[Register.ACK] = float(last.sequence)
                self._acknowledged = True

    async def _read(self, stored: int | None) -> Block:
        """The block; from a control that is read number by number only the heads and the slots that matter.

        stored: the highest stored sequence, None at the first contact.
        """
        if self.registers.whole:
            registers = await self.registers.read(WHOLE)
        else:
            registers = await self._one_by_one(stored)
        if self._block is not None and registers == self._numbers:
            return self._block
        try:
            block = read_block(registers)
        except BlockError as error:
            self._heads = []
            raise Misconfigured(str(error)) from error
        says = {unit: name for name, unit in UNITS.items()}.get(Unit(block.unit)) if block.unit in {1, 2} else None
        if says != self.machine.unit:
            self._heads = []
            raise Misconfigured(
                f"The control says that it works in {says or f'unit {block.unit}'}, the configuration says unit ="
                f" {self.machine.unit!r}. Nothing is fetched or corrected until they agree."
            )
        self._numbers = registers
        return block

    async def _one_by_one(self, stored: int | None) -> list[float]:
        """The block from a control that is read number by number."""
        await self._look()
        registers = self._heads + [0.0] * (SIZE - FIRST_SLOT)
        written, ack = self._heads[Register.WRITTEN], self._heads[Register.ACK]
        if not (isfinite(written) and isfinite(ack)):
            return registers
        last = round(written)
        oldest = max((round(ack) if stored is None else stored) + 1, last - SLOTS + 1)
        for sequence in range(oldest, min(last, oldest + SLOTS_AT_ONCE - 1) + 1):
            first = FIRST_SLOT + SLOT_SIZE * slot_of(sequence)
            registers[first : first + SLOT_SIZE] = await self.registers.read(range(first, first + SLOT_SIZE))
        return registers

    async def _look(self) -> None:
        """The heads as they are now: all of them only if one has changed, the bridge has written, or it was long ago."""
        if self._heads and time.monotonic() < self._heads_at + HEADS_EVERY:
            waits = self._heads[Register.MAIL_NUMBER] != self._heads[Register.ANSWERED]
            acknowledged = (Register.ACK,) if self._acknowledged else ()
            watched = (*WATCHED, *acknowledged, *(WATCHED_WITH_MAIL if waits else ()), Register.EPOCH)
            now = await self.registers.read(watched)
            if all(value == self._heads[place] for place, value in zip(watched[1:], now[1:], strict=True)):
                self._heads[Register.WRITTEN] = now[0]
                self._acknowledged = False
                return
        self._heads = await self.registers.read(HEADS)
        self._heads_at = time.monotonic()
        self._acknowledged = False

    def _received(self, slot: Slot, stored: Position, now: datetime, *, fresh: bool) -> Received:
        if slot.time is not None and fresh:
            learn(self.clock, slot.time, now)
        at = measured_at(self.clock, slot.time, now, fresh=fresh)
        return reading_of(self.machine, slot, Position(stored.epoch, slot.sequence, stored.generation), at)

    # --- corrections

    async def offer(self, orders: Sequence[Order]) -> None:
        """Put the order that waits longest into the mailbox, or write all directly; take back what is no longer wanted."""
        if self.machine.corrections == "none":
            return
        if self.machine.corrections == "direct":
            await self._set_directly(orders)
            return
        block = self._block
        if block is None:
            return
        open_number = block.mail.number if block.mail.number != block.answered else 0
        wanted = orders[0] if orders else None
        if wanted is None:
            if open_number:
                await self._write(Register.MAIL_NUMBER, block.answered)
            return
        if block.answered == wanted.number:
            if not block.answer_holds:
                self.remark = (
                    f"The control answers that correction {wanted.number} is applied (+{Register.ANSWERED}), but names"
                    f" {block.applied} as the last one (+{Register.APPLIED}): it is not confirmed. Does another program write"
                    " these registers?"
                )
            return
        content = mail_registers(self._mail(wanted), UNITS[self.machine.unit])
        # by its content: one from before a restart may have been converted by another mapping. “Check sum wrong” stays the
        # answer until the NC looks again: it says nothing of what lies there now
        if all(_same(self._numbers[place], value) for place, value in content):
            return
        if (
            open_number
        ):  # a newer one waits for the next poll: first the old one is taken back, and its answer looked for
            await self._write(Register.MAIL_NUMBER, block.answered)
            return
        await self._write_all(content[:-1])
        await self._write_all(content[-1:])  # the number last, when all else is read back

    async def try_out(self) -> list[str]:
        """Write what the bridge writes, with what is there: the mailbox, the acknowledgement, the last correction that is applied."""
        if self._block is None:
            return []
        places = [Register.ACK]
        if self.machine.corrections == "control":
            places = [*MAILBOX, Register.ACK]
        if self.machine.corrections == "direct":
            places.append(Register.APPLIED)
        try:
            await self._write_all([(place, self._numbers[place]) for place in places])
        except LinkError as error:
            return [f"The bridge could not write what it has to write: {error}"]
        return []

    def _mail(self, order: Order) -> Mail:
        location = location_of(self.machine, order.tool_memory)
        assert location is not None  # the guards have seen to it
        unit = self.machine.unit
        return Mail(
            order.number,
            location.tool,
            location.edge,
            self.parameter(location),
            in_steps(location.to_control(order.before, unit), UNITS[unit]),
            in_steps(location.to_control(order.after, unit), UNITS[unit]),
        )

    def parameter(self, location: Location) -> int:
        """The number by which the NC program knows the register."""
        numbered = getattr(self.registers, "parameter", None)
        return numbered(location) if numbered else 1

    async def outcomes(self) -> Sequence[Outcome]:
        """The NC program's last answer, or those of direct writes."""
        if self._direct:
            return list(self._direct.values())
        block = self._block
        if block is None or not block.answered or self.machine.corrections != "control" or not block.answer_holds:
            return []
        held = self._held_after(block)
        # the last two are said of mail behind the one that was answered last
        if block.answer in {Answer.APPLIED, Answer.CHECK_WRONG, Answer.ON_HOLD}:
            return [Outcome(block.answered, applied=True, offset=held)]
        if block.answer not in set(REFUSALS):
            return []
        reason = REFUSALS[Answer(block.answer)]
        return [Outcome(block.answered, False, held, reason, block.answer == Answer.OFFSET_DIFFERS)]

    def _held_after(self, block: Block) -> float | None:
        """The offset after the last answer, if the mailbox still says which location it was about."""
        if block.mail.number != block.answered or not block.mail_fits:
            return None
        for location in self.machine.location:
            same = (block.mail.tool, block.mail.edge) == (location.tool, location.edge)
            if same and self.parameter(location) == block.mail.parameter:
                return location.from_control(block.offset, self.machine.unit)
        return None

    async def _set_directly(self, orders: Sequence[Order]) -> None:
        """Compare and set: each offset before becomes the one after; anything else is left alone and reported.

        Run again after a crash it reads first: an offset that is already the one after is only reported. Where one must not be
        written now, or fails, the others are written all the same.
        """
        self._direct = {order.number: outcome for order in orders if (outcome := self._direct.get(order.number))}
        written: list[Order] = []
        waiting: dict[str, list[Order]] = {}
        for order in orders:
            if order.number in self._direct:
                continue
            try:
                if await self._compare_and_set(order):
                    written.append(order)
            except (Misconfigured, _NotNow) as error:
                waiting.setdefault(str(error), []).append(order)
        self.remark = " ".join(filter(None, (self.remark, *(_waits(them, why) for why, them in waiting.items()))))
        if written:
            await asyncio.sleep(self.machine.interval)  # a control shows a new value only after its next sampling tick
        for order in written:
            await self._note_direct(order, await self._offset_of(self._location(order.tool_memory)))

    async def _compare_and_set(self, order: Order) -> bool:
        """Tell if the offset was written. Raises `_NotNow` where the control must not be written to now."""
        location = self._location(order.tool_memory)
        before, after = (location.to_control(value, self.machine.unit) for value in (order.before, order.after))
        held = await self._offset_of(location)
        if self._near(location, held, after) or not self._near(location, held, before):
            await self._note_direct(order, held)
            return False
        if reason := await self.registers.against_writing(location):
            raise _NotNow(reason)
        await self.registers.write_offset(location, round(after, 6))
        return True

    def _near(self, location: Location, held: float, wanted: float) -> bool:
        return abs(held - wanted) <= abs(location.to_control(self.machine.tolerance, self.machine.unit))

    async def _note_direct(self, order: Order, held: float) -> None:
        location = self._location(order.tool_memory)
        before, after = (location.to_control(value, self.machine.unit) for value in (order.before, order.after))
        offset = location.from_control(held, self.machine.unit)
        if self._near(location, held, after):
            await self._write(Register.APPLIED, order.number)
            self._direct[order.number] = Outcome(order.number, applied=True, offset=offset)
        else:
            unit, decimals = self.machine.unit, 5 if self.machine.unit == "inch" else 4
            reason = f"The control holds {held:.{decimals}f} {unit}, expected was {before:.{decimals}f} {unit}."
            self._direct[order.number] = Outcome(order.number, False, offset, reason, differs=True)

    # --- decisions

    async def decide(self, decided: Sequence[Decided]) -> None:
        """Write what the NC program may wait for: the action first, then the last sequence that is decided.

        The action is never lowered: the NC program clears it when it acts, also on one that came too late to be waited for.
        """
        block = self._block
        if block is None:
            return
        places = (Register.DECIDED, Register.ACTION)
        whole = self.registers.whole
        held = [self._numbers[place] for place in places] if whole else await self.registers.read(places)
        known, lying = (round(value) if isfinite(value) else 0 for value in held)
        new: dict[int, Told] = {}
        for each in decided:
            _, epoch, sequence = each.key.rsplit(":", 2)
            if epoch.partition(".")[0] == str(block.epoch) and int(sequence) > known:
                new[int(sequence)] = TOLD.get(each.action, Told.NONE)
        if not new:
            return
        action = max(new.values())
        if action > lying:
            await self.registers.write(Register.ACTION, float(action))
            await self.registers.shown(Register.ACTION, float(action))
            [found] = await self.registers.read((Register.ACTION,))
            if round(found) not in {action, Told.NONE}:  # 0: it has acted already
                raise ControlAway(f"Register +{Register.ACTION} (action) holds {found:g} after {action} was written.")
        await self.registers.write(Register.DECIDED, float(max(new)))  # one that gets lost costs the program a wait

    # --- offsets

    async def offsets(self) -> dict[int, float]:
        """Every location's offset, mm."""
        found = {}
        for location in self.machine.location:
            value = await self.registers.read_offset(location)
            if value is not None:
                found[location.tool_memory] = location.from_control(value, self.machine.unit)
        return found

    async def read_offset(self, tool_memory: int) -> float:
        """The offset of one location, mm."""
        location = self._location(tool_memory)
        return location.from_control(await self._offset_of(location), self.machine.unit)

    async def write_offset(self, tool_memory: int, offset: float) -> None:
        """Set the offset of one location, mm. Raises `NotNow` where it must not be written now."""
        location = self._location(tool_memory)
        if reason := await self.registers.against_writing(location):
            raise NotNow(reason)
        await self.registers.write_offset(location, round(location.to_control(offset, self.machine.unit), 6))

    def _location(self, tool_memory: int) -> Location:
        location = location_of(self.machine, tool_memory)
        if location is None:
            raise Misconfigured(f"Tool memory {tool_memory} has no location in the configuration.")
        return location

    async def _offset_of(self, location: Location) -> float:
        value = await self.registers.read_offset(location)
        if value is None:
            raise Misconfigured(
                f'The offset of tool {location.tool}, {location.register}, cannot be read: use corrections = "control".'
            )
        return value

    async def _write(self, place: Register, value: float) -> None:
        """Write a register of the block and read it back."""
        await self._write_all([(place, value)])

    async def _write_all(self, content: Sequence[tuple[Register, float]]) -> None:
        """Write registers of the block in this order, and read them back.

        Twice where they are read one by one: such a control may hand us an answer that was meant for someone else.
        """
        for place, value in content:
            await self.registers.write(place, float(value))
            if self._heads and place < FIRST_SLOT:
                self._heads[place] = float(value)
        for place, value in content:
            await self.registers.shown(place, float(value))
        twice = [*content] if self.registers.whole else [*content, *content]
        held = await self.registers.read([place for place, _ in twice])
        for (place, value), found in zip(twice, held, strict=True):
            if not _same(found, value):
                self._heads = []
                raise ControlAway(
                    f"Register +{int(place)} ({place.name.lower()}) holds {found:g} after {value:g} was written: may the"
                    " bridge write it, and does another program?"
                )


def _same(found: float, written: float) -> bool:
    """Tell if a register holds what was written: less than half a step apart (`app.core.ring`), so the NC program reads the same.

    What is not a number is not the same.
    """
    return abs(found - written) < HALF_A_STEP


def _waits(orders: Sequence[Order], reason: str) -> str:
    """The sentence about orders that wait for the same reason: each with its tool, as it stands in the alarms of others, too."""
    named = ", ".join(f"{each.number} of tool memory {each.tool_memory}" for each in orders)
    return f"{'Correction' if len(orders) == 1 else 'Corrections'} {named} {'waits' if len(orders) == 1 else 'wait'}: {reason}"
