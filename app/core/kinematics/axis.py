"""Position errors of one rotary axis from ball centres at several of its angles (domain §9).

For C, with R the rotation by the angle φ and p0 the ball's nominal centre at φ = 0:

    d(φ) = P - R p0 = (I - R) t + (w x R p0 - R (w x p0)) + R s - b a/2 (z x R p0)

t = (EX0C, EY0C, 0) is where the axis stands beside its nominal place, w = (EA0C, EB0C, 0) how it leans. Besides the
domain's model: s, how far the ball lies from its nominal centre (left out with ``ball_known``), and the backlash b where
every angle is approached from both sides (a = +1 in the positive direction, -1 in the negative: the axis lags behind).
A and B follow by cyclic exchange of X, Y, Z. Linear least squares over all positions; lengths in mm, angles in degrees.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import degrees, hypot, radians, sqrt
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

Floats = NDArray[np.float64]
Point = tuple[float, float, float]
AxisName = Literal["A", "B", "C"]
AXES: tuple[AxisName, ...] = ("A", "B", "C")
LETTERS = "XYZ"
ERRORS: dict[AxisName, tuple[str, str, str, str]] = {
    "A": ("EY0A", "EZ0A", "EB0A", "EC0A"),
    "B": ("EZ0B", "EX0B", "EC0B", "EA0B"),
    "C": ("EX0C", "EY0C", "EA0C", "EB0C"),
}
"""The position errors of each axis in the order of QS144 to QS146: two in mm, two in degrees."""

FEWEST = 3
NARROWEST_ARC = 60.0  # degrees; on less, where the axis stands and where the ball lies can hardly be told apart
WORST_CONDITION = 1e6
SMALLEST_RADIUS = 1.0  # mm; a ball (nearly) on the axis does not move when it turns


class AxisFault(StrEnum):
    """Why positions give no axis. The sentence is worded at the edge."""

    TOO_FEW = "too_few_positions"
    ONE_SIDED_ARC = "one_sided_arc"
    ON_AXIS = "ball_on_axis"
    RANK = "rank"


@dataclass
class NoAxis(Exception):
    """These positions determine no axis. got: positions, arc (degrees), radius (mm) or condition; needed: at least."""

    fault: AxisFault
    got: float
    needed: float


class Position(NamedTuple):
    """Where the ball was found (mm) at an angle of the axis, degrees; approach: +1, -1, or 0 where nobody said from where."""

    angle: float
    centre: Point
    approach: int = 0


class Estimate(NamedTuple):
    """A value with its standard deviation, in the same unit."""

    value: float
    deviation: float


@dataclass(frozen=True)
class AxisErrors:
    """What the positions say of an axis; mm and degrees.

    errors: by their names, in the order of the result string. shift: how far the ball lies from its nominal centre, X Y Z.
    scatter_before, scatter_after: rms of the deviations and of the residuals; greatest likewise. mean_error: mean length
    of the residuals. angle_error: the largest that a residual comes to as an angle about the axis itself. radius: of the
    circle that the ball runs on. measured, optimised: deviations X Y Z of every position, before and after.
    """

    axis: AxisName
    ball: Point
    errors: dict[str, Estimate]
    shift: tuple[Estimate, Estimate, Estimate] | None
    backlash: Estimate | None
    scatter_before: float
    scatter_after: float
    greatest_before: float
    greatest_after: float
    mean_error: float
    angle_error: float
    radius: float
    arc: float
    condition: float
    freedom: int
    noise: float
    measured: tuple[Point, ...]
    optimised: tuple[Point, ...]

    def half_width(self, name: str, confidence: float = 0.95) -> float:
        """Half of the confidence interval of a position error, by Student's t."""
        return float(stdtrit(self.freedom, (1 + confidence) / 2)) * self.errors[name].deviation


def rotation(axis: AxisName, angle: float) -> Floats:
    """R: the rotation by an angle in degrees about an axis, as a matrix for X, Y, Z.

    >>> rotation("C", 90).round(12).tolist()
    [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    """
    order = _order(axis)
    made = np.zeros((3, 3))
    made[np.ix_(order, order)] = _about_third(angle)
    return made


def arc_of(angles: Sequence[float]) -> float:
    """The smallest arc that holds all angles, degrees.

    >>> arc_of([350, 0, 10]), arc_of([0, 90, 180, 270])
    (20.0, 270.0)
    """
    turned = np.sort(np.unique(np.mod(np.asarray(angles, dtype=np.float64), 360).round(6)))
    gaps = np.diff(np.append(turned, turned[0] + 360))
    return 360.0 - float(gaps.max())


