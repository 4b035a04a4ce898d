"""Minimum zones (Chebyshev): the narrowest ring, strip, slab and cylinder that hold all points.

The first three are found by linear programmes: to first order a touch's distance changes with a small shift or tilt of
the element by its gradient, and the zone ``hi - lo`` with ``lo <= r_i + g_i p <= hi`` is smallest at a vertex. The element
is moved there and the programme solved again, until nothing is gained; as four touches (three, for a strip) bear the
zone, few rounds do. A step that gains nothing is taken back and halved. The returned zone is always measured from the touches
themselves, so it is one that holds them all.

The cylinder is another matter: distances from an axis are lengths of two components. ``|v| <= rho`` holds if ``u v <=
rho`` in every direction u; directions are added where the touches ask for them, until the bound and the cylinder meet.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linprog

from app.core.geometry.circle import fit_circle
from app.core.geometry.line import PLANE, fit_line
from app.core.geometry.plane import fit_plane
from app.core.geometry.points import Degenerate, Floats, Reason, frame, points_of, unit

NOTHING = 1e-10  # mm: a zone that narrow is none
ENOUGH = 1e-9  # of the zone: what is gained by less is not looked for
MET = 1e-7  # of the radius: so near the bound and the cylinder have met
ROUNDS = 60
BEARING = 1e-6  # of the zone: touches nearer than that to its edge bear it


@dataclass(frozen=True, eq=False, slots=True)
class Ring:
    """Two circles about one centre with all points between them, mm. at: the touches that bear it, counted from 0."""

    centre: Floats
    inner: float
    outer: float
    at: tuple[int, ...]

    @property
    def width(self) -> float:
        """Roundness by the minimum zone, mm."""
        return self.outer - self.inner


@dataclass(frozen=True, eq=False, slots=True)
class Slab:
    """Two parallel lines or planes with all points between them, mm. point: halfway; normal: of length 1."""

    point: Floats
    normal: Floats
    width: float
    at: tuple[int, ...]


@dataclass(frozen=True, eq=False, slots=True)
class Cylinder:
    """The narrowest cylinder that holds all points, mm. Its diameter is the straightness of an axis."""

    point: Floats
    direction: Floats
    radius: float
    at: tuple[int, ...]


def minimum_zone_circle(points: ArrayLike) -> Ring:
    """The narrowest ring about points of the plane, next to their least-squares circle. Raises `Degenerate` as that does.

    >>> ring = minimum_zone_circle([(10.01, 0), (0, 9.99), (-10.01, 0), (0, -9.99)])
    >>> round(ring.width, 6), ring.at
    (0.02, (0, 1, 2, 3))
    """
    array = points_of(points, 2, 3)
    circle = fit_circle(array)
    about, centre, reach = array - circle.centre, np.zeros(2), circle.radius / 2
    width, distances = circle.range, np.linalg.norm(about, axis=1)
    for _ in range(ROUNDS if len(array) > 3 and width > NOTHING else 0):
        step = _narrowed(distances, (centre - about) / distances[:, None], width, reach)
        tried = np.linalg.norm(about - centre - step, axis=1)
        gained = width - float(np.ptp(tried))
        if gained <= 0:
            reach = float(np.abs(step).max()) / 2
        else:
            centre, distances, width = centre + step, tried, float(np.ptp(tried))
        if 0 <= gained <= ENOUGH * width or reach <= NOTHING / 100 or width <= NOTHING:
            break
    inner, outer = float(distances.min()), float(distances.max())
    return Ring(circle.centre + centre, inner, outer, bearing(distances, inner, outer))


def minimum_zone_line(points: ArrayLike) -> Slab:
    """The narrowest strip about points of the plane: straightness. Raises `Degenerate` as `fit_line` does.

    >>> round(minimum_zone_line([(0, 0), (1, 0.01), (2, 0)]).width, 6)
    0.01
    """
    array = points_of(points, PLANE, 2)
    line = fit_line(array)
    return _slab(array, line.point, np.array([[-line.direction[1], line.direction[0]], line.direction])[::-1])


def minimum_zone_plane(points: ArrayLike) -> Slab:
    """The narrowest slab about points of space: flatness. Raises `Degenerate` as `fit_plane` does.

    >>> round(minimum_zone_plane([(0, 0, 0.02), (10, 0, 0), (0, 10, 0), (10, 10, 0.02)]).width, 6)
    0.02
    """
    array = points_of(points, 3, 3)
    plane = fit_plane(array)
    return _slab(array, plane.point, frame(plane.normal))


def _slab(array: Floats, point: Floats, axes: Floats) -> Slab:
    """The narrowest slab. axes: rows, the last is the normal to begin with; the others lie along the slab."""
    about = array - point
    size = float(np.abs(about).max())
    heights = about @ axes[-1]
    width, reach = float(np.ptp(heights)), 1.0
    enough = len(axes) + 1
    for _ in range(ROUNDS if len(array) >= enough and width > NOTHING else 0):
        tilt = _narrowed(heights, -(about @ axes[:-1].T) / size, width, reach) / size
        turned = _turned(axes, tilt)
        tried = about @ turned[-1]
        gained = width - float(np.ptp(tried))
        if gained <= 0:
            reach = float(np.abs(tilt).max()) * size / 2
        else:
            axes, heights, width = turned, tried, float(np.ptp(tried))
        if 0 <= gained <= ENOUGH * width or reach <= NOTHING / 100 or width <= NOTHING:
            break
    low, high = float(heights.min()), float(heights.max())
    return Slab(point + axes[-1] * (low + high) / 2, unit(axes[-1]), width, bearing(heights, low, high))


def minimum_zone_axis(points: ArrayLike) -> Cylinder:
    """The narrowest cylinder about points of space, such as the centres of sections: straightness of their axis.

    >>> axis = minimum_zone_axis([(0, 0, 0), (0.01, 0, 10), (0, 0, 20)])
    >>> round(2 * axis.radius, 6)
    0.01
    """
    array = points_of(points, 3, 2)
    line = fit_line(array, 3)
    point, direction = line.point, line.direction
    radius = float(line.residuals.max())
    for _ in range(ROUNDS if len(array) > 2 and radius > NOTHING else 0):
        axes = frame(direction)
        local = (array - point) @ axes.T
        size = float(np.abs(local[:, 2]).max())
        move = _enclosed(local[:, :2], np.column_stack([np.ones(len(array)), local[:, 2] / size]))
        ahead = direction + move[1] / size @ axes[:2]
        ahead /= np.linalg.norm(ahead)
        moved = point + move[0] @ axes[:2]
        tried = float(_away(array, moved, ahead).max())
        if tried >= radius * (1 - 10 * MET):
            if tried < radius:
                point, direction, radius = moved, ahead, tried
            break
        point, direction, radius = moved, ahead, tried
    # Where all bear it, no touch is nearer than the others: what counts as on the edge is a share of the radius.
    on = bearing(_away(array, point, direction), None, radius, room=100 * BEARING * radius)
    return Cylinder(point, unit(direction), radius, on)


def _narrowed(residuals: Floats, slopes: Floats, width: float, reach: float) -> Floats:
    """The step p, none of it beyond `reach`, after which residuals + slopes p span the least, to first order."""
    parameters = slopes.shape[1]
    ones, none = np.ones((len(residuals), 1)), np.zeros((len(residuals), 1))
    level = (residuals - residuals.min()) / width
    rows = np.vstack([np.hstack([slopes, -ones, none]), np.hstack([-slopes, none, ones])])
    aim = np.array([0.0] * parameters + [1.0, -1.0])
    return solved(aim, rows, np.concatenate([-level, level]), reach / width, parameters)[:parameters] * width


def _enclosed(offsets: Floats, levers: Floats) -> Floats:
    """Shifts per lever, so that the longest of ``q_i - sum_k l_ik s_k`` (of two components each) is shortest."""
    count = levers.shape[1]
    scale = float(np.linalg.norm(offsets, axis=1).max())
    best = np.zeros((count, 2))
    if scale <= NOTHING:
        return best
    scaled, shifts, shortest = offsets / scale, best, np.inf
    rows, bounds = [], []
    aim = np.array([0.0] * (2 * count) + [1.0])
    for _ in range(ROUNDS):
        left = scaled - levers @ shifts
        lengths = np.linalg.norm(left, axis=1)
        if lengths.max() < shortest:
            best, shortest = shifts, float(lengths.max())
        far = lengths >= lengths.max() / 2
        directions = left[far] / lengths[far, None]
        pulls = (levers[far, :, None] * directions[:, None, :]).reshape(-1, 2 * count)
        rows.append(np.column_stack([-pulls, -np.ones(len(pulls))]))
        bounds.append(-(directions * scaled[far]).sum(axis=1))
        solution = solved(aim, np.vstack(rows), np.concatenate(bounds), 4.0, 2 * count)
        shifts = solution[:-1].reshape(count, 2)
        if shortest - solution[-1] <= MET:
            break
    return best * scale


def solved(aim: Floats, rows: Floats, bounds: Floats, reach: float, parameters: int) -> Floats:
    """The linear programme: least ``aim x`` with ``rows x <= bounds``; the first parameters within ±reach, the rest free."""
    limits = [(-reach, reach)] * parameters + [(None, None)] * (len(aim) - parameters)
    result = linprog(aim, A_ub=rows, b_ub=bounds, bounds=limits, method="highs")
    if result.x is None:
        raise Degenerate(Reason.NO_SOLUTION)
    solution: Floats = result.x
    return solution


def _turned(axes: Floats, tilt: Floats) -> Floats:
    """The axes with the last one tilted against the others, all of them square again."""
    normal = axes[-1] - tilt @ axes[:-1]
    normal /= np.linalg.norm(normal)
    if len(axes) == PLANE:
        return np.array([[normal[1], -normal[0]], normal])
    return frame(normal)


def _away(points: Floats, point: Floats, direction: Floats) -> Floats:
    about = points - point
    distances: Floats = np.linalg.norm(about - np.outer(about @ direction, direction), axis=1)
    return distances


def bearing(values: Floats, low: float | None, high: float | None, room: float = 0.0) -> tuple[int, ...]:
    """Indices of the values that lie on either edge, next to nothing off it; `room` off it at least."""
    room = max(BEARING * float(np.ptp(values)), NOTHING, room)
    on = np.zeros(len(values), dtype=bool)
    if low is not None:
        on |= values <= low + room
    if high is not None:
        on |= values >= high - room
    return tuple(int(at) for at in np.flatnonzero(on))
