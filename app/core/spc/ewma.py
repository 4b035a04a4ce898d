"""Charts that remember: the exponentially weighted moving average (Roberts 1959) and the plain moving average.

E_i = lambda x_i + (1 - lambda) E_(i-1) from E_0 = centre. Var E_i = sigma^2 lambda/(2 - lambda) (1 - (1 - lambda)^(2i)): the
exact limits widen with i, the asymptotic ones leave out the last factor (NIST/SEMATECH e-Handbook 6.3.2.4). The running
average of the measuring cycles (R29 = k) is the same recursion with lambda = 1/k.
"""

from math import ceil, inf, sqrt

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr

from app.core.compiled import compiled
from app.core.spc.refusal import Floats, Reason, Refused, checked
from app.core.spc.shewhart import Baseline, Chart, ControlChart

NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)
LONGEST_SOLVED = 1e12
"""Average run lengths beyond it are lost in the rounding of the equation that gives them: its condition is the length."""


@compiled
def _smoothed(x: Floats, weight: float, start: float) -> Floats:
    result = np.empty_like(x)
    last = start
    for i in range(len(x)):
        last = weight * x[i] + (1.0 - weight) * last
        result[i] = last
    return result


def _check(weight: float) -> None:
    if not 0 < weight <= 1:
        raise ValueError(f"lambda lies above 0 and up to 1, not at {weight}")


def ewma(
    baseline: Baseline,
    values: ArrayLike,
    weight: float = 0.2,
    *,
    exact: bool = True,
    start: float | None = None,
    seen: int = 0,
) -> ControlChart:
    """The EWMA of readings with lambda = `weight`; limits at baseline.width standard deviations of the average.

    `start`: the average so far, where an earlier chart is continued; `seen`: of how many readings (if that is not known,
    the limits are the asymptotic ones).

    >>> from app.core.spc.shewhart import given
    >>> chart = ewma(given(50, 2.0539), [52.0, 47.0, 53.0, 49.3], 0.3, exact=False)
    >>> chart.points.round(2).tolist(), round(chart.upper, 4)
    ([50.6, 49.52, 50.56, 50.18], 52.5884)
    """
    _check(weight)
    x = checked(values)
    points = _smoothed(x, float(weight), float(baseline.centre if start is None else start))
    share: Floats = np.asarray(weight / (2 - weight))
    if exact and (start is None or seen):
        number = np.arange(seen + 1, seen + len(x) + 1)
        share = share * -np.expm1(2 * number * np.log1p(-weight)) if weight < 1 else np.ones(len(x))
    deviation = baseline.sigma.value * np.sqrt(share)
    return _chart(Chart.EWMA, baseline, points, deviation)


def moving_average(baseline: Baseline, values: ArrayLike, span: int = 5) -> ControlChart:
    """Means of the last `span` readings; of those there are while there are fewer, with wider limits (Montgomery, section 9.3).

    >>> from app.core.spc.shewhart import given
    >>> chart = moving_average(given(10, 1), [9.45, 7.99, 9.29, 11.66, 12.16, 10.18], 5)
    >>> chart.points.round(3).tolist()
    [9.45, 8.72, 8.91, 9.598, 10.11, 10.256]
    """
    if span < 2:
        raise ValueError(f"a moving average spans at least 2 readings, not {span}")
    x = checked(values)
    away, summed = x - baseline.centre, np.zeros(len(x))
    for lag in range(min(span, len(x))):  # not from a running sum: a point may not depend on where the readings begin
        summed[lag:] += away[: len(x) - lag]
    count = np.minimum(np.arange(1, len(x) + 1), span)
    points = baseline.centre + summed / count
    return _chart(Chart.MOVING_AVERAGE, baseline, points, baseline.sigma.value / np.sqrt(count))


def _chart(chart: Chart, baseline: Baseline, points: Floats, deviation: Floats) -> ControlChart:
    reach = baseline.width * deviation
    z = (points - baseline.centre) / deviation
    lower, upper = baseline.centre - reach, baseline.centre + reach
    if reach.ndim == 0:
        return ControlChart(chart, points, baseline.centre, float(lower), float(upper), z, baseline)
    return ControlChart(chart, points, baseline.centre, lower, upper, z, baseline)


def average_run_length(weight: float, width: float, shift: float = 0.0) -> float:
    """Average number of points until the EWMA leaves its asymptotic limits; `shift` of the mean in sigma.

    Solves Crowder's integral equation L(u) = 1 + 1/lambda * integral of L(y) phi((y - (1 - lambda)u)/lambda - shift)
    over the limits (Technometrics 29, 1987), by Gauss-Legendre in pieces. Infinite where
    it is so long that sixteen digits cannot solve the equation (`LONGEST_SOLVED`).

    >>> round(average_run_length(0.1, 2.814)), round(average_run_length(0.1, 2.814, shift=1.0), 1)
    (500, 10.3)
    """
    _check(weight)
    if weight == 1:
        return 1 / (ndtr(-width - shift) + ndtr(-width + shift))
    limit = width * sqrt(weight / (2 - weight))
    # The first exit is no earlier than that of independent points: no equation is set up for what it could not solve.
    if 1 / (2 * (ndtr(-width - shift) + ndtr(-width + shift))) > LONGEST_SOLVED:
        return inf
    if limit / weight > 1e3:
        raise Refused(Reason.BEYOND_RANGE)
    pieces = ceil(limit / (4 * weight))  # each 8 deviations of a reading wide, or less
    middles = limit * (2 * np.arange(pieces) + 1 - pieces) / pieces
    y = (middles[:, None] + limit / pieces * NODES).reshape(-1)
    weights = limit / pieces * np.tile(WEIGHTS, pieces)
    nodes = len(y)
    distance = (y - (1 - weight) * y[:, None]) / weight - shift
    kernel = np.exp(-distance * distance / 2) / sqrt(2 * np.pi) / weight * weights
    lengths = np.linalg.solve(np.eye(nodes) - kernel, np.ones(nodes))
    first = y / weight - shift
    length = float(1 + (np.exp(-first * first / 2) / sqrt(2 * np.pi) / weight * weights) @ lengths)
    return length if 0 < length < LONGEST_SOLVED else inf
