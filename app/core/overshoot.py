"""Corrections that act about twice as strongly as they ask, and drive parts out of tolerance: a radius taken for a diameter.

With a gain of 2 (`app.core.opposite_effect`) each correction in full puts the size as far off on the other side of the target, and so does the
next one; above 2 it goes further each time. Below, and where R33 or the average (k) takes the size up, the swing ends by itself. So the
tool is paused only once both are there: parts out of tolerance since the two newest corrections, which take each other back, and a
gain that is credibly above 1.5, by all corrections among the newest `RECENT` parts::

    gain = sum(v_D v_x / F) / sum(v_x^2 / F),    gain - 4.75 errors > 1.5

One filter, one scatter and one way to choose the two with `app.core.opposite_effect`; there is no trend, for wear helps every other correction
as much as it hinders the next. The limits are those with which simulated tool lives are never paused (docs/reference/gain.md).
Lengths are mm.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.core.compiled import compiled
from app.core.opposite_effect import (
    BEFORE,
    LEAST,
    MOST,
    NM,
    RECENT,
    UNLIKE,
    Step,
    newest_two,
    regressed,
    scatter_of,
    steps_of,
)

Floats = NDArray[np.float64]

TOO_STRONG = 1.5  # a gain that is nearer to 2 than to 1
SURE = 4.75  # standard errors that it is above that
SURE_EACH = 1.0  # and each of the two newest corrections alone above 1
FEW = 100.0  # the scatter may be 1 + FEW / parts cubed times what few parts show: parts out of tolerance are evidence, too


class Overshoot(NamedTuple):
    """Two corrections in a row that took each other back, the gain of the newest parts and its standard error; how many are out."""

    first: Step
    second: Step
    gain: float
    error: float
    parts: int
    out: int


def overshoot(
    deviation: Floats,
    compensated: Floats,
    factor: float,
    begin: int,
    expected: float,
    averaging_limit: float,
    half: float,
) -> Overshoot | None:
    """The two newest corrections, if corrections act clearly too strongly and parts cut after the first of the two are out of tolerance.

    half: of the tolerance; all else as in `app.core.opposite_effect.opposed`.

    >>> d, s = np.array([0.01, -0.0098, 0.0102, -0.01, 0.0099, -0.0101]), np.array([0, -0.01, -0.0002, -0.0104, -0.0004, -0.0103])
    >>> found = overshoot(d, s, -1.0, 0, 0.0005, 0.005, 0.008)
    >>> round(found.gain, 2), found.parts, found.out, round(found.second.asked, 4), round(found.second.done, 4)
    (1.99, 6, 6, -0.0099, -0.02)
    >>> overshoot(d, s, -1.0, 0, 0.0005, 0.005, 0.012) is None
    True
    """
    strong, first, second, gain, error = judge_strong(
        deviation, compensated, factor, begin, expected, averaging_limit, half
    )
    if not strong:
        return None
    steps = steps_of(deviation, compensated, factor, (begin, first, second))
    start = max(begin, len(deviation) - RECENT)
    return Overshoot(*steps, gain, error, len(deviation) - start, outside(deviation, start, half))


def outside(deviation: Floats, first: int, half: float) -> int:
    """Return how many parts from this one on are out of tolerance; one on the limit is in."""
    out = 0
    for i in range(first, len(deviation)):
        if abs(deviation[i]) > half + NM / 2:
            out += 1
    return out


@compiled
def judge_strong(
    deviation: Floats,
    compensated: Floats,
    factor: float,
    begin: int,
    expected: float,
    averaging_limit: float,
    half: float,
) -> tuple[bool, int, int, float, float]:
    """Judge as `overshoot` does: the verdict, the first part of each of the two newest corrections, gain and standard error."""
    count = len(deviation)
    start = max(begin, count - RECENT)
    scatter, first, second = expected, 0, 0
    for _again in range(2):  # then by the scatter that they leave
        _start, first, second = newest_two(compensated, start, LEAST * scatter * abs(factor), UNLIKE)
        if first == 0 or outside(deviation, first, half) == 0:
            return False, 0, 0, 0.0, 0.0
        scatter = scatter_of(deviation, compensated, factor, expected, first)
    if (compensated[first] - compensated[first - 1]) * (compensated[second] - compensated[second - 1]) >= 0:
        return False, first, second, 0.0, 0.0
    largest = max(scatter, min(scatter * (1 + FEW / (max(count - 3.0, 0.0) + 1.0) ** 3), averaging_limit / MOST))
    xx, xd, moved = regressed(deviation, compensated, factor, (start, count, first), 0.0, scatter)
    before, between = max(start, first - BEFORE), max(first, second - BEFORE)
    xx_first, xd_first, _moved = regressed(deviation, compensated, factor, (before, second, first), 0.0, scatter)
    xx_second, xd_second, _moved = regressed(deviation, compensated, factor, (between, count, second), 0.0, scatter)
    if moved or min(xx, xx_first, xx_second) <= 0:
        return False, first, second, 0.0, 0.0
    gain, error = xd / xx, largest / sqrt(xx)
    each = (
        xd_first / xx_first - SURE_EACH * largest / sqrt(xx_first) > 1
        and xd_second / xx_second - SURE_EACH * largest / sqrt(xx_second) > 1
    )
    return gain - SURE * error > TOO_STRONG and each, first, second, gain, error
