"""Resolution: the step between readings, against their spread and the tolerance.

A gauge that shows few different values hides the scatter behind its step: 59 equal readings and one a nanometre off have a
standard deviation of 0.1 nm, and a Ppk of 69455 that tells nothing of the process. D. J. Wheeler and R. W. Lyday, Evaluating
the measurement process (1989): a step should be no larger than one sigma, else ranges take too few values.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from app.core.spc.refusal import Reason, Refused, checked
from app.core.spc.variation import ROUNDING

FEWEST_VALUES = 4
"""Different values that an index takes at least: of normal readings with a step of one sigma, 20 take four."""
MOST_EQUAL = 0.5
"""If more of the readings are the same value, the step is wider than 1.35 sigma and the spread is that of the rounding."""
SHARE_OF_TOLERANCE = 0.1
"""A step should be no larger than a tenth of the tolerance (AIAG MSA, chapter I section E: the rule of ten)."""


class Resolution(NamedTuple):
    """distinct: different values; most: readings that are the same, of the most frequent value; step: smallest distance of two."""

    readings: int
    distinct: int
    most: int
    step: float

    @property
    def enough(self) -> bool:
        """Tell whether the spread of the readings is that of a process, not that of rounding."""
        return self.distinct >= FEWEST_VALUES and self.most <= MOST_EQUAL * self.readings

    def coarse(self, sigma: float, tolerance: float | None = None) -> bool:
        """Tell whether a step is larger than sigma, or than a tenth of the tolerance."""
        return self.step > sigma or (tolerance is not None and self.step > SHARE_OF_TOLERANCE * tolerance * (1 + 1e-9))


def resolution_of(values: ArrayLike, scale: float = 0.0) -> Resolution:
    """Count the different values; those that differ by decimal noise alone are the same. Step is 0 of equal readings.

    scale: a number of the size that the values were computed from (limits, where they are deviations).

    >>> resolution_of([0.1, 0.3, 0.1 + 0.2, 0.2, 0.2, 0.2])
    Resolution(readings=6, distinct=3, most=3, step=0.1)
    """
    x = np.sort(checked(values))
    gaps = np.diff(x)
    apart = gaps > ROUNDING * max(abs(float(x[0])), abs(float(x[-1])), scale)
    sizes = np.diff(np.concatenate(([0], np.flatnonzero(apart) + 1, [len(x)])))
    step = round(float(gaps[apart].min()), 12) if apart.any() else 0.0
    return Resolution(len(x), len(sizes), int(sizes.max()), step)


def must_resolve(values: ArrayLike, scale: float = 0.0) -> Resolution:
    """The resolution of readings that carry a spread. Raises `Refused` (no variation, unresolved)."""
    resolution = resolution_of(values, scale)
    if resolution.distinct == 1:
        raise Refused(Reason.NO_VARIATION)
    if not resolution.enough:
        raise Refused(Reason.UNRESOLVED, have=resolution.distinct, needed=FEWEST_VALUES)
    return resolution
