"""Batches of 10,000 readings over HTTP against a binary COPY of the same rows into the same table.

Each round pushes a batch, takes its rows out again as a binary COPY stream, and copies that stream, made ready in memory,
back into `reading` under another characteristic. Printed is the median of the rounds' ratios COPY time / batch time.
``python -m bench.batch [--rounds 15]``
"""

import argparse
import time

import httpx
import msgspec
import psycopg

from bench.plant import TARGET, Plant, median, plant

SIZE = 10_000
WANTED = 0.4
COLUMNS = """machine_id, {characteristic}, sequence, measured, deviation, decided, average_before, average_after, measured_at,
    received_at, machined_at, parameters_version, correction_in_effect, correction, paused_by, late, zone, action, code,
    key, part, outstanding, alarms"""
SHADOW = 1_000_000


def batch(number: int) -> bytes:
    """Readings of a process in control, as a machine that was off the network for a while sends them."""
    return msgspec.json.encode(
        [
            {
                "characteristic": "c1",
                "measured": round(TARGET + 0.0001 * ((i * 31) % 19 - 9), 4),
                "measured_at": "2026-11-21T08:15:02.120+01:00",
                "part": f"SN-{i}",
                "key": f"{number}:{i}",
            }
            for i in range(SIZE)
        ]
    )


def ours(client: httpx.Client, body: bytes) -> float:
    begun = time.perf_counter()
    client.post("/readings/batch", content=body, headers={"Content-Type": "application/json"}).raise_for_status()
    return time.perf_counter() - begun


def theirs(connection: psycopg.Connection[tuple[object, ...]], first: int) -> float:
    out = f"COPY (SELECT {COLUMNS.format(characteristic=SHADOW)} FROM reading WHERE sequence >= {first} AND characteristic_id < {SHADOW}) TO STDOUT (FORMAT BINARY)"  # noqa: S608 - constants
    with connection.cursor() as cursor:
        with cursor.copy(out) as copy:
            rows = b"".join(bytes(block) for block in copy)
        begun = time.perf_counter()
        into = f"COPY reading ({COLUMNS.format(characteristic='characteristic_id')}) FROM STDIN (FORMAT BINARY)"
        with cursor.copy(into) as copy:
            copy.write(rows)
    connection.commit()
    return time.perf_counter() - begun


def measure(at: Plant, rounds: int) -> None:
    headers = {"Authorization": f"Bearer {at.key}"}
    with (
        httpx.Client(base_url=f"{at.url}/api/v1", headers=headers, timeout=120) as client,
        psycopg.connect(at.dsn) as connection,
    ):
        took, copied = [], []
        for number in range(rounds + 1):
            one = ours(client, batch(number))
            other = theirs(connection, number * SIZE + 1)
            if number:  # the first is for warming up
                took.append(one)
                copied.append(other)
    ratio = median([b / a for a, b in zip(took, copied, strict=True)])
    print(f"batch of {SIZE}: {SIZE / median(took):,.0f} readings/s, binary COPY {SIZE / median(copied):,.0f} rows/s")
    print(f"ratio {ratio:.2f} (wanted >= {WANTED})")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=15)
    arguments = parser.parse_args()
    with plant(1) as at:
        measure(at, arguments.rounds)


if __name__ == "__main__":
    main()
