"""The line through points, in a plane or in space.

Least squares of the orthogonal distances: the line runs through the centroid along the direction in which the points
reach farthest (K. Pearson, 1901), the first right singular vector of the points about their centroid.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from app.core.geometry.points import Degenerate, Fitted, Floats, Reason, extents, points_of, unit

PLANE, SPACE = 2, 3
ROUND = 1e-9  # extents that differ by a smaller share do not say which direction is the line's


@dataclass(frozen=True, eq=False, slots=True)
class Line(Fitted):
    """A line and how far the points lie from it, mm.

    point: on the line, where the points' centroid is; direction: of length 1. residuals: in a plane signed, positive to
    the left of the direction; in space the distances. along: where each point's foot lies, from `point`.
    """

    point: Floats
    direction: Floats
    residuals: Floats
    along: Floats

    @property
    def length(self) -> float:
        """From the first foot to the last, mm."""
        return float(np.ptp(self.along))


def fit_line(points: ArrayLike, dimension: int = PLANE) -> Line:
    """The least-squares line through points of the plane (2) or of space (3).

    Raises `Degenerate` for fewer than two different points, and where they reach equally far in every direction.

    >>> line = fit_line([(0, 0), (1, 1), (2, 2)])
    >>> line.direction.round(6).tolist(), round(line.rms, 9)
    ([0.707107, 0.707107], 0.0)
    """
    array = points_of(points, dimension, 2)
    centroid = array.mean(axis=0)
    about = array - centroid
    values, directions = extents(about)
    if len(values) > 1 and values[0] - values[1] <= ROUND * values[0]:
        raise Degenerate(Reason.NO_DIRECTION)
    return line_through(centroid, unit(directions[0]), array)


def line_through(point: Floats, direction: Floats, points: Floats) -> Line:
    """A given line, and how far points lie from it."""
    about = points - point
    along = about @ direction
    if len(point) == PLANE:
        residuals = direction[0] * about[:, 1] - direction[1] * about[:, 0]
    else:
        residuals = np.linalg.norm(about - np.outer(along, direction), axis=1)
    return Line(point, direction, residuals, along)
