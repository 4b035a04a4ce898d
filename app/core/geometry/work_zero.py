"""Work zero and size from the touches of an edge finder or probe (domain §7).

A touch is where the centre of the tip stood. Its surface lies half the tip further on, in the direction `approach` in
which the tip was moved; with a along it, c the zero and h half the size, every touch says

    a(theta)·(p - c) + tip/2 = +h  inside (pocket),  -h  outside (web),  0  at a corner

so centre = (X1 + X2)/2 and size = |X2 - X1| + tip inside, - tip outside. Two touches on one side show theta, by how much
the part is turned; all of them together are solved by least squares. A bore or boss is the least-squares circle of its
touches, or, touched in opposite pairs, the middle and length of these. Z zero = Z - feeler - tool length. Lengths mm,
angles degrees, counter-clockwise seen from +Z.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from math import hypot, isfinite, sqrt
from typing import NamedTuple

import numpy as np

from app.core.decision.step import DECIMALS, rounded
from app.core.geometry.circle import fit_circle
from app.core.geometry.edges import (
    Approach,
    EdgeKind,
    Problem,
    Solver,
    Touch,
    Unfit,
    Values,
    across,
    check,
    corner,
    is_paired,
    places_of,
    sides,
)
from app.core.geometry.points import TELLING_APART

COVERAGE = 2.0  # stated uncertainties are twice the standard deviation: 95 %
MOST_TURNED = 45.0  # degrees; a part that is turned further shows another side
SMALL_STEP = 1e-4  # mm, by which touches are moved to see what they do
ONE_SIDED = 120.0  # degrees of a circle; on less its centre is uncertain by several times a touch


class Height(NamedTuple):
    """Height Z at which the feeler was pinched or the probe triggered, mm. feeler: its thickness, 0 without one."""

    touched: float
    feeler: float = 0.0
    tool_length: float = 0.0


MISFIT = 5.0  # standard deviations of a touch; of a million good touches not one leaves more


class Notice(StrEnum):
    """Reasons to check a zero before it is used."""

    ONE_SIDED = "one_sided"  # touches on a short arc
    NOT_SQUARE = "not_square"  # the two sides of a corner are not at a right angle
    ONE_AXIS = (
        "one_axis"  # turned, and the other axis not touched: where the zero lies depends on where that one stands
    )
    MISFIT = "misfit"  # more is left at a touch than the probe's repeatability explains
    CHORDS = "chords"  # a bore or boss touched in pairs: beside the middle they are shorter than the diameter


@dataclass(frozen=True)
class Zero:
    """Result of the probed points; None where they do not determine a value.

    length: size along X, width: along Y. squareness: by how much the angle of a corner differs from 90°.
    residuals: per touch, what is left of it, mm, positive into the material. uncertainty: by name, 95 %; empty where the
    probe's repeatability is not known.
    """

    x: float | None = None
    y: float | None = None
    z: float | None = None
    rotation: float | None = None
    diameter: float | None = None
    length: float | None = None
    width: float | None = None
    squareness: float | None = None
    residuals: tuple[float, ...] = ()
    uncertainty: dict[str, float] = field(default_factory=dict)
    notices: tuple[Notice, ...] = ()


def find_zero(
    kind: EdgeKind,
    touches: Sequence[Touch],
    tip: float,
    *,
    height: Height | None = None,
    repeatability: float | None = None,
) -> Zero:
    """The zero and size that the touches make.

    tip: its diameter. repeatability: standard deviation of one touch. Raises `Unfit`, and `Degenerate` for a circle.

    >>> pocket = [Touch(-47, None, Approach.MINUS_X), Touch(53, None, Approach.PLUS_X)]
    >>> zero = find_zero(EdgeKind.POCKET, pocket, 6.0)
    >>> zero.x, zero.y, zero.length
    (3.0, None, 106.0)
    """
    if not (isfinite(tip) and tip >= 0):
        raise Unfit(Problem.SMALLER_THAN_TIP, needed=tip)
    paired = kind.is_round and is_paired(touches)
    if kind.is_round and not paired:
        zero = _round_zero(kind, touches, tip, repeatability)
    else:
        check(kind, touches)
        solve = corner if kind is EdgeKind.CORNER else across(kind) if paired else sides(kind)
        values, residuals = solve(touches, tip)
        _check_sizes(values, tip, outside=not kind.inside)
        if abs(values.get("rotation", 0.0)) > MOST_TURNED or abs(values.get("squareness", 0.0)) > MOST_TURNED:
            raise Unfit(Problem.TURNED_TOO_FAR, have=values["rotation"], needed=MOST_TURNED)
        uncertainty = _uncertainty(solve, touches, tip, values, repeatability)
        square = abs(values.get("squareness", 0.0))
        skew = square > 0.05 and square > uncertainty.get("squareness", 0.0)
        zero = Zero(
            **{name: rounded(float(value)) for name, value in values.items()},
            residuals=tuple(rounded(float(residual)) for residual in residuals),
            uncertainty=uncertainty,
            notices=tuple(_notices(values, paired=paired, skew=skew)),
        )
    if repeatability and max(map(abs, zero.residuals), default=0.0) > MISFIT * repeatability:
        zero = replace(zero, notices=(Notice.MISFIT, *zero.notices))
    return zero if height is None else replace(zero, z=zero_in_z(height))


def _notices(values: Values, *, paired: bool, skew: bool) -> Iterator[Notice]:
    if paired:
        yield Notice.CHORDS
    if skew:
        yield Notice.NOT_SQUARE
    if "rotation" in values and not {"x", "y"} <= set(values):
        yield Notice.ONE_AXIS


def zero_in_z(height: Height) -> float:
    """Z zero = Z - feeler - tool length.

    >>> zero_in_z(Height(-150.25, 0.1, 120.0))
    -270.35
    """
    return rounded(height.touched - height.feeler - height.tool_length)


def four_records(kind: EdgeKind, x1: float, x2: float, y1: float, y2: float) -> list[Touch]:
    """The touches that the printed macros keep as R1 to R4 (#501, #502, #504, #505).

    For a round part they are three places: the tip goes from X2 to Y2 in Y alone, and Y1 is where it stood at X1 and
    X2. The three make a right angle, so X1Y1 and X2Y2 lie across the circle (Thales) and the printed
    ``2*SQRT(POT(R1-R15)+POT(R3-R16))`` is the diameter of the tip's path:

    >>> zero = find_zero(EdgeKind.BORE, four_records(EdgeKind.BORE, -8, 8, -6, 6), 6.0)
    >>> zero.x, zero.y, zero.diameter
    (0.0, 0.0, 26.0)
    """
    if kind.is_round:
        return [Touch(x1, y1), Touch(x2, y1), Touch(x2, y2)]
    lower, upper = (Approach.MINUS_X, Approach.MINUS_Y), (Approach.PLUS_X, Approach.PLUS_Y)
    if not kind.inside:
        lower, upper = upper, lower
    return [
        Touch(min(x1, x2), None, lower[0]),
        Touch(max(x1, x2), None, upper[0]),
        Touch(None, min(y1, y2), lower[1]),
        Touch(None, max(y1, y2), upper[1]),
    ]


# --- bore and boss


def _round_zero(kind: EdgeKind, touches: Sequence[Touch], tip: float, repeatability: float | None) -> Zero:
    places = places_of(touches, range(len(touches)))
    circle = fit_circle(places)
    side = 1 if kind.inside else -1
    wrong = [
        at
        for at, (touch, place) in enumerate(zip(touches, places, strict=True), 1)
        if touch.approach is not None
        and side * touch.approach.sign * (place - circle.centre)[touch.approach.axis] < -TELLING_APART
    ]
    if wrong:
        raise Unfit(Problem.WRONG_SIDE, wrong)
    size = 2 * circle.radius + side * tip
    _check_sizes({"diameter": size}, tip, outside=not kind.inside)
    uncertainty = {}
    if repeatability:
        deviations = COVERAGE * repeatability * np.sqrt(np.diag(circle.cofactors))
        uncertainty = {"x": float(deviations[0]), "y": float(deviations[1]), "diameter": 2 * float(deviations[2])}
    return Zero(
        x=rounded(float(circle.centre[0])),
        y=rounded(float(circle.centre[1])),
        diameter=rounded(float(size)),
        residuals=tuple(rounded(float(side * residual)) for residual in circle.residuals),
        uncertainty=uncertainty,
        notices=(Notice.ONE_SIDED,) if circle.arc < ONE_SIDED else (),
    )


def _check_sizes(values: Values, tip: float, *, outside: bool) -> None:
    for name in ("diameter", "length", "width"):
        size = values.get(name)
        if size is not None and (size <= TELLING_APART if outside else size <= tip + TELLING_APART):
            raise Unfit(Problem.SMALLER_THAN_TIP, axis=name, have=size, needed=tip)


def _uncertainty(
    solve: Solver, touches: Sequence[Touch], tip: float, values: Values, repeatability: float | None
) -> Values:
    """Uncertainty of each value from the repeatability of a point, all points together."""
    if not repeatability:
        return {}
    squares = dict.fromkeys(values, 0.0)
    for at, touch in enumerate(touches):
        up, down = (
            solve([*touches[:at], _moved(touch, way), *touches[at + 1 :]], tip)[0] for way in (SMALL_STEP, -SMALL_STEP)
        )
        for name in squares:
            squares[name] += ((up[name] - down[name]) / (2 * SMALL_STEP)) ** 2
    return {name: COVERAGE * repeatability * sqrt(square) for name, square in squares.items()}


def _moved(touch: Touch, way: float) -> Touch:
    """The touch further along its axis."""
    if touch.approach is not None and touch.approach.axis == 0:
        return touch._replace(x=(touch.x or 0.0) + way)
    return touch._replace(y=(touch.y or 0.0) + way)


# --- shifting


class Shift(StrEnum):
    """Verdict on a fixture's shift from its reference."""

    UNKNOWN = "unknown"  # nothing to compare with, or no limit
    STEADY = "steady"
    WARNING = "warning"
    ALARM = "alarm"


def judge_shift(shifts: Sequence[float], warning: float | None, alarm: float | None) -> Shift:
    """Compare the shift of the zero, ``hypot`` of its axes, with the limits, mm; on a limit is the milder verdict.

    >>> judge_shift([0.012, -0.009], 0.01, 0.03).value, judge_shift([0.001], 0.01, 0.03).value
    ('warning', 'steady')
    """
    if not shifts or (warning is None and alarm is None):
        return Shift.UNKNOWN
    size = round(hypot(*shifts), DECIMALS)
    if alarm is not None and size > alarm:
        return Shift.ALARM
    return Shift.WARNING if warning is not None and size > warning else Shift.STEADY
