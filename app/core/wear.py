"""True wear behind a closed loop: the wear curve, wear per part with its uncertainty, and how long an edge will do.

Compensation hides wear: sizes stay where they are and the offset moves instead. The *wear curve* puts the two together
again. With D the deviation of a part and S the sum of the corrections that were in effect when it was cut, counted from
the tool change (mm of offset; a correction of ``factor x e`` removes the size error e)::

    w = D + S / factor

is the deviation that the part would have had, had nothing been corrected since the tool was changed. A fresh edge begins
with S = 0, so with its setting error. Whatever was decided and however late it took effect, w is wear plus scatter.

*Wear per part* is the slope of the least-squares line through the newest readings, as far back as they follow one line
(`fit`). Its standard error counts positively autocorrelated scatter by the effective number of readings
n (1 - rho) / (1 + rho), rho the lag-1 autocorrelation of the residuals (Santer et al. 2000, J. Geophys. Res. 105, 7337,
eq. 6; rho freed of its bias of -(2 + 4 rho)/n after Marriott and Pope 1954, Biometrika 41, 390). It assumes that
scatter is of one size; an edge that breaks cannot be foretold. Readings are rounded, so the standard deviation about the line
is at least that of rounding alone, step / sqrt(12) (GUM, JCGM 100:2008, F.2.2.1), with the smallest distance between two
different readings as the step (`resolution_of`): readings exactly on a line know its slope no better than that.

*Parts left* to a limit is where that line, continued, reaches it. Its interval has two sources. Fieller's (1954, J. R. Stat.
Soc. B 16, 175), with the scatter of a single part added, is that of a line that goes on straight. Wear does not: an edge runs
in, wears evenly, then faster (ISO 3685, the wear curve of a tool life). So both ends are moved apart by the factor

    (1 + parts / seen) ** widening

with `seen` the parts that the line was fitted over, `parts` those to the end of the straight interval: as far ahead again as
was seen, wear may turn out half or twice as fast. `widening` is 1, and more where the forecasts of edges before missed by more (`backtest`, `widened`). Lengths are mm.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import ceil, inf, log, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from app.core.parameters import Parameters
from app.core.spc.constants import d2
from app.core.spc.resolution import resolution_of
from app.core.spc.spread import t_quantile, without_steps
from app.core.spc.variation import varies

Values = NDArray[np.float64]

LONGEST, SHORTEST, FEWEST = 400, 30, 12  # readings that a line is fitted to
SHORTER = 0.7  # what is kept of a run that does not follow one line
LEVEL = 0.95  # of confidence, two-sided
BREAK = 0.001  # so rarely scatter alone makes one line look like two
OUTLIER = 5.0  # standard deviations from its neighbours
STEP = 8.0  # standard deviations from one reading to the next
NEAR = 5  # readings on either side of a step of the reference that say whether the parts moved
MOST_AHEAD = 10.0  # times as far along the line as a part is ahead, `cone` looks
LOOKS = (0.3, 0.5, 0.7, 0.9)  # of a tool life: where `backtest` makes a forecast of its end
MOST_WIDENING = 4.0  # exponent from which on an interval says nothing
SHORTEST_LIFE = 40  # readings of a tool life that a forecast is tested on


class Step(NamedTuple):
    """A change of the reference that the record tells of, and nobody says whether the parts moved with it.

    sequence: the first reading after it. size: by how much (mm of size) the wear curve must be lifted from there on if
    the sizes moved: offset change / factor for an edit by hand, the change of the empirical value for that.
    """

    sequence: int
    size: float


@dataclass(frozen=True, slots=True)
class Fit:
    """The line through the newest readings: w = level + slope x (sequence - last). mm, and mm per part.

    first, last: sequences it was fitted from, and of the newest reading; count: readings it was fitted to; left_out: outliers
    between them; off: newest readings that a step divides from the line, as when an edge breaks: they are left out too.
    slope_error, level_error: standard errors. scatter: standard deviation about the line, at least that of rounding. correlation: rho. effective: how
    many independent readings it is worth. centre, spread: mean of sequence - last, and sum of squares about it.
    """

    first: int
    last: int
    count: int
    left_out: int
    off: int
    level: float
    level_error: float
    slope: float
    slope_error: float
    scatter: float
    correlation: float
    effective: float
    centre: float
    spread: float

    @property
    def quantile(self) -> float:
        """Student's t for `LEVEL`."""
        return t_quantile(max(1.0, self.effective - 2), LEVEL)

    @property
    def slope_interval(self) -> tuple[float, float]:
        """The confidence interval of the wear per part."""
        half = self.quantile * self.slope_error
        return self.slope - half, self.slope + half

    @property
    def is_wear(self) -> bool:
        """Tell if wear is significant: the confidence interval of the slope does not hold 0."""
        low, high = self.slope_interval
        return self.slope != 0 and (low > 0 or high < 0)

    def at(self, ahead: float) -> float:
        """The w of the part that comes so many parts after the last."""
        return self.level + self.slope * ahead

    def half_width(self, ahead: float, *, single: bool = False) -> float:
        """Half the confidence interval of the line so many parts after the last; of a single part, with its scatter."""
        inflation = self.count / self.effective
        line = inflation * (1 / self.count + (ahead - self.centre) ** 2 / self.spread)
        return self.quantile * self.scatter * sqrt(line + (1.0 if single else 0.0))


