"""Capability: how wide the tolerance is, measured by the spread of the process.

========  ==============================================================================
Cp, Pp    (upper - lower) / (6 sigma)                                   two-sided limits only
Cpk, Ppk  min((upper - mean), (mean - lower)) / (3 sigma)               the sides there are
Cpm       (upper - lower) / (6 sqrt(s^2 + (mean - target)^2))           two-sided, with a target
========  ==============================================================================

Cp and Cpk take the sigma within (what the process could do), Pp, Ppk and Cpm the overall one (what it did). Sources:
Montgomery, chapter 8; Kotz and Johnson, Process capability indices (1993); ISO 22514-2 for the percentile method;
R. H. Kushler and P. Hurley, Confidence bounds for capability indices, J. Qual. Technol. 24 (1992) for the intervals.
Readings far from all others are named by `outliers`; what an index is quoted by, `quoting` decides.
"""

from dataclasses import dataclass
from enum import StrEnum
from math import inf, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import bdtr, bdtrc, gammaincinv, ndtr, ndtri

from app.core.spc.constants import NODES, WEIGHTS
from app.core.spc.normality import FEWEST_FOR_ANDERSON, anderson_darling
from app.core.spc.refusal import Floats, Reason, Refused, checked
from app.core.spc.resolution import must_resolve
from app.core.spc.spread import Estimator, Sigma, mean_of, moving_range, overall
from app.core.spc.variation import varies

FEWEST_READINGS = 20
"""Below it there is no index at all: with 20 readings the interval of Cp already reaches from 0.69 to 1.31 of it."""
ENOUGH_READINGS = 100
"""ISO 22514-2 asks for 100 readings and more for a preliminary number."""
ENOUGH_FOR_PERCENTILES = 1000
"""Fewer readings hold on average less than 1.35 values beyond each of the 0.135 % percentiles."""
BELOW, ABOVE = 0.00135, 0.99865
"""The percentiles that take the place of -3 sigma and +3 sigma (ISO 22514-2: X0.135 % and X99.865 %)."""
CAPABLE, VERY_CAPABLE = 1.33, 1.67
"""What is usually asked for (ISO 22514-2, AIAG): four sigma to each limit, five for safety-critical characteristics and machine performance."""


TINY = 1e-300


class Caution(StrEnum):
    """Caution that belongs to a number."""

    FEW_READINGS = "few_readings"
    NOT_IN_CONTROL = "not_in_control"
    NOT_NORMAL = "not_normal"
    FEW_FOR_PERCENTILES = "few_for_percentiles"
    COMPENSATED = "compensated"
    COARSE = "coarse"


@dataclass(frozen=True, slots=True)
class Limits:
    """Specification limits in the unit of the readings; None where a side has none."""

    lower: float | None
    upper: float | None
    target: float | None = None

    def __post_init__(self) -> None:
        """Refuse limits that limit nothing, or that are crossed."""
        if self.lower is None and self.upper is None:
            raise Refused(Reason.NO_LIMITS)
        if self.lower is not None and self.upper is not None and not self.lower < self.upper:
            raise Refused(Reason.LIMITS_CROSSED)


@dataclass(frozen=True, slots=True)
class Index:
    """A capability index with its two-sided confidence interval; the method of the interval in `interval`."""

    value: float
    low: float | None
    high: float | None
    interval: str | None


@dataclass(frozen=True, slots=True)
class Capability:
    """Everything said of one set of readings; an index is None where the limits do not define it.

    ppm: parts per million expected out of tolerance under a normal distribution; observed: counted.
    """

    readings: int
    mean: float
    within: Sigma
    overall: Sigma
    confidence: float
    cp: Index | None
    cpk: Index
    pp: Index | None
    ppk: Index
    cpm: Index | None
    ppm_within: float
    ppm_overall: float
    ppm_observed: float
    cautions: tuple[Caution, ...]


