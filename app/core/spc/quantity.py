"""Quantities to chart: sizes as they are, or the process as it would be without the loop that corrects it.

A loop that corrects makes ordinary charts lie: it takes out what a chart should show, and its corrections are steps of
their own. With w the wear curve (`app.core.wear`: the deviation had nothing been corrected since the tool was changed)
there is always a quantity that tells of the process alone:

=====================  ========================================================  ==================================
quantity               value                                                     what its chart shows
=====================  ========================================================  ==================================
deviation              D                                                         what the customer gets
without_corrections    w = D + S/factor                                          level and wear, a saw-tooth by tools
differences            w_i - w_(i-1), within one tool                            sudden steps and scatter, no wear
wear_residuals         w_i - level of the edge - slope (i - first of the edge)   all but the wear of the baseline
=====================  ========================================================  ==================================

Differences of neighbours share a reading, so they go up and down by turns by themselves: only the limits have a meaning
on them, and sigma is their standard deviation. Of residuals the slope is that of the baseline and stays so; the level is
set again by every edge when it has run in, and its readings until then are judged by nothing, for how an edge was set is no
signal of the process (Mandel 1969, The regression control chart, J. Qual. Technol. 1). Lengths are mm.
"""

from dataclasses import dataclass
from enum import StrEnum
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from app.core.spc.constants import d2
from app.core.spc.refusal import Floats, Reason, Refused
from app.core.spc.rules import FITTING, RuleName
from app.core.spc.shewhart import ENOUGH_READINGS, FEWEST_READINGS, Baseline, Chart
from app.core.spc.spread import Estimator, Sigma, mean_of, moving_range, overall
from app.core.spc.variation import varies

SETTLE = 20
"""Readings that set the level of an edge: it is then known to sigma/sqrt(20), a fifth of sigma."""
RUN_INS = (20, 30, 45, 70, 100, 150, 220, 330, 500)
"""Readings after which edges may have run in; a fresh edge wears faster at first, so its first readings say little of its level."""
NEARLY = 1.5  # times as far from the level as with the best of them


class Quantity(StrEnum):
    """Quantity of a control chart."""

    DEVIATION = "deviation"
    WITHOUT_CORRECTIONS = "without_corrections"
    DIFFERENCES = "differences"
    WEAR_RESIDUALS = "wear_residuals"


def fitting(quantity: Quantity, chart: Chart) -> tuple[RuleName, ...]:
    """Rules that make sense on a chart of this quantity; empty where the chart itself has none.

    >>> [name.value for name in fitting(Quantity.DIFFERENCES, Chart.INDIVIDUALS)], fitting(Quantity.DIFFERENCES, Chart.CUSUM)
    (['nelson_1'], ())
    """
    if quantity is not Quantity.DIFFERENCES:
        return FITTING[chart]
    # Differences of neighbours are correlated by -1/2: what sums or averages them, or looks at runs, would fire by itself.
    return (RuleName.NELSON_1,) if chart is Chart.INDIVIDUALS else ()


@dataclass(frozen=True, slots=True)
class Series:
    """Values in order of time, and their sequences.

    begins: True for the first value of a tool, or after a step of what sizes are measured by (an offset edited by hand,
    a new empirical value, a new target). A value there and the one before it have nothing in common.
    """

    sequence: NDArray[np.int64]
    values: Floats
    begins: NDArray[np.bool_]

    def __len__(self) -> int:
        """Number of values."""
        return len(self.sequence)

    @property
    def edge(self) -> NDArray[np.int64]:
        """Stretch between two begins that each value belongs to: 0, 1, 2 …"""
        return np.cumsum(self.begins) - (self.begins[0] if len(self) else 0)

    def only(self, wanted: NDArray[np.bool_]) -> "Series":
        """Those values; what comes first of a stretch begins it."""
        edge = self.edge[wanted]
        begins = np.ones(len(edge), np.bool_)
        begins[1:] = np.diff(edge) > 0
        return Series(self.sequence[wanted], self.values[wanted], begins)


def differences(series: Series) -> Series:
    """Difference of each value from the one before it, within one stretch.

    >>> s = Series(np.arange(1, 6), np.array([1.0, 3.0, 9.0, 9.5, 9.0]), np.array([True, False, True, False, False]))
    >>> d = differences(s); d.sequence.tolist(), d.values.tolist(), d.begins.tolist()
    ([2, 4, 5], [2.0, 0.5, -0.5], [True, True, False])
    """
    steps = np.concatenate(([0.0], np.diff(series.values))) if len(series) else series.values
    first = series.begins.copy()
    first[:1] = True
    return Series(series.sequence, steps, series.begins).only(~first)


@dataclass(frozen=True, slots=True)
class WearLine:
    """Wear per part: the slope that all stretches have in common, mm per reading, with its standard error."""

    slope: float
    error: float
    readings: int
    edges: int


def wear_line(series: Series) -> WearLine:
    """Least squares with one slope for all stretches and a level for each: sum dx dw / sum dx^2 about their means.

    Raises `Refused`: too few readings to tell a slope from a level.

    >>> s = Series(np.arange(6), np.array([0.0, 1, 2, 7, 8, 9]), np.array([True, False, False, True, False, False]))
    >>> wear_line(s).slope, wear_line(s).edges
    (1.0, 2)
    """
    edge = series.edge
    count = np.bincount(edge) if len(series) else np.zeros(0, np.int64)
    freedom = len(series) - int((count > 0).sum()) - 1
    if freedom < 1:
        raise Refused(Reason.TOO_FEW_READINGS, have=len(series), needed=len(series) + 1 - freedom)
    x, w = series.sequence - series.sequence[0], series.values - mean_of(series.values)
    x = x - (np.bincount(edge, x) / np.maximum(count, 1))[edge]
    w = w - (np.bincount(edge, w) / np.maximum(count, 1))[edge]
    spread = float(x @ x)
    slope = float(x @ w) / spread
    left = w - slope * x
    return WearLine(slope, sqrt(float(left @ left) / freedom / spread), len(series), int((count > 1).sum()))


