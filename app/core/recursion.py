"""`decide` for many readings that ask for nothing, compiled: the same numbers to the last bit, many times as fast.

Readings of a process in control follow one another without a correction or an alarm. `quiet_run` decides such readings
over columns and stops before the first one that is not of that kind; that one is for `compensation.decide`. It stops as
well where it could not tell how Python would round: so what it has decided is what `decide` would have decided.

Readings belong to lanes. All readings of a lane have the parameters, the empirical value and the outstanding corrections
in common; lanes may share a running average (R11) and a stream of sequence numbers.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.core.compensation import Code
from app.core.compiled import compiled
from app.core.parameters import Parameters
from app.core.zones import Zone

ZONES = (Zone.ZERO, Zone.AVERAGE, Zone.FULL)
"""The zones of quiet readings, by the numbers in `Quiet.zone`."""
CODES = (Code.WITHIN_ZERO_RANGE, Code.AVERAGE_KEPT, Code.MEASURE_ONLY)
"""Why, by the numbers in `Quiet.code`."""

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]
Small = NDArray[np.int8]


class Lane(NamedTuple):
    """What the readings of one lane are decided by.

    outstanding: `outstanding_effect` in mm. stream, memory: their indices. quiet: nothing but the reading itself can make
    it ask for something, such as a pause.
    """

    parameters: Parameters
    empirical_value: float
    outstanding: float
    stream: int
    memory: int
    quiet: bool = True


class Lanes(NamedTuple):
    """Lanes as columns, as `quiet_run` takes them."""

    numbers: Floats  # target, empirical value, outstanding, k
    limits: Whole  # R33, R34, R35/2, R36 in nm; 1 if it only measures; stream; memory or -1; 1 if quiet

    @classmethod
    def of(cls, lanes: Sequence[Lane]) -> "Lanes":
        """Make columns of lanes."""
        return cls(
            np.array(
                [
                    (lane.parameters.target, lane.empirical_value, lane.outstanding, lane.parameters.weighting_factor)
                    for lane in lanes
                ],
                dtype=np.float64,
            ).reshape(-1, 4),
            np.array([_whole(lane) for lane in lanes], dtype=np.int64).reshape(-1, 8),
        )

    @classmethod
    def unknown(cls, count: int) -> "Lanes":
        """So many lanes that nothing is known of yet: none is quiet."""
        return cls(np.zeros((count, 4)), np.zeros((count, 8), np.int64))

    def silence(self, which: NDArray[np.bool_]) -> None:
        """Let no reading of these lanes be quiet, until they are replaced."""
        self.limits[which, 7] = 0

    def replace(self, at: int, lane: Lane) -> None:
        """Put another lane in the place of one."""
        parameters = lane.parameters
        self.numbers[at] = (parameters.target, lane.empirical_value, lane.outstanding, parameters.weighting_factor)
        self.limits[at] = _whole(lane)


def _whole(lane: Lane) -> tuple[int, ...]:
    limits, parameters = lane.parameters.limits, lane.parameters
    return (
        limits.zero_range,
        limits.averaging,
        limits.tolerance,
        limits.confidence,
        parameters.measures_only,
        lane.stream,
        lane.memory if parameters.average_memory else -1,
        lane.quiet,
    )


class Quiet(NamedTuple):
    """What was decided, a row a reading; `decide` tells what the numbers mean."""

    sequence: Whole
    deviation: Floats
    decided: Floats
    before: Floats
    after: Floats
    zone: Small
    code: Small

    @classmethod
    def room(cls, count: int) -> "Quiet":
        """Room for so many readings."""
        deviation, decided, before, after = np.zeros((4, count))
        zone, code = np.zeros((2, count), np.int8)
        return cls(np.zeros(count, np.int64), deviation, decided, before, after, zone, code)


@compiled
def quiet_run(
    at: int, measured: Floats, lane: Whole, lanes: Lanes, sequences: Whole, averages: Floats, out: Quiet
) -> int:
    """Decide readings from index `at` on, up to the first that is not quiet; its index, or how many readings there are.

    measured: mm. lane: the lane of each reading, -1 for one that is never quiet. sequences, averages: the last number of
    each stream and M (mm) of each memory; both are moved along.
    """
    numbers, limits = lanes.numbers, lanes.limits
    sequence, deviations, decisions, before, after, zones, codes = out
    for i in range(at, len(measured)):
        which = lane[i]
        if which < 0 or not limits[which, 7]:
            return i
        # round(…, 9) as Python does it: to the nearest picometre, unless two are so near that only exact decimals can tell
        scaled = (measured[i] - numbers[which, 0] - numbers[which, 1]) * 1e9
        nearest = np.rint(scaled)
        if not abs(scaled) < 1e15 or abs(scaled - nearest) > 0.45:
            return i
        deviation = nearest / 1e9 + 0.0
        decided = deviation
        if numbers[which, 2] != 0.0:
            scaled = (deviation + numbers[which, 2]) * 1e9
            nearest = np.rint(scaled)
            if abs(scaled - nearest) > 0.45:
                return i
            decided = nearest / 1e9 + 0.0
        size = abs(np.rint(decided * 1_000_000.0))
        raw = abs(np.rint(deviation * 1_000_000.0))
        if size > limits[which, 2] or raw > limits[which, 2] or raw >= limits[which, 3]:
            return i
        memory, k = limits[which, 6], numbers[which, 3]
        average = averages[memory] if memory >= 0 else 0.0
        updated = decided
        if k != 1.0:
            updated = average - average / k + decided / k
            updated = min(max(updated, min(average, decided)), max(average, decided))
        if size <= limits[which, 0]:
            zone, code = 0, 0
        else:
            zone = 1 if size <= limits[which, 1] else 2
            if limits[which, 4]:
                code = 2
            elif zone == 1 and abs(np.rint(updated * 1_000_000.0)) <= limits[which, 0]:
                code = 1
            else:
                return i
        stream = limits[which, 5]
        sequences[stream] += 1
        sequence[i] = sequences[stream]
        deviations[i], decisions[i], before[i] = deviation, decided, average
        if memory >= 0:
            averages[memory] = after[i] = updated
        zones[i], codes[i] = zone, code
    return len(measured)
