"""Capability and normality: hand cases, invariances, intervals that hold what they promise, refusals and cautions."""

from collections import Counter
from collections.abc import Callable
from math import sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.stats import anderson, nct, norm

from app.core.spc.capability import Capability, Caution, Limits, capability, expected_ppm, observed_ppm, percentile
from app.core.spc.normality import anderson_darling, shapiro_wilk
from app.core.spc.outliers import far_off
from app.core.spc.refusal import Reason, Refused
from app.core.spc.spread import pooled, subgroups
from tests.chance import examples

READINGS = st.lists(st.integers(-300, 300), min_size=20, max_size=80).filter(
    lambda values: len(set(values)) > 8 and 2 * Counter(values).most_common(1)[0][1] <= len(values)  # not too coarse
)


def of(values: list[float], lower: float, upper: float) -> Capability:
    return capability(values, Limits(lower, upper))


@given(values=READINGS, shift=st.integers(-50, 50), scale=st.sampled_from([0.001, 2.0, 100.0]))
@examples(60)
def test_indices_do_not_know_the_unit(values: list[int], shift: int, scale: float) -> None:
    before = of([float(value) for value in values], -350, 350)
    after = of([scale * (value + shift) for value in values], scale * (shift - 350), scale * (shift + 350))
    for name in ("cp", "cpk", "pp", "ppk", "cpm"):
        old, new = getattr(before, name), getattr(after, name)
        assert (new.value, new.low, new.high) == pytest.approx((old.value, old.low, old.high), rel=1e-6)
    assert after.ppm_overall == pytest.approx(before.ppm_overall, rel=1e-6, abs=1e-9)
    assert after.ppm_observed == before.ppm_observed


@given(values=READINGS)
@examples(60)
def test_a_mirrored_process_is_as_capable(values: list[int]) -> None:
    before = of([float(value) for value in values], -310, 380)
    after = of([-float(value) for value in values], -380, 310)
    assert after.cpk.value == pytest.approx(before.cpk.value)
    assert after.ppk.value == pytest.approx(before.ppk.value)
    assert after.ppm_within == pytest.approx(before.ppm_within, rel=1e-9, abs=1e-9)


@given(values=READINGS)
@examples(60)
def test_no_index_is_larger_than_the_centred_one(values: list[int]) -> None:
    found = of([float(value) for value in values], -310, 380)
    assert found.cp
    assert found.pp
    assert found.cpm
    assert found.cpk.value <= found.cp.value + 1e-12
    assert found.ppk.value <= found.pp.value + 1e-12
    assert found.cpm.value <= found.pp.value + 1e-12


def test_one_sided_limits_have_one_sided_indices_alone() -> None:
    values = np.random.default_rng(3).normal(10, 1, size=60)
    found = capability(values, Limits(None, 13.0))
    assert (found.cp, found.pp, found.cpm) == (None, None, None)
    assert found.ppk.value == pytest.approx((13 - values.mean()) / (3 * values.std(ddof=1)))
    assert found.ppk.interval == "noncentral_t"


def test_the_one_sided_interval_is_that_of_the_non_central_t() -> None:
    values = np.random.default_rng(4).normal(10, 1, size=35)
    index = capability(values, Limits(None, 13.0)).ppk
    scale = 3 * sqrt(35)
    assert index.low is not None
    assert index.high is not None
    assert nct.cdf(index.value * scale, 34, index.low * scale) == pytest.approx(0.975, abs=1e-9)
    assert nct.cdf(index.value * scale, 34, index.high * scale) == pytest.approx(0.025, abs=1e-9)


@pytest.mark.parametrize(
    ("name", "lower", "truth"), [("cp", -4.0, 4 / 3), ("cpk", -4.0, 4 / 3), ("ppk", None, 4 / 3), ("cpm", -4.0, 4 / 3)]
)
def test_intervals_hold_the_truth_as_often_as_they_say(name: str, lower: float | None, truth: float) -> None:
    rng = np.random.default_rng(12)
    held = 0
    for _ in range(600):
        index = getattr(capability(rng.normal(size=40), Limits(lower, 4.0)), name)
        held += index.low <= truth <= index.high
    # The minimum of two sides lies below the truth a little more often than its interval allows for.
    assert held / 600 == pytest.approx(0.95, abs=0.03)


