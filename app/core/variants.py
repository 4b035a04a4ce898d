"""Results of a measuring variant beside the value (domain §4), and the repeatability of the probe.

==================  =========================================================================
one point, indexed  run-out = half-difference of the sides (of more than two, half their range)
several points      out-of-roundness = range of the points' means
round the part
several points      taper = slope of the least-squares line through the points' means, per mm
along the part      of length (R26 between points) and over the whole length; straightness = range
                    of the means about that line, of three points and more
two points          nothing beside the distance, which is the value
==================  =========================================================================

With repeats (R27 > 1) in every variant: the largest range of the repeats at one point, and their pooled standard
deviation ``s = sqrt(sum of squares about each point's mean / sum of (repeats - 1))``. Lengths are mm.
"""

from collections.abc import Sequence
from enum import StrEnum
from math import fsum, sqrt
from typing import NamedTuple

from app.core.acceptance import sections_outside
from app.core.decision.step import DECIMALS, rounded
from app.core.parameters import Parameters, Variant
from app.core.probing import Touches, points_expected, sections_of

POINTS_FOR_A_SHAPE = 2
POINTS_FOR_STRAIGHTNESS = 3


class FormResult(StrEnum):
    """A result that is form, of which a characteristic may keep statistics of its own."""

    RUN_OUT = "run_out"
    OUT_OF_ROUNDNESS = "out_of_roundness"
    TAPER = "taper"
    STRAIGHTNESS = "straightness"


class Results(NamedTuple):
    """The variant's own results; None where the variant has no such thing.

    run_out, out_of_roundness, straightness: mm, never negative. taper: how much larger the end is than the beginning, mm
    over the length; slope: the same in mm per mm, None where the spacing R26 is not said. repeat_range, repeat_deviation:
    of the repeats, mm. sections_outside: sections out of tolerance; rejected: too many of them. Both only with n of m.
    """

    run_out: float | None = None
    out_of_roundness: float | None = None
    taper: float | None = None
    slope: float | None = None
    repeat_range: float | None = None
    repeat_deviation: float | None = None
    sections_outside: int | None = None
    rejected: bool | None = None
    straightness: float | None = None

    def form(self, form: FormResult) -> float | None:
        """A form deviation as it is judged: its size, never negative, mm; None where the reading has none.

        >>> Results(taper=-0.004).form(FormResult.TAPER), Results(taper=-0.004).form(FormResult.RUN_OUT)
        (0.004, None)
        """
        value: float | None = getattr(self, form.value)
        return None if value is None else abs(value)


def forms_of(parameters: Parameters) -> tuple[FormResult, ...]:
    """The form deviations that readings with these parameters have beside the value.

    >>> from app.core.parameters import read
    >>> base = {"R32": 62.0, "R35": 0.03, "R33": 0, "R37": 0.3, "R36": 1.0}
    >>> [form.value for form in forms_of(read(base | {"R25": 3, "R23": 3, "R26": 10})[0])], forms_of(read(base)[0])
    (['taper', 'straightness'], ())
    """
    points = points_expected(parameters)
    own = {
        Variant.INDEXED: (FormResult.RUN_OUT,),
        Variant.ROUND: (FormResult.OUT_OF_ROUNDNESS,),
        Variant.ALONG: (FormResult.TAPER, *((FormResult.STRAIGHTNESS,) if points >= POINTS_FOR_STRAIGHTNESS else ())),
    }.get(parameters.variant, ())
    return own if points >= POINTS_FOR_A_SHAPE else ()


def yielded_by(parameters: Parameters) -> tuple[str, ...]:
    """Names of the `Results` lengths of a characteristic with these parameters, the variant's own first.

    >>> from app.core.parameters import read
    >>> yielded_by(read({"R32": 62.0, "R35": 0.03, "R33": 0, "R37": 0.3, "R36": 1.0, "R25": 1, "R27": 2})[0])
    ('run_out', 'repeat_range', 'repeat_deviation')
    """
    shape = (form.value for form in forms_of(parameters))
    return (*shape, *(("repeat_range", "repeat_deviation") if parameters.repeats > 1 else ()))


