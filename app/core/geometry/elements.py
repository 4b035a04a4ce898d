"""Elements as they are touched: a bore or shaft in sections, a surface in points; and how certain they are.

Cofactors are covariances for touches whose scatter along the probing direction has standard deviation 1: multiplied by
the square of the probe's repeatability they are mm².
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from app.core.geometry.circle import Circle, fit_circle
from app.core.geometry.line import fit_line
from app.core.geometry.plane import fit_plane
from app.core.geometry.points import Degenerate, Floats, Reason, surface_of

Point = tuple[float, ...]


class Section(NamedTuple):
    """One section: its touches in X and Y, or its centre as the control says it; and at which Z it was taken, mm."""

    touches: tuple[Point, ...] = ()
    height: float | None = None
    centre: Point | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Centre:
    """The centre of a section with its cofactors (2 x 2); circle and radius where it was touched, mm."""

    at: Floats
    cofactors: Floats
    circle: Circle | None

    @property
    def radius(self) -> float | None:
        """Radius of the path of the tip's centre, mm: not yet compensated."""
        return None if self.circle is None else self.circle.radius


@dataclass(frozen=True, eq=False, slots=True)
class Element:
    """An axis or a plane: the points it goes through, its direction or normal, and how certain these are.

    cofactors: of each point, 3 x 3. tilt: cofactors of the direction, 3 x 3. lengthwise: whether `direction` lies along
    the element (an axis) or is on it (a plane's normal).
    """

    points: Floats
    cofactors: Floats
    point: Floats
    direction: Floats
    tilt: Floats
    lengthwise: bool

    @property
    def length(self) -> float:
        """Length of an axis along itself, or of a plane across its widest, mm."""
        about = self.points - self.point
        if self.lengthwise:
            return float(np.ptp(about @ self.direction))
        _left, _values, directions = np.linalg.svd(about, full_matrices=False)
        return float(np.ptp(about @ directions[0]))


class WrongSection(ValueError):
    """A section through which no circle goes, and why."""

    def __init__(self, number: int, reason: Degenerate) -> None:
        super().__init__(f"section {number}: {reason}")
        self.number, self.reason = number, reason


def centre_of(section: Section) -> Centre:
    """The centre of a section. Raises `Degenerate`."""
    if section.centre is not None and not section.touches:
        return Centre(np.array(section.centre, dtype=np.float64), np.eye(2), None)
    circle = fit_circle(section.touches)
    return Centre(circle.centre, circle.cofactors[:2, :2], circle)


def centres_of(sections: Sequence[Section]) -> list[Centre]:
    """The centres of sections. Raises `WrongSection`."""
    centres = []
    for number, section in enumerate(sections, start=1):
        try:
            centres.append(centre_of(section))
        except Degenerate as reason:
            raise WrongSection(number, reason) from None
    return centres


def heights_of(sections: Sequence[Section]) -> Floats | None:
    """At which Z the sections were taken, or None where that is not said of every one.

    Raises `Degenerate` where all were taken at one height: then they say nothing about a direction.
    """
    heights = [section.height for section in sections]
    if any(height is None for height in heights):
        return None
    array = np.array(heights, dtype=np.float64)
    if len(array) > 1 and np.ptp(array) <= 0:
        raise Degenerate(Reason.COINCIDENT, at=tuple(range(1, len(array) + 1)))
    return array


def axis_through(sections: Sequence[Section]) -> Element:
    """The least-squares line in space through the centres of at least two sections at different heights.

    ``direction = (b, 1)/|(b, 1)|`` with b the slopes over the height, whose cofactors are ``sum g_j^2 Q_j`` with
    ``g_j = (h_j - h)/sum (h - h)^2``. Raises `Degenerate` and `WrongSection`.

    >>> ring = lambda x, z: Section(((x + 5.0, 0.0), (x, 5.0), (x - 5.0, 0.0)), z)
    >>> axis_through([ring(0.0, 0.0), ring(0.03, 40.0)]).direction.round(6).tolist()
    [0.00075, 0.0, 1.0]
    """
    if len(sections) < 2:
        raise Degenerate(Reason.TOO_FEW, have=len(sections), needed=2)
    heights = heights_of(sections)
    if heights is None:
        raise Degenerate(Reason.NO_DIRECTION)
    centres = centres_of(sections)
    points = np.column_stack([[centre.at for centre in centres], heights])
    line = fit_line(points, 3)
    direction = line.direction if line.direction[2] > 0 else -line.direction
    cofactors = np.zeros((len(centres), 3, 3))
    cofactors[:, :2, :2] = [centre.cofactors for centre in centres]
    gains = (heights - heights.mean()) / float(((heights - heights.mean()) ** 2).sum())
    tilt = (gains[:, None, None] ** 2 * cofactors).sum(axis=0)
    return Element(points, cofactors, line.point, direction, tilt, lengthwise=True)


def plane_through(points: Sequence[Point]) -> Element:
    """The least-squares plane through at least three touches. Raises `Degenerate`."""
    array = surface_of(points, 3)
    plane = fit_plane(array)
    about = array - plane.point
    _left, values, directions = np.linalg.svd(about, full_matrices=False)
    # A slope along a principal direction is as certain as the points reach far along it.
    tilt = sum(np.outer(directions[k], directions[k]) / values[k] ** 2 for k in (0, 1))
    across = np.outer(plane.normal, plane.normal)
    return Element(
        array,
        np.broadcast_to(across, (len(array), 3, 3)),
        plane.point,
        plane.normal,
        np.asarray(tilt),
        lengthwise=False,
    )
