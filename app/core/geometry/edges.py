"""Sides that an edge finder has touched: pocket, web and corner. What is asked of the touches, and the least squares.

The equation and what it is for are in `work_zero`. Lengths mm, angles degrees.
"""

from collections.abc import Callable, Sequence
from enum import StrEnum
from math import degrees, isfinite
from typing import NamedTuple

import numpy as np

from app.core.geometry.points import TELLING_APART, Degenerate, Floats, Reason

STEPS = 50

Values = dict[str, float]


class EdgeKind(StrEnum):
    """Shape that is measured to set a work zero."""

    BORE = "bore"
    BOSS = "boss"
    POCKET = "pocket"
    WEB = "web"
    CORNER = "corner"

    @property
    def inside(self) -> bool:
        """True if the tip touches from within, so that the size is larger than the travel of the tip."""
        return self in {EdgeKind.BORE, EdgeKind.POCKET}

    @property
    def is_round(self) -> bool:
        """True if the shape is a circle."""
        return self in {EdgeKind.BORE, EdgeKind.BOSS}


class Approach(StrEnum):
    """Direction in which the tip was moved when it touched."""

    PLUS_X = "+X"
    MINUS_X = "-X"
    PLUS_Y = "+Y"
    MINUS_Y = "-Y"

    @property
    def axis(self) -> int:
        """0 for X, 1 for Y."""
        return 0 if self.value.endswith("X") else 1

    @property
    def sign(self) -> int:
        """+1 or -1."""
        return 1 if self.value.startswith("+") else -1


class Touch(NamedTuple):
    """Position of the tip's centre, mm. The coordinate across the approach may be missing where nothing is turned."""

    x: float | None
    y: float | None
    approach: Approach | None = None


class Problem(StrEnum):
    """Reasons for no zero, beside those for which no circle can be fitted. Worded at the edge."""

    TOO_FEW = "too_few"
    NO_APPROACH = "no_approach"
    NO_COORDINATE = "no_coordinate"
    ONE_SIDE = "one_side"
    WRONG_SIDE = "wrong_side"
    SAME_PLACE = "same_place"
    SMALLER_THAN_TIP = "smaller_than_tip"
    TURNED_TOO_FAR = "turned_too_far"


class Unfit(ValueError):
    """Touches that make no zero. at: the touches meant, counted from 1; axis, have, needed: where they say something."""

    def __init__(
        self, why: Problem, at: Sequence[int] = (), *, axis: str = "", have: float = 0.0, needed: float = 0.0
    ) -> None:
        """Say why."""
        super().__init__(f"{why.value}: touches {', '.join(map(str, at))}" if at else why.value)
        self.why, self.at, self.axis, self.have, self.needed = why, tuple(sorted(at)), axis, have, needed


Solver = Callable[[Sequence[Touch], float], tuple[Values, Floats]]
"""Touches and tip to values by name and residuals."""


def check(kind: EdgeKind, touches: Sequence[Touch]) -> None:
    if len(touches) < 2:
        raise Unfit(Problem.TOO_FEW, have=len(touches), needed=2)
    missing = [at for at, touch in enumerate(touches, 1) if touch.approach is None]
    if missing:
        raise Unfit(Problem.NO_APPROACH, missing)
    for at, touch in enumerate(touches, 1):
        for value in (touch.x, touch.y):
            if value is not None and not isfinite(value):
                raise Degenerate(Reason.NOT_FINITE, at=(at,))
    places_of(touches, range(len(touches)), needed=_sharing(touches))
    for axis in (0, 1):
        lower, upper = (
            [i for i, t in enumerate(touches) if t.approach and (t.approach.axis, t.approach.sign) == (axis, sign)]
            for sign in (-1, 1)
        )
        name = "XY"[axis]
        if kind is EdgeKind.CORNER:
            if not lower and not upper:
                raise Unfit(Problem.ONE_SIDE, axis=name)
            if lower and upper:
                raise Unfit(Problem.WRONG_SIDE, [i + 1 for i in (*lower, *upper)], axis=name)
            continue
        if bool(lower) != bool(upper):
            raise Unfit(Problem.ONE_SIDE, [i + 1 for i in (*lower, *upper)], axis=name)
        if not lower:
            continue
        travelled = _mean(touches, upper, axis) - _mean(touches, lower, axis)
        if abs(travelled) < TELLING_APART:
            raise Unfit(Problem.SAME_PLACE, [i + 1 for i in (*lower, *upper)], axis=name)
        if (travelled > 0) != kind.inside:
            raise Unfit(Problem.WRONG_SIDE, [i + 1 for i in (*lower, *upper)], axis=name)


def _mean(touches: Sequence[Touch], which: Sequence[int], axis: int) -> float:
    return sum(touches[i][axis] or 0.0 for i in which) / len(which)  # type: ignore[misc]


def _sharing(touches: Sequence[Touch]) -> bool:
    """Tell if two points share a side, so that the part may be turned; they must lie apart along it."""
    shared = False
    for at, touch in enumerate(touches):
        for before in range(at):
            other = touches[before]
            if touch.approach is not other.approach or touch.approach is None:
                continue
            across = 1 - touch.approach.axis
            here, there = touch[across], other[across]
            if isinstance(here, float | int) and isinstance(there, float | int) and abs(here - there) < 1e-3:
                raise Unfit(Problem.SAME_PLACE, (before + 1, at + 1), axis="XY"[across])
            shared = True
    return shared


