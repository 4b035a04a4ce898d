"""A bridge with many machines: processor, memory, and the time from the NC's write until the bridge has the decision.

Simulated controls, each with a reading a second, run in a process of their own, the server in another; measured is the
bridge's process alone. Those of kind opcua are made for this, at a small cost (`bench.fleet`); the others are the simulators of
``inband bridge simulate``. ``python -m bench.bridge [--machines 100] [--kind opcua] [--interval 0.25] [--seconds 30]``
"""

import argparse
import asyncio
import json
import os
import random
import sqlite3
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx

from app.core.ring import SLOTS, Register
from app.simulators.controls import simulator_named
from app.simulators.controls.model import Model
from app.simulators.controls.toml_text import toml_of
from bench.fleet import Fleet
from bench.plant import PARAMETERS, TARGET, median, plant

LONGEST_START = 180.0  # s
TICKS = os.sysconf("SC_CLK_TCK")
CYCLE = 1.0  # s between readings of a machine
WEAR, NOISE = 0.00003, 0.0002  # mm a part, mm: a correction about each half minute
TAIL = 2.0  # s: readings so near the end may still be on their way


async def started(kind: str, models: list[Model]) -> tuple[list[dict[str, object]], list[Any]]:
    """Start the controls; a table of the configuration for each, and what has to be stopped."""
    if kind == "opcua":
        fleet = Fleet(models)
        await fleet.start()
        return fleet.tables, []
    module = simulator_named(kind)
    simulators: list[Any] = []
    for model in models:
        one_broker = [f"127.0.0.1:{simulators[0].port}"] if kind == "mqtt" and simulators else []
        simulators.append(await module.serve(model, 0, *one_broker))
    return [simulator.table() for simulator in simulators], simulators


async def simulate(kind: str, machines: int) -> None:
    """Run the controls until standard input ends; then tell when each part's reading was written."""
    features = Model().features if kind == "opcua" else getattr(simulator_named(kind), "FEATURES", Model().features)
    features = tuple(replace(each, nominal=TARGET, bias=0.0, wear=WEAR, noise=NOISE) for each in features)
    models = [Model(features, serial=f"SIM-{number:04}", seed=number) for number in range(machines)]
    tables, running = await started(kind, models)
    print(json.dumps(tables), flush=True)
    times: list[dict[int, float]] = [{} for _ in models]

    async def parts(number: int) -> None:
        model = models[number]
        await asyncio.sleep(random.random())
        while True:
            began = time.monotonic()
            for _ in model.part():
                if model.registers[Register.WRITTEN] - model.registers[Register.ACK] >= SLOTS:
                    await asyncio.sleep(0.05)
            times[number][model.parts] = time.time()
            await asyncio.sleep(max(0.0, CYCLE - (time.monotonic() - began)))

    tasks = [asyncio.create_task(parts(number)) for number in range(machines)]
    await asyncio.to_thread(sys.stdin.read)
    for task in tasks:
        task.cancel()
    print(json.dumps(times), flush=True)
    for simulator in running:
        await simulator.stop()


def processor(pid: int) -> float:
    """Seconds of processor that a process has had."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def memory(pid: int) -> float:
    """Resident memory of a process, MB."""
    lines = Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024


def set_up(client: httpx.Client, number: int) -> str:
    """A machine with a characteristic; the secret of its key."""
    key = f"m{number}"
    client.post("/machines", json={"key": key, "name": key, "control": "other"}).raise_for_status()
    parameters = PARAMETERS | {"tool_memory": 3, "average_memory": 5}
    body = {"key": f"c{number}", "name": key, "machine": key, "parameters": parameters}
    client.post("/characteristics", json=body).raise_for_status()
    return str(client.post(f"/machines/{key}/keys", json={"name": "bench"}).raise_for_status().json()["secret"])


def sent(store: Path) -> list[tuple[str, str | None, str, float | None]]:
    """Machine, part, state and time of every reading in the bridge's store."""
    with sqlite3.connect(f"file:{store}?mode=ro", uri=True) as database:
        return database.execute(
            "SELECT machine, json_extract(body, '$.part'), state, sent_at FROM reading ORDER BY id"
        ).fetchall()