def capability(
    values: ArrayLike,
    limits: Limits,
    *,
    within: Sigma | None = None,
    confidence: float = 0.95,
    minimum: int = FEWEST_READINGS,
    cautions: tuple[Caution, ...] = (),
) -> Capability:
    """All indices. `within`: sigma from subgroups; without it the mean moving range gives it.

    `cautions`: what the caller knows (a compensated process, a chart of its own that is out of control); passed on with what
    is found here: few readings, a step between them that is coarse, more of them beyond 3 sigma than chance explains, a distribution that is not normal.

    Raises `Refused` for too few readings, and for those that do not vary or are too coarse to tell of a spread.

    >>> c = capability([10, 12, 11, 13, 12], Limits(6, 16), minimum=5)
    >>> round(c.cp.value, 4), round(c.cpk.value, 4), round(c.pp.value, 4), round(c.ppk.value, 4)
    (1.2538, 1.1033, 1.4618, 1.2864)
    """
    if not 0 < confidence < 1:
        raise ValueError(f"a confidence lies between 0 and 1, not at {confidence}")
    x = checked(values, at_least=max(2, minimum))
    mean, total = mean_of(x), overall(x)
    inner = within or moving_range(x)
    numbers = [limit for limit in (limits.lower, limits.upper) if limit is not None]
    if not (varies(total.value, x, numbers) and varies(inner.value, x, numbers)):
        raise Refused(Reason.NO_VARIATION)
    resolution = must_resolve(x, scale=max(map(abs, numbers)))
    warnings = [*cautions]
    if resolution.coarse(inner.value, None if len(numbers) < 2 else numbers[1] - numbers[0]):
        warnings.append(Caution.COARSE)
    if len(x) < ENOUGH_READINGS:
        warnings.append(Caution.FEW_READINGS)
    if not in_control(x, mean, inner):
        warnings.append(Caution.NOT_IN_CONTROL)
    if not looks_normal(x):
        warnings.append(Caution.NOT_NORMAL)
    return Capability(
        readings=len(x),
        mean=mean,
        within=inner,
        overall=total,
        confidence=confidence,
        cp=spread_index(limits, inner, confidence),
        cpk=_centred_index(limits, mean, inner, len(x), confidence),
        pp=spread_index(limits, total, confidence),
        ppk=_centred_index(limits, mean, total, len(x), confidence),
        cpm=target_index(limits, mean, total, len(x), confidence),
        ppm_within=expected_ppm(limits, mean, inner.value),
        ppm_overall=expected_ppm(limits, mean, total.value),
        ppm_observed=observed_ppm(limits, x),
        cautions=tuple(dict.fromkeys(warnings)),
    )


def spread_index(limits: Limits, sigma: Sigma, confidence: float) -> Index | None:
    """Cp or Pp. Interval: value sqrt(chi2(q, df)/df), exact for the root of a variance (Montgomery, eq. 8.20)."""
    if limits.lower is None or limits.upper is None:
        return None
    value = (limits.upper - limits.lower) / (6 * sigma.value)
    low, high = _chi_square(value, sigma.degrees_of_freedom, confidence)
    return Index(value, low, high, "chi_square")


def _chi_square(value: float, freedom: float, confidence: float) -> tuple[float, float]:
    tail = (1 - confidence) / 2
    return (
        value * sqrt(_chi2(tail, freedom) / freedom),
        value * sqrt(_chi2(1 - tail, freedom) / freedom),
    )


def _chi2(share: float, freedom: float) -> float:
    """The quantile of chi-square: twice that of a gamma distribution with half the degrees of freedom."""
    return 2 * float(gammaincinv(freedom / 2, share))


def _centred_index(limits: Limits, mean: float, sigma: Sigma, readings: int, confidence: float) -> Index:
    """Cpk or Ppk. One-sided limits have an exact interval (non-central t); two-sided ones that of Bissell.

    Bissell (1990), How reliable is your capability index?, Appl. Stat. 39: value -/+ z sqrt(1/(9n) + value^2/(2 df)).
    """
    sides = []
    if limits.upper is not None:
        sides.append((limits.upper - mean) / (3 * sigma.value))
    if limits.lower is not None:
        sides.append((mean - limits.lower) / (3 * sigma.value))
    value = min(sides)
    if len(sides) == 1:
        low, high = _noncentral(value, readings, sigma.degrees_of_freedom, confidence)
        return Index(value, low, high, "noncentral_t")
    reach = float(-ndtri((1 - confidence) / 2)) * sqrt(1 / (9 * readings) + value**2 / (2 * sigma.degrees_of_freedom))
    return Index(value, value - reach, value + reach, "bissell")


def ppk_of(limits: Limits, mean: float, sigma: float, readings: int, confidence: float = 0.95) -> Index:
    """Ppk from what is known of readings: their mean, standard deviation and number.

    >>> found = ppk_of(Limits(-0.008, 0.008), 0.001, 0.002, 100)
    >>> round(found.value, 3), round(found.low, 3)
    (1.167, 0.992)
    """
    return _centred_index(
        limits, mean, Sigma(sigma, Estimator.OVERALL, readings, 1, readings - 1.0), readings, confidence
    )


