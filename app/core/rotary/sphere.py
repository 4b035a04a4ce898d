"""Centre of the calibration sphere from probed points, by least squares (domain §9).

Minimised is the sum of (|p - c| - r)² over the touches. The start is the algebraic fit, linear in c and r² - |c|²;
Gauss-Newton steps follow. Lengths in mm.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.core.decision.limits import nanometres
from app.core.decision.step import rounded

Floats = NDArray[np.float64]
Point = tuple[float, float, float]
FEWEST = 4
WORST_CONDITION = 1e4  # beyond it the touches lie in a plane, or too close together, for all one can see
STEPS = 50


class SphereFault(StrEnum):
    """Reasons for which points determine no calibration sphere. The sentence is worded at the edge."""

    TOO_FEW = "too_few_touches"
    FLAT = "flat_touches"
    WRONG_RADIUS = "wrong_radius"


@dataclass
class NoSphere(Exception):
    """Points that determine no sphere. needed, got: number of points; condition: of the system of equations."""

    fault: SphereFault
    needed: int = FEWEST
    got: int = 0
    condition: float | None = None


class Sphere(NamedTuple):
    """A ball, mm. residuals: how far each touch lies outside it; form: largest minus smallest of them.

    deviation: standard deviation of a touch; None where there are four touches only. condition: 1 is best.
    spread: covariance of the centre for touches that scatter by 1; a single touch on top leaves Z less sure than X and Y.
    """

    centre: Point
    radius: float
    residuals: tuple[float, ...]
    deviation: float | None
    condition: float
    spread: tuple[Point, Point, Point]

    @property
    def form(self) -> float:
        return max(self.residuals) - min(self.residuals)


def fit_sphere(touches: Sequence[Sequence[float]]) -> Sphere:
    """The ball through at least four touches that do not lie in a plane. Raises `NoSphere`.

    >>> fit_sphere([(11, 0, 0), (-9, 0, 0), (1, 10, 0), (1, -10, 0), (1, 0, 10)]).centre
    (1.0, 0.0, 0.0)
    """
    if len(touches) < FEWEST:
        raise NoSphere(SphereFault.TOO_FEW, got=len(touches))
    points = np.asarray(touches, dtype=np.float64)
    middle = points.mean(axis=0)
    size = float(np.abs(points - middle).max())
    if size == 0:
        raise NoSphere(SphereFault.FLAT, got=len(touches))
    scaled = (points - middle) / size
    matrix = np.column_stack([scaled, np.ones(len(scaled))])
    condition = float(np.linalg.cond(matrix))
    if not condition < WORST_CONDITION:
        raise NoSphere(SphereFault.FLAT, got=len(touches), condition=condition)
    solved = np.linalg.lstsq(matrix, (scaled**2).sum(axis=1), rcond=None)[0]
    centre = solved[:3] / 2
    radius = sqrt(max(float(solved[3] + centre @ centre), 0.0))
    for _step in range(STEPS):
        away = scaled - centre
        lengths = np.linalg.norm(away, axis=1)
        if not lengths.min() > 0:
            break
        jacobian = np.column_stack([-away / lengths[:, None], -np.ones(len(scaled))])
        change = np.linalg.lstsq(jacobian, radius - lengths, rcond=None)[0]
        centre, radius = centre + change[:3], radius + float(change[3])
        if np.abs(change).max() < 1e-14:
            break
    residuals = (np.linalg.norm(scaled - centre, axis=1) - radius) * size
    free = len(points) - FEWEST
    away = scaled - centre
    directions = np.column_stack([away / np.linalg.norm(away, axis=1)[:, None], np.ones(len(scaled))])
    spread = np.linalg.inv(directions.T @ directions)[:3, :3]
    return Sphere(
        _point(centre * size + middle),
        round(radius * size, 9),
        tuple((residuals.round(9) + 0.0).tolist()),
        sqrt(float(residuals @ residuals) / free) if free else None,
        condition,
        (_point(spread[0]), _point(spread[1]), _point(spread[2])),
    )


def radius_is_wrong(measured: float, calibrated: float, limit: float | None) -> bool:
    """maxDevCalBall: whether the measured radius lies further from the calibrated one (Q407) than is permitted.

    >>> radius_is_wrong(12.512, 12.5, 0.01), radius_is_wrong(12.51, 12.5, 0.01)
    (True, False)
    """
    return limit is not None and nanometres(abs(measured - calibrated)) > nanometres(limit)


def _point(values: Floats) -> Point:
    x, y, z = (rounded(float(value)) for value in values)
    return x, y, z
