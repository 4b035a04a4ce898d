"""Memory of the server while a million readings come in, by batches and one by one: it must stay flat.

After every 100,000 readings: resident memory of the server process, and what its own metrics count. Printed at the end is
the growth from the third line to the last, when everything has been in use once.
``python -m bench.memory [--readings 1000000]``
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

import httpx
from prometheus_client.parser import text_string_to_metric_families

from bench.batch import SIZE, batch
from bench.plant import Plant, plant

STEP = 100_000
CHARACTERISTICS = 200
SINGLY = 4.0  # seconds of single readings at 64 connections in every step
WANTED = 1.1


def resident(process: int) -> float:
    """Megabytes."""
    status = Path(f"/proc/{process}/status").read_text()
    return int(status.split("VmRSS:")[1].split()[0]) / 1024


def counted(client: httpx.Client, url: str) -> int:
    answer = client.get(f"{url}/metrics").raise_for_status()
    return int(
        sum(
            sample.value
            for family in text_string_to_metric_families(answer.text)
            if family.name == "inband_readings"
            for sample in family.samples
        )
    )


def singly(at: Plant, run: str) -> int:
    command = [sys.executable, "-m", "bench.load", str(at.port), at.key, "64", str(SINGLY), str(CHARACTERISTICS), run]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE)
    return int(json.loads(done.stdout)["count"])


def measure(at: Plant, readings: int) -> None:
    sizes, sent, batches = [resident(at.process.pid)], 0, 0
    print(f"{sent:>9,} readings  {sizes[0]:6.1f} MB")
    with httpx.Client(headers={"Authorization": f"Bearer {at.key}"}, timeout=120) as client:
        while sent < readings:
            aim = sent + STEP
            sent += singly(at, f"step {aim}")
            while sent < aim:
                body = batch(batches).replace(b'"c1"', b'"c%d"' % (batches % CHARACTERISTICS + 1))
                answer = client.post(f"{at.url}/api/v1/readings/batch", content=body).raise_for_status()
                sent += int(answer.json()["stored"])
                batches += 1
            sizes.append(resident(at.process.pid))
            stored = counted(client, at.url)
            print(f"{sent:>9,} readings  {sizes[-1]:6.1f} MB", flush=True)
            assert stored == sent, f"the metrics count {stored}"
    print(f"{batches} batches of {SIZE}, the others one by one")
    print(f"growth after the first steps {sizes[-1] / sizes[min(2, len(sizes) - 1)]:.2f} (wanted <= {WANTED})")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--readings", type=int, default=1_000_000)
    arguments = parser.parse_args()
    with plant(CHARACTERISTICS) as at:
        measure(at, arguments.readings)


if __name__ == "__main__":
    main()
