"""Haas NGC over TCP: machine data collection, setting 143.

``?Q600 n`` reads one variable, ``?En value`` writes one. The control sends every answer to every connection, and the answer does
not say which variable it is of: another collector's answer looks like ours. So one query is on its way at a time, and values are
read in short rows. A row ends with a marker, the epoch of the block (a random number), and with a fence, ``?Q100``: a foreign
answer in between moves ours, so that another number stands where the marker should, or one line too many has come before the
fence. Then the row is read again.
"""

import asyncio
import math
import random
import re
import time
from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Final

import msgspec
from msgspec import Meta

from app.bridge.configuration import Location, Machine
from app.bridge.links import ControlAway, Misconfigured
from app.bridge.registers import RegisterLink
from app.core.ring import Register

NUMBERED = True
REGISTER_OF = ("tool",)
PARAMETERS: Final = {"wear_length": 2200, "wear_diameter": 2600, "wear_x": 2700, "wear_z": 2800}
"""Registers of a tool: that of tool T is variable #[number + T]. A mill has the first two, a lathe the others."""
TOOLS: Final = {"wear_length": 200, "wear_diameter": 200, "wear_x": 50, "wear_z": 50}
ROW: Final = 10
SHORT_ROW: Final = 4
"""Values of a row; few after a foreign answer, so that a busy collector leaves room for a whole one."""
ALONE_AFTER: Final = 60.0  # s without a foreign answer
ATTEMPTS: Final = 12
FIRST_ANSWER: Final = 0.5
"""s: the first query of a connection may stay without an answer."""
DATE: Final = 3011  # as 20261124
TIME_OF_DAY: Final = 3012  # as 201500
NO_NUMBER: Final = math.nan
MACRO = re.compile(r"MACRO\s*,?(.*)", re.IGNORECASE)
SERIAL = re.compile(r"SERIAL\s*NUMBER\s*,\s*(\S+)", re.IGNORECASE)
STATE = re.compile(r"(?:PROGRAM|STATUS)\s*,\s*(.*)", re.IGNORECASE)
WRITTEN = re.compile(r"(!.*)")
LONGEST_LINE: Final = 4096