def estimate(
    axis: AxisName, positions: Sequence[Position], ball: Sequence[float] | None = None, *, ball_known: bool = False
) -> AxisErrors:
    """The position errors of an axis.

    ball: nominal centre p0 at the angle 0, from where the axis should be; the mean of the centres turned back if nobody
    says it. ball_known: it lies there exactly, as the printed model takes it. Raises `NoAxis` for fewer than three
    angles, an arc below 60°, or a ball on the axis.

    >>> seen = [Position(φ, tuple(rotation("C", φ) @ (100, 0, 50) + (1 - c, -s, 0))) for φ, c, s in
    ...         [(0, 1, 0), (90, 0, 1), (180, -1, 0), (270, 0, -1)]]
    >>> found = estimate("C", seen, (100, 0, 50))
    >>> [round(found.errors[name].value, 9) + 0.0 for name in ("EX0C", "EY0C", "EA0C", "EB0C")]
    [1.0, 0.0, 0.0, 0.0]
    """
    angles = [each.angle for each in positions]
    distinct = len({round(angle % 360, 6) for angle in angles})
    if distinct < FEWEST:
        raise NoAxis(AxisFault.TOO_FEW, distinct, FEWEST)
    arc = arc_of(angles)
    if arc < NARROWEST_ARC:
        raise NoAxis(AxisFault.ONE_SIDED_ARC, arc, NARROWEST_ARC)
    order = _order(axis)
    turns = np.array([_about_third(angle) for angle in angles])
    seen = np.array([each.centre for each in positions], dtype=np.float64)[:, order]
    nominal = np.einsum("nji,nj->ni", turns, seen).mean(axis=0) if ball is None else np.array(ball, float)[order]
    if hypot(nominal[0], nominal[1]) < SMALLEST_RADIUS:
        raise NoAxis(AxisFault.ON_AXIS, hypot(nominal[0], nominal[1]), SMALLEST_RADIUS)
    approaches = np.array([each.approach for each in positions], dtype=np.float64)
    both = bool((approaches > 0).any() and (approaches < 0).any())
    deviations = seen - turns @ nominal
    columns = _columns(turns, nominal, approaches if both else None, ball_known=ball_known)
    solved, spread, condition, noise, freedom = _solve(columns, deviations.ravel())
    residuals = deviations - (columns @ solved).reshape(-1, 3)
    values = [Estimate(float(v) + 0.0, float(s)) for v, s in zip(solved, spread, strict=True)]
    tilts = [Estimate(degrees(v), degrees(s)) for v, s in values[2:4]]
    shift = None
    if not ball_known:
        by_letter = dict(zip(order, values[-3:], strict=True))
        shift = (by_letter[0], by_letter[1], by_letter[2])
    leaning = np.array([solved[3], -solved[2]]) * nominal[2]  # where the axis stands at the height of the ball
    centre = nominal[:2] - solved[:2] - leaning + (0 if ball_known else solved[-3:-1])
    radius = hypot(float(centre[0]), float(centre[1]))
    tangents = np.cross([0.0, 0.0, 1.0], turns @ nominal)
    lengths = np.linalg.norm(tangents, axis=1)
    turning = np.degrees((residuals * tangents).sum(axis=1) / lengths**2)
    before, after = np.linalg.norm(deviations, axis=1), np.linalg.norm(residuals, axis=1)
    return AxisErrors(
        axis=axis,
        ball=_restored(nominal, order),
        errors=dict(zip(ERRORS[axis], [*values[:2], *tilts], strict=True)),
        shift=shift,
        backlash=Estimate(degrees(values[4].value), degrees(values[4].deviation)) if both else None,
        scatter_before=_rms(before),
        scatter_after=_rms(after),
        greatest_before=float(before.max()),
        greatest_after=float(after.max()),
        mean_error=float(after.mean()),
        angle_error=float(turning[np.abs(turning).argmax()]) + 0.0,
        radius=radius,
        arc=arc,
        condition=condition,
        freedom=freedom,
        noise=noise,
        measured=tuple(_restored(each, order) for each in deviations),
        optimised=tuple(_restored(each, order) for each in residuals),
    )


def _order(axis: AxisName) -> list[int]:
    """Which of X, Y, Z stand first, second and third when the axis is taken for the third: the cyclic exchange."""
    third = AXES.index(axis)
    return [(third + 1) % 3, (third + 2) % 3, third]


def _about_third(angle: float) -> Floats:
    c, s = np.cos(radians(angle)), np.sin(radians(angle))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _columns(turns: Floats, ball: Floats, approaches: Floats | None, *, ball_known: bool) -> Floats:
    """The design: three rows for each position; columns t1, t2, w1, w2, then b and s where they are looked for."""
    eye, turned = np.eye(3), turns @ ball
    columns = [eye[:, k] - turns[:, :, k] for k in (0, 1)]
    columns += [np.cross(eye[k], turned) - turns @ np.cross(eye[k], ball) for k in (0, 1)]
    if approaches is not None:
        columns.append(-approaches[:, None] / 2 * np.cross(eye[2], turned))
    if not ball_known:
        columns += [turns[:, :, k] for k in range(3)]
    return np.stack(columns, axis=-1).reshape(-1, len(columns))


def _solve(columns: Floats, wanted: Floats) -> tuple[Floats, Floats, float, float, int]:
    """Least squares with standard deviations, condition number, standard deviation of one coordinate, and freedom."""
    scale = np.linalg.norm(columns, axis=0)
    if not scale.min() > 0:
        raise NoAxis(AxisFault.RANK, float("inf"), WORST_CONDITION)
    u, sizes, v = np.linalg.svd(columns / scale, full_matrices=False)
    condition = float(sizes[0] / sizes[-1]) if sizes[-1] > 0 else float("inf")
    if not condition < WORST_CONDITION:
        raise NoAxis(AxisFault.RANK, condition, WORST_CONDITION)
    inverse = (v.T / sizes) / scale[:, None]
    solved = inverse @ (u.T @ wanted)
    freedom = len(wanted) - columns.shape[1]
    left = wanted - columns @ solved
    noise = sqrt(float(left @ left) / freedom)
    return solved, noise * np.sqrt((inverse**2).sum(axis=1)), condition, noise, freedom


def _restored(values: Floats, order: Sequence[int]) -> Point:
    """X, Y, Z of what was reckoned with the axis as the third, to a picometre."""
    made = np.empty(3)
    made[list(order)] = values
    x, y, z = (round(float(each), 12) + 0.0 for each in made)
    return x, y, z


def _rms(lengths: Floats) -> float:
    return sqrt(float(lengths @ lengths) / len(lengths))
