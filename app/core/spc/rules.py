"""Run rules: the eight of Nelson and the four of Western Electric, every signal kept as a run of points.

All look at z, the distance of points from the centre in sigma (`ControlChart.z`). A point exactly on a limit belongs
to the inner side; a point exactly on the centre is on neither side; equal neighbours neither rise nor fall.

========  ======================================================  ==================================
rule      fires when                                              Western Electric
========  ======================================================  ==================================
nelson_1  a point lies beyond 3 sigma                             its rule 1
nelson_2  9 points in a row lie on one side of the centre         western_4: 8 points in a row
nelson_3  6 points in a row rise, or fall
nelson_4  14 points in a row alternate up and down
nelson_5  2 of 3 points lie beyond 2 sigma on one side            its rule 2
nelson_6  4 of 5 points lie beyond 1 sigma on one side            its rule 3
nelson_7  15 points in a row lie within 1 sigma
nelson_8  8 points in a row lie beyond 1 sigma, on either side
========  ======================================================  ==================================

Sources: L. S. Nelson, The Shewhart control chart: tests for special causes, J. Qual. Technol. 16 (1984) 237-239; Western
Electric Co., Statistical Quality Control Handbook (1956) 25-28. "k of n" fires at the point that makes it true, so
that point lies beyond the limit itself.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import IntEnum, StrEnum
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from app.core.spc.cusum import Cusum
from app.core.spc.refusal import Floats, checked
from app.core.spc.scan import STATE, beyond_runs, equal_runs, painted
from app.core.spc.shewhart import Chart, ControlChart


class RuleKind(IntEnum):
    """Pattern that a rule looks for."""

    BEYOND = 0  # k of n beyond a limit, on one side
    SIDE = 1
    TREND = 2
    ALTERNATING = 3
    WITHIN = 4
    OUTSIDE = 5


class RuleName(StrEnum):
    """The rules."""

    NELSON_1 = "nelson_1"
    NELSON_2 = "nelson_2"
    NELSON_3 = "nelson_3"
    NELSON_4 = "nelson_4"
    NELSON_5 = "nelson_5"
    NELSON_6 = "nelson_6"
    NELSON_7 = "nelson_7"
    NELSON_8 = "nelson_8"
    WESTERN_4 = "western_4"


@dataclass(frozen=True, slots=True)
class Rule:
    """A rule with its numbers: k of n points (k = n but for "k of n"), and the limit in sigma where it has one."""

    name: RuleName
    kind: RuleKind
    n: int
    k: int
    limit: float = 0.0

    def __post_init__(self) -> None:
        """Refuse numbers that have no meaning."""
        steps = self.kind in {RuleKind.TREND, RuleKind.ALTERNATING}
        if not 1 <= self.k <= self.n <= 60 or self.limit < 0 or (steps and self.n < 2):
            raise ValueError(f"{self.name}: {self.k} of {self.n} points beyond {self.limit} sigma has no meaning")


RULES = {
    rule.name: rule
    for rule in (
        Rule(RuleName.NELSON_1, RuleKind.BEYOND, 1, 1, 3.0),
        Rule(RuleName.NELSON_2, RuleKind.SIDE, 9, 9),
        Rule(RuleName.NELSON_3, RuleKind.TREND, 6, 6),
        Rule(RuleName.NELSON_4, RuleKind.ALTERNATING, 14, 14),
        Rule(RuleName.NELSON_5, RuleKind.BEYOND, 3, 2, 2.0),
        Rule(RuleName.NELSON_6, RuleKind.BEYOND, 5, 4, 1.0),
        Rule(RuleName.NELSON_7, RuleKind.WITHIN, 15, 15, 1.0),
        Rule(RuleName.NELSON_8, RuleKind.OUTSIDE, 8, 8, 1.0),
        Rule(RuleName.WESTERN_4, RuleKind.SIDE, 8, 8),
    )
}
NELSON = tuple(rule for rule in RULES.values() if rule.name is not RuleName.WESTERN_4)
WESTERN_ELECTRIC = tuple(
    RULES[name] for name in (RuleName.NELSON_1, RuleName.NELSON_5, RuleName.NELSON_6, RuleName.WESTERN_4)
)

FITTING: dict[Chart, tuple[RuleName, ...]] = {
    Chart.INDIVIDUALS: tuple(RULES),
    Chart.XBAR: tuple(RULES),
    # Their points share readings (MR, EWMA, moving average, sums), or scatter unevenly about the centre (R, s): zones and
    # runs would fire by themselves. Only the limits have a meaning.
    Chart.MOVING_RANGE: (RuleName.NELSON_1,),
    Chart.RANGES: (RuleName.NELSON_1,),
    Chart.DEVIATIONS: (RuleName.NELSON_1,),
    Chart.EWMA: (RuleName.NELSON_1,),
    Chart.MOVING_AVERAGE: (RuleName.NELSON_1,),
    Chart.CUSUM: (RuleName.NELSON_1,),
}
"""Which rules have a sense on which chart."""


@dataclass(frozen=True, slots=True)
class Run:
    """One signal: where it begins and ends (both included), how many points make it, and the side they are on.

    side: 1 above or rising, -1 below or falling, 0 where a rule knows no side.
    """

    rule: RuleName
    side: int
    start: int
    end: int
    points: int


@dataclass(frozen=True, slots=True)
class Signals:
    """All signals of some rules on `length` points. Rows of `runs`: side, start, end, number of points."""

    length: int
    runs: dict[RuleName, NDArray[np.int64]]

    def __iter__(self) -> Iterator[Run]:
        """Every signal, rule by rule, in order of time."""
        for name, rows in self.runs.items():
            for side, start, end, points in rows.tolist():
                yield Run(name, side, start, end, points)

    def count(self, name: RuleName) -> int:
        """Number of signals of a rule; a run that goes on counts once."""
        return len(self.runs[name])

    def newest(self, most: int) -> list[Run]:
        """The last N signals by where they end, the newest last; of those that end together the later rule."""
        names = list(self.runs)
        if not names:
            return []
        rows = np.concatenate(
            [np.column_stack((np.full(len(self.runs[n]), at), self.runs[n])) for at, n in enumerate(names)]
        )
        order = np.argsort(rows[:, 3], kind="stable")[max(0, len(rows) - most) :]
        return [Run(names[at], side, start, end, points) for at, side, start, end, points in rows[order].tolist()]

    def sides(self, nowhere: int) -> NDArray[np.int8]:
        """Of each point the side of its signal, of several that of the last rule; `nowhere` where there is none."""
        sides = np.full(self.length, nowhere, np.int8)
        for rows in self.runs.values():
            painted(sides, rows)
        return sides


class Scan:
    """Rules that watch points as they come in, in pieces of any size; what was seen before is not forgotten.

    >>> scan = Scan(NELSON)
    >>> scan.feed([0.5, 0.2, 3.4]); scan.feed([2.1, 0.1, 2.5])
    >>> [(run.rule.value, run.start, run.end, run.points) for run in scan.signals()]
    [('nelson_1', 2, 2, 1), ('nelson_5', 2, 5, 3)]
    """

    def __init__(self, rules: Iterable[Rule] = NELSON) -> None:
        """Watch for these rules."""
        self.rules = tuple(rules)
        self.length = 0
        self._last = 0.0
        self._states = {rule.name: np.zeros((2, STATE), np.int64) for rule in self.rules}
        self._runs = {rule.name: np.empty((0, 4), np.int64) for rule in self.rules}

    def feed(self, z: ArrayLike) -> None:
        """Take the next points."""
        points = checked(z)
        for rule in self.rules:
            earlier = self._runs[rule.name]
            self._runs[rule.name] = _fed(rule, points, self.length, self._last, self._states[rule.name], earlier)
        self.length += len(points)
        self._last = float(points[-1])

    def signals(self) -> Signals:
        """Every signal so far."""
        return Signals(self.length, dict(self._runs))

    def memory(self) -> dict[str, Any]:
        """State to go on from without the points seen so far, as JSON. Only runs that may still grow are in it.

        >>> first, second = Scan(NELSON), Scan(NELSON)
        >>> first.feed([0.5, 2.2]); second.recall(first.memory()); second.feed([2.1])
        >>> [(run.rule.value, run.start, run.end, run.points) for run in second.signals()]
        [('nelson_5', 1, 2, 2)]
        """
        return {
            "length": self.length,
            "last": self._last,
            "rules": {
                rule.name.value: {"state": self._states[rule.name].tolist(), "runs": _newest(self._runs[rule.name])}
                for rule in self.rules
            },
        }

    def recall(self, memory: Mapping[str, Any]) -> None:
        """Go on where another scan of the same rules has left off."""
        self.length, self._last = memory["length"], memory["last"]
        for rule in self.rules:
            state = memory["rules"][rule.name.value]
            self._states[rule.name] = np.array(state["state"], np.int64).reshape(2, STATE)
            self._runs[rule.name] = np.array(state["runs"], np.int64).reshape(-1, 4)


def _newest(rows: NDArray[np.int64]) -> list[list[int]]:
    """The last run of each side, in order of time: of the others none can grow."""
    of_sides = [rows[rows[:, 0] == side][-1:] for side in (1, 0, -1)]
    return sorted(np.concatenate(of_sides).tolist(), key=lambda row: int(row[1]))


def _fed(
    rule: Rule, z: Floats, offset: int, last: float, state: NDArray[np.int64], earlier: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Go on with one rule: rows of earlier runs, the last of which may grow, and of new ones."""
    if rule.kind is RuleKind.BEYOND:
        sides = []
        for row, side in enumerate((1, -1)):
            runs = earlier[earlier[:, 0] == side]
            sides.append(beyond_runs(z, offset, side, rule.n, rule.k, rule.limit, state[row], runs))
        rows = np.concatenate(sides)
        return rows[np.argsort(rows[:, 1], kind="stable")]
    return equal_runs(z, offset, last, int(rule.kind), rule.n, rule.limit, state[0], earlier)


