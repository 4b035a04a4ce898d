"""A bridge whose every part is killed or cut at random points: every reading exactly once, every correction exactly once.

A simulated control makes parts: six tools, two of them with two characteristics, one with a sister that goes on half way, one without
a location. A bridge (a process of its own) brings them to a server (another process). Meanwhile the
bridge is killed, the server is killed, the broker is killed, the links are cut, the power of the control fails, its network goes,
and an operator edits the offset by hand. At the end what the control has written is compared with what the server holds.
``python -m bench.bridge_faults [--faults 30] [--kind haas] [--seed 1]`` goes through all kinds if none is named; the long run is
``--faults 1000``.
"""

import argparse
import asyncio
import contextlib
import json
import os
import random
import signal
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Coroutine, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any, Protocol

import httpx

from app.core.ring import SLOTS, Register
from app.simulators.controls import simulator_named
from app.simulators.controls.model import OWNERS, SISTERS, TOLERANCE, UNMAPPED, Feature, Model, six_tools
from app.simulators.controls.mqtt import start_broker
from app.simulators.controls.toml_text import toml_of
from bench.outcome import HEAD, Outcome, Play, Process, shown
from bench.plant import PARAMETERS, free_port, plant, wait_until_ready

EDITED = (1, 2, 3, 5)  # tools whose offsets an operator edits
WORN = 4
BIAS = 0.001  # mm
SETTLE = 240.0  # s that everything may take to come to rest afterwards
CYCLE = 0.15  # s between two parts
MAIL_WAIT = 0.2  # s that the NC program waits for the next correction after each that it has taken
UNHEARD = SLOTS - len(
    OWNERS
)  # readings that nobody has heard when a part begins: the program prints the last eight again
NOTICED = 90.0  # s within which an edit by hand is noticed
OPEN = {"held", "awaiting_approval", "pending"}  # states of a correction that another one may follow


@dataclass(frozen=True)
class Kind:
    """What of the campaign differs by kind of control.

    feature: words of that control. corrections: it takes them. decimals: of a size as it is carried. ordered: readings arrive in
    the order in which they were measured; what is printed or published again comes later than its followers. waits: its ring
    waits for the bridge; where it does not, parts are held up, so that they take longer than an outage as real ones do.
    """

    feature: dict[str, Any] = field(default_factory=dict)
    corrections: bool = True
    decimals: int = 6
    ordered: bool = True
    waits: bool = True


KINDS = {
    "dprnt": Kind(corrections=False, decimals=4, ordered=False, waits=False),
    "folder": Kind(corrections=False),
    "haas": Kind({"register": "wear_diameter", "parameter": 2600}),
    "heidenhain": Kind({"register": "QR31", "parameter": 31, "holds": "radius"}, decimals=4, waits=False),
    "mqtt": Kind(ordered=False, waits=False),
    "opcua": Kind({"register": "wear_length_1", "parameter": 12}),
}
OUT = 0.008  # mm: the tolerance
FAULTS = {
    "bridge killed": 5,
    "server killed": 1,
    "link to the server cut": 4,
    "link to the control cut": 4,
    "power of the control lost": 3,
    "broker killed": 3,
    "edited by hand": 1,
}
"""Faults, and how often each comes in proportion."""


class Restartable(Protocol):
    """A server that can be killed and comes back."""

    url: str

    def kill(self) -> None:
        """Kill it."""

    def restart(self) -> None:
        """Start it again and wait until it is ready."""


