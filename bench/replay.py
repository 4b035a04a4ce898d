"""The closed loop of a what-if replay, compiled, against the same loop in plain Python; then a map of settings, in a click.

Plain Python is measured twice: `followed`, which calls `decide` for each reading as the server does, and the
very source of the compiled loop, uncompiled. Each must agree with the compiled loop bit for bit.
``python -m bench.replay [--readings 100000] [--rounds 5]``
"""

import argparse
import time
from collections import deque
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import httpx
import numpy as np
import psycopg

from app.core.compiled import plain
from app.core.decision import loops
from app.core.decision.decide import LoopState, decide
from app.core.decision.limits import ZONES
from app.core.decision.loops import LANE, TALLY, Mark, ProcessTrace, ReplayResult
from app.core.decision.step import CODES, Action, effect_of, not_in_size, rounded
from app.core.parameters import Parameters
from app.core.policy_map import with_settings
from app.core.replay import Policy, ReplayedCharacteristic, figures_of, run, without_events
from app.quality.what_if.turn_limit import on_all_cores
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


def uncompiled(trace: ProcessTrace, policy: Policy) -> ReplayResult:
    """The source of the compiled loop, run by the interpreter; the columns as lists, which it is faster on."""
    columns: list[Any] = [*(column.tolist() for column in trace[:-1]), trace.averages]
    result: list[Any] = [column.tolist() for column in ReplayResult.room(len(trace.free))]
    lanes: Any = [SimpleNamespace(**dict(zip(LANE.names or (), lane.row(), strict=True))) for lane in policy.lanes]
    tally = SimpleNamespace(**dict.fromkeys(TALLY.names or (), 0))
    plain(loops.follow)(ProcessTrace(*columns), lanes, policy.delay, loops.EVERY_PART, ReplayResult(*result), tally)
    return ReplayResult(*map(np.array, result))


def followed(trace: ProcessTrace, policy: Policy) -> Iterator[tuple[float, float, float, float, float, str, str]]:
    """Each reading as it comes out and is decided, the columns of `ReplayResult`: what `run` compiles, in plain Python by `decide`."""
    averages: list[float] = []
    waiting: deque[tuple[int, float]] = deque()
    offset = pending = total = 0.0
    held: float | None = None
    begun = 0
    columns = (trace.free.tolist(), trace.lane.tolist(), trace.marks.tolist(), trace.part.tolist())
    for free, which, mark, part in zip(*columns, strict=True):
        lane = policy.lanes[which]
        parameters = lane.parameters
        if mark & Mark.BEGIN:
            offset, pending = float(trace.offset[begun]), float(trace.pending[begun])
            averages = trace.averages[begun].tolist()
            total, held = rounded(offset + pending), None
            waiting.clear()
            if pending:
                waiting.append((part + policy.delay + 1, pending))
            begun += 1
        if mark & Mark.RESTART and lane.memory >= 0:
            averages[lane.memory] = 0.0
        if mark & Mark.RELEASED and held is not None:
            offset, total, held = rounded(offset + held), rounded(total + held), None
        while waiting and waiting[0][0] <= part:
            _due, amount = waiting.popleft()
            offset, pending = rounded(offset + amount), rounded(pending - amount)
        decision = decide(
            parameters,
            LoopState(averages[lane.memory] if lane.memory >= 0 else 0.0, total, bool(mark & Mark.PAUSED)),
            rounded(free + lane.of_size * offset),
            outstanding=effect_of(not_in_size(parameters.rules, total, pending), parameters.factor),
            accepted=not mark & Mark.REJECTED,
            jump=bool(mark & Mark.JUMP),
        )
        if lane.memory >= 0:
            averages[lane.memory] = decision.average_after
        if decision.amount is not None:
            held = decision.amount if decision.action is Action.HOLD else None
            if decision.action is Action.CORRECT:
                total = rounded(total + decision.amount)
                pending = rounded(pending + decision.amount)
                waiting.append((part + policy.delay + 1, decision.amount))
        yield (
            decision.deviation,
            decision.decided,
            decision.average_after,
            decision.amount or 0.0,
            offset,
            decision.zone,
            decision.code,
        )


def decisions(count: int, rounds: int) -> None:
    rng = np.random.default_rng(1)
    free = np.round(np.cumsum(rng.normal(0.00002, 0.00001, count)) % 0.2 + rng.normal(0, 0.0014, count), 6)
    trace = without_events(free)
    trace.marks[::5000] |= Mark.BEGIN
    begins = int((trace.marks & Mark.BEGIN > 0).sum())
    trace = trace._replace(offset=np.zeros(begins), pending=np.zeros(begins), averages=np.zeros((begins, 1)))
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
    policy = Policy((ReplayedCharacteristic(parameters, response=1.0),), delay=2)
    result, figures = run(trace, policy)  # compiled, or read from the cache
    rows = list(followed(trace, policy))
    compiled_rows = [(*map(float, row), ZONES[zone], CODES[code]) for *row, zone, code in zip(*result, strict=True)]
    other = uncompiled(trace, policy)
    same = compiled_rows == rows and all(
        (np.asarray(a) == np.asarray(b)).all() for a, b in zip(result, other, strict=True)
    )
    print(f"{count:,} readings, {figures.corrections:,} corrections; equal bit for bit: {'yes' if same else 'NO'}")
    compiled = seconds(lambda: run(trace, policy), 5 * rounds)
    print(f"compiled                      {compiled * 1000:8.1f} ms  {compiled / count * 1e9:6.0f} ns a reading")
    for name, task in (
        ("plain Python, decide()", lambda: sum(1 for _ in followed(trace, policy))),
        ("plain Python, the same source", lambda: uncompiled(trace, policy)),
    ):
        duration = seconds(task, max(1, rounds // 2))
        print(f"{name:<29} {duration * 1000:8.0f} ms  ratio {duration / compiled:,.0f} (wanted >= {WANTED_FASTER:g})")
    choices = [
        policy.with_(lambda p, k=k, r33=r33: with_settings(p, weighting_factor=k, zero_range=r33))  # type: ignore[misc]
        for k in np.linspace(1, 20, STEPS).tolist()
        for r33 in np.round(np.linspace(0, 0.005, STEPS), 6).tolist()
    ]
    duration = seconds(lambda: on_all_cores(lambda share: figures_of(trace, share), choices), rounds)
    print(
        f"map of {STEPS} x {STEPS} settings: {duration:.2f} s, {len(choices) * count / duration / 1e6:.0f} million decisions a second"
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
        choices_sent = {
            "last": count,
            "weighting_factors": np.linspace(1, 20, STEPS).tolist(),
            "zero_ranges": np.round(np.linspace(0, 0.005, STEPS), 6).tolist(),
        }
        times = []
        for _ in range(rounds + 1):
            begun = time.perf_counter()
            client.post("/characteristics/c/what-if/map", json=choices_sent).raise_for_status()
            times.append(time.perf_counter() - begun)
        print(f"the map by request and answer: first {times[0]:.2f} s, then {min(times[1:]):.2f} s")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--readings", type=int, default=100_000)
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    decisions(arguments.readings, arguments.rounds)
    over_http(arguments.readings, arguments.rounds)


if __name__ == "__main__":
    main()
