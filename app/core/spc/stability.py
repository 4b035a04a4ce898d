"""Whether a chart signals more than chance does: only a process that is stable has a capability that will be there tomorrow.

No signal at all is too much to ask of many readings: a rule fires on a stable process too, once in its average run length
(`chance`). So signals are counted, runs of points each once, and compared with what chance brings: under it their number
is nearly Poisson's with mean points / run length. The process counts as unstable if for one of the rules so many have
less than one chance in a thousand, divided among the rules (Bonferroni).
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
WATCHED = (RuleName.NELSON_1, RuleName.NELSON_2, RuleName.NELSON_3, RuleName.NELSON_5, RuleName.NELSON_6)
"""Rules about what makes a process unstable: a part unlike the others, a mean that moves, a drift."""


class Fired(NamedTuple):
    """How often a rule fired, how often chance would let it fire, and the probability of so many by chance."""

    rule: RuleName
    signals: int
    expected: float
    p_value: float


@dataclass(frozen=True, slots=True)
class Stability:
    """The verdict. `frozen`: judged by limits that were set before, not by limits of these readings themselves."""

    points: int
    fired: tuple[Fired, ...]
    frozen: bool

    @property
    def stable(self) -> bool:
        """Whether no rule fires more than chance explains."""
        return not self.beyond_chance

    @property
    def beyond_chance(self) -> tuple[Fired, ...]:
        """The rules that do."""
        return tuple(each for each in self.fired if each.p_value < LEVEL / len(self.fired))


def stability(z: ArrayLike, rules: Iterable[RuleName] = WATCHED, *, frozen: bool = False) -> Stability:
    """Judge points of a chart, in sigma from its centre (`ControlChart.z`), by those of `rules` that are watched here.

    >>> found = stability([0.2, -0.4] * 20 + [0.5] * 20)
    >>> [(each.rule.value, each.signals) for each in found.fired if each.signals], found.stable
    ([('nelson_2', 1)], True)
    """
    points = np.asarray(z, dtype=np.float64)
    watched = [name for name in rules if name in WATCHED]
    found = signals(points, [RULES[name] for name in watched])
    fired = []
    for name in watched:
        count = found.count(name)
        expected = len(points) / _run_length(name)
        fired.append(Fired(name, count, expected, float(pdtrc(count - 1, expected)) if count else 1.0))
    return Stability(len(points), tuple(fired), frozen)


def of_readings(values: ArrayLike) -> Stability:
    """Judge readings by an individuals chart of their own. Raises `Refused` as `individuals_baseline` does."""
    return stability(individuals(individuals_baseline(values), values).z)


@cache
def _run_length(name: RuleName) -> float:
    return chance(RULES[name]).average_run_length
