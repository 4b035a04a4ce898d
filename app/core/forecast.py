"""Parts until wear reaches a limit, with an interval that allows for run-in, even wear and a steep end, and how often such forecasts held.

*Parts left* is where the line of `app.core.wear`, continued, reaches the limit. Its interval has two sources. Fieller's (1954,
J. R. Stat. Soc. B 16, 175), with the scatter of a single part added, is that of a line that goes on straight: `low` to `high`.
Wear does not go on straight: an edge runs in, wears evenly, then steeply (ISO 3685:1993, tool-life testing with single-point
turning tools). So both ends are moved outwards, with `seen` the parts that the line was fitted over::

    soonest = low / (3 + 3 low / (low + seen)) ** widening     a steep end may begin at any moment, also with the next part
    latest = high * (1.5 + high / seen) ** widening            wear may slow down, also shortly before the limit; further ahead, more

*Widening* is what earlier edges needed: the exponent with which 95 % of the forecasts made on them would have held
(`backtest`; split conformal prediction, Vovk et al. 2005, Algorithmic learning in a random world). Until `ENOUGH` edges are over
it is never below `PUBLIC_WIDENING`, the exponent that public wear series of other tools need; docs/reference/wear.md
has the series, and how many forecasts held on tools that it was not tuned on (`bench/wear.py`). Few edges say little about the
next: what N of them needed counts (1 + `FEW_LIVES` / N) times, of fewer than `ENOUGH` a quarter more. An edge that breaks cannot be foretold. Lengths are mm.
"""

from collections.abc import Sequence
from math import ceil, inf, log, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.core.wear import LEVEL, NEAR, Fit, Values, fit, off_of

STEEP = 3.0  # times as fast an edge may wear from the next part on, where widening is 1; far ahead up to twice that
SLOW = 1.5  # times as slowly it may wear from the next part on, where widening is 1
PUBLIC_WIDENING = 2.0  # exponent that public wear series need: docs/reference/wear.md
FEW_LIVES = 2.0  # what N lives needed counts (1 + this / N) times; N is ENOUGH at least
ENOUGH = 8  # tool lives from which on their own exponent alone holds
LEAST_WIDENING, MOST_WIDENING = (
    0.5,
    4.0,
)  # a steep end may come though none did before; beyond, an interval says nothing
LOOKS = (0.3, 0.5, 0.7, 0.9)  # of a tool life: where `backtest` makes a forecast of its end
SHORTEST_LIFE = 40  # readings of a tool life that a forecast is tested on
MOST_AHEAD = 40.0  # times as far along the line as a part is ahead, `cone` looks


class Forecast(NamedTuple):
    """Parts until the wear reaches a limit, with its 95 % interval; 0 = reached. high is inf where it cannot be determined."""

    parts: float
    low: float
    high: float


class Record(NamedTuple):
    """Record of earlier forecasts: number tested, on how many lives, and number whose interval held the true number of parts.

    Each was made with the widening that was known then, from the lives before it. widening: exponent for the edge that is in
    the machine.
    """

    lives: int
    tested: int
    held: int
    widening: float

    @property
    def is_enough(self) -> bool:
        """Tell if the interval is that of these edges alone, no longer widened to what public series need."""
        return self.lives >= ENOUGH


NO_RECORD = Record(0, 0, 0, PUBLIC_WIDENING)


def forecast(fit: Fit, limit: float, widening: float = PUBLIC_WIDENING) -> Forecast | None:
    """Parts until w reaches `limit` (mm), one that lies the way that it wears; None where no wear is to be seen.

    A limit that the line has passed already is reached: 0 parts. What broke tells nothing of what comes: None as well.
    widening: exponent of the factors by which wear that does not go on straight widens the interval; see `Record`.

    >>> from app.core import wear
    >>> w = np.arange(40) * 0.0001 + np.array([0.001, -0.001] * 20)
    >>> f = forecast(wear.fit(np.arange(1, 41), w), 0.0139)
    >>> round(f.parts), round(f.low), round(f.high)
    (105, 3, 5046)
    """
    straight = _straight(fit, limit)
    if straight is None:
        return None
    return Forecast(straight.parts, _sooner(fit, straight.low, widening), _later(fit, straight.high, widening))


