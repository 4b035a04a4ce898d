"""The gain of many corrections, measured on a closed loop: the share e of a commanded change of size that arrives.

A deviation is the process without corrections less what the corrections in effect, S (mm of offset), have changed::

    D_i = w_i - e S_i / f,    e = 1: a correction of 10 µm moves the part by 10 µm.

Comparing parts before and after a correction would overstate e: a loop corrects when scatter, too, points away, and that
does not come again. A straight line through everything would understate it: the loop corrects most while the machine warms
up. So w is a local line, which wears and warms up now quicker, now slower, under scatter::

    w_i = level_i + noise,  level_i+1 = level_i + slope_i + random step,  slope_i+1 = slope_i + random step

and e the size of interventions in it (Box and Tiao 1975, J. Am. Stat. Assoc. 70, 70; Harvey 1989, Forecasting, structural time
series models and the Kalman filter, section 7.3). One Kalman filter predicts D and -S / f with the same
weights; its prediction errors of D are e times those of -S / f, plus scatter: a weighted least-squares line, whose slope is e. S_i was
decided from readings before i, so its prediction error does not depend on the scatter of i: the loop being closed does no harm.

The variances of the steps are those of the greatest likelihood on a grid. Readings further off than `OUTLIER` standard deviations are
taken as missing (a chip under the stylus); after three of them in a row the course begins again (an edge that broke).

A local line is not quite what a machine does that warms up each morning. On simulated plants whose corrections act in full
it was off by up to 6 %, whatever the number of readings: `MODEL` is part of the interval. Lengths are mm.
"""

from enum import StrEnum
from itertools import product
from math import hypot, inf, log, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.core.compiled import compiled
from app.core.spc.refusal import Reason, Refused
from app.core.spc.spread import t_quantile
from app.core.spc.variation import varies

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