def residuals(series: Series, slope: float, settle: int = SETTLE) -> Series:
    """Wear curve without its wear: of every stretch the values after its first `settle` values.

    They let the edge run in; the last `SETTLE` of them set its level.

    >>> s = Series(np.arange(1, 6), np.array([5.0, 6.0, 7.0, 8.5, 9.0]), np.array([True, False, False, False, False]))
    >>> residuals(s, 1.0, settle=2).values.tolist(), residuals(s, 1.0, settle=2).sequence.tolist()
    ([0.0, 0.5, 0.0], [3, 4, 5])
    """
    if not len(series):
        return series
    edge, place, flat = _flat(series, slope)
    return Series(series.sequence, flat - _levels(edge, place, flat, settle)[edge], series.begins).only(place >= settle)


def _flat(series: Series, slope: float) -> tuple[NDArray[np.int64], NDArray[np.int64], Floats]:
    """Of each value its stretch, its place in it, and what it is without the slope."""
    edge = series.edge
    first = np.concatenate(([0], np.flatnonzero(np.diff(edge)) + 1))
    flat = series.values - slope * (series.sequence - series.sequence[first][edge])
    return edge, np.arange(len(series)) - first[edge], flat


def _levels(edge: NDArray[np.int64], place: NDArray[np.int64], flat: Floats, settle: int) -> Floats:
    setting = (place < settle) & (place >= settle - SETTLE)
    count = np.bincount(edge[setting], minlength=int(edge[-1]) + 1)
    levels: Floats = np.bincount(edge[setting], flat[setting], minlength=len(count)) / np.maximum(count, 1)
    return levels


def run_in(series: Series, first: int, slope: float, sigma: float) -> int:
    """After how many readings the level of an edge is that of its readings from the sequence `first` on.

    Of `RUN_INS` the smallest with which all edges agree within 3 standard errors, or nearly as well as with the best: a
    machine that warms up every morning never agrees within the scatter of neighbours. None is longer than a quarter of
    the edges, or hardly anything would be judged.

    >>> x = np.arange(400)
    >>> s = Series(x, np.minimum(x, 60) * 0.1 + np.where(x % 2, 0.5, -0.5), x == 0)
    >>> run_in(s, 200, 0.0, 0.5)
    70
    """
    if not len(series):
        return SETTLE
    edge, place, flat = _flat(series, slope)
    longest = float(np.median(np.bincount(edge))) / 4
    far: dict[int, float] = {}
    for settle in RUN_INS:
        if settle > max(longest, SETTLE):
            break
        later = (series.sequence >= first) & (place >= settle)
        count = np.bincount(edge[later], minlength=int(edge[-1]) + 1)
        if not (count > 0).any():
            break
        mean = np.bincount(edge[later], flat[later], minlength=len(count)) / np.maximum(count, 1)
        error = 3 * sigma * np.sqrt(1 / SETTLE + 1 / np.maximum(count, 1))
        off = np.abs(mean - _levels(edge, place, flat, settle))[count > 0]
        if not (off > error[count > 0]).any():
            return settle
        far[settle] = float(np.sqrt((off**2).mean()))
    nearly = NEARLY * min(far.values(), default=0.0)
    return next((settle for settle, off in far.items() if off <= nearly), SETTLE)


def individuals_of(
    series: Series, quantity: Quantity, slope: float = 0.0, *, minimum: int = FEWEST_READINGS
) -> Baseline:
    """Centre and sigma for single values: the mean, and the mean moving range / d2 of neighbours within a stretch.

    series: D or w; of `wear_residuals` w too, for their sigma needs no level: centre 0, and the ranges are of w - slope i.
    Of differences sigma is their standard deviation. Raises `Refused` for fewer values than `minimum`, or no variation.
    """
    if quantity is Quantity.DIFFERENCES:
        steps = differences(series).values
        if len(steps) < minimum:
            raise Refused(Reason.TOO_FEW_READINGS, have=len(steps), needed=minimum)
        centre, sigma = mean_of(steps), overall(steps)
    else:
        if len(series) < minimum:
            raise Refused(Reason.TOO_FEW_READINGS, have=len(series), needed=minimum)
        flat = series.values - slope * (series.sequence - series.sequence[0])
        centre = 0.0 if quantity is Quantity.WEAR_RESIDUALS else mean_of(series.values)
        sigma = moving_range_within(Series(series.sequence, flat, series.begins))
    if not varies(sigma.value, series.values):
        raise Refused(Reason.NO_VARIATION)
    return Baseline(centre, sigma, provisional=sigma.readings < ENOUGH_READINGS)


def moving_range_within(series: Series) -> Sigma:
    """Sigma from the mean moving range, without the ranges over a begin: a change of tool is no scatter of the process."""
    inner = ~series.begins[1:]
    if inner.all():
        return moving_range(series.values)
    if not inner.any():
        raise Refused(Reason.TOO_FEW_READINGS, have=1, needed=2)
    ranges = np.abs(np.diff(series.values))[inner]
    # Ranges of several stretches are worth at least what as many of one stretch are, which share more readings.
    worth = moving_range(np.arange(len(ranges) + 1.0)).degrees_of_freedom
    return Sigma(float(ranges.mean()) / d2(2), Estimator.MOVING_RANGE, len(ranges) + 1, len(ranges), worth)
