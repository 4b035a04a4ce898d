"""Reading a characteristic's whole history into arrays, against the server's own ``COPY … TO '/dev/null'`` of the same rows.

Both walk through the same readings in the order of their sequence; `COPY` writes them as text to nowhere, so what it takes is
what no client can save. Rounds are interleaved. ``python -m bench.history [--readings 1000000] [--rounds 7]``
"""

import argparse
import time
from collections.abc import Callable
from typing import Any

import httpx
import psycopg

from app.db.engine import Database
from app.loop.characteristics.queries import characteristic_named
from app.loop.summaries.queries.history import history_of
from app.loop.summaries.queries.window import window_of
from bench.plant import PARAMETERS, Plant, median, plant
from bench.readings import fill

WANTED = 1.5
CASES = {
    "deviation": ("sequence", "deviation"),
    "what a chart needs": ("sequence", "deviation", "compensated", "measured_at"),
}


def ours(database: Database, names: tuple[str, ...]) -> int:
    with database.begin() as session:
        characteristic = characteristic_named(session, "c").characteristic
        return len(history_of(session, characteristic, window_of(session, characteristic), names[1:]))


def theirs(connection: psycopg.Connection[Any], names: tuple[str, ...]) -> int:
    rows = (
        f"SELECT {', '.join(names)} FROM reading WHERE (machine_id, characteristic_id) = "  # noqa: S608 - of our own names
        "(SELECT machine_id, id FROM characteristic WHERE key = 'c') ORDER BY sequence"
    )
    return connection.execute(f"COPY ({rows}) TO '/dev/null'").rowcount


def seconds(task: Callable[[], int], expected: int) -> float:
    begun = time.perf_counter()
    readings = task()
    if readings != expected:
        raise SystemExit(f"{readings} readings, not {expected}")
    return time.perf_counter() - begun


def measure(at: Plant, count: int, rounds: int) -> None:
    database = Database(at.dsn, pool_size=1)
    with psycopg.connect(at.dsn, autocommit=True) as connection:
        connection.execute("SET statement_timeout = 0")
        fill(connection, "c", count)
        connection.execute("VACUUM ANALYZE")
        print(f"{count:,} readings         COPY ms   into arrays ms   ratio (wanted <= {WANTED:g})")
        for name, columns in CASES.items():
            mine, copies = [], []
            for turn in range(rounds + 1):
                copied = seconds(lambda columns=columns: theirs(connection, columns), count)  # type: ignore[misc]
                own = seconds(lambda columns=columns: ours(database, columns), count)  # type: ignore[misc]
                if turn:  # the first ones warm up
                    copies.append(copied)
                    mine.append(own)
            ratio = median([a / b for a, b in zip(mine, copies, strict=True)])
            print(f"{name:<22} {median(copies) * 1000:10.0f} {median(mine) * 1000:16.0f}   {ratio:.2f}")
    database.close()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--readings", type=int, default=1_000_000)
    parser.add_argument("--rounds", type=int, default=7)
    arguments = parser.parse_args()
    with (
        plant() as at,
        httpx.Client(base_url=f"{at.url}/api/v1", headers={"Authorization": f"Bearer {at.key}"}, timeout=60) as client,
    ):
        client.post("/machines", json={"key": "m", "name": "m", "control": "other"}).raise_for_status()
        body = {"key": "c", "name": "c", "machine": "m", "parameters": PARAMETERS | {"tool_memory": 3}}
        client.post("/characteristics", json=body).raise_for_status()
        measure(at, arguments.readings, arguments.rounds)


if __name__ == "__main__":
    main()
