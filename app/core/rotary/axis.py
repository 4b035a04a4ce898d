"""Position errors of one rotary axis from ball centres at several of its angles (domain §9).

For C, with R the rotation by the angle φ and p0 the ball's nominal centre at φ = 0:

    d(φ) = P - R p0 = (I - R) t + (w x R p0 - R (w x p0)) + R s - b a/2 (z x R p0)

t = (EX0C, EY0C, 0) is where the axis is beside its nominal place, w = (EA0C, EB0C, 0) how it leans. Besides the
domain's model: s, how far the ball lies from its nominal centre (left out with ``ball_known``), and the backlash b where
every angle is approached from both sides (a = +1 in the positive direction, -1 in the negative: the axis lags behind).
A and B follow by cyclic exchange of X, Y, Z. Linear least squares over all positions; lengths in mm, angles in degrees.

So a table carries the ball round. Where a head turns, the ball stays, and the control, which takes the axis for nominal,
shows it at P = p0 + s - d(φ): where the tip truly is further by d, the machine stands back by d. What is found has the
same sign for both: t and w are from where the control believes the axis to where it is, so the kinematics gets t and w
added. Angles count by the right hand about +X, +Y, +Z; ``reversed`` for an axis that counts against it, as many tables do.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import degrees, hypot, radians, sqrt
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.core.spc.spread import t_quantile
from app.core.spc.variation import varies

Floats = NDArray[np.float64]
Point = tuple[float, float, float]
AxisName = Literal["A", "B", "C"]
AXES: tuple[AxisName, ...] = ("A", "B", "C")
ERRORS: dict[AxisName, tuple[str, str, str, str]] = {
    "A": ("EY0A", "EZ0A", "EB0A", "EC0A"),
    "B": ("EZ0B", "EX0B", "EC0B", "EA0B"),
    "C": ("EX0C", "EY0C", "EA0C", "EB0C"),
}
"""The position errors of each axis in the order of QS144 to QS146: two in mm, two in degrees."""

FEWEST = 3
NARROWEST_ARC = 60.0  # degrees; on less, where the axis stands and where the ball lies can hardly be distinguished
WORST_CONDITION = 1e6
EXACT = 1e-9  # mm; what scatters less does not scatter
SMALLEST_RADIUS = 1.0  # mm; a ball (nearly) on the axis does not move when it turns
ELSEWHERE, ELSEWHERE_SHARE = 10.0, 0.5  # mm and of the radius: further off, the positions are not of this axis and ball


class AxisFault(StrEnum):
    """Reasons for which positions determine no axis. The sentence is worded at the edge."""

    TOO_FEW = "too_few_positions"
    ONE_SIDED_ARC = "one_sided_arc"
    ON_AXIS = "ball_on_axis"
    ELSEWHERE = "elsewhere"
    RANK = "rank"


class Carried(StrEnum):
    """Part that the axis turns: the table with the calibration sphere on it, or the head with the probe."""

    TABLE = "table"
    HEAD = "head"


@dataclass
class NoAxis(Exception):
    """These positions determine no axis. got: positions, arc (degrees), radius, distance (mm) or condition; needed: at least.

    fits: what the positions would fit, were they sent as that: `reversed`, `head` or `table`; empty: nothing that is known.
    """

    fault: AxisFault
    got: float
    needed: float
    fits: str = ""


class Position(NamedTuple):
    """Measured centre of the calibration sphere (mm) at an angle of the axis, degrees; approach: +1, -1, 0 if unknown.

    spread: covariance of the centre for touches that scatter by 1; None: each coordinate is as sure as the others.
    """

    angle: float
    centre: Point
    approach: int = 0
    spread: tuple[Point, Point, Point] | None = None


class Estimate(NamedTuple):
    """A value with its standard deviation, in the same unit; None where nothing scatters that it could be distinguished from."""

    value: float
    deviation: float | None


@dataclass(frozen=True)
class AxisErrors:
    """Errors of an axis from its measured positions; mm and degrees.

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

    def half_width(self, name: str, confidence: float = 0.95) -> float | None:
        """Half of the confidence interval of a position error, by Student's t; None where its deviation is unknown."""
        deviation = self.errors[name].deviation
        return None if deviation is None else t_quantile(self.freedom, confidence) * deviation


def rotation(axis: AxisName, angle: float) -> Floats:
    """R: the rotation by an angle in degrees about an axis, as a matrix for X, Y, Z.

    >>> rotation("C", 90).round(12).tolist()
    [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    """
    order = _order(axis)
    matrix = np.zeros((3, 3))
    matrix[np.ix_(order, order)] = _about_third(angle)
    return matrix


def arc_of(angles: Sequence[float]) -> float:
    """The smallest arc that holds all angles, degrees.

    >>> arc_of([350, 0, 10]), arc_of([0, 90, 180, 270])
    (20.0, 270.0)
    """
    turned = np.sort(np.unique(np.mod(np.asarray(angles, dtype=np.float64), 360).round(6)))
    gaps = np.diff(np.append(turned, turned[0] + 360))
    return 360.0 - float(gaps.max())


