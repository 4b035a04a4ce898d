"""Sources of lines that a machine prints: a serial port, a TCP connection, a port that listens, a file that grows."""

import asyncio
import contextlib
import errno
import os
import socket
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any, Generic, Literal, Protocol, TypeVar

import msgspec
from msgspec import Meta

from app.bridge.configuration import Machine
from app.bridge.links import LIBRARIES, Clock, ControlAway, LinkError, Misconfigured, OneWay, Position, Received
from app.bridge.moments import START

HELD = 256 * 1024  # bytes that may wait for the next poll; then the sender has to
AT_ONCE = 1 << 20  # bytes of a file in one poll
COMPARED = 512  # bytes in front of those that are new: another file has others there
EIGHT_BITS = {"7E1": "8N1", "7E2": "8N2"}
"""Framings with as many bits on the wire, for ports that do not do seven bits with parity."""
Port = Annotated[int, Meta(ge=1, le=65535)]
L = TypeVar("L")


class Settings(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """The place that lines come from: one of serial, connect and listen.

    serial: a device such as ``/dev/ttyUSB0``, with baud, framing and flow (``xon``, ``rts`` or ``none``) as at the other end.
    connect: ``address:port`` of a serial server. listen: a port to which the control, or a serial server, connects, on the
    address listen_on.
    """

    serial: str | None = None
    connect: str | None = None
    listen: Port | None = None
    baud: Annotated[int, Meta(ge=50)] = 4800
    framing: Literal["7E1", "7E2", "8N1", "8N2"] = "7E1"
    flow: Literal["xon", "rts", "none"] = "xon"
    listen_on: str = "0.0.0.0"  # noqa: S104 - the control has to reach it

    @property
    def read_once(self) -> bool:
        """A second reader would take lines from the first: everywhere but in a file."""
        return bool(self.serial or self.connect or self.listen)


class Reader(Protocol[L]):
    """A reader that finds lines in a stream of bytes. damaged: those that began and were not complete, or are wrong."""

    damaged: int

    def feed(self, data: bytes) -> list[L]:
        """The lines that these bytes complete."""


class Source(Generic[L]):
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

    async def take(self) -> list[L]:
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


class Stream(Generic[L]):
    """Bytes of one connection that wait to be taken."""

    def __init__(self, reader: asyncio.StreamReader, lines: Reader[L]) -> None:
        self.lines = lines
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

    def take(self) -> list[L]:
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


class One(Source[L]):
    """A source that is one connection: a serial port, or a TCP connection that the bridge opens."""

    def __init__(self, settings: Settings, lines: Callable[[], Reader[L]]) -> None:
        self.settings, self._reader = settings, lines
        self._stream: Stream[L] | None = None
        self._connection: Closing | None = None  # kept: it closes itself when nobody holds it

    async def _connected(self) -> tuple[asyncio.StreamReader, Closing]:
        raise NotImplementedError

    async def open(self) -> str:
        """Connect."""
        reader, self._connection = await self._connected()
        self._stream, self.since = Stream(reader, self._reader()), time.monotonic() + START
        return str(self.settings.serial or self.settings.connect)

    async def take(self) -> list[L]:
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


class Client(One[L]):
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


class SerialPort(One[L]):
    """A serial port of this computer."""

    async def _connected(self) -> tuple[asyncio.StreamReader, Closing]:
        try:
            import serial
        except ModuleNotFoundError as error:
            raise Misconfigured(f"A serial port needs pyserial, which is not installed: {LIBRARIES}") from error
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
        try:
            transport, _ = await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), port)
        except NotImplementedError:  # Windows: its selectors know sockets alone
            return reader, ReadByThread(port, reader, loop)
        return reader, transport


class ReadByThread:
    """A serial port that a thread reads, where the event loop cannot wait for one."""

    def __init__(self, port: Any, reader: asyncio.StreamReader, loop: asyncio.AbstractEventLoop) -> None:
        self._port, self._reader, self._loop = port, reader, loop
        self._closing = False
        port.timeout = 0.2  # s: as long as closing takes
        threading.Thread(target=self._pump, name=f"serial port {port.name}", daemon=True).start()

    def _pump(self) -> None:
        words = None
        try:
            while not self._closing:
                if data := self._port.read(max(1, self._port.in_waiting)):
                    self._loop.call_soon_threadsafe(self._reader.feed_data, data)
        except Exception as error:  # noqa: BLE001 - as where it is opened
            words = OSError(0, _reason(error))
        finally:
            self._port.close()
        with contextlib.suppress(RuntimeError):  # the loop has ended before the thread
            if words is None:
                self._loop.call_soon_threadsafe(self._reader.feed_eof)
            else:
                self._loop.call_soon_threadsafe(self._reader.set_exception, words)

    def close(self) -> None:
        """End it, within a moment."""
        self._closing = True
        with contextlib.suppress(Exception):  # it may have ended by itself
            self._port.cancel_read()


