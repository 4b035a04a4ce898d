"""Run rules: against their definitions spelled out, in pieces as in one, mirrored, and against what others published."""

import re
from itertools import pairwise
from math import cos, e, tan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app import HOUSE
from app.core.compiled import plain
from app.core.spc import scan
from app.core.spc.chance import average_run_length, chance, per_window
from app.core.spc.cusum import cusum
from app.core.spc.refusal import Reason, Refused
from app.core.spc.rules import (
    FITTING,
    NELSON,
    RULES,
    WESTERN_ELECTRIC,
    Rule,
    RuleKind,
    RuleName,
    Scan,
    signals,
    signals_of_cusum,
)
from app.core.spc.shewhart import Chart
from app.core.spc.shewhart import given as standard
from tests.chance import by_chance, examples, runs, seed

# Quarters reach every limit exactly, and equal neighbours come up often.
POINTS = st.lists(st.integers(-14, 14).map(lambda quarter: quarter / 4), min_size=1, max_size=80)


def fires(rule: Rule, z: list[float], at: int) -> list[tuple[int, set[int]]]:
    """The rule's definition at one point, word by word: sides on which it fires there, with the points of the pattern."""
    first = at - rule.n + 1
    if rule.kind is RuleKind.BEYOND:
        found = []
        for side in (1, -1):
            pattern = {i for i in range(max(0, first), at + 1) if side * z[i] > rule.limit}
            if at in pattern and len(pattern) >= rule.k:
                found.append((side, pattern))
        return found
    if first < 0:
        return []
    window = z[first : at + 1]
    steps = [b - a for a, b in pairwise(window)]
    points = set(range(first, at + 1))
    match rule.kind:
        case RuleKind.SIDE:
            sides = [side for side in (1, -1) if all(side * value > 0 for value in window)]
        case RuleKind.TREND:
            sides = [side for side in (1, -1) if all(side * step > 0 for step in steps)]
        case RuleKind.ALTERNATING:
            sides = [0] if steps[0] != 0 and all(a * b < 0 for a, b in pairwise(steps)) else []
        case RuleKind.WITHIN:
            sides = [0] if all(abs(value) <= rule.limit for value in window) else []
        case _:
            sides = [0] if all(abs(value) > rule.limit for value in window) else []
    return [(side, points) for side in sides]


def expected(rule: Rule, z: list[float]) -> set[tuple[int, int]]:
    """Side and number of every point of every pattern."""
    return {(side, i) for at in range(len(z)) for side, pattern in fires(rule, z, at) for i in pattern}


@pytest.mark.parametrize("rule", RULES.values(), ids=lambda rule: rule.name.value)
@given(z=POINTS)
@examples(150)
def test_the_points_of_all_signals_are_those_of_the_definition(rule: Rule, z: list[float]) -> None:
    found = list(signals(z, [rule]))
    members = [
        [i for i in range(run.start, run.end + 1) if rule.kind is not RuleKind.BEYOND or run.side * z[i] > rule.limit]
        for run in found
    ]
    assert {(run.side, i) for run, points in zip(found, members, strict=True) for i in points} == expected(rule, z)
    for run, points in zip(found, members, strict=True):
        assert (run.start, run.end, run.points) == (points[0], points[-1], len(points))


@given(z=POINTS, cuts=st.lists(st.integers(1, 79), max_size=6))
@examples(150)
def test_pieces_give_what_the_whole_gives(z: list[float], cuts: list[int]) -> None:
    watching = Scan(RULES.values())
    edges = [0, *sorted({cut for cut in cuts if cut < len(z)}), len(z)]
    for start, end in pairwise(edges):
        watching.feed(z[start:end])
    assert list(watching.signals()) == list(signals(z, RULES.values()))


@given(z=POINTS, most=st.integers(0, 20))
@examples(100)
def test_the_newest_and_the_sides_are_those_of_the_runs_one_by_one(z: list[float], most: int) -> None:
    found = signals(z, RULES.values())
    runs = list(found)
    assert found.newest(most) == sorted(runs, key=lambda run: run.end)[len(runs) - min(most, len(runs)) :]
    sides = [9] * len(z)
    for run in runs:
        sides[run.start : run.end + 1] = [run.side] * (run.end + 1 - run.start)
    assert found.sides(9).tolist() == sides


