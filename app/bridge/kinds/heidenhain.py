"""Heidenhain TNC: readings from a file that the NC program prints by FN 16; corrections as a small program that it calls.

The files come and go by LSV2 file transfer (library pyLSV2), or lie in a folder. The TNC keeps the offset in a QR parameter, which the
tool call adds (``DR+QR31``): no tool table is written. Tried against a simulator only.
"""

import asyncio
import contextlib
import logging
import re
import socket
import tempfile
import time
from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path, PureWindowsPath
from typing import Annotated, Any, NamedTuple, Protocol, TypeVar

import msgspec
import pyLSV2
from msgspec import Meta

from app.bridge.configuration import Machine
from app.bridge.links import Clock, ControlAway, Decided, LinkError, Misconfigured, Order, Outcome, Position, Received
from app.bridge.moments import Prints
from app.bridge.plain_files import read_plain, write_new
from app.bridge.slots import printed_reading
from app.bridge.tnc_program import correction_program
from app.core.printed_line import DECIMALS, MODULUS, LineReader, Printed
from app.core.ring import STEPS, Unit

NUMBERED = True
REGISTER_OF = ()
LARGE = 500_000  # bytes: a file that is fetched whole each time it grows should be emptied now and then
REGISTER = re.compile(r"QR([1-9]\d{1,2})")
FIRST_REGISTER, LAST_REGISTER = 10, 499  # QR0 to QR9 are for the counters
ANSWER = re.compile(r"INBANS N([0-9]+) A([0-9]) R([0-9]+) V(-?[0-9]+[.]([0-9]+)) U([12]) K([0-9]+) FIN")
REASONS = {1: "The control holds another offset than expected.", 4: "The NC program refused the step (answer 4)."}
MOST_ANSWERS = 100  # the newest that are handed on
T = TypeVar("T")
for _name in ("LSV2 Client", "LSV2 TCP"):
    logging.getLogger(_name).setLevel(logging.CRITICAL)  # what it logs is said here in a sentence


