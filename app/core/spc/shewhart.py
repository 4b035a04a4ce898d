"""Shewhart's control charts: individuals and moving range, X-bar with R or s, of subgroups of any sizes.

First a baseline, once, from readings that a person has chosen; then charts, which judge any readings by it and estimate
nothing. Formulas: NIST/SEMATECH e-Handbook 6.3.2; Montgomery, chapter 6.

    >>> baseline = individuals_baseline([49.6, 47.6, 49.9, 51.3, 47.8, 51.2, 52.6, 52.4, 53.6, 52.1], minimum=10)
    >>> chart = individuals(baseline, [50.2, 56.1])
    >>> round(chart.lower, 4), round(chart.upper, 4), chart.outside.tolist()
    (45.8176, 55.8024, [False, True])
"""

from dataclasses import dataclass
from enum import StrEnum
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from app.core.spc.constants import c4, d2, d3
from app.core.spc.refusal import Floats, Reason, Refused, checked
from app.core.spc.spread import (
    Estimator,
    Factor,
    Sigma,
    Subgroups,
    from_deviations,
    from_ranges,
    mean_of,
    moving_range,
    pooled,
)
from app.core.spc.variation import varies

FEWEST_READINGS = 20
"""Individuals: below it there are no limits. Sigma would be uncertain by a fifth and more."""
FEWEST_SUBGROUPS = 20
"""X-bar charts: 20 to 25 subgroups are asked for since Shewhart (Montgomery, section 6.2)."""
ENOUGH_READINGS = 100
"""Fewer readings than this give limits that are marked as provisional."""


class Chart(StrEnum):
    """The kinds of control chart."""

    INDIVIDUALS = "individuals"
    MOVING_RANGE = "moving_range"
    XBAR = "xbar"
    RANGES = "ranges"
    DEVIATIONS = "deviations"
    EWMA = "ewma"
    MOVING_AVERAGE = "moving_average"
    CUSUM = "cusum"


@dataclass(frozen=True, slots=True)
class Baseline:
    """Centre and sigma that judge later readings, and the distance of the limits from the centre (in sigma).

    `provisional`: made of fewer than 100 readings.
    """

    centre: float
    sigma: Sigma
    width: float = 3.0
    provisional: bool = False


@dataclass(frozen=True, slots=True)
class ControlChart:
    """A chart: its points, and the centre and limits they are judged by (single numbers, or one per point).

    z: how far each point lies from the centre in standard deviations of what is plotted. Where the limits are not
    symmetric (ranges) it is stretched so that they lie at -width and +width; so the limits are always |z| = width.
    """

    chart: Chart
    points: Floats
    centre: float | Floats
    lower: float | Floats
    upper: float | Floats
    z: Floats
    baseline: Baseline

    @property
    def outside(self) -> NDArray[np.bool_]:
        """Mask of the points beyond a limit; a point on it is not beyond."""
        return (self.points > self.upper) | (self.points < self.lower)


def given(centre: float, sigma: float, width: float = 3.0) -> Baseline:
    """A baseline that is known from elsewhere: a standard, a former study."""
    if not (sigma > 0 and varies(sigma, centre)):
        raise Refused(Reason.NO_VARIATION)
    return Baseline(centre, Sigma(sigma, Estimator.GIVEN, 0, 0, float("inf")), width)


def individuals_baseline(values: ArrayLike, *, minimum: int = FEWEST_READINGS, width: float = 3.0) -> Baseline:
    """Centre = mean, sigma = mean moving range / d2(2).

    Raises `Refused`: fewer readings than `minimum`, or all of them equal, which says that the gauge does not resolve
    the process, not that it does not vary.
    """
    x = checked(values, at_least=max(2, minimum))
    return _baseline(mean_of(x), moving_range(x), width, x)


def subgroup_baseline(
    groups: Subgroups,
    estimator: Estimator = Estimator.RANGES,
    *,
    minimum: int = FEWEST_SUBGROUPS,
    width: float = 3.0,
) -> Baseline:
    """Centre = mean of all readings, sigma from ranges, standard deviations or pooled variances inside the subgroups.

    minimum: subgroups of two readings or more; those of one tell nothing of sigma.
    """
    telling = int((groups.sizes > 1).sum())
    if telling < minimum:
        raise Refused(Reason.TOO_FEW_SUBGROUPS, have=telling, needed=minimum)
    estimate = {
        Estimator.RANGES: from_ranges,
        Estimator.STANDARD_DEVIATIONS: from_deviations,
        Estimator.POOLED: pooled,
    }[estimator]
    centre = float((groups.sizes * groups.means).sum() / groups.sizes.sum())
    return _baseline(centre, estimate(groups), width, groups.means)


