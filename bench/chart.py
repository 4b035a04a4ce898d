"""Opening the zone chart of a characteristic with ten million readings against one with ten thousand, over HTTP.

Both charts are asked for in turn; what is printed is the ratio of the medians, and whether every extreme is on the large
one. ``python -m bench.chart [--large 10000000] [--small 10000] [--rounds 60]``
"""

import argparse
import sys
import time
from typing import Any

import httpx
import psycopg

from bench.plant import PARAMETERS, Plant, median, plant
from bench.readings import fill

WANTED = 3.0


def set_up(at: Plant, client: httpx.Client, machine: str, count: int) -> dict[int, float]:
    """A machine with one characteristic of so many readings; the extremes by sequence (mm)."""
    client.post("/machines", json={"key": machine, "name": machine, "control": "other"}).raise_for_status()
    body = {"key": machine, "name": machine, "machine": machine, "parameters": PARAMETERS | {"tool_memory": 3}}
    client.post("/characteristics", json=body).raise_for_status()
    begun = time.perf_counter()
    with psycopg.connect(at.dsn, autocommit=True) as connection:
        extremes = fill(connection, machine, count)
    print(f"{count:>10,} readings made in {time.perf_counter() - begun:.0f} s", file=sys.stderr)
    return extremes


def charted(figure: dict[str, Any]) -> list[str]:
    """All that the figure says in words about its points: the extremes are told there in µm."""
    return [text for trace in figure["data"] for text in trace.get("text") or ()]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--large", type=int, default=10_000_000)
    parser.add_argument("--small", type=int, default=10_000)
    parser.add_argument("--rounds", type=int, default=60)
    arguments = parser.parse_args()
    with (
        plant() as at,
        httpx.Client(base_url=f"{at.url}/api/v1", headers={"Authorization": f"Bearer {at.key}"}, timeout=60) as client,
    ):
        set_up(at, client, "small", arguments.small)
        extremes = set_up(at, client, "large", arguments.large)
        with psycopg.connect(at.dsn, autocommit=True) as connection:
            connection.execute("VACUUM ANALYZE")
        answers: dict[tuple[str, str], httpx.Response] = {}
        print("last   scale    10 thousand ms  10 million ms  ratio (wanted <= 3)   KB")
        for last, scale in (("all", "zones"), ("all", "true"), ("1000", "zones"), ("50", "zones")):
            times: dict[str, list[float]] = {"small": [], "large": []}
            for turn in range(arguments.rounds + 3):
                for name, milliseconds in times.items():
                    begun = time.perf_counter()
                    answer = client.get(f"/characteristics/{name}/figures/zones", params={"last": last, "scale": scale})
                    answer.raise_for_status()
                    if turn >= 3:  # the first ones warm up
                        milliseconds.append((time.perf_counter() - begun) * 1000)
                    answers[name, last] = answer
            small, large = median(times["small"]), median(times["large"])
            size = len(answer.content) / 1024
            print(
                f"{last:<6} {scale:<6}  {small:>14.1f}  {large:>13.1f}  {large / small:>5.2f}             {size:>8.0f}"
            )
        words = " ".join(charted(answers["large", "all"].json()))
        missing = [d for d in extremes.values() if f"{abs(d) * 1000:.1f}" not in words]
        print(f"extremes on the chart: {len(extremes) - len(missing)} of {len(extremes)}")
        if missing:
            raise SystemExit(f"not on the chart: {missing}")


if __name__ == "__main__":
    main()
