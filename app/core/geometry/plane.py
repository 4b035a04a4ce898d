"""The plane through points.

Least squares of the orthogonal distances: the plane runs through the centroid, its normal is the direction in which the
points reach least (K. Pearson, 1901), the last right singular vector of the points about their centroid.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from app.core.geometry.points import STRAIGHT, Degenerate, Fitted, Floats, Reason, extents, points_of, unit


@dataclass(frozen=True, eq=False, slots=True)
class Plane(Fitted):
    """A plane and how far the points lie from it, mm.

    point: in the plane, where the points' centroid is. normal: of length 1, its greatest component positive.
    residuals: signed, positive on the side of the normal.
    """

    point: Floats
    normal: Floats
    residuals: Floats

    @property
    def range(self) -> float:
        """Highest minus lowest point, mm."""
        return float(np.ptp(self.residuals))


def fit_plane(points: ArrayLike) -> Plane:
    """The least-squares plane through three points or more.

    Raises `Degenerate` where they lie on one line: then any plane through it fits.

    >>> plane = fit_plane([(0, 0, 1), (10, 0, 1), (0, 10, 1), (10, 10, 1)])
    >>> plane.normal.tolist(), plane.range
    ([0.0, 0.0, 1.0], 0.0)
    """
    array = points_of(points, 3, 3)
    centroid = array.mean(axis=0)
    about = array - centroid
    values, directions = extents(about)
    if values[1] <= STRAIGHT * values[0]:
        raise Degenerate(Reason.COLLINEAR)
    normal = unit(np.cross(directions[0], directions[1]))
    if values[1] - values[2] <= STRAIGHT * values[1]:
        raise Degenerate(Reason.NO_DIRECTION)
    return Plane(centroid, normal, about @ normal)
