"""A simulated MTConnect agent beside the model of a machine: probe, current and sample, with what is awkward in real ones.

The buffer keeps few observations, and positions fill it. Before the first part everything is UNAVAILABLE. Beside the part count
stands a target. Errors come with status 404. Times of answers are whole seconds.
"""

import asyncio
import time
from datetime import UTC, datetime
from typing import NamedTuple
from urllib.parse import parse_qs, unquote, urlsplit
from xml.sax.saxutils import escape

from app.core.ring import Register
from app.simulators.controls.model import Model
from app.simulators.controls.tcp_control import TcpControl

BUFFER = 64
TICK = 0.05  # s
NAMESPACE = "urn:mtconnect.org:MTConnect{}:1.5"
ITEMS = {
    "count": ("PartCount", "PART_COUNT", "ALL"),
    "target": ("PartCount", "PART_COUNT", "TARGET"),
    "program": ("Program", "PROGRAM", ""),
    "tool": ("ToolNumber", "TOOL_NUMBER", ""),
    "execution": ("Execution", "EXECUTION", ""),
    "x": ("Position", "POSITION", "ACTUAL"),
}
"""dataItemId: element, type, subType."""


class Entry(NamedTuple):
    """One observation in the buffer."""

    number: int
    item: str
    value: str
    at: datetime


class AgentSimulator(TcpControl):
    """An agent that is running. answering: while it is cleared, questions stay without an answer. instead: what it answers, whatever is asked."""

    def __init__(self, model: Model, buffer: int = BUFFER) -> None:
        super().__init__(model)
        self.buffer = buffer
        self.answering = asyncio.Event()
        self.answering.set()
        self.instead: bytes | None = None
        self.asked: list[str] = []
        self.instance = 0
        self.next = 1
        self.entries: list[Entry] = []
        self.now: dict[str, Entry] = {}

    async def start(self, port: int) -> None:
        """Listen; 0 takes a free port."""
        self.restart()
        await super().start(port)

    def restart(self) -> None:
        """Begin again: another instance, numbers from 1, nothing known."""
        self.instance = max(self.instance + 1, int(time.time()))
        self.next = 1
        self.entries.clear()
        self.now.clear()
        for item in ITEMS:
            self.observe(item, "UNAVAILABLE")

    def observe(self, item: str, value: str) -> None:
        """Note a value, if it is another one."""
        if item in self.now and self.now[item].value == value:
            return
        self.now[item] = Entry(self.next, item, value, datetime.now(UTC))
        self.entries.append(self.now[item])
        self.next += 1
        del self.entries[: -self.buffer]

    def table(self) -> dict[str, object]:
        """The context table of a machine in the configuration."""
        return {"context": {"kind": "mtconnect", "url": f"http://127.0.0.1:{self.port}", "device": self.model.serial}}

    def look(self) -> None:
        """Note what the machine does now."""
        model = self.model
        model.registers[Register.ACK] = model.registers[Register.WRITTEN]  # nobody fetches readings here
        if model.parts == 0:
            return
        self.observe("count", str(model.parts))
        self.observe("target", "500")
        self.observe("program", "O1000")
        self.observe("execution", "ACTIVE")
        if model.tool_in_spindle:
            self.observe("tool", str(model.tool_in_spindle))
        self.observe("x", f"{time.monotonic() % 200:.4f}")

    async def _work(self) -> None:
        while True:
            self.look()
            await asyncio.sleep(TICK)

    async def _talk(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while True:
            head = (await reader.readuntil(b"\r\n\r\n")).decode("latin-1")
            target = head.split()[1]
            self.asked.append(target)
            await self.answering.wait()
            status, body = self.answer(target)
            content = self.instead if self.instead is not None else body.encode()
            writer.write(
                f"HTTP/1.1 {status}\r\nContent-Type: text/xml\r\nContent-Length: {len(content)}\r\n\r\n".encode()
                + content
            )
            await writer.drain()

    def answer(self, target: str) -> tuple[str, str]:
        """Status and document for a path with its query."""
        parts = urlsplit(target)
        *device, what = [unquote(word) for word in parts.path.split("/") if word] or ["probe"]
        query = {name: values[0] for name, values in parse_qs(parts.query).items()}
        if device not in ([], [self.model.serial]):
            return self._error("NO_DEVICE", f"Could not find the device {device[0]!r}")
        if what == "probe":
            return "200 OK", self._probe()
        if what == "current":
            return "200 OK", self._streams(list(self.now.values()), self.next)
        if what != "sample":
            return self._error("UNSUPPORTED", f"{what!r} is not known")
        first = self.entries[0].number
        begin = int(query.get("from", first))
        if not first <= begin <= self.next:
            return self._error("OUT_OF_RANGE", f"'from' must be between {first} and {self.next}")
        chosen = [entry for entry in self.entries if entry.number >= begin][: int(query.get("count", 100))]
        return "200 OK", self._streams(chosen, chosen[-1].number + 1 if chosen else self.next)

    def _header(self, more: str = "") -> str:
        now = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
        return (
            f'<Header creationTime="{now}" sender="simulated" instanceId="{self.instance}" version="1.5.0"'
            f' bufferSize="{self.buffer}"{more}/>'
        )

    def _document(self, kind: str, inner: str) -> str:
        root = f"MTConnect{kind}"
        space = NAMESPACE.format(kind)
        return (
            f'<?xml version="1.0" encoding="UTF-8"?>\n<m:{root} xmlns:m="{space}" xmlns="{space}">{inner}</m:{root}>\n'
        )

    def _error(self, code: str, words: str) -> tuple[str, str]:
        errors = f'<Errors><Error errorCode="{code}">{escape(words)}</Error></Errors>'
        return "404 Not Found", self._document("Error", self._header() + errors)

    def _streams(self, entries: list[Entry], following: int) -> str:
        numbers = f' firstSequence="{self.entries[0].number}" lastSequence="{self.next - 1}" nextSequence="{following}"'
        values = "".join(
            f'<{ITEMS[each.item][0]} dataItemId="{each.item}" sequence="{each.number}"'
            + (f' subType="{ITEMS[each.item][2]}"' if ITEMS[each.item][2] else "")
            + f' timestamp="{each.at.isoformat(timespec="milliseconds").replace("+00:00", "Z")}">{escape(each.value)}'
            f"</{ITEMS[each.item][0]}>"
            for each in entries
        )
        name = self.model.serial
        return self._document(
            "Streams",
            f'{self._header(numbers)}<Streams><DeviceStream name="{name}" uuid="{name}"><ComponentStream component="Path"'
            f' componentId="p1"><Events>{values}</Events></ComponentStream></DeviceStream></Streams>',
        )

    def _probe(self) -> str:
        items = "".join(
            f'<DataItem category="{"SAMPLE" if item == "x" else "EVENT"}" id="{item}" type="{kind}"'
            + (f' subType="{subtype}"/>' if subtype else "/>")
            for item, (_, kind, subtype) in ITEMS.items()
        )
        name = self.model.serial
        return self._document(
            "Devices",
            f'{self._header()}<Devices><Device id="d1" name="{name}" uuid="{name}"><DataItems>{items}</DataItems>'
            "</Device></Devices>",
        )


async def serve(model: Model, port: int) -> AgentSimulator:
    """Start one."""
    simulator = AgentSimulator(model)
    await simulator.start(port)
    return simulator