class Forecast(NamedTuple):
    """Parts until the wear reaches a limit, with its 95 % interval; 0 = reached. high is inf where nobody can say."""

    parts: float
    low: float
    high: float


def wear(deviation: Values, compensated: Values, factor: float) -> Values:
    """The wear curve, mm: D + S / factor.

    >>> wear(np.array([0.007, 0.0, 0.002]), np.array([0.0, -0.007, -0.007]), -1.0).round(6).tolist()
    [0.007, 0.007, 0.009]
    """
    return deviation + compensated / factor


def joined(sequence: NDArray[np.int64], curve: Values, steps: Sequence[Step]) -> tuple[Values, float]:
    """The curve with its reference the same throughout, and by how much its end was lifted in all.

    An offset typed in by hand moves the parts, or only tells what the control has held all along; an empirical value moves
    with the probe, or only becomes known. Wear goes on over both, so of the two readings the one holds by which the
    curve goes on where it was.

    >>> s, w = np.arange(1, 11), np.array([0.0] * 5 + [-0.5] * 5)
    >>> joined(s, w, [Step(6, 0.5)])[0].tolist() == [0.0] * 10, joined(s, w * 0, [Step(6, 0.5)])[0].tolist() == [0.0] * 10
    (True, True)
    """
    lifted_curve, lifted = curve.copy(), 0.0
    for step in sorted(steps):
        at = int(np.searchsorted(sequence, step.sequence))
        if not 0 < at < len(lifted_curve):
            continue
        jump = float(np.median(lifted_curve[at : at + NEAR]) - np.median(lifted_curve[max(0, at - NEAR) : at]))
        if abs(jump + step.size) < abs(jump):
            lifted_curve[at:] += step.size
            lifted += step.size
    return lifted_curve, lifted


def scatter_of(curve: Values) -> float:
    """The standard deviation of the scatter alone, told by successive differences, so that wear and drift do not count.

    Mean moving range / d2 (d2 = 1.128, ISO 7870-2), ranges beyond four times the mean left out: a step is no scatter.

    >>> round(scatter_of(np.array([0.0, 1.128, 0.0, 1.128, 0.0])), 3)
    1.0
    """
    ranges = without_steps(np.abs(np.diff(curve)))
    return float(ranges.mean()) / d2(2) if ranges.size else 0.0


def outliers(curve: Values) -> NDArray[np.bool_]:
    """Single readings far from their neighbours (a chip under the stylus): further than `OUTLIER` standard deviations
    from the median of the five readings about them.
    """
    if len(curve) < FEWEST:
        return np.zeros(len(curve), dtype=bool)
    middle = np.median(np.lib.stride_tricks.sliding_window_view(curve, 5), axis=1)
    medians = np.concatenate((np.repeat(middle[:1], 2), middle, np.repeat(middle[-1:], 2)))
    return np.asarray(np.abs(curve - medians) > max(OUTLIER * scatter_of(curve), 1e-9))