def results_of(
    parameters: Parameters, touches: Touches, points: Sequence[float], empirical_value: float = 0.0
) -> Results | None:
    """The results of one reading, if there are any. touches and points as `measured_value` has taken and made them, mm.

    The sections of n of m are judged with the empirical value (mm), as the value is.

    >>> from app.core.parameters import read
    >>> bore = {"R32": 62.0, "R35": 0.03, "R33": 0, "R37": 0.3, "R36": 1.0, "R25": 3, "R23": 3, "R26": 10}
    >>> found = results_of(read(bore)[0], [[62.0], [62.002], [62.004]], [62.0, 62.002, 62.004])
    >>> found.taper, found.slope, found.straightness
    (0.004, 0.0002, 0.0)
    """
    run_out = out_of_roundness = taper = slope = straightness = repeat_range = repeat_deviation = None
    if len(points) >= POINTS_FOR_A_SHAPE:
        spread = round(max(points) - min(points), DECIMALS)
        if parameters.variant is Variant.INDEXED:
            run_out = round(spread / 2, DECIMALS)
        elif parameters.variant is Variant.ROUND:
            out_of_roundness = spread
        elif parameters.variant is Variant.ALONG:
            step = fitted_step(points)
            taper = rounded(step * (len(points) - 1))
            slope = rounded(step / parameters.index) if parameters.index else None
            straightness = _straightness(points) if len(points) >= POINTS_FOR_STRAIGHTNESS else None
    if parameters.repeats > 1:
        repeats = [[touch for touch in point or () if touch is not None] for point in touches]
        repeat_range = round(max(max(point) - min(point) for point in repeats), DECIMALS)
        repeat_deviation = _pooled_deviation(repeats)
    outside = rejected = None
    if parameters.accept_m > 1:
        sections = sections_of(parameters, points)
        outside = sections_outside(parameters, sections, empirical_value)
        rejected = len(sections) - outside < parameters.accept_n
    if run_out is out_of_roundness is taper is repeat_range is outside is None:
        return None
    repeats_of = (repeat_range, repeat_deviation)
    return Results(run_out, out_of_roundness, taper, slope, *repeats_of, outside, rejected, straightness)


def fitted_step(points: Sequence[float]) -> float:
    """Rise of the least-squares line through evenly spaced points from one to the next, mm.

    ``b = sum (i - i_mean) y_i / sum (i - i_mean)^2``

    >>> fitted_step([1.0, 3.0, 2.0])
    0.5
    """
    middle = (len(points) - 1) / 2
    mean = fsum(points) / len(points)
    above = fsum((at - middle) * (point - mean) for at, point in enumerate(points))
    return above / fsum((at - middle) ** 2 for at in range(len(points)))


def fitted_points(points: Sequence[float]) -> list[float]:
    """The least-squares line at each of evenly spaced points, mm.

    >>> fitted_points([1.0, 3.0, 2.0])
    [1.5, 2.0, 2.5]
    """
    middle, mean, step = (len(points) - 1) / 2, fsum(points) / len(points), fitted_step(points)
    return [mean + (at - middle) * step for at in range(len(points))]


def _straightness(points: Sequence[float]) -> float:
    """Range of evenly spaced points about their least-squares line, mm (ISO 12780, LS reference)."""
    beside = [point - fitted for point, fitted in zip(points, fitted_points(points), strict=True)]
    return abs(rounded(max(beside) - min(beside)))


def _pooled_deviation(touches: Sequence[Sequence[float]]) -> float:
    squares = fsum((touch - fsum(repeats) / len(repeats)) ** 2 for repeats in touches for touch in repeats)
    return round(sqrt(squares / sum(len(repeats) - 1 for repeats in touches)), DECIMALS)
