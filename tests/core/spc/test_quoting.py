"""Quoted indices: readings that are too coarse carry none, and the quote never contradicts the cautions."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.spc.capability import Caution, Limits, capability, percentile
from app.core.spc.distributions import Family
from app.core.spc.fitting import fitted
from app.core.spc.quoting import FORBID_CPK, Quote, Quoting, quoting, quoting_of
from app.core.spc.refusal import Reason, Refused
from app.core.spc.resolution import resolution_of

LIMITS = Limits(-0.008, 0.008)


def judged(values: np.ndarray, *, stable: bool | None = True, far: bool = False) -> tuple[Any, Any, Quoting]:
    def tried(compute: Callable[[np.ndarray, Limits], Any]) -> Any:
        try:
            return compute(values, LIMITS)
        except Refused as refused:
            return refused

    found, by_percentile = tried(capability), tried(percentile)
    return found, by_percentile, quoting(found, by_percentile, stable=stable, far=far)


@pytest.mark.parametrize(
    "values",
    [
        [0.0] * 59 + [0.000001],  # Ppk 69455
        [0.0] * 58 + [0.000001, -0.000001],
        [0.0, 0.001] * 60,  # two values: Ppk by percentiles 59 of others like them
        [0.0] * 5000 + [0.001] * 30,
        [0.001] * 70 + list(np.random.default_rng(1).normal(0, 0.001, 60)),
        list(0.1 + np.random.default_rng(2).normal(0, 1e-17, 200)),
        list(np.random.default_rng(3).normal(0, 7e-15, 200)),  # decimal noise of 40.000 - 40.000
    ],
)
def test_readings_that_hide_their_spread_carry_no_index(values: list[float]) -> None:
    found, by_percentile, quote = judged(np.array(values))
    assert isinstance(found, Refused)
    assert found.reason in {Reason.UNRESOLVED, Reason.NO_VARIATION}
    assert isinstance(by_percentile, Refused)
    assert (quote.quote, quote.value) == (Quote.NONE, None)


def test_a_step_of_one_sigma_still_carries_an_index_and_a_wider_one_is_cautioned() -> None:
    rng = np.random.default_rng(4)
    for step, coarse in ((0.0002, False), (0.0012, True)):
        found, _percentile, quote = judged(np.round(rng.normal(0, 0.001, 400) / step) * step)
        assert (Caution.COARSE in found.cautions) is coarse
        assert resolution_of(np.round(rng.normal(0, 0.001, 400) / step) * step).step == pytest.approx(step)
        assert quote.quote is not Quote.NONE
        assert (quote.quote is Quote.CPK) is not coarse


def test_not_normal_and_too_few_for_percentiles_is_quoted_by_nothing() -> None:
    """The caution said *no index here says what the tails hold* beside `quote: ppk`."""
    found, by_percentile, quote = judged(np.random.default_rng(5).exponential(0.001, 90))
    assert Caution.NOT_NORMAL in found.cautions
    assert isinstance(by_percentile, Refused)
    assert quote == (Quote.NONE, None, None, None, False, "no_shape")


def test_a_reading_far_from_all_others_makes_no_index() -> None:
    values = np.random.default_rng(6).normal(0, 0.001, 400)
    assert judged(values)[2].quote is Quote.CPK
    assert judged(values, far=True)[2] == (Quote.NONE, None, None, None, False, "far_off")


@given(
    seed=st.integers(0, 10**6),
    count=st.sampled_from([10, 25, 60, 99, 120, 400, 1500]),
    step=st.sampled_from([0.0, 0.0001, 0.0008, 0.0015, 0.004]),
    shape=st.sampled_from(["normal", "exponential", "drift", "equal"]),
    stable=st.sampled_from([True, False, None]),
    far=st.booleans(),
)
def test_the_quote_never_contradicts_a_caution(
    seed: int, count: int, step: float, shape: str, stable: bool | None, far: bool
) -> None:
    rng = np.random.default_rng(seed)
    values = {
        "normal": rng.normal(0, 0.001, count),
        "exponential": rng.exponential(0.001, count),
        "drift": rng.normal(0, 0.0005, count) + np.linspace(0, 0.004, count),
        "equal": np.full(count, 0.001),
    }[shape]
    found, by_percentile, quote = judged(np.round(values / step) * step if step else values, stable=stable, far=far)
    assert (quote.quote is Quote.NONE) == (quote.value is None) == (quote.why is not None)
    if isinstance(found, Refused):
        assert quote.quote is Quote.NONE
        return
    if quote.quote is Quote.CPK:
        assert stable is True
        assert not FORBID_CPK & set(found.cautions)
    if quote.quote in {Quote.CPK, Quote.PPK}:
        assert Caution.NOT_NORMAL not in found.cautions
    if quote.quote is Quote.PERCENTILE:
        assert Caution.NOT_NORMAL in found.cautions
        assert (quote.value, quote.high) == (by_percentile.ppk.value, by_percentile.ppk.high)
        assert quote.preliminary == bool(by_percentile.cautions or Caution.FEW_READINGS in found.cautions)
    assert not (far and quote.quote is not Quote.NONE)
    assert Caution.FEW_READINGS not in found.cautions or quote.preliminary or quote.quote is Quote.NONE


def test_at_a_natural_limit_what_if_quotes_the_distribution_that_begins_there() -> None:
    """As the capability page does: of 300 half-normal readings the normal one would be judged beside zero."""
    values = np.abs(np.random.default_rng(12).normal(0, 0.002, 300))
    limits = Limits(None, 0.0127, 0.0)
    quoted = quoting_of(values, limits, side=-1)
    fit = fitted(values, limits, side=-1)
    assert (quoted.quote, quoted.value) == (Quote.FITTED, fit.ppk.value)
    assert fit.fit.family is Family.HALF_NORMAL
