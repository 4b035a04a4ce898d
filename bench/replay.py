"""The closed loop of a what-if replay, compiled, against the same loop in plain Python; then a map of settings, in a click.

Plain Python is measured twice: `app.core.replay.followed`, which calls `decide` for each reading as the server does, and the
very source of the compiled loop, uncompiled. Each must agree with the compiled loop bit for bit.
``python -m bench.replay [--readings 100000] [--rounds 5]``
"""

import argparse
import time
from collections.abc import Callable
from typing import Any

import httpx
import numpy as np
import psycopg

from app.core import closed_loop, replay
from app.core.closed_loop import CODES, ZONES, Count, Course, Mark, Total
from app.core.compiled import plain
from app.core.parameters import Parameters
from app.core.policy_map import with_settings
from app.core.replay import Lane, Policy, figures_of, followed, run, undisturbed
from app.whatif.turns import on_all_cores
from bench.plant import PARAMETERS, plant
from bench.readings import fill

WANTED_FASTER = 30.0
STEPS = 20


def seconds(task: Callable[[], Any], rounds: int) -> float:
    """The shortest time of some rounds: what else runs on the machine only ever adds."""
    times = []
    for _ in range(rounds):
        begun = time.perf_counter()
        task()
        times.append(time.perf_counter() - begun)
    return min(times)


def uncompiled(way: closed_loop.Way, policy: Policy) -> Course:
    """The source of the compiled loop, run by the interpreter; the columns as lists, which it is faster on."""
    columns: list[Any] = [*(column.tolist() for column in way[:-1]), way.averages]
    course: list[Any] = [column.tolist() for column in Course.room(len(way.free))]
    counts: Any = [0] * len(Count)
    sums: Any = [0.0] * len(Total)
    numbers, limits = replay._rows(policy)  # noqa: SLF001
    loop, rounding = plain(closed_loop._follow), closed_loop._round9  # noqa: SLF001 - what is measured
    closed_loop._round9 = plain(rounding)  # noqa: SLF001
    try:
        loop(
            closed_loop.Way(*columns),
            numbers,
            limits,
            policy.delay,
            Course(*course),
            counts,
            sums,
        )
    finally:
        closed_loop._round9 = rounding  # noqa: SLF001
    return Course(*map(np.array, course))


def recursion(count: int, rounds: int) -> None:
    rng = np.random.default_rng(1)
    free = np.round(np.cumsum(rng.normal(0.00002, 0.00001, count)) % 0.2 + rng.normal(0, 0.0014, count), 6)
    way = undisturbed(free)
    way.marks[::5000] |= Mark.BEGIN
    begins = int((way.marks & Mark.BEGIN > 0).sum())
    way = way._replace(offset=np.zeros(begins), pending=np.zeros(begins), averages=np.zeros((begins, 1)))
    parameters = Parameters(
        target=39.992,
        tolerance_width=0.016,
        zero_range=0.001,
        averaging_limit=0.0053,
        wear_limit=0.3,
        confidence_limit=1.0,
        weighting_factor=2,
        factor=-1,
        tool_memory=3,
        average_memory=1,
    )
    policy = Policy((Lane(parameters, response=1.0),), delay=2)
    course, figures = run(way, policy)  # compiled, or read from the cache
    rows = list(followed(way, policy))
    told = [(*map(float, row), ZONES[zone], CODES[code]) for *row, zone, code in zip(*course, strict=True)]
    other = uncompiled(way, policy)
    same = told == rows and all((np.asarray(a) == np.asarray(b)).all() for a, b in zip(course, other, strict=True))
    print(f"{count:,} readings, {figures.corrections:,} corrections; equal bit for bit: {'yes' if same else 'NO'}")
    compiled = seconds(lambda: run(way, policy), 5 * rounds)
    print(f"compiled                      {compiled * 1000:8.1f} ms  {compiled / count * 1e9:6.0f} ns a reading")
    for name, task in (
        ("plain Python, decide()", lambda: sum(1 for _ in followed(way, policy))),
        ("plain Python, the same source", lambda: uncompiled(way, policy)),
    ):
        taken = seconds(task, max(1, rounds // 2))
        print(f"{name:<29} {taken * 1000:8.0f} ms  ratio {taken / compiled:,.0f} (wanted >= {WANTED_FASTER:g})")
    choices = [
        policy.with_(lambda p, k=k, r33=r33: with_settings(p, weighting_factor=k, zero_range=r33))  # type: ignore[misc]
        for k in np.linspace(1, 20, STEPS).tolist()
        for r33 in np.round(np.linspace(0, 0.005, STEPS), 6).tolist()
    ]
    taken = seconds(lambda: on_all_cores(lambda share: figures_of(way, share), choices), rounds)
    print(
        f"map of {STEPS} x {STEPS} settings: {taken:.2f} s, {len(choices) * count / taken / 1e6:.0f} million decisions a second"
    )
    if not same:
        raise SystemExit("the loops do not agree")


def over_http(count: int, rounds: int) -> None:
    """The same as a user meets it: readings out of PostgreSQL, the process rebuilt, 400 replays, the answer as JSON."""
    with (
        plant() as at,
        httpx.Client(base_url=f"{at.url}/api/v1", headers={"Authorization": f"Bearer {at.key}"}, timeout=120) as client,
    ):
        client.post("/machines", json={"key": "m", "name": "m", "control": "other"}).raise_for_status()
        body = {"key": "c", "name": "c", "machine": "m", "parameters": PARAMETERS | {"tool_memory": 3}}
        client.post("/characteristics", json=body).raise_for_status()
        with psycopg.connect(at.dsn, autocommit=True) as connection:
            fill(connection, "c", count)
            connection.execute("VACUUM ANALYZE")
        asked = {
            "last": count,
            "weighting_factors": np.linspace(1, 20, STEPS).tolist(),
            "zero_ranges": np.round(np.linspace(0, 0.005, STEPS), 6).tolist(),
        }
        times = []
        for _ in range(rounds + 1):
            begun = time.perf_counter()
            client.post("/characteristics/c/what-if/map", json=asked).raise_for_status()
            times.append(time.perf_counter() - begun)
        print(f"the map by request and answer: first {times[0]:.2f} s, then {min(times[1:]):.2f} s")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--readings", type=int, default=100_000)
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    recursion(arguments.readings, arguments.rounds)
    over_http(arguments.readings, arguments.rounds)


if __name__ == "__main__":
    main()
