"""Durable single readings over HTTP against pgbench running the same transaction on the same server.

pgbench: `-M prepared`, five statements: begin, lock the state, insert the reading, update the state, commit. Rounds are
interleaved; what is printed is the median of the rounds' ratios. ``python -m bench.single [--seconds 4] [--rounds 5]``
"""

import argparse
import json
import re
import subprocess
import sys
from pathlib import Path
from tempfile import NamedTemporaryFile

import psycopg

from bench.plant import Plant, median, plant

SPREAD = 200
WANTED = {1: 0.5, 16: 0.9, 64: 1.5}
WANTED_AT_ONE = 5.0
# The same tables, the same indexes; characteristics of a machine of pgbench's own.
SCRIPT = r"""
\set c random(:first, :last)
BEGIN;
SELECT sequence + 1 AS s FROM stream WHERE machine_id = :machine AND characteristic_id = :c FOR UPDATE \gset
INSERT INTO reading (machine_id, characteristic_id, sequence, measured, deviation, decided, average_before, average_after,
    measured_at, received_at, parameters_version, late, zone, action, code, key, part)
VALUES (:machine, :c, :s, 39.9921, 0.0001, 0.0001, 0.0, 0.0, now(), now(), 1, false, 'zero', 'none', 'within_zero_range',
    'pgbench-' || :s, 'SN-' || :s);
UPDATE stream SET sequence = :s, last_measured_at = now(), last_received_at = now(), last_measured = 39.9921,
    last_deviation = 0.0001, last_average = 0, last_zone = 'zero' WHERE machine_id = :machine AND characteristic_id = :c;
COMMIT;
"""
PREPARE = """
WITH m AS (INSERT INTO machine (key, name, control) VALUES ('pgbench', 'pgbench', 'other') RETURNING id),
c AS (INSERT INTO characteristic (machine_id, key, name)
      SELECT id, 'p' || g, 'pgbench' FROM m, generate_series(1, %s) g RETURNING machine_id, id)
INSERT INTO stream (machine_id, characteristic_id, parameters_version, tool_memory, average_memory)
SELECT machine_id, id, 1, 0, 0 FROM c RETURNING machine_id, characteristic_id
"""


def ours(at: Plant, connections: int, seconds: float, spread: int, run: str) -> dict[str, float]:
    out = subprocess.run(
        [sys.executable, "-m", "bench.load", str(at.port), at.key, str(connections), str(seconds), str(spread), run],
        check=True,
        capture_output=True,
    )
    result = json.loads(out.stdout)
    quantiles = result["quantiles"]
    return {"rate": result["rate"], "p50": quantiles["0.5"], "p99": quantiles["0.99"]}


def theirs(at: Plant, script: str, place: tuple[int, int, int], connections: int, seconds: float, one: bool) -> float:
    machine, first, last = place
    out = subprocess.run(
        [
            *(
                str(at.binaries / "pgbench"),
                "-n",
                "-M",
                "prepared",
                "-c",
                str(connections),
                "-j",
                str(min(connections, 2)),
            ),
            *("-T", str(round(seconds)), "-f", script, "-D", f"machine={machine}", "-D", f"first={first}"),
            *("-D", f"last={first if one else last}", at.dsn),
        ],
        check=True,
        capture_output=True,
        text=True,
    )
    match = re.search(r"tps = ([\d.]+)", out.stdout)
    assert match is not None, out.stdout
    return float(match[1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=4)
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    with plant(SPREAD) as at, NamedTemporaryFile("w", suffix=".sql") as script:
        script.write(SCRIPT)
        script.flush()
        Path(script.name).chmod(0o644)
        with psycopg.connect(at.dsn, autocommit=True) as connection:
            rows = connection.execute(PREPARE, [SPREAD]).fetchall()
            connection.execute("VACUUM ANALYZE")
        place = (rows[0][0], min(row[1] for row in rows), max(row[1] for row in rows))
        ours(at, 16, 2, SPREAD, "warm")
        theirs(at, script.name, place, 16, 2, False)
        print("connections  ours/s  pgbench/s  ratio (wanted)   p50 ms  p99 ms  p99/p50 (wanted <= 3)")
        for connections, spread in ((1, SPREAD), (16, SPREAD), (64, SPREAD), (64, 1)):
            ratios, rates, others, p50s, p99s = [], [], [], [], []
            for turn in range(arguments.rounds):
                mine = ours(at, connections, arguments.seconds, spread, f"{connections}-{spread}-{turn}")
                other = theirs(at, script.name, place, connections, arguments.seconds, spread == 1)
                ratios.append(mine["rate"] / other)
                rates.append(mine["rate"])
                others.append(other)
                p50s.append(mine["p50"] / 1000)
                p99s.append(mine["p99"] / 1000)
            goal = WANTED_AT_ONE if spread == 1 else WANTED[connections]
            print(
                f"{connections:>3} on {spread:>3}   {median(rates):>7.0f}  {median(others):>8.0f}   {median(ratios):>5.2f} ({goal})"
                f"      {median(p50s):>6.2f}  {median(p99s):>6.2f}  {median([b / a for a, b in zip(p50s, p99s, strict=True)]):>5.2f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
