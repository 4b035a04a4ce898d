"""Rules watching a chart while points come in: in pieces as in one, forgetting nothing and repeating nothing."""

import json
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.spc.cusum import cusum
from app.core.spc.ewma import ewma, moving_average
from app.core.spc.points import ChartSettings, Piece
from app.core.spc.rules import FITTING, RULES, RuleName, signals_of, signals_of_cusum
from app.core.spc.shewhart import Chart, ControlChart, individuals, moving_ranges
from app.core.spc.shewhart import given as standard
from app.core.spc.watch import SignalSpan, Watch
from tests.chance import examples

UNIT = standard(0.0, 1.0)
# Of quarters sums are exact; of tenths they are not, and a point on the limit stays there only if it is summed up alike.
POINTS = st.sampled_from([4, 10]).flatmap(
    lambda parts: st.lists(st.integers(-14, 14).map(lambda each: each / parts), min_size=2, max_size=80)
)
CHARTS = [Chart.INDIVIDUALS, Chart.MOVING_RANGE, Chart.EWMA, Chart.MOVING_AVERAGE, Chart.CUSUM]


def drawn(chart: Chart) -> ChartSettings:
    return ChartSettings(chart, width=1.5, span=4, limit=3.0, headstart=1.0)  # narrow: signals come often


def piece(z: list[float], start: int = 1, begins: frozenset[int] = frozenset()) -> Piece:
    at = np.arange(start, start + len(z)) * 3  # readings between them are excluded
    return Piece([np.array(z, np.float64)], at - 1, at, np.isin(at, list(begins)))


def final(found: list[SignalSpan]) -> set[SignalSpan]:
    """Signals that are left when each signal is reported again as it grows."""
    return set({(each.rule, each.side, each.first): each for each in found}.values())


@pytest.mark.parametrize("chart", CHARTS)
@given(z=POINTS, cuts=st.lists(st.integers(1, 79), max_size=6), begins=st.frozensets(st.integers(1, 80), max_size=3))
@examples(60)
def test_pieces_give_what_the_whole_gives(
    chart: Chart, z: list[float], cuts: list[int], begins: frozenset[int]
) -> None:
    since = {name: 30 * (number % 3) for number, name in enumerate(FITTING[chart])}
    places = frozenset(3 * place for place in begins)
    whole = Watch(drawn(chart), since).feed(piece(z, begins=places))
    found, memory = [], None
    for start, end in pairwise([0, *sorted({cut for cut in cuts if cut < len(z)}), len(z)]):
        watch = Watch(drawn(chart), since, memory)
        found += watch.feed(piece(z[start:end], start + 1, places))
        memory = json.loads(json.dumps(watch.memory()))
    assert final(found) == final(whole)
    assert len(whole) == len(final(whole))


@pytest.mark.parametrize("chart", [Chart.EWMA, Chart.MOVING_AVERAGE, Chart.CUSUM])
def test_a_point_on_the_limit_is_the_same_wherever_a_piece_ends(chart: Chart) -> None:
    """0.8 + 0.8 + 0.8 + 0.6 is 3.0 or the next double: a mean on its limit of 0.75, and a sum on h = 3, by turns."""
    z = [0.1, 0.7, 0.3, -1.1, *([0.8, 0.8, 0.8, 0.6, -0.9, 0.3] * 12)]
    since = {RuleName.NELSON_1: 0}
    whole = Watch(drawn(chart), since).feed(piece(z))
    for length in (1, 3, 4, 5, 7):
        found, memory = [], None
        for start in range(0, len(z), length):
            watch = Watch(drawn(chart), since, memory)
            found += watch.feed(piece(z[start : start + length], start + 1))
            memory = json.loads(json.dumps(watch.memory()))
        assert final(found) == final(whole), length


