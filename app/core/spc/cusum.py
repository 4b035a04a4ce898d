"""Tabular cumulative sums: small lasting shifts, seen soon (Page 1954; Montgomery, section 9.1).

In standard units z = (x - target)/sigma: C+_i = max(0, C+_(i-1) + z_i - k), C-_i = max(0, C-_(i-1) - z_i - k), both from
`headstart` (0, or h/2 for the fast initial response of Lucas and Crosier 1982). A sum above h is a signal.
"""

from dataclasses import dataclass
from math import exp, inf, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr

from app.core.compiled import compiled
from app.core.spc.ewma import LONGEST_SOLVED
from app.core.spc.refusal import Floats, checked
from app.core.spc.shewhart import Baseline

Counts = NDArray[np.int64]


@compiled
def _sums(z: Floats, k: float, above: float, below: float) -> tuple[Floats, Floats, Counts, Counts]:
    upper, lower = np.empty_like(z), np.empty_like(z)
    since_upper, since_lower = np.empty(len(z), np.int64), np.empty(len(z), np.int64)
    high, low = above, below
    ups, downs = 0, 0
    for i in range(len(z)):
        high = max(0.0, high + z[i] - k)
        low = max(0.0, low - z[i] - k)
        ups = ups + 1 if high > 0.0 else 0
        downs = downs + 1 if low > 0.0 else 0
        upper[i], lower[i], since_upper[i], since_lower[i] = high, low, ups, downs
    return upper, lower, since_upper, since_lower


@dataclass(frozen=True, slots=True)
class Cusum:
    """Both sums, in the unit of the readings, for how many points each has been above 0, and the limit h sigma."""

    above: Floats
    below: Floats
    since_above: Counts
    since_below: Counts
    limit: float
    reference: float
    baseline: Baseline

    @property
    def outside(self) -> NDArray[np.bool_]:
        """Mask of the points where a sum is above the limit."""
        return (self.above > self.limit) | (self.below > self.limit)

    def new_mean(self, at: int) -> float | None:
        """Probable mean of the process since its sum left 0: target +/- (K + C/N). None without a signal there.

        >>> from app.core.spc.shewhart import given
        >>> x = [10.90, 9.33, 12.29, 11.50, 10.60, 11.08, 10.38, 11.62, 11.31]
        >>> chart = cusum(given(10, 1), x, state=(0.34, 0.0))
        >>> round(chart.new_mean(8), 2)
        11.25
        """
        if self.above[at] > self.limit:
            return self.baseline.centre + self.reference + float(self.above[at] / self.since_above[at])
        if self.below[at] > self.limit:
            return self.baseline.centre - self.reference - float(self.below[at] / self.since_below[at])
        return None


def cusum(
    baseline: Baseline,
    values: ArrayLike,
    k: float = 0.5,
    h: float = 5.0,
    *,
    headstart: float = 0.0,
    state: tuple[float, float] | None = None,
) -> Cusum:
    """Cumulative sums of readings about the baseline's centre; k (half the shift that matters), h and headstart in sigma.

    `state`: both sums of an earlier chart that is continued, in the unit of the readings; instead of a headstart.

    >>> from app.core.spc.shewhart import given
    >>> cusum(given(10, 1), [9.45, 7.99, 9.29, 11.66, 12.16]).above.round(2).tolist()
    [0.0, 0.0, 0.0, 1.16, 2.82]
    """
    if k < 0 or h <= 0 or not 0 <= headstart < h:
        raise ValueError(f"k = {k} must not be negative, h = {h} positive, and the headstart {headstart} below h")
    sigma = baseline.sigma.value
    z = (checked(values) - baseline.centre) / sigma
    above, below = (headstart, headstart) if state is None else (state[0] / sigma, state[1] / sigma)
    high, low, since_high, since_low = _sums(z, float(k), float(above), float(below))
    return Cusum(high * sigma, low * sigma, since_high, since_low, h * sigma, k * sigma, baseline)


def _one_sided(k: float, h: float, shift: float, start: float) -> tuple[float, float]:
    """Run lengths of the upper sum alone from 0 and from `start`: the integral equation of Page, by Gauss-Legendre.

    L(u) = 1 + L(0) Phi(k - u - shift) + integral over 0..h of L(x) phi(x + k - u - shift). Infinite where Siegmund's
    approximation, (exp(2db) - 2db - 1)/(2d^2) with d = k - shift and b = h + 1.166, is beyond `LONGEST_SOLVED`.
    """
    d, b = k - shift, h + 1.166
    if d > 0 and (2 * d * b > 100 or exp(2 * d * b) / (2 * d * d) > LONGEST_SOLVED):
        return inf, inf
    nodes = int(32 + 3 * h)
    x, weights = np.polynomial.legendre.leggauss(nodes)
    x, weights = h * (x + 1) / 2, h / 2 * weights
    at = np.concatenate(([0.0, start], x))
    distance = x + k - at[:, None] - shift
    kernel = np.zeros((len(at), len(at)))
    kernel[:, 0] = ndtr(k - at - shift)
    kernel[:, 2:] = np.exp(-distance * distance / 2) / sqrt(2 * np.pi) * weights
    lengths = np.linalg.solve(np.eye(len(at)) - kernel, np.ones(len(at)))
    if not 0 < lengths[0] < LONGEST_SOLVED:
        return inf, inf
    return float(lengths[0]), float(lengths[1])


def average_run_length(k: float, h: float, shift: float = 0.0, headstart: float = 0.0) -> float:
    """Average number of points until one of both sums is above h; `shift` of the mean in sigma.

    Both sides are put together as Lucas and Crosier do (Technometrics 24, 1982):
    L = (L+(S) L-(0) + L-(S) L+(0) - L+(0) L-(0)) / (L+(0) + L-(0)). Infinite beyond `LONGEST_SOLVED`.

    >>> round(average_run_length(0.5, 5)), round(average_run_length(0.5, 5, shift=1.0), 1)
    (465, 10.4)
    >>> round(average_run_length(0.5, 5, headstart=2.5)), round(average_run_length(0.5, 5, 1.0, 2.5), 2)
    (430, 6.35)
    """
    up, up_started = _one_sided(k, h, shift, headstart)
    down, down_started = _one_sided(k, h, -shift, headstart)
    if inf in {up, down}:
        return inf if up == down else up_started if down == inf else down_started
    return (up_started * down + down_started * up - up * down) / (up + down)
