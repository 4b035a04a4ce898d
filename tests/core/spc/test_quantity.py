"""Quantities to chart of a process that is corrected: differences, the wear line, and residuals about it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.spc.quantity import (
    SETTLE,
    Quantity,
    Series,
    differences,
    fitting,
    individuals_of,
    residuals,
    run_in,
    wear_line,
)
from app.core.spc.refusal import Reason, Refused
from app.core.spc.rules import RuleName
from app.core.spc.shewhart import Chart
from app.core.spc.spread import Estimator


def series(values: list[float], begins: tuple[int, ...] = (0,)) -> Series:
    count = len(values)
    return Series(np.arange(1, count + 1), np.array(values, float), np.isin(np.arange(count), begins))


def edges(lives: int, parts: int, slope: float, levels: list[float], scatter: float = 0.0, seed: int = 1) -> Series:
    """So many tools of so many parts each, with a level of their own."""
    noise = np.random.default_rng(seed).normal(0, scatter, lives * parts) if scatter else np.zeros(lives * parts)
    place = np.tile(np.arange(parts), lives)
    values = np.repeat(levels, parts) + slope * place + noise
    return Series(np.arange(1, lives * parts + 1), values, place == 0)


def test_a_wear_line_has_one_slope_and_a_level_for_each_edge() -> None:
    line = wear_line(edges(3, 50, 0.25, [0.0, 700.0, -31.0]))
    assert line.slope == pytest.approx(0.25, abs=1e-12)
    assert line.error == pytest.approx(0, abs=1e-9)
    assert (line.readings, line.edges) == (150, 3)


def test_its_standard_error_is_that_of_one_regression_on_slope_and_levels() -> None:
    """Against least squares with a column for each level: covariance s^2 (X'X)^-1."""
    s = edges(3, 40, 0.1, [0.0, 5.0, 9.0], scatter=0.7)
    columns = np.column_stack([s.sequence, *(s.edge == number for number in range(3))]).astype(float)
    solved, squares, *_ = np.linalg.lstsq(columns, s.values)
    error = np.sqrt(squares[0] / (120 - 4) * np.linalg.inv(columns.T @ columns)[0, 0])
    line = wear_line(s)
    assert line.slope == pytest.approx(solved[0], rel=1e-9)
    assert line.error == pytest.approx(error, rel=1e-9)


def test_residuals_know_neither_wear_nor_how_an_edge_was_set() -> None:
    left = residuals(edges(3, 50, 0.25, [0.0, 700.0, -31.0]), 0.25)
    assert len(left) == 3 * (50 - SETTLE)
    assert np.abs(left.values).max() < 1e-9
    assert left.begins.sum() == 3, "the first that is judged begins its edge"


def test_an_edge_that_never_ran_in_is_judged_by_nothing() -> None:
    s = edges(2, 30, 0.0, [0.0, 5.0])
    assert residuals(s.only(s.sequence <= 45), 0.0, settle=20).sequence.tolist() == list(range(21, 31))
    assert len(residuals(s, 0.0, settle=100)) == 0
    assert len(residuals(s.only(np.zeros(60, np.bool_)), 0.0)) == 0


def test_an_edge_that_wears_faster_leaves_the_line() -> None:
    """0.02 a part more than the baseline's: after 100 parts 100 * 0.02 above the level that its 11th to 30th set."""
    s = edges(1, 131, 0.12, [3.0])
    assert residuals(s, 0.10, settle=30).values[-1] == pytest.approx(0.02 * (130 - 19.5))


@given(
    shift=st.floats(-1e3, 1e3),
    scale=st.floats(0.01, 100),
    slope=st.floats(-1, 1),
    settle=st.integers(1, 40),
)
def test_shift_does_not_matter_and_scale_scales(shift: float, scale: float, slope: float, settle: int) -> None:
    s = edges(2, 60, slope, [0.0, 3.0], scatter=1.0)
    moved = Series(s.sequence, scale * s.values + shift, s.begins)
    tolerance = 1e-9 * (abs(shift) + scale * 100)
    assert residuals(moved, scale * slope, settle).values == pytest.approx(
        scale * residuals(s, slope, settle).values, abs=tolerance
    )
    assert differences(moved).values == pytest.approx(scale * differences(s).values, abs=tolerance)
    line, same = wear_line(s), wear_line(moved)
    assert same.slope == pytest.approx(scale * line.slope, abs=tolerance)
    for which in Quantity:
        mine, other = (individuals_of(each, which, factor * line.slope) for each, factor in ((s, 1.0), (moved, scale)))
        assert other.sigma.value == pytest.approx(scale * mine.sigma.value, rel=1e-6)


@given(cut=st.integers(1, 119), settle=st.integers(1, 40))
def test_a_residual_is_the_same_however_much_comes_after_it(cut: int, settle: int) -> None:
    s = edges(2, 60, 0.1, [0.0, 3.0], scatter=1.0)
    early, whole = residuals(s.only(s.sequence <= cut), 0.1, settle), residuals(s, 0.1, settle)
    assert early.sequence.tolist() == whole.sequence[whole.sequence <= cut].tolist()
    known = early.sequence <= cut  # a level is settled before anything is judged by it
    assert early.values[known] == pytest.approx(whole.values[: len(early)], abs=1e-12)


def test_sigma_by_hand_and_without_the_jump_of_a_tool_change() -> None:
    """Ranges 1, 1, 1, (100 over the change) 3, 3: mean 9/5 over d2 = 2/sqrt(pi)."""
    s = series([0, 1, 0, 1, 101, 104, 101], (0, 4))
    baseline = individuals_of(s, Quantity.DEVIATION, minimum=7)
    assert baseline.centre == pytest.approx(308 / 7)
    assert baseline.sigma.value == pytest.approx(9 / 5 * np.sqrt(np.pi) / 2)
    assert (baseline.sigma.readings, baseline.sigma.groups) == (6, 5)
    whole = individuals_of(series([0, 1, 0, 1, 101, 104, 101]), Quantity.DEVIATION, minimum=7)
    assert whole.sigma.value == pytest.approx(109 / 6 * np.sqrt(np.pi) / 2), "one tool: the jump is scatter"


def test_of_differences_sigma_is_their_standard_deviation() -> None:
    """Moving ranges of differences would be too large by sqrt(3/2): neighbours share a reading."""
    rng = np.random.default_rng(7)
    found = individuals_of(series(rng.normal(0, 1, 20_000).tolist()), Quantity.DIFFERENCES)
    assert found.sigma.estimator is Estimator.OVERALL
    assert found.sigma.value == pytest.approx(np.sqrt(2), rel=0.02)


@pytest.mark.parametrize("which", Quantity)
def test_too_little_says_how_much_is_missing(which: Quantity) -> None:
    with pytest.raises(Refused) as refused:
        individuals_of(series([0.0, 1.0] * 6), which)
    assert refused.value.reason is Reason.TOO_FEW_READINGS
    assert refused.value.missing == (9 if which is Quantity.DIFFERENCES else 8)
    with pytest.raises(Refused) as refused:
        individuals_of(series([1.0] * 50), which)
    assert refused.value.reason is Reason.NO_VARIATION


def test_readings_that_have_nothing_in_common_have_no_sigma_and_no_line() -> None:
    alone = series([float(number) for number in range(30)], tuple(range(30)))
    with pytest.raises(Refused):
        individuals_of(alone, Quantity.DEVIATION)
    with pytest.raises(Refused):
        wear_line(alone)


def test_running_in_is_found_and_where_nothing_fits_the_shortest_is_taken() -> None:
    steady = edges(2, 300, 0.0, [0.0, 4.0], scatter=1.0)
    assert run_in(steady, 100, 0.0, 1.0) == SETTLE
    place = np.arange(900, dtype=np.int64)
    # 8 exp(-p/30) are still to wear: 0.41 on average of parts 80 to 99, beyond 3 * 0.5 * sqrt(1/20 + 1/750) = 0.34; of
    # parts 130 to 149 only 0.08.
    worn = 8 * (1 - np.exp(-place / 30)) + np.where(place % 2, 0.5, -0.5)
    assert run_in(Series(place + 1, np.asarray(worn, np.float64), place == 0), 150, 0.0, 0.5) == 150
    drifting = Series(place + 1, np.asarray(place, np.float64), place == 0)
    assert run_in(drifting, 850, 0.0, 0.1) == SETTLE
    assert run_in(drifting.only(place > 500), 1, 0.0, 0.1) == SETTLE


def test_running_in_takes_no_more_than_a_quarter_of_an_edge() -> None:
    """400 parts whose level wanders: nothing agrees within the scatter of neighbours but what is hardly tested at all."""
    place = np.arange(400, dtype=np.int64)
    ran_in = 6 * np.exp(-place / 25)
    wanders = np.asarray(3 * np.sin(place / 40) - ran_in, np.float64)
    found = run_in(Series(place + 1, wanders, place == 0), 1, 0.0, 0.05)
    assert SETTLE < found <= 100


def test_runs_have_no_sense_on_differences() -> None:
    assert fitting(Quantity.DIFFERENCES, Chart.INDIVIDUALS) == (RuleName.NELSON_1,)
    assert fitting(Quantity.DIFFERENCES, Chart.EWMA) == ()
    assert RuleName.NELSON_2 in fitting(Quantity.WEAR_RESIDUALS, Chart.INDIVIDUALS)
