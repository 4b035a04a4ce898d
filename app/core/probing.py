"""From touches to a measured value (domain §4): repeats (R27) are averaged at each point, points per variant.

A touch is expected within ±a of the programmed dimension, a = 1 mm x R28. A missing touch, a touch
outside the window or a wrong count refuses the reading and says which point and which repeat.
"""

from collections.abc import Sequence
from math import fsum
from typing import NamedTuple

from app.core.compensation import DECIMALS
from app.core.parameters import Parameters, Variant
from app.core.zones import nanometres


class Measured(NamedTuple):
    """The value that the touches amount to, mm, and the mean at each point."""

    value: float
    points: tuple[float, ...]


class TouchError(ValueError):
    """Touches that cannot be made into a reading.

    code: ``points`` (wrong number of points), ``repeats`` (wrong number at a point), ``window``
    (outside ±a). point and repeat count from 1; expected and got are counts or mm.
    """

    def __init__(
        self, code: str, *, point: int | None = None, repeat: int | None = None, expected: float, got: float
    ) -> None:
        super().__init__(code, point, repeat, expected, got)
        self.code, self.point, self.repeat, self.expected, self.got = code, point, repeat, expected, got


def points_expected(parameters: Parameters) -> int:
    """How many points a reading has: two where the variant itself says so, R23 otherwise."""
    if parameters.variant in (Variant.INDEXED, Variant.TWO_POINT):
        return max(2, parameters.points)
    return parameters.points


def measured_value(parameters: Parameters, touches: Sequence[Sequence[float]]) -> Measured:
    """Make one measured value (mm) of the touches, one list of repeats per point.

    single, indexed, round, along: the mean over the points of the mean over the repeats;
    two_point: the distance between the two points' means. Raises `TouchError`.
    """
    expected = points_expected(parameters)
    if len(touches) != expected:
        raise TouchError("points", expected=expected, got=len(touches))
    two_point = parameters.variant is Variant.TWO_POINT
    means: list[float] = []
    for point, repeats in enumerate(touches, start=1):
        if len(repeats) != parameters.repeats:
            raise TouchError("repeats", point=point, expected=parameters.repeats, got=len(repeats))
        if not two_point:
            for repeat, touch in enumerate(repeats, start=1):
                if nanometres(abs(touch - parameters.target)) > nanometres(parameters.window):
                    raise TouchError("window", point=point, repeat=repeat, expected=parameters.window, got=touch)
        means.append(fsum(repeats) / len(repeats))
    value = abs(means[1] - means[0]) if two_point else fsum(means) / len(means)
    return Measured(round(value, DECIMALS), tuple(round(mean, DECIMALS) for mean in means))
