"""Tests of normality: Anderson-Darling with the mean and sigma of the readings, and Shapiro-Wilk.

A test can speak against normality, never for it: with few readings hardly anything is rejected, with very many everything
is, because readings are rounded. What follows from a small p is the percentile method (`capability.percentile`), not doubt in the readings.
"""

from dataclasses import dataclass
from math import exp, log2

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import log_ndtr

from app.core.spc.refusal import Reason, Refused, checked
from app.core.spc.spread import summary
from app.core.spc.variation import varies

FEWEST_FOR_ANDERSON = 8  # D'Agostino and Stephens: their approximation holds from here on
FEWEST_FOR_SHAPIRO = 3
MOST_FOR_SHAPIRO = 5000  # Royston's approximation of the p-value goes no further


@dataclass(frozen=True, slots=True)
class Normality:
    """A test's statistic and p-value: the probability of one as far from normal by chance."""

    test: str
    statistic: float
    p_value: float
    readings: int


def anderson_darling(values: ArrayLike) -> Normality:
    """A^2 = -n - 1/n sum (2i - 1)(ln F(x_i) + ln(1 - F(x_n+1-i))), for unknown mean and sigma (case 3).

    p from A*^2 = A^2 (1 + 0.75/n + 2.25/n^2) (D'Agostino and Stephens, Goodness-of-fit techniques (1986), table 4.9).

    >>> test = anderson_darling([-1.3, -0.7, -0.4, -0.1, 0.1, 0.4, 0.7, 1.3])
    >>> round(test.statistic, 3), test.p_value > 0.5
    (0.095, True)
    """
    x = checked(values, at_least=FEWEST_FOR_ANDERSON)
    numbers = summary(x)
    if not numbers.standard_deviation or not varies(numbers.standard_deviation, x):
        raise Refused(Reason.NO_VARIATION)
    z = np.sort((x - numbers.mean) / numbers.standard_deviation)
    n = len(z)
    weights = 2 * np.arange(1, n + 1) - 1
    # Logarithms of the tails, so that a far outlier does not become ln 0.
    statistic = float(-n - (weights @ (log_ndtr(z) + log_ndtr(-z[::-1]))) / n)
    return Normality("anderson_darling", statistic, p_of(statistic * (1 + 0.75 / n + 2.25 / n**2)), n)


def p_of(a: float) -> float:
    """D'Agostino and Stephens (1986), table 4.9: the p-value that belongs to A*^2."""
    if a >= 10:  # beyond this the parabola would turn upward again
        return 0.0
    if a >= 0.6:
        return exp(1.2937 - 5.709 * a + 0.0186 * a * a)
    if a > 0.34:
        return exp(0.9177 - 4.279 * a - 1.38 * a * a)
    if a > 0.2:
        return 1 - exp(-8.318 + 42.796 * a - 59.938 * a * a)
    return 1 - exp(-13.436 + 101.14 * a - 223.73 * a * a)


def shapiro_wilk(values: ArrayLike) -> Normality:
    """W and its p-value (Royston 1995, algorithm AS R94), by SciPy. For 3 to 5000 readings.

    >>> shapiro_wilk([1.0, 2.0, 4.0]).statistic.__round__(4)
    0.9643
    """
    from scipy.stats import shapiro  # half a second and 45 MB that nothing else here needs

    x = checked(values, at_least=FEWEST_FOR_SHAPIRO)
    if len(x) > MOST_FOR_SHAPIRO:
        raise Refused(Reason.BEYOND_RANGE, have=len(x), needed=MOST_FOR_SHAPIRO)
    if not varies(float(np.ptp(x)), x):
        raise Refused(Reason.NO_VARIATION)
    # Centred and scaled by a power of two: the same W, and no digits lost on a large size.
    centred = x - np.median(x)
    result = shapiro(centred * 2.0 ** -round(log2(np.abs(centred).max())))
    return Normality("shapiro_wilk", float(result.statistic), float(result.pvalue), len(x))
