"""Points of a circle, a bore, a line or a plane that do not belong, and the values that would fit."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from app.core.geometry.circle import fit_circle
from app.core.geometry.elements import Point, Section, heights_of
from app.core.geometry.line import fit_line
from app.core.geometry.outliers import Outlier, OutlierTest, outliers
from app.core.geometry.plane import fit_plane
from app.core.geometry.points import Degenerate, Floats, frame

STEPS = 8
FAR = 5.0  # times the distance: a coordinate that would have to change by more is not the one that is wrong


class SuspectPoint(NamedTuple):
    """A touch that does not belong.

    section, touch: counted from 1; section is None where there are none. off: how far it lies from the element through
    the others, mm, positive outside or above; t and its limit. given: as it came; nearest: the next point on that
    element. alone: per coordinate what it would have to be if the others are right; None where that would not do.
    """

    section: int | None
    touch: int
    off: float
    t: float
    limit: float
    given: Point
    nearest: Point
    alone: tuple[float | None, ...]


class SuspectPoints(NamedTuple):
    """The suspects. tested: there were enough points for the test."""

    suspects: tuple[SuspectPoint, ...] = ()
    tested: bool = False


def in_section(touches: Sequence[Point], number: int) -> SuspectPoints:
    """Find suspect points of one section by itself, number from 1, against its own circle."""
    circle = fit_circle(touches)
    array = np.asarray(touches, dtype=np.float64)
    away = array - circle.centre
    jacobian = np.column_stack([-away / np.linalg.norm(away, axis=1)[:, None], -np.ones(len(away))])
    test = outliers(circle.residuals, jacobian)
    if not test.outliers:
        return SuspectPoints((), test.tested)
    others = fit_circle(np.delete(array, [outlier.at for outlier in test.outliers], axis=0))
    suspects = [
        _off_circle(outlier, (number, outlier.at + 1), array[outlier.at], others.centre, others.radius)
        for outlier in test.outliers
    ]
    return SuspectPoints(tuple(suspects), True)


def in_bore(sections: Sequence[Section]) -> SuspectPoints:
    """Find suspect points of all sections together, as points of one straight bore (or shaft) of one radius.

    Without heights the bore is taken for upright. Sections given by their centres have no touches to suspect.
    """
    touched = [(at, section) for at, section in enumerate(sections) if section.touches]
    if not touched:
        return SuspectPoints()
    points = np.array([touch for _at, section in touched for touch in section.touches], dtype=np.float64)
    places = [(at + 1, k + 1) for at, section in touched for k in range(len(section.touches))]
    known = heights_of([section for _at, section in touched]) if len(touched) > 1 else None
    levers = np.zeros(len(points))
    if known is not None:
        counts = [len(section.touches) for _at, section in touched]
        levers = np.repeat((known - known.mean()) / np.ptp(known), counts)
    try:
        bore, jacobian = _bore(points, levers)
    except Degenerate:
        return SuspectPoints()
    away = _away(points, levers, bore)
    test: OutlierTest = outliers(np.linalg.norm(away, axis=1) - bore[-1], jacobian)
    if not test.outliers:
        return SuspectPoints((), test.tested)
    remaining = np.delete(np.arange(len(points)), [outlier.at for outlier in test.outliers])
    others, _jacobian = _bore(points[remaining], levers[remaining])
    suspects = [
        _off_circle(
            outlier, places[outlier.at], points[outlier.at], others[:2] + levers[outlier.at] * others[2:4], others[4]
        )
        for outlier in test.outliers
    ]
    return SuspectPoints(tuple(suspects), True)


def in_plane(points: Sequence[Point]) -> SuspectPoints:
    """Find suspect points of a surface, against its plane."""
    array = np.asarray(points, dtype=np.float64)
    plane = fit_plane(array)
    jacobian = np.column_stack([(array - plane.point) @ frame(plane.normal)[:2].T, np.ones(len(array))])
    test = outliers(plane.residuals, jacobian)
    if not test.outliers:
        return SuspectPoints((), test.tested)
    others = fit_plane(np.delete(array, [outlier.at for outlier in test.outliers], axis=0))
    return SuspectPoints(
        tuple(_off_flat(outlier, array[outlier.at], others.point, others.normal) for outlier in test.outliers), True
    )


def in_line(points: Sequence[Point]) -> SuspectPoints:
    """Find suspect points of a profile, against its line."""
    array = np.asarray(points, dtype=np.float64)
    line = fit_line(array)
    test = outliers(line.residuals, np.column_stack([line.along, np.ones(len(array))]))
    if not test.outliers:
        return SuspectPoints((), test.tested)
    others = fit_line(np.delete(array, [outlier.at for outlier in test.outliers], axis=0))
    normal = np.array([-others.direction[1], others.direction[0]])
    return SuspectPoints(
        tuple(_off_flat(outlier, array[outlier.at], others.point, normal) for outlier in test.outliers), True
    )


def _bore(points: Floats, levers: Floats) -> tuple[Floats, Floats]:
    """The straight bore of one radius through touches: centre, slope, radius; and the derivatives there."""
    circle = fit_circle(points)
    bore = np.array([*circle.centre, 0.0, 0.0, circle.radius])
    tilted = bool(levers.any())
    for _ in range(STEPS):
        away = _away(points, levers, bore)
        distances = np.linalg.norm(away, axis=1)
        units = away / distances[:, None]
        jacobian = np.column_stack([-units, -units * levers[:, None], -np.ones(len(points))])
        free = [0, 1, 2, 3, 4] if tilted else [0, 1, 4]
        jacobian = jacobian[:, free]
        bore[free] += np.linalg.lstsq(jacobian, bore[-1] - distances, rcond=None)[0]
    return bore, jacobian


def _away(points: Floats, levers: Floats, bore: Floats) -> Floats:
    return points - bore[:2] - levers[:, None] * bore[2:4]


def _off_circle(outlier: Outlier, place: tuple[int, int], touch: Floats, centre: Floats, radius: float) -> SuspectPoint:
    away = touch - centre
    distance = float(np.linalg.norm(away))
    nearest = centre + away * radius / distance
    off = distance - float(radius)
    alone = tuple(_on_circle(float(away[k]), float(away[1 - k]), float(centre[k]), radius, off) for k in (0, 1))
    return SuspectPoint(place[0], place[1], off, outlier.t, outlier.limit, _point(touch), _point(nearest), alone)


def _on_circle(here: float, other: float, centre: float, radius: float, off: float) -> float | None:
    """Value of one coordinate that lies on the circle, the other as it is; the one on the same side."""
    square = radius * radius - other * other
    if square <= 0:
        return None
    there = float(np.copysign(np.sqrt(square), here))
    return centre + there if abs(there - here) <= FAR * abs(off) else None


def _off_flat(outlier: Outlier, touch: Floats, point: Floats, normal: Floats) -> SuspectPoint:
    off = float((touch - point) @ normal)
    alone = tuple(float(touch[k] - off / normal[k]) if abs(normal[k]) * FAR >= 1 else None for k in range(len(touch)))
    return SuspectPoint(
        None, outlier.at + 1, off, outlier.t, outlier.limit, _point(touch), _point(touch - off * normal), alone
    )


def _point(array: Floats) -> Point:
    return tuple(float(value) for value in array)