def signals(z: ArrayLike, rules: Iterable[Rule] = NELSON, restarts: Iterable[int] = ()) -> Signals:
    """Every signal of these rules on these points. restarts: places, ascending, where the rules begin again: no run goes over one.

    >>> [(run.rule.value, run.start, run.end) for run in signals([0.1] * 9 + [-0.1])]
    [('nelson_2', 0, 8)]
    >>> [(run.start, run.end) for run in signals([0.1] * 18, restarts=[4])]
    [(4, 17)]
    """
    points, chosen = checked(z), tuple(rules)
    edges = sorted({0, len(points), *(place for place in restarts if 0 < place < len(points))})
    found: dict[RuleName, list[NDArray[np.int64]]] = {rule.name: [] for rule in chosen}
    for begin, end in pairwise(edges):
        scan = Scan(chosen)
        scan.feed(points[begin:end])
        for name, rows in scan.signals().runs.items():
            found[name].append(rows + np.array([0, begin, begin, 0]))
    return Signals(len(points), {name: np.concatenate(rows) for name, rows in found.items()})


def signals_of(chart: ControlChart, rules: Iterable[Rule] = NELSON, restarts: Iterable[int] = ()) -> Signals:
    """The signals of a chart: of the rules that fit it, with rule 1 at the limits that the chart has. restarts: as above."""
    width = chart.baseline.width
    fitting = [
        Rule(rule.name, rule.kind, rule.n, rule.k, width) if rule.name is RuleName.NELSON_1 else rule
        for rule in rules
        if rule.name in FITTING[chart.chart]
    ]
    return signals(chart.z, fitting, restarts)


def signals_of_cusum(chart: Cusum, restarts: Iterable[int] = ()) -> Signals:
    """The signals of a CUSUM: runs of points whose upper (side 1) or lower sum (side -1) is above h.

    When the change began is another question: `Cusum.since_above` points back to where the sum left 0. restarts: as `signals`.

    >>> from app.core.spc.cusum import cusum
    >>> from app.core.spc.shewhart import given
    >>> list(signals_of_cusum(cusum(given(0, 1), [2.0, 2.0, 2.0, 2.0, -9.0])))[0]
    Run(rule=<RuleName.NELSON_1: 'nelson_1'>, side=1, start=3, end=3, points=1)
    """
    once = [Rule(RuleName.NELSON_1, RuleKind.BEYOND, 1, 1, chart.limit)]
    rows = []
    for side, sums in ((1, chart.above), (-1, chart.below)):
        runs = signals(sums, once, restarts).runs[RuleName.NELSON_1] if len(sums) else np.empty((0, 4), np.int64)
        runs[:, 0] = side
        rows.append(runs)
    together = np.concatenate(rows)
    return Signals(len(chart.above), {RuleName.NELSON_1: together[np.argsort(together[:, 1], kind="stable")]})
