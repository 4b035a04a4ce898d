"""Corrections that act earlier than they are counted: the machine's clock is behind, or a number or a confirmation comes late.

A part is judged as if the corrections that it was cut without had acted (`decision.step`). If it was cut with them after all, they
are taken back, part after part, and the size swings out of tolerance or follows wear by half. With D the deviation of a part, x what
the corrections that it counts as cut with have done to it, and u what those that it counts as cut without will do::

    D_i = w_i + g x_i + h u_i,    w_i = level_i + drift i + scatter,    level_i+1 = level_i + random step

u is that of corrections which act after 0, 1, … `LATEST` parts, from the part on that asked for them, less those counted already.
h is 0 where the count is right and near g where it is not; far above g where an edge breaks just when a correction acts. As in
`app.core.opposite_effect` one Kalman filter predicts D and each regressor alike, and least squares of its innovations give g, h and the drift;
g is 1 to within 1 before, the drift 0 to within the scatter. The scatter is that of the residuals; while few parts have shown it, h
is taken for less sure. The limits are those with which no simulated tool life is taken for one of these (tests/core/test_early.py).
Lengths are mm.
"""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from app.core.compiled import compiled

Floats = NDArray[np.float64]

FEWEST = 8  # parts
LATEST = 5  # parts that may be on the way
CHANGES = 3  # of u, by more than this many times the scatter that is expected
CLEAR = 2.0
NEARER = 0.5  # h is nearer to 1 than to 0,
SURE, LOWEST = 5.5, 0.3  # and this many standard errors above that
HIGHEST = 2.5  # above it something else has moved the size, as an edge that breaks
LEVEL_STEP = 0.1  # variance of a step of the level over that of the scatter
PRIOR, FEW = 3.0, 90.0  # parts that the expected scatter is worth; errors are 1 + FEW / parts squared times as large


def share_of(deviation: Floats, counted: Floats, missing: Floats, expected: float) -> tuple[float, float]:
    """Return h and its standard error. counted, missing: x and u of each part; expected: the scatter to begin with."""
    count = len(deviation)
    level, p, squares = deviation[0], 1.0 + LEVEL_STEP, 0.0
    levels, missed = np.zeros(3), np.zeros(3)
    levels[0], levels[1] = counted[0], missing[0]
    products, sums = np.zeros((3, 3)), np.zeros(3)
    for i in range(1, count):
        variance = p + 1.0
        k = p / variance
        of_d = deviation[i] - level
        missed[0], missed[1], missed[2] = counted[i] - levels[0], missing[i] - levels[1], i - levels[2]
        for j in range(3):
            sums[j] += missed[j] * of_d / variance
            for other in range(3):
                products[j, other] += missed[j] * missed[other] / variance
        squares += of_d * of_d / variance
        level += k * of_d
        levels += k * missed
        p = p - k * p + LEVEL_STEP
    scatter, share, error = expected, 0.0, 0.0
    for _nearer in range(3):
        information, known = products.copy(), sums.copy()
        information[0, 0] += scatter * scatter
        known[0] += scatter * scatter
        information[2, 2] += 1.0
        inverse = np.linalg.inv(information)
        found = inverse @ known
        left = float(squares - 2 * (found @ sums) + found @ (products @ found))
        scatter = sqrt((PRIOR * expected * expected + max(left, 0.0)) / (PRIOR + count - 3.0))
        share, error = found[1], scatter * sqrt(inverse[1, 1]) * (1 + FEW / count**2)
    return share, error


@compiled
def acts_early(
    deviation: Floats, compensated: Floats, outstanding: Floats, factor: float, begin: int, expected: float
) -> tuple[int, float, float]:
    """Return after how many parts corrections act, where they act before they are counted, else -1; h and its standard error.

    deviation, compensated: as in `app.core.opposite_effect.opposed`; outstanding: by how much those that a part counts as cut without will
    change its size. What is before `begin` does not count. expected: the scatter to begin with (`app.core.opposite_effect.expected_scatter`).

    >>> total = np.array([0, 5, 0, 5, 0, 5, 0, 5, 0, 5]) * -1e-3  # of corrections: all in effect, none counted
    >>> scatter = np.array([1, 3, -2, 0, 2, -3, 1, -1, 2, 0]) * 1e-4
    >>> after, share, error = acts_early(0.005 + total + scatter, np.zeros(10), total, -1.0, 0, 0.0003)
    >>> after, round(share, 1), acts_early(0.005 + scatter, np.zeros(10), total, -1.0, 0, 0.0003)[0]
    (0, 1.0, -1)
    """
    counted = compensated / -factor
    for after in range(LATEST + 1):
        first = begin + after
        count = len(deviation) - first
        if count < FEWEST:
            break
        missing = counted[first - after : len(counted) - after] + outstanding[first - after : len(counted) - after]
        missing -= counted[first:]
        changes = 0
        for i in range(1, count):
            changes += abs(missing[i] - missing[i - 1]) > CLEAR * expected
        if changes < CHANGES:
            continue
        share, error = share_of(deviation[first:], counted[first:], missing, expected)
        if NEARER < share < HIGHEST and share - SURE * error > LOWEST:
            return after, share, error
    return -1, 0.0, 0.0
