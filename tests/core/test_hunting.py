"""Corrections that scatter alone causes, compared with the rules run on simulated scatter."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest

from app.core.decision.decide import LoopState as Loop
from app.core.decision.decide import decide
from app.core.hunting import (
    ALARM,
    FEWEST,
    GOAL,
    Hunting,
    LoopVerdict,
    ScatterCorrections,
    Settings,
    corrections_by_scatter,
    judge,
    least_remedy,
)
from app.core.parameters import Parameters
from tests.chance import by_chance, runs, seed

SIGMA = 0.001  # mm


def corrections(settings: Settings, readings: int, seed: int, drift: float = 0.0, gain: float = 1.0) -> list[float]:
    """The size errors that the loop removes while the process only scatters, and wears by `drift` per part.

    gain: what a correction changes the size by, over what it should.
    """
    parameters = Parameters(
        target=0.0,
        tolerance_width=max(2.2 * settings.averaging_limit, 8 * SIGMA),
        zero_range=settings.zero_range,
        averaging_limit=settings.averaging_limit,
        wear_limit=0.3,
        confidence_limit=1.0,
        weighting_factor=settings.weighting_factor,
        factor=-1,
        tool_memory=1,
        average_memory=1 if settings.memory else 0,
    )
    scatter = np.random.default_rng(seed).normal(0.0, SIGMA, readings)
    mean, loop, removed = 0.0, Loop(), []
    for part, error in enumerate(scatter):
        decision = decide(parameters, loop, round(mean + drift * part + float(error), 9))
        loop = Loop(decision.average_after)
        if decision.size_error is not None:
            mean -= gain * decision.size_error
            removed.append(decision.size_error)
    return removed


def reversals(sizes: Sequence[float]) -> int:
    return sum((one > 0) != (other > 0) for one, other in pairwise(sizes))


CASES = [
    Settings(0.0, 0.005, 1.0),
    Settings(0.0, 0.005, 2.0),
    Settings(0.001, 0.0053, 2.0),
    Settings(0.0015, 0.004, 1.5),
    Settings(0.0005, 0.003, 3.0),
    Settings(0.0015, 0.002, 1.0),
    Settings(0.0002, 0.002, 4.0),
    Settings(0.001, 0.003, 2.0, memory=False),
]


@pytest.mark.parametrize("settings", CASES, ids=str)
def test_the_theory_says_what_the_rules_do(settings: Settings) -> None:
    readings = 40_000
    sizes = corrections(settings, readings, seed=3)
    told = corrections_by_scatter(settings, SIGMA)
    assert told.corrections == pytest.approx(len(sizes) / readings, rel=0.06)
    assert told.reversals == pytest.approx(reversals(sizes) / readings, rel=0.07)
    assert told.size == pytest.approx(np.abs(sizes).mean(), rel=0.04)


def test_corrected_in_full_after_every_part_by_hand() -> None:
    """k = 1, R33 = 0: mu = -e of the part before, so y = e' - e: twice the variance, neighbours correlated by -1/2,
    which change sign with probability arccos(-1/2)/pi = 2/3; mean size 2 sigma / sqrt(pi)."""
    told = corrections_by_scatter(Settings(0.0, 1.0, 1.0), SIGMA)
    assert told == pytest.approx(ScatterCorrections(1.0, 2 / 3, 2 * SIGMA / np.sqrt(np.pi), np.sqrt(2) - 1), rel=0.005)


def test_a_third_of_a_micrometre_of_scatter_and_one_of_a_millimetre_are_the_same_question() -> None:
    small, large = (corrections_by_scatter(Settings(1.2 * s, 5 * s, 2.0), s) for s in (0.0003, 1.0))
    assert small.corrections == pytest.approx(large.corrections)
    assert small.size / 0.0003 == pytest.approx(large.size)


def test_no_scatter_no_hunting() -> None:
    assert corrections_by_scatter(Settings(0.0, 0.005, 1.0), 0.0).corrections == 0
    assert judge([0.001, -0.001] * 30, 60, 0.0, Settings(0.0, 0.005, 1.0)).state is LoopVerdict.UNKNOWN


# --- the test


def verdict(settings: Settings, readings: int, seed: int, **more: float) -> Hunting:
    return judge(corrections(settings, readings, seed, **more), readings, SIGMA, settings)


@pytest.mark.parametrize("readings", [20, 50, 200])
@pytest.mark.parametrize("drift", [0.0, 0.0002])
def test_sensible_settings_never_alarm(readings: int, drift: float) -> None:
    """R33 of two and a half standard deviations, k = 2: in control and wearing, four hundred looks."""
    settings = Settings(0.0025, 0.006, 2.0)
    assert all(verdict(settings, readings, seed, drift=drift).state is LoopVerdict.QUIET for seed in range(200))


@runs(150, 1_500)
def test_at_the_boundary_a_false_alarm_is_as_rare_as_stated(runs: int) -> None:
    """Scatter alone takes back 1 in 10 readings (k = 4, R33 = half a standard deviation; and k = 1.2, R33 = 1.85 of them)."""
    for settings in (Settings(0.00052, 0.006, 4.0), Settings(0.00185, 0.007, 1.2)):
        assert corrections_by_scatter(settings, SIGMA).reversals == pytest.approx(0.1, abs=0.015)
        for readings in (20, 60, 200):
            first = seed(0)
            found = [verdict(settings, readings, first + run).state for run in range(runs)]
            assert sum(each is not LoopVerdict.QUIET for each in found) / runs <= ALARM + by_chance(ALARM, runs)


def test_corrected_after_every_part_it_is_found_within_thirty() -> None:
    settings = Settings(0.0, 0.005, 1.0)
    found = [verdict(settings, 30, seed) for seed in range(300)]
    assert sum(each.state is LoopVerdict.HUNTING for each in found) >= 297
    assert verdict(settings, FEWEST - 1, 1).state is LoopVerdict.UNKNOWN


@pytest.mark.parametrize("settings", [Settings(0.0005, 0.005, 1.0), Settings(0.0003, 0.004, 2.0)], ids=str)
def test_far_too_narrow_it_is_found_within_two_hundred_while_it_wears(settings: Settings) -> None:
    found = [verdict(settings, 200, seed, drift=0.00005) for seed in range(100)]
    assert sum(each.state is LoopVerdict.HUNTING for each in found) >= 97


def test_wear_is_no_hunting_however_often_it_is_corrected() -> None:
    settings = Settings(0.0, 0.005, 1.0)
    sizes = corrections(settings, 200, seed=1, drift=0.004)
    assert len(sizes) > 190
    assert judge(sizes, 200, SIGMA, settings).state is LoopVerdict.QUIET


def test_swinging_that_scatter_does_not_explain_is_called_so() -> None:
    """The offset acts nearly twice as far as the factor says: each correction overshoots, whatever R33 is."""
    settings = Settings(0.0035, 0.008, 1.0)
    found = verdict(settings, 200, seed=1, drift=0.0004, gain=1.95)
    assert found.expected is not None
    assert found.expected.reversals < 0.02
    assert found.state is LoopVerdict.SWINGING
    assert found.remedy is None


# --- by how much


@pytest.mark.parametrize("settings", [Settings(0.0, 0.006, 3.0), Settings(0.001, 0.0053, 2.0)], ids=str)
def test_the_suggested_r33_does_and_a_tenth_of_a_micrometre_less_does_not(settings: Settings) -> None:
    remedy = least_remedy(settings, SIGMA)
    assert remedy.zero_range is not None
    assert corrections_by_scatter(settings._replace(zero_range=remedy.zero_range), SIGMA).corrections <= GOAL
    assert corrections_by_scatter(settings._replace(zero_range=remedy.zero_range - 0.0001), SIGMA).corrections > GOAL
    readings = 40_000
    simulated = len(corrections(settings._replace(zero_range=remedy.zero_range), readings, seed=5)) / readings
    assert simulated == pytest.approx(GOAL, rel=0.35)  # rare, and in bursts


def test_the_suggested_k_does_and_half_less_does_not() -> None:
    settings = Settings(0.00125, 0.0066, 2.0)
    k = least_remedy(settings, SIGMA).weighting_factor
    assert k == 4.0
    assert corrections_by_scatter(settings._replace(weighting_factor=k), SIGMA).corrections <= GOAL
    assert corrections_by_scatter(settings._replace(weighting_factor=k - 0.5), SIGMA).corrections > GOAL


def test_no_k_helps_where_r33_is_zero() -> None:
    assert least_remedy(Settings(0.0, 0.006, 1.0), SIGMA).weighting_factor is None


def test_where_r34_is_too_near_both_are_suggested_together() -> None:
    settings = Settings(0.0005, 0.002, 1.0)  # one reading in twenty lies beyond R34 and is corrected in full
    remedy = least_remedy(settings, SIGMA)
    assert remedy.weighting_factor is None
    assert remedy.averaging_limit is not None
    assert remedy.zero_range is not None
    assert 0.002 < remedy.averaging_limit < 0.005
    assert remedy.zero_range < remedy.averaging_limit
    wider = settings._replace(zero_range=remedy.zero_range, averaging_limit=remedy.averaging_limit)
    assert corrections_by_scatter(wider, SIGMA).corrections <= GOAL


def test_r33_is_never_suggested_below_the_signal_path() -> None:
    settings = Settings(0.0, 0.006, 2.0)
    free, bound = least_remedy(settings, SIGMA), least_remedy(settings, SIGMA, floor=0.0031)
    assert free.zero_range is not None
    assert free.zero_range < 0.0031
    assert bound.zero_range == 0.0031
