"""Alignment in a plane: two touches along a side, or two holes, each from its touches; and turning the table by it.

    angle = direction(actual 2 - actual 1) - direction(nominal 2 - nominal 1)

Two touches show the turn and how far the side lies off; along the side they say nothing. Two holes show the shift as
well, and check themselves: their distance must be the nominal one. Lengths mm, angles degrees, about Z.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import atan2, degrees, hypot, sqrt
from typing import NamedTuple

import numpy as np

from app.core.decision.step import rounded
from app.core.geometry.circle import fit_circle
from app.core.geometry.frames import angles_of, frame, from_angles
from app.core.geometry.points import Floats, points_of

COVERAGE = 2.0
Place = tuple[float, float]


class Hole(NamedTuple):
    """A hole or spigot: its centre from three touches or more, or as the control has found it, mm.

    cofactors: variance of the centre's X and Y, and their covariance, for touches with variance 1.
    """

    centre: Place
    diameter: float | None = None
    cofactors: tuple[float, float, float] = (1.0, 1.0, 0.0)
    residuals: tuple[float, ...] = ()

    @classmethod
    def from_touches(cls, touches: Sequence[Place], tip: float = 0.0, *, inside: bool = True) -> "Hole":
        """The circle of its touches (tip's centre). Raises `Degenerate`.

        >>> Hole.from_touches([(12, 10), (10, 12), (8, 10), (10, 8)], 2.0).centre
        (10.0, 10.0)
        """
        circle = fit_circle(touches)
        x, y = (rounded(float(value)) for value in circle.centre)
        c = circle.cofactors
        size = 2 * circle.radius + (tip if inside else -tip)
        return cls((x, y), size, (float(c[0, 0]), float(c[1, 1]), float(c[0, 1])), tuple(circle.residuals.tolist()))


@dataclass(frozen=True, eq=False)
class InPlane:
    """Position and rotation of a part in the plane. motion: 4 x 4, a shift in X and Y and a turn about Z.

    off: by how much the distance of the holes differs from the nominal one, mm; None for touches on a side.
    uncertainty: of a, b (mm) and gamma (degrees), 95 %.
    """

    motion: Floats
    off: float | None = None
    uncertainty: dict[str, float] = field(default_factory=dict)

    @property
    def angle(self) -> float:
        """gamma, degrees."""
        return angles_of(self.motion[:3, :3])[2]


def two_points(nominal: Sequence[Place], measured: Sequence[Place], repeatability: float | None = None) -> InPlane:
    """Fit by two points on a side. The shift is across the side; along it the part is assumed in its nominal place.

    >>> fit = two_points([(0, 0), (100, 0)], [(0, 0.1), (100, 0.3)])
    >>> round(fit.angle, 6), fit.motion[:2, 3].round(6).tolist()
    (0.114591, [-0.0002, 0.1])
    """
    first, second = _pair(nominal)
    turn, distance = _turn(nominal, measured)
    rotation = from_angles(0.0, 0.0, degrees(turn))
    along = rotation[:2, :2] @ (second - first) / distance
    across = np.array([-along[1], along[0]])
    away = _pair(measured)[0] - rotation[:2, :2] @ first
    shift = across * float(away @ across)
    uncertainty = {}
    if repeatability:
        lever = float((first @ (second - first)) / distance)  # where the foot of the origin lies along the side
        weights = (1 + lever / distance, -lever / distance)
        off = COVERAGE * repeatability * hypot(*weights)
        turning = COVERAGE * repeatability * sqrt(2) / distance
        uncertainty = {
            "a": off * abs(float(across[0])),
            "b": off * abs(float(across[1])),
            "gamma": degrees(turning),
        }
    return InPlane(frame(rotation, [*shift, 0.0]), None, uncertainty)


def two_holes(nominal: Sequence[Place], holes: Sequence[Hole], repeatability: float | None = None) -> InPlane:
    """Fit by the centres of two holes. Both share the error of their distance.

    >>> fit = two_holes([(0, 0), (100, 0)], [Hole((1, 2)), Hole((101.001, 2))])
    >>> round(fit.off, 6), fit.motion[:2, 3].round(6).tolist()
    (0.001, [1.0005, 2.0])
    """
    measured = [hole.centre for hole in holes]
    turn, distance = _turn(nominal, measured)
    rotation = from_angles(0.0, 0.0, degrees(turn))
    middle = _pair(nominal).mean(axis=0)
    shift = _pair(measured).mean(axis=0) - rotation[:2, :2] @ middle
    direction = _pair(measured)[1] - _pair(measured)[0]
    uncertainty = {}
    if repeatability:
        across = np.array([-direction[1], direction[0]]) / np.linalg.norm(direction)
        spread = [np.array([[vx, xy], [xy, vy]]) for vx, vy, xy in (hole.cofactors for hole in holes)]
        lever = rotation[:2, :2] @ np.array([-middle[1], middle[0]])
        # Shift at the origin = middle of the centres less the turn times the lever: how each centre moves it.
        squares, turning = np.zeros(2), 0.0
        for sign, mine in zip((-1.0, 1.0), spread, strict=True):
            of_turn = sign * across / distance
            moved = np.eye(2) / 2 - np.outer(lever, of_turn)
            squares += np.diag(moved @ mine @ moved.T)
            turning += float(of_turn @ mine @ of_turn)
        a, b = COVERAGE * repeatability * np.sqrt(squares)
        uncertainty = {"a": float(a), "b": float(b), "gamma": degrees(COVERAGE * repeatability * sqrt(turning))}
    off = float(np.linalg.norm(direction)) - distance
    return InPlane(frame(rotation, [*shift, 0.0]), off, uncertainty)


def _pair(places: Sequence[Place]) -> Floats:
    return points_of(places, 2, 2)


def _turn(nominal: Sequence[Place], measured: Sequence[Place]) -> tuple[float, float]:
    """Turn of the line through both points, radians, and their nominal distance. Raises `Degenerate`."""
    nominal_line, measured_line = (np.diff(_pair(places), axis=0)[0] for places in (nominal, measured))
    turn = atan2(
        nominal_line[0] * measured_line[1] - nominal_line[1] * measured_line[0], float(nominal_line @ measured_line)
    )
    return turn, float(np.linalg.norm(nominal_line))


class Table(NamedTuple):
    """A rotary table. centre: where its axis is in the part's nominal coordinates, mm. position: where it is, degrees.

    clockwise: whether a positive command turns the part clockwise seen from +Z, as ISO 841 has it for an axis that carries
    the part (so that the tool goes round it counter-clockwise).
    """

    centre: Place = (0.0, 0.0)
    position: float = 0.0
    clockwise: bool = True


class Turned(NamedTuple):
    """Command for a rotary table. turn: of the part about Z, degrees, counter-clockwise positive. position: to command.

    motion: what is left for the frame after that.
    """

    turn: float
    position: float
    motion: Floats


def by_table(motion: Floats, table: Table) -> Turned:
    """Take the turn about Z out by the table; the frame keeps the rest.

    >>> turned = by_table(frame(from_angles(0, 0, 0.5), [0.0, 0.0, 0.0]), Table(position=90.0))
    >>> round(turned.turn, 9), round(turned.position, 9), round(angles_of(turned.motion[:3, :3])[2], 9) + 0.0
    (-0.5, 90.5, 0.0)
    """
    gamma = angles_of(motion[:3, :3])[2]
    back = from_angles(0.0, 0.0, -gamma)
    centre = np.array([*table.centre, 0.0])
    turning = frame(back, centre - back @ centre)
    position = table.position + (gamma if table.clockwise else -gamma)
    return Turned(-gamma, position, turning @ motion)