def _noncentral(value: float, readings: int, freedom: float, confidence: float) -> tuple[float, float]:
    """Exact: 3 sqrt(n) C^ is a non-central t with df degrees of freedom and non-centrality 3 sqrt(n) C (Chou, Owen and Borrego 1990).

    P(T <= t) = E Phi(t S - non-centrality) over S = sqrt(chi2/df), by Gauss-Legendre over all of S that has a weight.
    """
    scale = 3 * sqrt(readings)
    near, tail = value * scale, (1 - confidence) / 2
    low, high = (sqrt(_chi2(q, freedom) / freedom) for q in (1e-15, 1 - 1e-15))
    s = (low + high) / 2 + (high - low) / 2 * NODES
    logarithm = (freedom - 1) * np.log(s) - s * s * freedom / 2  # of the density of S, but for a constant
    density = WEIGHTS * np.exp(logarithm - logarithm.max())
    density /= density.sum()

    def bound(share: float) -> float:
        def away(noncentrality: float) -> float:
            return float(density @ ndtr(near * s - noncentrality)) - share

        return float(brentq(away, min(near * low, near * high) - 12, max(near * low, near * high) + 12)) / scale

    return bound(1 - tail), bound(tail)


def target_index(limits: Limits, mean: float, sigma: Sigma, readings: int, confidence: float) -> Index | None:
    """Cpm (Taguchi's index; Chan, Cheng and Spiring 1988), for the target, else the middle of the tolerance.

    With tau^2 = s^2 + (mean - target)^2, s as for Pp. Interval: chi-square with the degrees of freedom
    n (1 + d^2)^2 / (1 + 2 d^2), d = (mean - target)/s (Boyles 1991, The Taguchi capability index, J. Qual. Technol. 23).
    """
    if limits.lower is None or limits.upper is None:
        return None
    target = (limits.lower + limits.upper) / 2 if limits.target is None else limits.target
    off = (mean - target) / sigma.value
    value = (limits.upper - limits.lower) / (6 * sigma.value * sqrt(1 + off * off))
    freedom = readings * (1 + off * off) ** 2 / (1 + 2 * off * off)
    low, high = _chi_square(value, freedom, confidence)
    return Index(value, low, high, "boyles")


class Fallout(NamedTuple):
    """Parts per million beyond each limit; 0 where there is none."""

    below: float
    above: float

    @property
    def total(self) -> float:
        """Beyond either."""
        return self.below + self.above


def expected(limits: Limits, mean: float, sigma: float) -> Fallout:
    """Parts per million beyond the limits under a normal distribution.

    >>> expected(Limits(-3.0, None), 0.5, 1.0).below.__round__(1)
    232.6
    """
    return Fallout(
        0.0 if limits.lower is None else float(ndtr(-(mean - limits.lower) / sigma)) * 1e6,
        0.0 if limits.upper is None else float(ndtr(-(limits.upper - mean) / sigma)) * 1e6,
    )


def expected_ppm(limits: Limits, mean: float, sigma: float) -> float:
    """Parts per million beyond either limit under a normal distribution.

    >>> round(expected_ppm(Limits(-3.0, 3.0), 0.0, 1.0), 1)
    2699.8
    """
    return expected(limits, mean, sigma).total


def observed(limits: Limits, values: Floats) -> Fallout:
    """Parts per million that were beyond the limits; a value on a limit is good."""
    below = 0 if limits.lower is None else int((values < limits.lower).sum())
    above = 0 if limits.upper is None else int((values > limits.upper).sum())
    return Fallout(below / len(values) * 1e6, above / len(values) * 1e6)


def observed_ppm(limits: Limits, values: Floats) -> float:
    """Parts per million that were beyond either limit."""
    return observed(limits, values).total


def in_control(values: Floats, mean: float, within: Sigma) -> bool:
    """True if no more readings lie beyond 3 sigma than chance brings in 999 of 1000 cases (binomial, 0.27 % each)."""
    beyond = int((np.abs(values - mean) > 3 * within.value).sum())
    return float(bdtrc(beyond - 1, len(values), 2 * ndtr(-3.0))) > 0.001


def looks_normal(values: Floats) -> bool:
    """True if Anderson-Darling leaves p >= 0.005, on at most 5000 readings taken evenly: of more, rounding alone would be seen."""
    if len(values) < FEWEST_FOR_ANDERSON:
        return True
    at = np.linspace(0, len(values) - 1, min(len(values), 5000)).round().astype(np.int64)
    return anderson_darling(values[at]).p_value >= 0.005