class Settings(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """address: name or number of the control in the network. port: setting 143. first_register: the variable in which the block begins.

    pause: seconds between an answer and the next query. answer: seconds in which an answer comes.
    """

    address: str
    port: Annotated[int, Meta(ge=1, le=65535)] = 5051
    first_register: Annotated[int, Meta(ge=1)] = 10800
    pause: Annotated[float, Meta(ge=0, le=1)] = 0.02
    answer: Annotated[float, Meta(gt=0)] = 2.0


class Mixed(Exception):
    """Someone else's answer came among ours."""


class Lines(asyncio.Protocol):
    """Lines from the control, without prompt and blanks; None at the end of the connection."""

    def __init__(self) -> None:
        self.lines: asyncio.Queue[str | None] = asyncio.Queue()
        self._rest = b""

    def data_received(self, data: bytes) -> None:
        """Cut at each line end."""
        *lines, self._rest = re.split(rb"[\r\n]+", self._rest + data)
        self._rest = self._rest[-LONGEST_LINE:]
        for line in lines:
            if text := line.decode("ascii", "replace").strip("> \t\0\x02\x03\x17"):
                self.lines.put_nowait(text)

    def connection_lost(self, exc: Exception | None) -> None:
        """The end."""
        self.lines.put_nowait(None)

    def taken(self) -> list[str]:
        """Lines that came without being awaited."""
        found = []
        while not self.lines.empty():
            line = self.lines.get_nowait()
            if line is None:
                self.lines.put_nowait(None)
                break
            found.append(line)
        return found


class HaasRegisters:
    """The variables of one control: `app.bridge.registers.Registers`."""

    whole = False

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.settings: Settings = machine.settings
        self._transport: asyncio.Transport | None = None
        self._lines = Lines()
        self._marker = NO_NUMBER
        self._asked = self._fenced = False
        self._mixed_at = -ALONE_AFTER

    @property
    def _place(self) -> str:
        return f"{self.settings.address}:{self.settings.port}"

    async def connect(self) -> str:
        """Connect, and answer the serial number. The first query of a connection may stay without an answer."""
        for location in self.machine.location:
            self.parameter(location)
        self._lines, self._marker, self._asked, self._fenced = Lines(), NO_NUMBER, False, False
        try:
            self._transport, _ = await asyncio.get_running_loop().create_connection(
                lambda: self._lines, self.settings.address, self.settings.port
            )
        except OSError as error:
            raise ControlAway(
                f"No connection to {self._place}: {error.strerror or error}. Is the control on, is the address right, and"
                f" does setting 143 say {self.settings.port}?"
            ) from error
        for _ in range(2):
            try:
                return (await self._query("?Q100", SERIAL, min(FIRST_ANSWER, self.settings.answer)))[1]
            except TimeoutError:
                continue
        try:
            return (await self._query("?Q100", SERIAL))[1]
        except TimeoutError as error:
            raise ControlAway(
                f"{self._place} takes the connection but does not answer ?Q100 with a serial number: is it a Haas control,"
                " and is this the port of setting 143?"
            ) from error

    async def close(self) -> None:
        """Disconnect."""
        if self._transport is not None:
            self._transport.close()
            self._transport = None

    async def shown_time(self) -> datetime | None:
        """Date (#3011) and time (#3012) of the control."""
        date, time_of_day, later = await self.variables([DATE, TIME_OF_DAY, DATE])
        try:
            shown = datetime.strptime(f"{date:08.0f} {time_of_day:06.0f}", "%Y%m%d %H%M%S")  # noqa: DTZ007 - it has no zone
        except ValueError:
            return None
        return shown if date == later else None  # it is midnight

    # --- the block

    def _variable(self, place: int) -> int:
        return self.settings.first_register + place

    async def read(self, places: Sequence[int]) -> list[float]:
        """Registers of the block. One that is empty is not a number; an empty layout is 0, as where nobody set it up."""
        values = await self.variables([self._variable(place) for place in places])
        return [
            0.0 if place == Register.LAYOUT and math.isnan(value) else value
            for place, value in zip(places, values, strict=True)
        ]

    async def write(self, place: int, value: float) -> None:
        """Write one register of the block."""
        await self._set(self._variable(place), value)

    # --- offsets

    def parameter(self, location: Location) -> int:
        """The number of a location's register for the NC program: that of tool T is #[number + T]."""
        if location.register not in PARAMETERS:
            raise Misconfigured(
                f"machine.{self.machine.key}: register = {location.register!r} is not known on a Haas; there are"
                f" {', '.join(PARAMETERS)}."
            )
        if location.tool > TOOLS[location.register]:
            raise Misconfigured(
                f"machine.{self.machine.key}: {location.register} has tools up to {TOOLS[location.register]}, not"
                f" {location.tool}."
            )
        return PARAMETERS[location.register]

    async def shown(self, place: int, value: float) -> None:
        """Nothing to wait for: what is written is shown at once."""

    async def read_offset(self, location: Location) -> float | None:
        """The offset; None where the variable is empty."""
        [value] = await self.variables([self.parameter(location) + location.tool])
        return None if math.isnan(value) else value

    async def write_offset(self, location: Location, value: float) -> None:
        """Set the offset, and read it back twice."""
        number = self.parameter(location) + location.tool
        await self._set(number, value)
        found = await self.variables([number, number])
        if not all(abs(each - value) <= 1e-4 for each in found):
            raise ControlAway(
                f"#{number} holds {found[0]:g} after {value:g} was written: is the variable free to write by ?E?"
            )

    async def against_writing(self, location: Location) -> str | None:
        """A program that runs, or a state that is not idle."""
        try:
            words = (await self._query("?Q500", STATE))[1].upper()
        except TimeoutError as error:
            raise self._silent("?Q500") from error
        if "BUSY" in words:
            return "A program is running on the control (?Q500 says BUSY): the offset is not written now."
        if "IDLE" not in words:
            return f"The control is not idle (?Q500 says {words!r}): the offset is not written now."
        return None

    # --- queries

    async def variables(self, numbers: Sequence[int]) -> list[float]:
        """Variables by their numbers; one that is empty is not a number."""
        values: list[float] = []
        alone = time.monotonic() >= self._mixed_at + ALONE_AFTER
        row, attempts = ROW if alone else SHORT_ROW, ATTEMPTS
        while len(values) < len(numbers):
            wanted = numbers[len(values) : len(values) + row]
            try:
                values += await self._row(wanted)
                attempts = ATTEMPTS
            except TimeoutError as error:
                raise self._silent(f"?Q600 {wanted[0]}") from error
            except Mixed as error:
                self._marker, self._mixed_at = NO_NUMBER, time.monotonic()
                row, attempts = SHORT_ROW if row > SHORT_ROW else max(row // 2, 1), attempts - 1
                if not attempts:
                    raise ControlAway(
                        f"Another program asks at {self._place} so often that its answers and the bridge's mix: let it ask"
                        " less often, or close it. Nothing was taken over."
                    ) from error
                await asyncio.sleep(random.uniform(0.01, 0.05))  # noqa: S311 - out of step with the other
        return values

    async def _row(self, numbers: Sequence[int]) -> list[float]:
        """Some values, with the marker behind them, and before them too where it is not known; then the fence.

        All answers come in the order of their queries. So when ours to the fence is there, so are all before it, and as many
        lines as we have asked for must have come since the last fence.
        """
        if not self._fenced:
            await self._fence()
        self._fenced = False
        if any(SERIAL.match(line) for line in self._lines.taken()):
            raise Mixed  # one of the two was for someone else
        marker = self._variable(Register.EPOCH)
        before = [marker] if math.isnan(self._marker) else []
        behind = [] if numbers[-1] == marker else [marker]
        row = [await self._value(number) for number in (*before, *numbers, *behind)]
        known = row[0] if before else self._marker
        if row[-1] != known and not (math.isnan(row[-1]) and math.isnan(known)):
            raise Mixed
        if any(MACRO.match(line) or SERIAL.match(line) for line in await self._fence()):
            raise Mixed
        self._marker, self._fenced = row[-1], True
        return row[len(before) : len(before) + len(numbers)]

    async def _fence(self) -> list[str]:
        """Ask for the serial number; the lines that came before it."""
        passed: list[str] = []
        await self._query("?Q100", SERIAL, passed=passed)
        return passed

    async def _value(self, number: int) -> float:
        passed: list[str] = []
        found = await self._query(f"?Q600 {number}", MACRO, passed=passed)
        if any(MACRO.match(line) or SERIAL.match(line) for line in passed):
            raise Mixed
        try:
            return float(found[1])
        except ValueError:
            return NO_NUMBER

    async def _set(self, number: int, value: float) -> None:
        text = f"{value:.6f}".rstrip("0")
        try:
            await self._query(f"?E{number} {text}{'0' if text.endswith('.') else ''}", WRITTEN)
        except TimeoutError as error:
            raise ControlAway(
                f"The control has not confirmed that #{number} was written (?E): does it allow that variable?"
            ) from error

    async def _query(
        self, command: str, wanted: re.Pattern[str], patience: float | None = None, passed: list[str] | None = None
    ) -> re.Match[str]:
        """One query, and the first line that can be its answer; ``passed`` takes the others. Raises `TimeoutError`."""
        if self._transport is None:
            raise ControlAway(f"No connection to {self._place}.")
        if self._asked:
            await asyncio.sleep(self.settings.pause)
        if passed is not None:
            passed += self._lines.taken()
        self._asked = True
        self._transport.write(f"{command}\r\n".encode())
        async with asyncio.timeout(patience or self.settings.answer):
            while (line := await self._lines.lines.get()) is not None:
                if found := wanted.match(line):
                    return found
                if passed is not None:
                    passed.append(line)
        self._lines.lines.put_nowait(None)
        raise ControlAway(
            f"{self._place} has closed the connection. It serves two programs at most: close one of the others, or the"
            " control was switched off."
        )

    def _silent(self, command: str) -> ControlAway:
        return ControlAway(
            f"The control has not answered {command} for {self.settings.answer:g} s. Is the variable there, and is the"
            " control up?"
        )


def link(machine: Machine) -> RegisterLink:
    """The link to a machine's control."""
    return RegisterLink(machine, HaasRegisters(machine))
