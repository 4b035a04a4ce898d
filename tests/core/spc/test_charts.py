"""Control charts: invariances, unequal subgroups, pieces and wholes, and baselines that are refused."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import integrate
from scipy.special import log_ndtr

from app.core.compiled import plain
from app.core.spc import constants, shewhart, spread
from app.core.spc import cusum as sums
from app.core.spc import ewma as averages
from app.core.spc.constants import c4, d2, d2_star, d3, factors
from app.core.spc.cusum import cusum
from app.core.spc.ewma import average_run_length, ewma, moving_average
from app.core.spc.refusal import Reason, Refused
from app.core.spc.rules import signals_of
from app.core.spc.spread import Estimator, subgroups, summary
from tests.chance import examples

READINGS = st.lists(st.integers(-400, 400).map(lambda tenth: tenth / 10), min_size=20, max_size=60).filter(
    lambda values: len(set(values)) > 5
)
SHIFTS = st.integers(-1000, 1000).map(float)
SCALES = st.sampled_from([0.001, 0.5, 3.0, 1000.0])


def charts(values: Any) -> list[shewhart.ControlChart]:
    baseline = shewhart.individuals_baseline(values)
    groups = subgroups(values, 4)
    grouped = shewhart.subgroup_baseline(groups, minimum=2)
    return [
        shewhart.individuals(baseline, values),
        shewhart.moving_ranges(baseline, values),
        shewhart.means(grouped, groups),
        shewhart.ranges(grouped, groups),
        shewhart.deviations(grouped, groups),
        ewma(baseline, values),
        moving_average(baseline, values),
    ]


@given(values=READINGS, shift=SHIFTS, scale=SCALES)
@examples(60)
def test_charts_move_and_stretch_with_their_readings(values: list[float], shift: float, scale: float) -> None:
    for before, after in zip(charts(values), charts([shift + scale * value for value in values]), strict=True):
        moved = 0.0 if before.chart in {"moving_range", "ranges", "deviations"} else shift
        for name in ("points", "centre", "lower", "upper"):
            old, new = getattr(before, name), getattr(after, name)
            assert new == pytest.approx(moved + scale * old, rel=1e-9, abs=1e-9 * (abs(shift) + 100 * scale))
        assert after.z == pytest.approx(before.z, rel=1e-6, abs=1e-6)


@given(values=READINGS)
@examples(60)
def test_a_mirrored_process_has_a_mirrored_chart(values: list[float]) -> None:
    for before, after in zip(charts(values), charts([-value for value in values]), strict=True):
        if before.chart in {"moving_range", "ranges", "deviations"}:
            assert after.points == pytest.approx(before.points)
            assert after.upper == pytest.approx(before.upper)
        else:
            assert after.points == pytest.approx(-before.points)
            assert after.lower == pytest.approx(-np.asarray(before.upper))


@given(values=READINGS, cut=st.integers(1, 19))
@examples(60)
def test_what_remembers_goes_on_where_it_stopped(values: list[float], cut: int) -> None:
    baseline = shewhart.given(1.0, 4.0)
    whole = ewma(baseline, values)
    later = ewma(baseline, values[cut:], start=float(whole.points[cut - 1]))
    assert later.points.tolist() == whole.points[cut:].tolist()
    later = ewma(baseline, values[cut:], start=float(whole.points[cut - 1]), seen=cut)
    for name in ("lower", "upper"):
        assert getattr(later, name) == pytest.approx(getattr(whole, name)[cut:], abs=1e-12)
    first = cusum(baseline, values[:cut], headstart=2.5)
    rest = cusum(baseline, values[cut:], state=(float(first.above[-1]), float(first.below[-1])))
    together = cusum(baseline, values, headstart=2.5)
    assert [*first.above, *rest.above] == pytest.approx(together.above.tolist(), abs=1e-12)
    assert [*first.below, *rest.below] == pytest.approx(together.below.tolist(), abs=1e-12)


def test_an_average_of_nobody_knows_how_many_has_the_limits_of_very_many() -> None:
    chart = ewma(shewhart.given(10.0, 2.0), [10.5, 11.0], 0.2, start=10.4)
    assert (chart.lower, chart.upper) == pytest.approx((8.0, 12.0))  # 10 ± 3 x 2 x sqrt(0.2 / 1.8)


def test_the_probable_mean_lies_on_the_side_of_the_sum() -> None:
    """Montgomery's example, and its mirror: 1.25 above the target of 10, or below."""
    away = np.array([0.90, -0.67, 2.29, 1.50, 0.60, 1.08, 0.38, 1.62, 1.31])
    baseline = shewhart.given(10, 1)
    above = cusum(baseline, 10 + away, state=(0.34, 0.0))
    below = cusum(baseline, 10 - away, state=(0.0, 0.34))
    assert (above.new_mean(8), below.new_mean(8)) == pytest.approx((11.25, 8.75), abs=0.005)
    assert below.new_mean(0) is None


