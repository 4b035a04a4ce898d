"""The smallest circle about points and the largest among them: how a shaft and a bore meet their counterpart.

The smallest circumscribed circle (MCC) rests on two points or three: beginning with any, the point farthest outside is
taken in and the smallest circle about these few found, until none is outside; its radius grows each time, so it ends. The
largest inscribed circle (MIC) is found by linear programmes as in `zones`.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from app.core.geometry.circle import fit_circle
from app.core.geometry.minimum_zones import ENOUGH, NOTHING, ROUNDS, bearing, solved
from app.core.geometry.points import Degenerate, Floats, Reason, points_of

SURROUNDED = 180.0  # degrees: inside a shorter arc no circle is the largest
INSIDE = 1e-12  # of the radius: rounding, not a point outside


@dataclass(frozen=True, eq=False, slots=True)
class Disc:
    """A circle alone, mm: the smallest that holds all points, or the largest that holds none."""

    centre: Floats
    radius: float
    at: tuple[int, ...]


def circumscribed(points: ArrayLike) -> Disc:
    """The smallest circle that holds all points of the plane (MCC).

    >>> disc = circumscribed([(-5, 0), (5, 0), (0, 3)])
    >>> disc.centre.tolist(), disc.radius, disc.at
    ([0.0, 0.0], 5.0, (0, 1))
    """
    array = points_of(points, 2, 2)
    middle = array.mean(axis=0)
    about = array - middle
    rests: tuple[int, ...] = (0, int(np.linalg.norm(about - about[0], axis=1).argmax()))
    centre, radius = _through(about[list(rests)])
    for _ in range(10 * len(array)):
        distances = np.linalg.norm(about - centre, axis=1)
        farthest = int(distances.argmax())
        if distances[farthest] <= radius * (1 + INSIDE):
            break
        centre, radius, rests = _smallest(about, (*rests, farthest))
    return Disc(middle + centre, radius, tuple(sorted(rests)))


def _smallest(points: Floats, among: tuple[int, ...]) -> tuple[Floats, float, tuple[int, ...]]:
    """The smallest circle about a few points, and on which two or three of them it rests."""
    chosen = points[list(among)]
    discs = []
    for count in (2, 3):
        for rests in combinations(range(len(among)), count):
            centre, radius = _through(chosen[list(rests)])
            if np.linalg.norm(chosen - centre, axis=1).max() <= radius * (1 + INSIDE):
                discs.append((radius, count, centre, tuple(among[at] for at in rests)))
    radius, _count, centre, rests = min(discs, key=lambda disc: disc[:2])
    return centre, radius, rests


def _through(points: Floats) -> tuple[Floats, float]:
    """The circle on two points as its diameter, or through three; without end where these lie on a line."""
    if len(points) == 2:
        centre: Floats = points.mean(axis=0)
    else:
        (bx, by), (cx, cy) = points[1] - points[0], points[2] - points[0]
        twice = 2 * (bx * cy - by * cx)
        if twice == 0:
            return points[0], np.inf
        b, c = bx * bx + by * by, cx * cx + cy * cy
        centre = points[0] + np.array([cy * b - by * c, bx * c - cx * b]) / twice
    return centre, float(np.linalg.norm(points - centre, axis=1).max())


def inscribed(points: ArrayLike) -> Disc:
    """The largest circle among points of the plane that holds none of them (MIC), next to their least-squares circle.

    Raises `Degenerate` where the points do not surround it.

    >>> disc = inscribed([(-5, 0), (5, 0), (0, 6), (0, -6)])
    >>> disc.centre.round(6).tolist(), round(disc.radius, 6)
    ([0.0, 0.0], 5.0)
    """
    array = points_of(points, 2, 3)
    circle = fit_circle(array)
    if circle.arc <= SURROUNDED:
        raise Degenerate(Reason.SHORT_ARC, have=round(circle.arc, 3), needed=SURROUNDED)
    about, centre, reach = array - circle.centre, np.zeros(2), max(4 * circle.range, NOTHING)
    distances = np.linalg.norm(about, axis=1)
    for _ in range(ROUNDS):
        scale = max(circle.range, NOTHING)
        slopes = (centre - about) / distances[:, None]
        rows = np.column_stack([-slopes, np.ones(len(array))])
        solution = solved(np.array([0.0, 0.0, -1.0]), rows, (distances - distances.min()) / scale, reach / scale, 2)
        step = solution[:2] * scale
        tried = np.linalg.norm(about - centre - step, axis=1)
        gained = float(tried.min() - distances.min())
        if gained > 0:
            centre, distances = centre + step, tried
        else:
            reach = float(np.abs(step).max()) / 2
        if 0 <= gained <= ENOUGH * scale or reach <= ENOUGH * scale:
            break
    radius = float(distances.min())
    return Disc(circle.centre + centre, radius, bearing(distances, radius, None))
