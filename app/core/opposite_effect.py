"""Corrections of opposite effect: the two newest ones are judged before a third goes out.

The gain is what the size did over what each change of the offset asked of it. A correction of ``amount`` asks the size to change by
``-amount / factor`` (`decision.step.effect_of`); a gain of 1 is a size that does. A wrong sign makes it -1, a radius taken for a
diameter 2 or 1/2, an offset that the control does not use 0. With D the deviation of a part and x = -S / factor, S the sum of the
corrections it was cut with::

    D_i = w_i + gain x_i,    w_i = level_i + scatter,    level_i+1 = level_i + random step

One Kalman filter for a level that takes random steps predicts D and x with the same weights (Harvey 1989, Forecasting, structural
time series models and the Kalman filter, sections 2.3 and 7.3). Its prediction errors of D regressed on those of x, weighted least
squares, give the gain::

    gain = sum(v_D v_x / F) / sum(v_x^2 / F),    error = scatter / sqrt(sum(v_x^2 / F))

over the parts since the first of the two; over those of one correction alone it is the gain of that correction. Parts count by the
corrections they were cut with, so parts on the way only add to what is known of the level; smaller corrections that answer their
scatter meanwhile, often against the sense of the two, are in x and are not judged. The scatter is that of the steps from part to part,
large ones cut off, so wear from part to part is in it, and a chip or an edge that breaks hardly is. While few parts have shown it, it
is assumed larger, as far as R34 leaves room. With the limits below no simulated tool life is ever paused (docs/reference/gain.md).

The gain over many corrections, while the machine warms up, is measured by `app.core.measured_gain`. Lengths are mm.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.core.compiled import compiled

Floats = NDArray[np.float64]

LONGEST = 48  # parts that are looked at
# Parts before a correction that count; on either side of one, that say what it did.
BEFORE, NEAR = 3, 5
RECENT = 16  # parts among which both corrections took effect
LEVEL_STEP = 0.1  # variance of a step of the level over that of the scatter
# Parts before the first correction that show how the size wears or warms up; the sum of squares that a slope of none is worth.
TREND, SHRUNK = 17, 60.0
OPPOSITE = -0.2  # the gain is below this: with wear, that of corrections that do nothing is a little below 0
SURE_OPPOSITE, SURE_NOT_WEAK = 2.0, 4.75  # standard errors that the gain is below 0, and below half
LARGEST_ERROR = 0.36  # of the gain
LEAST = 1.5  # times the scatter that each of the two asks for: smaller ones say nothing
UNLIKE = (
    5.0  # times that one of the two may be as large as the other: those between that answer the scatter say nothing
)
NOT_DONE, FARTHEST = 0.4, -3.5  # the gain of each of the two alone: beyond, something else has happened, an edge broke
# And that of the second, the larger one where a sign is wrong: an edge that wears off quickly only seems to undo it.
AGAIN = -0.1
SURE_FIRST, SURE_SECOND = 1.9, 2.0  # standard errors that they are below 1, and below half
# Standard deviations of a step between two parts of one correction: the process moved by itself, as where an edge breaks.
ITSELF = 4.0
# Standard deviations at which a step counts no more for the scatter; what is left of the variance of a normal distribution then.
FAR, LEFT = 2.5, 0.978
# By how much larger the scatter may be than few parts show: 1 + FEW / parts cubed; never more than R34 over MOST.
FEW, MOST = 900.0, 2.0
KNOWN = 20  # parts that show what the readings are rounded to
# A gain that each of two corrections exceeds where the offset has another unit; times the scatter that each has done; how many times
# the gain of one that of the other may be; how many times the first the second asks for, to take back what that has done.
FAR_TOO_STRONG, CLEARLY, ALIKE, BACK = 8.0, 12.0, 1.5, -4.0
PRIOR = 3.0  # parts that the expected scatter is worth
NM = 1e-6


class Step(NamedTuple):
    """A change of the corrections in effect. asked, done: change of size, mm. before, after: sums of corrections, mm of offset."""

    asked: float
    done: float
    before: float
    after: float


class Opposed(NamedTuple):
    """Two corrections in a row whose effect is against what they asked; the gain of both together and its standard error."""

    first: Step
    second: Step
    gain: float
    error: float


class Judged(NamedTuple):
    """The verdict, the first part of each of the two newest corrections (0: there are not two), gain and standard error."""

    opposed: bool
    first: int
    second: int
    gain: float
    error: float


def expected_scatter(zero_range: float, averaging_limit: float) -> float:
    """The standard deviation to go by until parts have shown another: R33 is set so that scatter lies in it.

    >>> round(expected_scatter(0.0012, 0.005), 6), round(expected_scatter(0.0, 0.005), 6)
    (0.0005, 0.0005)
    """
    return max(zero_range / 3, averaging_limit / 10, 0.0001)


def opposed(
    deviation: Floats, compensated: Floats, factor: float, begin: int, expected: float, averaging_limit: float
) -> Opposed | None:
    """The two newest corrections, if what they did is clearly against what they asked.

    deviation, compensated: of the newest parts, in order; those before `begin` were cut before a tool change, a manual edit or a
    resume, and show the scatter alone. expected: the scatter to begin with (`expected_scatter`). averaging_limit: R34.

    >>> d, s = np.array([0.005, 0.0103, 0.020]), np.array([0.0, 0.005, 0.0153])
    >>> found = opposed(d, s, 1.0, 0, expected_scatter(0.001, 0.004), 0.004)
    >>> [(round(step.asked, 4), round(step.done, 4)) for step in (found.first, found.second)], round(found.gain, 2)
    ([(-0.005, 0.0053), (-0.0103, 0.0097)], -0.97)
    >>> opposed(np.array([0.005, 0.0003, 0.0052]), s, 1.0, 0, 0.0005, 0.004) is None
    True
    """
    judged = Judged(*judge(deviation, compensated, factor, begin, expected, averaging_limit))
    if not judged.opposed:
        return None
    first, second = steps_of(deviation, compensated, factor, (begin, judged.first, judged.second))
    return Opposed(first, second, judged.gain, judged.error)


def steps_of(deviation: Floats, compensated: Floats, factor: float, places: tuple[int, int, int]) -> tuple[Step, Step]:
    """Return what the two newest corrections asked and did. places: the beginning, and where each took effect."""
    start, first, second = places
    end = len(deviation)
    return (
        _step(deviation, compensated, factor, (start, first, second)),
        _step(deviation, compensated, factor, (first, second, end)),
    )


def _step(deviation: Floats, compensated: Floats, factor: float, places: tuple[int, int, int]) -> Step:
    """Return what a correction asked and did. places: where the one before it took effect, it, and the one behind it."""
    low, at, high = places
    done = deviation[at : min(high, at + NEAR)].mean() - deviation[max(low, at - NEAR) : at].mean()
    before, after = float(compensated[at - 1]), float(compensated[at])
    return Step((before - after) / factor, float(done), before, after)


def overdone(deviation: Floats, compensated: Floats, factor: float, expected: float) -> tuple[float, float] | None:
    """The gain of the two newest corrections and its standard error, if each did many times what it asked.

    An offset that is taken for inches does 25 times as much: R37 holds the third, and there are never enough for `app.core.measured_gain`. By
    itself the size moves so far where an edge breaks, but not twice in the sense of what was asked. expected: as in `opposed`.

    >>> d, s = np.array([0.0015, -0.0366, 0.893]), np.array([0.0, -0.0015, 0.0351])
    >>> gain, error = overdone(d, s, -1.0, 0.0003)
    >>> round(gain, 1), overdone(np.array([0.0015, 0.0366, 0.0001]), np.array([0.0, -0.0015, -0.0381]), -1.0, 0.0003)
    (25.4, None)
    """
    start, first, second = newest_two(compensated, 0, NM, np.inf)
    if first == 0:
        return None
    steps = steps_of(deviation, compensated, factor, (start, first, second))
    if steps[1].asked / steps[0].asked > BACK:
        return None
    low, high = sorted(step.done / step.asked for step in steps)
    if low < FAR_TOO_STRONG or high > ALIKE * low or min(abs(step.done) for step in steps) < CLEARLY * expected:
        return None
    asked = sum(step.asked * step.asked for step in steps)
    return sum(step.asked * step.done for step in steps) / asked, expected * sqrt(2 / asked)


def against(deviation: Floats, compensated: Floats, factor: float, expected: float) -> Step | None:
    """The newest change of the corrections in effect, if the size went the other way by about as much.

    One is no proof, an edge that breaks does the same; but where a person has to look, it says where. expected: as in `opposed`.

    >>> found = against(np.array([0.012, 0.048]), np.array([0.006, 0.042]), 1.0, 0.0003)
    >>> round(found.asked, 3), round(found.done, 3), against(np.array([0.012, 0.3]), np.array([0.006, 0.042]), 1.0, 0.0003)
    (-0.036, 0.036, None)
    """
    _start, before, newest = newest_two(compensated, 0, NM, np.inf)
    if newest == 0:
        return None
    step = _step(deviation, compensated, factor, (before, newest, len(deviation)))
    clear = min(abs(step.asked), abs(step.done)) >= 2 * LEAST * expected
    return step if clear and FARTHEST <= step.done / step.asked <= OPPOSITE else None


def newest_two(compensated: Floats, begin: int, least: float, alike: float) -> tuple[int, int, int]:
    """Return where the correction before the newest two, and those two, took effect; 0 where there are not two.

    least: changes of the offset that are no larger, mm, do not count; nor does one that the other exceeds `alike` times.
    """
    first, second, size = 0, 0, 0.0
    for i in range(len(compensated) - 1, begin, -1):
        change = abs(compensated[i] - compensated[i - 1])
        if change <= least or change * alike < size:
            continue
        if first:
            return i, first, second
        if second == 0 or change > size * alike:
            second, size = i, change
        else:
            first = i
    return begin, first, second


def trend_before(deviation: Floats, compensated: Floats, factor: float, low: int, first: int, itself: float) -> float:
    """Return what the size wears and warms up by from part to part before the first of the two corrections, mm.

    The slope of a least-squares line through parts that earlier corrections are taken out of as if they had acted in full, since the
    last step that the size made by itself; less than it while there are few parts.
    """
    t_sum, w_sum, tt, tw, count = 0.0, 0.0, 0.0, 0.0, 0
    before = 0.0
    for i in range(max(low, first - TREND), first):
        level = deviation[i] + compensated[i] / factor
        if count and abs(level - before) > itself:
            t_sum, w_sum, tt, tw, count = 0.0, 0.0, 0.0, 0.0, 0
        before, t = level, float(i - first)
        t_sum, w_sum, tt, tw, count = t_sum + t, w_sum + level, tt + t * t, tw + t * level, count + 1
    if count < NEAR:
        return 0.0
    return (tw - t_sum * w_sum / count) / (tt - t_sum * t_sum / count + SHRUNK)


def line_through(deviation: Floats, compensated: Floats, factor: float, low: int, high: int) -> float:
    """Return the gain of all corrections between two parts: least squares, the size steps from part to part."""
    xx, xd = 0.0, 0.0
    for i in range(low + 1, high):
        asked = (compensated[i - 1] - compensated[i]) / factor
        xx += asked * asked
        xd += asked * (deviation[i] - deviation[i - 1])
    return xd / xx if xx > 0 else 0.0


def grid_of(deviation: Floats) -> float:
    """Return the smallest difference between two parts: what the readings are rounded to, or less. 0: they are all alike.

    Between any two: where the size swings from side to side, those in a row are far apart.
    """
    ordered, smallest = np.sort(deviation), np.inf
    for i in range(1, len(ordered)):
        if NM < ordered[i] - ordered[i - 1] < smallest:
            smallest = ordered[i] - ordered[i - 1]
    return smallest if smallest < np.inf else 0.0


def scatter_of(deviation: Floats, compensated: Floats, factor: float, expected: float, first: int) -> float:
    """Return the standard deviation of the scatter: the steps from part to part, of which large ones count as `FAR` (Huber).

    What corrections did is taken out by a line through those before `first` and one through the others, whatever their gains;
    `expected` is worth `PRIOR` parts more. It is never below half a step of what the readings are rounded to.
    """
    count = len(deviation)
    before = line_through(deviation, compensated, factor, 0, first)
    since = line_through(deviation, compensated, factor, first - 1, count)
    steps = np.empty(count - 1)
    for i in range(1, count):
        asked = (compensated[i - 1] - compensated[i]) / factor
        step = deviation[i] - deviation[i - 1]
        steps[i - 1] = abs(step - (before if i < first else since) * asked)
    freedom = max(count - 3.0, 0.0)
    scatter = float(np.median(steps)) * 1.4826 / sqrt(2.0)
    if freedom:
        for _nearer in range(4):
            far, squares = FAR * sqrt(2.0) * scatter, 0.0
            for step in steps:
                squares += min(step, far) ** 2 / 2
            scatter = sqrt(squares / freedom / LEFT)
    if count >= KNOWN:
        scatter = max(scatter, grid_of(deviation) / 2)
    return sqrt((PRIOR * expected * expected + freedom * scatter * scatter) / (PRIOR + freedom))


def regressed(
    deviation: Floats, compensated: Floats, factor: float, places: tuple[int, int, int], trend: float, scatter: float
) -> tuple[float, float, bool]:
    """Return the sums of v_x^2 / F and of v_D v_x / F, and if the size moved by itself since the first of the corrections.

    places: the part to begin with, the end, and where the first of the corrections took effect.
    """
    start, end, first = places
    level_d, level_x = deviation[start], -compensated[start] / factor
    p, xx, xd, moved = 1.0 + LEVEL_STEP, 0.0, 0.0, False
    for i in range(start + 1, end):
        step, asked = abs(deviation[i] - deviation[i - 1]), abs((compensated[i] - compensated[i - 1]) / factor)
        if asked <= LEAST * scatter and step > ITSELF * sqrt(2.0) * scatter + 2 * asked:
            moved |= i > first
            level_d, level_x, p = deviation[i], -compensated[i] / factor, 1.0 + LEVEL_STEP
            continue
        variance = p + 1.0
        missed_d, missed_x = deviation[i] - level_d - trend, -compensated[i] / factor - level_x
        xx += missed_x * missed_x / variance
        xd += missed_x * missed_d / variance
        k = p / variance
        level_d += trend + k * missed_d
        level_x += k * missed_x
        p = p - k * p + LEVEL_STEP
    return xx, xd, moved


def newest_gain(
    deviation: Floats, compensated: Floats, factor: float, begin: int, expected: float
) -> tuple[float, float] | None:
    """The gain of all corrections among the newest `RECENT` parts, without a trend, and its standard error.

    None where they do not show it: too few or too small corrections, or the size moved by itself. begin, expected: as in `opposed`.

    >>> d, s = np.array([0.010, -0.0098, 0.0102, -0.01]), np.array([0.0, -0.01, -0.0002, -0.0104])
    >>> gain, error = newest_gain(d, s, -1.0, 0, 0.0005)
    >>> round(gain, 2), error < 0.1, newest_gain(d, np.zeros(4), -1.0, 0, 0.0005)
    (1.98, True, None)
    """
    count = len(deviation)
    start = max(begin, count - RECENT)
    scatter = scatter_of(deviation, compensated, factor, expected, start + 1)
    xx, xd, moved = regressed(deviation, compensated, factor, (start, count, start), 0.0, scatter)
    if moved or xx <= 0 or scatter / sqrt(xx) > LARGEST_ERROR:
        return None
    return float(xd / xx), float(scatter / sqrt(xx))


@compiled
def judge(
    deviation: Floats, compensated: Floats, factor: float, begin: int, expected: float, averaging_limit: float
) -> tuple[bool, int, int, float, float]:
    """Judge as `opposed` does; the result is that of `Judged`."""
    count = len(deviation)
    scatter, first, second = expected, 0, 0
    for _again in range(2):  # then by the scatter that they leave
        least = LEAST * scatter * abs(factor)
        _start, first, second = newest_two(compensated, max(begin, count - RECENT), least, UNLIKE)
        if first == 0:
            return False, 0, 0, 0.0, 0.0
        scatter = scatter_of(deviation, compensated, factor, expected, first)
    asked_first = (compensated[first - 1] - compensated[first]) / factor
    asked_second = (compensated[second - 1] - compensated[second]) / factor
    start = max(begin, first - BEFORE)
    trend = trend_before(deviation, compensated, factor, begin, first, ITSELF * sqrt(2.0) * scatter)
    xx, xd, moved = regressed(deviation, compensated, factor, (start, count, first), trend, scatter)
    xx_first, xd_first, _moved = regressed(deviation, compensated, factor, (start, second, first), trend, scatter)
    start = max(first, second - BEFORE)
    xx_second, xd_second, _moved = regressed(deviation, compensated, factor, (start, count, second), trend, scatter)
    if moved or min(xx, xx_first, xx_second) <= 0:
        return False, first, second, 0.0, 0.0
    shown = max(count - 3.0, 0.0) + 1.0
    largest = max(scatter, min(scatter * (1 + FEW / shown**3), averaging_limit / MOST))
    gain, error = xd / xx, largest / sqrt(xx)
    first_gain, second_gain = xd_first / xx_first, xd_second / xx_second
    clearly = (
        gain < OPPOSITE
        and gain + SURE_OPPOSITE * error < 0
        and gain + SURE_NOT_WEAK * error < 0.5
        and error < LARGEST_ERROR
        and min(abs(asked_first), abs(asked_second)) > LEAST * largest
    )
    each = (
        FARTHEST < first_gain < NOT_DONE
        and FARTHEST < second_gain < AGAIN
        and first_gain + SURE_FIRST * largest / sqrt(xx_first) < 1
        and second_gain + SURE_SECOND * largest / sqrt(xx_second) < 0.5
    )
    return clearly and each, first, second, gain, error
