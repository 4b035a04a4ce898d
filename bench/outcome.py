"""Parts in tolerance: a machine with six tools over REST and each kind of bridge, beside the same process corrected at once.

Eight characteristics, two tools with two of them, one tool without a location in the bridge. The tools wear, sizes scatter; the sister of
the fourth tool goes on after a third of the parts, the first tool is changed half way, the edge of the fifth breaks and is replaced two parts later. Parts follow each other as on a machine
that takes longer for a part than the bridge for a poll. ``python -m bench.outcome [--parts 300] [--kind opcua]``
"""

import argparse
import asyncio
import contextlib
import json
import logging
import random
import sqlite3
import ssl
import tempfile
import time
from collections.abc import Awaitable, Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import httpx

from app.bridge import control_side, offering, server_side
from app.bridge.configuration import configuration_from
from app.bridge.program import link_of
from app.bridge.store import Store
from app.bridge.unit import Unit, ended
from app.core.ring import INCH, SLOTS, Register, Status
from app.core.ring import Unit as Lengths
from app.simulators.controls import simulator_named
from app.simulators.controls.model import OWNERS, SISTERS, UNMAPPED, Feature, Model, Steps, six_tools
from bench.plant import PARAMETERS, TARGET, plant
from inband_client import AsyncClient, Unavailable

CHANGED, WORN, BROKEN = 1, 4, 5
TOLERANCE = 0.008
WEAR, NOISE, BREAK = 0.0005, 0.0003, 0.05  # mm a part, mm, mm
LEFT = 2  # parts until a broken edge is replaced
PATIENCE = 60.0  # s
NOBODY = "http://127.0.0.1:9"
KINDS: dict[str, dict[str, Any]] = {
    "heidenhain": {"register": "QR31", "parameter": 31},
    "haas": {"register": "wear_diameter", "parameter": 2600},
    "mqtt": {},
    "opcua": {"register": "wear_length_1", "parameter": 12},
}
"""The words of each control for its offsets."""
WORST = 1.5
"""The largest deviation may be so many times that of the process that is corrected at once."""


def features_of(kind: str) -> tuple[Feature, ...]:
    """Eight characteristics on six tools, in the words of the control."""
    first = Feature(nominal=TARGET, wear=WEAR, noise=NOISE, bias=0.0, **KINDS.get(kind, {}))
    return six_tools(first)


@dataclass(slots=True)
class Process(Model):
    """A machine whose parts have the same wear and scatter whatever corrects it. sizes: deviations of each characteristic, mm.

    amiss: as sure as factor, sign and unit may be wrong at the control, what a correction does there; 1: what it says. swapped: tools
    whose offsets it takes for each other's. blind: the first part of which the probe does not see the first characteristic, 0: none.
    start: deviation of the first part, mm. obeys: by REST, it cuts no part more once an answer says stop. more: whether mail may still come, so that the program does not wait in vain.
    """

    sizes: dict[int, list[float]] = field(default_factory=dict)
    new_at: dict[int, int] = field(default_factory=dict)
    broken: bool = False
    amiss: float = 1.0
    swapped: dict[int, int] = field(default_factory=dict)
    blind: int = 0
    start: float = 0.0
    obeys: bool = False
    more: Callable[[], bool] = bool

    def take_corrections(self) -> Steps:
        """Take mail; the wait for the next, which a machine waits out, ends as soon as none can come."""
        for _ in Model.take_corrections(self):
            if self.idle and not self.more():
                self.idle = False
                return
            yield

    def size(self, feature: Feature) -> float:
        """The size that is cut and measured now, in the control's unit."""
        scale = INCH if self.unit == Lengths.INCH else 1.0
        scatter = random.Random(f"{feature.number} {self.parts}").gauss(0.0, feature.noise)
        worn = self.start + feature.wear * (self.parts - self.new_at.get(feature.tool, 0))
        if self.broken and feature.tool == BROKEN:
            worn += BREAK
        offset = self.offsets[self.place_of(self.swapped.get(feature.tool, feature.tool))] * scale
        deviation = worn + scatter + self.amiss * offset
        self.sizes.setdefault(feature.number, []).append(deviation)
        return (feature.nominal + deviation) / scale

    def place_of(self, tool: int) -> tuple[int, int, str]:
        """The offset of a tool."""
        return next((each.tool, each.edge, each.register) for each in self.every if each.tool == tool)

    def send(self, characteristic: int, measured: float, tool: int, status: int = Status.GOOD) -> Steps:
        """Write the reading of a probe that may have failed."""
        failed = characteristic == 1 and 0 < self.blind <= self.parts
        yield from Model.send(self, characteristic, measured, tool, Status.NO_TRIGGER if failed else status)

    def renew(self, tool: int) -> None:
        """Another edge, and its offset set to 0."""
        self.new_at[tool] = self.parts
        self.edit(self.place_of(tool), 0.0)

    def go_on_with_sister(self, tool: int) -> None:
        """Another tool cuts from now on."""
        self.worn.add(tool)
        self.new_at[SISTERS[tool]] = self.parts