@given(z=POINTS)
@examples(100)
def test_turned_over_they_change_sides_and_nothing_else(z: list[float]) -> None:
    def told(points: list[float], turn: int) -> set[tuple[str, int, int, int, int]]:
        return {(run.rule, turn * run.side, run.start, run.end, run.points) for run in signals(points, RULES.values())}

    assert told(z, 1) == told([-value for value in z], -1)


def test_the_compiled_loops_are_the_python_they_are_made_from() -> None:
    z = np.random.default_rng(3).normal(size=3000).round(1) * 1.5
    none = np.empty((0, 4), np.int64)
    for kind in range(1, 6):
        states = [np.zeros(scan.STATE, np.int64), np.zeros(scan.STATE, np.int64)]
        told = [
            function(z, 0, 0.0, kind, 4, 1.0, state, none)
            for function, state in zip((scan.equal_runs, plain(scan.equal_runs)), states, strict=True)
        ]
        assert len(told[0]) > 0
        assert np.array_equal(told[0], told[1])
        assert np.array_equal(states[0], states[1])
    states = [np.zeros(scan.STATE, np.int64), np.zeros(scan.STATE, np.int64)]
    told = [
        function(z, 0, 1, 5, 4, 1.0, state, none)
        for function, state in zip((scan.beyond_runs, plain(scan.beyond_runs)), states, strict=True)
    ]
    assert len(told[0]) > 0
    assert np.array_equal(told[0], told[1])


def test_a_rule_fires_at_the_last_of_its_points_and_goes_on_as_one_signal() -> None:
    for rule in NELSON:
        if rule.kind is RuleKind.TREND:
            pattern = [0.1 * i for i in range(rule.n)]
        elif rule.kind in {RuleKind.ALTERNATING, RuleKind.OUTSIDE}:
            pattern = [1.5 * (-1) ** i for i in range(rule.n)]
        elif rule.kind is RuleKind.BEYOND:
            pattern = [rule.limit + 0.5] * rule.k
        else:
            pattern = [0.5] * rule.n
        if len(pattern) > 1:
            assert not list(signals(pattern[:-1], [rule])), rule.name
        (run,) = signals(pattern, [rule])
        assert (run.start, run.end, run.points) == (0, len(pattern) - 1, len(pattern))


def test_a_point_on_the_limit_is_not_beyond_it_and_one_on_the_centre_on_no_side() -> None:
    assert not list(signals([3.0, -3.0], NELSON))
    assert [run.rule for run in signals([np.nextafter(3.0, 4.0)], NELSON)] == [RuleName.NELSON_1]
    assert not list(signals([0.1] * 8 + [0.0] + [0.1] * 8, [RULES[RuleName.NELSON_2]]))
    assert [run.rule for run in signals([1.0, -1.0] * 7 + [1.0], [RULES[RuleName.NELSON_7]])] == [RuleName.NELSON_7]


def test_every_signal_is_kept_when_several_rules_fire_on_one_point() -> None:
    found = list(signals([2.5, 2.5, 2.5, 3.5]))
    assert {run.rule for run in found} == {RuleName.NELSON_1, RuleName.NELSON_5, RuleName.NELSON_6}


@given(z=POINTS)
@examples(60)
def test_the_signals_of_a_cusum_are_its_points_beyond_the_limit(z: list[float]) -> None:
    chart = cusum(standard(0, 1), z, h=3.0)
    found = list(signals_of_cusum(chart))
    for side, sums in ((1, chart.above), (-1, chart.below)):
        flagged = {i for run in found if run.side == side for i in range(run.start, run.end + 1)}
        assert flagged == set(np.flatnonzero(sums > chart.limit).tolist())


def test_ranges_and_averages_know_no_rule_but_their_limits() -> None:
    assert set(FITTING) == set(Chart)
    for chart in set(Chart) - {Chart.INDIVIDUALS, Chart.XBAR}:
        assert FITTING[chart] == (RuleName.NELSON_1,)


@pytest.mark.parametrize("values", [[], [1.0, float("nan")], [float("inf")]])
def test_what_is_no_number_is_refused(values: list[float]) -> None:
    with pytest.raises(Refused) as refused:
        signals(values)
    assert refused.value.reason in {Reason.TOO_FEW_READINGS, Reason.NOT_FINITE}