def estimate(
    axis: AxisName,
    positions: Sequence[Position],
    ball: Sequence[float] | None = None,
    *,
    ball_known: bool = False,
    carries: Carried = Carried.TABLE,
    reversed_: bool = False,
    touch: float | None = None,
) -> AxisErrors:
    """The position errors of an axis.

    ball: nominal centre p0 at the angle 0, from where the axis should be; the mean of the centres turned back if nobody
    says it. ball_known: it lies there exactly, as the printed model takes it. carries: what the axis turns. reversed_: its
    angles count against the right hand. touch: standard deviation of a touch (mm), where positions have a spread. Raises `NoAxis` for fewer than three angles, an arc below 60°, a ball on the axis,
    or centres that lie nowhere near.

    >>> seen = [Position(φ, tuple(rotation("C", φ) @ (100, 0, 50) + (1 - c, -s, 0))) for φ, c, s in
    ...         [(0, 1, 0), (90, 0, 1), (180, -1, 0), (270, 0, -1)]]
    >>> found = estimate("C", seen, (100, 0, 50))
    >>> [round(found.errors[name].value, 9) + 0.0 for name in ("EX0C", "EY0C", "EA0C", "EB0C")]
    [1.0, 0.0, 0.0, 0.0]
    """
    angles = [position.angle for position in positions]
    distinct = len({round(angle % 360, 6) for angle in angles})
    if distinct < FEWEST:
        raise NoAxis(AxisFault.TOO_FEW, distinct, FEWEST)
    arc = arc_of(angles)
    if arc < NARROWEST_ARC:
        raise NoAxis(AxisFault.ONE_SIDED_ARC, arc, NARROWEST_ARC)
    order, sense, head = _order(axis), -1 if reversed_ else 1, carries is Carried.HEAD
    turns = np.array([_about_third(sense * angle) for angle in angles])
    seen = np.array([position.centre for position in positions], dtype=np.float64)[:, order]
    nominal, deviations = _near(seen, turns, None if ball is None else np.array(ball, float)[order], head=head)
    approaches = sense * np.array([position.approach for position in positions], dtype=np.float64)
    both = bool((approaches > 0).any() and (approaches < 0).any())
    columns = _columns(turns, nominal, approaches if both else None, ball_known=ball_known, head=head)
    sure = _spreads(positions, order)
    solved, spread, condition, noise, freedom = _solve(columns, deviations.ravel(), sure, touch)
    residuals = deviations - (columns @ solved).reshape(-1, 3)
    scatters = varies(_rms(np.linalg.norm(residuals, axis=1)), seen, nominal)
    values = [Estimate(float(v) + 0.0, float(s) if scatters else None) for v, s in zip(solved, spread, strict=True)]
    shift = None
    if not ball_known:
        by_letter = dict(zip(order, values[-3:], strict=True))
        shift = (by_letter[0], by_letter[1], by_letter[2])
    leaning = np.array([solved[3], -solved[2]]) * nominal[2]  # where the axis is at the height of the ball
    centre = nominal[:2] - solved[:2] - leaning + (0 if ball_known or head else solved[-3:-1])
    radius = hypot(float(centre[0]), float(centre[1]))
    if radius < SMALLEST_RADIUS:
        raise NoAxis(AxisFault.ON_AXIS, radius, SMALLEST_RADIUS)
    tangents = np.cross([0.0, 0.0, -1.0 if head else 1.0], turns @ nominal)
    lengths = np.linalg.norm(tangents, axis=1)
    turning = sense * np.degrees((residuals * tangents).sum(axis=1) / lengths**2)
    before, after = np.linalg.norm(deviations, axis=1), np.linalg.norm(residuals, axis=1)
    return AxisErrors(
        axis=axis,
        ball=_restored(nominal, order),
        errors=dict(zip(ERRORS[axis], [*values[:2], *map(_in_degrees, values[2:4])], strict=True)),
        shift=shift,
        backlash=_in_degrees(values[4]) if both else None,
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
        measured=tuple(_restored(deviation, order) for deviation in deviations),
        optimised=tuple(_restored(residual, order) for residual in residuals),
    )


def _in_degrees(angle: Estimate) -> Estimate:
    return Estimate(degrees(angle.value), None if angle.deviation is None else degrees(angle.deviation))


