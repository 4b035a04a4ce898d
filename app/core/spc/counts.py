"""Control charts of counts: rejected parts (p, np) and nonconformities (c, u), and Laney's p' and u'.

=====  =========================================  ======================================================
p      rejected / inspected                       p -/+ 3 sqrt(p (1 - p) / n), each point by its own n
np     rejected, of equally many inspected        n p -/+ 3 sqrt(n p (1 - p))
c      nonconformities, of equal areas            c -/+ 3 sqrt(c)
u      nonconformities / units                    u -/+ 3 sqrt(u / n)
p', u' as p and u                                 the same reach times sigma z
=====  =========================================  ======================================================

Sigma z is the mean moving range of z = (point - centre)/sigma, by d2(2) = 1.128: 1 where the counts scatter as binomial or Poisson
counts do, more where large samples scatter by what differs from shift to shift. Sources: NIST/SEMATECH e-Handbook 6.3.3;
Montgomery, chapter 7; D. B. Laney, Improved control charts for attributes, Quality Engineering 14 (2002).
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from app.core.spc.constants import d2
from app.core.spc.refusal import Floats, Reason, Refused, checked
from app.core.spc.shewhart import FEWEST_SUBGROUPS

OVERDISPERSED = 1.3
"""Above this sigma z Laney's chart is advised: ordinary limits would signal by chance twenty times as often."""


class CountChart(StrEnum):
    """The kinds of chart of counts."""

    P = "p"
    NP = "np"
    C = "c"
    U = "u"
    P_PRIME = "p_prime"
    U_PRIME = "u_prime"

    @property
    def parts(self) -> bool:
        """True if parts are rejected, each once; else there may be several nonconformities on one."""
        return self in {CountChart.P, CountChart.NP, CountChart.P_PRIME}


@dataclass(frozen=True, slots=True)
class Counts:
    """A chart of counts: points, centre and limits of each point.

    sigma_z: scatter of the points as a share of what binomial or Poisson counts have. provisional: fewer than 20 points.
    """

    chart: CountChart
    points: Floats
    centre: Floats
    lower: Floats
    upper: Floats
    sigma_z: float
    provisional: bool

    @property
    def outside(self) -> NDArray[np.bool_]:
        """Mask of the points beyond a limit; a point on it is not beyond."""
        return (self.points > self.upper) | (self.points < self.lower)

    @property
    def overdispersed(self) -> bool:
        """True if ordinary limits are too narrow for these counts."""
        return self.sigma_z > OVERDISPERSED


def counts_chart(
    chart: CountChart,
    counts: ArrayLike,
    inspected: ArrayLike | None = None,
    *,
    baseline: int | None = None,
    centre: float | None = None,
) -> Counts:
    """Points and limits of counts.

    counts: rejected parts or nonconformities, in order of time. inspected: parts or units of each; one number for all, and for c
    none. baseline: the number of first points that estimate centre and sigma z, all if left out. centre: a share, or a rate per unit,
    that is given and not estimated.

    Raises `Refused`: fewer than two points, counts that none is beyond 0 of, samples of unequal size for np or c.

    >>> found = counts_chart(CountChart.C, [16, 14, 28, 16, 12, 20, 10, 12, 10, 17])
    >>> round(float(found.centre[0]), 2), round(float(found.lower[0]), 3), round(float(found.upper[0]), 3)
    (15.5, 3.689, 27.311)
    """
    x = checked(counts, at_least=2)
    n = np.broadcast_to(checked(1.0 if inspected is None else inspected), x.shape).astype(np.float64)
    if (x < 0).any() or (n <= 0).any() or (chart.parts and (x > n).any()):
        raise Refused(Reason.BEYOND_RANGE)
    if chart in {CountChart.NP, CountChart.C} and (n != n[0]).any():
        raise Refused(Reason.INCOMPLETE_STUDY, have=len(np.unique(n)), needed=1, what="sample sizes")
    used = slice(0, len(x) if baseline is None else max(2, baseline))
    rate = float(x[used].sum() / n[used].sum()) if centre is None else centre
    if not rate > 0 or (chart.parts and rate >= 1):
        raise Refused(Reason.NO_VARIATION)
    sigma = np.sqrt(rate * (1 - rate) / n) if chart.parts else np.sqrt(rate / n)
    z = (x / n - rate) / sigma
    sigma_z = float(np.abs(np.diff(z[used])).mean()) / d2(2)
    primed = chart in {CountChart.P_PRIME, CountChart.U_PRIME}
    if primed and sigma_z == 0:
        raise Refused(Reason.NO_VARIATION)
    reach = 3 * sigma * (sigma_z if primed else 1.0)
    lower, upper = np.maximum(rate - reach, 0.0), rate + reach
    if chart.parts:
        upper = np.minimum(upper, 1.0)
    scale = n if chart in {CountChart.NP, CountChart.C} else np.ones_like(n)
    return Counts(
        chart,
        x / n * scale,
        rate * scale,
        lower * scale,
        upper * scale,
        sigma_z,
        provisional=len(x[used]) < FEWEST_SUBGROUPS,
    )
