"""Points fit to be fitted through, and the reasons why some are not."""

from enum import StrEnum
from itertools import pairwise
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

FARTHEST = 1e6  # mm: beyond a kilometre a float no longer holds a nanometre
TELLING_APART = 1e-6  # mm: points nearer to each other than a nanometre are one point
STRAIGHT = 1e-9  # points whose second extent is so small a share of their first lie on a line
NARROW, NARROW_SHARE = 0.5, 0.01  # mm, and of their length: what is narrower in both ways is no surface


class Reason(StrEnum):
    """Reasons for which nothing can be fitted. The sentences, and what to do, are worded at the edge."""

    TOO_FEW = "too_few"
    NOT_FINITE = "not_finite"
    TOO_FAR = "too_far"
    COINCIDENT = "coincident"
    COLLINEAR = "collinear"
    COPLANAR = "coplanar"
    SHORT_ARC = "short_arc"
    NO_DIRECTION = "no_direction"
    NO_SOLUTION = "no_solution"


class Fitted:
    """An element through points, with the distance of each from it, mm: with a sign, or in space without."""

    __slots__ = ()
    residuals: Floats

    @property
    def rms(self) -> float:
        """Root mean square of the distances, mm."""
        return sqrt(float(np.mean(self.residuals**2)))


class Degenerate(ValueError):
    """Points that do not carry what is asked of them.

    have, needed: what there is too little of: points, or for `SHORT_ARC` degrees. at: the points meant, counted from 1.
    """

    def __init__(self, reason: Reason, *, have: float = 0, needed: float = 0, at: tuple[int, ...] = ()) -> None:
        """Say why, and where it can be said how much is missing and which points are meant."""
        detail = f": {have:g} of {needed:g}" if needed else f": points {', '.join(map(str, at))}" if at else ""
        super().__init__(reason.value + detail)
        self.reason, self.have, self.needed, self.at = reason, have, needed, at


def points_of(points: ArrayLike, dimension: int, at_least: int) -> Floats:
    """Points as rows, as many different ones as are needed.

    Raises `Degenerate` for too few, for one that is not a number or too far away, and where points coincide so that
    fewer than `at_least` different ones are left.

    >>> points_of([(0, 0), (1, 0), (0, 0)], 2, 3)
    Traceback (most recent call last):
    ...
    app.core.geometry.points.Degenerate: coincident: points 1, 3
    """
    array = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, dimension)
    if len(array) < at_least:
        raise Degenerate(Reason.TOO_FEW, have=len(array), needed=at_least)
    wrong = ~np.isfinite(array).all(axis=1)
    if wrong.any():
        raise Degenerate(Reason.NOT_FINITE, at=_counted(wrong))
    wrong = (np.abs(array) > FARTHEST).any(axis=1)
    if wrong.any():
        raise Degenerate(Reason.TOO_FAR, at=_counted(wrong))
    pairs = _same(array)
    if len(array) - len(pairs) < at_least:
        raise Degenerate(Reason.COINCIDENT, at=pairs[0])
    return array


def extents(points: Floats) -> tuple[Floats, Floats]:
    """Reach of points along their principal directions, greatest first, and these directions as rows.

    points: already about their centroid.
    """
    _left, values, directions = np.linalg.svd(points, full_matrices=False)
    return values, directions


def surface_of(points: ArrayLike, at_least: int) -> Floats:
    """Points as rows that spread over a surface, as many different ones as are needed.

    Touches in a row lie in many planes; which one is nearest is found by their scatter alone, and a bow along the row would
    be flat in it. Raises `Degenerate` as `points_of` does, and for touches in a row.

    >>> surface_of([(0, 5, 0.05), (50, 5.0004, 0), (100, 4.9997, 0.05), (25, 5, 0.01)], 4)
    Traceback (most recent call last):
    ...
    app.core.geometry.points.Degenerate: collinear
    """
    array = points_of(points, 3, at_least)
    about = array - array.mean(axis=0)
    length, width = np.ptp(about @ extents(about)[1][:2].T, axis=0)
    if width < min(NARROW, NARROW_SHARE * length):
        raise Degenerate(Reason.COLLINEAR)
    return array


def unit(vector: ArrayLike) -> Floats:
    """A vector of length 1, turned so that its greatest component is positive: a direction has no sign of its own.

    >>> unit([0.0, -3.0, 0.0]).tolist()
    [0.0, 1.0, 0.0]
    """
    array = np.asarray(vector, dtype=np.float64)
    array = array / np.linalg.norm(array)
    direction: Floats = (-array if array[np.abs(array).argmax()] < 0 else array) + 0.0
    return direction


def frame(axis: Floats) -> Floats:
    """Three rows: two directions across an axis, and the axis itself; right-handed.

    >>> frame(np.array([0.0, 0.0, 1.0])).tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    least = np.zeros(3)
    least[np.abs(axis).argmin()] = 1.0
    first = least - axis * (axis @ least)
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(axis, first), axis])


def _counted(which: ArrayLike) -> tuple[int, ...]:
    return tuple(int(at) + 1 for at in np.flatnonzero(which)[:8])


def _same(points: Floats) -> list[tuple[int, int]]:
    """Pairs of neighbours in sorted order that are one point, counted from 1."""
    order = np.lexsort(points.T[::-1])
    near = np.abs(np.diff(points[order], axis=0)).max(axis=1, initial=0.0) < TELLING_APART
    pairs = [(int(a) + 1, int(b) + 1) for (a, b), same in zip(pairwise(order), near, strict=True) if same]
    return [(min(pair), max(pair)) for pair in pairs]