def fit(sequence: NDArray[np.int64], curve: Values) -> Fit | None:
    """The line through the newest readings, ascending; None of fewer than `FEWEST`.

    Of the newest `LONGEST`, as many as follow one line: while two lines, one through each half, do significantly better
    (Chow 1960, Econometrica 28, 591, with F divided by the loss of effective readings), the older readings are left, down to `SHORTEST`.
    So the run-in of a fresh edge, warming up, or a chipped edge end the past.

    >>> f = fit(np.arange(1, 41), np.arange(40) * 0.0001 + np.array([0.001, -0.001] * 20))
    >>> f.count, round(f.slope, 5), f.is_wear
    (40, 0.0001, True)
    """
    sequence, curve = sequence[-LONGEST:], curve[-LONGEST:]
    good = ~outliers(curve)
    off = _off(curve[good])
    good[np.flatnonzero(good)[len(curve[good]) - off :]] = False
    x, y = sequence[good].astype(np.float64), curve[good]
    while len(x) * SHORTER >= SHORTEST and _breaks(x, y):
        keep = int(len(x) * SHORTER)
        x, y = x[-keep:], y[-keep:]
    if len(x) < FEWEST:
        return None
    last = int(sequence[-1])
    x = x - last
    centre, count = float(x.mean()), len(x)
    spread = float(((x - centre) ** 2).sum())
    slope = float(((x - centre) * y).sum() / spread) if varies(float(np.ptp(y)), y) else 0.0
    residual = y - y.mean() - slope * (x - centre)
    rho = _correlation(residual) if varies(float(np.ptp(residual)), y) else 0.0
    effective = max(4.0, count * (1 - rho) / (1 + rho))
    scatter = max(sqrt(float((residual**2).sum()) / max(1.0, count - 2)), _rounding(y))
    inflation = count / effective
    return Fit(
        first=int(x[0]) + last,
        last=last,
        count=count,
        left_out=int((sequence >= x[0] + last).sum()) - count - off,
        off=off,
        level=float(y.mean()) - slope * centre,
        level_error=scatter * sqrt(inflation * (1 / count + centre**2 / spread)),
        slope=slope,
        slope_error=scatter * sqrt(inflation / spread),
        scatter=scatter,
        correlation=rho,
        effective=effective,
        centre=centre,
        spread=spread,
    )


def forecast(fit: Fit, limit: float, widening: float = 1.0) -> Forecast | None:
    """Parts until w reaches `limit` (mm), one that lies the way that it wears; None where no wear is to be seen.

    A limit that the line has passed already is reached: 0 parts. What broke tells nothing of what comes: None as well.
    widening: exponent of the factor by which wear that does not go on straight widens the interval; see `Record`.

    >>> w = np.arange(40) * 0.0001 + np.array([0.001, -0.001] * 20)
    >>> f = forecast(fit(np.arange(1, 41), w), 0.0139)
    >>> round(f.parts), round(f.low), round(f.high)
    (105, 25, 825)
    """
    straight = _straight(fit, limit)
    if straight is None:
        return None
    return Forecast(straight.parts, _sooner(fit, straight.low, widening), _later(fit, straight.high, widening))


def cone(fit: Fit, ahead: Values, widening: float = 1.0) -> tuple[Values, Values]:
    """Limits of the size of a part so many parts after the last, mm: with the slowest and with the fastest wear.

    The same interval as that of `forecast`, seen from the parts: it comes to a limit after `low` and after `high` parts.

    >>> line = fit(np.arange(1, 41), np.arange(40) * 0.0001 + np.array([0.001, -0.001] * 20))
    >>> [ends.round(4).tolist() for ends in cone(line, np.array([0.0, 18.7]))]
    [[0.0017, 0.0029], [0.006, 0.0098]]
    """
    straight = np.concatenate(([0.0], np.geomspace(0.01, MOST_AHEAD * max(float(ahead.max()), 1.0), 1_000)))
    sooner = np.array([_sooner(fit, distance, widening) for distance in straight])
    later = np.array([_later(fit, distance, widening) for distance in straight])
    sign = 1.0 if fit.slope >= 0 else -1.0
    slow, fast = np.interp(ahead, later, straight), np.interp(ahead, sooner, straight)
    return (
        np.array([fit.at(distance) - sign * fit.half_width(distance, single=True) for distance in slow]),
        np.array([fit.at(distance) + sign * fit.half_width(distance, single=True) for distance in fast]),
    )


