"""False alarms of all that is watched: several rules together, and the limits of any chart.

As in `chance`, for independent, normally distributed readings about the right centre with the right sigma. Where no exact
number is known, `exact` is False and the number is what follows from the rates of the parts.
"""

from collections.abc import Iterable
from functools import cache
from math import sqrt
from typing import NamedTuple

import numpy as np
from scipy.special import chdtr, ndtr

from app.core.spc import cusum, ewma
from app.core.spc.chance import STEPS, average_run_length, chance
from app.core.spc.constants import c4, d2, d3, range_at_most
from app.core.spc.points import ChartSettings
from app.core.spc.refusal import Floats, Refused
from app.core.spc.rules import RULES, Rule, RuleName
from app.core.spc.shewhart import Chart

NODES, WEIGHTS = np.polynomial.legendre.leggauss(200)
LONGEST = 1e9
"""Points: rarer than once in this many is not distinguished. A process of a part per second takes thirty years for them, and
the equations behind the longer run lengths cannot be solved with sixteen digits."""
FARTHEST = 9.0  # sigma; beyond it lies nothing


class FalseAlarms(NamedTuple):
    """Average number of points from one signal to the next; infinite where nothing is watched.

    `LONGEST`, and not exact: that many or more.
    """

    every: float
    exact: bool = True

    @property
    def rarely(self) -> bool:
        """Once in `LONGEST` points, or less often."""
        return LONGEST <= self.every < float("inf")

    def expected(self, points: int) -> float:
        """Number of signals that N points bring by chance."""
        return points / self.every


def by_chance(settings: ChartSettings, names: Iterable[RuleName], size: int = 1) -> FalseAlarms:
    """Of a chart that these rules watch together; of a chart whose limits alone have a meaning, of these. size: of subgroups.

    >>> western = [RuleName.NELSON_1, RuleName.NELSON_5, RuleName.NELSON_6, RuleName.WESTERN_4]
    >>> round(by_chance(ChartSettings(Chart.INDIVIDUALS), western).every, 2)
    91.75
    >>> round(by_chance(ChartSettings(Chart.CUSUM), [RuleName.NELSON_1]).every)
    465
    """
    watched = tuple(sorted(set(names)))
    if not watched:
        return FalseAlarms(float("inf"))
    if settings.chart in {Chart.INDIVIDUALS, Chart.XBAR}:
        return together(tuple(_at(name, settings.width) for name in watched))
    return of_limits(settings, size)


def _at(name: RuleName, width: float) -> Rule:
    rule = RULES[name]
    return Rule(rule.name, rule.kind, rule.n, rule.k, width) if name is RuleName.NELSON_1 else rule


@cache
def together(rules: tuple[Rule, ...]) -> FalseAlarms:
    """Several rules on independent points. Exact by the Markov chain of `chance`; rules about steps are added by their rates.

    That counts a point twice where a step rule and another fire at once: of all eight rules it makes the number 3 % small.
    """
    plain = [rule for rule in rules if rule.kind not in STEPS]
    steps = [rule for rule in rules if rule.kind in STEPS]
    exact = len(steps) + bool(plain) == 1
    try:
        rate = 1 / average_run_length(plain) if plain else 0.0
    except Refused:
        rate, exact = sum(1 / average_run_length([rule]) for rule in plain), False
    rate += sum(1 / chance(rule).average_run_length for rule in steps)
    return _at_rate(rate, exact=exact)


@cache
def of_limits(settings: ChartSettings, size: int = 1) -> FalseAlarms:
    """Points of a chart beyond its limits, those in a row counted as one where neighbours share readings."""
    match settings.chart:
        case Chart.EWMA:
            return _once_in(ewma.average_run_length(settings.weight, settings.width))
        case Chart.CUSUM:
            return _once_in(cusum.average_run_length(settings.reference, settings.limit, headstart=settings.headstart))
        case Chart.MOVING_RANGE:
            return _at_rate(_moving_ranges(settings.width), exact=False)
        case Chart.MOVING_AVERAGE:
            return _at_rate(_moving_averages(settings.width, settings.span), exact=False)
        case Chart.RANGES:
            return _at_rate(_ranges(settings.width, size))
        case Chart.DEVIATIONS:
            return _at_rate(_deviations(settings.width, size))
    return _at_rate(float(2 * ndtr(-settings.width)))


def _once_in(length: float, *, exact: bool = True) -> FalseAlarms:
    return FalseAlarms(length, exact) if length < LONGEST else FalseAlarms(LONGEST, exact=False)


def _at_rate(rate: float, *, exact: bool = True) -> FalseAlarms:
    return _once_in(1 / rate if rate > 0 else LONGEST, exact=exact)


def _density(x: Floats) -> Floats:
    return np.asarray(np.exp(-x * x / 2) / sqrt(2 * np.pi))


def _moving_ranges(width: float) -> float:
    """A range beyond a limit after one that is not: P(beyond) - P(two in a row), which share the middle reading."""
    x, weights = FARTHEST * NODES, FARTHEST * WEIGHTS * _density(FARTHEST * NODES)
    upper, lower = d2(2) + width * d3(2), max(0.0, d2(2) - width * d3(2))
    above = ndtr(x - upper) + ndtr(-x - upper)
    below = ndtr(x + lower) - ndtr(x - lower)
    return float(weights @ (above * (1 - above)) + weights @ (below * (1 - below)))


def _moving_averages(width: float, span: int) -> float:
    """An average beyond a limit after one that is not; neighbours are correlated by (span - 1)/span."""
    shared = (span - 1) / span
    half = (FARTHEST - width) / 2
    if half <= 0:
        return float(2 * ndtr(-width))
    x = width + half * (NODES + 1)
    stays = ndtr((shared * x - width) / sqrt(1 - shared * shared))
    return float(2 * half * (WEIGHTS * _density(x)) @ (1 - stays))


def _ranges(width: float, size: int) -> float:
    """Range of n values beyond d2 -/+ width d3."""
    mean, reach = d2(size), width * d3(size)
    below, above = range_at_most(np.array([max(0.0, mean - reach), mean + reach]), size)
    return float(1 - above + below)


def _deviations(width: float, size: int) -> float:
    """Standard deviation s beyond c4 -/+ width sqrt(1 - c4^2): (n - 1) s^2 is distributed as chi-square."""
    mean = c4(size)
    reach = width * sqrt(1 - mean * mean)
    upper, lower = (size - 1) * (mean + reach) ** 2, (size - 1) * max(0.0, mean - reach) ** 2
    return float(1 - chdtr(size - 1, upper) + chdtr(size - 1, lower))
