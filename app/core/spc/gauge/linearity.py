"""Linearity: the bias at several reference sizes, and the straight line through it (AIAG MSA, chapter III section B).

It is acceptable if bias = 0 is possible at every size: the zero line lies inside the confidence band of the fitted line over
the whole range, and the t tests find neither slope nor intercept. A bias that is the same at all sizes is a bias.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtr

from app.core.spc.in_time import Test, decompose
from app.core.spc.refusal import Reason, Refused, checked
from app.core.spc.spread import mean_of, t_quantile
from app.core.spc.variation import varies


@dataclass(frozen=True, slots=True)
class Coefficient:
    """A coefficient of the line, its standard error, and the test against 0."""

    value: float
    standard_error: float
    t: float
    p_value: float


@dataclass(frozen=True, slots=True)
class Linearity:
    """bias = intercept + slope * reference. `biases`: the mean bias at each reference. s: scatter about the line.

    beside: F test of whether the biases lie beside the line (lack of fit); None of fewer than three references, or without
    repeats.
    """

    readings: int
    biases: dict[float, float]
    average_bias: float
    slope: Coefficient
    intercept: Coefficient
    r_squared: float
    s: float
    confidence: float
    beside: Test | None
    _mean: float
    _squares: float

    @property
    def by_size(self) -> bool:
        """Tell whether the bias differs by size: the slope differs from 0, or the biases do not lie on a line."""
        return self.slope.p_value < 1 - self.confidence or self.bent

    @property
    def bent(self) -> bool:
        """Tell whether the biases lie beside the line by more than the repeats scatter."""
        return self.beside is not None and self.beside.p_value < 1 - self.confidence

    @property
    def average_interval(self) -> tuple[float, float]:
        """Confidence interval of the average bias."""
        _line, low, high = self.line_at(self._mean)
        return low, high

    @property
    def biased_at(self) -> tuple[float, ...]:
        """References at which the band leaves 0 out."""
        return tuple(reference for reference in self.biases if self._beyond(reference) > 0)

    @property
    def holds_zero(self) -> bool:
        """Tell whether the zero line lies inside the band at every size from the smallest reference to the largest."""
        sizes = [min(self.biases), max(self.biases)]
        reach = self._reach**2 / self._squares
        if reach > self.slope.value**2:  # between the ends the line comes nearest to leaving its band here
            peak = self._mean + self.slope.value * self.average_bias / (reach - self.slope.value**2)
            sizes.append(min(max(peak, sizes[0]), sizes[1]))
        return all(self._beyond(size) <= 0 for size in sizes)

    @property
    def acceptable(self) -> bool:
        """Tell whether nothing speaks against a bias of 0 at every size."""
        return self.holds_zero and not self.by_size and not self.intercept.p_value < 1 - self.confidence

    @property
    def _reach(self) -> float:
        return t_quantile(self.readings - 2, self.confidence) * self.s

    def _beyond(self, reference: float) -> float:
        """By how much the square of the line exceeds that of half the band."""
        value, low, _high = self.line_at(reference)
        return value**2 - (value - low) ** 2

    def line_at(self, reference: float) -> tuple[float, float, float]:
        """The line at a size, and the confidence band of it there.

        Where the band leaves 0 out, the gauge is biased at that size.
        """
        value = self.intercept.value + self.slope.value * reference
        reach = self._reach * sqrt(1 / self.readings + (reference - self._mean) ** 2 / self._squares)
        return value, value - reach, value + reach


def linearity(studies: Mapping[float, ArrayLike], *, confidence: float = 0.95) -> Linearity:
    """Least squares over all readings; by reference size, the readings taken of it.

    Raises `Refused` for fewer than two references or three readings, and where nothing varies: repeats that are all the same
    at every reference are no evidence of a scatter of 0, and no test can be made of them.

    >>> line = linearity({2.0: [2.5, 2.5, 2.6], 4.0: [4.1, 4.2, 4.2], 6.0: [5.9, 5.8, 6.0]})
    >>> round(line.slope.value, 4), line.slope.p_value < 0.001
    (-0.1583, True)
    """
    if len(studies) < 2:
        raise Refused(Reason.INCOMPLETE_STUDY, have=len(studies), needed=2, what="references")
    samples = {float(reference): checked(values) for reference, values in studies.items()}
    x = np.concatenate([np.full(len(values), reference) for reference, values in samples.items()])
    y = np.concatenate([values - reference for reference, values in samples.items()])
    if len(x) < 3:
        raise Refused(Reason.TOO_FEW_READINGS, have=len(x), needed=3)
    middle, off = mean_of(x), x - mean_of(x)
    squares = float(off @ off)
    slope = float(off @ (y - y.mean())) / squares
    intercept = float(y.mean()) - slope * middle
    left = y - intercept - slope * x
    total = float(((y - y.mean()) ** 2).sum())
    if not varies(sqrt(float(left @ left)), x, x + y):
        raise Refused(Reason.NO_VARIATION, what="repeats" if len(x) > len(samples) else "")
    within = [values for values in samples.values() if len(values) > 1]
    if within and not any(varies(float(np.ptp(values)), values) for values in within):
        raise Refused(Reason.NO_VARIATION, what="repeats")
    biases = [values - reference for reference, values in samples.items()]
    repeated = len(samples) > 2 and len(x) > len(samples)
    s = sqrt(float(left @ left) / (len(x) - 2))
    return Linearity(
        readings=len(x),
        biases={reference: mean_of(values - reference) for reference, values in samples.items()},
        average_bias=float(y.mean()),
        slope=_tested(slope, s / sqrt(squares), len(x) - 2),
        intercept=_tested(intercept, s * sqrt(1 / len(x) + middle**2 / squares), len(x) - 2),
        r_squared=1 - float(left @ left) / total,
        s=s,
        confidence=confidence,
        beside=decompose(biases, list(samples)).beside_line if repeated else None,
        _mean=middle,
        _squares=squares,
    )


def _tested(value: float, error: float, freedom: int) -> Coefficient:
    return Coefficient(value, error, value / error, float(2 * stdtr(freedom, -abs(value / error))))