FEWEST_CORRECTIONS, FEWEST_READINGS = 10, 50
LONGEST = 10_000  # readings that are looked at
LEVEL = 0.95  # of confidence, two-sided
OUTLIER = 4.5
MODEL = 0.06  # that the model alone may be off by, of 1
STEPS_OF_LEVEL = (0.0, 0.001, 0.01, 0.05, 0.2, 1.0)  # variance of a step over that of the scatter
STEPS_OF_SLOPE = (0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
PASSES = 4
FEWEST_FOR_GAIN, FEWEST_PARTS = 4, 12
STARTS = (1.0, 0.0, 0.5, 2.0, -1.0)
CREDIBLE = 0.9999  # of confidence, two-sided, for a verdict on the gain
CREDIBLY_STRONG = 0.99  # for that of twice: no loop whose gain is right looks like one (docs/reference/gain.md)
HALVED, DOUBLED = 0.75, 1.5  # nearer to 1/2 or to 2 than to 1
HALF = 0.5  # where this is not ruled out, no alarm says that the control does not use the offset


class Effect(NamedTuple):
    """The share of a correction that arrives, with its confidence interval.

    corrections: changes of the offset that it is found by, among the readings; typical: the median change of size that they
    commanded, mm. scatter: standard deviation of a part about the course of the process, mm.
    """

    value: float
    low: float
    high: float
    corrections: int
    readings: int
    typical: float
    scatter: float

    @property
    def is_full(self) -> bool:
        """Tell if corrections may act in full: the confidence interval holds 1."""
        return self.low <= 1 <= self.high


def measured_effect(deviation: Floats, compensated: Floats, factor: float, begins: Flags) -> Effect:
    """Effect of corrections in the newest `LONGEST` readings. begins: flags of readings after a break, such as a new edge.

    Raises `Refused` with fewer than ten corrections or fifty readings, and where nothing varies.

    >>> chance = np.random.default_rng(1)
    >>> s = -np.repeat(np.arange(40), 10) * 0.002
    >>> d = np.arange(400) * 0.0002 + chance.normal(0, 0.0005, 400) + 0.9 * s
    >>> found = measured_effect(d, s, -1.0, np.arange(400) == 0)
    >>> found.low < 0.9 < found.high, found.is_full, found.corrections
    (True, False, 39)
    """
    y = np.asarray(deviation, np.float64)[-LONGEST:]
    x = (-np.asarray(compensated, np.float64) / factor)[-LONGEST:]
    begins = np.array(begins[-LONGEST:], np.bool_)
    begins[:1] = True
    steps = np.abs(np.diff(x))[~begins[1:]]
    steps = steps[steps > 1e-9]
    if len(y) < FEWEST_READINGS:
        raise Refused(Reason.TOO_FEW_READINGS, have=len(y), needed=FEWEST_READINGS)
    if len(steps) < FEWEST_CORRECTIONS:
        raise Refused(Reason.INCOMPLETE_STUDY, have=len(steps), needed=FEWEST_CORRECTIONS, what="corrections")
    scatter = float(np.median(np.abs(np.diff(y - x)))) * 1.4826 / sqrt(2)
    if not varies(scatter, y, x):
        raise Refused(Reason.NO_VARIATION)
    line, scatter = _estimated(y, x, begins, 1.0, scatter)
    if not line.sxx > 0 or line.freedom < 1:
        raise Refused(Reason.NO_VARIATION)
    half = _half(line, LEVEL)
    slope = line.slope
    return Effect(slope, slope - half, slope + half, len(steps), len(y), float(np.median(steps)), scatter)


class GainVerdict(StrEnum):
    """Verdict on the gain of corrections, credible to `CREDIBLE`, that of strong to `CREDIBLY_STRONG`."""

    OPPOSITE = "opposite"
    NONE = "none"  # the control does not use this offset
    WEAK = "weak"  # a half, or less
    STRONG = "strong"  # twice, or more


class Gain(NamedTuple):
    """Gain of corrections, 1 where they act in full, with its 95 % interval, from the numbers of changes of the offset and of readings."""

    value: float
    low: float
    high: float
    corrections: int
    readings: int
    verdict: GainVerdict | None

    @property
    def half_width(self) -> float:
        """Half the 95 % interval."""
        return (self.high - self.low) / 2


def gain_of(deviation: Floats, compensated: Floats, factor: float) -> Gain | None:
    """The gain of the corrections of one edge, in the order of the readings; None where they do not tell it to within ±1.

    As `measured_effect`, from fewer readings and from any gain, 0 and -1 included: of the lines that the filter finds from
    each of `STARTS`, the likeliest.

    >>> chance = np.random.default_rng(2)
    >>> s = np.cumsum([0, 5, -5, 5, -4, 5, -6, 5, 4, -6, 5, -5]).repeat(3) * 0.001
    >>> found = gain_of(chance.normal(0, 0.0005, 36) + 2 * s, s, -1.0)
    >>> found.low < 2 < found.high, found.verdict.value, found.corrections
    (True, 'strong', 11)
    """
    y, x = np.asarray(deviation, np.float64), -np.asarray(compensated, np.float64) / factor
    begins = np.arange(len(y)) == 0
    corrections = int((np.abs(np.diff(x)) > 1e-9).sum())
    if corrections < FEWEST_FOR_GAIN or len(y) < FEWEST_PARTS:
        return None
    found: list[tuple[float, _Line]] = []
    for start in STARTS:
        scatter = float(np.median(np.abs(np.diff(y - start * x)))) * 1.4826 / sqrt(2)
        if varies(scatter, y, x):
            line, scatter = _estimated(y, x, begins, start, scatter)
            found.append((line.unlikely + 2 * len(y) * log(scatter), line))
    if not found:
        return None
    line = min(found, key=lambda each: each[0])[1]
    if not line.sxx > 0 or line.freedom < 1 or _half(line, LEVEL) > 1:
        return None
    if line.left_out > max(
        1, corrections // 4
    ):  # steps of the process that corrections answer look like chips, and gain 0
        return None
    value, half, sure = line.slope, _half(line, LEVEL), _half(line, CREDIBLE)
    strong = value - _half(line, CREDIBLY_STRONG) > DOUBLED
    verdict = GainVerdict.STRONG if strong else _verdict(value - sure, value + sure)
    return Gain(value, value - half, value + half, corrections, len(y), verdict)


def _verdict(low: float, high: float) -> GainVerdict | None:
    if high < 0:
        return GainVerdict.OPPOSITE
    if high < HALVED:
        return GainVerdict.NONE if low <= 0 and high < HALF else GainVerdict.WEAK
    return None


def _estimated(y: Floats, x: Floats, begins: Flags, start: float, scatter: float) -> tuple["_Line", float]:
    """Return the line found from this slope on, and the scatter about it."""
    slope = start
    for _pass in range(PASSES):
        lines = (
            _line(y / scatter, x / scatter, begins, steps_, slope) for steps_ in product(STEPS_OF_LEVEL, STEPS_OF_SLOPE)
        )
        line = min(lines, key=lambda each: each.unlikely)
        before, slope = slope, line.slope
        scatter *= sqrt(line.variance) if line.variance > 0 else 1.0
        if abs(slope - before) < 0.001:
            break
    return line, scatter


def _half(line: "_Line", level: float) -> float:
    return hypot(MODEL, t_quantile(line.freedom, level) * sqrt(line.variance / line.sxx))


class _Line(NamedTuple):
    slope: float
    sxx: float
    variance: float
    freedom: int
    unlikely: float
    left_out: int


def _line(y: Floats, x: Floats, begins: Flags, steps: tuple[float, float], slope: float) -> _Line:
    missed_y, missed_x, variance, used, left_out = _missed(y, x, begins, *steps, slope, OUTLIER)
    weight = 1 / np.sqrt(variance[used])
    dy, dx = missed_y[used] * weight, missed_x[used] * weight
    sxx, freedom = float(dx @ dx), len(dy) - 1
    if not sxx > 0 or freedom < 1:
        return _Line(slope, 0.0, 0.0, freedom, inf, left_out)
    share = float(dx @ dy) / sxx
    left = dy - share * dx
    residual_variance = float(left @ left) / freedom
    unlikely = (
        len(dy) * log(max(residual_variance, 1e-12)) + float(np.log(variance[used]).sum()) + left_out * OUTLIER**2
    )
    return _Line(share, sxx, residual_variance, freedom, unlikely, left_out)


@compiled
def _missed(
    y: Floats, x: Floats, begins: Flags, level_step: float, slope_step: float, share: float, outlier: float
) -> tuple[Floats, Floats, Floats, Flags, int]:
    """Innovations of the filter for y and x, their variance, flags of those that count, and the number of outliers.

    The scatter has the variance 1. At a beginning nothing is known of the level: the first two readings count for nothing.
    """
    count = len(y)
    missed_y, missed_x, variances = np.zeros(count), np.zeros(count), np.ones(count)
    used = np.zeros(count, np.bool_)
    left_out, since, in_row = 0, 0, 0
    level_y = slope_y = level_x = slope_x = 0.0
    p11 = p12 = p22 = 0.0
    for i in range(count):
        if begins[i] or in_row == 3:
            level_y, slope_y, level_x, slope_x = y[i], 0.0, x[i], 0.0
            p11, p12, p22 = 1.0, 0.0, 1.0  # of the slope: a scatter per part is more than any machine warms up
            since, in_row = 1, 0
        else:
            variance = p11 + 1.0
            vy, vx = y[i] - level_y, x[i] - level_x
            if since > 1 and abs(vy - share * vx) > outlier * np.sqrt(variance):
                left_out += 1
                in_row += 1
            else:
                in_row = 0
                if since > 1:
                    missed_y[i], missed_x[i], variances[i], used[i] = vy, vx, variance, True
                since += 1
                k1, k2 = p11 / variance, p12 / variance
                level_y, slope_y = level_y + k1 * vy, slope_y + k2 * vy
                level_x, slope_x = level_x + k1 * vx, slope_x + k2 * vx
                p22 -= k2 * p12
                p12 -= k2 * p11
                p11 -= k1 * p11
        level_y += slope_y
        level_x += slope_x
        p11 += 2 * p12 + p22 + level_step
        p12 += p22
        p22 += slope_step
    return missed_y, missed_x, variances, used, left_out
