"""Readings that an NC program prints by DPRNT (Fanuc and its like): from a serial port, a TCP connection, or a file.

The control prints and asks nothing back, so nothing can be acknowledged, and nothing is corrected. What gets lost on the way is
found by its number, and comes again with the second print at the end of the program. A reading is known by epoch and sequence.
"""

import time
from collections import OrderedDict
from collections.abc import Sequence
from datetime import datetime

from app.bridge import sources
from app.bridge.configuration import Machine
from app.bridge.links import Misconfigured, Position, Received
from app.bridge.moments import Prints
from app.bridge.slots import printed_reading
from app.bridge.sources import Following, Printing, Source, source_of
from app.core.printed_line import LineReader, Printed

NUMBERED = True
REMEMBERED = 64  # readings that a second print is compared with
NAMED = 12  # sequences that a sentence names
LONGEST_GAP = 1000  # sequences that are kept as missing


class Settings(sources.Settings, forbid_unknown_fields=True, frozen=True):
    """One of serial, connect, listen and file says where the lines come from, see `sources.Settings`.

    file: to which a control or a DNC program appends.
    """

    file: str | None = None


class PrintedLink(Printing[Printed]):
    """A control that prints. remark: gaps and damage, in words."""

    def __init__(self, machine: Machine) -> None:
        super().__init__(machine)
        self._prints = Prints(self.clock, machine.interval)
        self._highest: tuple[int, int] | None = None
        self._missing: OrderedDict[tuple[int, int], None] = OrderedDict()
        self._recent: OrderedDict[tuple[int, int], float] = OrderedDict()
        self._lost = 0
        self._epochs = ""

    async def connect(self) -> str:
        """Open the source; what it is called."""
        if self.machine.corrections != "none":
            raise Misconfigured(
                f'machine.{self.machine.key}: a control that prints takes no corrections. Set corrections = "none"; carry'
                " them as program text (page Programs)."
            )
        settings = self.machine.settings
        self._source = source_of(settings, "dprnt", LineReader, file=settings.file, files=True)
        if isinstance(self._source, Following):
            self._highest, self._epochs = None, ""
            self._missing.clear()
        return await self._source.open()

    def _received(self, source: Source[Printed], lines: Sequence[Printed], stored: Position) -> list[Received]:
        """The readings on these lines but for those that were printed before with the same size."""
        following = isinstance(source, Following)  # a file is read from its beginning, and counted from there
        if not following and self._highest is None and stored.epoch is not None:
            self._highest = (stored.epoch, stored.sequence)
        new = []
        for printed in lines:
            slot, place = printed.slot, (printed.epoch, printed.slot.sequence)
            known = self._recent.get(place)
            if known == slot.measured:
                continue
            self._count(place)
            if known is None:
                self._recent[place] = slot.measured
                if len(self._recent) > REMEMBERED:
                    self._recent.popitem(last=False)
            epoch, sequence = self._highest or place
            new.append((printed, Position(epoch, sequence, stored.generation), known))
        times = self._prints.place(
            [printed for printed, _, _ in new],
            datetime.now().astimezone(),
            time.monotonic(),
            source.since,
            source.written,
        )
        return [
            printed_reading(self.machine, printed, position, at, known)
            for (printed, position, known), at in zip(new, times, strict=True)
        ]

    def _count(self, place: tuple[int, int]) -> None:
        """Note which sequences are missing."""
        epoch, sequence = place
        before = self._highest
        if before is None:
            self._highest = place
            return
        if epoch != before[0]:
            self._epochs = (
                f"The control began to count again: epoch {before[0]} became {epoch}. Were its variables lost?"
            )
            self._highest = place
            return
        if sequence <= before[1]:
            self._missing.pop(place, None)
            return
        for lost in range(before[1] + 1, sequence)[-LONGEST_GAP:]:
            self._missing[epoch, lost] = None
        self._lost += max(0, sequence - before[1] - 1 - LONGEST_GAP)
        while len(self._missing) > LONGEST_GAP:
            self._missing.popitem(last=False)
            self._lost += 1
        self._highest = place

    def _remark(self) -> str:
        """Gaps and damage in words."""
        words = []
        if self._source is not None and self._source.remark:
            words.append(self._source.remark)
        if self._epochs:
            words.append(self._epochs)
        if self._missing:
            newest = [str(sequence) for _, sequence in list(self._missing)[-NAMED:]]
            number = len(self._missing) + self._lost
            named = ", ".join(newest)
            words.append(
                f"Readings are missing: {number}, the newest are {named}. Print the last eight again (the second program)."
                if number > NAMED
                else f"Missing readings: {named}. Print the last eight again (the second program)."
            )
        if self._damaged:
            words.append(f"Damaged lines since the start: {self._damaged}.")
        return " ".join(words)


def link(machine: Machine) -> PrintedLink:
    """The link to a machine's control."""
    return PrintedLink(machine)
