"""Drift over the runs, and changes between two of them."""

import numpy as np
import pytest

from app.core.rotary.drift import change, trend


def test_a_trend_by_hand() -> None:
    """Four days, 1 µm a day with ±0.1 µm beside: slope 0.98, s² = 0.018/2 µm², over Sxx = 5."""
    found = trend([0, 1, 2, 3], [0.0, 0.0011, 0.0019, 0.003])
    assert found is not None
    assert found.slope == pytest.approx(0.00098, abs=1e-12)
    half = 4.302652729 * np.sqrt(0.018e-6 / 2 / 5)  # t for 2 degrees of freedom
    assert found.high - found.slope == pytest.approx(half, rel=1e-6)
    assert found.moves


@pytest.mark.parametrize("days", [[], [1.0, 2.0], [1.0, 1.0, 1.0]])
def test_too_little_is_no_trend(days: list[float]) -> None:
    assert trend(days, [0.0] * len(days)) is None


def test_the_interval_holds_the_truth() -> None:
    random = np.random.default_rng(2)
    days = np.arange(8.0)
    hits = 0
    for _run in range(1000):
        found = trend(list(days), list(0.001 * days + random.normal(0, 0.002, 8)))
        assert found is not None
        hits += found.low <= 0.001 <= found.high
    assert 930 < hits < 970


def test_a_change_is_more_than_scatter_or_not() -> None:
    assert change(0.0, 0.003, 0.001, 0.001).moved is True
    assert change(0.0, -0.0028, 0.001, 0.001).moved is False  # 2 √2 = 2.83 µm
    assert change(0.0, 0.003, None, 0.001).moved is None
    assert change(0.002, 0.005).difference == 0.003


@pytest.mark.parametrize("values", [[0.1, 0.1 + 1e-17, 0.3 - 0.2, 0.1 + 2e-17], [0.001, 0.002, 0.003, 0.004]])
def test_runs_that_do_not_scatter_say_nothing_of_how_sure_a_trend_is(values: list[float]) -> None:
    assert trend([0, 7, 14, 21], values) is None
