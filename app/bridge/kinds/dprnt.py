"""Readings that an NC program prints by DPRNT (Fanuc and its like): from a serial port, a TCP connection, or a file.

The control prints and asks nothing back, so nothing can be acknowledged, and nothing is corrected. What gets lost on the way is
told by its number, and comes again with the second print at the end of the program. A reading is known by epoch and sequence.
"""

import asyncio
import contextlib
import errno
import os
import socket
import time
from collections import OrderedDict
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any, Literal, Protocol

import msgspec
from msgspec import Meta

from app.bridge.configuration import Machine
from app.bridge.links import Clock, ControlAway, LinkError, Misconfigured, Order, Outcome, Position, Received
from app.bridge.moments import START, Prints
from app.bridge.slots import printed_reading
from app.core.printed_line import LineReader, Printed

NUMBERED = True
HELD = 256 * 1024  # bytes that may wait for the next poll; then the sender has to
AT_ONCE = 1 << 20  # bytes of a file in one poll
COMPARED = 512  # bytes in front of those that are new: another file has others there
REMEMBERED = 64  # readings that a second print is compared with
NAMED = 12  # sequences that a sentence names
LONGEST_GAP = 1000  # sequences that are kept as missing
EIGHT_BITS = {"7E1": "8N1", "7E2": "8N2"}
"""Framings with as many bits on the wire, for ports that do not do seven bits with parity."""
Port = Annotated[int, Meta(ge=1, le=65535)]


class Settings(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """One of serial, connect, listen and file says where the lines come from.

    serial: a device such as ``/dev/ttyUSB0``, with baud, framing and flow (``xon``, ``rts`` or ``none``) as at the control.
    connect: ``address:port`` of a serial server. listen: a port to which the control, or a serial server, connects, on the
    address listen_on. file: to which a control or a DNC program appends.
    """

    serial: str | None = None
    connect: str | None = None
    listen: Port | None = None
    file: str | None = None
    baud: Annotated[int, Meta(ge=50)] = 4800
    framing: Literal["7E1", "7E2", "8N1", "8N2"] = "7E1"
    flow: Literal["xon", "rts", "none"] = "xon"
    listen_on: str = "0.0.0.0"  # noqa: S104 - the control has to reach it


class Source:
    """A source of bytes. Each connection is a stream of its own, so that halves of two lines are never joined.

    since: from then on, by the bridge's clock (s), nothing waits any more in a buffer. written: when the newest of the lines that
    were taken last was, where it is known.
    """

    remark = ""
    since = 0.0
    written: datetime | None = None

    async def open(self) -> str:
        """Open it, and say what it is. Raises `LinkError`."""
        raise NotImplementedError

    async def take(self) -> list[Printed]:
        """The lines that have come. Raises `LinkError` once it is gone and everything is taken."""
        raise NotImplementedError

    async def close(self) -> None:
        """Close it."""

    def damaged(self) -> int:
        """Damaged lines since the last call."""
        raise NotImplementedError


class Closing(Protocol):
    """A connection that can be closed."""

    def close(self) -> None: ...


class Stream:
    """Bytes of one connection that wait to be taken."""

    def __init__(self, reader: asyncio.StreamReader) -> None:
        self.lines = LineReader()
        self.ended: str | None = None
        self._waiting = bytearray()
        self._room = asyncio.Event()
        self._task = asyncio.create_task(self._pump(reader))

    async def _pump(self, reader: asyncio.StreamReader) -> None:
        try:
            while data := await reader.read(4096):
                self._waiting += data
                if len(self._waiting) >= HELD:
                    self._room.clear()
                    await self._room.wait()
            self.ended = "it was closed at the other end"
        except OSError as error:
            self.ended = error.strerror or str(error)

    def take(self) -> list[Printed]:
        """The lines that have come."""
        data = bytes(self._waiting)
        self._waiting.clear()
        self._room.set()
        return self.lines.feed(data)

    @property
    def finished(self) -> bool:
        """True once it has ended and everything is taken."""
        return self.ended is not None and not self._waiting

    async def stop(self) -> None:
        """End it."""
        self._task.cancel()
        await asyncio.gather(self._task, return_exceptions=True)


class One(Source):
    """A source that is one connection: a serial port, or a TCP connection that the bridge opens."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self._stream: Stream | None = None
        self._connection: Closing | None = None  # kept: it closes itself when nobody holds it

    async def _connected(self) -> tuple[asyncio.StreamReader, Closing]:
        raise NotImplementedError

    async def open(self) -> str:
        """Connect."""
        reader, self._connection = await self._connected()
        self._stream, self.since = Stream(reader), time.monotonic() + START
        return str(self.settings.serial or self.settings.connect)

    async def take(self) -> list[Printed]:
        """The lines that have come."""
        assert self._stream is not None
        lines = self._stream.take()
        if not lines and self._stream.finished:
            raise ControlAway(
                f"The connection {self.settings.serial or self.settings.connect} has ended: {self._stream.ended}."
            )
        return lines

    def damaged(self) -> int:
        """Damaged lines since the last call."""
        if self._stream is None:
            return 0
        number, self._stream.lines.damaged = self._stream.lines.damaged, 0
        return number

    async def close(self) -> None:
        """Disconnect."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None
        if self._stream is not None:
            await self._stream.stop()


class Client(One):
    """A TCP connection to a serial server, or to the control."""

    async def _connected(self) -> tuple[asyncio.StreamReader, Closing]:
        address, _, port = (self.settings.connect or "").rpartition(":")
        try:
            reader, writer = await asyncio.open_connection(address, int(port))
        except OSError as error:
            raise ControlAway(
                f"No connection to {self.settings.connect}: {error.strerror or error}. Is the serial server on, and is this"
                " its port?"
            ) from error
        _keep_alive(writer)
        return reader, writer


class SerialPort(One):
    """A serial port of this computer."""

    async def _connected(self) -> tuple[asyncio.StreamReader, Closing]:
        try:
            import serial
        except ModuleNotFoundError as error:
            raise Misconfigured(
                "A serial port needs pyserial, which is not installed. Install inband[serial]."
            ) from error
        settings = self.settings

        def opened(framing: str) -> Any:
            return serial.Serial(
                settings.serial,
                settings.baud,
                bytesize=int(framing[0]),
                parity=framing[1],
                stopbits=int(framing[2]),
                xonxoff=settings.flow == "xon",
                rtscts=settings.flow == "rts",
                timeout=0,
                exclusive=True,
            )

        try:
            try:
                port = await asyncio.to_thread(opened, settings.framing)
            except Exception as error:
                eight = EIGHT_BITS.get(settings.framing)
                if eight is None or not _refuses_framing(error):
                    raise
                port = await asyncio.to_thread(opened, eight)
                self.remark = (
                    f"The port {settings.serial} refuses {settings.framing}. It is read as {eight}, which is the same on the"
                    f' wire: the eighth bit is the parity, and is left out. Set framing = "{eight}", and it is not said again.'
                )
        except (
            Exception
        ) as error:  # a SerialException is an OSError, the termios.error of Linux is nothing but an Exception
            raise ControlAway(
                f"The serial port {settings.serial} cannot be opened: {_reason(error)}. Is it plugged in, may this program use"
                " it (group dialout), does no other, and does it know baud, framing and flow?"
            ) from error
        reader = asyncio.StreamReader()
        loop = asyncio.get_running_loop()
        transport, _ = await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), port)
        return reader, transport