def taken(store: Path) -> int:
    """Corrections that controls have applied."""
    with sqlite3.connect(f"file:{store}?mode=ro", uri=True) as database:
        return int(database.execute("SELECT count(*) FROM intent WHERE applied").fetchone()[0])


def wait_for_all(store: Path, machines: int, bridge: subprocess.Popen[bytes]) -> None:
    """Until the server has had a reading of each machine."""
    end = time.monotonic() + LONGEST_START
    while time.monotonic() < end and bridge.poll() is None:
        if store.exists() and len({row[0] for row in sent(store) if row[2] == "sent"}) == machines:
            return
        time.sleep(1)
    raise SystemExit("the bridge did not bring a reading of each machine")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machines", type=int, default=100)
    parser.add_argument("--kind", default="opcua")
    parser.add_argument("--interval", type=float, default=0.25)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument(
        "--profile", help="write a profile of the bridge to this file; its processor time is worthless then"
    )
    parser.add_argument("--simulate", action="store_true", help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.simulate:
        asyncio.run(simulate(chosen.kind, chosen.machines))
        return
    this = [sys.executable, "-m", "bench.bridge", "--simulate"]
    command = [*this, "--kind", chosen.kind, "--machines", str(chosen.machines)]
    with plant() as running, tempfile.TemporaryDirectory(prefix="inband-bench-bridge-") as folder:
        client = httpx.Client(
            base_url=f"{running.url}/api/v1", headers={"Authorization": f"Bearer {running.key}"}, timeout=60
        )
        controls = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert controls.stdin is not None
        assert controls.stdout is not None
        text = f'[server]\nurl = "{running.url}"\n\n[store]\nfile = "store.sqlite3"\n\n'
        for number, table in enumerate(json.loads(controls.stdout.readline())):
            table.pop("secret_file", None)
            table |= {
                "secret": set_up(client, number),
                "characteristics": {"1": f"c{number}"},
                "interval": chosen.interval,
                "proof_needed": False,
            }
            text += toml_of(f"m{number}", table) + "\n\n"
        file, store = Path(folder) / "plant.toml", Path(folder) / "store.sqlite3"
        file.write_text(text, encoding="utf-8")
        profiled = ["-m", "cProfile", "-o", chosen.profile] if chosen.profile else []
        start = [sys.executable, *profiled, "-m", "app", "bridge", "--config", str(file)]
        with (Path(folder) / "log").open("wb") as log:
            bridge = subprocess.Popen(start, stderr=log)
            try:
                wait_for_all(store, chosen.machines, bridge)
                before, began, beginning = processor(bridge.pid), time.monotonic(), time.time()
                time.sleep(chosen.seconds)
                used = (processor(bridge.pid) - before) / (time.monotonic() - began)
                held = memory(bridge.pid)
                ending = time.time()
                time.sleep(TAIL)
            finally:
                bridge.terminate()
                bridge.wait(60)
                controls.stdin.close()
                times = json.loads(controls.stdout.readline())
                controls.wait(60)
        delays: list[float] = []
        refused = 0
        for machine, part, state, at in sent(store):
            written = times[int(machine[1:])].get(part, 0.0)
            refused += state == "quarantined"
            if beginning <= written <= ending:
                delays.append((at or time.time()) - written)
        corrections = taken(store)
    delays.sort()
    own = "a fleet made for this" if chosen.kind == "opcua" else "the simulators of the program"
    print(
        f"{chosen.machines} machines of kind {chosen.kind} ({own}), a reading a second each,"
        f" polled every {chosen.interval:g} s:"
    )
    print(f"  processor  {100 * used:6.1f} % of one core (wanted: below 20)")
    print(f"  memory     {held:6.1f} MB (wanted: below 150)")
    print(
        f"  from the NC's write to the decision at the bridge: median {median(delays):.2f} s,"
        f" 95 % {delays[int(0.95 * len(delays))]:.2f} s (wanted: within {2 * chosen.interval:g} s)"
    )
    print(
        f"  {len(delays)} readings in {chosen.seconds:g} s, {refused} refused, {corrections} corrections since the start"
    )


if __name__ == "__main__":
    main()
