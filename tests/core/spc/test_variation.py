"""One threshold of "no variation": equal readings never become a tiny sigma by rounding."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.spc import outliers, shewhart
from app.core.spc.in_time import brown_forsythe, in_time
from app.core.spc.normality import anderson_darling, shapiro_wilk
from app.core.spc.quantity import Quantity, Series, individuals_of
from app.core.spc.refusal import Reason, Refused
from app.core.spc.spread import Estimator, subgroups, summary
from app.core.spc.variation import varies

SIZES = st.floats(min_value=-1e5, max_value=1e5, allow_nan=False)


@given(SIZES, st.integers(min_value=2, max_value=500))
def test_equal_readings_do_not_vary_however_they_are_rounded(size: float, many: int) -> None:
    values = np.full(many, size)
    for spread_of_them in (
        float(values.std()),
        float(np.abs(values - values.sum() / many).max()),
        float(np.ptp(values)),
    ):
        assert not varies(spread_of_them, values)


@given(SIZES, st.floats(min_value=1e-5, max_value=10.0))
def test_ten_nanometres_vary_at_any_size(size: float, apart: float) -> None:
    values = np.array([size, size + apart])
    assert varies(float(np.ptp(values)), values)


def test_differences_are_rounded_like_what_they_were_taken_between() -> None:
    references = np.array([10.0, 20.0, 30.0, 40.0, 50.0])
    biases = (references + 0.1) - references
    assert biases.std() > 0
    assert not varies(float(biases.std()), references)


def test_what_is_no_number_does_not_vary() -> None:
    assert not varies(float("nan"), [1.0])
    assert not varies(0.0)
    assert varies(1e-30, [0.0])


CONSTANT_INSIDE = np.repeat(0.001 * np.arange(1, 31) + 0.0003, 5)
"""Thirty subgroups of five equal readings: their mean is not exactly what it is the mean of."""


@pytest.mark.parametrize("estimator", [Estimator.RANGES, Estimator.STANDARD_DEVIATIONS, Estimator.POOLED])
def test_subgroups_that_are_constant_inside_give_no_limits(estimator: Estimator) -> None:
    groups = subgroups(CONSTANT_INSIDE, 5)
    assert groups.deviations.max() > 0 or estimator is not Estimator.STANDARD_DEVIATIONS
    with pytest.raises(Refused) as refused:
        shewhart.subgroup_baseline(groups, estimator)
    assert refused.value.reason is Reason.NO_VARIATION


def test_no_verdict_is_made_of_rounding_noise() -> None:
    noise = 40.0 + np.where(np.arange(60) % 3 == 0, 7.1e-15, 0.0)
    assert noise.std() > 0
    series = Series(np.arange(60), noise, np.arange(60) == 0)
    for refuses in (
        lambda: shewhart.individuals_baseline(noise),
        lambda: individuals_of(series, Quantity.DEVIATION),
        lambda: anderson_darling(noise),
        lambda: shapiro_wilk(noise),
        lambda: in_time(noise),
        lambda: shewhart.given(40.0, 1e-14),
    ):
        with pytest.raises(Refused) as refused:
            refuses()
        assert refused.value.reason is Reason.NO_VARIATION
    assert summary(noise).autocorrelation is None
    assert not outliers.far_off(noise).any()
    assert np.isnan(brown_forsythe([noise[:30], noise[30:]]).p_value)