def test_sigma_from_subgroups_is_taken_where_it_is_given() -> None:
    values = np.random.default_rng(5).normal(size=100)
    sigma = pooled(subgroups(values, 5))
    found = capability(values, Limits(-5, 5), within=sigma)
    assert found.within is sigma
    assert found.cp
    assert found.cp.value == pytest.approx(10 / (6 * sigma.value))


def test_parts_out_of_tolerance_are_counted_and_expected() -> None:
    assert observed_ppm(Limits(0.0, 2.0), np.array([0.0, 1.0, 2.0, 2.5])) == 250_000
    assert observed_ppm(Limits(None, 2.0), np.array([-9.0, 1.0, 2.0, 2.5])) == 250_000
    assert expected_ppm(Limits(-6, 6), 1.5, 1.0) == pytest.approx(3.3977, abs=1e-4)  # the 3.4 ppm of six sigma


@given(values=READINGS, shift=st.integers(-50, 50), scale=st.sampled_from([-7.0, -1.0, 0.001, 2.0]))
@examples(60)
def test_normality_does_not_know_unit_sign_or_zero(values: list[int], shift: int, scale: float) -> None:
    x = np.array(values, dtype=np.float64)
    for test in (anderson_darling, shapiro_wilk):
        before, after = test(x), test(shift + scale * x)
        assert after.statistic == pytest.approx(before.statistic, rel=1e-6)
        assert after.p_value == pytest.approx(before.p_value, rel=1e-4, abs=1e-9)


@given(values=READINGS, shift=st.integers(-50, 50), scale=st.sampled_from([-7.0, -1.0, 0.001, 2.0]))
@examples(60)
def test_percentiles_do_not_know_unit_sign_or_zero(values: list[int], shift: int, scale: float) -> None:
    x = np.array(values, dtype=np.float64)
    limits = sorted((shift - scale * 310, shift + scale * 380))
    try:
        before = percentile(x, Limits(-310, 380), minimum=20)
    except Refused:
        return
    after = percentile(shift + scale * x, Limits(*limits), minimum=20)
    assert (after.pp, after.ppk.value) == pytest.approx((before.pp, before.ppk.value), rel=1e-6)
    assert after.ppk.low == before.ppk.low
    assert after.ppk.high == pytest.approx(before.ppk.high, rel=1e-6)


@given(values=READINGS, scale=st.sampled_from([-7.0, 0.001, 2.0]))
@examples(60)
def test_what_lies_far_off_lies_there_in_any_unit(values: list[int], scale: float) -> None:
    x = np.array([*values, 90_000], dtype=np.float64)
    assert far_off(x)[-1]
    assert far_off(5 + scale * x).tolist() == far_off(x).tolist()


HIDING = np.append(2 * norm.ppf((np.arange(1000) + 0.5) / 1000), [15, 19, 19.8, 20.6])
"""A quiet process, 1,000 quantiles of a normal one with sigma 2, and four readings about ten sigma out: a tail without a gap."""


def test_a_few_at_ten_sigma_hide_none_at_three_hundred() -> None:
    assert not far_off(HIDING).any()
    for sign in (1, -1):
        x = sign * np.append(HIDING, [600.0, 602, 603])
        assert far_off(x).nonzero()[0].tolist() == [1004, 1005, 1006]
    stairs = np.append(HIDING, [35.0, 60, 110, 200, 390, 600])  # no gap of twice the last one anywhere
    assert far_off(stairs).nonzero()[0].tolist() == [1004, 1005, 1006, 1007, 1008, 1009]


HEAVY: dict[str, Callable[[np.random.Generator, int], Any]] = {
    "normal": lambda rng, n: rng.normal(size=n),
    "rounded": lambda rng, n: np.round(rng.normal(0, 1.2, n)),
    "gamma": lambda rng, n: rng.gamma(2, 1, n),
    "lognormal": lambda rng, n: rng.lognormal(0, 0.8, n),
    "t4": lambda rng, n: rng.standard_t(4, n),
    "wide": lambda rng, n: rng.normal(0, np.where(rng.random(n) < 0.02, 5, 1)),
}


