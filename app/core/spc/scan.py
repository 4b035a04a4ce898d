"""The loops behind the run rules: one pass per rule, with a state, so that pieces give what the whole gives.

Rows of runs are side, start, end, number of points. The last row of what was found earlier may still grow.
"""

import numpy as np
from numpy.typing import NDArray

from app.core.compiled import compiled
from app.core.spc.refusal import Floats

Rows = NDArray[np.int64]
STATE = 4
"""Numbers that a rule remembers: (code, start, whether anything was seen) or (bits of the last n points, open run)."""


@compiled
def equal_runs(
    z: Floats, offset: int, last: float, kind: int, n: int, limit: float, state: Rows, earlier: Rows
) -> Rows:
    """Runs of at least n points of the same sort: on one side (1), rising or falling (2), alternating (3), within (4) or outside (5).

    Each point gets a code; a run is a row of equal codes that are not 0. Rising and falling are codes of steps, so such a
    run has one point more than steps; alternating steps have equal codes once every other one is turned over.
    """
    steps = kind in (2, 3)
    needed = n - 1 if steps else n
    rows = np.empty((len(earlier) + len(z) // max(needed, 1) + 2, 4), np.int64)
    rows[: len(earlier)] = earlier
    count = len(earlier)
    code, start, seen = state[0], state[1], state[2]
    for i in range(len(z)):
        value = z[i]
        if kind == 1:
            new = int(value > 0.0) - int(value < 0.0)
        elif steps:
            new = (int(value > last) - int(value < last)) * seen
            if kind == 3 and (offset + i) % 2 == 1:
                new = -new
            last = value
            seen = 1
        elif kind == 4:
            new = 1 if -limit <= value <= limit else 0
        else:
            new = 0 if -limit <= value <= limit else 1
        if new != code:
            code, start = new, offset + i
        if code != 0:
            length = offset + i - start + 1
            if length >= needed:
                if length == needed:
                    rows[count, 0] = code if kind in (1, 2) else 0
                    rows[count, 1] = start - 1 if steps else start
                    count += 1
                rows[count - 1, 2] = offset + i
                rows[count - 1, 3] = length + 1 if steps else length
    state[0], state[1], state[2] = code, start, seen
    return rows[:count].copy()


@compiled
def beyond_runs(z: Floats, offset: int, side: int, n: int, k: int, limit: float, state: Rows, earlier: Rows) -> Rows:
    """Signals "k of n points beyond the limit on one side"; such that touch or share points are one run."""
    rows = np.empty((len(earlier) + len(z) // k + 2, 4), np.int64)
    rows[: len(earlier)] = earlier
    count = len(earlier)
    window = (1 << n) - 1
    bits = state[0]
    for i in range(len(z)):
        beyond = side * z[i] > limit
        bits = ((bits << 1) | beyond) & window
        if not beyond:
            continue
        inside, oldest = 0, 0
        for age in range(n):
            if bits >> age & 1:
                inside += 1
                oldest = age
        if inside < k:
            continue
        at = offset + i
        if count > 0 and at - oldest <= rows[count - 1, 2] + 1:
            for age in range(at - rows[count - 1, 2]):
                rows[count - 1, 3] += bits >> age & 1
            rows[count - 1, 2] = at
        else:
            rows[count, 0], rows[count, 1], rows[count, 2], rows[count, 3] = side, at - oldest, at, inside
            count += 1
    state[0] = bits
    return rows[:count].copy()
