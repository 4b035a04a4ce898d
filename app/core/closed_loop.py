"""The closed loop of a replay, compiled: `app.core.replay.followed` to the last bit, many times as fast.

A reading of the replay is the process without corrections plus what the corrections in effect make of it; it is decided as
`compensation.decide` does, and what is issued takes effect some parts later. `Way` says what happens beside the readings.

``round(x, 9)`` of Python rounds the exact decimal value of x. Here x * 1e9 is rounded to a whole number; only where it
lies half between two does its own rounding error decide, which Dekker's product (1971, Numer. Math. 18, 224) gives exactly.
A whole number below 2**53 divided by 1e9 is the double next to the decimal number, as Python makes it. True up to 1 km.
"""

from enum import IntEnum, IntFlag
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.core.compensation import Code
from app.core.compiled import compiled
from app.core.zones import Zone

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]
Small = NDArray[np.int8]

ZONES = tuple(Zone)
"""Zones by the numbers in `Course.zone`."""
CODES = (
    Code.WITHIN_ZERO_RANGE,
    Code.AVERAGE_KEPT,
    Code.MEASURE_ONLY,
    Code.PROBE_FAULT,
    Code.PAUSED,
    Code.REJECTED,
    Code.OFFSET_LIMIT,
    Code.AVERAGED_DEVIATION,
    Code.FULL_DEVIATION,
    Code.OUT_OF_TOLERANCE,
    Code.TOOL_WORN_RELEASED,
    Code.TOOL_WORN_HELD,
    Code.IMPLAUSIBLE,
)
"""Why, by the numbers in `Course.code`; from `CORRECTS` on a correction was computed, from `HOLDS` on it is held."""
CORRECTS, HOLDS = 7, 11


class Mark(IntFlag):
    """What happens at a reading, whatever the policy."""

    BEGIN = 1  # a fresh edge, an offset set by hand, or the first reading: the offset is what it was then
    RESTART = 2  # M begins anew: target or empirical value have changed
    PAUSED = 4  # an alarm paused compensation
    REJECTED = 8  # not accepted by n of m
    JUMP = 16  # implausible
    RELEASED = 32  # a correction that was held has been released before this part was cut
    LEFT_OUT = 64  # taken out of the statistics; the loop has seen it


class Way(NamedTuple):
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


class Course(NamedTuple):
    """What came of each reading: raw deviation, deviation decided by, M after it, correction, offset in effect (mm); zone, code."""

    deviation: Floats
    decided: Floats
    average: Floats
    amount: Floats
    offset: Floats
    zone: Small
    code: Small

    @classmethod
    def room(cls, count: int) -> "Course":
        """Room for so many readings; 0 if only the tally is wanted."""
        deviation, decided, average, amount, offset = np.zeros((5, count))
        zone, code = np.zeros((2, count), np.int8)
        return cls(deviation, decided, average, amount, offset, zone, code)


class Count(IntEnum):
    """Places in the counts of a tally: readings of the lanes that count and are not left out."""

    READINGS = 0
    REJECTS = 1  # raw deviation out of tolerance, probe faults apart
    OVERSIZE = 2
    UNDERSIZE = 3
    WORN = 4
    FAULTS = 5
    LIMIT = 6  # offset limit
    CORRECTIONS = 7
    HELD = 8
    INNER = 9  # raw deviation within R37: what mean and spread are of
    OF_TOOL = 10  # corrections of every lane


class Total(IntEnum):
    """Places in the sums of a tally, mm: of raw deviations within R37, and of the size errors removed."""

    SUM = 0
    SQUARES = 1
    LARGEST = 2
    SIZES = 3


@compiled
def _round9(value: float) -> float:
    scaled = value * 1e9
    nearest = np.rint(scaled)
    left = scaled - nearest
    if abs(left) == 0.5:
        split = value * 134217729.0
        high = split - (split - value)
        low = value - high
        # 1e9 = 999999488 + 512: halves of 26 bits at most
        rest = ((high * 999999488.0 - scaled) + high * 512.0 + low * 999999488.0) + low * 512.0
        if left > 0.0 and rest > 0.0:
            nearest += 1.0
        elif left < 0.0 and rest < 0.0:
            nearest -= 1.0
    return nearest / 1e9 + 0.0  # type: ignore[no-any-return]


