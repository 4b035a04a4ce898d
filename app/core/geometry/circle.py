"""The circle through points, in its plane and in space.

Least squares of the geometric distances ``d_i = |x_i - c| - r``; with r the mean distance, what is left is a minimum
over the centre alone. Newton's method with the exact second derivatives reaches it to the last digit also where the
points lie far from any circle (W. Gander, G. H. Golub, R. Strebel: Least-squares fitting of circles and ellipses, 1994);
it starts from the algebraic fit of G. Taubin (1991), which unlike the simpler ones is not drawn inwards on an arc.
"""

from dataclasses import dataclass
from math import degrees, sqrt

import numpy as np
from numpy.typing import ArrayLike

from app.core.geometry.points import STRAIGHT, Degenerate, Fitted, Floats, Reason, extents, points_of

LEAST_ARC = 30.0  # degrees: on a shorter arc the centre is thirty times less certain than a touch
LARGEST = 1e4  # radii per extent of the points: as good as straight
STEPS = 200
ROUNDING = 1e-15  # of a distance: near the least sum of squares only the gradient still tells which way it is


@dataclass(frozen=True, eq=False, slots=True)
class Circle(Fitted):
    """A circle in its plane, mm. residuals: positive outside. arc: how much of the circle the points cover, degrees."""

    centre: Floats
    radius: float
    residuals: Floats
    arc: float
    cofactors: Floats  # of centre X, centre Y and radius: their covariance for touches with variance 1

    @property
    def range(self) -> float:
        """Roundness about the least-squares centre: greatest minus smallest radius, mm."""
        return float(np.ptp(self.residuals))


def fit_circle(points: ArrayLike, least_arc: float = LEAST_ARC) -> Circle:
    """The least-squares circle through three points or more of the plane; through three exactly.

    least_arc: degrees; points that cover less are refused. Raises `Degenerate`: collinear, coincident, one-sided arc.

    >>> circle = fit_circle([(1, 7), (2, 6), (5, 8), (7, 7), (9, 5), (3, 7)])
    >>> circle.centre.round(4).tolist(), round(circle.radius, 4)
    ([4.7398, 2.9835], 4.7142)
    """
    array = points_of(points, 2, 3)
    centroid = array.mean(axis=0)
    about = array - centroid
    values, _directions = extents(about)
    if values[1] <= STRAIGHT * values[0]:
        raise Degenerate(Reason.COLLINEAR)
    size = float(values[0])
    scaled = about / size
    centre = _refined(_taubin(scaled), scaled)
    away = scaled - centre
    distances = np.linalg.norm(away, axis=1)
    radius = float(distances.mean())
    if radius > LARGEST:
        raise Degenerate(Reason.SHORT_ARC, have=0, needed=least_arc)
    arc = covered(away)
    if arc < least_arc:
        raise Degenerate(Reason.SHORT_ARC, have=round(arc, 3), needed=least_arc)
    jacobian = np.column_stack([away / distances[:, None], np.ones(len(away))])
    cofactors = np.linalg.pinv(jacobian.T @ jacobian)
    return Circle(centroid + centre * size, radius * size, (distances - radius) * size, arc, cofactors)


def covered(away: Floats) -> float:
    """Angle that points cover as seen from the centre: 360° less the greatest gap, degrees.

    >>> round(covered(np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])), 9)
    180.0
    """
    angles = np.sort(np.arctan2(away[:, 1], away[:, 0]))
    gaps = np.diff(angles, append=angles[0] + 2 * np.pi)
    return degrees(2 * np.pi - float(gaps.max()))


def _taubin(points: Floats) -> Floats:
    """The centre of Taubin's algebraic circle through points about their centroid."""
    squares = (points**2).sum(axis=1)
    mean = float(squares.mean())
    rows = np.column_stack([(squares - mean) / (2 * sqrt(mean)), points])
    _left, _values, directions = np.linalg.svd(rows, full_matrices=False)
    a, b, c = directions[2]
    a /= 2 * sqrt(mean)
    if abs(a) < 1 / LARGEST**2:
        raise Degenerate(Reason.SHORT_ARC, have=0, needed=LEAST_ARC)
    centre: Floats = np.array([b, c]) / (-2 * a)
    return centre


def _refined(centre: Floats, points: Floats) -> Floats:
    """The centre with the smallest sum of squares, by Newton; damped where that would climb.

    ``F(c) = sum (d_i - mean d)^2``; its gradient is ``-2 sum f_i u_i``, its Hessian
    ``2 (sum (u_i - mean u)(u_i - mean u)' + sum f_i (1 - u_i u_i')/d_i)``.
    """
    square, damping = _squares(centre, points), 0.0
    for _ in range(STEPS):
        away = points - centre
        distances = np.linalg.norm(away, axis=1)
        if not distances.all():  # a centre on a point has no direction to it: step off it
            centre = centre + 1e-9
            continue
        units = away / distances[:, None]
        f = distances - distances.mean()
        spread = units - units.mean(axis=0)
        gradient = units.T @ f
        gauss = spread.T @ spread
        curved = (f / distances).sum() * np.eye(2) - (units * (f / distances)[:, None]).T @ units
        hessian = gauss + curved
        if np.linalg.eigvalsh(hessian)[0] <= 0:
            hessian = gauss
        step = np.linalg.lstsq(hessian + damping * np.eye(2), gradient, rcond=None)[0]
        tried = _squares(centre + step, points)
        if tried <= square + ROUNDING * sqrt(len(points) * square):
            centre, square, damping = centre + step, min(tried, square), damping / 10 if damping > 1e-12 else 0.0
            if np.abs(step).max() <= 1e-16 * max(1.0, float(np.abs(centre).max())):
                break
        elif np.abs(step).max() <= 1e-13 * max(1.0, float(np.abs(centre).max())):
            break
        else:
            damping = max(10 * damping, 1e-6)
        if np.abs(centre).max() > 10 * LARGEST:
            break
    return centre


def _squares(centre: Floats, points: Floats) -> float:
    distances = np.linalg.norm(points - centre, axis=1)
    return float(((distances - distances.mean()) ** 2).sum())
