"""From touches to a measured value (domain §4): repeats (R27) are averaged at each point, points per variant.

A touch is expected within ±a of the programmed dimension, a = 1 mm x R28. A missing touch, a touch
outside the window or a wrong count refuses the reading and says which point and which repeat.
"""

from collections.abc import Sequence
from math import fsum
from typing import NamedTuple

from app.core.decision.limits import nanometres
from app.core.decision.step import DECIMALS, rounded
from app.core.parameters import Axis, Direction, Feature, Parameters, Variant

Touches = Sequence[Sequence[float | None] | None]
"""One list of repeats per point, mm; None where the probe did not trigger."""


class Measured(NamedTuple):
    """The value that the touches amount to, mm, and the mean at each point."""

    value: float
    points: tuple[float, ...]


class TouchError(ValueError):
    """Touches that cannot be made into a reading.

    code: ``points`` (wrong number of points), ``repeats`` (wrong number at a point), ``missing`` (the probe did not
    trigger), ``window`` (outside ±a), ``distance`` (two points further from or nearer to each other than ±a). point and
    repeat count from 1 and name the first that is missing, too many or outside; expected and got are counts or mm.
    """

    def __init__(
        self, code: str, *, point: int, repeat: int | None = None, expected: float, got: float | None = None
    ) -> None:
        super().__init__(code, point, repeat, expected, got)
        self.code, self.point, self.repeat, self.expected, self.got = code, point, repeat, expected, got


class Travel(NamedTuple):
    """Start of the probe's measuring move, and its end if nothing triggers, on the measuring axis, mm."""

    start: float
    end: float


def points_expected(parameters: Parameters) -> int:
    """Number of points of a reading: R23, and no fewer than the variant and the sections of n of m need.

    >>> from app.core.parameters import read
    >>> drawing = {"R32": 62.0, "R35": 0.03, "R33": 0, "R37": 0.3, "R36": 1.0}
    >>> points_expected(read(drawing | {"R25": 1})[0])
    2
    >>> points_expected(read(drawing | {"variant": "two_point", "accept": {"n": 2, "m": 3}})[0])
    6
    """
    if parameters.variant is Variant.TWO_POINT:
        pairs = parameters.accept_m if parameters.accept_m > 1 else (parameters.points + 1) // 2
        return 2 * pairs
    least = 2 if parameters.variant is Variant.INDEXED else 1
    return max(least, parameters.points, parameters.accept_m)


def measured_value(parameters: Parameters, touches: Touches) -> Measured:
    """Make one measured value (mm) of the touches, one list of repeats per point.

    single, indexed, round, along: the mean over the points of the mean over the repeats;
    two_point: the mean over the pairs of points of the distance between their means. Raises `TouchError`.
    """
    expected = points_expected(parameters)
    if len(touches) != expected:
        raise TouchError("points", point=min(len(touches), expected) + 1, expected=expected, got=len(touches))
    points = [_repeats(parameters, at, repeats or ()) for at, repeats in enumerate(touches, start=1)]
    if parameters.variant is Variant.TWO_POINT:
        _refuse_distances(parameters, points)
    else:
        _refuse_outside(parameters, points)
    means = tuple(round(fsum(repeats) / len(repeats), DECIMALS) for repeats in points)
    sections = sections_of(parameters, [fsum(repeats) / len(repeats) for repeats in points])
    return Measured(round(fsum(sections) / len(sections), DECIMALS), means)


def sections_of(parameters: Parameters, points: Sequence[float]) -> tuple[float, ...]:
    """One value (mm) per section of the part: each point, or for two points the distance of each pair."""
    if parameters.variant is Variant.TWO_POINT:
        return tuple(round(abs(b - a), DECIMALS) for a, b in zip(points[::2], points[1::2], strict=True))
    return tuple(points)


def start_and_end(parameters: Parameters) -> Travel:
    """Start = programmed ± a, end = behind the surface by a; the other point of two lies opposite.

    The probe starts on the free side of the surface: outside a shaft, inside a bore. On X and Y, which count from the
    middle of the part, inside/outside with the direction R31 says which half is touched: an outside surface moving in
    the negative direction in the positive half, moving in the positive direction in the negative half. On Z, which
    counts from a face, the direction alone says from where the probe comes.

    >>> from app.core.parameters import read
    >>> bore = {"R32": 62.0, "R35": 0.03, "R33": 0, "R37": 0.3, "R36": 1.0, "R28": 2, "feature": "inside", "R31": 0}
    >>> start_and_end(read(bore)[0])
    Travel(start=60.0, end=64.0)
    >>> start_and_end(read(bore | {"feature": "outside"})[0])
    Travel(start=-64.0, end=-60.0)
    """
    forward = 1.0 if parameters.direction is Direction.POSITIVE else -1.0
    side = 1.0
    if parameters.axis is not Axis.Z:
        side = forward if parameters.feature is Feature.INSIDE else -forward
    surface = side * parameters.target
    return Travel(
        rounded(surface - forward * parameters.window),
        rounded(surface + forward * parameters.window),
    )


def _repeats(parameters: Parameters, point: int, repeats: Sequence[float | None]) -> list[float]:
    """The touches at one point, all there."""
    if len(repeats) != parameters.repeats:
        first_wrong = min(len(repeats), parameters.repeats) + 1
        raise TouchError("repeats", point=point, repeat=first_wrong, expected=parameters.repeats, got=len(repeats))
    there = [touch for touch in repeats if touch is not None]
    if len(there) != len(repeats):
        raise TouchError("missing", point=point, repeat=list(repeats).index(None) + 1, expected=parameters.repeats)
    return there


def _refuse_outside(parameters: Parameters, touches: Sequence[Sequence[float]]) -> None:
    window = nanometres(parameters.window)
    for point, repeats in enumerate(touches, start=1):
        for repeat, touch in enumerate(repeats, start=1):
            if nanometres(abs(touch - parameters.target)) > window:
                raise TouchError("window", point=point, repeat=repeat, expected=parameters.window, got=touch)


def _refuse_distances(parameters: Parameters, touches: Sequence[Sequence[float]]) -> None:
    """Refuse pairs whose distance is not near the target: of two surfaces only the distance is programmed."""
    window = nanometres(parameters.window)
    for second in range(1, len(touches), 2):
        for repeat, (a, b) in enumerate(zip(touches[second - 1], touches[second], strict=True), start=1):
            distance = round(abs(b - a), DECIMALS)
            if nanometres(abs(distance - parameters.target)) > window:
                raise TouchError("distance", point=second + 1, repeat=repeat, expected=parameters.window, got=distance)
