"""False alarms: against what others have tabulated, and against charts of random numbers."""

from math import inf

import numpy as np
import pytest

from app.core.spc.constants import c4, d2, d3
from app.core.spc.false_alarms import by_chance, of_limits, together
from app.core.spc.points import Drawn, Piece
from app.core.spc.rules import NELSON, RULES, Rule, RuleName
from app.core.spc.shewhart import Chart
from app.core.spc.watch import Watch


def counted(drawn: Drawn, names: list[RuleName], points: int = 400_000) -> float:
    """Points per signal on random numbers."""
    at = np.arange(1, points + 1)
    z = np.random.default_rng(17).normal(size=points)
    return points / len(Watch(drawn, dict.fromkeys(names, 0)).feed(Piece([z], at, at, at < 0)))


def test_published_sets_have_their_published_lengths() -> None:
    # Champ and Woodall, Technometrics 29 (1987), table 1: rules 1; 1 and 2 of 3; 1 and 8 on a side; all four, at shift 0.
    def length(*names: RuleName) -> float:
        return by_chance(Drawn(Chart.INDIVIDUALS), names).every

    assert length(RuleName.NELSON_1) == pytest.approx(370.40, abs=0.005)
    assert length(RuleName.NELSON_1, RuleName.NELSON_5) == pytest.approx(225.44, abs=0.005)
    assert length(RuleName.NELSON_1, RuleName.WESTERN_4) == pytest.approx(152.73, abs=0.005)
    four = (RuleName.NELSON_1, RuleName.NELSON_5, RuleName.NELSON_6, RuleName.WESTERN_4)
    assert length(*four) == pytest.approx(91.75, abs=0.005)


def test_with_rules_about_steps_it_is_nearly_as_counted() -> None:
    every = together(NELSON)
    assert not every.exact
    assert together((RULES[RuleName.NELSON_3],)).exact
    # The first signal of all eight rules on random numbers: 72.7 +/- 0.9 points (6000 charts).
    assert every.every == pytest.approx(72.7, rel=0.04)


@pytest.mark.parametrize(
    "drawn",
    [
        Drawn(Chart.MOVING_RANGE),
        Drawn(Chart.MOVING_RANGE, width=2.0),
        Drawn(Chart.MOVING_AVERAGE, span=5),
        Drawn(Chart.MOVING_AVERAGE, width=2.0, span=3),
        Drawn(Chart.INDIVIDUALS, width=2.5),
    ],
    ids=lambda drawn: f"{drawn.chart}-{drawn.width}",
)
def test_limits_are_left_as_often_as_on_random_numbers(drawn: Drawn) -> None:
    expected = by_chance(drawn, [RuleName.NELSON_1]).every
    assert counted(drawn, [RuleName.NELSON_1]) == pytest.approx(expected, rel=5 * (expected / 400_000) ** 0.5)


@pytest.mark.parametrize("size", [2, 5, 9])
def test_scatter_of_subgroups_leaves_its_limits_as_often_as_on_random_numbers(size: int) -> None:
    groups = np.random.default_rng(23).normal(size=(200_000, size))
    spread, s = np.ptp(groups, axis=1), groups.std(axis=1, ddof=1)
    scatter = (1 - c4(size) ** 2) ** 0.5
    shares = {
        Chart.RANGES: ((spread > d2(size) + 3 * d3(size)) | (spread < d2(size) - 3 * d3(size))).mean(),
        Chart.DEVIATIONS: ((s > c4(size) + 3 * scatter) | (s < c4(size) - 3 * scatter)).mean(),
    }
    for chart, share in shares.items():
        rate = 1 / of_limits(Drawn(chart), size).every
        assert share == pytest.approx(rate, abs=5 * (rate / 200_000) ** 0.5)


def test_averages_and_sums_have_their_published_lengths() -> None:
    assert by_chance(Drawn(Chart.EWMA, width=2.814, weight=0.1), [RuleName.NELSON_1]).every == pytest.approx(500, abs=1)
    assert by_chance(Drawn(Chart.CUSUM), [RuleName.NELSON_1]).every == pytest.approx(465, abs=1)
    assert by_chance(Drawn(Chart.CUSUM, headstart=2.5), [RuleName.NELSON_1]).every == pytest.approx(430, abs=1)


def test_nothing_watched_never_fires_and_hopeless_chains_are_estimated() -> None:
    assert by_chance(Drawn(Chart.EWMA), []).every == inf
    assert by_chance(Drawn(Chart.INDIVIDUALS), []).expected(1000) == 0
    one = by_chance(Drawn(Chart.INDIVIDUALS), [RuleName.NELSON_1])
    assert one.expected(1000) == pytest.approx(2.7, abs=0.001)
    same = together((RULES[RuleName.NELSON_1], Rule(RuleName.NELSON_5, RULES[RuleName.NELSON_5].kind, 3, 2, 2.0)))
    assert same.exact