def _baseline(centre: float, sigma: Sigma, width: float, values: Floats) -> Baseline:
    if not varies(sigma.value, values):
        raise Refused(Reason.NO_VARIATION)
    return Baseline(centre, sigma, width, provisional=sigma.readings < ENOUGH_READINGS)


def individuals(baseline: Baseline, values: ArrayLike) -> ControlChart:
    """Each reading, between centre - width sigma and centre + width sigma."""
    x = checked(values)
    reach = baseline.width * baseline.sigma.value
    z = (x - baseline.centre) / baseline.sigma.value
    lower, upper = baseline.centre - reach, baseline.centre + reach
    return ControlChart(Chart.INDIVIDUALS, x, baseline.centre, lower, upper, z, baseline)


def moving_ranges(baseline: Baseline, values: ArrayLike) -> ControlChart:
    """The distance of each reading from the one before it: one point fewer than readings; limits D3, D4 of two values."""
    ranges = np.abs(np.diff(checked(values, at_least=2)))
    return _dispersion(Chart.MOVING_RANGE, baseline, ranges, d2(2), d3(2))


def means(baseline: Baseline, groups: Subgroups) -> ControlChart:
    """Subgroup means, between centre -/+ width sigma/sqrt(n). With unequal sizes every point has its own limits.

    Rules that look at several points then look at z, as on the standardised chart that Montgomery advises (section 6.3.2).
    """
    sigma = baseline.sigma.value / np.sqrt(groups.sizes)
    reach = _single(baseline.width * sigma)
    z = (groups.means - baseline.centre) / sigma
    lower, upper = baseline.centre - reach, baseline.centre + reach
    return ControlChart(Chart.XBAR, groups.means, baseline.centre, lower, upper, z, baseline)


def ranges(baseline: Baseline, groups: Subgroups) -> ControlChart:
    """Subgroup ranges, about d2 sigma, with limits (d2 -/+ width d3) sigma, the lower not below 0."""
    return _by_size(Chart.RANGES, baseline, groups, groups.ranges, d2, d3)


def deviations(baseline: Baseline, groups: Subgroups) -> ControlChart:
    """Subgroup standard deviations, about c4 sigma, with limits (c4 -/+ width sqrt(1 - c4^2)) sigma, the lower not below 0."""
    return _by_size(Chart.DEVIATIONS, baseline, groups, groups.deviations, c4, lambda n: sqrt(1 - c4(n) ** 2))


def _by_size(
    chart: Chart, baseline: Baseline, groups: Subgroups, points: Floats, mean: Factor, deviation: Factor
) -> ControlChart:
    if (groups.sizes < 2).any():
        raise Refused(Reason.TOO_FEW_READINGS, have=1, needed=2)
    sizes, where = np.unique(groups.sizes, return_inverse=True)
    centres = np.array([mean(int(n)) for n in sizes])[where]
    scatters = np.array([deviation(int(n)) for n in sizes])[where]
    return _dispersion(chart, baseline, points, centres, scatters)


def _dispersion(
    chart: Chart, baseline: Baseline, points: Floats, mean: float | Floats, deviation: float | Floats
) -> ControlChart:
    sigma, width = baseline.sigma.value, baseline.width
    centre = np.asarray(mean) * sigma
    upper = centre + width * np.asarray(deviation) * sigma
    lower = np.maximum(0.0, centre - width * np.asarray(deviation) * sigma)
    away = points - centre
    z = width * away / np.where(away > 0, upper - centre, centre - lower)
    return ControlChart(chart, points, _single(centre), _single(lower), _single(upper), z, baseline)


def _single(values: Floats) -> float | Floats:
    """One number where all are the same: charts of equal subgroups have one limit."""
    flat = np.atleast_1d(values)
    return float(flat[0]) if len(flat) and (flat == flat[0]).all() else flat
