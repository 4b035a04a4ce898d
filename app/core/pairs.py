"""Paired readings: the same part on the machine and on an external gauge (micrometer, CMM); domain §5.

Each pair says how much the machine reads too much: d = machine reading - true value. Their mean is the empirical value;
its confidence interval says how well it is known.
"""

from collections.abc import Sequence
from math import sqrt
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from app.core.decision.limits import nanometres
from app.core.decision.step import DECIMALS, rounded
from app.core.spc.resolution import resolution_of
from app.core.spc.spread import t_quantile

FEWEST = 5
"""Pairs before an empirical value is suggested. With two, t = 12.7 makes the interval useless; with five it is 2.8."""
FEWEST_FOR_OUTLIER = 3


class Comparison(NamedTuple):
    """Comparison of pairs of sizes; mm.

    pairs: how many. mean and deviation (the sample's standard deviation) are None without enough pairs; low and high bound the mean.
    outlier: which pair, from 0, stands out; only a hint. missing: how many more pairs a suggestion needs.
    suggested: the empirical value to accept; None while pairs are missing, when the one in effect lies inside the
    interval, for then they agree with it, and when all differences are the same. equal: they are, so that they say nothing of
    how well the mean is known; low and high are None. step: smallest distance between two of them, where rounding alone
    decides on the interval because it is larger than their scatter; else None.
    """

    pairs: int
    confidence: float
    mean: float | None
    deviation: float | None
    low: float | None
    high: float | None
    outlier: int | None
    missing: int
    suggested: float | None
    equal: bool = False
    step: float | None = None


def compare(differences: Sequence[float], *, empirical_value: float, confidence: float = 0.95) -> Comparison:
    """Mean difference with its Student t interval: mean ± t(1 - (1 - confidence)/2, n - 1) s/√n.

    Source: NIST/SEMATECH e-Handbook 1.3.5.2, confidence limits for the mean, on the differences of the pairs. Where these
    differ by steps larger than s the gauge rounds more than the parts scatter: the mean is known to half a step at best.

    >>> compare([0.002, 0.003], empirical_value=0.0).missing
    3
    """
    count = len(differences)
    missing = max(0, FEWEST - count)
    if count == 0:
        return Comparison(0, confidence, None, None, None, None, None, missing, None)
    mean = float(np.mean(differences))
    if count == 1:
        return Comparison(1, confidence, rounded(mean), None, None, None, None, missing, None)
    deviation = float(np.std(differences, ddof=1))
    resolution = resolution_of(np.round(differences, DECIMALS))
    if resolution.distinct == 1:
        return Comparison(count, confidence, rounded(mean), 0.0, None, None, None, missing, None, equal=True)
    half = t_quantile(count - 1, confidence) * deviation / sqrt(count)
    step = resolution.step if resolution.coarse(deviation) and resolution.step / 2 > half else None
    half = max(half, (step or 0.0) / 2)
    low, high = rounded(mean - half), rounded(mean + half)
    agrees = nanometres(low) <= nanometres(empirical_value) <= nanometres(high)
    return Comparison(
        count,
        confidence,
        rounded(mean),
        rounded(deviation),
        low,
        high,
        outlier(differences),
        missing,
        None if missing or agrees else rounded(mean),
        step=step,
    )


def outlier(differences: Sequence[float], significance: float = 0.05) -> int | None:
    """The one value that does not belong to the others, by Grubbs' test (two-sided), or None.

    G = max|d - mean| / s is compared with (n-1)/√n √(t²/(n - 2 + t²)), t = t(1 - significance/(2n), n - 2).
    Source: NIST/SEMATECH e-Handbook 1.3.5.17.1.

    >>> outlier([199.31, 199.53, 200.19, 200.82, 201.92, 201.95, 202.18, 245.57])
    7
    """
    count = len(differences)
    if count < FEWEST_FOR_OUTLIER:
        return None
    values = np.asarray(differences)
    spread = float(np.std(values, ddof=1))
    if nanometres(spread) == 0:
        return None
    distances = np.abs(values - values.mean()) / spread
    furthest = int(np.argmax(distances))
    return furthest if distances[furthest] > grubbs_limit(count, significance) else None


def grubbs_limit(count: int, significance: float = 0.05) -> float:
    """The two-sided critical value of Grubbs' test for N values.

    >>> round(grubbs_limit(8), 3)
    2.127
    """
    t = float(stdtrit(count - 2, 1 - significance / (2 * count)))
    return (count - 1) / sqrt(count) * sqrt(t * t / (count - 2 + t * t))
