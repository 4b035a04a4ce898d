"""Touches that do not belong: a chip under the stylus, a number written down wrongly.

A touch is held against the element that fits the others. Its studentized residual ``t_i = e_i/(s_i sqrt(1 - h_i))``, with
s_i the scatter without it and h_i its leverage, follows Student's distribution with one degree of freedom less than the
fit has; of n touches one is suspected from the ``alpha/(2n)`` quantile on (Bonferroni). The worst is set aside, the rest
looked at again. Three touches always lie on a circle: sections of three are therefore held against each other, as touches
of one straight bore of one radius.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from app.core.geometry.points import Floats

ALPHA = 0.01  # how often a set of good touches is suspected of holding a bad one
MOST = 0.25  # of the touches: where more do not belong, it cannot be determined which
LEAST_FREEDOM = 2
SMALLEST = 1e-6  # mm: nobody suspects a nanometre


class Outlier(NamedTuple):
    """A touch that stands out: which one, from 0; how far off the element through the others, mm; t and its limit."""

    at: int
    off: float
    t: float
    limit: float


class OutlierTest(NamedTuple):
    """Outliers of a fit. tested: there were enough points for the test."""

    outliers: tuple[Outlier, ...]
    tested: bool


def outliers(residuals: Floats, jacobian: Floats, floor: float = 0.0) -> OutlierTest:
    """Find the residuals that stand out of a fit. jacobian: change of a residual with each parameter of the element.

    floor: mm, what a touch must be off at least. Residuals are those of any fit that is near enough for a linear step.

    >>> flat = np.column_stack([np.ones(8), np.arange(8.0)])
    >>> heights = np.array([0.001, -0.001, 0.0, 0.001, 0.09, -0.001, 0.001, 0.0])
    >>> [(outlier.at, round(outlier.off, 3)) for outlier in outliers(heights, flat).outliers]
    [(4, 0.09)]
    """
    remaining = np.arange(len(residuals))
    detected: list[Outlier] = []
    parameters = int(np.linalg.matrix_rank(jacobian))
    tested = len(residuals) - parameters > LEAST_FREEDOM
    while len(remaining) - parameters > LEAST_FREEDOM and len(detected) < max(1, int(MOST * len(residuals))):
        worst = _worst(residuals[remaining], jacobian[remaining], parameters)
        if worst is None:
            break
        at, off, t = worst
        limit = float(stdtrit(len(remaining) - parameters - 1, 1 - ALPHA / (2 * len(remaining))))
        if t <= limit or abs(off) <= max(floor, SMALLEST):
            break
        detected.append(Outlier(int(remaining[at]), off, t, limit))
        remaining = np.delete(remaining, at)
    return OutlierTest(tuple(detected), tested)


def _worst(residuals: Floats, jacobian: Floats, parameters: int) -> tuple[int, float, float] | None:
    """The touch with the greatest studentized residual: which, how far off, t."""
    basis = np.linalg.svd(jacobian, full_matrices=False)[0][:, :parameters]
    left = residuals - basis @ (basis.T @ residuals)
    share = 1 - (basis**2).sum(axis=1)
    can: NDArray[np.bool_] = share > 1e-9  # a touch that alone bears a parameter agrees with everything
    if not can.any():
        return None
    share = np.where(can, share, 1.0)
    freedom = len(residuals) - parameters - 1
    others = np.maximum(left @ left - left**2 / share, 0.0) / freedom
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(can, np.abs(left) / np.sqrt(others * share), 0.0)
    t = np.nan_to_num(t, nan=0.0, posinf=np.finfo(float).max)
    at = int(t.argmax())
    return at, float(left[at] / share[at]), float(t[at])