WIDER = {0.01: 1.25, 0.02: 1.5, 0.04: 2.5}
CHANCE: dict[str, tuple[Callable[[np.random.Generator, int], Any], float]] = {
    "normal": (HEAVY["normal"], 0.0),
    "rayleigh": (lambda rng, n: rng.rayleigh(size=n), 0.0),
    "laplace": (lambda rng, n: rng.laplace(size=n), 0.0),
    "exponential": (lambda rng, n: rng.exponential(size=n), 0.0),
    "lognormal, 0.5": (lambda rng, n: rng.lognormal(0, 0.5, n), 0.005),
    "lognormal, 0.8": (HEAVY["lognormal"], 0.04),
    "t3": (lambda rng, n: rng.standard_t(3, n), 0.29),
    "t4": (HEAVY["t4"], 0.07),
    "t5": (lambda rng, n: rng.standard_t(5, n), 0.015),
    "one in fifty five times as wide": (HEAVY["wide"], 0.075),
}
"""Kinds, and the share of series that may have a reading marked by chance."""


def with_one_far(kind: str, count: int, off: float, sign: int, seed: int) -> tuple[Any, float, float, float]:
    """Readings, the last one `off` sigma of the middle half away; with the median, its distance, and the nearer quartile's."""
    x = HEAVY[kind](np.random.default_rng(seed), count)
    low, middle, high = np.quantile(x, [0.25, 0.5, 0.75])
    x = np.append(x, middle + sign * off * (high - low) / 1.349)
    low, middle, high = np.quantile(x, [0.25, 0.5, 0.75])
    return x, middle, abs(x[-1] - middle), min(high - middle, middle - low)


KIND, SIGN, SEED = st.sampled_from(sorted(HEAVY)), st.sampled_from([-1, 1]), st.integers(0, 1 << 30)
OFF = st.floats(0, 3).map(lambda power: float(10**power))
"""From 1 to 1000 sigma, each size alike."""
INSIDE = st.lists(st.floats(-1, 1, allow_nan=False), max_size=60)


@given(kind=KIND, off=OFF, sign=SIGN, seed=SEED, inner=INSIDE, copies=st.integers(1, 100))
@examples(100)
def test_readings_added_evenly_to_the_middle_half_never_unmark_one(
    kind: str, off: float, sign: int, seed: int, inner: list[float], copies: int
) -> None:
    """However many, from 1 to 1000 sigma: pairs about the median, no farther from it than its nearer quartile."""
    x, middle, _, quartile = with_one_far(kind, 301, off, sign, seed)
    pairs = [middle + way * quartile * each for each in inner for way in (-1, 1)] * copies
    before, after = far_off(x), far_off(np.append(x, pairs))
    assert not (before & ~after[: len(x)]).any()


@given(kind=KIND, sign=SIGN, seed=SEED, off=OFF, moved=st.lists(st.floats(0, 1), min_size=1, max_size=10))
@example(kind="normal", sign=1, seed=1, off=19.0, moved=[0.46])  # by a gap of twice the next one inside it was unmarked
@examples(100)
def test_what_lies_beyond_the_bulk_moves_no_limit(
    kind: str, sign: int, seed: int, off: float, moved: list[float]
) -> None:
    """A twentieth lies outside: each may come as near as the 95 % point, and no other loses its mark."""
    x, middle, distance, _ = with_one_far(kind, 300, off, sign, seed)
    away = sign * (x - middle)
    outside = np.argsort(away)[-1 - len(moved) : -1]
    edge = np.sort(away)[int(0.95 * (len(x) - 1))]
    nearer = x.copy()
    nearer[outside] = middle + sign * (edge + np.array(moved) * max(0.0, distance - edge))
    assert far_off(nearer)[-1] == far_off(x)[-1]


@given(kind=KIND, off=OFF, sign=SIGN, seed=SEED, share=st.sampled_from(sorted(WIDER)), nearer=INSIDE)
@examples(150)
def test_a_few_readings_anywhere_nearer_unmark_none_but_beside_the_limit(
    kind: str, off: float, sign: int, seed: int, share: float, nearer: list[float]
) -> None:
    """`WIDER` says how far beyond the limit is safe from so many more; docs/reference/statistics.md names it and says why."""
    x, middle, distance, _ = with_one_far(kind, 1000, off, sign, seed)
    within = middle + (x[-1] - middle) / WIDER[share]
    if not far_off(np.append(x[:-1], within))[-1]:
        return
    added = np.resize(nearer or [0.9], int(share * 1000))
    assert far_off(np.append(middle + distance * added, x))[-1]
    assert far_off(np.append(middle + sign * distance * np.abs(added), x))[-1], "all on one side"