class Settings(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Either address or folder.

    address, port: of the TNC for LSV2. readings: the file that FN 16 appends to. corrections: the program that the part program
    calls. folder: where both files lie under their names, on a share that the TNC writes to. answer: seconds for one answer.
    """

    address: str | None = None
    port: Annotated[int, Meta(ge=1, le=65535)] = 19000
    folder: str | None = None
    readings: str = "TNC:\\inband\\readings.txt"
    corrections: str = "TNC:\\inband\\corr.h"
    answer: Annotated[float, Meta(gt=0)] = 3.0

    def beside(self, folder: Path, place: str, problems: list[str]) -> "Settings":
        """The same with a folder that is not relative; mistakes are added to ``problems``."""
        if (self.address is None) == (self.folder is None):
            problems.append(f"{place} needs one of address and folder.")
        return self if self.folder is None else msgspec.structs.replace(self, folder=str(folder / self.folder))


class Answered(NamedTuple):
    """The NC program's answer to a correction. held: the offset then, in the control's unit."""

    number: int
    answer: int
    register: int
    held: float
    unit: Unit


def answer_check(answered: Answered) -> int:
    """The check sum of an answer's line: 0 to 96."""
    steps = round(abs(answered.held) * STEPS[answered.unit])
    total = 3 * answered.number + 5 * answered.answer + 7 * answered.register + steps + 23 * answered.unit
    return int(total + (answered.held < 0 and steps > 0)) % MODULUS


def answers_in(text: str) -> list[Answered]:
    """The answers in the text of a file, in their order; damaged ones are left out."""
    found = []
    for number, answer, register, held, decimals, unit, check in ANSWER.findall(text):
        one = Answered(int(number), int(answer), int(register), float(held), Unit(int(unit)))
        if len(decimals) == DECIMALS[one.unit] and answer_check(one) == int(check):
            found.append(one)
    return found


class Files(Protocol):
    """The two files; every call blocks, and is made in a thread. written: when the one that was read last was written, if it is known."""

    written: datetime | None

    def open(self) -> str:
        """Connect, and answer the identity. Raises `LinkError`, as all do."""

    def read(self) -> bytes | None:
        """The file of readings if it has changed since the last call; None if not."""

    def put(self, text: str) -> None:
        """Replace the program of corrections; never half of it."""

    def try_out(self) -> str | None:
        """Write as `put` does, beside the program; a sentence if that does not go."""

    def end(self) -> None:
        """Disconnect at once, also while another thread waits for an answer."""


class FolderFiles:
    """Files in a folder."""

    def __init__(self, settings: Settings) -> None:
        self.folder = Path(settings.folder or "")
        self.readings = self.folder / PureWindowsPath(settings.readings).name
        self.corrections = self.folder / PureWindowsPath(settings.corrections).name
        self.written: datetime | None = None
        self._known: tuple[int, int] | None = None

    def open(self) -> str:
        """Look whether the folder is there; its name."""
        if not self.folder.is_dir():
            raise ControlAway(f"The folder {self.folder} is not there: is the share mounted?")
        return str(self.folder)

    def read(self) -> bytes | None:
        """The file of readings if it has changed."""
        try:
            about = self.readings.lstat()
            if self._known == (about.st_size, about.st_mtime_ns):
                return None
            content, about = read_plain(self.readings)
        except FileNotFoundError:
            self.open()
            changed, self._known = self._known != (0, 0), (0, 0)
            return b"" if changed else None
        except OSError as error:
            raise ControlAway(f"{self.readings} cannot be read: {error.strerror or error}.") from error
        self._known = (about.st_size, about.st_mtime_ns)
        self.written = datetime.fromtimestamp(about.st_mtime).astimezone()
        return content

    def put(self, text: str) -> None:
        """Replace the program of corrections."""
        new = self.corrections.with_suffix(".new")
        try:
            write_new(new, text.encode("cp1252"))
            new.replace(self.corrections)
        except OSError as error:
            raise ControlAway(
                f"{self.corrections} cannot be written: {error.strerror or error}. May this program write into the folder?"
            ) from error

    def try_out(self) -> str | None:
        """A sentence if the program of corrections could not be written."""
        probe = self.corrections.with_suffix(".check")
        try:
            write_new(probe, b"")
            probe.unlink()
        except OSError as error:
            return f"{self.corrections} could not be written: {error.strerror or error}. May this program write into the folder?"
        return None

    def end(self) -> None:
        """Nothing is open."""


class _Socket(socket.socket):
    """A socket that reports an end as an error: pyLSV2 would wait for the rest of an answer for ever."""

    def recv(self, size: int, flags: int = 0) -> bytes:
        """Bytes, never none."""
        data = super().recv(size, flags)
        if not data:
            raise ConnectionResetError("the control has closed the connection")
        return data


class Lsv2Files:
    """Files of a TNC by LSV2. Logins INSPECT and FILE, nothing else: pyLSV2's safe mode stays on."""

    written: datetime | None = None  # the control says it by its own clock

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self._client: Any = None
        self._socket: _Socket | None = None
        self._known: tuple[int, Any] | None = None

    def _said(self, words: str) -> str:
        code = self._client.last_error
        return f"{words} ({pyLSV2.get_error_text(code)})" if code.e_code > 0 else words

    def _guarded(self, call: Callable[[], T], what: str) -> T:
        place = f"{self.settings.address}:{self.settings.port}"
        try:
            return call()
        except TimeoutError as error:
            raise ControlAway(
                f"{place} has not answered for {self.settings.answer:g} s while the bridge {what}: is the control on, and is"
                " there a firewall between?"
            ) from error
        except OSError as error:
            raise ControlAway(
                f"{place}: {error.strerror or error}, while the bridge {what}. Are address and port right, and is external"
                " access switched on at the control?"
            ) from error
        except Exception as error:
            # pyLSV2 raises bare exceptions, and ValueError and struct.error for what it cannot read
            raise ControlAway(
                f"{place} gives an answer that is not understood while the bridge {what}: {error}. Is it a TNC, and LSV2?"
            ) from error

    def open(self) -> str:
        """Connect; type and number of the control."""
        settings = self.settings

        def connected() -> None:
            self._client = pyLSV2.LSV2(settings.address or "", settings.port, settings.answer)
            wire = self._client._llcom  # noqa: SLF001 - it offers no other way to notice a closed connection
            wire._tcpsock.close()  # noqa: SLF001
            self._socket = _Socket(socket.AF_INET, socket.SOCK_STREAM)
            self._socket.settimeout(settings.answer)
            wire._tcpsock = self._socket  # noqa: SLF001
            self._client.connect()

        self._guarded(connected, "connected")
        if not self._guarded(lambda: self._client.login(pyLSV2.Login.FILETRANSFER), "logged in"):
            raise Misconfigured(
                self._said("The control refuses the login FILE")
                + ": allow external access and file transfer at the control (MOD functions)."
            )
        about = self._client.versions
        number = "" if about.id_number == "not supported" else f" {about.id_number}"
        return f"{about.control}{number}".strip("\0 ")

    def read(self) -> bytes | None:
        """The file of readings if its size or time has changed."""
        name = self.settings.readings
        about = self._guarded(lambda: self._client.file_info(name), f"looked for {name}")
        if about is None:
            if self._client.last_error.e_code != pyLSV2.LSV2StatusCode.T_ER_NO_FILE:
                raise Misconfigured(self._said(f"The control does not show {name}") + ". Is the path right?")
            changed, self._known = self._known != (0, None), (0, None)
            return b"" if changed else None
        known = (about.size, about.timestamp)
        if known == self._known:
            return None
        if about.size == 0:  # pyLSV2 cannot fetch an empty file
            self._known = known
            return b""
        with tempfile.TemporaryDirectory() as folder:
            local = Path(folder) / "readings.txt"
            if not self._guarded(lambda: self._client.recive_file(name, local), f"fetched {name}"):
                raise ControlAway(self._said(f"The control did not send {name}") + ". It is tried again.")
            content = local.read_bytes()
        self._known = known
        return content

    def put(self, text: str) -> None:
        """Replace the program: sent under another name first, so that a half one is never called."""
        self._put(text, self.settings.corrections)

    def try_out(self) -> str | None:
        """The same with a program of another name, that does nothing; it is fetched, and deleted again."""
        name = str(PureWindowsPath(self.settings.corrections).with_name("corr_chk.h"))
        try:
            self._put(correction_program((), {}, "mm", name), name)
            with tempfile.TemporaryDirectory() as folder:
                local = Path(folder) / "corr_chk.h"
                fetched = self._guarded(lambda: self._client.recive_file(name, local), f"fetched {name}")
                whole = bool(fetched) and b"END PGM CORR_CHK" in local.read_bytes()
            if not self._guarded(lambda: self._client.delete_file(name), f"deleted {name}"):
                return self._said(f"{name} could not be deleted") + ". It does nothing; delete it at the control."
        except LinkError as error:
            return str(error)
        return (
            None
            if whole
            else f"{name}, written to the control, did not come back whole. It is tried again by the bridge."
        )

    def _put(self, text: str, name: str) -> None:
        new = str(PureWindowsPath(name).with_name("corr_new.h"))
        with tempfile.TemporaryDirectory() as folder:
            local = Path(folder) / "corr_new.h"
            local.write_bytes(text.encode("cp1252"))

            def sent() -> bool:
                client = self._client
                return bool(
                    client.send_file(local, new, override_file=True)
                    and client.delete_file(name)
                    and client.move_file(new, name)
                )

            try:
                done = self._guarded(sent, f"wrote {name}")
            except ControlAway as error:
                if not isinstance(error.__cause__, pyLSV2.LSV2StateException):
                    raise
                raise Misconfigured(
                    f"{name} cannot be written: {error.__cause__}. Make the directory {PureWindowsPath(name).parent} at the"
                    " control."
                ) from error
        if not done:
            raise ControlAway(
                self._said(f"The control did not take {name}") + ". Is it open in the editor? It is tried again."
            )

    def end(self) -> None:
        """Cut the connection: a thread that waits for an answer ends with an error."""
        if self._socket is not None:
            with contextlib.suppress(OSError):
                self._socket.shutdown(socket.SHUT_RDWR)
            self._socket.close()
            self._socket = None


class TncLink:
    """A TNC: a `Link`. remark: gaps, damage and a large file, in words."""

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.clock = Clock()
        self.remark = ""
        self._files: Files | None = None
        self._prints = Prints(self.clock, machine.interval)
        self._begin()

    def _begin(self) -> None:
        self._reader = LineReader()
        self._content = b""
        self._sizes: dict[tuple[int, int], float] = {}
        self._unstored: list[Received] = []
        self._highest: tuple[int, int] | None = None
        self._answers: list[Answered] = []
        self._lying: str | None = None
        self._stop: int | None = None
        self._looked = False
        self._since = time.monotonic()
        self._missing = 0

    async def connect(self) -> str:
        """Connect; type and number of the control, or the folder."""
        machine = self.machine
        if machine.corrections == "direct":
            raise Misconfigured(
                f'machine.{machine.key}: a TNC takes corrections by its program only. Set corrections = "control" or "none".'
            )
        for place in machine.location:
            found = REGISTER.fullmatch(place.register)
            if found is None or not FIRST_REGISTER <= int(found[1]) <= LAST_REGISTER:
                raise Misconfigured(
                    f"machine.{machine.key}: register = {place.register!r} is not a QR parameter from QR{FIRST_REGISTER} to"
                    f" QR{LAST_REGISTER}."
                )
        self._begin()
        chosen = FolderFiles if machine.settings.folder is not None else Lsv2Files
        self._files = chosen(machine.settings)
        return await asyncio.to_thread(self._files.open)

    async def close(self) -> None:
        """Disconnect."""
        if self._files is not None:
            self._files.end()
            self._files = None

    def _open_files(self) -> Files:
        if self._files is None:
            raise ControlAway("It is not connected.")
        return self._files

    async def fetch(self, stored: Position) -> Sequence[Received]:
        """The readings that the file has and the store has not, in the order of the file."""
        content = await asyncio.to_thread(self._open_files().read)
        if content is None:
            self._placed([])
        else:
            content = content.replace(b",", b".")  # decimal comma, by the language of the control
            self._take(content, stored)
        return list(self._unstored)

    def _take(self, content: bytes, stored: Position) -> None:
        if not content.startswith(self._content):  # emptied, or another file: from its beginning
            self._reader, self._sizes = LineReader(), {}
            self._content = b""
        lines = self._reader.feed(content[len(self._content) :])
        self._content = content
        self._answers = answers_in(content.decode("cp1252", "replace"))
        if not self._looked:
            self._looked = True
            self._highest = None if stored.epoch is None else (stored.epoch, stored.sequence)
            places = [(line.epoch, line.slot.sequence) for line in lines]
            if self._highest in places:
                first = places.index(self._highest) + 1
                self._sizes = {place: line.slot.measured for place, line in zip(places[:first], lines, strict=False)}
                lines = lines[first:]
        new = [each for printed in lines if (each := self._new(printed, stored.generation))]
        times = self._placed([printed for printed, _, _ in new])
        self._unstored += [
            printed_reading(self.machine, printed, position, at, known)
            for (printed, position, known), at in zip(new, times, strict=True)
        ]
        self.remark = self._remark()

    def _placed(self, lines: Sequence[Printed]) -> list[datetime | None]:
        now, written = datetime.now().astimezone(), self._open_files().written
        return self._prints.place(lines, now, time.monotonic(), self._since, written)

    def _new(self, printed: Printed, generation: int) -> tuple[Printed, Position, float | None] | None:
        """A line with its position and the other size that it had before; None where the file has it: M_APPEND writes whole
        blocks again.
        """
        slot, place = printed.slot, (printed.epoch, printed.slot.sequence)
        known = self._sizes.get(place)
        if known == slot.measured:
            return None
        self._sizes.setdefault(place, slot.measured)
        before = self._highest
        if before is None or before[0] != place[0] or place[1] > before[1]:
            if before is not None and before[0] == place[0]:
                self._missing += place[1] - before[1] - 1
            self._highest = place
        epoch, sequence = self._highest or place
        return printed, Position(epoch, sequence, generation), known

    def _remark(self) -> str:
        words = []
        if self._missing:
            words.append(f"Missing readings since the connection: {self._missing}; they are not in the file.")
        if self._reader.damaged:
            words.append(f"Damaged lines in the file: {self._reader.damaged}.")
        if len(self._content) > LARGE:
            words.append("The file of readings is large: delete it at the control between two programs.")
        return " ".join(words)

    async def acknowledge(self, received: Sequence[Received]) -> None:
        """They are stored. The file stays as it is."""
        del self._unstored[: len(received)]

    async def offer(self, orders: Sequence[Order]) -> None:
        """Write all orders as a program, or one that does nothing; only if another lies there."""
        if self.machine.corrections == "none" and self._stop is None:
            return
        answered = {answer.number for answer in self._answers}
        if orders and all(order.number in answered for order in orders):
            return
        open_ones = [order for order in orders if order.number not in answered]
        locations = {place.tool_memory: place for place in self.machine.location}
        settings = self.machine.settings
        text = correction_program(open_ones, locations, self.machine.unit, settings.corrections, self._stop)
        if text != self._lying:
            self._lying = None
            await asyncio.to_thread(self._open_files().put, text)
            self._lying = text

    async def try_out(self) -> list[str]:
        """Write a program beside that of the corrections, as one of these is written, and take it away."""
        wrong = await asyncio.to_thread(self._open_files().try_out)
        return [wrong] if wrong else []

    async def outcomes(self) -> Sequence[Outcome]:
        """The NC program's answers, of each correction the first: it may be cut off, and run again."""
        if self.machine.corrections == "none":
            return []
        first: dict[int, Answered] = {}
        for answered in self._answers:
            first.setdefault(answered.number, answered)
        return [self._outcome(answered) for answered in list(first.values())[-MOST_ANSWERS:]]

    def _outcome(self, answered: Answered) -> Outcome:
        held = None
        for location in self.machine.location:
            if location.register == f"QR{answered.register}":
                held = location.from_control(answered.held, "mm" if answered.unit is Unit.MM else "inch")
        if answered.answer == 0:
            return Outcome(answered.number, applied=True, offset=held)
        reason = REASONS.get(answered.answer, f"The NC program refused it (answer {answered.answer}).")
        return Outcome(answered.number, False, held, reason, answered.answer == 1)

    async def decide(self, decided: Sequence[Decided]) -> None:
        """A stop goes into the program of corrections: the next call of it stops, before the next part is cut."""
        stops = [int(each.key.rsplit(":", 1)[1].partition(":")[0]) for each in decided if each.action == "stop"]
        if stops:
            self._stop = stops[-1]

    async def offsets(self) -> dict[int, float]:
        """Nothing can be read; an edit is noticed at the next correction."""
        return {}


def link(machine: Machine) -> TncLink:
    """The link to a machine's control."""
    return TncLink(machine)