@dataclass(frozen=True, slots=True)
class PercentileCapability:
    """Ppk and Pp without a distribution: from the percentiles that hold the middle 99.73 % of the readings.

    ppk.low is None where no reading bounds the outer percentile from beyond: of fewer than 2731 readings, at 95 %.
    """

    readings: int
    median: float
    low: float
    high: float
    pp: float | None
    ppk: Index
    ppm_observed: float
    cautions: tuple[Caution, ...]


def of_percentiles(low: float, median: float, high: float, limits: Limits) -> tuple[float | None, float]:
    """Pp and Ppk of X0.135, X50 and X99.865; no Pp without both limits.

    >>> of_percentiles(-1.0, 0.0, 3.0, Limits(-2.0, 3.0))
    (1.25, 1.0)
    """
    upper = inf if limits.upper is None else (limits.upper - median) / (high - median)
    lower = inf if limits.lower is None else (median - limits.lower) / (median - low)
    both = None if limits.lower is None or limits.upper is None else (limits.upper - limits.lower) / (high - low)
    return both, min(upper, lower)


def percentile(
    values: ArrayLike, limits: Limits, *, confidence: float = 0.95, minimum: int = ENOUGH_READINGS
) -> PercentileCapability:
    """ISO 22514-2: Pp = (U - L)/(X99.865 - X0.135), Ppk = min((U - X50)/(X99.865 - X50), (X50 - L)/(X50 - X0.135)).

    Percentiles of the readings as they are, median-unbiased (Hyndman and Fan, type 8). Of fewer than 1000 readings they are
    hardly more than the extremes, and the result says so.

    >>> c = percentile(np.arange(2001.0), Limits(-500, 2500))
    >>> round(c.median), round(c.ppk.value, 3), c.ppk.low, round(c.ppk.high, 3)
    (1000, 1.503, None, 1.509)
    """
    x = np.sort(checked(values, at_least=max(2, minimum)))
    low, median, high = (float(quantile) for quantile in np.quantile(x, [BELOW, 0.5, ABOVE], method="median_unbiased"))
    must_resolve(x, scale=max(abs(limit) for limit in (limits.lower, limits.upper) if limit is not None))
    if not low < median < high:
        raise Refused(Reason.UNRESOLVED)
    pp, ppk = of_percentiles(low, median, high, limits)
    return PercentileCapability(
        readings=len(x),
        median=median,
        low=low,
        high=high,
        pp=pp,
        ppk=_between_order_statistics(x, median, limits, ppk, confidence),
        ppm_observed=observed_ppm(limits, x),
        cautions=(Caution.FEW_FOR_PERCENTILES,) if len(x) < ENOUGH_FOR_PERCENTILES else (),
    )


def order_statistics(share: float, readings: int, confidence: float) -> tuple[int | None, int | None]:
    """Places, from 0, of the ordered readings between which the quantile of a share below one half lies, with this confidence.

    Exact for any distribution, binomial, half of the doubt on each side (Hahn and Meeker, Statistical intervals (1991),
    section 5.2); None where no reading is far enough out.

    >>> order_statistics(0.5, 10, 0.95), order_statistics(0.00135, 3000, 0.95)
    ((1, 8), (0, 8))
    """
    doubt = (1 - confidence) / 2
    most = min(readings, int(readings * share + 12 * sqrt(readings * share) + 40))
    below = bdtr(np.arange(most, dtype=np.float64), readings, share)  # P(at most N readings below the quantile)
    inner = int(np.searchsorted(below, 1 - doubt))
    outer = int(np.searchsorted(below, doubt, side="right")) - 1
    return outer if outer >= 0 else None, inner if inner < readings else None


def _between_order_statistics(x: Floats, median: float, limits: Limits, ppk: float, confidence: float) -> Index:
    """Ppk with the interval that the order statistics leave to each outer percentile; the median is taken as known.

    Its variance is a fortieth of theirs.
    """
    places = order_statistics(BELOW, len(x), confidence)
    sides = []
    for limit, outwards in ((limits.upper, x[::-1]), (limits.lower, x)):
        if limit is not None:
            distances = (inf if place is None else abs(float(outwards[place]) - median) for place in places)
            room = limit - median if limit is limits.upper else median - limit
            sides.append(sorted(room / max(distance, TINY) for distance in distances))
    low, high = (min(side) for side in zip(*sides, strict=True))
    return Index(
        ppk, low if places[0] is not None or low < 0 else None, high if abs(high) < 1e100 else None, "order_statistics"
    )
