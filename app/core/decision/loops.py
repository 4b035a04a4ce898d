"""The loops over columns of readings, compiled: `decide` to the last bit, many times as fast. Bookkeeping alone.

`quiet_run` decides a batch until a reading asks for something; `follow` runs the closed loop of a replay. Both call
`step`, the very functions that `decide` calls, compiled.

One of them has a compiled form of its own. ``round(x, 9)`` of Python rounds the exact decimal value of x. `_rounded` rounds
x * 1e9 to a whole number; only where it lies half between two does its own rounding error decide, which Dekker's product
(1971, Numer. Math. 18, 224) gives exactly. A whole number below 2**53 divided by 1e9 is the double next to the decimal
number, as Python makes it. True up to `FARTHEST`.
"""

from collections.abc import Sequence
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.core.compiled import compiled, compiled_form_of
from app.core.decision.limits import FAULT, FULL, WEAR, nanometres, reaches, within
from app.core.decision.step import (
    BELIEVED,
    CORRECT,
    HOLD,
    NONE,
    OFFSET_LIMIT,
    Rules,
    deviation_of,
    effect_of,
    judged_size,
    not_in_size,
    rounded,
    step,
)
from app.core.parameters import Parameters

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]
Small = NDArray[np.int8]
Rows = NDArray[np.void]

FARTHEST = 1e6  # mm: a kilometre


@compiled_form_of(rounded)
def _rounded(length: float) -> float:
    scaled = length * 1e9
    nearest = np.rint(scaled)
    left = scaled - nearest
    if abs(left) == 0.5:
        split = length * 134217729.0
        high = split - (split - length)
        low = length - high
        # 1e9 = 999999488 + 512: halves of 26 bits at most
        rest = ((high * 999999488.0 - scaled) + high * 512.0 + low * 999999488.0) + low * 512.0
        if left > 0.0 and rest > 0.0:
            nearest += 1.0
        elif left < 0.0 and rest < 0.0:
            nearest -= 1.0
    return nearest / 1e9 + 0.0  # type: ignore[no-any-return]


NUMBA = {int: np.int64, float: np.float64, bool: np.bool_}
RULES = [(name, NUMBA[kind]) for name, kind in Rules.__annotations__.items()]
SERIES = np.dtype(
    [
        *RULES,
        *[(name, np.float64) for name in ("target", "empirical_value", "outstanding")],
        *[(name, np.int64) for name in ("stream", "memory")],
        ("quiet", np.bool_),
    ],
    align=True,
)
"""What the readings of a series are decided by: rules, mm, indices (memory -1: none), and `Series.quiet`."""


class Series(NamedTuple):
    """Readings that have parameters, empirical value and outstanding corrections in common.

    outstanding: `outstanding_effect` in mm. stream, memory: indices of their sequence numbers and running average, which
    series may share. quiet: nothing but the reading itself can make it ask for something, such as a pause.
    """

    parameters: Parameters
    empirical_value: float
    outstanding: float
    stream: int
    memory: int
    quiet: bool = True

    def row(self) -> tuple[Any, ...]:
        """Return it as a row of `SERIES`."""
        rules = self.parameters.rules
        memory = self.memory if rules.averages else -1
        return (*rules, self.parameters.target, *self[1:4], memory, self.quiet)


def rows_of(series: Sequence[Series]) -> Rows:
    """Return series as `quiet_run` takes them."""
    return np.array([each.row() for each in series], SERIES)


class Quiet(NamedTuple):
    """The decisions on quiet readings, a row a reading; zone and code are places in `ZONES` and `CODES`."""

    sequence: Whole
    deviation: Floats
    decided: Floats
    before: Floats
    after: Floats
    zone: Small
    code: Small

    @classmethod
    def room(cls, count: int) -> "Quiet":
        """Room for N readings."""
        deviation, decided, before, after = np.zeros((4, count))
        zone, code = np.zeros((2, count), np.int8)
        return cls(np.zeros(count, np.int64), deviation, decided, before, after, zone, code)


@compiled
def quiet_run(
    at: int, measured: Floats, belongs: Whole, series: Rows, sequences: Whole, averages: Floats, out: Quiet
) -> int:
    """Decide readings from index `at` on, up to the first that is not quiet; its index, or how many readings there are.

    Quiet is a reading in tolerance that asks for no correction and no alarm; the first that is not is for `decide`.
    measured: mm. belongs: the series of each reading, -1 for one that is never quiet. sequences, averages: the last number
    of each stream and M (mm) of each memory; both are moved along.
    """
    sequence, deviations, decisions, before, after, zones, codes = out
    for i in range(at, len(measured)):
        if belongs[i] < 0:
            return i
        its = series[belongs[i]]
        if not its.quiet or not abs(measured[i]) + abs(its.target) + abs(its.empirical_value) < FARTHEST:
            return i
        deviation = deviation_of(measured[i], its.target, its.empirical_value)
        average = float(averages[its.memory]) if its.memory >= 0 else 0.0
        made = step(its, average, 0.0, deviation, its.outstanding, False, False, False, False, BELIEVED)
        if made.action != NONE or made.code == OFFSET_LIMIT or made.zone > FULL:
            return i
        if not within(nanometres(deviation), its.tolerance):
            return i
        sequences[its.stream] += 1
        sequence[i] = sequences[its.stream]
        deviations[i], decisions[i], before[i], after[i] = deviation, made.decided, average, made.average
        zones[i], codes[i] = made.zone, made.code
        if its.memory >= 0:
            averages[its.memory] = made.average
    return len(measured)


