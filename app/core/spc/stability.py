"""Statistical control: a chart signals no more than chance does. Only such a process has a capability that lasts.

Not to be taken for the behaviour in time of ISO 22514 (`in_time`), which tests whether mean and scatter are constant.

No signal at all is too much to ask of many readings: a rule fires on a process in control too, once in its average run length
(`chance`). So signals are counted, runs of points each once, and compared with what chance brings: under it their number
is nearly Poisson's with mean points / run length. The process counts as out of control if for one of the rules that many have
less than one chance in a thousand, divided among the rules (Bonferroni). Signals are sized as well as counted: one point
beyond `GROSS` sigma is enough, for chance brings none in a hundred million.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import pdtrc

from app.core.spc.chance import chance
from app.core.spc.rules import RULES, RuleName, signals
from app.core.spc.shewhart import individuals, individuals_baseline

LEVEL = 0.001
GROSS = 6.0
"""Sigma from the centre: twice the distance of the limits, reached by chance once in 500 million points."""
WATCHED = (RuleName.NELSON_1, RuleName.NELSON_2, RuleName.NELSON_3, RuleName.NELSON_5, RuleName.NELSON_6)
"""Rules about what puts a process out of control: a part unlike the others, a mean that moves, a drift."""


class Fired(NamedTuple):
    """Number of signals of a rule, the number that chance explains, and the probability of that many by chance."""

    rule: RuleName
    signals: int
    expected: float
    p_value: float


@dataclass(frozen=True, slots=True)
class Stability:
    """The verdict. `frozen`: judged by limits that were set before, not by limits of these readings themselves.

    gross: how many points lie beyond `GROSS` sigma. farthest: the largest distance from the centre, in sigma.
    """

    points: int
    fired: tuple[Fired, ...]
    frozen: bool
    gross: int
    farthest: float

    @property
    def in_control(self) -> bool:
        """No rule fires more than chance explains, and no point lies far beyond the limits."""
        return not (self.beyond_chance or self.gross)

    @property
    def beyond_chance(self) -> tuple[Fired, ...]:
        """The rules that do."""
        return tuple(entry for entry in self.fired if entry.p_value < LEVEL / len(self.fired))


def stability(z: ArrayLike, rules: Iterable[RuleName] = WATCHED, *, frozen: bool = False) -> Stability:
    """Judge points of a chart, in sigma from its centre (`ControlChart.z`), by those of `rules` that are watched here.

    >>> found = stability([0.2, -0.4] * 20 + [0.5] * 20)
    >>> [(each.rule.value, each.signals) for each in found.fired if each.signals], found.in_control
    ([('nelson_2', 1)], True)
    """
    points = np.asarray(z, dtype=np.float64)
    watched = [name for name in rules if name in WATCHED]
    runs = signals(points, [RULES[name] for name in watched])
    fired = []
    for name in watched:
        count = runs.count(name)
        expected = len(points) / _run_length(name)
        fired.append(Fired(name, count, expected, float(pdtrc(count - 1, expected)) if count else 1.0))
    away = np.abs(points)
    return Stability(len(points), tuple(fired), frozen, int((away > GROSS).sum()), float(away.max(initial=0.0)))


def of_readings(values: ArrayLike) -> Stability:
    """Judge readings by an individuals chart of their own. Raises `Refused` as `individuals_baseline` does."""
    return stability(individuals(individuals_baseline(values), values).z)


@cache
def _run_length(name: RuleName) -> float:
    return chance(RULES[name]).average_run_length
