"""A bridge whose every part is killed or cut at random points: every reading exactly once, every correction exactly once.

A simulated control makes parts, a bridge (a process of its own) brings them to a server (another process). Meanwhile the
bridge is killed, the server is killed, the links are cut, the power of the control fails, its network goes, and an operator
edits the offset by hand. At the end what the control has written is compared with what the server holds.
``python -m bench.bridge_faults [--faults 30] [--kind haas] [--seed 1]``; the long run is ``--faults 1000``.
"""

import argparse
import asyncio
import contextlib
import os
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Coroutine, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import httpx

from app.bridge.simulators import simulator_named
from app.bridge.simulators.model import Feature, Model
from app.cli.bridge import toml_of
from app.core.ring import SLOTS, Register
from bench.plant import PARAMETERS, plant, wait_until_ready

MACHINE, CHARACTERISTIC, TOOL = "faults", "shaft", 3
SETTLE = 240.0  # s that everything may take to come to rest afterwards
NOTICED = 90.0  # s within which an edit by hand is noticed


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
    """The simulated control and the links, in a thread of their own."""

    kind: str
    server_port: int
    seed: int
    cycle: float = 0.15
    model: Model = field(init=False)
    loop: asyncio.AbstractEventLoop = field(init=False)
    to_server: Proxy = field(init=False)
    to_control: Proxy = field(init=False)
    making: bool = True

    def __post_init__(self) -> None:
        feature = Feature(nominal=39.992, tool=TOOL, bias=0.001, wear=0.0006, noise=0.0003, **_REGISTERS[self.kind])
        self.model = Model((feature,), seed=self.seed)
        self.feature = feature

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
        return asyncio.run_coroutine_threadsafe(work, self.loop).result(60)

    async def _start(self) -> None:
        self.simulator = await simulator_named(self.kind).serve(self.model, 0)
        self.to_control, self.to_server = Proxy(self.simulator.port), Proxy(self.server_port)
        await self.to_control.start()
        await self.to_server.start()
        self._program: Iterator[None] = iter(())

    async def _stop(self) -> None:
        await self.to_control.stop()
        await self.to_server.stop()
        await self.simulator.stop()

    async def _parts(self) -> None:
        while True:
            if next(self._program, self) is self:
                await asyncio.sleep(self.cycle)
                self._program = self.model.part() if self.making else iter(())
            full = self.model.registers[Register.WRITTEN] - self.model.registers[Register.ACK] >= SLOTS
            await asyncio.sleep(0.02 if full else 0.001)

    async def power_loss(self) -> None:
        self.model.power_loss()
        self._program = iter(())
        self.to_control.open = False
        self.to_control.cut()
        await asyncio.sleep(0.5)
        self.to_control.open = True

    async def cut(self, proxy: Proxy, seconds: float) -> None:
        proxy.open = seconds == 0
        proxy.cut()
        await asyncio.sleep(seconds)
        proxy.open = True

    async def edit(self, change: float) -> float:
        place = (self.feature.tool, self.feature.edge, self.feature.register)
        self.model.edit(place, round(self.model.offsets[place] + change, 4))
        return self.model.offsets[place]