class Mark(IntEnum):
    """Bits of what happens at a reading, whatever the policy."""

    BEGIN = 1  # a fresh edge, an offset set by hand, or the first reading: the offset is what it was then
    RESTART = 2  # M begins again: target or empirical value have changed
    PAUSED = 4  # an alarm paused compensation
    REJECTED = 8  # not accepted by n of m
    JUMP = 16  # implausible
    RELEASED = 32  # a correction that was held has been released before this part was cut
    LEFT_OUT = 64  # taken out of the statistics; the loop has seen it


class ProcessTrace(NamedTuple):
    """The readings of one tool in their order, and what happened beside them; one entry a reading. mm.

    free: deviation without any correction. lane: which characteristic, by which version. marks: of `Mark`. part: number of the part, never
    falling. offset, pending: at each `Mark.BEGIN`, the sum of corrections in effect and of those issued but not yet in effect.
    averages: the same, M of each memory, a row a beginning.
    """

    free: Floats
    lane: Whole
    marks: Small
    part: Whole
    offset: Floats
    pending: Floats
    averages: Floats


class ReplayResult(NamedTuple):
    """Results of each reading: raw deviation, deviation decided by, M after it, correction, offset in effect (mm); zone and
    code as places in `ZONES` and `CODES`.
    """

    deviation: Floats
    decided: Floats
    average: Floats
    amount: Floats
    offset: Floats
    zone: Small
    code: Small

    @classmethod
    def room(cls, count: int) -> "ReplayResult":
        """Room for N readings; 0 if only the tally is wanted."""
        deviation, decided, average, amount, offset = np.zeros((5, count))
        zone, code = np.zeros((2, count), np.int8)
        return cls(deviation, decided, average, amount, offset, zone, code)


LANE = np.dtype(
    [*RULES, ("response", np.float64), ("memory", np.int64), ("counts", np.bool_)],
    align=True,
)
"""What the readings of a lane are decided by: rules, mm of size per mm of offset, index of M (-1: none), in the tally."""

TALLY = np.dtype(
    [
        *[
            (name, np.int64)
            for name in (
                "readings",
                "rejects",  # raw deviation out of tolerance, probe faults apart
                "oversize",
                "undersize",
                "worn",
                "faults",
                "offset_limit",
                "corrections",
                "held",
                "inner",  # raw deviation within R37: what the sums are of
                "of_tool",  # corrections of every lane
                "measured",  # of the readings: all but those that a sampling leaves out
                "escaped",  # of the rejects: those that were not measured
            )
        ],
        *[(name, np.float64) for name in ("sum", "squares", "largest", "sizes")],  # mm; sizes: of the errors removed
    ]
)
"""Sums over the readings of the lanes that count and are not left out."""


EVERY_PART = np.array([1, 0, 0], np.int64)
"""A sampling: 1 in N parts is measured, and every part for N readings after a fresh edge, and after an alarm."""


def _is_out(rules: Any, deviation: float, made: Any) -> bool:
    return not within(nanometres(judged_size(rules, deviation, made.decided)), rules.tolerance)


def _alarms(rules: Any, deviation: float, made: Any, mark: int) -> bool:
    """Tell if a reading raises an alarm: by its size, or as it did then."""
    if made.zone in (FAULT, WEAR) or made.code == OFFSET_LIMIT:
        return True
    return mark & Mark.REJECTED != 0 or mark & Mark.JUMP != 0 or _is_out(rules, deviation, made)


def _after(sampling: Whole, tight: int, raised: bool, fault: bool) -> tuple[int, int]:
    """Return the parts to leave out after one that was measured, and the readings for which every part is measured yet."""
    tight = max(tight - 1, sampling[2] if raised else 0)
    return (0 if tight > 0 or fault else sampling[0] - 1), tight


def _count_size(tally: Any, rules: Any, deviation: float) -> bool:
    """Add a part to the tally, measured or not; whether it is a reject."""
    size = nanometres(deviation)
    reject = not within(size, rules.tolerance) and not reaches(size, rules.confidence)
    tally.readings += 1
    tally.rejects += reject
    if not reaches(size, rules.wear):
        tally.inner += 1
        tally.sum += deviation
        tally.squares += deviation * deviation
        tally.largest = max(tally.largest, abs(deviation))
    return reject


