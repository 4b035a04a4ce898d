"""Rules that watch a chart while readings come in. A new reading costs what it costs, however many there were before.

Every rule begins with the first point that is complete after the reading named for it: nothing is known of what lies before.

    >>> watch = Watch(ChartSettings(Chart.INDIVIDUALS), {RuleName.NELSON_1: 10, RuleName.NELSON_2: 0})
    >>> at = np.arange(9, 18)
    >>> watch.feed(Piece([np.array([4.0] + [0.5] * 8)], at, at, at < 0))
    [SignalSpan(rule=<RuleName.NELSON_2: 'nelson_2'>, side=1, first=9, last=17, points=9)]
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from app.core.spc.points import ChartSettings, Piece, Points
from app.core.spc.rules import FITTING, RULES, Rule, RuleName, Scan
from app.core.spc.shewhart import Chart


class SignalSpan(NamedTuple):
    """A signal by the readings it is made of: sequence numbers of the first and the last of them, and how many points.

    side: 1 above or rising, -1 below or falling, 0 where the rule knows no side.
    """

    rule: RuleName
    side: int
    first: int
    last: int
    points: int


class Watch:
    """One chart and the rules that watch it."""

    def __init__(
        self, settings: ChartSettings, since: Mapping[RuleName, int], memory: Mapping[str, Any] | None = None
    ) -> None:
        """`since`: for each rule the reading after which it begins. `memory`: of a watch with the same rules before.

        Rules that do not fit the chart are left out (`FITTING`).
        """
        self._points = Points(settings)
        names = sorted(name for name in since if name in FITTING[settings.chart])
        rows = 2 if settings.chart is Chart.CUSUM else 1
        self._rules = [_Watched(_at(name, settings), since[name], row) for name in names for row in range(rows)]
        if memory is not None:
            self._points.recall(memory["points"])
            for rule, state in zip(self._rules, memory["rules"], strict=True):
                rule.recall(state)

    def feed(self, piece: Piece) -> list[SignalSpan]:
        """Take the next points of the individuals or X-bar chart; the signals that begin or go on with them, by rule and time."""
        points = self._points.feed(piece)
        return [span for rule in self._rules for span in rule.feed(points)]

    def memory(self) -> dict[str, Any]:
        """State to go on from, as JSON: some hundred bytes per rule, however many readings there were."""
        return {"points": self._points.memory(), "rules": [rule.memory() for rule in self._rules]}


def _at(name: RuleName, settings: ChartSettings) -> Rule:
    """A rule by its name; rule 1 at the limits of the chart."""
    rule = RULES[name]
    return Rule(rule.name, rule.kind, rule.n, rule.k, settings.reach) if name is RuleName.NELSON_1 else rule


class _Watched:
    """One rule on one row of points."""

    def __init__(self, rule: Rule, since: int, row: int) -> None:
        self.rule, self.since, self.row = rule, since, row
        self._scan = Scan([rule])
        self._firsts = np.empty(0, np.int64)  # of the last points: the first reading of each
        self._begun: dict[int, int] = {}  # of runs that may grow: number of the first point, and its first reading

    def feed(self, piece: Piece) -> list[SignalSpan]:
        counted = piece.last > self.since
        if not counted.any():
            return []
        piece = piece.only(counted)
        before = self._scan.length
        self._scan.feed(piece.rows[self.row])
        firsts = np.concatenate((self._firsts, piece.first))
        spans = []
        for run in self._scan.signals():
            first = self._begun.get(run.start)
            if first is None:
                first = self._begun[run.start] = int(firsts[run.start - before + len(self._firsts)])
            if run.end >= before:
                spans.append(SignalSpan(run.rule, run.side, first, int(piece.last[run.end - before]), run.points))
        self._firsts = firsts[-self.rule.n - 1 :]
        # Only runs that may grow are kept, or every reading would cost what all runs before it cost.
        self._scan.recall(self._scan.memory())
        self._begun = {run.start: self._begun[run.start] for run in self._scan.signals()}
        return spans

    def memory(self) -> dict[str, Any]:
        begun = [[start, first] for start, first in self._begun.items()]
        return {"scan": self._scan.memory(), "firsts": self._firsts.tolist(), "begun": begun}

    def recall(self, memory: Mapping[str, Any]) -> None:
        self._scan.recall(memory["scan"])
        self._firsts = np.array(memory["firsts"], np.int64)
        self._begun = dict(memory["begun"])
