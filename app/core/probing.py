"""From touches to a measured value (domain §4): repeats (R27) are averaged at each point, points per variant.

A touch is expected within ±a of the programmed dimension, a = 1 mm x R28. A missing touch, or one outside the window, makes
the reading a probe fault that names point and repeat: the probe or the part is wrong. More points or repeats than there can
be say that the program is, and are refused.
"""

from collections.abc import Sequence
from math import fsum
from typing import NamedTuple

from app.core.decision.limits import nanometres
from app.core.decision.step import DECIMALS, rounded
from app.core.parameters import Axis, Direction, Feature, Parameters, Variant

Touches = Sequence[Sequence[float | None] | None]
"""One list of repeats per point, mm; None where the probe did not trigger."""


class TouchError(ValueError):
    """Touches that cannot be believed (`Measured.fault`), or cannot be touches of this characteristic (raised).

    code: ``points`` (wrong number of points), ``repeats`` (wrong number at a point), ``missing`` (the probe did not
    trigger), ``window`` (outside ±a), ``distance`` (two points further from or nearer to each other than ±a). point and
    repeat count from 1 and name the first that is missing, too many or outside; expected and got are counts or mm.
    """

    def __init__(
        self, code: str, *, point: int, repeat: int | None = None, expected: float, got: float | None = None
    ) -> None:
        super().__init__(code, point, repeat, expected, got)
        self.code, self.point, self.repeat, self.expected, self.got = code, point, repeat, expected, got

    def as_dict(self) -> dict[str, str | float | None]:
        """The arguments that make it again, as an alarm keeps them."""
        return {name: getattr(self, name) for name in ("code", "point", "repeat", "expected", "got")}


class Measured(NamedTuple):
    """The value that the touches amount to, mm, and the mean at each point.

    fault: the first touch that makes a probe fault of the reading. The value is that of the touches that are there then,
    without any the end of the measuring move; there are no points.
    """

    value: float
    points: tuple[float, ...]
    fault: TouchError | None = None


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
    two_point: the mean over the pairs of points of the distance between their means. Raises `TouchError` for more points or
    repeats than the characteristic has.

    >>> from app.core.parameters import read
    >>> bore = read({"R32": 62.0, "R35": 0.03, "R33": 0, "R37": 0.3, "R36": 1.0, "feature": "inside"})[0]
    >>> measured_value(bore, [[62.01]]).value, measured_value(bore, [[None]]).value, measured_value(bore, [[60.9]]).fault.code
    (62.01, 63.0, 'window')
    """
    expected = points_expected(parameters)
    if len(touches) > expected:
        raise TouchError("points", point=expected + 1, expected=expected, got=len(touches))
    for point, repeats in enumerate(touches, start=1):
        if len(repeats or ()) > parameters.repeats:
            raise TouchError(
                "repeats",
                point=point,
                repeat=parameters.repeats + 1,
                expected=parameters.repeats,
                got=len(repeats or ()),
            )
    there = [[touch for touch in repeats or () if touch is not None] for repeats in touches]
    fault = _missing(parameters, touches) or _outside(parameters, there)
    if fault is not None:
        return Measured(_as_far_as_known(parameters, there), (), fault)
    means = tuple(round(fsum(repeats) / len(repeats), DECIMALS) for repeats in there)
    sections = sections_of(parameters, [fsum(repeats) / len(repeats) for repeats in there])
    return Measured(round(fsum(sections) / len(sections), DECIMALS), means)


def unmeasured(parameters: Parameters, *, first_move: bool = False) -> float:
    """Size at the end of the measuring move, or at its start, mm: nothing was touched up to there, or something at once."""
    travel = start_and_end(parameters)
    return rounded(_side(parameters) * (travel.start if first_move else travel.end))


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
    >>> start_and_end(read(bore | {"feature": "outside", "R31": None})[0])
    Travel(start=64.0, end=60.0)
    """
    forward = _forward(parameters)
    surface = _side(parameters) * parameters.target
    return Travel(
        rounded(surface - forward * parameters.window),
        rounded(surface + forward * parameters.window),
    )


def direction_of(parameters: Parameters) -> Direction:
    """Direction of the measuring move: R31, and where it is not given from the free side, in the positive half (L93)."""
    if parameters.direction is not None:
        return parameters.direction
    return Direction.POSITIVE if parameters.feature is Feature.INSIDE else Direction.NEGATIVE


def _forward(parameters: Parameters) -> float:
    return 1.0 if direction_of(parameters) is Direction.POSITIVE else -1.0


def _side(parameters: Parameters) -> float:
    """Half of the part in which the surface is touched: 1 the positive, -1 the negative one."""
    if parameters.axis is Axis.Z:
        return 1.0
    return _forward(parameters) if parameters.feature is Feature.INSIDE else -_forward(parameters)


def _missing(parameters: Parameters, touches: Touches) -> TouchError | None:
    """The first point or repeat without a touch."""
    expected = points_expected(parameters)
    if len(touches) < expected:
        return TouchError("points", point=len(touches) + 1, expected=expected, got=len(touches))
    for point, repeats in enumerate(touches, start=1):
        found = list(repeats or ())
        if None in found:
            return TouchError("missing", point=point, repeat=found.index(None) + 1, expected=parameters.repeats)
        if len(found) < parameters.repeats:
            repeat = len(found) + 1
            return TouchError("repeats", point=point, repeat=repeat, expected=parameters.repeats, got=len(found))
    return None


def _outside(parameters: Parameters, touches: Sequence[Sequence[float]]) -> TouchError | None:
    """The first touch outside ±a; of two surfaces only their distance is programmed."""
    window = nanometres(parameters.window)
    if parameters.variant is Variant.TWO_POINT:
        return next(
            (
                TouchError("distance", point=second + 1, repeat=repeat, expected=parameters.window, got=distance)
                for second in range(1, len(touches), 2)
                for repeat, (a, b) in enumerate(zip(touches[second - 1], touches[second], strict=True), start=1)
                for distance in [round(abs(b - a), DECIMALS)]
                if nanometres(abs(distance - parameters.target)) > window
            ),
            None,
        )
    return next(
        (
            TouchError("window", point=point, repeat=repeat, expected=parameters.window, got=touch)
            for point, repeats in enumerate(touches, start=1)
            for repeat, touch in enumerate(repeats, start=1)
            if nanometres(abs(touch - parameters.target)) > window
        ),
        None,
    )


def _as_far_as_known(parameters: Parameters, touches: Sequence[Sequence[float]]) -> float:
    """The value of the points that were touched at all, mm; of none the end of the measuring move."""
    means = [fsum(repeats) / len(repeats) if repeats else None for repeats in touches]
    if parameters.variant is Variant.TWO_POINT:
        pairs = zip(means[::2], means[1::2], strict=False)
        values = [abs(b - a) for a, b in pairs if a is not None and b is not None]
    else:
        values = [mean for mean in means if mean is not None]
    return round(fsum(values) / len(values), DECIMALS) if values else unmeasured(parameters)
