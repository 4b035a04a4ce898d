"""Standard deviations that follow from what a protocol states, held against simulated axes."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.rotary.axis import ERRORS, estimate
from app.core.rotary.protocol_uncertainty import stated_deviations
from tests.core.rotary.simulated import positions

BALLS: dict[Any, tuple[float, float, float]] = {"A": (0.0, 180.0, 0.0), "B": (0.0, 0.0, 180.0), "C": (180.0, 0.0, 0.0)}
ANGLES = (-90.0, -30.0, 30.0, 90.0, 135.0)


@pytest.mark.parametrize("axis", BALLS)
def test_they_are_those_of_many_runs(axis: Any) -> None:
    runs = [
        estimate(axis, positions(axis, BALLS[axis], ANGLES, noise=0.001, seed=seed), BALLS[axis]) for seed in range(300)
    ]
    spread = np.std([[each.value for each in run.errors.values()] for run in runs], axis=0, ddof=1)
    scatter = float(np.sqrt(np.mean([run.scatter_after**2 for run in runs])))
    stated = stated_deviations(axis, ANGLES, 180.0, scatter)
    assert stated is not None
    assert list(stated) == list(ERRORS[axis])
    assert list(stated.values()) == pytest.approx(list(spread), rel=0.15)


@given(st.floats(1e-5, 0.1), st.floats(1.01, 10))
def test_they_grow_with_the_scatter(scatter: float, times: float) -> None:
    one, more = stated_deviations("C", ANGLES, 180.0, scatter), stated_deviations("C", ANGLES, 180.0, scatter * times)
    assert one is not None
    assert more is not None
    assert all(more[name] == pytest.approx(times * one[name]) for name in one)


@pytest.mark.parametrize(
    ("angles", "radius"),
    [((0.0, 90.0), 180.0), ((0.0, 1.0, 2.0, 3.0), 180.0), ((0.0, 90.0, 180.0), 0.0), ((), 180.0), ((0.0,) * 5, 180.0)],
)
def test_where_angles_determine_nothing_nothing_is_said(angles: tuple[float, ...], radius: float) -> None:
    assert stated_deviations("C", angles, radius, 0.002) is None