def _count(tally: Any, rules: Any, deviation: float, made: Any) -> None:
    """Add a reading to the tally."""
    _count_size(tally, rules, deviation)
    tally.measured += 1
    if made.zone == FAULT:
        tally.faults += 1
    elif made.zone == WEAR:
        tally.worn += 1
    elif _is_out(rules, deviation, made):
        if judged_size(rules, deviation, made.decided) > 0:
            tally.oversize += 1
        else:
            tally.undersize += 1
    if made.code == OFFSET_LIMIT:
        tally.offset_limit += 1
    if made.action == HOLD:
        tally.held += 1
    elif made.action == CORRECT:
        tally.corrections += 1
        tally.sizes += abs(made.size_error)


@compiled
def follow(trace: ProcessTrace, lanes: Rows, delay: int, sampling: Whole, result: ReplayResult, tally: Any) -> None:
    """Follow the loop along the trace with one policy, recorded in `result` and summed up in `tally`, a row of `TALLY`.

    lanes: of `LANE`. delay: parts that come out with the old offset after a correction has been issued. sampling: as `EVERY_PART`,
    of the lanes that count; a part that is not measured has a size and no decision, and is not recorded.
    """
    free, lane_of, marks, parts, start_offset, start_pending, start_average = trace
    deviations, decisions, averages_after, amounts, offsets, zones, codes = result
    recorded = len(deviations) > 0
    averages = np.zeros(start_average.shape[1])
    room = (delay + 2) * len(lanes) + 4
    due_amount, due_part = np.zeros(room), np.zeros(room, np.int64)
    head, waiting, begun = 0, 0, 0
    offset, pending, total, held = 0.0, 0.0, 0.0, 0.0
    holding = False
    skip, tight = 0, 0  # parts to leave out yet; readings for which every part is measured yet
    for i in range(len(free)):
        mark, part = marks[i], parts[i]
        lane = lanes[lane_of[i]]
        memory = lane.memory
        if mark & Mark.BEGIN:
            offset, pending = start_offset[begun], start_pending[begun]
            for each in range(len(averages)):  # no slice: see `app.core.spc.scan`
                averages[each] = start_average[begun, each]
            total = rounded(offset + pending)
            begun += 1
            head, waiting, holding = 0, 0, False
            if pending != 0.0:
                due_amount[0], due_part[0], waiting = pending, part + delay + 1, 1
            if sampling[1] > 0:
                skip, tight = 0, max(tight, sampling[1])
        if mark & Mark.RESTART and memory >= 0:
            averages[memory] = 0.0
        if mark & Mark.RELEASED and holding:
            offset, total, holding = rounded(offset + held), rounded(total + held), False
        while waiting > 0 and due_part[head] <= part:
            offset = rounded(offset + float(due_amount[head]))
            pending = rounded(pending - float(due_amount[head]))
            head = head + 1 if head + 1 < room else 0
            waiting -= 1
        deviation = rounded(free[i] + lane.response * offset)
        if lane.counts and skip > 0:
            skip -= 1
            if not mark & Mark.LEFT_OUT and _count_size(tally, lane, deviation):
                tally.escaped += 1
            continue
        made = step(
            lane,
            float(averages[memory]) if memory >= 0 else 0.0,  # uncompiled, NumPy's own floats round otherwise
            total,
            deviation,
            effect_of(not_in_size(lane, total, pending), lane.factor),
            mark & Mark.PAUSED != 0,
            False,
            mark & Mark.REJECTED != 0,
            mark & Mark.JUMP != 0,
            BELIEVED,
        )
        if made.action == HOLD:
            held, holding = made.amount, True
        elif made.action == CORRECT:
            holding = False
            total, pending = rounded(total + made.amount), rounded(pending + made.amount)
            at = head + waiting
            if at >= room:
                at -= room
            due_amount[at], due_part[at] = made.amount, part + delay + 1
            waiting += 1
        if memory >= 0:
            averages[memory] = made.average
        if recorded:
            deviations[i], decisions[i], averages_after[i] = deviation, made.decided, made.average
            amounts[i], offsets[i], zones[i], codes[i] = made.amount + 0.0, offset, made.zone, made.code
        if lane.counts and sampling[0] > 1:
            skip, tight = _after(sampling, tight, _alarms(lane, deviation, made, mark), made.zone == FAULT)
        if mark & Mark.LEFT_OUT:
            continue
        tally.of_tool += made.action == CORRECT
        if lane.counts:
            _count(tally, lane, deviation, made)


@compiled
def follow_each(
    trace: ProcessTrace, lanes: Rows, delay: int, samplings: Whole, nothing: ReplayResult, tallies: Rows
) -> None:
    """The same with many policies, summed up alone: a row of lanes, a sampling and a tally each. nothing: `ReplayResult.room(0)`."""
    for policy in range(len(lanes)):
        follow(trace, lanes[policy], delay, samplings[policy], nothing, tallies[policy])