def places_of(touches: Sequence[Touch], which: Sequence[int], *, needed: bool = True) -> Floats:
    """Touches as rows of x, y; what is missing across the approach is 0 where it is not needed."""
    for at in which:
        touch = touches[at]
        for axis, value in enumerate((touch.x, touch.y)):
            along = touch.approach is None or touch.approach.axis == axis
            if value is None and (needed or along):
                raise Unfit(Problem.NO_COORDINATE, (at + 1,), axis="XY"[axis])
    return np.array([[touches[at].x or 0.0, touches[at].y or 0.0] for at in which], dtype=np.float64).reshape(-1, 2)


def _directions(touches: Sequence[Touch], angle: float = 0.0) -> Floats:
    """The approaches as unit vectors, turned with the part; angle in radians."""
    cos, sin = np.cos(angle), np.sin(angle)
    rows = [(t.approach.sign * np.eye(2)[t.approach.axis]) for t in touches if t.approach is not None]
    turned: Floats = np.array(rows) @ np.array([[cos, sin], [-sin, cos]])
    return turned


def sides(kind: EdgeKind) -> Solver:
    """Centre, half sizes and rotation of a pocket or web together, by Gauss and Newton."""
    side = 1.0 if kind.inside else -1.0

    def solve(touches: Sequence[Touch], tip: float) -> tuple[Values, Floats]:
        turning = _sharing(touches)
        places = places_of(touches, range(len(touches)), needed=turning)
        axes = np.array([touch.approach.axis for touch in touches if touch.approach is not None])
        both = [axis for axis in (0, 1) if (axes == axis).any()]
        centre = places.mean(axis=0)
        halves = np.zeros(2)
        angle = 0.0
        for axis in both:
            mine = places[axes == axis, axis]
            centre[axis] = (mine.max() + mine.min()) / 2
            halves[axis] = (np.ptp(mine) + side * tip) / 2
        for _ in range(STEPS):
            normals = _directions(touches, angle)
            away = places - centre
            residuals = (normals * away).sum(axis=1) + tip / 2 - side * halves[axes]
            turned = np.column_stack([-normals[:, 1], normals[:, 0]])  # derivative of the normals by the angle
            columns = [-normals[:, axis] for axis in both] + [-side * (axes == axis) for axis in both]
            columns += [(turned * away).sum(axis=1)] if turning else []
            step = np.linalg.lstsq(np.column_stack(columns), -residuals, rcond=None)[0]
            centre[both] += step[: len(both)]
            halves[both] += step[len(both) : 2 * len(both)]
            if turning:
                angle += float(step[-1])
            if np.abs(step).max() < 1e-13 * max(1.0, float(np.abs(centre).max())):
                break
        normals = _directions(touches, angle)
        residuals = (normals * (places - centre)).sum(axis=1) + tip / 2 - side * halves[axes]
        values = {"xy"[axis]: float(centre[axis]) for axis in both}
        values |= {("length", "width")[axis]: 2 * float(halves[axis]) for axis in both}
        if turning:
            values["rotation"] = degrees(angle)
        return values, residuals

    return solve


def across(kind: EdgeKind) -> Solver:
    """Centre and diameter of a bore or boss from one pair of opposite touches, or two.

    Each pair lies on a chord. Halfway along it is the centre whatever the chord; the longer one is nearer to the diameter.
    """
    of_pairs = sides(kind)

    def solve(touches: Sequence[Touch], tip: float) -> tuple[Values, Floats]:
        values, residuals = of_pairs(touches, tip)
        return values | {"diameter": max(values[name] for name in ("length", "width") if name in values)}, residuals

    return solve


def is_paired(touches: Sequence[Touch]) -> bool:
    """Tell if a round part was probed in pairs across it: each point from another side, with too few for a circle."""
    approaches = [touch.approach for touch in touches]
    if None in approaches or len(set(approaches)) < len(approaches):
        return False
    return len(touches) == 2 or any(touch.x is None or touch.y is None for touch in touches)


def corner(touches: Sequence[Touch], tip: float) -> tuple[Values, Floats]:
    """Intersection of the two sides of a corner. Each side with two points has its own direction."""
    places = places_of(touches, range(len(touches)), needed=_sharing(touches))
    axes = np.array([touch.approach.axis for touch in touches if touch.approach is not None])
    straight = _directions(touches)
    angles: dict[int, float] = {}
    for axis in (0, 1):
        mine = places[axes == axis]
        if len(mine) > 1:
            along = np.linalg.svd(mine - mine.mean(axis=0))[2][0]
            normal = np.array([along[1], -along[0]])
            nominal = straight[axes == axis][0]
            normal *= np.sign(normal @ nominal) or 1.0
            angles[axis] = float(np.arctan2(nominal[0] * normal[1] - nominal[1] * normal[0], nominal @ normal))
    normals, reaches = np.zeros((2, 2)), np.zeros(2)
    for axis in (0, 1):
        turned = angles.get(axis, angles.get(1 - axis, 0.0))
        which = np.flatnonzero(axes == axis)
        normals[axis] = _directions([touches[i] for i in which[:1]], turned)[0]
        reaches[axis] = float((places[which] @ normals[axis]).mean()) + tip / 2
    meeting = np.linalg.solve(normals, reaches)
    residuals = (normals[axes] * places).sum(axis=1) + tip / 2 - reaches[axes]
    values = {"x": float(meeting[0]), "y": float(meeting[1])}
    if angles:
        values["rotation"] = degrees(angles.get(1, angles.get(0, 0.0)))  # of the side along X, where it has two touches
    if len(angles) == 2:
        values["squareness"] = degrees(angles[0] - angles[1])
    return values, residuals
