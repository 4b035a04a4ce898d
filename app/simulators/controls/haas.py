"""A simulated Haas NGC: machine data collection by TCP, with what the manual warns of.

Two connections at most. Every answer goes to all connections, and says no variable's number. The first ``?Q100`` of a connection
stays without an answer. A variable that is not set is empty.
"""

import asyncio
import contextlib
import re

from app.bridge.kinds.haas import DATE, PARAMETERS, TIME_OF_DAY
from app.core.ring import SIZE
from app.simulators.controls.model import Feature, Model
from app.simulators.controls.tcp_control import TcpControl

FEATURES = (Feature(register="wear_length", parameter=PARAMETERS["wear_length"]),)
CONNECTIONS = 2
LATENCY = 0.003  # s
QUERY = re.compile(r"\?Q(\d+)\s*(\d*)\s*$", re.IGNORECASE)
WRITE = re.compile(r"\?E(\d+)\s+([-+]?\d*\.?\d*)\s*$", re.IGNORECASE)


class HaasSimulator(TcpControl):
    """One control that is running. variables: those that are neither in the block nor an offset of the model."""

    def __init__(self, model: Model, first: int = 10800, latency: float = LATENCY) -> None:
        super().__init__(model)
        self.first = first
        self.latency = latency
        self.variables: dict[int, float] = {5041: 234.567}
        self.queries = 0
        self._lock = asyncio.Lock()

    def table(self) -> dict[str, object]:
        """The table of a machine in the configuration."""
        reached: dict[str, object] = {"address": "127.0.0.1", "port": self.port, "first_register": self.first}
        return self.model.table(
            "haas", reached, identity=self.model.serial, proof_needed=False, location=self.model.locations
        )

    async def _talk(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if self.connections > CONNECTIONS:
            return
        greeted = False
        with contextlib.suppress(ValueError):  # a line too long
            while line := await reader.readline():
                text = line.decode("ascii", "replace").strip()
                if not greeted and text.upper() == "?Q100":
                    greeted = True
                    continue
                if text:
                    async with self._lock:
                        await asyncio.sleep(self.latency)
                        self.broadcast(self.answer(text))

    def broadcast(self, line: str) -> None:
        """Send a line to all connections."""
        for writer in self._connected:
            if not writer.is_closing():
                writer.write(f"{line}\r\n".encode())

    def answer(self, text: str) -> str:
        """The answer to one line."""
        if found := WRITE.match(text):
            return self._write(int(found[1]), float(found[2]))
        if not (found := QUERY.match(text)):
            return ">?, UNKNOWN COMMAND"
        self.queries += 1
        state = "STATUS, BUSY" if self.model.running else f"PROGRAM, O09820, IDLE, PARTS, {self.model.parts}"
        if found[1] == "600":
            value = self._read(int(found[2] or 0))
            return ">MACRO, " if value is None else f">MACRO, {value:.6f}"
        answers = {
            "100": f"SERIAL NUMBER, {self.model.serial}",
            "101": "SOFTWARE, VERSION 100.23.000.1001",
            "102": "MODEL, VF-2",
            "104": "MODE, MEM",
            "201": f"USING TOOL, {self.model.tool_in_spindle}",
            "500": state,
        }
        return f">{answers.get(found[1], 'UNKNOWN COMMAND')}"

    def _offset(self, number: int) -> tuple[int, int, str] | None:
        for place in self.model.offsets:
            if PARAMETERS.get(place[2], -SIZE) + place[0] == number:
                return place
        return None

    def _read(self, number: int) -> float | None:
        if 0 <= number - self.first < SIZE:
            return self.model.registers[number - self.first]
        if number in {DATE, TIME_OF_DAY}:
            return float(self.model.clock().strftime("%Y%m%d" if number == DATE else "%H%M%S"))
        place = self._offset(number)
        return self.variables.get(number) if place is None else self.model.offsets[place]

    def _write(self, number: int, value: float) -> str:
        if 0 <= number - self.first < SIZE:
            self.model.registers[number - self.first] = value
        elif place := self._offset(number):
            self.model.edit(place, value)
        elif number in range(10_000, 11_000) or number in range(500, 1000):
            self.variables[number] = value
        else:
            return ">?, UNKNOWN VARIABLE"
        return f"!#{number}={value:.6f}"


async def serve(model: Model, port: int = 0) -> HaasSimulator:
    """Start a simulated control."""
    simulator = HaasSimulator(model)
    await simulator.start(port)
    return simulator
