"""Set-up error of a workpiece from touches: six points (3-2-1) or more (domain §8).

The part is shifted by t = (a, b, c) and turned by the small angles w = (lambda, beta, gamma) about X, Y and Z, so a
point r moves by ``t + w x r``. A touch on a face with the normal n feels of that

    [n, r x n] · [t, w] = delta,    delta = n · (actual - nominal)

Six rows make six unknowns; more are solved by least squares. That is exact for small angles only. The exact solution
takes the rotation R for what it is and asks that every touched point p lie on its face of the moved part,

    (R n) · (p - t) - n · r = 0,

by Gauss and Newton from the small angles on. Lengths mm; angles degrees where they leave this file.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from math import sqrt
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri, stdtrit

from app.core.geometry.frames import angles_of, frame, turned, vector_of
from app.core.geometry.layout import MOTIONS, Layout, Loose, NotLaidOut, layout_of, refuse_loose
from app.core.geometry.points import FARTHEST, Degenerate, Floats, Reason
from app.core.spc.variation import varies

COVERAGE = 2.0
STEPS = 60
CHANCE = 0.05  # that touches without any misfit are said to have one
Vector = tuple[float, float, float]


class Method(StrEnum):
    """Solution by small angles or by an exact rotation."""

    EXACT = "exact"  # finite rotation, iterated
    SMALL = "small"  # rows [n, r x n], small angles
    PRINTED = "printed"  # the short form for 3-2-1: faces along the axes, points taken at z = 0


class Touch(NamedTuple):
    """Nominal place and normal of a face, and the point that was probed on it, mm."""

    nominal: Vector
    normal: Vector
    measured: Vector

    @classmethod
    def off_by(cls, nominal: Vector, normal: Vector, deviation: float) -> "Touch":
        """A touch that was found so far along the normal."""
        length = sqrt(sum(n * n for n in normal)) or 1.0
        x, y, z = (r + deviation * n / length for r, n in zip(nominal, normal, strict=True))
        return cls(nominal, normal, (x, y, z))

    @classmethod
    def by_tip(cls, nominal: Vector, normal: Vector, centre: Vector, tip: float) -> "Touch":
        """A touch of which is known where the centre of the tip stood; tip: its diameter.

        The centre lies half a tip before the face however the part is turned, so the face is taken half a tip further out.

        >>> Touch.by_tip((100.0, 40.0, 0.0), (0.0, 0.0, 1.0), (100.0, 40.0, 3.1), 6.0).nominal
        (100.0, 40.0, 3.0)
        """
        return cls(cls.off_by(nominal, normal, tip / 2).measured, normal, centre)


class Advice(NamedTuple):
    """One more touch that would help most. gain: by what factor the least certain motion becomes more certain by it."""

    place: Vector
    normal: Vector
    gain: float


@dataclass(frozen=True, eq=False)
class Alignment:
    """Position and rotation of a part, and their quality.

    motion: 4 x 4. shift: a, b, c, mm. angles: about X, Y, Z as a frame takes them (Z, Y', X''); turns: lambda, beta, gamma,
    the one turn about an axis in space, which for small angles is the same. residuals, leverage: per touch; a leverage
    of 1 means that nothing checks the touch. difference: how far, at any touch, the small-angle solution lies from the
    exact one, mm. uncertainty: of a, b, c, lambda, beta, gamma, 95 %. weakest: the least certain motion, as shift and
    turn about the touches' middle. misfits: touches that do not fit the others, from 1, the worst first; several together
    where any one of them may be the one.
    """

    motion: Floats
    method: Method
    deviations: tuple[float, ...]
    residuals: tuple[float, ...]
    leverage: tuple[float, ...]
    condition: float
    difference: float
    solved_for: tuple[str, ...]
    uncertainty: dict[str, float] = field(default_factory=dict)
    weakest: tuple[float, ...] = ()
    misfits: tuple[tuple[int, ...], ...] = ()
    advice: Advice | None = None

    @property
    def shift(self) -> Vector:
        """a, b, c, mm."""
        a, b, c = (float(value) for value in self.motion[:3, 3])
        return a, b, c

    @property
    def angles(self) -> Vector:
        """About X, Y, Z as a frame takes them, degrees."""
        return angles_of(self.motion[:3, :3])

    @property
    def turns(self) -> Vector:
        """lambda, beta, gamma, degrees."""
        x, y, z = (float(value) for value in np.degrees(vector_of(self.motion[:3, :3])))
        return x, y, z

    @property
    def rms(self) -> float:
        """Root mean square of what is left, over the touches there are beyond those needed, mm; 0 where none is."""
        spare = len(self.residuals) - len(self.solved_for)
        return sqrt(sum(e * e for e in self.residuals) / spare) if spare > 0 else 0.0


def align(
    touches: Sequence[Touch],
    method: Method = Method.EXACT,
    *,
    solve_for: Sequence[str] = MOTIONS,
    repeatability: float | None = None,
) -> Alignment:
    """Fit position and rotation of a part to all its probed points.

    solve_for: the motions that are unknown; the others are taken for none. repeatability: standard deviation of one
    touch, mm. Raises `NotLaidOut` where the touches leave the part free to move, and `Degenerate` for what is no touch.

    >>> faces = [((0, 0, 0), (0, 0, 1)), ((100, 0, 0), (0, 0, 1)), ((0, 80, 0), (0, 0, 1))]
    >>> faces += [((10, 0, 0), (0, 1, 0)), ((90, 0, 0), (0, 1, 0)), ((0, 40, 0), (1, 0, 0))]
    >>> lifted = [Touch.off_by(place, normal, 0.1 if normal[2] else 0.0) for place, normal in faces]
    >>> [round(value, 9) + 0.0 for value in align(lifted).shift]
    [0.0, 0.0, 0.1]
    """
    places, normals, measured = _rows(touches)
    layout = layout_of(places, normals, solve_for)
    refuse_loose(layout)
    deviations = (normals * (measured - places)).sum(axis=1)
    small = _small(layout, deviations)
    if method is Method.PRINTED:
        shift, turns = _printed(places, normals, deviations)
        motion = frame(turned(turns), shift)
    else:
        motion = small if method is Method.SMALL else _exact(layout, places, normals, measured, small)
    residuals = _residuals(motion, places, normals, measured)
    misfits = _misfits(layout, residuals, repeatability)
    return Alignment(
        motion=motion,
        method=method,
        deviations=tuple(deviations.tolist()),
        residuals=tuple(residuals.tolist()),
        leverage=tuple(layout.leverage.tolist()),
        condition=layout.condition,
        difference=_difference(motion, small, places),
        solved_for=tuple(layout.solved_for),
        uncertainty=_uncertainty(layout, repeatability),
        weakest=tuple(layout.weakest.tolist()),
        misfits=misfits,
        advice=Advice(*layout.helpful) if layout.helpful else None,
    )


def _rows(touches: Sequence[Touch]) -> tuple[Floats, Floats, Floats]:
    if not touches:
        raise Degenerate(Reason.TOO_FEW, have=0, needed=1)
    places, normals, measured = (np.array(rows, dtype=np.float64) for rows in zip(*touches, strict=True))
    for rows in (places, normals, measured):
        wrong = ~np.isfinite(rows).all(axis=1)
        if wrong.any():
            raise Degenerate(Reason.NOT_FINITE, at=tuple(int(i) + 1 for i in np.flatnonzero(wrong)[:8]))
        wrong = np.abs(rows).max(axis=1) > FARTHEST
        if wrong.any():
            raise Degenerate(Reason.TOO_FAR, at=tuple(int(i) + 1 for i in np.flatnonzero(wrong)[:8]))
    lengths = np.linalg.norm(normals, axis=1)
    if (lengths < 1e-9).any():
        raise Degenerate(Reason.NO_DIRECTION, at=tuple(int(i) + 1 for i in np.flatnonzero(lengths < 1e-9)[:8]))
    return places, normals / lengths[:, None], measured


def _small(layout: Layout, deviations: Floats) -> Floats:
    """One step of least squares; the shift as it is at the origin: ``t = s - w x g`` for s at the middle g."""
    solution = layout.spread(np.asarray(np.linalg.lstsq(layout.scaled, deviations, rcond=None)[0], dtype=np.float64))
    shift, turns = solution[:3], solution[3:]
    return frame(turned(turns), shift - np.cross(turns, layout.middle))


def _exact(layout: Layout, places: Floats, normals: Floats, measured: Floats, start: Floats) -> Floats:
    rotation = start[:3, :3]
    middle = layout.middle
    shift = start[:3, 3] + rotation @ middle - middle
    along = (normals * (places - middle)).sum(axis=1)
    best, best_motion = np.inf, (rotation, shift)
    for _ in range(STEPS):
        facing = normals @ rotation.T
        away = measured - middle - shift
        left = (facing * away).sum(axis=1) - along
        square = float(left @ left)
        if square < best:
            best, best_motion = square, (rotation, shift)
        rows = layout.scale(facing, np.cross(away, facing))
        step = layout.spread(np.asarray(np.linalg.lstsq(rows, left, rcond=None)[0], dtype=np.float64))
        shift = shift + step[:3]
        rotation = turned(step[3:]) @ rotation
        if np.abs(step[:3]).max() < 1e-13 * max(1.0, layout.reach) and np.abs(step[3:]).max() < 1e-15:
            break
    rotation, shift = best_motion
    return frame(rotation, middle + shift - rotation @ middle)


def _printed(places: Floats, normals: Floats, deviations: Floats) -> tuple[Floats, Floats]:
    """The short form as it is printed, with the rows of lambda and beta in their right places (the source swaps them)."""
    axes = np.abs(normals)
    order = [2, 2, 2, 1, 1, 0]
    if len(places) != len(order) or any(axes[i, axis] < 1 - 1e-9 for i, axis in enumerate(order)):
        raise NotLaidOut(Loose.NOT_321, tuple(range(1, len(places) + 1)))
    felt = deviations * np.sign(normals[np.arange(6), order])
    (x1, x2, x3, x4, x5, _x6), (y1, y2, y3) = places[:, 0], places[:3, 1]
    z1, z2, z3, d4, d5, d6 = felt
    big = float(np.linalg.det(np.column_stack([np.ones(3), places[:3, 1], -places[:3, 0]])))
    c = ((x2 * y3 - x3 * y2) * z1 + (x3 * y1 - x1 * y3) * z2 + (x1 * y2 - x2 * y1) * z3) / big
    about_x = ((x3 - x2) * z1 + (x1 - x3) * z2 + (x2 - x1) * z3) / big
    about_y = ((y3 - y2) * z1 + (y1 - y3) * z2 + (y2 - y1) * z3) / big
    about_z = (d5 - d4) / (x5 - x4)
    b = (x5 * d4 - x4 * d5) / (x5 - x4)
    return np.array([d6, b, c]), np.array([about_x, about_y, about_z])


def _residuals(motion: Floats, places: Floats, normals: Floats, measured: Floats) -> Floats:
    facing = normals @ motion[:3, :3].T
    left: Floats = (facing * (measured - motion[:3, 3])).sum(axis=1) - (normals * places).sum(axis=1)
    return left


def _difference(motion: Floats, small: Floats, places: Floats) -> float:
    apart = places @ (motion - small)[:3, :3].T + (motion - small)[:3, 3]
    return float(np.linalg.norm(apart, axis=1).max())


def _uncertainty(layout: Layout, repeatability: float | None) -> dict[str, float]:
    """At the origin: a turn about the middle of the touches moves it."""
    if not repeatability:
        return {}
    covariance = layout.covariance * repeatability**2
    x, y, z = layout.middle
    lever = np.eye(6)
    lever[:3, 3:] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]  # -w x g
    deviations = COVERAGE * np.sqrt(np.diag(lever @ covariance @ lever.T))
    uncertainties = [*deviations[:3], *np.degrees(deviations[3:])]
    return {name: float(value) for name, value in zip(MOTIONS, uncertainties, strict=True) if name in layout.solved_for}


def _misfits(layout: Layout, residuals: Floats, repeatability: float | None) -> tuple[tuple[int, ...], ...]:
    """Touches that do not fit the others, taken out one by one, the worst first, while more remain than are needed.

    Four touches on a face check each other once: that one of them is off shows, but not which.
    """
    inside = list(range(len(residuals)))
    rows, left_over = layout.scaled, residuals
    misfits: list[tuple[int, ...]] = []
    unknown = len(layout.solved_for)
    while (spare := len(inside) - unknown) >= (1 if repeatability else 2):
        mine = rows[inside]
        if np.linalg.matrix_rank(mine, tol=1e-9) < unknown:
            break
        q = np.linalg.qr(mine)[0]
        free = 1 - (q**2).sum(axis=1)
        left = left_over[inside] - q @ (q.T @ left_over[inside])
        checked = free > 1e-9
        if not checked.any():
            break
        square = float(left @ left)
        if not repeatability and not varies(sqrt(square / spare), layout.reach):
            break
        ratio = np.zeros(len(inside))
        if repeatability:
            ratio[checked] = np.abs(left[checked]) / (repeatability * np.sqrt(free[checked]))
            limit = float(-ndtri(CHANCE / (2 * len(residuals))))
        else:
            own = left[checked] ** 2 / free[checked]
            others = np.maximum(square - own, 0.0) / (spare - 1)
            noise = max(1e-24, float(np.finfo(float).eps * layout.reach) ** 2)
            ratio[checked] = np.sqrt(own / np.maximum(others, noise))
            limit = float(stdtrit(spare - 1, 1 - CHANCE / (2 * len(residuals))))
        worst = int(ratio.argmax())
        if ratio[worst] <= limit:
            break
        misfits.append(tuple(inside[i] + 1 for i in np.flatnonzero(ratio > (1 - 1e-6) * ratio[worst])))
        del inside[worst]
    return tuple(misfits)