def _refuses_framing(error: Exception) -> bool:
    """Tell if the port is there, and does not do what was asked for."""
    return isinstance(error, ValueError) or error.args[:1] == (errno.EINVAL,)


def _reason(error: Exception) -> str:
    """The words of an error; one of termios has its number in front of them."""
    return str(error.args[-1]) if error.args else type(error).__name__


class Listener(Source[L]):
    """A port to which controls or serial servers connect."""

    def __init__(self, settings: Settings, lines: Callable[[], Reader[L]]) -> None:
        self.settings, self._reader = settings, lines
        self._server: asyncio.Server | None = None
        self._streams: dict[Stream[L], asyncio.StreamWriter] = {}
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
        self._streams[Stream(reader, self._reader())] = writer
        self.since = time.monotonic() + START

    async def take(self) -> list[L]:
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


class Following(Source[L]):
    """A file that grows.

    One that shrinks, is replaced or rewritten is read from its beginning: keys keep readings from coming twice.
    """

    def __init__(self, file: str, lines: Callable[[], Reader[L]]) -> None:
        self.path, self._reader = Path(file), lines
        self._lines = lines()
        self._at = 0
        self._known: int | None = None
        self._before = b""  # what is in front of `_at`

    async def open(self) -> str:
        """Look whether it is there."""
        self._lines, self._at, self._known, self._before = self._reader(), 0, None, b""
        await asyncio.to_thread(self._read)
        self._at, self._known, self._before = 0, None, b""
        self.since = time.monotonic()
        return str(self.path)

    async def take(self) -> list[L]:
        """The lines that were appended."""
        return self._lines.feed(await asyncio.to_thread(self._read))

    def _read(self) -> bytes:
        try:
            with self.path.open("rb") as file:
                about = os.fstat(file.fileno())
                file.seek(self._at - len(self._before))
                same = about.st_size >= self._at and self._known in {None, about.st_ino}
                # a file that was rewritten has other lines there: each has its own number
                if not same or file.read(len(self._before)) != self._before:
                    self._at, self._before = 0, b""
                    self._lines = self._reader()
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


class Printing(OneWay, Generic[L]):
    """A link to a machine that prints: nothing can be acknowledged, and nothing goes back. remark: oddities, in words."""

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.clock = Clock()
        self.remark = ""
        self._source: Source[L] | None = None
        self._unstored: list[Received] = []
        self._damaged = 0

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
        try:
            lines = await self._source.take()
        except LinkError:
            if not self._unstored:
                raise
            lines = []
        self._unstored += self._received(self._source, lines, stored)
        self._damaged += self._source.damaged()
        self.remark = self._remark()
        return list(self._unstored)

    async def acknowledge(self, received: Sequence[Received]) -> None:
        """They are stored. The machine cannot be informed."""
        del self._unstored[: len(received)]

    def _received(self, source: Source[L], lines: Sequence[L], stored: Position) -> Iterable[Received]:
        raise NotImplementedError

    def _remark(self) -> str:
        raise NotImplementedError


def _keep_alive(writer: asyncio.StreamWriter) -> None:
    """Let the system notice a cable that was pulled: a control that prints nothing is silent for hours."""
    writer.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)


def source_of(
    settings: Settings, kind: str, lines: Callable[[], Reader[L]], *, file: str | None = None, files: bool = False
) -> Source[L]:
    """The source that the settings, or a file to follow, name. files: the kind may follow one. Raises `Misconfigured`."""
    names = ("serial", "connect", "listen", *(["file"] if files else []))
    given = {"serial": settings.serial, "connect": settings.connect, "listen": settings.listen, "file": file}
    chosen = [name for name in names if given[name] is not None]
    if len(chosen) != 1:
        wanted = f"{', '.join(names[:-1])} and {names[-1]}"
        raise Misconfigured(f"{kind} needs one of {wanted}; it has {' and '.join(chosen) or 'none of them'}.")
    if settings.connect is not None and not settings.connect.rpartition(":")[2].isdecimal():
        raise Misconfigured(f"connect = {settings.connect!r} is not an address with a port, such as 192.0.2.17:4001.")
    if chosen == ["file"]:
        return Following(file or "", lines)
    kinds: dict[str, type[SerialPort[L] | Client[L] | Listener[L]]]
    kinds = {"serial": SerialPort, "connect": Client, "listen": Listener}
    return kinds[chosen[0]](settings, lines)
