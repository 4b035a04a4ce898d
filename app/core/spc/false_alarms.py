"""How often what is watched fires though nothing has happened: several rules together, and the limits of any chart.

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
from app.core.spc.constants import c4, d2, d3
from app.core.spc.points import Drawn
from app.core.spc.refusal import Floats, Refused
from app.core.spc.rules import RULES, Rule, RuleName
from app.core.spc.shewhart import Chart

NODES, WEIGHTS = np.polynomial.legendre.leggauss(200)
FARTHEST = 9.0  # sigma; beyond it lies nothing


class FalseAlarms(NamedTuple):
    """How many points there are on average from one signal to the next; infinite where nothing is watched."""

    every: float
    exact: bool = True

    def expected(self, points: int) -> float:
        """How many signals so many points bring by chance."""
        return points / self.every


def by_chance(drawn: Drawn, names: Iterable[RuleName], size: int = 1) -> FalseAlarms:
    """Of a chart that these rules watch together; of a chart whose limits alone have a meaning, of these. size: of subgroups.

    >>> western = [RuleName.NELSON_1, RuleName.NELSON_5, RuleName.NELSON_6, RuleName.WESTERN_4]
    >>> round(by_chance(Drawn(Chart.INDIVIDUALS), western).every, 2)
    91.75
    >>> round(by_chance(Drawn(Chart.CUSUM), [RuleName.NELSON_1]).every)
    465
    """
    watched = tuple(sorted(set(names)))
    if not watched:
        return FalseAlarms(float("inf"))
    if drawn.chart in {Chart.INDIVIDUALS, Chart.XBAR}:
        return together(tuple(_at(name, drawn.width) for name in watched))
    return of_limits(drawn, size)


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
    return FalseAlarms(1 / rate, exact)


@cache
def of_limits(drawn: Drawn, size: int = 1) -> FalseAlarms:
    """Points of a chart beyond its limits, those in a row counted as one where neighbours share readings."""
    match drawn.chart:
        case Chart.EWMA:
            return FalseAlarms(ewma.average_run_length(drawn.weight, drawn.width))
        case Chart.CUSUM:
            return FalseAlarms(cusum.average_run_length(drawn.reference, drawn.limit, headstart=drawn.headstart))
        case Chart.MOVING_RANGE:
            return FalseAlarms(1 / _moving_ranges(drawn.width), exact=False)
        case Chart.MOVING_AVERAGE:
            return FalseAlarms(1 / _moving_averages(drawn.width, drawn.span), exact=False)
        case Chart.RANGES:
            return FalseAlarms(1 / _ranges(drawn.width, size))
        case Chart.DEVIATIONS:
            return FalseAlarms(1 / _deviations(drawn.width, size))
    return FalseAlarms(1 / float(2 * ndtr(-drawn.width)))


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
    """Range of n values beyond d2 -/+ width d3: P(R <= w) = n * integral of phi(x) (Phi(x + w) - Phi(x))^(n-1)."""
    x, weights = FARTHEST * NODES, FARTHEST * WEIGHTS

    def up_to(reach: float) -> float:
        return float(size * (weights * _density(x)) @ (ndtr(x + reach) - ndtr(x)) ** (size - 1))

    return 1 - up_to(d2(size) + width * d3(size)) + up_to(max(0.0, d2(size) - width * d3(size)))


def _deviations(width: float, size: int) -> float:
    """Standard deviation s beyond c4 -/+ width sqrt(1 - c4^2): (n - 1) s^2 is distributed as chi-square."""
    mean = c4(size)
    reach = width * sqrt(1 - mean * mean)
    upper, lower = (size - 1) * (mean + reach) ** 2, (size - 1) * max(0.0, mean - reach) ** 2
    return float(1 - chdtr(size - 1, upper) + chdtr(size - 1, lower))
