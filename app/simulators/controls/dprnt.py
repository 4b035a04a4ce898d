"""A simulated control that prints: on a TCP port like a serial server, and on a pseudo terminal like a serial port.

It pads numbers with blanks, prints ``-`` in front of the padding, asks nothing back, and prints the last eight again after each
part. Anyone who is not connected misses what is printed.
"""

import asyncio
import contextlib
import os

from app.core.printed_line import DECIMALS, END, START, Printed, check_of
from app.core.ring import SLOTS, Register, Slot, Unit
from app.simulators.controls.model import Feature, Model
from app.simulators.controls.tcp_control import TcpControl

FEATURES = (Feature(),)
TICK = 0.01  # s


class PrintingSimulator(TcpControl):
    """One control that is running. device: its pseudo terminal. parity: seven bits and even parity, as 7E1 sends them."""

    def __init__(self, model: Model, *, parity: bool = False) -> None:
        super().__init__(model)
        self.parity = parity
        self.device = ""
        self._terminal: tuple[int, int] | None = None
        self._printed = 0

    async def start(self, port: int) -> None:
        """Listen; 0 takes a free port."""
        if hasattr(os, "openpty"):  # Windows has no pseudo terminals
            import tty

            ours, theirs = os.openpty()
            tty.setraw(theirs)
            os.set_blocking(ours, False)
            self._terminal, self.device = (ours, theirs), os.ttyname(theirs)
        await super().start(port)

    async def stop(self) -> None:
        """End it."""
        await super().stop()
        for end in self._terminal or ():
            os.close(end)
        self._terminal = None

    def table(self) -> dict[str, object]:
        """The table of a machine in the configuration."""
        return self.model.table("dprnt", {"connect": f"127.0.0.1:{self.port}"}, corrections="none")

    async def _talk(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while await reader.read(1024):
            pass

    async def _work(self) -> None:
        parts = self.model.parts
        while True:
            for epoch, slot in self.model.written[self._printed :]:
                self.send(self.text(epoch, slot))
                self._printed += 1
            self.model.registers[Register.ACK] = self.model.registers[Register.WRITTEN]  # a print waits for nobody
            if not self.model.running and self.model.parts != parts:
                parts = self.model.parts
                self.print_again()
            await asyncio.sleep(TICK)

    def print_again(self) -> None:
        """Print the last eight again."""
        for epoch, slot in self.model.written[: self._printed][-SLOTS:]:
            self.send(self.text(epoch, slot))

    def text(self, epoch: int, slot: Slot) -> bytes:
        """A reading as the control prints it."""
        unit = Unit(self.model.unit)
        decimals = DECIMALS[unit]
        size = round(slot.measured, decimals)
        printed = Printed(epoch, unit, Slot(slot.sequence, slot.characteristic, size, *_rest(slot)))
        numbers = {
            "E": (epoch, 6),
            "N": (slot.sequence, 7),
            "C": (slot.characteristic, 4),
            "V": (size, 9),
            "I": (slot.in_effect, 7),
            "P": (slot.part, 7),
            "T": (slot.tool, 4),
            "S": (slot.status, 1),
            "H": (-1 if slot.time is None else round(slot.time), 5),
            "U": (int(unit), 1),
            "K": (check_of(printed), 2),
        }
        words = []
        for letter, (number, digits) in numbers.items():
            shown = f"{abs(number):.{decimals}f}" if letter == "V" else str(abs(int(number)))
            words.append(f"{letter}{'-' if number < 0 else ''}{shown:>{digits}}")
        return f"{START} {' '.join(words)} {END}\n".encode()

    def send(self, data: bytes) -> None:
        """Send bytes to everybody who listens."""
        if self.parity:
            data = bytes(byte | (0x80 if byte.bit_count() % 2 else 0) for byte in data)
        for writer in self._connected:
            if not writer.is_closing():
                writer.write(data)
        if self._terminal is not None:
            with contextlib.suppress(BlockingIOError):  # nobody reads it
                os.write(self._terminal[0], data)


def _rest(slot: Slot) -> tuple[int, int, int, int, float | None]:
    return slot.in_effect, slot.part, slot.tool, slot.status, slot.time


async def serve(model: Model, port: int = 0) -> PrintingSimulator:
    """Start a simulated control."""
    simulator = PrintingSimulator(model)
    await simulator.start(port)
    return simulator