_REGISTERS: dict[str, dict[str, Any]] = {
    "haas": {"register": "wear_diameter", "parameter": 2600},
    "opcua": {"register": "wear_length_1", "parameter": 12},
}


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
    """One run. server: to be killed; call: the REST API as an administrator, ``(method, path, **json) -> JSON``."""

    server: Restartable
    call: Callable[..., Any]
    folder: Path
    kind: str = "haas"
    seed: int = 1
    faults: dict[str, int] = field(default_factory=dict)
    edits: int = 0

    def run(self, count: int) -> dict[str, int]:
        """Cause so many faults; what was compared. Raises `AssertionError` for anything lost, doubled or overwritten."""
        secret = self._set_up()
        chance = random.Random(self.seed)
        port = int(self.server.url.rpartition(":")[2])
        with Control(self.kind, port, self.seed).running() as control:
            bridge = Bridge(self._configuration(control, secret))
            bridge.start()
            try:
                self._until(lambda: len(self._readings()) >= 3, "the first readings", 60)
                for number in range(count):
                    self._one_fault(chance, control, bridge)
                    time.sleep(chance.uniform(0.05, 4.0))
                    if sys.stderr.isatty():
                        print(f"\r{number + 1}/{count} {self.faults}", end="", file=sys.stderr)
                return self._compare(control)
            finally:
                bridge.end(signal.SIGTERM)
                bridge.log.close()

    def _one_fault(self, chance: random.Random, control: Control, bridge: Bridge) -> None:
        kinds: list[tuple[str, int]] = [
            ("bridge killed", 5), ("server killed", 1), ("link to the server cut", 4), ("link to the control cut", 4),
            ("power of the control lost", 3), ("edited by hand", 1),
        ]  # fmt: skip
        [name] = chance.choices([name for name, _ in kinds], [weight for _, weight in kinds])
        self.faults[name] = self.faults.get(name, 0) + 1
        match name:
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
                control.do(control.cut(control.to_control, chance.choice([0, 0.5])))
            case "power of the control lost":
                control.do(control.power_loss())
            case _:
                self._edit(chance, control)

    def _edit(self, chance: random.Random, control: Control) -> None:
        """An operator changes the offset, and says at the alarm that it is true."""
        held = control.do(control.edit(chance.choice([-0.004, 0.003, 0.005])))
        self.edits += 1

        def noticed() -> bool:
            alarms = self.call("GET", f"/alarms?state=active&machine={MACHINE}")["items"]
            for alarm in alarms:
                with contextlib.suppress(httpx.HTTPStatusError):
                    self.call("POST", f"/alarms/{alarm['id']}/acknowledge", action="noted", comment="edited")
            tool = self.call("GET", f"/machines/{MACHINE}/tools/{TOOL}")
            now = self._offset(control)
            return bool(abs(tool["offset"] - now) < 0.0006 or now != held)

        self._until(noticed, f"the edit to {held} is noticed", NOTICED)

    def _offset(self, control: Control) -> float:
        feature = control.feature
        return control.model.offsets[feature.tool, feature.edge, feature.register]

    # --- before and after

    def _set_up(self) -> str:
        self.call("POST", "/machines", key=MACHINE, name="Faults", control="other")
        parameters = PARAMETERS | {"tool_memory": TOOL, "average_memory": 5}
        self.call("POST", "/characteristics", key=CHARACTERISTIC, name="Shaft", machine=MACHINE, parameters=parameters)
        return str(self.call("POST", f"/machines/{MACHINE}/keys", name="bridge")["secret"])

    def _configuration(self, control: Control, secret: str) -> Path:
        table: dict[str, Any] = dict(control.simulator.table())
        settings = dict(table[self.kind])
        for name, value in settings.items():
            if value == control.simulator.port:
                settings[name] = control.to_control.port
            elif isinstance(value, str):
                settings[name] = value.replace(f":{control.simulator.port}", f":{control.to_control.port}")
        feature = control.feature
        place = {
            "tool_memory": TOOL,
            "tool": feature.tool,
            "edge": 1,
            "register": feature.register,
            "holds": "diameter",
        }
        for name in ("secret_file", "secret_env"):
            table.pop(name, None)
        table |= {
            "unit": "mm",
            "secret": secret,
            "characteristics": {"1": CHARACTERISTIC},
            "location": [place],
            "interval": 0.05,
            "offsets_every": 1.0,
            "patience": 5.0,
            "largest_distance": 5.0,
            "proof_needed": False,
            self.kind: settings,
        }
        file = self.folder / "plant.toml"
        server = f'[server]\nurl = "http://127.0.0.1:{control.to_server.port}"\nask = 0.5\nheartbeat = 2\n\n'
        file.write_text(server + toml_of(MACHINE, table), encoding="utf-8")
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

    def _readings(self) -> list[dict[str, Any]]:
        found: list[dict[str, Any]] = []
        after = 0
        while True:
            page = self.call("GET", f"/readings?characteristic={CHARACTERISTIC}&order=oldest&limit=1000&after={after}")
            found += page["items"]
            if page["next"] is None:
                return found
            after = page["next"]

    def _compare(self, control: Control) -> dict[str, int]:
        """Let everything come to rest, and compare."""
        control.making = False
        model = control.model

        def at_rest() -> bool:
            stored = len(self._readings())
            return stored >= len(model.written) and model.registers[Register.ACK] == model.registers[Register.WRITTEN]

        self._until(at_rest, f"all {len(model.written)} readings at the server", SETTLE)

        def settled() -> bool:
            applied = self.call("GET", f"/machines/{MACHINE}/corrections?status=applied&limit=1000")["items"]
            return {each.number for each in model.applied} <= {each["number"] for each in applied} or not model.applied

        with contextlib.suppress(AssertionError):  # those superseded by an edit are compared below
            self._until(settled, "corrections are confirmed", 15)
        readings = self._readings()
        keys = [reading["key"].removeprefix(f"{MACHINE}:") for reading in readings]
        assert keys == list(model.truth()), _difference(keys, list(model.truth()))
        sizes = [reading["measured"] for reading in readings]
        assert all(abs(a - b) < 1e-6 for a, b in zip(sizes, model.truth().values(), strict=True)), "a size was changed"
        assert [reading["sequence"] for reading in readings] == list(range(1, len(readings) + 1)), "numbers have gaps"
        numbers = [each.number for each in model.applied]
        assert numbers, "no correction was applied: nothing was tried"
        assert len(set(numbers)) == len(numbers), f"applied twice: {sorted(n for n in numbers if numbers.count(n) > 1)}"
        _no_edit_overwritten(model)
        return {"readings": len(readings), "corrections": len(numbers), "edits": self.edits, **self.faults}


def _difference(found: list[str], written: list[str]) -> str:
    lost = [key for key in written if key not in set(found)]
    new = [key for key in found if key not in set(written)]
    twice = sorted({key for key in found if found.count(key) > 1})
    return f"lost {lost[:5]}, doubled {twice[:5]}, never written {new[:5]}, else in another order"


def _no_edit_overwritten(model: Model) -> None:
    """The offset is the sum of edits and corrections, each correction made on what stood there before."""
    held = 0.0
    for before, after in model.history:
        assert abs(before - held) < 1e-9, f"an offset of {held} was overwritten as if it were {before}"
        held = after
    [offset] = model.offsets.values()
    assert abs(offset - held) < 1e-9, f"the offset is {offset}, edits and corrections lead to {held}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--faults", type=int, default=30)
    parser.add_argument("--kind", default="haas", choices=sorted(_REGISTERS))
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args()
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

        began = time.monotonic()
        found = Campaign(Server(), call, Path(folder), chosen.kind, chosen.seed).run(chosen.faults)
    print(f"\n{chosen.faults} faults in {time.monotonic() - began:.0f} s, nothing lost, doubled or overwritten:")
    for name, number in found.items():
        print(f"{number:8d}  {name}")


if __name__ == "__main__":
    main()