def cone(fit: Fit, ahead: Values, widening: float = PUBLIC_WIDENING) -> tuple[Values, Values]:
    """Limits of the size of a part N parts after the last, mm: with the slowest and with the fastest wear.

    The same interval as that of `forecast`, seen from the parts: it comes to a limit after `low` and after `high` parts.

    >>> from app.core import wear
    >>> line = wear.fit(np.arange(1, 41), np.arange(40) * 0.0001 + np.array([0.001, -0.001] * 20))
    >>> [ends.round(4).tolist() for ends in cone(line, np.array([0.0, 18.7]), 1.0)]
    [[0.0017, 0.0026], [0.006, 0.0169]]
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


def backtest(lives: Sequence[tuple[NDArray[np.int64], Values]]) -> Record:
    """Test forecasts on tool lives that are over, oldest first: sequences and wear curve of each, ascending.

    At several moments of a life its forecast of the level that it came to in the end is made from the readings until then,
    with the widening that the lives before it had taught, and compared with the parts that it really took. Lives of fewer
    than `SHORTEST_LIFE` readings, and moments at which no forecast would have been made, count for nothing.

    >>> w = np.arange(200) * 0.0001 + np.array([0.001, -0.001] * 100)
    >>> backtest([(np.arange(1, 201), w)])
    Record(lives=1, tested=4, held=4, widening=2.0)
    """
    held = counted = 0
    needed: list[float] = []
    widening = PUBLIC_WIDENING
    for sequence, curve in lives:
        exponents = [exponent for _moment, exponent in needed_at(sequence, curve)]
        if exponents:
            held += sum(exponent <= widening for exponent in exponents)
            needed += exponents
            counted += 1
            widening = widening_after(counted, taught(needed))
    return Record(counted, len(needed), held, widening)


def taught(needed: Sequence[float]) -> float:
    """The exponent that holds at least 95 % of what comes, by what was needed so far: the (n + 1) 0.95th smallest.

    Of fewer than 19 it is the largest. 0 where nothing was needed.

    >>> taught([]), taught([0.2, 1.0, 0.4]), taught([number / 100 for number in range(1, 101)])
    (0.0, 1.0, 0.96)
    """
    if not needed:
        return 0.0
    return sorted(needed)[min(len(needed), ceil((len(needed) + 1) * LEVEL)) - 1]


def widening_after(lives: int, taught: float) -> float:
    """The exponent for the next edge, after N lives that taught this one.

    >>> widening_after(0, 0.0), widening_after(2, 1.9), widening_after(ENOUGH, 0.8), widening_after(9, 0.0)
    (2.0, 2.375, 1.0, 0.5)
    """
    least = LEAST_WIDENING if lives >= ENOUGH else PUBLIC_WIDENING
    return min(MOST_WIDENING, max(least, taught * (1 + FEW_LIVES / max(lives, ENOUGH))))


def needed_at(sequence: NDArray[np.int64], curve: Values) -> list[tuple[float, float]]:
    """The exponents that the forecasts of one life needed, each with the moment of the life."""
    if len(curve) < SHORTEST_LIFE:
        return []
    whole = len(curve) - off_of(curve)  # an edge that broke in the end was worn until then
    sequence, curve = sequence[:whole], curve[:whole]
    end, limit = int(sequence[-1 - NEAR // 2]), float(np.median(curve[-NEAR:]))
    needed = []
    for share in LOOKS:
        upto = int(whole * share)
        line = fit(sequence[:upto], curve[:upto])
        straight = None if line is None else _straight(line, limit)
        if line is not None and straight is not None and straight.parts > 0:
            needed.append((share, _needed(line, straight, float(end - line.last))))
    return needed


def _needed(fit: Fit, straight: Forecast, truth: float) -> float:
    """The exponent with which the interval just holds the truth; 0 where the straight one does."""
    if straight.low <= truth <= straight.high:
        return 0.0
    if truth < straight.low:
        return log(straight.low / truth) / log(_steep(fit, straight.low))
    return log(truth / straight.high) / log(SLOW + straight.high / _seen(fit))


def _seen(fit: Fit) -> int:
    """The parts that the line was fitted over."""
    return fit.last - fit.first + 1


def _steep(fit: Fit, parts: float) -> float:
    """By how many times wear that ends steeply may be faster than the line, N parts ahead."""
    return STEEP * (1 + parts / (parts + _seen(fit)))


def _sooner(fit: Fit, parts: float, widening: float) -> float:
    """The parts after which a steep end may be where the line is after `parts`; more for a farther place, up to a widening of 5.8."""
    return float(parts / _steep(fit, parts) ** widening)


def _later(fit: Fit, parts: float, widening: float) -> float:
    """The parts after which slower wear may only be where the line is after `parts`."""
    return float(parts * (SLOW + parts / _seen(fit)) ** widening)


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