@given(kind=KIND, nearer=INSIDE, off=st.floats(70, 1000), sign=SIGN, seed=SEED)
@examples(60)
def test_beyond_seventy_sigma_a_tenth_more_unmark_none(
    kind: str, nearer: list[float], off: float, sign: int, seed: int
) -> None:
    x, middle, distance, _ = with_one_far(kind, 10 * max(60, len(nearer)), off, sign, seed)
    assert far_off(x)[-1]
    assert far_off(np.append(middle + distance * np.array(nearer), x))[-1]


def test_enough_readings_one_by_one_are_a_process_of_their_own() -> None:
    """Why the property has a bound: no rule that marks the first and leaves the last alone keeps each mark at each step."""
    lone = np.append(norm.ppf((np.arange(1000) + 0.5) / 1000), 20.0)
    filled = np.append(lone, np.linspace(-20, 20, 20_000))
    assert far_off(lone).nonzero()[0].tolist() == [1000]
    assert not far_off(filled).any()


@pytest.mark.parametrize("draw", sorted(CHANCE))
def test_heavy_tails_are_seldom_far_off(draw: str) -> None:
    """Shares of 1,000 readings each in which one is marked by chance; docs/reference/statistics.md names them."""
    rng = np.random.default_rng(7)
    kind, most = CHANCE[draw]
    assert np.mean([far_off(kind(rng, 1000)).any() for _ in range(400)]) <= most


def test_nothing_lies_far_off_by_chance_or_in_a_saw_tooth() -> None:
    rng = np.random.default_rng(6)
    assert not far_off(rng.normal(size=100_000)).any()
    assert not far_off(np.tile(np.linspace(0, 1, 50), 20)).any()
    assert not far_off(np.array([1.0, 400.0])).any()
    assert not far_off(np.full(50, 1.0)).any()


def test_a_chip_is_seen_though_the_middle_half_is_one_value() -> None:
    """A gauge of 1 µm on a quiet process: most readings are the same, and quartiles say nothing of their scatter."""
    quiet = [40.0] * 60 + [40.001] * 12 + [39.999] * 12
    assert far_off(np.array([*quiet, 40.25])).nonzero()[0].tolist() == [84]
    assert not far_off(np.array([*quiet, 40.003])).any()
    assert not far_off(np.array([*([40.0] * 60), 40.25])).any(), "of two values nobody knows the step"


class TestCautions:
    def test_good_data_carries_its_numbers(self) -> None:
        assert capability(np.random.default_rng(7).normal(size=300), Limits(-5, 5)).cautions == ()

    def test_few_readings(self) -> None:
        assert Caution.FEW_READINGS in capability(np.random.default_rng(7).normal(size=99), Limits(-5, 5)).cautions

    def test_a_process_that_drifts_is_not_in_control(self) -> None:
        drifting = np.random.default_rng(7).normal(size=300) + np.linspace(0, 20, 300)
        assert Caution.NOT_IN_CONTROL in capability(drifting, Limits(-50, 50)).cautions

    def test_a_skewed_process_is_not_normal(self) -> None:
        skewed = np.random.default_rng(7).exponential(size=400)
        assert Caution.NOT_NORMAL in capability(skewed, Limits(None, 10)).cautions

    def test_what_the_caller_knows_is_passed_on_once(self) -> None:
        values = np.random.default_rng(7).normal(size=50)
        found = capability(values, Limits(-5, 5), cautions=(Caution.COMPENSATED, Caution.FEW_READINGS))
        assert found.cautions == (Caution.COMPENSATED, Caution.FEW_READINGS)


