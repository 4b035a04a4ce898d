"""False alarms: against what others have tabulated, and against charts of random numbers."""

from math import inf

import numpy as np
import pytest

from app.core.spc import cusum, ewma
from app.core.spc.constants import c4, d2, d3
from app.core.spc.false_alarms import LONGEST, by_chance, of_limits, together
from app.core.spc.points import ChartSettings, Piece
from app.core.spc.rules import NELSON, RULES, Rule, RuleName
from app.core.spc.shewhart import Chart
from app.core.spc.watch import Watch


def counted(drawn: ChartSettings, names: list[RuleName], points: int = 400_000) -> float:
    """Points per signal on random numbers."""
    at = np.arange(1, points + 1)
    z = np.random.default_rng(17).normal(size=points)
    return points / len(Watch(drawn, dict.fromkeys(names, 0)).feed(Piece([z], at, at, at < 0)))


def test_published_sets_have_their_published_lengths() -> None:
    # Champ and Woodall, Technometrics 29 (1987), table 1: rules 1; 1 and 2 of 3; 1 and 8 on a side; all four, at shift 0.
    def length(*names: RuleName) -> float:
        return by_chance(ChartSettings(Chart.INDIVIDUALS), names).every

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
        ChartSettings(Chart.MOVING_RANGE),
        ChartSettings(Chart.MOVING_RANGE, width=2.0),
        ChartSettings(Chart.MOVING_AVERAGE, span=5),
        ChartSettings(Chart.MOVING_AVERAGE, width=2.0, span=3),
        ChartSettings(Chart.INDIVIDUALS, width=2.5),
    ],
    ids=lambda drawn: f"{drawn.chart}-{drawn.width}",
)
def test_limits_are_left_as_often_as_on_random_numbers(drawn: ChartSettings) -> None:
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
        rate = 1 / of_limits(ChartSettings(chart), size).every
        assert share == pytest.approx(rate, abs=5 * (rate / 200_000) ** 0.5)


def test_averages_and_sums_have_their_published_lengths() -> None:
    assert by_chance(ChartSettings(Chart.EWMA, width=2.814, weight=0.1), [RuleName.NELSON_1]).every == pytest.approx(
        500, abs=1
    )
    assert by_chance(ChartSettings(Chart.CUSUM), [RuleName.NELSON_1]).every == pytest.approx(465, abs=1)
    assert by_chance(ChartSettings(Chart.CUSUM, headstart=2.5), [RuleName.NELSON_1]).every == pytest.approx(430, abs=1)


def test_no_setting_that_is_accepted_has_a_false_or_a_slow_rate() -> None:
    for weight in (0.001, 0.02, 0.5, 0.999, 1.0):
        rates = [
            of_limits(ChartSettings(Chart.EWMA, width=width, weight=weight)) for width in (0.01, 1, 3, 5, 6, 7, 10)
        ]
        assert all(1 <= rate.every <= LONGEST for rate in rates), weight
        assert [rate.every for rate in rates] == sorted(rate.every for rate in rates), weight
        assert rates[-1].rarely, weight
        assert not rates[-1].exact, weight
        assert not rates[2].rarely, weight
        assert rates[2].exact, weight
    for reference in (0.0, 0.5, 1.0, 10.0):
        sums = [
            of_limits(ChartSettings(Chart.CUSUM, reference=reference, limit=limit))
            for limit in (0.1, 1, 5, 20, 60, 100)
        ]
        assert all(1 <= rate.every <= LONGEST for rate in sums), reference
        assert [rate.every for rate in sums] == sorted(rate.every for rate in sums), reference
        assert sums[4].rarely is (reference > 0), reference
    assert by_chance(ChartSettings(Chart.INDIVIDUALS, width=10.0), [RuleName.NELSON_1]).rarely
    assert of_limits(ChartSettings(Chart.RANGES, width=12.0), 5).rarely


def test_the_pieces_of_a_long_memory_give_what_one_whole_gave() -> None:
    # Computed with 12 Gauss-Legendre nodes for each deviation of a reading, over the whole width at once.
    assert ewma.average_run_length(0.001, 3.0) == pytest.approx(45602.4316, rel=1e-8)
    assert ewma.average_run_length(0.05, 0.5) == pytest.approx(5.21498778, rel=1e-8)
    assert cusum.average_run_length(0.0, 10.0, headstart=10 / 3) == pytest.approx(47.2462759, rel=1e-8)
    assert cusum.average_run_length(0.25, 30.0, headstart=10.0) == pytest.approx(23393273, rel=1e-5)


def test_nothing_watched_never_fires_and_hopeless_chains_are_estimated() -> None:
    assert by_chance(ChartSettings(Chart.EWMA), []).every == inf
    assert by_chance(ChartSettings(Chart.INDIVIDUALS), []).expected(1000) == 0
    one = by_chance(ChartSettings(Chart.INDIVIDUALS), [RuleName.NELSON_1])
    assert one.expected(1000) == pytest.approx(2.7, abs=0.001)
    same = together((RULES[RuleName.NELSON_1], Rule(RuleName.NELSON_5, RULES[RuleName.NELSON_5].kind, 3, 2, 2.0)))
    assert same.exact
