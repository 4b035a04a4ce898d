"""Linearity: the bias at several reference sizes, and the straight line through it (AIAG MSA, chapter III section B)."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtr, stdtrit

from app.core.spc.refusal import Reason, Refused, checked
from app.core.spc.spread import mean_of


@dataclass(frozen=True, slots=True)
class Coefficient:
    """A coefficient of the line, its standard error, and the test against 0."""

    value: float
    standard_error: float
    t: float
    p_value: float


@dataclass(frozen=True, slots=True)
class Linearity:
    """bias = intercept + slope * reference. `biases`: the mean bias at each reference. s: scatter about the line."""

    readings: int
    biases: dict[float, float]
    average_bias: float
    slope: Coefficient
    intercept: Coefficient
    r_squared: float
    s: float
    confidence: float
    _mean: float
    _squares: float

    def line_at(self, reference: float) -> tuple[float, float, float]:
        """The line at a size, and the confidence band of it there.

        Where the band leaves 0 out, the gauge is biased at that size.
        """
        value = self.intercept.value + self.slope.value * reference
        reach = float(stdtrit(self.readings - 2, (1 + self.confidence) / 2)) * self.s
        reach *= sqrt(1 / self.readings + (reference - self._mean) ** 2 / self._squares)
        return value, value - reach, value + reach


def linearity(studies: Mapping[float, ArrayLike], *, confidence: float = 0.95) -> Linearity:
    """Least squares over all readings; by reference size, the readings taken of it.

    >>> line = linearity({2.0: [2.5, 2.5, 2.6], 4.0: [4.1, 4.2, 4.2], 6.0: [5.9, 5.8, 6.0]})
    >>> round(line.slope.value, 4), line.slope.p_value < 0.001
    (-0.1583, True)
    """
    if len(studies) < 2:
        raise Refused(Reason.INCOMPLETE_STUDY, have=len(studies), needed=2, what="references")
    taken = {float(reference): checked(values) for reference, values in studies.items()}
    x = np.concatenate([np.full(len(values), reference) for reference, values in taken.items()])
    y = np.concatenate([values - reference for reference, values in taken.items()])
    if len(x) < 3:
        raise Refused(Reason.TOO_FEW_READINGS, have=len(x), needed=3)
    middle, off = mean_of(x), x - mean_of(x)
    squares = float(off @ off)
    slope = float(off @ (y - y.mean())) / squares
    intercept = float(y.mean()) - slope * middle
    left = y - intercept - slope * x
    total = float(((y - y.mean()) ** 2).sum())
    if not total > 0 or not float(left @ left) > 0:
        raise Refused(Reason.NO_VARIATION)
    s = sqrt(float(left @ left) / (len(x) - 2))
    return Linearity(
        readings=len(x),
        biases={reference: mean_of(values - reference) for reference, values in taken.items()},
        average_bias=float(y.mean()),
        slope=_tested(slope, s / sqrt(squares), len(x) - 2),
        intercept=_tested(intercept, s * sqrt(1 / len(x) + middle**2 / squares), len(x) - 2),
        r_squared=1 - float(left @ left) / total,
        s=s,
        confidence=confidence,
        _mean=middle,
        _squares=squares,
    )


def _tested(value: float, error: float, freedom: int) -> Coefficient:
    return Coefficient(value, error, value / error, float(2 * stdtr(freedom, -abs(value / error))))