class TestRefusals:
    @pytest.mark.parametrize(
        ("values", "reason"),
        [([], Reason.TOO_FEW_READINGS), ([1.0] * 19, Reason.TOO_FEW_READINGS), ([1.0] * 50, Reason.NO_VARIATION)],
    )
    def test_readings_that_carry_no_number(self, values: list[float], reason: Reason) -> None:
        with pytest.raises(Refused) as refused:
            of(values, 0, 2)
        assert refused.value.reason is reason

    def test_limits_that_limit_nothing_or_are_crossed(self) -> None:
        for lower, upper, reason in ((None, None, Reason.NO_LIMITS), (2, 1, Reason.LIMITS_CROSSED)):
            with pytest.raises(Refused) as refused:
                Limits(lower, upper)
            assert refused.value.reason is reason

    def test_a_confidence_that_is_none(self) -> None:
        with pytest.raises(ValueError, match="confidence"):
            capability([1.0, 2.0], Limits(0, 2), confidence=95)


class TestPercentiles:
    def test_of_normal_readings_they_agree_with_the_indices(self) -> None:
        values = np.random.default_rng(9).normal(10, 2, size=400_000)
        by_percentile = percentile(values, Limits(0, 22))
        assert by_percentile.ppk.value == pytest.approx(capability(values, Limits(0, 22)).ppk.value, rel=0.02)
        assert by_percentile.cautions == ()

    def test_of_a_skewed_process_they_tell_what_happens(self) -> None:
        values = np.random.default_rng(9).exponential(size=100_000)
        found = percentile(values, Limits(None, 6.6077))  # the true 99.865 % point
        assert found.ppk.value == pytest.approx(1.0, abs=0.03)
        assert found.pp is None

    @pytest.mark.parametrize("count", [300, 1000, 4000])
    def test_the_interval_holds_the_truth_as_often_as_it_says(self, count: int) -> None:
        rng, held, bounded = np.random.default_rng(21), 0, 0
        truth = (9 - np.log(2)) / (-np.log(0.00135) - np.log(2))
        for _ in range(400):
            index = percentile(rng.exponential(size=count), Limits(None, 9.0)).ppk
            assert index.high is not None
            held += (index.low or 0.0) <= truth <= index.high
            bounded += index.low is not None
        assert held / 400 >= 0.94
        assert bounded == (400 if count >= 2731 else 0)

    def test_an_open_end_is_none_and_beyond_the_limit_it_is_the_other_one(self) -> None:
        values = np.random.default_rng(21).exponential(size=500)
        good, bad = (percentile(values, Limits(None, limit)).ppk for limit in (9.0, 0.3))
        assert good.low is None
        assert bad.low is not None
        assert bad.low < bad.value < 0.0 == bad.high

    def test_of_few_readings_they_say_so_or_are_refused(self) -> None:
        values = np.random.default_rng(9).normal(size=999)
        assert percentile(values, Limits(-9, 9)).cautions == (Caution.FEW_FOR_PERCENTILES,)
        with pytest.raises(Refused):
            percentile(values[:99], Limits(-9, 9))
        with pytest.raises(Refused):
            percentile([1.0] * 100, Limits(0, 2))


class TestNormality:
    def test_the_statistic_is_scipys(self) -> None:
        values = np.random.default_rng(2).gamma(3, size=80)
        method: Any = "interpolate"  # the stubs spell it otherwise
        found = anderson(values, "norm", method=method)
        assert anderson_darling(values).statistic == pytest.approx(float(found.statistic), abs=1e-10)

    def test_p_is_what_it_says_when_nothing_is_wrong(self) -> None:
        rng = np.random.default_rng(13)
        p = np.array([anderson_darling(rng.normal(size=30)).p_value for _ in range(4000)])
        for level in (0.01, 0.05, 0.25, 0.5):
            assert (p <= level).mean() == pytest.approx(level, abs=4 * sqrt(level * (1 - level) / 4000) + 0.005)

    def test_a_far_outlier_is_no_nan(self) -> None:
        found = anderson_darling([0.0] * 20 + [1e-9] * 20 + [1e9])
        assert (np.isfinite(found.statistic), found.p_value) == (True, 0.0)

    def test_what_they_cannot_test_is_refused(self) -> None:
        wrongs: list[Callable[[], object]] = [
            lambda: anderson_darling([1.0] * 7),
            lambda: anderson_darling([1.0] * 20),
            lambda: shapiro_wilk([1.0, 2.0]),
            lambda: shapiro_wilk([3.0] * 20),
            lambda: shapiro_wilk(np.arange(5001.0)),
        ]
        for wrong in wrongs:
            with pytest.raises(Refused):
                wrong()