def _refuses_framing(error: Exception) -> bool:
    """Tell if the port is there, and does not do what was asked for."""
    return isinstance(error, ValueError) or error.args[:1] == (errno.EINVAL,)


def _reason(error: Exception) -> str:
    """The words of an error; one of termios has its number in front of them."""
    return str(error.args[-1]) if error.args else type(error).__name__


class Listener(Source):
    """A port to which controls or serial servers connect."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self._server: asyncio.Server | None = None
        self._streams: dict[Stream, asyncio.StreamWriter] = {}
        self._damaged = 0

    async def open(self) -> str:
        """Listen."""
        place = f"{self.settings.listen_on}:{self.settings.listen}"
        try:
            self._server = await asyncio.start_server(self._accept, self.settings.listen_on, self.settings.listen)
        except OSError as error:
            raise Misconfigured(
                f"The bridge cannot listen on {place}: {error.strerror or error}. Does another program use that port?"
            ) from error
        return place

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        _keep_alive(writer)
        self._streams[Stream(reader)] = writer
        self.since = time.monotonic() + START

    async def take(self) -> list[Printed]:
        """The lines that have come on any connection."""
        lines = []
        for stream, writer in list(self._streams.items()):
            lines += stream.take()
            self._damaged += stream.lines.damaged
            stream.lines.damaged = 0
            if stream.finished:
                del self._streams[stream]
                writer.close()
                await stream.stop()
        self.remark = "" if self._streams else f"Nobody is connected to port {self.settings.listen} yet."
        return lines

    def damaged(self) -> int:
        """Damaged lines since the last call."""
        number, self._damaged = self._damaged, 0
        return number

    async def close(self) -> None:
        """Stop listening."""
        if self._server is not None:
            self._server.close()
        for stream, writer in self._streams.items():
            writer.close()
            await stream.stop()
        self._streams.clear()


class Following(Source):
    """A file that grows.

    One that shrinks, is replaced or written anew is read from its beginning: keys keep readings from coming twice.
    """

    def __init__(self, settings: Settings) -> None:
        self.path = Path(settings.file or "")
        self._lines = LineReader()
        self._at = 0
        self._known: int | None = None
        self._before = b""  # what stands in front of `_at`

    async def open(self) -> str:
        """Look whether it is there."""
        self._lines, self._at, self._known, self._before = LineReader(), 0, None, b""
        await asyncio.to_thread(self._read)
        self._at, self._known, self._before = 0, None, b""
        self.since = time.monotonic()
        return str(self.path)

    async def take(self) -> list[Printed]:
        """The lines that were appended."""
        return self._lines.feed(await asyncio.to_thread(self._read))

    def _read(self) -> bytes:
        try:
            with self.path.open("rb") as file:
                about = os.fstat(file.fileno())
                file.seek(self._at - len(self._before))
                same = about.st_size >= self._at and self._known in {None, about.st_ino}
                # a file that was written anew has other lines there: each has its own number
                if not same or file.read(len(self._before)) != self._before:
                    self._at, self._before = 0, b""
                    self._lines = LineReader()
                self._known = about.st_ino
                file.seek(self._at)
                data = file.read(AT_ONCE)
                self.written = datetime.fromtimestamp(about.st_mtime).astimezone()
        except OSError as error:
            raise ControlAway(
                f"{self.path} cannot be read: {error.strerror or error}. Does the control, or the DNC program, write there?"
            ) from error
        self._at += len(data)
        self._before = (self._before + data)[-COMPARED:]
        return data

    def damaged(self) -> int:
        """Damaged lines since the last call."""
        number, self._lines.damaged = self._lines.damaged, 0
        return number


def _keep_alive(writer: asyncio.StreamWriter) -> None:
    """Let the system notice a cable that was pulled: a control that prints nothing is silent for hours."""
    writer.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)


def source_of(settings: Settings) -> Source:
    """The source that the settings name. Raises `Misconfigured`."""
    chosen = [name for name in ("serial", "connect", "listen", "file") if getattr(settings, name) is not None]
    if len(chosen) != 1:
        raise Misconfigured(
            f"dprnt needs one of serial, connect, listen and file; it has {' and '.join(chosen) or 'none of them'}."
        )
    if settings.connect is not None and not settings.connect.rpartition(":")[2].isdecimal():
        raise Misconfigured(f"connect = {settings.connect!r} is not an address with a port, such as 192.0.2.17:4001.")
    kinds = {"serial": SerialPort, "connect": Client, "listen": Listener, "file": Following}
    return kinds[chosen[0]](settings)


class PrintedLink:
    """A control that prints: a `Link` without acknowledgement and without corrections. remark: gaps and damage, in words."""

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.clock = Clock()
        self.remark = ""
        self._prints = Prints(self.clock, machine.interval)
        self._source: Source | None = None
        self._unstored: list[Received] = []
        self._highest: tuple[int, int] | None = None
        self._missing: OrderedDict[tuple[int, int], None] = OrderedDict()
        self._recent: OrderedDict[tuple[int, int], float] = OrderedDict()
        self._lost = 0
        self._damaged = 0
        self._epochs = ""

    async def connect(self) -> str:
        """Open the source; what it is called."""
        if self.machine.corrections != "none":
            raise Misconfigured(
                f'machine.{self.machine.key}: a control that prints takes no corrections. Set corrections = "none"; carry'
                " them as program text (page Programs)."
            )
        self._source = source_of(self.machine.settings)
        if isinstance(self._source, Following):
            self._highest, self._epochs = None, ""
            self._missing.clear()
        return await self._source.open()

    async def close(self) -> None:
        """Close the source."""
        if self._source is not None:
            with contextlib.suppress(OSError):
                await self._source.close()
            self._source = None

    async def fetch(self, stored: Position) -> Sequence[Received]:
        """The readings that have come, in their order; those that were not stored the last time come first."""
        if self._source is None:
            raise ControlAway("It is not open.")
        following = isinstance(self._source, Following)  # a file is read from its beginning, and counted from there
        if not following and self._highest is None and stored.epoch is not None:
            self._highest = (stored.epoch, stored.sequence)
        try:
            lines = await self._source.take()
        except LinkError:
            if not self._unstored:
                raise
            lines = []
        self._unstored += self._received(self._source, lines, stored.generation)
        self._damaged += self._source.damaged()
        self.remark = self._remark()
        return list(self._unstored)

    def _received(self, source: Source, lines: Sequence[Printed], generation: int) -> list[Received]:
        """The readings on these lines but for those that were printed before with the same size."""
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
            new.append((printed, Position(epoch, sequence, generation), known))
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
                f"The control began to count anew: epoch {before[0]} became {epoch}. Were its variables lost?"
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

    async def acknowledge(self, received: Sequence[Received]) -> None:
        """They are stored: they need not come again. The control cannot be told."""
        del self._unstored[: len(received)]

    async def offer(self, orders: Sequence[Order]) -> None:
        """Nothing can be offered."""

    async def outcomes(self) -> Sequence[Outcome]:
        """Nothing is answered."""
        return []

    async def offsets(self) -> dict[int, float]:
        """Nothing can be read."""
        return {}


def link(machine: Machine) -> PrintedLink:
    """The link to a machine's control."""
    return PrintedLink(machine)
