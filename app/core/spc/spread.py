"""Mean, spread and sigma of readings; every estimate of sigma says how it was made and what it is worth.

Two kinds of sigma are kept apart. *Within*: from differences between neighbours or inside subgroups, what the process
scatters by from part to part; control limits, Cp and Cpk are made of it. *Overall*: the standard deviation of everything,
drift and steps included; Pp and Ppk are made of it.

Degrees of freedom of an estimate that is not a root mean square are those of the chi-square distribution with the same
relative variance, 1 / (2 Var(sigma^) / sigma^2) (Patnaik 1950), so that intervals can be given for all.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from math import asin, pi, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import stdtrit

from app.core.spc.constants import c4, d2, d3
from app.core.spc.refusal import Floats, Reason, Refused, checked
from app.core.spc.variation import varies

Factor = Callable[[int], float]

STEP = 4.0
"""Ranges of neighbours of more than this many mean ranges are steps, not scatter: a new edge, an offset set by hand."""


class Estimator(StrEnum):
    """Method of estimating a sigma."""

    MOVING_RANGE = "moving_range"
    RANGES = "ranges"
    STANDARD_DEVIATIONS = "standard_deviations"
    POOLED = "pooled"
    OVERALL = "overall"
    GIVEN = "given"


@dataclass(frozen=True, slots=True)
class Sigma:
    """An estimate of sigma (in the unit of the readings), from `readings` values in `groups` differences or subgroups."""

    value: float
    estimator: Estimator
    readings: int
    groups: int
    degrees_of_freedom: float


@dataclass(frozen=True, slots=True)
class Summary:
    """Count, mean, sample standard deviation (n - 1; None for one reading), extremes and lag-1 autocorrelation."""

    count: int
    mean: float
    standard_deviation: float | None
    minimum: float
    maximum: float
    autocorrelation: float | None


def mean_of(values: Floats) -> float:
    """The mean, corrected once by the mean of what is left over, so that large offsets cost no digits."""
    first = float(values.mean())
    return first + float((values - first).mean())


def summary(values: ArrayLike) -> Summary:
    """Sum up readings.

    The autocorrelation is r1 = sum (x_i - m)(x_i+1 - m) / sum (x_i - m)^2, as NIST StRD certifies it.

    >>> s = summary([10000001, 10000003, 10000002])
    >>> s.mean, s.standard_deviation, s.autocorrelation
    (10000002.0, 1.0, -0.5)
    """
    x = checked(values)
    mean = mean_of(x)
    left = x - mean
    squares = float(left @ left)
    return Summary(
        count=len(x),
        mean=mean,
        standard_deviation=sqrt(squares / (len(x) - 1)) if len(x) > 1 else None,
        minimum=float(x.min()),
        maximum=float(x.max()),
        autocorrelation=float(left[:-1] @ left[1:]) / squares if varies(sqrt(squares / len(x)), x) else None,
    )


def overall(values: ArrayLike) -> Sigma:
    """The sample standard deviation, sqrt(sum (x - mean)^2 / (n - 1)). Not divided by c4: Pp and Ppk use it as it is.

    >>> overall([2, 4, 4, 4, 5, 5, 7, 9]).degrees_of_freedom
    7.0
    """
    x = checked(values, at_least=2)
    left = x - mean_of(x)
    return Sigma(sqrt(float(left @ left) / (len(x) - 1)), Estimator.OVERALL, len(x), 1, float(len(x) - 1))


def freedom_of_moving_ranges(n: int) -> float:
    """Of MR-bar/d2 over n readings: neighbouring ranges share a reading, so they are worth less than n - 1 ranges.

    Var|D| = 2 - 4/pi, Cov(|D1|, |D2|) = (4/pi)(sqrt(1 - r^2) + r asin r - 1) with r = -1/2 (Cryer and Ryan 1990,
    The estimation of sigma for an X chart, J. Qual. Technol. 22). Tends to 0.605 n.
    """
    m = n - 1
    variance = 2 - 4 / pi
    covariance = 4 / pi * (sqrt(0.75) - 0.5 * asin(-0.5) - 1)
    return m * m * (4 / pi) / (2 * (m * variance + 2 * (m - 1) * covariance))


def without_steps(ranges: Floats) -> Floats:
    """Ranges of neighbours without those beyond `STEP` times their mean, left out twice."""
    for _pass in range(2):
        if ranges.size:
            ranges = ranges[ranges <= STEP * ranges.mean()]
    return ranges


def t_quantile(freedom: float, confidence: float) -> float:
    """Student's t of a two-sided interval.

    >>> round(t_quantile(9, 0.95), 3)
    2.262
    """
    return float(stdtrit(freedom, (1 + confidence) / 2))


def moving_range(values: ArrayLike) -> Sigma:
    """Sigma from the mean moving range of neighbours, MR-bar / d2(2) (Montgomery, section 6.4).

    >>> round(moving_range([10, 12, 11, 13, 12]).value, 6)
    1.32934
    """
    x = checked(values, at_least=2)
    ranges = np.diff(x)
    value = float(np.abs(ranges, out=ranges).mean()) / d2(2)
    return Sigma(value, Estimator.MOVING_RANGE, len(x), len(x) - 1, freedom_of_moving_ranges(len(x)))


@dataclass(frozen=True, slots=True)
class Subgroups:
    """Readings in subgroups: sizes, means, ranges and standard deviations, one entry per subgroup.

    A subgroup of one has a mean but no range and no s (both 0 here) and counts for no sigma.
    """

    sizes: NDArray[np.int64]
    means: Floats
    ranges: Floats
    deviations: Floats

    def __len__(self) -> int:
        """Number of subgroups."""
        return len(self.sizes)


def subgroups(values: ArrayLike, sizes: int | ArrayLike) -> Subgroups:
    """Take readings, one after the other, into subgroups of one size or of the sizes named; what is left over is left out.

    >>> g = subgroups([10, 12, 11, 13, 15], [2, 3])
    >>> g.means.tolist(), g.ranges.tolist(), g.deviations.round(3).tolist()
    ([11.0, 13.0], [2.0, 4.0], [1.414, 2.0])
    """
    x = checked(values)
    lengths = np.asarray(sizes, dtype=np.int64)
    if lengths.ndim == 0:
        lengths = np.full(len(x) // max(int(lengths), 1), lengths)
    if len(lengths) == 0:
        raise Refused(Reason.TOO_FEW_SUBGROUPS, have=0, needed=1)
    if (lengths < 1).any() or lengths.sum() > len(x):
        raise ValueError(f"subgroups of {lengths.sum()} readings do not fit {len(x)}")
    x = x[: lengths.sum()]
    starts = np.concatenate(([0], np.cumsum(lengths)[:-1]))
    centred = x - mean_of(x)  # large offsets cost no digits
    means = np.add.reduceat(centred, starts) / lengths
    left = centred - np.repeat(means, lengths)
    squares = np.add.reduceat(left * left, starts)
    return Subgroups(
        sizes=lengths,
        means=means + mean_of(x),
        ranges=np.maximum.reduceat(x, starts) - np.minimum.reduceat(x, starts),
        deviations=np.sqrt(squares / np.maximum(lengths - 1, 1)),
    )


def from_ranges(groups: Subgroups) -> Sigma:
    """Sigma from subgroup ranges: each R/d2(n), weighted by d2^2/d3^2; R-bar/d2 where all sizes are equal.

    Burr (1969), Control charts for measurements with varying sample sizes, J. Qual. Technol. 1: the unbiased estimate
    of least variance among weighted means.
    """
    return _weighted(groups, groups.ranges, Estimator.RANGES, mean=d2, deviation=d3)


def from_deviations(groups: Subgroups) -> Sigma:
    """Sigma from subgroup standard deviations: each s/c4(n), weighted by c4^2/(1 - c4^2); s-bar/c4 for equal sizes (Burr 1969)."""
    return _weighted(
        groups,
        groups.deviations,
        Estimator.STANDARD_DEVIATIONS,
        mean=c4,
        deviation=lambda n: sqrt(1 - c4(n) ** 2),
    )


def pooled(groups: Subgroups) -> Sigma:
    """Sigma as the root of the mean variance inside subgroups, sqrt(sum (n-1)s^2 / sum (n-1)) (Montgomery, eq. 6.31)."""
    _usable(groups)
    freedom = float((groups.sizes - 1).sum())
    squares = float(((groups.sizes - 1) * groups.deviations**2).sum())
    return Sigma(sqrt(squares / freedom), Estimator.POOLED, int(groups.sizes.sum()), len(groups), freedom)


def _usable(groups: Subgroups) -> NDArray[np.bool_]:
    usable = groups.sizes > 1
    if not usable.any():
        raise Refused(Reason.TOO_FEW_SUBGROUPS, have=0, needed=1)
    return usable


def _weighted(groups: Subgroups, statistic: Floats, estimator: Estimator, *, mean: Factor, deviation: Factor) -> Sigma:
    usable = _usable(groups)
    sizes, where = np.unique(groups.sizes[usable], return_inverse=True)
    means = np.array([mean(int(n)) for n in sizes])[where]
    worth = (means / np.array([deviation(int(n)) for n in sizes])[where]) ** 2
    value = float((worth * statistic[usable] / means).sum() / worth.sum())
    # Var(sigma^)/sigma^2 = 1 / sum of the worths.
    return Sigma(value, estimator, int(groups.sizes[usable].sum()), int(usable.sum()), float(worth.sum()) / 2)