@compiled
def _follow(way: Way, numbers: Floats, limits: Whole, delay: int, course: Course, counts: Whole, sums: Floats) -> None:
    free, lanes, marks, parts, start_offset, start_pending, start_average = way
    deviations, decisions, averages_after, amounts, offsets, zones, codes = course
    recorded = len(deviations) > 0
    averages = np.zeros(start_average.shape[1])
    room = (delay + 2) * len(limits) + 4
    due_amount, due_part = np.zeros(room), np.zeros(room, np.int64)
    head, waiting = 0, 0
    begun = 0
    offset, pending, total, held = 0.0, 0.0, 0.0, 0.0
    holding = False
    for i in range(len(free)):
        mark, lane, part = marks[i], lanes[i], parts[i]
        r33, r34, r35, r37, r36 = (
            limits[lane, 0],
            limits[lane, 1],
            limits[lane, 2],
            limits[lane, 3],
            limits[lane, 4],
        )
        memory = limits[lane, 6]
        if mark:
            if mark & 1:
                offset, pending = start_offset[begun], start_pending[begun]
                averages[:] = start_average[begun]
                total = _round9(offset + pending)
                begun += 1
                head, waiting, holding = 0, 0, False
                if pending != 0.0:
                    due_amount[0], due_part[0], waiting = pending, part + delay + 1, 1
            if mark & 2 and memory >= 0:
                averages[memory] = 0.0
            if mark & 32 and holding:
                offset, total, holding = _round9(offset + held), _round9(total + held), False
        while waiting > 0 and due_part[head] <= part:
            offset = _round9(offset + due_amount[head])
            pending = _round9(pending - due_amount[head])
            head = head + 1 if head + 1 < room else 0
            waiting -= 1
        k, factor = numbers[lane, 0], numbers[lane, 1]
        deviation = _round9(free[i] + numbers[lane, 2] * offset)
        decided = deviation
        if pending != 0.0:
            outstanding = _round9(-pending / factor)
            if outstanding != 0.0:
                decided = _round9(deviation + outstanding)
        before = averages[memory] if memory >= 0 else 0.0
        size = np.int64(abs(np.rint(decided * 1_000_000.0)))
        raw = np.int64(abs(np.rint(deviation * 1_000_000.0)))
        fault = raw >= r36
        if fault:
            zone = 6
        elif size <= r33:
            zone = 0
        elif size <= r34:
            zone = 1
        elif size <= r35:
            zone = 2
        elif size < r37:
            zone = 3 if decided > 0 else 4
        elif size < r36:
            zone = 5
        else:
            zone = 6
        after, amount, error = before, 0.0, 0.0
        hold = limits[lane, 7] != 0
        jump = mark & 16 != 0 and not (zone == 5 and hold)
        if zone == 6:
            code = 3
        elif mark & 4:
            code = 4
        elif mark & 8 and limits[lane, 8] == 0:
            code = 5
        elif jump and (zone == 0 or limits[lane, 5] != 0):
            code = 12
            zone += 64  # nothing is issued
        else:
            updated = decided
            if k != 1.0:
                updated = before - before / k + decided / k
                if before < decided:
                    updated = max(updated, before)
                    updated = min(updated, decided)
                else:
                    updated = max(updated, decided)
                    updated = min(updated, before)
            if zone == 0:
                code, after = 0, updated
            elif limits[lane, 5] != 0:
                code = 2
                if zone != 5:
                    after = updated
            else:
                without = before
                if jump:
                    code, error = 12, decided
                elif zone == 1:
                    if abs(np.rint(updated * 1_000_000.0)) <= r33:
                        code, after = 1, updated
                    else:
                        code, error, after, without = 7, updated, 0.0, updated
                elif zone == 2:
                    code, error, after = 8, decided, 0.0
                elif zone == 5:
                    code, error = 11 if hold else 10, decided
                else:
                    code, error, after = 9, decided, 0.0
                if code >= 7:
                    amount = _round9(factor * error)
                    largest = numbers[lane, 3]
                    if abs(amount) > largest:
                        amount = largest if amount > 0 else -largest
                    limit = numbers[lane, 4]
                    if limit < np.inf:
                        reached = abs(np.rint((total + amount) * 1_000_000.0))
                        if reached > np.rint(limit * 1_000_000.0) and reached > abs(np.rint(total * 1_000_000.0)):
                            code, after, amount = 6, without, 0.0
        issued = code >= 7 and zone < 64
        zone &= 63
        if issued:
            holding = False
            if code >= 11:
                held, holding = amount, True
            else:
                total, pending = _round9(total + amount), _round9(pending + amount)
                at = head + waiting
                if at >= room:
                    at -= room
                due_amount[at], due_part[at] = amount, part + delay + 1
                waiting += 1
        if memory >= 0:
            averages[memory] = after
        else:
            after = 0.0
        if recorded:
            deviations[i], decisions[i], averages_after[i], amounts[i] = deviation, decided, after, amount + 0.0
            offsets[i], zones[i], codes[i] = offset, zone, code
        if mark & 64:
            continue
        if issued and code < 11:
            counts[10] += 1
        if limits[lane, 9] == 0:
            continue
        counts[0] += 1
        if zone == 6:
            counts[5] += 1
        elif zone == 5:
            counts[4] += 1
        elif raw > r35:
            counts[2 if deviation > 0 else 3] += 1
        if raw > r35 and raw < r36:
            counts[1] += 1
        if code == 6:
            counts[6] += 1
        if issued:
            if code >= 11:
                counts[8] += 1
            else:
                counts[7] += 1
                sums[3] += abs(error)
        if raw < r37:
            counts[9] += 1
            sums[0] += deviation
            sums[1] += deviation * deviation
            sums[2] = max(sums[2], abs(deviation))


@compiled
def follow(way: Way, numbers: Floats, limits: Whole, delay: int, course: Course, counts: Whole, sums: Floats) -> None:
    """Follow the loop along the way with one policy, recorded in `course` and tallied in `counts` and `sums`.

    numbers: a row a lane: k, factor, mm of size per mm of offset, max_step, max_total (inf: none). limits: a row a lane: R33,
    R34, R35/2, R37, R36 in nm; 1 if it only measures; memory or -1; 1 if wear is held; 1 if rejected parts may correct; 1 if
    it counts in the tally.
    delay: parts that come out with the old offset after a correction has been issued.
    """
    _follow(way, numbers, limits, delay, course, counts, sums)


@compiled
def follow_each(
    way: Way, numbers: Floats, limits: Whole, delay: int, nothing: Course, counts: Whole, sums: Floats
) -> None:
    """The same with many policies, tallied alone: one more index, the policy, before those of `follow`. nothing: `Course.room(0)`."""
    for each in range(len(numbers)):
        _follow(way, numbers[each], limits[each], delay, nothing, counts[each], sums[each])
