"""Statistical tolerance intervals: where a share of all parts lies, with a confidence, though only some were measured.

=============  ====================================================================================
one-sided      x + k s, k = t'(confidence; n - 1, z(share) sqrt n) / sqrt n, exact by the non-central t
two-sided      x -/+ k s, exact: E P(chi2 >= (n - 1) r(Z)^2 / k^2) = confidence, Z the error of the mean
by Howe        k = z((1 + share)/2) sqrt((1 + 1/n)(n - 1)/chi2(1 - confidence; n - 1)), the usual approximation
without shape  the smallest and the largest reading, for readings that are not normal
=============  ====================================================================================

Sources: ISO 16269-6 (2014); W. G. Howe, Two-sided tolerance limits for normal populations, J. Am. Stat. Assoc. 64 (1969);
NIST/SEMATECH e-Handbook of Statistical Methods, section 7.2.6.3; S. S. Wilks, Ann. Math. Stat. 12 (1941) for the extremes.
"""

from dataclasses import dataclass
from enum import StrEnum
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import bdtr, gammaincc, gammainccinv, gammaincinv, ndtr, ndtri

from app.core.spc.constants import NODES, WEIGHTS
from app.core.spc.refusal import Reason, Refused, checked
from app.core.spc.resolution import must_resolve
from app.core.spc.spread import mean_of, overall

FEWEST = 2


class Method(StrEnum):
    """The way in which an interval was made."""

    NORMAL = "normal"
    EXTREMES = "extremes"


@dataclass(frozen=True, slots=True)
class ToleranceInterval:
    """An interval in which at least `share` of all parts lies, with `confidence`, in the unit of the readings; None where it has no end.

    k: factor of the standard deviation, None without a shape. reached: the confidence that the extremes give.
    """

    readings: int
    share: float
    confidence: float
    method: Method
    low: float | None
    high: float | None
    k: float | None
    reached: float


def k_one_sided(readings: int, share: float, confidence: float) -> float:
    """Factor of a one-sided interval, exact.

    >>> round(k_one_sided(10, 0.95, 0.95), 3), round(k_one_sided(43, 0.90, 0.99), 3)
    (2.911, 1.874)
    """
    freedom, noncentrality = _freedom(readings), float(ndtri(share)) * sqrt(readings)
    low, high = (sqrt(2 * float(gammaincinv(freedom / 2, q)) / freedom) for q in (1e-15, 1 - 1e-15))
    s = (low + high) / 2 + (high - low) / 2 * NODES
    logarithm = (freedom - 1) * np.log(s) - s * s * freedom / 2  # of the density of s, but for a constant
    density = WEIGHTS * np.exp(logarithm - logarithm.max())
    density /= density.sum()

    def away(t: float) -> float:
        return float(density @ ndtr(t * s - noncentrality)) - confidence

    reach = (abs(noncentrality) + 12) / low
    return float(brentq(away, -reach, reach)) / sqrt(readings)


def k_two_sided(readings: int, share: float, confidence: float) -> float:
    """Factor of a two-sided interval, exact.

    >>> round(k_two_sided(10, 0.95, 0.95), 3), round(k_two_sided(43, 0.90, 0.99), 3)
    (3.393, 2.223)
    """
    freedom = _freedom(readings)
    z = 4.5 * (NODES + 1)  # error of the mean, in its own sigma; both signs are alike
    weights = 9.0 * WEIGHTS * np.exp(-z * z / 2) / sqrt(2 * np.pi)
    off = z / sqrt(readings)
    r = off + float(ndtri(share))  # holds the share where one tail alone is beyond; Newton's method from there
    for _round in range(50):
        excess = ndtr(off + r) - ndtr(off - r) - share
        step = excess * sqrt(2 * np.pi) / (np.exp(-((off + r) ** 2) / 2) + np.exp(-((off - r) ** 2) / 2))
        r = r - step
        if np.abs(step).max() < 1e-12:
            break

    def away(k: float) -> float:
        return float(weights @ gammaincc(freedom / 2, freedom * r * r / (2 * k * k))) - confidence

    near = k_by_howe(readings, share, confidence)
    return float(brentq(away, near / 3, near * 3))


def k_by_howe(readings: int, share: float, confidence: float) -> float:
    """Factor of a two-sided interval by Howe's approximation, as many tables have it.

    >>> round(k_by_howe(43, 0.90, 0.99), 4)
    2.2173
    """
    freedom = _freedom(readings)
    chi_square = 2 * float(gammainccinv(freedom / 2, confidence))
    return float(ndtri((1 + share) / 2)) * sqrt((1 + 1 / readings) * freedom / chi_square)


def confidence_of_extremes(readings: int, share: float, *, sides: int) -> float:
    """Confidence that the extremes (sides: 2), or the largest reading alone (1), bound the share, whatever the distribution.

    >>> round(confidence_of_extremes(93, 0.95, sides=2), 4), round(confidence_of_extremes(59, 0.95, sides=1), 4)
    (0.95, 0.9515)
    """
    return 1 - float(bdtr(float(sides - 1), readings, 1 - share))


def fewest_for_extremes(share: float, confidence: float, *, sides: int) -> int:
    """Number of readings from which on the extremes are enough.

    >>> fewest_for_extremes(0.95, 0.95, sides=2), fewest_for_extremes(0.99, 0.95, sides=2), fewest_for_extremes(0.95, 0.95, sides=1)
    (93, 473, 59)
    """
    n = max(2, int(np.log(1 - confidence) / np.log(share)))
    while confidence_of_extremes(n, share, sides=sides) < confidence:
        n += 1 + n // 2000
    while n > sides and confidence_of_extremes(n - 1, share, sides=sides) >= confidence:
        n -= 1
    return n


def tolerance_interval(
    values: ArrayLike,
    share: float,
    confidence: float,
    *,
    lower: bool = True,
    upper: bool = True,
    normal: bool = True,
) -> ToleranceInterval:
    """The interval that holds a share of all parts. lower, upper: ends that it has.

    Of readings that are not normal it goes from the smallest to the largest, if there are enough of them: raises `Refused` with
    the number that it takes, and for readings that do not vary.

    >>> found = tolerance_interval([10.0, 12, 11, 13, 12, 9, 11, 12, 10, 10], 0.95, 0.95)
    >>> round(found.low, 3), round(found.high, 3)
    (6.768, 15.232)
    """
    if not (0 < share < 1 and 0 < confidence < 1):
        raise ValueError("share and confidence lie between 0 and 1")
    x = checked(values, at_least=FEWEST)
    sides = 2 if lower and upper else 1
    must_resolve(x)
    if not normal:
        needed = fewest_for_extremes(share, confidence, sides=sides)
        if len(x) < needed:
            raise Refused(Reason.TOO_FEW_READINGS, have=len(x), needed=needed)
        reached = confidence_of_extremes(len(x), share, sides=sides)
        low, high = float(x.min()), float(x.max())
        method, k = Method.EXTREMES, None
    else:
        k = (k_two_sided if sides == 2 else k_one_sided)(len(x), share, confidence)
        mean, s = mean_of(x), overall(x).value
        low, high, method, reached = mean - k * s, mean + k * s, Method.NORMAL, confidence
    return ToleranceInterval(
        len(x), share, confidence, method, low if lower else None, high if upper else None, k, reached
    )


def _freedom(readings: int) -> int:
    if readings < FEWEST:
        raise Refused(Reason.TOO_FEW_READINGS, have=readings, needed=FEWEST)
    return readings - 1
