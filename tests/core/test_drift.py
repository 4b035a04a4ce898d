"""Drift by temperature, warming up and wear: each is found again beside the others, and unknown temperatures count for nothing."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.drift import Column, Drift, drift, since_pause, usual_pause
from app.core.regression import LeftOut


def days(
    seed: int, count: int = 400, *, per_kelvin: float = 0.0009, warming: float = 0.0002, wear: float = 0.00003
) -> Any:
    """Readings every two minutes, a night after every hundred; two tools; mm."""
    rng = np.random.default_rng(seed)
    sequence = np.arange(1, count + 1)
    minutes = sequence * 2.0 + (sequence - 1) // 100 * 900
    edge = (sequence > count * 0.55).astype(np.int64)
    temperature = 22 + 3 * np.sin(sequence / 37) + rng.normal(size=count) / 5
    worn = (
        per_kelvin * temperature
        + warming * np.minimum((sequence - 1) % 100, 20)
        + wear * sequence
        + 0.02 * edge
        + rng.normal(size=count) * 0.0005
    )
    return sequence, worn, edge, minutes, temperature


def effect(found: Drift, column: Column) -> Any:
    return found.regression.effects[column.value]


@given(st.integers(0, 2**32 - 1))
def test_each_is_found_beside_the_others(seed: int) -> None:
    found = drift(*days(seed))
    assert found.pauses == 4
    for column, true in (
        (Column.TEMPERATURE, 0.0009),
        (Column.SINCE_PAUSE, 0.0002),
        (Column.WEAR, 0.00003),
    ):
        assert effect(found, column).value == pytest.approx(true, abs=6 * effect(found, column).standard_error)
        assert effect(found, column).significant
    slope = float(np.polyfit(found.temperature, found.apart, 1)[0])
    assert slope == pytest.approx(0.0009, rel=0.2), "what is drawn has the slope that is stated"


@given(st.integers(0, 2**32 - 1), st.sampled_from([-300.0, 900.0, 3276.7, np.nan]))
def test_temperatures_that_cannot_be_true_count_for_nothing(seed: int, wrong: float) -> None:
    sequence, worn, edge, minutes, temperature = days(seed, 120)
    broken = temperature.copy()
    broken[::7] = wrong
    stated = ~np.isin(np.arange(120), np.arange(120)[::7])
    found = drift(sequence, worn, edge, minutes, broken)
    assert found.regression.readings == stated.sum()
    assert found.unbelieved == (0 if np.isnan(wrong) else (~stated).sum())
    assert found.sequence.tolist() == sequence[stated].tolist()


def test_a_machine_that_never_pauses_is_warm() -> None:
    sequence, worn, edge, minutes, temperature = days(3, 90)
    found = drift(sequence + 100, worn, edge, minutes, temperature)
    assert (found.pauses, found.regression.left_out) == (0, {Column.SINCE_PAUSE.value: LeftOut.CONSTANT})


def test_a_temperature_that_stays_has_no_effect() -> None:
    sequence, worn, edge, minutes, temperature = days(3, 90)
    found = drift(sequence, worn, edge, minutes, np.full_like(temperature, 21.0))
    assert found.regression.left_out == {Column.TEMPERATURE.value: LeftOut.CONSTANT}


def test_a_temperature_that_rises_with_the_wear_is_hard_to_tell_from_it() -> None:
    rng = np.random.default_rng(5)
    sequence = np.arange(1, 61)
    temperature = 20 + sequence / 10 + rng.normal(size=60) / 20
    worn = 0.001 * temperature + rng.normal(size=60) * 0.001
    found = drift(sequence, worn, np.zeros(60, np.int64), 3 * sequence.astype(np.float64), temperature)
    assert effect(found, Column.TEMPERATURE).inflated
    assert effect(found, Column.WEAR).inflated


@given(st.lists(st.floats(0.1, 200), min_size=1, max_size=60), st.integers(1, 5000), st.integers(1, 40))
def test_parts_since_the_pause(gaps: list[float], first: int, warm_up: int) -> None:
    minutes = np.concatenate(([0.0], np.cumsum(gaps)))
    sequence = np.arange(first, first + len(minutes))
    pause = usual_pause(minutes)
    parts, pauses = since_pause(sequence, minutes, pause, warm_up)
    expected, here = [], 0 if first == 1 else warm_up
    for at in range(len(minutes)):
        here = 0 if at and minutes[at] - minutes[at - 1] >= pause else here + (at > 0)
        expected.append(min(here, warm_up))
    assert parts.tolist() == expected
    assert pauses == (first == 1) + int((np.diff(minutes) >= pause).sum())


def test_a_reading_that_came_late_is_no_pause() -> None:
    parts, pauses = since_pause(np.arange(2, 6), np.array([100.0, 101.0, 20.0, 102.0]), 10.0)
    assert (parts.tolist(), pauses) == ([20.0] * 4, 0)


def test_parts_that_are_left_out_make_no_pause() -> None:
    sequence, worn, edge, minutes, temperature = days(1)
    kept = np.ones(len(sequence), np.bool_)
    kept[240:252] = False  # faults of the probe, for 24 minutes
    some = (sequence[kept], worn[kept], edge[kept], minutes[kept], temperature[kept])
    assert drift(*some).pauses == 5
    assert drift(*some, cut=(sequence, minutes)).pauses == 4


def test_a_clock_that_ran_ahead_once_hides_no_pause() -> None:
    sequence, worn, edge, minutes, temperature = days(2)
    minutes[150] += 60 * 24 * 30
    assert drift(sequence, worn, edge, minutes, temperature).pauses == 4


def test_wear_of_a_first_run_up_is_not_taken_for_warming_up() -> None:
    """Parts since the pause and parts are the same then: nobody can say which it is."""
    rng, sequence = np.random.default_rng(3), np.arange(1, 21)
    temperature = 22 + rng.normal(size=20)
    worn = 0.0001 * sequence + 0.001 * temperature + rng.normal(size=20) * 0.0001
    found = drift(sequence, worn, np.zeros(20, np.int64), (sequence * 2.0).astype(np.float64), temperature).regression
    assert set(found.effects) == {Column.TEMPERATURE.value}
    assert found.effects[Column.TEMPERATURE.value].value == pytest.approx(0.001, rel=0.2)
    assert found.left_out == {
        Column.SINCE_PAUSE.value: LeftOut.DETERMINED,
        Column.WEAR.value: LeftOut.DETERMINED,
    }