@pytest.mark.parametrize(("n", "tabled"), [(50, 4.498), (100, 5.015), (200, 5.492), (500, 6.073), (1000, 6.483)])
def test_large_subgroups_have_the_mean_range_that_tippett_tabled(n: int, tabled: float) -> None:
    # L. H. C. Tippett (1925), On the extreme individuals and the range of samples, Biometrika 17, to three decimals.
    assert d2(n) == pytest.approx(tabled, abs=0.0006)


@pytest.mark.parametrize("n", [10_001, 1_000_000, 100_000_000])
def test_of_very_large_subgroups_both_ends_of_the_range_are_independent(n: int) -> None:
    largest = integrate.quad(lambda x: -np.expm1(n * log_ndtr(x)), 0, 12, epsabs=1e-12, limit=500)[0]
    squared = integrate.quad(lambda x: -2 * x * np.expm1(n * log_ndtr(x)), 0, 12, epsabs=1e-12, limit=500)[0]
    assert d2(n) == pytest.approx(2 * largest, rel=1e-9)
    # Smallest and largest value know less and less of each other: the variance of the range is twice that of one end.
    assert d3(n) ** 2 == pytest.approx(2 * (squared - largest**2), rel=0.5 / n**0.5 + 1e-7)


def test_at_the_border_both_integrations_say_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    before = d2(constants.LARGE), d3(constants.LARGE)
    monkeypatch.setattr(constants, "LARGE", 1)
    constants._moments_of_range.cache_clear()
    assert (d2(10_000), d3(10_000)) == pytest.approx(before, rel=1e-9)
    constants._moments_of_range.cache_clear()


def test_a_range_chart_takes_a_subgroup_of_any_size() -> None:
    values = np.random.default_rng(3).normal(size=2 * 10_001 + 60)
    groups = subgroups(values, [3] * 20 + [10_001, 10_001])
    baseline = shewhart.subgroup_baseline(groups)
    assert baseline.sigma.value == pytest.approx(1.0, abs=0.05)
    assert not shewhart.ranges(baseline, groups).outside[-2:].any()  # the two large ones


def test_the_limits_of_a_chart_are_where_rule_one_fires() -> None:
    values = np.random.default_rng(2).standard_t(3, size=400)
    for chart in charts(values):
        (rows,) = [rows for name, rows in signals_of(chart).runs.items() if name == "nelson_1"]
        flagged = {int(i) for _side, start, end, _points in rows for i in range(start, end + 1)}
        assert flagged == set(np.flatnonzero(chart.outside).tolist())
        assert flagged or chart.chart == "xbar"


def test_monitoring_estimates_nothing() -> None:
    baseline = shewhart.individuals_baseline(np.random.default_rng(4).normal(size=50))
    quiet = shewhart.individuals(baseline, [0.0, 0.1])
    wild = shewhart.individuals(baseline, [1e6, -1e6])
    assert (quiet.centre, quiet.lower, quiet.upper) == (wild.centre, wild.lower, wild.upper)
    assert wild.outside.all()


class TestUnequalSubgroups:
    def test_each_point_has_the_limits_of_its_size(self) -> None:
        groups = subgroups(np.arange(12.0), [2, 3, 5, 2])
        baseline = shewhart.given(5.0, 2.0)
        chart = shewhart.means(baseline, groups)
        assert np.asarray(chart.upper) == pytest.approx([5 + 6 / n**0.5 for n in (2, 3, 5, 2)])
        chart = shewhart.ranges(baseline, groups)
        assert np.asarray(chart.centre) == pytest.approx([2 * d2(n) for n in (2, 3, 5, 2)])
        assert np.asarray(chart.upper) == pytest.approx([2 * (d2(n) + 3 * d3(n)) for n in (2, 3, 5, 2)])
        assert np.asarray(shewhart.deviations(baseline, groups).centre) == pytest.approx(
            [2 * c4(n) for n in (2, 3, 5, 2)]
        )

    def test_equal_ones_reduce_to_the_tables(self) -> None:
        values = np.random.default_rng(6).normal(20, 3, size=100)
        groups = subgroups(values, 5)
        f = factors(5)
        by_range = shewhart.means(shewhart.subgroup_baseline(groups), groups)
        assert by_range.upper == pytest.approx(values.mean() + f.A2 * groups.ranges.mean())
        by_deviation = shewhart.subgroup_baseline(groups, Estimator.STANDARD_DEVIATIONS)
        assert shewhart.means(by_deviation, groups).lower == pytest.approx(
            values.mean() - f.A3 * groups.deviations.mean()
        )
        assert shewhart.deviations(by_deviation, groups).upper == pytest.approx(f.B4 * groups.deviations.mean())
        assert shewhart.ranges(shewhart.subgroup_baseline(groups), groups).upper == pytest.approx(
            f.D4 * groups.ranges.mean()
        )

    def test_all_estimates_of_sigma_are_unbiased_and_as_certain_as_they_say(self) -> None:
        rng = np.random.default_rng(8)
        sizes = [2, 3, 4, 6] * 5
        for estimate in (spread.from_ranges, spread.from_deviations, spread.pooled):
            found = [estimate(subgroups(rng.normal(size=75), sizes)) for _ in range(2000)]
            values = np.array([each.value for each in found])
            freedom = found[0].degrees_of_freedom
            assert values.mean() == pytest.approx(1.0, abs=0.01)
            assert values.var() == pytest.approx(1 / (2 * freedom), rel=0.12)

    def test_the_moving_range_is_as_certain_as_it_says(self) -> None:
        rng = np.random.default_rng(9)
        found = [spread.moving_range(rng.normal(size=30)) for _ in range(4000)]
        values = np.array([each.value for each in found])
        assert values.mean() == pytest.approx(1.0, abs=0.01)
        assert values.var() == pytest.approx(1 / (2 * found[0].degrees_of_freedom), rel=0.08)
        assert found[0].degrees_of_freedom == pytest.approx(0.605 * 30, abs=0.5)

    def test_subgroups_of_one_have_a_mean_and_tell_nothing_of_sigma(self) -> None:
        groups = subgroups([1.0, 3.0, 5.0, 9.0], [1, 3])
        assert spread.from_ranges(groups).value == pytest.approx(6 / d2(3))
        with pytest.raises(Refused):
            shewhart.ranges(shewhart.given(0, 1), groups)
        with pytest.raises(Refused):
            spread.pooled(subgroups([1.0, 2.0], 1))
        with pytest.raises(ValueError, match="do not fit"):
            subgroups([1.0, 2.0], [3])