@pytest.mark.parametrize(
    ("kind", "n", "k"),
    [(RuleKind.BEYOND, 3, 4), (RuleKind.SIDE, 0, 0), (RuleKind.TREND, 1, 1), (RuleKind.SIDE, 61, 61)],
)
def test_numbers_without_a_meaning_are_refused(kind: RuleKind, n: int, k: int) -> None:
    with pytest.raises(ValueError, match="no meaning"):
        Rule(RuleName.NELSON_1, kind, n, k, 1.0)


class TestChance:
    def test_runs_of_steps_have_the_lengths_that_combinatorics_gives(self) -> None:
        # No three in a row rise or fall: alternating orders, of which there are Euler's numbers: 2 (sec 1 + tan 1) - 2.
        trend = chance(Rule(RuleName.NELSON_3, RuleKind.TREND, 3, 3)).average_run_length
        assert trend == pytest.approx(2 * (1 / cos(1) + tan(1)) - 2, abs=1e-12)
        # No three in a row alternate: monotone orders, two of each length: 2e - 2.
        alternating = chance(Rule(RuleName.NELSON_4, RuleKind.ALTERNATING, 3, 3)).average_run_length
        assert alternating == pytest.approx(2 * e - 2, abs=1e-12)

    def test_runs_on_one_side_are_as_tosses_of_a_coin(self) -> None:
        assert average_run_length([RULES[RuleName.NELSON_2]]) == pytest.approx(2**9 - 1)

    @runs(20_000, 200_000)
    @pytest.mark.parametrize("rule", NELSON, ids=lambda rule: rule.name.value)
    def test_a_window_shows_a_pattern_as_often_as_it_is_counted(self, rule: Rule, runs: int) -> None:
        windows = np.random.default_rng(seed(11)).normal(size=(runs, rule.n))
        if rule.kind is RuleKind.BEYOND:
            beyond = [(side * windows > rule.limit).sum(axis=1) >= rule.k for side in (1, -1)]
            seen = float((beyond[0] | beyond[1]).mean())
        else:
            seen = float(np.mean([len(signals(window, [rule]).runs[rule.name]) > 0 for window in windows]))
        share = per_window(rule)
        assert seen == pytest.approx(share, abs=by_chance(share, runs))

    @runs(400, 5_000)
    @pytest.mark.parametrize("rule", [*NELSON[1:6], WESTERN_ELECTRIC[3]], ids=lambda rule: rule.name.value)
    def test_the_first_signal_comes_as_late_as_it_is_counted(self, rule: Rule, runs: int) -> None:
        random, firsts = np.random.default_rng(seed(5)), []
        for _ in range(runs):
            z = random.normal(size=12_000)
            rows = signals(z, [rule]).runs[rule.name]
            assert len(rows)
            # The run's first firing: with the n-th point of a plain run; of "k of n" with the k-th point beyond.
            start = rows[0, 1]
            if rule.kind is RuleKind.BEYOND:
                beyond = np.flatnonzero(rows[0, 0] * z[start:] > rule.limit)
                firsts.append(start + beyond[rule.k - 1] + 1)
            else:
                firsts.append(start + rule.n)
        length = chance(rule).average_run_length
        assert np.mean(firsts) == pytest.approx(length, rel=5 / runs**0.5)

    def test_the_reference_prints_what_is_computed(self) -> None:
        text = (HOUSE / "docs" / "reference" / "statistics.md").read_text(encoding="utf-8")
        printed = re.findall(r"^\| (Nelson|Western Electric) (\d).*\| ([\d.]+) % \| ([\d ]+)", text, re.MULTILINE)
        assert len(printed) == len(RULES)
        for family, number, share, length in printed:
            found = chance(RULES[RuleName(f"{family.split()[0].lower()}_{number}")])
            assert share == f"{100 * found.per_window:.2f}"
            assert int(length.replace(" ", "")) == round(found.average_run_length)
        assert f"every {average_run_length(WESTERN_ELECTRIC):.0f} points" in text

    def test_steps_with_others_and_too_many_rules_are_refused(self) -> None:
        with pytest.raises(Refused):
            average_run_length(NELSON)
        wide = [
            Rule(RuleName.NELSON_6, RuleKind.BEYOND, 30, 15, 0.5),
            Rule(RuleName.NELSON_5, RuleKind.BEYOND, 30, 15, 0.25),
        ]
        with pytest.raises(Refused):
            average_run_length(wide)
        assert average_run_length([]) == float("inf")
