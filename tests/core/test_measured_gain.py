"""The measured effect of corrections: planted ones are found again, though the loop is closed."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.compiled import plain
from app.core.decision.step import BELIEVED, CORRECT, step
from app.core.measured_gain import (
    FEWEST_CORRECTIONS,
    FEWEST_READINGS,
    LONGEST,
    Effect,
    _missed,
    _verdict,
    gain_of,
    measured_effect,
)
from app.core.replay import Policy, ReplayedCharacteristic, run, without_events
from app.core.spc.refusal import Reason, Refused
from tests.chance import runs
from tests.core.conftest import SEAT
from tests.core.tool_lives import rules_of

Values = NDArray[np.float64]
LIFE = 520


def loop(effect: float, delay: int, seed: int, count: int = 1500) -> tuple[Values, Values, NDArray[np.bool_]]:
    """Deviations, corrections in effect and beginnings of a shaft that wears, warms up, scatters, with single outliers."""
    chance, part = np.random.default_rng(seed), np.arange(count) % LIFE
    free = part * 0.00006 + 0.004 * (1 - np.exp(-part / 20)) + 0.006 * (1 - np.exp(-part / 40))
    free += chance.normal(0, 0.0008, count) + (chance.random(count) < 1 / 180) * 0.005
    trace = without_events(free.round(9))
    trace.marks[::LIFE] = 1
    begins = int((trace.marks > 0).sum())
    trace = trace._replace(offset=np.zeros(begins), pending=np.zeros(begins), averages=np.zeros((begins, 1)))
    course, _figures = run(trace, Policy((ReplayedCharacteristic(replace(SEAT, zero_range=0.002), effect),), delay))
    return course.deviation, course.offset, trace.marks > 0


@pytest.mark.parametrize("delay", [0, 2])
@pytest.mark.parametrize("effect", [1.0, 0.9, 0.6])
def test_a_planted_effect_is_found_again(effect: float, delay: int) -> None:
    found = []
    for seed in range(12):
        deviation, offset, begins = loop(effect, delay, seed)
        found.append(measured_effect(deviation, offset, -1.0, begins))
    assert np.mean([each.value for each in found]) == pytest.approx(effect, abs=0.03)
    assert sum(each.low <= effect <= each.high for each in found) >= 11
    assert max(each.high - each.low for each in found) < 0.25


def test_comparing_before_and_after_would_not_do() -> None:
    """Bias of the simple estimates: too large without the pipeline, because the loop follows scatter."""
    deviation, offset, begins = loop(0.8, 0, 1)
    steps = np.flatnonzero((np.diff(offset) != 0) & ~begins[1:])
    simple = np.polyfit(np.diff(offset)[steps], np.diff(deviation)[steps], 1)[0]
    assert simple > 0.9
    found = measured_effect(deviation, offset, -1.0, begins)
    assert found.high < 1.0
    assert not found.is_full


def test_an_edge_that_broke_does_not_change_it() -> None:
    deviation, offset, begins = loop(1.0, 2, 5)
    broken = deviation + np.where(np.arange(1500) >= 900, 0.05, 0.0)
    assert measured_effect(broken, offset, -1.0, begins).value == pytest.approx(1.0, abs=0.06)


@pytest.mark.parametrize("factor", [-0.5, 0.5, -2.0])
def test_the_factor_only_turns_offsets_into_sizes(factor: float) -> None:
    deviation, offset, begins = loop(0.9, 2, 7)
    expected = measured_effect(deviation, offset, -1.0, begins)
    found = measured_effect(deviation, -offset * factor, factor, begins)
    assert found == pytest.approx(expected)
    assert isinstance(found, Effect)


def test_it_is_the_same_in_any_unit_and_in_the_mirror() -> None:
    deviation, offset, begins = loop(0.9, 1, 9)
    expected = measured_effect(deviation, offset, -1.0, begins)
    for scale in (1000.0, -1.0):
        found = measured_effect(scale * deviation, scale * offset, -1.0, begins)
        assert found.value == pytest.approx(expected.value)
        assert found.low == pytest.approx(expected.low)


def test_only_the_newest_readings_are_looked_at() -> None:
    deviation, offset, begins = loop(0.9, 1, 9, count=LONGEST + 500)
    found = measured_effect(deviation, offset, -1.0, begins)
    assert found == measured_effect(deviation[500:], offset[500:], -1.0, begins[500:])
    assert found.readings == LONGEST


def test_what_does_not_carry_it_is_refused_with_what_is_missing() -> None:
    deviation, offset, begins = loop(1.0, 1, 2)
    with pytest.raises(Refused) as few:
        measured_effect(deviation[: FEWEST_READINGS - 1], offset[: FEWEST_READINGS - 1], -1.0, begins[:49])
    assert (few.value.reason, few.value.missing) == (Reason.TOO_FEW_READINGS, 1)
    with pytest.raises(Refused) as none:
        measured_effect(deviation, np.zeros(1500), -1.0, begins)
    assert (none.value.reason, none.value.missing) == (Reason.INCOMPLETE_STUDY, FEWEST_CORRECTIONS)
    steps = np.repeat(np.arange(20.0), 5) * 0.001
    with pytest.raises(Refused) as same:
        measured_effect(-steps, -steps, -1.0, np.arange(100) == 0)
    assert same.value.reason is Reason.NO_VARIATION


def test_the_compiled_filter_is_its_python() -> None:
    deviation, offset, begins = loop(0.9, 1, 3, count=300)
    arguments = (deviation * 1000, offset * 1000, begins, 0.01, 1e-4, 1.0, 4.5)
    for quick, slow in zip(_missed(*arguments), plain(_missed)(*arguments), strict=True):
        np.testing.assert_allclose(np.asarray(quick, float), np.asarray(slow, float), rtol=1e-12, atol=1e-12)


def test_a_filter_by_hand() -> None:
    # Variances 1 of scatter, level and slope: after 0 the second is foretold with 1 + 1 + 1 and pulls the level by 2/3, the
    # slope by 1/3; so 1 is foretold for the third, with (2/3 + 2/3 + 2/3) + 1.
    y = np.array([0.0, 1.0, 2.5])
    missed, _x, variance, used, _out = _missed(y, y, np.array([True, False, False]), 0.0, 0.0, 1.0, 4.5)
    assert used.tolist() == [False, False, True]
    assert missed[2] == pytest.approx(1.5)
    assert variance[2] == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("gain", "verdict"), [(-1.0, "opposite"), (0.0, "none"), (0.5, "weak"), (1.0, None), (2.0, "strong")]
)
def test_a_gain_is_found_from_few_corrections_whatever_it_is(gain: float, verdict: str | None) -> None:
    chance = np.random.default_rng(3)
    offset = np.array([0, 4, -3, 5, -4, 4], np.float64).repeat(5) * 0.001
    found = gain_of(chance.normal(0, 0.0003, 30) + np.arange(30) * 0.00005 + gain * offset, offset, -1.0)
    assert found is not None
    assert (found.verdict, found.corrections) == (verdict, 5)
    assert found.low < gain < found.high


@pytest.mark.parametrize(
    ("low", "high", "verdict"), [(-0.1, 0.4, "none"), (-0.1, 0.6, "weak"), (0.1, 0.4, "weak"), (-0.1, 0.8, None)]
)
def test_an_offset_is_said_to_be_unused_only_where_a_half_is_ruled_out(
    low: float, high: float, verdict: str | None
) -> None:
    assert _verdict(low, high) == verdict


def test_corrections_after_every_part_of_even_wear_tell_no_gain() -> None:
    """The offset moves as evenly as the wear: nobody can say which of them moved the size."""
    chance, offset = np.random.default_rng(6), -np.arange(60, dtype=np.float64) * 0.0003
    found = gain_of(chance.normal(0.0003, 0.0005, 60), offset, -1.0)
    assert found is None or found.verdict is None


def test_steps_of_the_process_are_no_corrections_without_effect() -> None:
    """Each step is corrected at once: the part after it looks as one after a chip does, whose correction did nothing."""
    deviation, offset, steps = [], [], np.arange(48) // 6 * 0.005
    sum_, chance = 0.0, np.random.default_rng(8)
    for shift in steps:
        deviation.append(shift + sum_ + chance.normal(0, 0.0003))
        offset.append(sum_)
        sum_ -= deviation[-1] if abs(deviation[-1]) > 0.001 else 0.0
    found = gain_of(np.array(deviation), np.array(offset), -1.0)
    assert found is None or found.verdict is None


def reported_at(gain: float, seed: int) -> int:
    """The part with which a gain is reported as strong in a loop of wear 0.2 µm a part and scatter 0.5 µm; 0 within sixty: never."""
    chance, rules = np.random.default_rng(seed), rules_of(0.001, 0.005, 2.0, -1.0)
    deviation, offset, average, total = list[float](), list[float](), 0.0, 0.0
    for part in range(60):
        offset.append(total)
        deviation.append(float(round(part * 0.0002 + gain * total + chance.normal(0, 0.0005), 7)))
        made = step(rules, average, total, deviation[-1], 0.0, False, False, False, False, BELIEVED)
        average, total = made.average, total + (made.amount if made.action == CORRECT else 0.0)
        if part % 6 == 5 and (found := gain_of(np.array(deviation), np.array(offset), -1.0)) and found.verdict:
            assert found.verdict == "strong"
            return part + 1
    return 0


@runs(6, 60)
def test_a_radius_taken_for_a_diameter_is_reported_within_sixty_parts(runs: int) -> None:
    assert sum(reported_at(2.0, seed) > 0 for seed in range(runs)) >= 0.6 * runs
    assert [reported_at(gain, seed) for gain in (1.0, 1.3) for seed in range(runs)] == [0] * 2 * runs


def test_of_too_few_no_gain_is_named() -> None:
    assert gain_of(np.zeros(30), np.array([0, 0.001, 0.002]).repeat(10), -1.0) is None
    assert gain_of(np.zeros(0), np.zeros(0), -1.0) is None
