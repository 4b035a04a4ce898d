"""The loops behind the run rules, with a state, so that pieces give what the whole gives.

Each rule takes two passes: one gives every point a code, which the processor does for many points at once, one counts
equal codes without a branch that depends on chance. Together they take a tenth of what one pass with branches does.

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
    codes = np.empty(len(z), np.int8)
    if kind == 1:
        for i in range(len(z)):
            codes[i] = int(z[i] > 0.0) - int(z[i] < 0.0)
    elif steps:
        if len(z):
            codes[0] = (int(z[0] > last) - int(z[0] < last)) * state[2]
        for i in range(1, len(z)):
            codes[i] = int(z[i] > z[i - 1]) - int(z[i] < z[i - 1])
        if kind == 3:
            for i in range((offset + 1) % 2, len(z), 2):
                codes[i] = -codes[i]
    elif kind == 4:
        for i in range(len(z)):
            codes[i] = int(z[i] >= -limit) & int(z[i] <= limit)
    else:
        for i in range(len(z)):
            codes[i] = int(z[i] < -limit) | int(z[i] > limit)
    needed = n - 1 if steps else n
    rows = np.empty((len(earlier) + len(z) // max(needed, 1) + 2, 4), np.int64)
    for row in range(len(earlier)):  # a slice takes three seconds to compile: its error has a text
        for at in range(4):
            rows[row, at] = earlier[row, at]
    count = len(earlier)
    code, start = state[0], state[1]
    for i in range(len(z)):
        new = codes[i]
        start = start if new == code else offset + i
        code = new
        length = (offset + i - start + 1) * (code != 0)
        if length >= needed:
            if length == needed:
                rows[count, 0] = code if kind in (1, 2) else 0
                rows[count, 1] = start - 1 if steps else start
                count += 1
            rows[count - 1, 2] = offset + i
            rows[count - 1, 3] = length + 1 if steps else length
    state[0], state[1] = code, start
    state[2] = 1 if steps and len(z) else state[2]
    return rows[:count].copy()


@compiled
def beyond_runs(z: Floats, offset: int, side: int, n: int, k: int, limit: float, state: Rows, earlier: Rows) -> Rows:
    """Signals "k of n points beyond the limit on one side"; such that touch or share points are one run."""
    beyond = np.empty(n + len(z), np.int8)  # the n points before these, then these
    inside = 0
    for age in range(n):
        beyond[n - 1 - age] = state[0] >> age & 1
        inside += int(beyond[n - 1 - age])
    if side > 0:
        for i in range(len(z)):
            beyond[n + i] = z[i] > limit
    else:
        for i in range(len(z)):
            beyond[n + i] = -z[i] > limit
    every = 0
    for i in range(len(z)):
        every += int(beyond[n + i])
    rows = np.empty((len(earlier) + every // k + 2, 4), np.int64)
    for row in range(len(earlier)):  # a slice takes three seconds to compile: its error has a text
        for at in range(4):
            rows[row, at] = earlier[row, at]
    count = len(earlier)
    for i in range(len(z)):
        inside += int(beyond[n + i]) - int(beyond[i])
        if inside * int(beyond[n + i]) >= k:
            oldest = 0
            for age in range(n):
                oldest = age if beyond[n + i - age] else oldest
            at = offset + i
            if count > 0 and at - oldest <= rows[count - 1, 2] + 1:
                for age in range(at - rows[count - 1, 2]):
                    rows[count - 1, 3] += int(beyond[n + i - age])
                rows[count - 1, 2] = at
            else:
                rows[count, 0], rows[count, 1], rows[count, 2], rows[count, 3] = side, at - oldest, at, inside
                count += 1
    bits = 0
    for age in range(n):
        bits |= int(beyond[n + len(z) - 1 - age]) << age
    state[0] = bits
    return rows[:count].copy()


@compiled
def painted(sides: NDArray[np.int8], rows: Rows) -> None:
    """Write the side of each run at its points."""
    for row in range(len(rows)):
        for i in range(rows[row, 1], rows[row, 2] + 1):
            sides[i] = rows[row, 0]