def _near(seen: Floats, turns: Floats, ball: Floats | None, *, head: bool) -> tuple[Floats, Floats]:
    """The nominal ball and the deviations from it. Raises `NoAxis` for a ball on the axis, or centres of something else."""
    back = turns.transpose(0, 2, 1)
    still = np.broadcast_to(np.eye(3), turns.shape)
    carried_by = {}
    for name, way in (("table", turns), ("reversed", back), ("head", still)):
        nominal = np.einsum("nji,nj->ni", way, seen).mean(axis=0) if ball is None else ball
        deviations = seen - way @ nominal
        far = _rms(np.linalg.norm(deviations, axis=1))
        carried_by[name] = (nominal, deviations, far, max(ELSEWHERE, ELSEWHERE_SHARE * hypot(nominal[0], nominal[1])))
    nominal, deviations, far, most = carried_by["head" if head else "table"]
    if far > most:
        fits = [name for name, (_nominal, _off, away, permitted) in carried_by.items() if away < permitted]
        raise NoAxis(AxisFault.ELSEWHERE, far, most, fits[0] if fits else "")
    radius = hypot(nominal[0], nominal[1])
    if radius < SMALLEST_RADIUS:
        raise NoAxis(AxisFault.ON_AXIS, radius, SMALLEST_RADIUS)
    return nominal, deviations


def _order(axis: AxisName) -> list[int]:
    """Cyclic exchange of X, Y, Z that makes the axis the third."""
    third = AXES.index(axis)
    return [(third + 1) % 3, (third + 2) % 3, third]


def _about_third(angle: float) -> Floats:
    c, s = np.cos(radians(angle)), np.sin(radians(angle))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _columns(turns: Floats, ball: Floats, approaches: Floats | None, *, ball_known: bool, head: bool) -> Floats:
    """The design: three rows for each position; columns t1, t2, w1, w2, then b and s where they are looked for."""
    eye, turned = np.eye(3), turns @ ball
    columns = [eye[:, k] - turns[:, :, k] for k in (0, 1)]
    columns += [np.cross(eye[k], turned) - turns @ np.cross(eye[k], ball) for k in (0, 1)]
    if approaches is not None:
        columns.append(-approaches[:, None] / 2 * np.cross(eye[2], turned))
    if head:
        columns = [-column for column in columns]
    if not ball_known:
        columns += [np.broadcast_to(eye[:, k], turned.shape) if head else turns[:, :, k] for k in range(3)]
    return np.stack(columns, axis=-1).reshape(-1, len(columns))


def _spreads(positions: Sequence[Position], order: Sequence[int]) -> Floats | None:
    """The spreads of all centres, with the axis as the third; None where one of them has none."""
    spreads = [position.spread for position in positions if position.spread is not None]
    return np.array(spreads)[:, order][:, :, order] if len(spreads) == len(positions) else None


def _solve(
    columns: Floats, deviations: Floats, spreads: Floats | None = None, touch: float | None = None
) -> tuple[Floats, Floats, float, float, int]:
    """Least squares with standard deviations, condition number, standard deviation of one coordinate, and freedom.

    Centres that are less sure in one direction than in another are weighted: by what the touches leave unsure, and what
    scatters besides alike in all directions (an axis that does not come back quite).
    """
    solution = _least_squares(columns, deviations)
    noise = solution[3]
    if spreads is None or noise < EXACT:
        return solution
    touched = spreads * (noise if touch is None else touch) ** 2
    besides = 0.0 if touch is None else max(noise**2 - _mean_variance(touched), 0.0)
    whole = touched + besides * np.eye(3)
    size = _mean_variance(whole)
    if not size > 0:
        return solution
    roots = np.linalg.inv(np.linalg.cholesky(whole / size))
    weighted = np.einsum("nij,njp->nip", roots, columns.reshape(len(roots), 3, -1)).reshape(columns.shape)
    solved, spread, _condition, noise, freedom = _least_squares(
        weighted, np.einsum("nij,nj->ni", roots, deviations.reshape(-1, 3)).ravel()
    )
    return solved, spread, solution[2], noise, freedom


def _mean_variance(covariances: Floats) -> float:
    return float(np.trace(covariances, axis1=1, axis2=2).mean()) / 3


def _least_squares(columns: Floats, deviations: Floats) -> tuple[Floats, Floats, float, float, int]:
    scale = np.linalg.norm(columns, axis=0)
    if not scale.min() > 0:
        raise NoAxis(AxisFault.RANK, float("inf"), WORST_CONDITION)
    u, sizes, v = np.linalg.svd(columns / scale, full_matrices=False)
    condition = float(sizes[0] / sizes[-1]) if sizes[-1] > 0 else float("inf")
    if not condition < WORST_CONDITION:
        raise NoAxis(AxisFault.RANK, condition, WORST_CONDITION)
    inverse = (v.T / sizes) / scale[:, None]
    solved = inverse @ (u.T @ deviations)
    freedom = len(deviations) - columns.shape[1]
    left = deviations - columns @ solved
    noise = sqrt(float(left @ left) / freedom)
    return solved, noise * np.sqrt((inverse**2).sum(axis=1)), condition, noise, freedom


def _restored(values: Floats, order: Sequence[int]) -> Point:
    """X, Y, Z of what was reckoned with the axis as the third, to a picometre."""
    restored = np.empty(3)
    restored[list(order)] = values
    x, y, z = (round(float(value), 12) + 0.0 for value in restored)
    return x, y, z


def _rms(lengths: Floats) -> float:
    return sqrt(float(lengths @ lengths) / len(lengths))