def _bending(fit: Fit, parts: float) -> float:
    """By how much faster or slower than along the line wear may come so far."""
    return 1 + parts / (fit.last - fit.first + 1)


def _sooner(fit: Fit, parts: float, widening: float) -> float:
    """The parts after which faster wear may be where the line is after `parts`; never fewer than for a nearer place."""
    if widening > 1:
        parts = min(parts, (fit.last - fit.first + 1) / (widening - 1))
    return float(parts / _bending(fit, parts) ** widening)


def _later(fit: Fit, parts: float, widening: float) -> float:
    """The parts after which slower wear may only be where the line is after `parts`."""
    return float(parts * _bending(fit, parts) ** widening)


def _straight(fit: Fit, limit: float) -> Forecast | None:
    """The forecast of wear that goes on along its line."""
    if not fit.is_wear or fit.off:
        return None
    # (c + b u - L)^2 = T^2 (1 + v/n + v u^2 / Sxx) about the centre of the readings, u = parts - centre.
    inflation, reach = fit.count / fit.effective, fit.quantile * fit.scatter
    gap = fit.at(fit.centre) - limit
    square = fit.slope**2 - reach**2 * inflation / fit.spread
    half = fit.slope * gap
    rest = gap**2 - reach**2 * (1 + inflation / fit.count)
    parts = (limit - fit.level) / fit.slope
    root = sqrt(max(0.0, half**2 - square * rest))
    if square <= 0:
        return Forecast(max(0.0, parts), 0.0, inf)
    low, high = (-half - root) / square + fit.centre, (-half + root) / square + fit.centre
    return Forecast(max(0.0, parts), max(0.0, low), max(0.0, high))


class Record(NamedTuple):
    """Record of earlier forecasts: number tested, on how many lives, and number whose interval held the true value.

    widening: the exponent with which 95 % of them would have held it, never below 1; for `forecast` of the edge that is
    in the machine. held counts the intervals as they are without it.
    """

    lives: int
    tested: int
    held: int
    widening: float