class Outcome(NamedTuple):
    """The outcome for the parts. out: characteristic and part out of tolerance; worst: mm; age: s."""

    out: frozenset[tuple[int, int]]
    worst: float
    issued: int
    applied: int
    age: float

    def faults(self, ideal: "Outcome") -> list[tuple[int, int]]:
        """Parts that are out here and are in where each correction is applied at once."""
        return sorted(self.out - ideal.out)


class Play:
    """One machine at a server and its process. call: one request of the REST contract, its answer.

    kind: of KINDS, with ``direct`` behind it where the bridge writes the offsets itself; or ``rest``. ago: minutes that a part was cut
    before it really is: a clock that is moved in place of waiting. behind: called behind each part that the server knows.
    """

    def __init__(self, call: Callable[..., Any], machine: str, kind: str, parts: int) -> None:
        self.call, self.machine, self.parts = call, machine, parts
        self.kind, _, mode = kind.partition(" ")
        self.corrections = mode or "control"
        self.ago: Callable[[int], float] | None = None
        self.behind: Callable[[int], None] = lambda _part: None
        self.process = Process(features_of(self.kind))
        self.keys = {each.number: f"{machine}-{each.number}" for each in self.process.features}
        self.without_server, self.eventful = range(0), True
        self.judged = tuple(each.number for each in self.process.features if each.tool != UNMAPPED)

    def set_up(self, **parameters: Any) -> str:
        """The machine with its characteristics; the secret of its key."""
        self.call("POST", "/machines", key=self.machine, name=self.machine, control="other")
        for feature in self.process.features:
            chosen = PARAMETERS | {
                "tool_memory": feature.tool,
                "average_memory": feature.number,
                "wear_limit": BREAK / 2,
            }
            self.call(
                "POST",
                "/characteristics",
                key=self.keys[feature.number],
                name=self.keys[feature.number],
                machine=self.machine,
                parameters=chosen | parameters,
            )
        return str(self.call("POST", f"/machines/{self.machine}/keys", name="outcome")["secret"])

    def between(self, part: int) -> None:
        """Events behind a part: the sister that goes on, the tool that is changed, the edge that breaks, the one that replaces it."""
        if not self.eventful:
            return
        if part == self.parts // 3:
            tool = f"/machines/{self.machine}/tools/{WORN}"
            self.call("PATCH", tool, sister=SISTERS[WORN])
            self.call("POST", f"{tool}/switch", reason="outcome")
            self.process.go_on_with_sister(WORN)
        if part == self.parts // 2:
            self._renewed(CHANGED)
        if part == self.parts * 2 // 3:
            self.process.broken = True
        if part == self.parts * 2 // 3 + LEFT:
            self.process.broken = False
            self._renewed(BROKEN)

    def _renewed(self, tool: int) -> None:
        self.call("POST", f"/machines/{self.machine}/tools/{tool}/change", offset=0.0, reason="outcome")
        self.process.renew(tool)

    def outcome(self) -> Outcome:
        corrections = self.call("GET", f"/machines/{self.machine}/corrections?limit=1000")["items"]
        mapped = [each for each in corrections if each["tool_memory"] != UNMAPPED]
        applied = [each for each in mapped if each["status"] == "applied"]
        ages = [_seconds(each["applied_at"]) - _seconds(each["created_at"]) for each in applied]
        sizes = {number: self.process.sizes[number] for number in self.judged}
        out = frozenset(
            (number, part) for number, row in sizes.items() for part, size in enumerate(row, 1) if abs(size) > TOLERANCE
        )
        worst = max(abs(size) for number, row in sizes.items() for size in self._unbroken(number, row))
        return Outcome(out, worst, len(mapped), len(applied), max(ages, default=0.0))

    def _unbroken(self, number: int, row: Sequence[float]) -> Sequence[float]:
        first = self.parts * 2 // 3
        return [*row[:first], *row[first + LEFT :]] if OWNERS[number - 1] == BROKEN else row

    # --- corrected at once, by REST

    def at_once(self, wait: int = 0, *, without_server: range = range(0), takes: bool = True) -> Outcome:
        """Every correction is in the offset before the next cut, or so many parts later: a machine that asks for them.

        without_server: parts of an outage, whose readings the machine keeps. takes: False for a machine that takes no correction.
        """
        process = self.process

        in_effect: dict[int, int] = {}
        kept: list[dict[str, Any]] = []
        stopped = False
        for part in range(1, self.parts + 1):
            if stopped and process.obeys:
                break
            process.parts += 1
            for each in process.features:
                feature = process.cut_now(each)
                size = process.size(feature)
                failed = feature.number == 1 and 0 < process.blind <= part
                found: dict[str, Any] = {"touches": []} if failed else {"measured": round(size, 6)}
                found |= {
                    "characteristic": self.keys[feature.number],
                    "correction_in_effect": in_effect.get(feature.tool, 0),
                }
                if self.ago is not None:
                    found["measured_at"] = self._measured_at(part)
                if part in without_server:
                    kept.append(found)
                    continue
                while kept:
                    self.call("POST", "/readings", **kept.pop(0))
                answer = self.call("POST", "/readings", **found)
                stopped = stopped or answer["action"] == "stop"
                if wait == 0 and takes:
                    self._apply(feature.tool, in_effect)
            if wait and part % wait == 0:
                for tool in sorted({each.tool for each in process.every} - {UNMAPPED}):
                    self._apply(tool, in_effect)
            self.between(part)
            if part not in without_server:
                self.behind(part)

        return self.outcome()

    def _measured_at(self, part: int) -> str:
        assert self.ago is not None
        return (datetime.now(UTC) - timedelta(minutes=self.ago(part))).isoformat()

    def _apply(self, tool: int, in_effect: dict[int, int]) -> None:
        if tool == UNMAPPED:
            return
        place = self.process.place_of(tool)
        for each in self.call("GET", f"/machines/{self.machine}/corrections?status=pending&limit=1000")["items"]:
            if each["tool_memory"] == tool:
                self.process.offsets[place] = each["offset_expected"]
                self.call(
                    "POST",
                    f"/corrections/{self.machine}/{each['number']}/applied",
                    offset_after=each["offset_expected"],
                )
                in_effect[tool] = each["number"]

    # --- over a bridge

    def over_bridge(
        self,
        url: str,
        secret: str,
        folder: Path,
        verify: ssl.SSLContext | bool = True,
        without_server: range = range(0),
    ) -> Outcome:
        """The same through the simulated control of this kind and the tasks of the bridge. without_server: parts of an outage."""
        self.without_server = without_server
        with ThreadPoolExecutor(1) as pool:  # whoever calls may have a loop of its own
            pool.submit(lambda: asyncio.run(self._bridged(url, secret, folder, verify))).result()
        return self.outcome()

    async def _bridged(self, url: str, secret: str, folder: Path, verify: ssl.SSLContext | bool) -> None:
        more = {"secure": False} if self.kind == "opcua" else {}
        simulator = await simulator_named(self.kind).serve(self.process, 0, **more)
        table = dict(simulator.table())
        table.pop("secret_file", None)
        table |= {
            "secret": secret,
            "proof_needed": False,
            "interval": 0.02,
            "offsets_every": 1e6,  # a tool change is told, and the new offset is set, between two looks
            "patience": PATIENCE,
            "corrections": self.corrections,
            "characteristics": {str(number): key for number, key in self.keys.items()},
        }
        if self.kind == "haas":
            simulator.latency = 0.0
            table["haas"] = table["haas"] | {"pause": 0.0}
        content = {
            "server": {"url": url},
            "store": {"file": "outcome.sqlite3"},
            "machine": {self.machine: table},
        }
        [machine] = configuration_from(content, folder).machines
        store = Store(folder / "outcome.sqlite3")
        unit = Unit(machine, link_of(machine), store)
        self.process.mail_wait, self.process.more = PATIENCE, lambda: bool(unit.offered)
        task = asyncio.create_task(control_side.run(unit))
        try:
            async with (
                AsyncClient(url, secret, patience=PATIENCE, verify=verify) as client,
                AsyncClient(NOBODY, secret, patience=0.0) as silent,
            ):
                for part in range(1, self.parts + 1):
                    await self._part()
                    await self._stored(unit)
                    self._backdate(folder / "outcome.sqlite3", part)
                    if part in self.without_server:
                        await self._kept(unit, silent)
                        continue
                    await self._settled(unit, client)
                    self.between(part)
                    self.behind(part)
                    if part in {self.parts // 3, self.parts // 2, self.parts * 2 // 3 + LEFT}:
                        await self._settled(unit, client)
                await client.heartbeat(self.machine, **await server_side.heartbeat(unit))
        finally:
            await ended([task])
            await simulator.stop()
            store.close()

    async def _part(self) -> None:
        registers = self.process.registers
        for _ in self.process.part():
            full = registers[Register.WRITTEN] - registers[Register.ACK] >= SLOTS
            await asyncio.sleep(0.02 if full or self.process.idle else 0)

    async def _stored(self, unit: Unit) -> None:
        """What has been measured is in the bridge's store."""

        async def stored() -> bool:
            [rows] = await unit.store._run(  # noqa: SLF001 - a benchmark counts what is there
                lambda database: database.execute("SELECT count(*) FROM reading").fetchone()
            )
            return bool(rows >= len(self.process.written))

        await _until(stored, "all readings are in the store")

    def _backdate(self, store: Path, part: int) -> None:
        """Let the readings of this part have been measured as long ago as `ago` says."""
        if self.ago is None:
            return
        with contextlib.closing(sqlite3.connect(store, timeout=PATIENCE)) as database, database:
            rows = database.execute("SELECT id, body FROM reading WHERE state = 'waiting'").fetchall()
            for number, body in rows[-len(self.process.features) :]:
                moved = json.dumps(json.loads(body) | {"measured_at": self._measured_at(part)})
                database.execute("UPDATE reading SET body = ? WHERE id = ?", [moved, number])

    async def _kept(self, unit: Unit, silent: AsyncClient) -> None:
        """A part while no server answers: the bridge tries, and keeps what it has."""
        for step in (offering.tell, server_side._forward, offering.ask):  # noqa: SLF001 - the steps of the task
            with contextlib.suppress(Unavailable):
                await step(unit, silent)

    async def _settled(self, unit: Unit, client: AsyncClient) -> None:
        """What has been measured is at the server, what it wants is with the control: a part takes longer than that."""
        registers = self.process.registers
        for _ in range(3):
            for step in (offering.tell, server_side._forward, offering.ask):  # noqa: SLF001 - the steps of the task
                await step(unit, client)
            await _until(partial(_polled, unit, unit.polls + 2), "two polls")
            if not await unit.store.intents(unit.machine.key, "answered"):
                break
        if unit.orders and self.corrections == "control":
            await _until(lambda: registers[Register.MAIL_NUMBER] != registers[Register.ANSWERED], "mail")


def _polled(unit: Unit, polls: int) -> bool:
    return unit.polls > polls


async def _until(met: Callable[[], Awaitable[bool] | bool], what: str) -> None:
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        found = met()
        if await found if isinstance(found, Awaitable) else found:
            return
        await asyncio.sleep(0.01)
    raise AssertionError(f"{what}: not within {PATIENCE:g} s")


def _seconds(moment: str) -> float:
    return datetime.fromisoformat(moment).timestamp()


HEAD = f"{'':12} {'out':>6} {'faults':>6} {'worst µm':>8} {'ratio':>6} {'issued':>7} {'applied':>8} {'age s':>8}"
"""Out of tolerance, and of these the ones that are in where each correction is applied at once: by the loop's fault."""
MEASURE_ONLY = {
    "dprnt": "the control prints and takes nothing",
    "folder": "files of a measuring machine",
    "text": "lines of a gauge",
    "mtconnect": "the agent names the part of readings that come another way",
}


def shown(name: str, found: Outcome, ideal: Outcome) -> str:
    """A line of the table."""
    return (
        f"{name:12} {len(found.out):6d} {len(found.faults(ideal)):6d} {1000 * found.worst:8.2f} {found.worst / ideal.worst:6.2f}"
        f" {found.issued:7d} {found.applied:8d} {found.age:8.2f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--parts", type=int, default=300)
    parser.add_argument("--kind", choices=["rest", *sorted(KINDS)], help="all, one after the other, if left out")
    chosen = parser.parse_args()
    logging.getLogger("app.bridge").setLevel(logging.ERROR)  # alarms of a part are no news here
    kinds = [chosen.kind] if chosen.kind else ["rest", *sorted(KINDS)]
    failed = []
    with plant() as running, tempfile.TemporaryDirectory(prefix="inband-outcome-") as folder:
        client = httpx.Client(
            base_url=f"{running.url}/api/v1", headers={"Authorization": f"Bearer {running.key}"}, timeout=60
        )

        def call(method: str, path: str, **body: Any) -> Any:
            answer = client.request(method, path, json=body or None)
            answer.raise_for_status()
            return answer.json()

        ideal = Play(call, "ideal", "rest", chosen.parts)
        ideal.set_up()
        best = ideal.at_once()
        print(
            f"{chosen.parts} parts, {len(OWNERS)} characteristics, {len(set(OWNERS))} tools; beside the same corrected at once"
        )
        print(HEAD)
        print(shown("at once", best, best), flush=True)
        for kind in kinds:
            play = Play(call, f"by-{kind}", kind, chosen.parts)
            secret = play.set_up()
            own = Path(folder, kind)
            own.mkdir()
            found = play.at_once(wait=1) if kind == "rest" else play.over_bridge(running.url, secret, own)
            print(shown(kind, found, best), flush=True)
            if found.faults(best) or found.worst > WORST * best.worst:
                failed.append(kind)
    for kind, why in MEASURE_ONLY.items() if chosen.kind is None else ():
        print(
            f"{kind:12} carries no corrections ({why}): parts as without the loop; readings: python -m bench.bridge_faults"
        )
    if failed:
        raise SystemExit(f"Parts are out by the loop's fault, or worse than {WORST:g} times: {', '.join(failed)}.")


if __name__ == "__main__":
    main()