@given(z=POINTS)
@examples(60)
def test_what_is_found_are_the_signals_of_the_chart(z: list[float]) -> None:
    unit = standard(0.0, 1.0, 1.5)
    charts: list[ControlChart] = [
        individuals(unit, z),
        moving_ranges(unit, z),
        ewma(unit, z),
        moving_average(unit, z, 4),
    ]
    for chart in charts:
        found = Watch(drawn(chart.chart), dict.fromkeys(FITTING[chart.chart], 0)).feed(piece(z))
        shift = 1 if chart.chart is Chart.MOVING_RANGE else 0
        told = {(e.rule, e.side, e.first // 3 + 1, e.last // 3, e.points) for e in found}
        assert told == {
            (run.rule, run.side, run.start + 1, run.end + 1 + shift, run.points)
            for run in signals_of(chart, RULES.values())
        }
    sums = signals_of_cusum(cusum(UNIT, z, h=3.0, headstart=1.0))
    found = Watch(drawn(Chart.CUSUM), {RuleName.NELSON_1: 0}).feed(piece(z))
    assert {(e.side, e.first // 3, e.last // 3 - 1) for e in found} == {(r.side, r.start, r.end) for r in sums}


def test_a_rule_tells_nothing_of_what_lies_before_it() -> None:
    watch = Watch(ChartSettings(Chart.INDIVIDUALS), {RuleName.NELSON_1: 9, RuleName.NELSON_2: 12})
    assert watch.feed(piece([4.0, 4.0, 4.0])) == []  # readings 3, 6, 9
    assert watch.feed(piece([4.0] * 9, 4)) == [SignalSpan(RuleName.NELSON_1, 1, 11, 36, 9)]
    (longer, second) = watch.feed(piece([4.0], 13))
    assert (longer.first, longer.points) == (11, 10)
    assert second == SignalSpan(RuleName.NELSON_2, 1, 14, 39, 9)


def test_a_range_over_a_change_of_tool_is_none() -> None:
    ranges = {RuleName.NELSON_1: 0}
    assert Watch(ChartSettings(Chart.MOVING_RANGE), ranges).feed(piece([0.0, 6.0], begins=frozenset({6}))) == []
    assert Watch(ChartSettings(Chart.MOVING_RANGE), ranges).feed(piece([0.0, 6.0])) == [
        SignalSpan(RuleName.NELSON_1, 1, 2, 6, 1)
    ]
    apart = Watch(ChartSettings(Chart.MOVING_RANGE), ranges)
    assert apart.feed(piece([0.0])) == []
    assert apart.feed(piece([6.0], 2, frozenset({6}))) == []


def test_the_memory_stays_small() -> None:
    rng = np.random.default_rng(7)
    watch = Watch(drawn(Chart.INDIVIDUALS), dict.fromkeys(FITTING[Chart.INDIVIDUALS], 0))
    found = []
    for start in range(1, 4_000, 50):
        found += watch.feed(piece(rng.normal(size=50).tolist(), start))
    assert len(final(found)) > 300
    assert len(json.dumps(watch.memory())) < 6_000


def test_rules_that_do_not_fit_the_chart_are_left_out() -> None:
    watch = Watch(ChartSettings(Chart.EWMA), dict.fromkeys(RuleName, 0))
    assert {each.rule for each in watch.feed(piece([2.0] * 40))} == {RuleName.NELSON_1}


@pytest.mark.parametrize("chart", CHARTS)
def test_a_hundred_thousand_points_in_chunks_give_what_one_chunk_gives(chart: Chart) -> None:
    z = np.random.default_rng(19).normal(size=100_000)
    at = np.arange(1, len(z) + 1)
    rules = dict.fromkeys(FITTING[chart], 0)
    whole = Watch(drawn(chart), rules).feed(Piece([z], at, at, at < 0))
    watch, found = Watch(drawn(chart), rules), []
    for first in range(0, len(z), 9_973):
        part = slice(first, first + 9_973)
        found += watch.feed(Piece([z[part]], at[part], at[part], at[part] < 0))
        watch = Watch(drawn(chart), rules, json.loads(json.dumps(watch.memory())))
    assert len(whole) > 100
    assert final(found) == final(whole)