class TestRefusals:
    def test_too_few_readings_give_no_limits_and_say_how_many_are_missing(self) -> None:
        with pytest.raises(Refused) as refused:
            shewhart.individuals_baseline([1.0, 2.0, 3.0])
        assert (refused.value.reason, refused.value.missing) == (Reason.TOO_FEW_READINGS, 17)
        with pytest.raises(Refused) as refused:
            shewhart.subgroup_baseline(subgroups(np.arange(30.0), 5))
        assert (refused.value.reason, refused.value.have, refused.value.needed) == (Reason.TOO_FEW_SUBGROUPS, 6, 20)

    def test_equal_readings_have_no_limits(self) -> None:
        with pytest.raises(Refused) as refused:
            shewhart.individuals_baseline([0.001] * 50)
        assert refused.value.reason is Reason.NO_VARIATION
        with pytest.raises(Refused):
            shewhart.given(0, 0)

    def test_limits_of_few_readings_are_provisional(self) -> None:
        rng = np.random.default_rng(1)
        assert shewhart.individuals_baseline(rng.normal(size=99)).provisional
        assert not shewhart.individuals_baseline(rng.normal(size=100)).provisional

    def test_senseless_settings_are_refused(self) -> None:
        baseline = shewhart.given(0, 1)
        for wrong in (
            lambda: ewma(baseline, [1.0], 0.0),
            lambda: moving_average(baseline, [1.0], 1),
            lambda: cusum(baseline, [1.0], h=5, headstart=5),
            lambda: d2(1),
            lambda: c4(1),
        ):
            with pytest.raises(ValueError, match=r"not|below"):
                wrong()


def test_one_reading_has_a_mean_and_nothing_else() -> None:
    one = summary([4.2])
    assert (one.mean, one.standard_deviation, one.autocorrelation) == (4.2, None, None)
    assert summary([3.0, 3.0, 3.0]).autocorrelation is None


def test_lambda_one_is_the_individuals_chart() -> None:
    baseline = shewhart.given(10, 2)
    assert ewma(baseline, [12.0, 7.0], 1.0).points.tolist() == [12.0, 7.0]
    assert np.asarray(ewma(baseline, [12.0, 7.0], 1.0).upper).tolist() == [16.0, 16.0]
    assert average_run_length(1.0, 3.0) == pytest.approx(370.398, abs=0.001)


def test_constants_have_their_closed_forms() -> None:
    assert d2(2) == pytest.approx(2 / np.pi**0.5, abs=1e-12)
    assert d2(3) == pytest.approx(3 / np.pi**0.5, abs=1e-12)
    assert d3(2) == pytest.approx((2 - 4 / np.pi) ** 0.5, abs=1e-10)
    assert d2_star(2, 1) == pytest.approx(2**0.5, abs=1e-10)
    assert c4(2) == pytest.approx((2 / np.pi) ** 0.5, abs=1e-12)
    assert c4(1_000_000) == pytest.approx(1 - 1 / 4_000_000 - 7 / 32e12, abs=1e-15)
    assert c4(1000) == pytest.approx(1 - 1 / 4000 - 7 / 32e6 - 19 / 128e9, abs=1e-11)


def test_the_compiled_loops_are_the_python_they_are_made_from() -> None:
    z = np.random.default_rng(3).normal(size=500)
    assert np.array_equal(averages._smoothed(z, 0.2, 0.1), plain(averages._smoothed)(z, 0.2, 0.1))
    for quick, slow in zip(sums._sums(z, 0.5, 0.0, 2.5), plain(sums._sums)(z, 0.5, 0.0, 2.5), strict=True):
        assert np.array_equal(quick, slow)
