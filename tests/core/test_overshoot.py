"""The guard against corrections that act twice as strongly as they ask: few parts out of tolerance, and never a false pause."""

from statistics import mean

import numpy as np
import pytest

from app.core.opposite_effect import expected_scatter
from tests.chance import runs
from tests.core.tool_lives import SETTINGS, STRONG, Life, life, lives, rules_of

ZERO, AVERAGING, HALF, SCATTER, WEAR = 0.001, 0.0053, 0.008, 0.0003, 0.0005
"""R33, R34, half the tolerance, the scatter and the wear of a part on the machine with six tools, mm."""
PARTS = 30


def cut(gain: float, first: float, k: float, seed: int) -> Life:
    """Thirty parts of one tool, the first of which is so far off, mm."""
    of = np.zeros(1, SETTINGS)[0]
    of["sigma"], of["gain"], of["setting"], of["wear"] = SCATTER, gain, first / SCATTER, WEAR / SCATTER
    of["tau"], of["grid"], of["half"], of["expected"] = 1, 1e-6, HALF, expected_scatter(ZERO, AVERAGING)
    of["changed"] = of["edited"] = of["wrong_from"] = 10_000
    of["parts"], of["seed"] = PARTS, seed
    return Life(*life(rules_of(ZERO, AVERAGING, k, -1.0), of, 3 * SCATTER))


@runs(2_000, 100_000)
def test_no_tool_whose_corrections_act_is_ever_paused(runs: int) -> None:
    """Of gains of 0.7 to 1.3, where the tolerance is as wide as R34 up to twice that: in half of the lives parts are out of it."""
    found = lives(runs, 29)
    assert sum(each.out > 0 for each in found) > runs / 2
    assert [each for each in found if each.paused] == []


@pytest.mark.parametrize(("first", "out"), [(0.003, 1.5), (0.006, 1.5), (0.010, 8), (0.015, 7.5)])
@pytest.mark.parametrize("k", [1, 2, 4])
def test_a_radius_taken_for_a_diameter_costs_few_parts(k: float, first: float, out: float) -> None:
    found = [cut(2.0, first, k, seed) for seed in range(60)]
    assert mean(each.out for each in found) <= out
    assert max(each.out for each in found) <= 7
    assert all(each.paused == STRONG for each in found if each.out > 5)


@pytest.mark.parametrize("first", [0.006, 0.010, 0.015])
def test_three_times_as_strong_is_stopped_before_it_runs_away(first: float) -> None:
    found = [cut(3.0, first, 2, seed) for seed in range(60)]
    assert {each.paused for each in found} == {STRONG}
    assert max(each.parts for each in found) <= 5


@pytest.mark.parametrize("gain", [1.0, 1.3, 1.5, 1.6])
@pytest.mark.parametrize("first", [0.006, 0.015])
def test_a_swing_that_ends_by_itself_pauses_nothing(gain: float, first: float) -> None:
    found = [cut(gain, first, k, seed) for k in (1, 2, 4) for seed in range(60)]
    assert {each.paused for each in found} == {0}
    assert max(each.out for each in found) <= 2


def test_a_swing_within_the_tolerance_pauses_nothing() -> None:
    assert {life.paused for life in (cut(2.0, 0.004, 1, seed) for seed in range(60)) if life.out == 0} == {0}
