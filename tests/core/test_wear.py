"""The wear curve and the line through it, by hand and against planted wear."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.forecast import forecast
from app.core.wear import (
    FEWEST,
    LONGEST,
    Fit,
    Step,
    Values,
    fit,
    joined,
    outliers,
    scatter_of,
    wear,
)
from tests.chance import by_chance, runs, seed


def line(count: int, slope: float, scatter: float, seed: int, level: float = 0.0, rho: float = 0.0) -> Values:
    noise = np.random.default_rng(seed).normal(0.0, scatter, count)
    for at in range(1, count if rho else 0):
        noise[at] = rho * noise[at - 1] + np.sqrt(1 - rho**2) * noise[at]
    values: Values = level + slope * np.arange(count) + noise
    return values


def fitted(curve: Values) -> Fit:
    found = fit(np.arange(1, len(curve) + 1), curve)
    assert found is not None
    return found


# --- the curve


@pytest.mark.parametrize("factor", [-1.0, -0.5, 0.5])
def test_a_correction_does_not_show_in_the_curve(factor: float) -> None:
    """A part is 7 µm too large; the correction factor x 7 µm takes it to 0: the curve stays at 7 µm."""
    assert wear(np.array([0.007, 0.0]), np.array([0.0, factor * 0.007]), factor) == pytest.approx([0.007, 0.007])


def test_an_edit_that_moved_the_parts_is_taken_out_and_one_that_only_reported_is_not() -> None:
    sequence = np.arange(1, 21)
    flat = np.full(20, 0.001)
    moved = flat - 0.25 * (sequence >= 11)  # 0.25 mm typed in, factor -1: the parts came out 0.25 smaller
    curve, lifted = joined(sequence, moved, [Step(11, 0.25)])
    assert curve == pytest.approx(flat)
    assert lifted == 0.25
    curve, lifted = joined(sequence, flat, [Step(11, 0.25)])  # only the true offset was told
    assert curve == pytest.approx(flat)
    assert lifted == 0


def test_a_step_before_or_after_all_readings_changes_nothing() -> None:
    sequence, curve = np.arange(5, 15), np.zeros(10)
    for at in (1, 5, 15, 99):
        made, lifted = joined(sequence, curve, [Step(at, -1.0)])
        assert lifted == 0
        assert made == pytest.approx(curve)


def test_steps_add_up() -> None:
    sequence = np.arange(1, 31)
    curve = 0.0 - 0.1 * (sequence >= 11) + 0.03 * (sequence >= 21)
    made, lifted = joined(sequence, curve, [Step(21, -0.03), Step(11, 0.1)])
    assert made == pytest.approx(np.zeros(30))
    assert lifted == pytest.approx(0.07)


# --- scatter and outliers


def test_scatter_does_not_count_wear_steps_or_chips() -> None:
    curve = line(400, 0.0001, 0.001, seed=2)
    curve[200:] += 0.3
    curve[50] += 0.02
    assert scatter_of(curve) == pytest.approx(0.001, rel=0.1)
    assert scatter_of(np.zeros(1)) == 0.0


def test_scatter_is_reported_rounded_sizes_too() -> None:
    rounded = np.round(line(4000, 0.0, 0.0008, seed=1), 3)
    assert scatter_of(rounded) == pytest.approx(np.sqrt(0.0008**2 + 0.001**2 / 12), rel=0.08)


def test_a_chip_under_the_stylus_is_an_outlier_and_a_step_is_none() -> None:
    curve = line(100, 0.0, 0.001, seed=4)
    curve[40] += 0.009
    curve[70:] += 0.009
    assert np.flatnonzero(outliers(curve)).tolist() == [40]


def test_wear_without_scatter_has_no_outliers() -> None:
    assert not outliers(line(50, 0.0001, 0.0, seed=1)).any()


# --- the line


def test_the_line_is_that_of_the_textbook() -> None:
    """w = 1, 2, 4 … by the formulas of simple regression, worked out apart from the code."""
    y = np.array([0.0, 1, 3, 2, 4, 6, 5, 7, 9, 8, 10, 12]) / 1000
    found = fitted(y)
    slope, intercept = np.polyfit(np.arange(1, 13), y, 1)
    residual = y - intercept - slope * np.arange(1, 13)
    scatter = np.sqrt((residual**2).sum() / 10)
    assert found.slope == pytest.approx(slope)
    assert found.level == pytest.approx(intercept + 12 * slope)
    assert found.scatter == pytest.approx(scatter)
    assert found.correlation == 0.0  # neighbours scatter against each other
    assert found.slope_error == pytest.approx(scatter / np.sqrt(143))  # sum of squares of 1 … 12 about its mean
    assert found.level_error == pytest.approx(scatter * np.sqrt(1 / 12 + 5.5**2 / 143))
    assert found.quantile == pytest.approx(2.228, abs=0.001)  # t, 10 degrees of freedom


def test_too_few_readings_make_no_line() -> None:
    assert fit(np.arange(FEWEST - 1), np.zeros(FEWEST - 1)) is None


def test_gaps_count_as_parts() -> None:
    """Excluded readings and parts of the tool before leave gaps; the parts were cut all the same."""
    sequence = np.arange(1, 101)
    keep = sequence % 3 != 0
    found = fit(sequence[keep], (0.0002 * sequence)[keep])
    assert found is not None
    assert found.slope == pytest.approx(0.0002)


@runs(150, 2_000)
@pytest.mark.parametrize("count", [20, 60, 200, LONGEST])
@pytest.mark.parametrize("rho", [0.0, 0.4])
def test_the_interval_of_the_slope_holds_the_planted_wear_nineteen_times_in_twenty(
    count: int, rho: float, runs: int
) -> None:
    first = seed(0)
    made = [fit(np.arange(1, count + 1), line(count, 0.00005, 0.001, first + run, rho=rho)) for run in range(runs)]
    found = [each.slope_interval for each in made if each]  # few autocorrelated readings may look like two lines
    assert len(found) > 0.98 * runs
    share = 0.93 if rho else 0.95  # they say less, too
    assert sum(low <= 0.00005 <= high for low, high in found) / len(found) >= share - by_chance(share, runs)


def test_run_in_and_chips_end_the_past() -> None:
    parts = np.arange(400)
    run_in = 0.02 * (1 - np.exp(-parts / 20)) + line(400, 0.00005, 0.0005, seed=1)
    assert fitted(run_in).slope == pytest.approx(0.00005, rel=0.1)
    chipped = line(400, 0.00005, 0.0005, seed=1)
    chipped[330:] += 0.01
    found = fitted(chipped)
    assert found.first > 320
    assert abs(found.slope - 0.00005) < 4 * found.slope_error


def test_an_edge_that_breaks_bends_no_line_and_predicts_nothing() -> None:
    curve = line(100, 0.0001, 0.0005, seed=1)
    curve[-3:] += 0.4
    found = fitted(curve)
    assert (found.off, found.last, found.count) == (3, 100, 97)
    assert found.slope == pytest.approx(0.0001, rel=0.05)
    assert forecast(found, 0.3) is None
    curve[-20:-3] += 0.4  # twenty readings beyond it are the new line
    found = fitted(curve)
    assert found.off == 0


def test_one_line_is_rarely_taken_for_two() -> None:
    whole = [fitted(line(200, 0.00005, 0.001, seed)) for seed in range(300)]
    assert sum(found.first > 1 for found in whole) <= 3


def test_outliers_are_left_out_and_counted() -> None:
    curve = line(100, 0.0001, 0.0005, seed=6)
    curve[[30, 60]] += 0.02
    found = fitted(curve)
    assert (found.count, found.left_out) == (98, 2)
    assert found.slope == pytest.approx(0.0001, rel=0.1)


def test_readings_that_are_all_the_same_are_no_wear() -> None:
    """A hundred times 0.1 has a slope of 1e-19, and a scatter as small."""
    assert not fitted(np.full(100, 0.1)).is_wear
    assert not fitted(np.full(61, -0.0123)).is_wear


def test_readings_exactly_on_a_line_know_its_slope_to_their_own_step() -> None:
    """1 µm more with each of 40 parts: σ of rounding to 1 µm is 1/√12 µm, and the sum of squares of 1 … 40 about its mean 5330."""
    exact = fitted(np.arange(40) / 1000)
    assert exact.scatter == pytest.approx(0.001 / np.sqrt(12))
    assert exact.slope_error == pytest.approx(0.001 / np.sqrt(12 * 5330))
    low, high = exact.slope_interval
    assert low < 0.001 < high
    assert exact.is_wear
    prediction = forecast(exact, 0.06)
    assert prediction is not None
    assert prediction.low < prediction.parts < prediction.high


def test_one_step_of_the_rounding_is_no_wear() -> None:
    """Fifty times one size, then fifty times the next one: rounding explains that, and no two lines without any scatter."""
    staircase = fitted(np.repeat([0.0, 0.001], 50))
    assert staircase.count == 100
    assert staircase.scatter == pytest.approx(0.001 / np.sqrt(12))
    assert not staircase.is_wear


@given(
    step=st.sampled_from([1e-5, 1e-4, 1e-3, 1e-2]),
    slope=st.floats(-3, 3),
    readings=st.lists(st.integers(-2, 2), min_size=FEWEST, max_size=150),
)
def test_no_interval_is_narrower_than_rounding_makes_it(step: float, slope: float, readings: list[int]) -> None:
    x = np.arange(1, len(readings) + 1)
    rounded = np.round(slope * x + np.array(readings)) * step
    line = fit(x, rounded)
    if line is None or line.slope == 0:
        return
    kept = rounded[x >= line.first]
    assert np.ptp(kept) > 0
    assert line.scatter >= step / np.sqrt(12) * (1 - 1e-6)
    low, high = line.slope_interval
    assert high - low >= 2 * 1.9 * step / np.sqrt(12 * line.spread)