class Proxy:
    """A link that can be cut: everything that goes through it breaks off, and nothing connects for a while."""

    def __init__(self, target: int) -> None:
        self.target = target
        self.port = 0
        self.open = True
        self._pairs: set[asyncio.StreamWriter] = set()
        self._server: asyncio.Server | None = None

    async def start(self) -> None:
        self._server = await asyncio.start_server(self._connected, "127.0.0.1", 0)
        self.port = self._server.sockets[0].getsockname()[1]

    async def stop(self) -> None:
        assert self._server is not None
        self._server.close()
        self.cut()

    def cut(self) -> None:
        for writer in list(self._pairs):
            writer.transport.abort()

    async def _connected(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if not self.open:
            writer.transport.abort()
            return
        try:
            there, back = await asyncio.open_connection("127.0.0.1", self.target)
        except OSError:
            writer.transport.abort()
            return
        self._pairs |= {writer, back}
        try:
            await asyncio.gather(_pump(reader, back), _pump(there, writer))
        finally:
            self._pairs -= {writer, back}
            writer.transport.abort()
            back.transport.abort()


async def _pump(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    with contextlib.suppress(OSError):
        while data := await reader.read(65536):
            writer.write(data)
            await writer.drain()
    writer.transport.abort()


@dataclass
class Control:
    """The simulated control and the links, in a thread of their own. share: a folder's link; a cut takes it away."""

    name: str
    server_port: int
    seed: int
    folder: Path
    model: Model = field(init=False)
    simulator: Any = field(init=False)
    loop: asyncio.AbstractEventLoop = field(init=False)
    to_server: Proxy = field(init=False)
    to_control: Proxy = field(init=False)
    making: bool = True
    cutting: bool = True

    def __post_init__(self) -> None:
        self.kind = KINDS[self.name]
        first = Feature(nominal=39.992, bias=BIAS, wear=0.0006, noise=0.0003, **self.kind.feature)
        self.model = Model(six_tools(first), seed=self.seed, mail_wait=MAIL_WAIT)
        self.files, self.share = self.folder / "files", self.folder / "share"

    @contextmanager
    def running(self) -> Iterator["Control"]:
        """The control, making parts."""
        self.loop = asyncio.new_event_loop()
        thread = threading.Thread(target=self.loop.run_forever, daemon=True)
        thread.start()
        self.do(self._start())
        parts = asyncio.run_coroutine_threadsafe(self._parts(), self.loop)
        try:
            yield self
        finally:
            parts.cancel()
            self.do(self._stop())
            self.loop.call_soon_threadsafe(self.loop.stop)
            thread.join()
            self.loop.close()

    def do(self, work: Coroutine[Any, Any, Any]) -> Any:
        return asyncio.run_coroutine_threadsafe(work, self.loop).result(SETTLE)

    async def _start(self) -> None:
        place: tuple[str, ...] = ()
        if self.name == "folder":
            place = (str(self.files),)
            self.share.symlink_to(self.files)
        elif self.name == "mqtt":
            self.files.mkdir()
            self.broker_port = free_port()
            broker = await start_broker(self.files, self.broker_port)
            place = (f"127.0.0.1:{self.broker_port}",)
        more = {"secure": False} if self.name == "opcua" else {}  # keys take long to make
        self.simulator = await simulator_named(self.name).serve(self.model, 0, *place, **more)
        if self.name == "mqtt":
            self.simulator.broker = broker
        if self.name == "folder":
            self.simulator.pause = 0.1  # a file a reading: there are eight times as many
        self.to_control, self.to_server = Proxy(self.simulator.port), Proxy(self.server_port)
        await self.to_control.start()
        await self.to_server.start()
        self._program: Iterator[None] = iter(())

    async def _stop(self) -> None:
        await self.to_control.stop()
        await self.to_server.stop()
        await self.simulator.stop()

    def by_the_link(self, setting: object) -> object:
        """A setting of the control, so that the bridge reaches it by the link that can be cut."""
        if setting == self.simulator.port:
            return self.to_control.port
        if isinstance(setting, str):
            port = f":{self.simulator.port}"
            return setting.replace(port, f":{self.to_control.port}").replace(str(self.files), str(self.share))
        return setting

    async def _parts(self) -> None:
        while True:
            if next(self._program, self) is self:
                await asyncio.sleep(CYCLE)
                while not self.kind.waits and len(self.model.written) - self._stored() > UNHEARD:
                    await self.print_again()
                    await asyncio.sleep(0.5)
                self.cutting = self.making
                self._program = self.model.part() if self.cutting else iter(())
            full = self.model.registers[Register.WRITTEN] - self.model.registers[Register.ACK] >= SLOTS
            await asyncio.sleep(0.02 if full else 0.001)

    def _stored(self) -> int:
        """The number of readings that the bridge has stored."""
        place = f"file:{self.folder}/inband-bridge.sqlite3?mode=ro"
        try:
            with contextlib.closing(sqlite3.connect(place, uri=True)) as store:
                return int(store.execute("SELECT count(*) FROM reading").fetchone()[0])
        except sqlite3.OperationalError:  # the bridge has not made it yet
            return 0

    async def power_loss(self) -> None:
        self.model.power_loss()
        self._program = iter(())
        await self.cut_control(0.5)

    async def cut_control(self, seconds: float) -> None:
        """Cut the link to the control; a share goes away."""
        mounted = self.share.is_symlink()
        if mounted:
            self.share.unlink()
        await self.cut(self.to_control, seconds)
        if mounted:
            self.share.symlink_to(self.files)

    async def cut(self, proxy: Proxy, seconds: float) -> None:
        proxy.open = seconds == 0
        proxy.cut()
        await asyncio.sleep(seconds)
        proxy.open = True

    async def kill_broker(self, seconds: float) -> None:
        self.simulator.broker.kill()
        await self.simulator.broker.wait()
        await asyncio.sleep(seconds)
        self.simulator.broker = await start_broker(self.files, self.broker_port)

    async def edit(self, tool: int, change: float) -> None:
        [place] = {(each.tool, each.edge, each.register) for each in self.model.places if each.tool == tool}
        self.model.edit(place, round(self.model.offsets[place] + change, 4))

    async def go_on_with_sister(self) -> None:
        self.model.worn.add(WORN)

    async def print_again(self) -> None:
        """The program that prints the last eight again, where there is one."""
        if self.name == "dprnt":
            self.simulator.print_again()

    @property
    def scale(self) -> float:
        """What a step of an offset is in diameter, as the server has it."""
        return 2.0 if self.model.features[0].holds == "radius" else 1.0

    @property
    def offsets(self) -> dict[int, float]:
        """The offset of each tool that is corrected, as the server has it."""
        places = {each.tool: (each.tool, each.edge, each.register) for each in self.model.places}
        used = {tool: place for tool, place in places.items() if tool not in SISTERS.values() or self.model.worn}
        return {tool: self.scale * self.model.offsets[place] for tool, place in used.items()}

    def truth(self, number: int) -> dict[str, float]:
        """Name and size of each reading of a characteristic that was written completely; the files of a folder name the part only."""
        slots = [(epoch, slot) for epoch, slot in self.model.written if slot.characteristic == number]
        if self.name == "folder":
            return {f"P{slot.part}": slot.measured for _, slot in slots}
        return {f"{epoch}:{slot.sequence}": slot.measured for epoch, slot in slots}

    def named(self, reading: dict[str, Any]) -> str:
        """The name of a reading of the server, as in the truth."""
        return str(reading["part"]) if self.name == "folder" else ":".join(reading["key"].split(":")[-2:])


class Bridge:
    """``inband bridge`` as a process."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self.log = file.with_suffix(".log").open("ab")
        self.process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        command = [sys.executable, "-m", "app", "bridge", "--config", str(self.file)]
        self.process = subprocess.Popen(command, stdout=self.log, stderr=self.log)

    def end(self, how: int = signal.SIGKILL) -> None:
        assert self.process is not None
        self.process.send_signal(how)
        self.process.wait(60)


@dataclass
class Campaign:
    """One run. server: to be killed; call: the REST API as an administrator, ``(method, path, **json) -> JSON``.

    name: of the machine, together with the kind. pause: s at most between two faults. outcome: of its parts, afterwards.
    """

    server: Restartable
    call: Callable[..., Any]
    folder: Path
    kind: str = "haas"
    seed: int = 1
    name: str = "faults"
    pause: float = 4.0
    faults: dict[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.machine = f"{self.name}-{self.kind}"
        self.keys = {number: f"{self.machine}-{number}" for number in range(1, len(OWNERS) + 1)}
        self.parts, self.outcome = 0, Outcome(frozenset(), 0.0, 0, 0, 0.0)
        self.chance = random.Random(f"{self.seed} {self.kind}")

    def run(self, count: int) -> dict[str, int]:
        """Cause so many faults; what was compared. Raises `AssertionError` for anything lost, doubled or overwritten."""
        there = dict(FAULTS)
        if self.kind != "mqtt":
            del there["broker killed"]
        if not KINDS[self.kind].corrections:
            del there["edited by hand"]
        try:
            return self.go_through(self.chance.choices(list(there), list(there.values()), k=count))
        except AssertionError as error:
            error.add_note(
                f"Once more: python -m bench.bridge_faults --kind {self.kind} --faults {count} --seed {self.seed}"
            )
            raise

    def go_through(self, faults: Sequence[str]) -> dict[str, int]:
        """As `run`, with these faults."""
        secret = self._set_up()
        port = int(self.server.url.rpartition(":")[2])
        with Control(self.kind, port, self.seed, self.folder).running() as control:
            bridge = Bridge(self._configuration(control, secret))
            bridge.start()
            try:
                self._until(lambda: len(self._readings(1)) >= 3, "the first readings", SETTLE)
                for number, fault in enumerate(faults, 1):
                    self._cause(fault, control, bridge)
                    if number == (len(faults) + 1) // 2 and control.kind.corrections:
                        self._go_on_with_sister(control)
                    time.sleep(self.chance.uniform(0.05, self.pause))
                    self._acknowledge()
                    if sys.stderr.isatty() or number % 25 == 0:
                        print(f"\r{self.kind} {number}/{len(faults)} {self.faults}", end="", file=sys.stderr)
                return self._compare(control)
            finally:
                bridge.end(signal.SIGTERM)
                bridge.log.close()

    def _cause(self, fault: str, control: Control, bridge: Bridge) -> None:
        self.faults[fault] = self.faults.get(fault, 0) + 1
        chance = self.chance
        match fault:
            case "bridge killed":
                bridge.end()
                time.sleep(chance.uniform(0, 0.5))
                bridge.start()
            case "server killed":
                self.server.kill()
                time.sleep(chance.uniform(0, 0.5))
                self.server.restart()
            case "link to the server cut":
                control.do(control.cut(control.to_server, chance.choice([0, 0.5])))
            case "link to the control cut":
                control.do(control.cut_control(chance.choice([0, 0.5])))
            case "power of the control lost":
                control.do(control.power_loss())
            case "broker killed":
                control.do(control.kill_broker(chance.uniform(0, 0.5)))
            case _:
                self._edit(control)

    def _go_on_with_sister(self, control: Control) -> None:
        tool = f"/machines/{self.machine}/tools/{WORN}"
        self.call("PATCH", tool, sister=SISTERS[WORN])
        self.call("POST", f"{tool}/switch", reason="faults")
        control.do(control.go_on_with_sister())

    def _edit(self, control: Control) -> None:
        """An operator changes the offset of a tool, and says at the alarm that it is true."""
        tool = self.chance.choice(EDITED)
        control.do(control.edit(tool, self.chance.choice([-0.004, 0.003, 0.005])))
        held = control.offsets[tool]

        def noticed() -> bool:
            self._acknowledge()
            return abs(self._told(tool) - control.offsets[tool]) < TOLERANCE or control.offsets[tool] != held

        try:
            self._until(noticed, f"the edit of tool {tool} to {held} is noticed", NOTICED)
        except AssertionError as error:
            error.add_note(
                f"The control holds {control.offsets[tool]}. The server: {self._known(tool)}. The bridge: {self._noted()}"
            )
            raise

    def _noted(self) -> str:
        """What the bridge has noted: the offset that the control holds, the one that it has told, and what is under way."""
        with contextlib.closing(sqlite3.connect(self.folder / "inband-bridge.sqlite3")) as store:
            places = store.execute("SELECT held, told FROM location").fetchall()
            intents = store.execute("SELECT number, state FROM intent WHERE state IN ('open', 'answered')").fetchall()
        return f"held and told {places}, under way {intents}"

    def _known(self, number: int) -> str:
        """What the server says of a tool, and what asks for a person."""
        try:
            tool = self.call("GET", f"/machines/{self.machine}/tools/{number}")
            alarms = self.call("GET", f"/alarms?state=active&machine={self.machine}")["items"]
        except httpx.HTTPError as error:
            return repr(error)
        return f"{tool}, alarms {[alarm['kind'] for alarm in alarms]}"

    def _acknowledge(self) -> None:
        """An operator looks at the alarms and releases what is held, so that corrections go on."""
        with contextlib.suppress(httpx.HTTPError):
            for held in self.call("GET", f"/machines/{self.machine}/corrections?status=held")["items"]:
                with contextlib.suppress(httpx.HTTPStatusError):
                    self.call(
                        "POST", f"/corrections/{self.machine}/{held['number']}/release", reason="The edge is good"
                    )
            for alarm in self.call("GET", f"/alarms?state=active&machine={self.machine}")["items"]:
                with contextlib.suppress(httpx.HTTPStatusError):
                    self.call("POST", f"/alarms/{alarm['id']}/acknowledge", action="noted", comment="seen")

    # --- before and after

    def _set_up(self) -> str:
        self.call("POST", "/machines", key=self.machine, name=self.machine, control="other")
        for (number, key), tool in zip(self.keys.items(), OWNERS, strict=True):
            parameters = PARAMETERS | {"tool_memory": tool, "average_memory": number}
            self.call("POST", "/characteristics", key=key, name=key, machine=self.machine, parameters=parameters)
        return str(self.call("POST", f"/machines/{self.machine}/keys", name="bridge")["secret"])

    def _configuration(self, control: Control, secret: str) -> Path:
        table: dict[str, Any] = dict(control.simulator.table())
        settings = {name: control.by_the_link(value) for name, value in table[self.kind].items()}
        if self.kind == "folder":
            settings["every"] = 0.2
        for name in ("secret_file", "secret_env"):
            table.pop(name, None)
        table |= {
            "secret": secret,
            "characteristics": dict(zip(table["characteristics"], self.keys.values(), strict=True)),
            "interval": 0.05,
            "offsets_every": 1.0,
            "patience": 5.0,
            "largest_step": 5.0,
            "largest_distance": 5.0,
            "proof_needed": False,
            self.kind: settings,
        }
        file = self.folder / "plant.toml"
        server = f'[server]\nurl = "http://127.0.0.1:{control.to_server.port}"\nask = 0.5\nheartbeat = 2\n\n'
        file.write_text(server + toml_of(self.machine, table), encoding="utf-8")
        return file

    def _until(self, met: Callable[[], bool], what: str, seconds: float) -> None:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            with contextlib.suppress(httpx.HTTPError):
                if met():
                    return
            time.sleep(0.2)
        log = (self.folder / "plant.log").read_text(encoding="utf-8", errors="replace")[-3000:]
        raise AssertionError(f"{what}: not within {seconds:g} s. The bridge said:\n{log}")

    def _all(self, path: str) -> list[dict[str, Any]]:
        found: list[dict[str, Any]] = []
        after: int | None = 0
        while after is not None:
            page = self.call("GET", f"{path}limit=1000&after={after}")
            found += page["items"]
            after = page["next"]
        return found

    def _readings(self, number: int) -> list[dict[str, Any]]:
        return self._all(f"/readings?characteristic={self.keys[number]}&order=oldest&")

    def _corrections(self) -> dict[int, dict[str, Any]]:
        return {each["number"]: each for each in self._all(f"/machines/{self.machine}/corrections?")}

    def _compare(self, control: Control) -> dict[str, int]:
        """Let everything come to rest, and compare."""
        model = control.model

        def tried() -> bool:
            self._acknowledge()
            return bool(model.applied) or not control.kind.corrections

        self._until(tried, "a first correction is applied", SETTLE)
        control.making = False
        self._until(lambda: not control.cutting, "the last part is measured", SETTLE)

        def at_rest() -> bool:
            control.do(control.print_again())
            return model.registers[Register.ACK] == model.registers[Register.WRITTEN] and all(
                len(self._readings(number)) >= len(control.truth(number)) for number in self.keys
            )

        self._until(at_rest, f"all {len(model.written)} readings at the server", SETTLE)
        for number in self.keys:
            self._compare_readings(control, number)
        if control.kind.corrections:
            self._compare_corrections(control)
        self.parts, self.outcome = model.parts, self._outcome(control)
        return {"readings": len(model.written), "corrections": len(model.applied), **self.faults}

    def _compare_readings(self, control: Control, number: int) -> None:
        readings, truth = self._readings(number), control.truth(number)
        found = [control.named(reading) for reading in readings]
        assert sorted(found) == sorted(truth), _difference(found, list(truth))
        assert found == list(truth) or not control.kind.ordered, "they are in another order"
        least = 0.51 * 10**-control.kind.decimals
        for name, reading in zip(found, readings, strict=True):
            assert abs(reading["measured"] - truth[name]) < least, f"{name} was {truth[name]}, is {reading['measured']}"
        assert [reading["sequence"] for reading in readings] == list(range(1, len(readings) + 1)), "numbers have gaps"

    def _outcome(self, control: Control) -> Outcome:
        """As `bench.outcome` has it; edits by hand, and parts cut while all was cut off, are among them."""
        sizes = {
            (slot.characteristic, slot.part): slot.measured - control.model.features[0].nominal
            for _, slot in control.model.written
            if OWNERS[slot.characteristic - 1] != UNMAPPED
        }
        issued = [each for each in self._corrections().values() if each["tool_memory"] != UNMAPPED]
        applied = [each for each in issued if each["status"] == "applied"]
        ages = [
            datetime.fromisoformat(each["applied_at"]) - datetime.fromisoformat(each["created_at"]) for each in applied
        ]
        return Outcome(
            frozenset(at for at, size in sizes.items() if abs(size) > OUT),
            max(map(abs, sizes.values())),
            len(issued),
            len(applied),
            max((age.total_seconds() for age in ages), default=0.0),
        )

    def ideal(self) -> Outcome:
        """The same wear and scatter, corrected at once: as many parts of another machine."""
        play = Play(self.call, f"{self.machine}-ideal", self.kind, self.parts)
        play.process, play.eventful = Process(play.process.features, start=BIAS), False
        play.set_up()
        return play.at_once()

    def _compare_corrections(self, control: Control) -> None:
        model, scale = control.model, control.scale
        numbers = [each.number for each in model.applied]

        def settled() -> bool:
            known = self._corrections()
            return all(known[number]["status"] not in OPEN for number in numbers)

        with contextlib.suppress(AssertionError):  # one that an edit has made obsolete is compared below
            self._until(settled, "corrections are confirmed", 15)
        assert len(set(numbers)) == len(numbers), f"applied twice: {sorted(n for n in numbers if numbers.count(n) > 1)}"
        known = self._corrections()
        merged, acted = self._merged(), set[int]()
        for number, before, after in model.applied:
            # an order takes along what the control had taken already, too, while the bridge did not know it: no step is left of that
            together = [each for each in (*merged.get(number, []), number) if each not in acted]
            acted.update(together)
            step, wanted = scale * (after - before), sum(known[each]["amount"] for each in together)
            assert abs(step - wanted) < scale * TOLERANCE, (
                f"correction {number} was {wanted}, with {together}, the offset went by {step} from {before}: {model.history}"
            )
        _no_edit_overwritten(model)
        offsets = control.offsets
        self._until(
            lambda: all(abs(self._told(tool) - offset) < TOLERANCE for tool, offset in offsets.items()),
            f"the offsets {offsets} are told",
            30,
        )

    def _merged(self) -> dict[int, list[int]]:
        """By number of an order: the earlier corrections that it took along."""
        with contextlib.closing(sqlite3.connect(self.folder / "inband-bridge.sqlite3")) as store:
            rows = store.execute("SELECT number, merged FROM intent WHERE machine = ?", (self.machine,)).fetchall()
        return {number: json.loads(merged) for number, merged in rows}

    def _told(self, tool: int) -> float:
        return float(self.call("GET", f"/machines/{self.machine}/tools/{tool}")["offset"])


def _difference(found: list[str], written: list[str]) -> str:
    lost = [key for key in written if key not in set(found)]
    new = [key for key in found if key not in set(written)]
    twice = sorted({key for key in found if found.count(key) > 1})
    return f"lost {lost[:5]}, doubled {twice[:5]}, never written {new[:5]}, else in another order"


def _no_edit_overwritten(model: Model) -> None:
    """Each offset is the sum of edits and corrections, each correction made on what stood there before."""
    held = dict.fromkeys(model.offsets, 0.0)
    for place, before, after in model.history:
        assert abs(before - held[place]) < 1e-9, f"{held[place]} at {place} was overwritten as if it were {before}"
        held[place] = after
    for place, offset in model.offsets.items():
        assert abs(offset - held[place]) < 1e-9, f"{place} is {offset}, edits and corrections lead to {held[place]}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--faults", type=int, default=30)
    parser.add_argument("--kind", choices=sorted(KINDS), help="all, one after the other, if left out")
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args()
    kinds = [chosen.kind] if chosen.kind else sorted(KINDS)
    with plant() as running, tempfile.TemporaryDirectory(prefix="inband-faults-") as folder:
        client = httpx.Client(
            base_url=f"{running.url}/api/v1", headers={"Authorization": f"Bearer {running.key}"}, timeout=30
        )

        def call(method: str, path: str, **body: Any) -> Any:
            answer = client.request(method, path, json=body or None)
            answer.raise_for_status()
            return answer.json()

        class Server:
            url = running.url

            def kill(self) -> None:
                running.process.kill()
                running.process.wait()

            def restart(self) -> None:
                running.process = subprocess.Popen(
                    [sys.executable, "-m", "app", "serve", "--port", str(running.port)],
                    env=os.environ | {"INBAND_DATABASE_URL": running.dsn},
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                )
                wait_until_ready(running.url, running.process)

        lost = []
        for place, kind in enumerate(kinds):
            count = (chosen.faults + place) // len(kinds)
            own = Path(folder, kind)
            own.mkdir()
            began = time.monotonic()
            try:
                campaign = Campaign(Server(), call, own, kind, chosen.seed)
                found = campaign.run(count)
            except AssertionError as error:
                lost.append(kind)
                print("\n".join([f"\n{kind}: {error}", *getattr(error, "__notes__", ())]), flush=True)
                continue
            print(
                f"\n{kind}: {count} faults in {time.monotonic() - began:.0f} s, nothing lost, doubled or overwritten:"
            )
            for name, number in found.items():
                print(f"{number:8d}  {name}", flush=True)
            best = campaign.ideal()
            print("\n".join([HEAD, shown("at once", best, best), shown(kind, campaign.outcome, best)]), flush=True)
    if lost:
        raise SystemExit(f"Failed: {', '.join(lost)}.")


if __name__ == "__main__":
    main()
