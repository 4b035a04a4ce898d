"""Variation against rounding noise: one threshold of "no variation" for the whole core.

Equal readings seldom give a spread of exactly 0: the mean of five times 0.1 is 0.1 + 1e-17, and a bias of 0.1 taken at five
sizes differs in the sixteenth digit. Whatever divides by a spread asks here first whether there is one.
"""

import numpy as np
from numpy.typing import ArrayLike

ROUNDING = 1e-10
"""Of the largest number: 1 nm in 10 m. No gauge resolves that; doubles round by less than a hundred-thousandth of it."""


def varies(spread: float, *values: ArrayLike) -> bool:
    """Tell a spread from rounding noise.

    spread: a standard deviation, range or residual, never negative. values: the numbers that it was computed from, in the
    same unit. Where these are differences, give what they were taken between as well (sizes and reference sizes): the
    rounding is that of the largest of them. Not a number is no variation.

    >>> equal = np.array([0.1, 0.1, 0.1, 0.1, 0.1])
    >>> varies(1e-17, equal), varies(1e-6, 40.0, equal), varies(1e-9, 40.0, equal)
    (False, True, False)
    """
    largest = max((float(np.abs(row).max()) for row in map(np.asarray, values) if row.size), default=0.0)
    return spread > ROUNDING * largest