def backtest(lives: Sequence[tuple[NDArray[np.int64], Values]]) -> Record:
    """Test forecasts on tool lives that are over: sequences and wear curve of each, ascending.

    At several moments of a life its forecast of the level that it came to in the end is made from the readings until then,
    and compared with the parts that it really took. Lives of fewer than `SHORTEST_LIFE` readings, and moments at which no
    forecast would have been made, count for nothing.

    >>> w = np.arange(200) * 0.0001 + np.array([0.001, -0.001] * 100)
    >>> backtest([(np.arange(1, 201), w)])
    Record(lives=1, tested=4, held=4, widening=1.0)
    """
    tested = held = counted = 0
    needed: list[float] = []
    for numbers, worn in lives:
        if len(worn) < SHORTEST_LIFE:
            continue
        whole = len(worn) - _off(worn)  # an edge that broke in the end was worn until then
        sequence, curve = numbers[:whole], worn[:whole]
        end, limit = int(sequence[-1 - NEAR // 2]), float(np.median(curve[-NEAR:]))
        before = tested
        for share in LOOKS:
            upto = int(len(curve) * share)
            line = fit(sequence[:upto], curve[:upto])
            straight = None if line is None else _straight(line, limit)
            if line is None or straight is None or straight.parts <= 0:
                continue
            tested += 1
            exponent = _needed(line, straight, float(end - line.last))
            needed.append(exponent)
            held += exponent <= 1
        counted += tested > before
    return Record(counted, tested, held, max(1.0, widened(needed)))


def _needed(fit: Fit, straight: Forecast, truth: float) -> float:
    """The exponent with which the interval just holds the truth; 0 where the straight one does."""
    if straight.low <= truth <= straight.high:
        return 0.0
    if truth < straight.low:
        return log(straight.low / truth) / log(_bending(fit, straight.low))
    return log(truth / straight.high) / log(_bending(fit, straight.high))


def widened(needed: Sequence[float]) -> float:
    """The exponent that holds at least 95 % of what comes, by what was needed so far: the (n + 1) 0.95th smallest.

    Of fewer than 19 it is the largest (split conformal prediction: Vovk et al. 2005, Algorithmic learning in a random
    world); and never above `MOST_WIDENING`, from which on the interval says nothing.
    """
    if not needed:
        return 1.0
    place = min(len(needed), ceil((len(needed) + 1) * LEVEL))
    return min(MOST_WIDENING, sorted(needed)[place - 1])


class Towards(StrEnum):
    """The limit that wear reaches: R37 worn off, the end of the tolerance, or the tool's offset limit."""

    WEAR = "wear"
    TOLERANCE = "tolerance"
    OFFSET = "offset"


def limits_of(parameters: Parameters, way: float, total: float, lifted: float = 0.0) -> dict[Towards, float]:
    """Position of each limit on the wear curve, mm, in the direction of wear (sign of `way`).

    wear: nothing corrected, a part would deviate by R37. tolerance: were nothing corrected from now on, a part would
    deviate by R35/2; `total` is the sum of the corrections issued since the tool change. offset: following the wear, the
    corrections come to `max_total`. lifted: by how much `joined` lifted the end of the curve.

    >>> p = Parameters(target=10, tolerance_width=0.016, zero_range=0.001, averaging_limit=0.005, wear_limit=0.3,
    ...                confidence_limit=1.0, tool_memory=3, max_total=0.1)
    >>> {name.value: limit for name, limit in limits_of(p, way=1.0, total=-0.02).items()}
    {'wear': 0.3, 'tolerance': 0.028, 'offset': 0.1}
    """
    sign = 1.0 if way >= 0 else -1.0
    limits = {
        Towards.WEAR: sign * parameters.wear_limit,
        Towards.TOLERANCE: total / parameters.factor + lifted + sign * parameters.tolerance_width / 2,
    }
    if parameters.max_total is not None and not parameters.measures_only:
        limits[Towards.OFFSET] = sign * parameters.max_total / abs(parameters.factor) + lifted
    return limits


def _off(curve: Values) -> int:
    """Number of newest readings after a step, `STEP` standard deviations high; none once they are enough for a line."""
    newest = np.abs(np.diff(curve[-FEWEST:]))
    steps = np.flatnonzero(newest > max(STEP * scatter_of(curve), 1e-9))
    return len(newest) - int(steps[0]) if len(curve) > FEWEST and len(steps) else 0


def _rounding(readings: Values) -> float:
    """Standard deviation that the rounding of the readings causes: their step / sqrt(12); 0 of equal readings, which show no step."""
    return resolution_of(readings).step / sqrt(12)


def _correlation(residual: Values) -> float:
    """Lag-1 autocorrelation of the residuals of a line, freed of its bias, never below 0."""
    squares = float((residual**2).sum())
    if squares <= 0:
        return 0.0
    rho = float((residual[1:] * residual[:-1]).sum()) / squares
    rho += (2 + 4 * rho) / len(residual)
    return min(0.95, max(0.0, rho))


def _nearby(y: Values) -> float:
    """Autocorrelation of neighbours, which a bend or a step in the course does not raise.

    Differences of first neighbours have the variance 2 s^2 (1 - rho), those of second ones 2 s^2 (1 - rho^2) under AR(1).
    """
    one, two = scatter_of(y), (scatter_of(y[::2]) + scatter_of(y[1::2])) / 2
    return min(0.9, max(0.0, (two / one) ** 2 - 1)) if one > 0 else 0.0


def _squares(x: Values, y: Values) -> float:
    """Sum of squares about the line through these readings."""
    centred = x - x.mean()
    residual = y - y.mean() - centred * ((centred * y).sum() / (centred**2).sum())
    return float((residual**2).sum())


def _breaks(x: Values, y: Values) -> bool:
    """Tell if two lines describe these readings significantly better than one."""
    half = len(x) // 2
    whole = _squares(x, y)
    parts = _squares(x[:half], y[:half]) + _squares(x[half:], y[half:])
    parts = max(parts, (len(x) - 4) * _rounding(y) ** 2)
    if parts <= 1e-18 * len(x):
        return False
    rho = _nearby(y)
    f = (whole - parts) / 2 / (parts / (len(x) - 4)) * (1 - rho) / (1 + rho)
    return bool(fdtrc(2, len(x) - 4, f) < BREAK)
