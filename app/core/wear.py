"""True wear behind a closed loop: the wear curve, and wear per part with its uncertainty.

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
scatter is of one size; an edge that breaks cannot be predicted. Readings are rounded, so the standard deviation about the line
is at least that of rounding alone, step / sqrt(12) (GUM, JCGM 100:2008, F.2.2.1), with the smallest distance between two
different readings as the step (`resolution_of`): readings exactly on a line know its slope no better than that. `app.core.forecast` continues the line. Lengths are mm.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import sqrt
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
        """The w of the part that comes N parts after the last."""
        return self.level + self.slope * ahead

    def half_width(self, ahead: float, *, single: bool = False) -> float:
        """Half the confidence interval of the line N parts after the last; of a single part, with its scatter."""
        inflation = self.count / self.effective
        line = inflation * (1 / self.count + (ahead - self.centre) ** 2 / self.spread)
        return self.quantile * self.scatter * sqrt(line + (1.0 if single else 0.0))


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
    """The standard deviation of the scatter alone, found by successive differences, so that wear and drift do not count.

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
    off = off_of(curve[good])
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
    rho = autocorrelation(residual) if varies(float(np.ptp(residual)), y) else 0.0
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
        Towards.TOLERANCE: total / parameters.factor + lifted + sign * parameters.half,
    }
    if parameters.max_total is not None and not parameters.measures_only:
        limits[Towards.OFFSET] = sign * parameters.max_total / abs(parameters.factor) + lifted
    return limits


def off_of(curve: Values) -> int:
    """Number of newest readings after a step, `STEP` standard deviations high; none once they are enough for a line."""
    newest = np.abs(np.diff(curve[-FEWEST:]))
    steps = np.flatnonzero(newest > max(STEP * scatter_of(curve), 1e-9))
    return len(newest) - int(steps[0]) if len(curve) > FEWEST and len(steps) else 0


def _rounding(readings: Values) -> float:
    """Standard deviation that the rounding of the readings causes: their step / sqrt(12); 0 of equal readings, which show no step."""
    return resolution_of(readings).step / sqrt(12)


def autocorrelation(residual: Values) -> float:
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
