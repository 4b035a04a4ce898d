"""A bridge with many machines: processor, memory, and the time from the NC's write until the server has the reading.

Simulated controls, each with a reading a second, run in a process of their own, the server in another; measured is the
bridge's process alone. ``python -m bench.bridge [--machines 100] [--kind opcua] [--interval 0.25] [--seconds 30]``
"""

import argparse
import asyncio
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from datetime import datetime
from pathlib import Path
from typing import Any

import httpx

from app.bridge.simulators import simulator_named
from app.bridge.simulators.model import Model
from app.cli.bridge import toml_of
from app.core.ring import SLOTS, Register
from bench.plant import PARAMETERS, median, plant

WARM = 20.0  # s
TICKS = os.sysconf("SC_CLK_TCK")
CYCLE = 1.0  # s between readings of a machine


async def simulate(kind: str, machines: int) -> None:
    """Run the controls until standard input ends; then tell when each reading was written."""
    module = simulator_named(kind)
    options: dict[str, Any] = {"secure": False} if kind == "opcua" else {}
    features = getattr(module, "FEATURES", Model().features)
    models = [Model(features, seed=number) for number in range(machines)]
    simulators = [await module.serve(model, 0, **options) for model in models]
    print(json.dumps([simulator.table() for simulator in simulators]), flush=True)
    times: list[list[float]] = [[] for _ in models]

    async def parts(number: int) -> None:
        await asyncio.sleep(random.random())
        while True:
            began = time.monotonic()
            for _ in models[number].part():
                registers = models[number].registers
                if registers[Register.WRITTEN] - registers[Register.ACK] >= SLOTS:
                    await asyncio.sleep(0.05)
            times[number].append(time.time())
            await asyncio.sleep(max(0.0, CYCLE - (time.monotonic() - began)))

    tasks = [asyncio.create_task(parts(number)) for number in range(machines)]
    await asyncio.to_thread(sys.stdin.read)
    for task in tasks:
        task.cancel()
    print(json.dumps(times), flush=True)


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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machines", type=int, default=100)
    parser.add_argument("--kind", default="opcua")
    parser.add_argument("--interval", type=float, default=0.25)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--simulate", action="store_true", help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.simulate:
        asyncio.run(simulate(chosen.kind, chosen.machines))
        return
    command = [
        sys.executable,
        "-m",
        "bench.bridge",
        "--simulate",
        "--kind",
        chosen.kind,
        "--machines",
        str(chosen.machines),
    ]
    with plant() as running, tempfile.TemporaryDirectory(prefix="inband-bench-bridge-") as folder:
        client = httpx.Client(
            base_url=f"{running.url}/api/v1", headers={"Authorization": f"Bearer {running.key}"}, timeout=60
        )
        controls = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert controls.stdin is not None
        assert controls.stdout is not None
        text = f'[server]\nurl = "{running.url}"\n\n'
        for number, table in enumerate(json.loads(controls.stdout.readline())):
            table.pop("secret_file", None)
            table |= {
                "secret": set_up(client, number),
                "characteristics": {"1": f"c{number}"},
                "interval": chosen.interval,
                "proof_needed": False,
            }
            text += toml_of(f"m{number}", table) + "\n\n"
        file = Path(folder) / "plant.toml"
        file.write_text(text, encoding="utf-8")
        with (Path(folder) / "log").open("wb") as log:
            bridge = subprocess.Popen([sys.executable, "-m", "app", "bridge", "--config", str(file)], stderr=log)
            time.sleep(WARM)
            before, began = processor(bridge.pid), time.monotonic()
            time.sleep(chosen.seconds)
            used = (processor(bridge.pid) - before) / (time.monotonic() - began)
            held = memory(bridge.pid)
            time.sleep(1)
            controls.stdin.close()
            times = json.loads(controls.stdout.readline())
            bridge.terminate()
            bridge.wait(60)
            controls.wait(60)
        delays: list[float] = []
        for number, written in enumerate(times):
            page = client.get("/readings", params={"characteristic": f"c{number}", "order": "oldest", "limit": 1000})
            arrived = [datetime.fromisoformat(each["received_at"]).timestamp() for each in page.json()["items"]]
            delays += [there - here for here, there in zip(written, arrived, strict=False)][int(WARM) :]
    delays.sort()
    print(
        f"{chosen.machines} machines of kind {chosen.kind}, a reading a second each, polled every {chosen.interval:g} s:"
    )
    print(f"  processor  {100 * used:6.1f} % of one core (wanted: below 20)")
    print(f"  memory     {held:6.1f} MB (wanted: below 150)")
    print(
        f"  from the NC's write to the server: median {median(delays):.2f} s, 95 % {delays[int(0.95 * len(delays))]:.2f} s"
        f" (wanted: within {2 * chosen.interval:g} s), {len(delays)} readings"
    )


if __name__ == "__main__":
    main()
