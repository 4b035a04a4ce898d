"""Drift of a position error over the runs, and one run compared with another (domain §9)."""

from collections.abc import Sequence
from math import sqrt
from typing import NamedTuple

import numpy as np

from app.core.spc.spread import t_quantile
from app.core.spc.variation import varies

FEWEST = 3
COVERAGE = 2.0  # standard deviations, about 95 %


class Trend(NamedTuple):
    """Rate of change of a value, per day, with its confidence interval."""

    slope: float
    low: float
    high: float
    runs: int

    @property
    def moves(self) -> bool:
        """True if the value changes significantly: 0 lies outside the confidence interval."""
        return self.low > 0 or self.high < 0


class Change(NamedTuple):
    """From one run to another. deviation: of the difference; None where a run does not say how sure it is."""

    before: float
    after: float
    deviation: float | None

    @property
    def difference(self) -> float:
        return round(self.after - self.before, 12) + 0.0

    @property
    def moved(self) -> bool | None:
        """True if the difference is more than scatter; None where it cannot be found."""
        return None if self.deviation is None else abs(self.difference) > COVERAGE * self.deviation


def trend(days: Sequence[float], values: Sequence[float], confidence: float = 0.95) -> Trend | None:
    """The line through values over time by least squares; None for fewer than three runs, all at one moment, or without scatter.

    >>> found = trend([0, 1, 2, 3], [0.0, 0.0011, 0.0019, 0.003])
    >>> round(found.slope, 5), found.moves
    (0.00098, True)
    """
    t, y = np.asarray(days, dtype=np.float64), np.asarray(values, dtype=np.float64)
    if len(t) < FEWEST or np.ptp(t) == 0:
        return None
    away = t - t.mean()
    square = float(away @ away)
    slope = float(away @ y) / square
    left = y - y.mean() - slope * away
    if not varies(float(np.abs(left).max()), y):  # too coarse or too few: no interval follows from no scatter
        return None
    freedom = len(t) - 2
    half = t_quantile(freedom, confidence) * sqrt(float(left @ left) / freedom / square)
    return Trend(slope, slope - half, slope + half, len(t))


def change(
    before: float, after: float, deviation_before: float | None = None, deviation_after: float | None = None
) -> Change:
    """The change of a value between two runs.

    >>> change(0.001, 0.009, 0.0005, 0.0005).moved, change(0.001, 0.0012, 0.0005, 0.0005).moved
    (True, False)
    """
    known = deviation_before is not None and deviation_after is not None
    return Change(before, after, sqrt(deviation_before**2 + deviation_after**2) if known else None)  # type: ignore[operator] # both are known
