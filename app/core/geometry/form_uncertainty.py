"""Uncertainty of a form deviation, as far as it comes from the scatter of single points.

Cofactors again: times the square of the probe's repeatability they are the variance of the deviation, mm².

Least squares: the deviation is ``a'e`` with e the residuals and a +1 at the highest, -1 at the lowest touch; the fit
follows the touches, so its cofactor is ``a'(I - H)a``. Minimum zone: the touches that bear the zone share in it with the
multipliers l of its linear programme, for which no shift or tilt gains anything: ``sum s l g = 0``, ``sum l = 1`` on either
edge; the cofactor is ``sum l^2``. Both are first order: near a deviation of zero they say too little, because scatter
never makes a form better than it is.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from app.core.geometry.points import Floats

COVERAGE = 2.0  # k: the expanded uncertainty, about 95 %


def range_cofactor(residuals: Floats, jacobian: Floats) -> float:
    """Cofactor of the range of least-squares residuals.

    >>> round(range_cofactor(np.array([0.1, 0.0, -0.1]), np.ones((3, 1))), 9)
    2.0
    """
    basis, values, _right = np.linalg.svd(jacobian, full_matrices=False)
    basis = basis[:, values > values[0] * 1e-12]
    chosen = np.zeros(len(residuals))
    chosen[residuals.argmax()] += 1.0
    chosen[residuals.argmin()] -= 1.0
    along = basis.T @ chosen
    return max(float(chosen @ chosen - along @ along), 0.0)


def zone_multipliers(slopes: Floats, sides: NDArray[np.float64]) -> Floats:
    """Share of each bearing point in the width of a minimum zone.

    slopes: what each touch's distance changes by with each shift and tilt of the zone. sides: +1 on the upper edge, -1 on
    the lower; where all are +1 there is one edge, as of a cylinder.

    >>> zone_multipliers(np.array([[-1.0], [0.0], [1.0]]), np.array([1.0, -1.0, 1.0])).round(9).tolist()
    [0.5, 1.0, 0.5]
    """
    scale = np.abs(slopes).max(axis=0, initial=0.0)
    scale[scale == 0] = 1.0
    edges = [sides == side for side in (1.0, -1.0) if (sides == side).any()]
    rows = np.vstack([(slopes / scale * sides[:, None]).T, *[edge.astype(float)[None, :] for edge in edges]])
    sums = np.array([0.0] * slopes.shape[1] + [1.0] * len(edges))
    multipliers: Floats = nnls(rows, sums)[0]
    return multipliers
