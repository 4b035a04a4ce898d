"""Gauge studies: what is put in comes out, and half a study is refused."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.spc.constants import d2, d2_star
from app.core.spc.gauge import crossed, linearity, single, zero_range
from app.core.spc.gauge.crossed import by_anova, by_average_and_range
from app.core.spc.refusal import Reason, Refused
from app.core.uncertainty import SignalPath, zero_range_floor


def study(
    parts: int = 200,
    operators: int = 40,
    trials: int = 3,
    *,
    equipment: float = 1.0,
    appraiser: float = 0.7,
    both: float = 0.0,
) -> np.ndarray:
    rng = np.random.default_rng(21)
    return (
        rng.normal(0, 3, size=(parts, 1, 1))
        + rng.normal(0, appraiser, size=(1, operators, 1))
        + rng.normal(0, 1, size=(parts, operators, 1)) * both
        + rng.normal(0, equipment, size=(parts, operators, trials))
    )


class TestCrossed:
    def test_the_components_that_were_put_in_come_out(self) -> None:
        found = by_anova(study(both=0.5))
        assert found.equipment == pytest.approx(1.0, rel=0.02)
        assert found.appraiser == pytest.approx(0.7, rel=0.25)
        assert found.interaction == pytest.approx(0.5, rel=0.05)
        assert found.part == pytest.approx(3.0, rel=0.1)
        assert not found.pooled
        assert found.total**2 == pytest.approx(found.grr**2 + found.part**2)

    def test_an_interaction_that_chance_explains_is_pooled(self) -> None:
        readings = study(20, 3)
        p_value = {line.source: line.p_value for line in by_anova(readings).table}["interaction"]
        found = by_anova(readings, pooled_above=p_value - 1e-9)
        assert (found.pooled, found.interaction) == (True, None)
        left = readings - readings.mean(axis=2, keepdims=True)
        assert found.equipment > by_anova(readings, pooled_above=p_value).equipment
        assert by_anova(readings, pooled_above=p_value).equipment == pytest.approx(((left**2).sum() / 120) ** 0.5)

    def test_ranges_agree_with_the_analysis_of_variance(self) -> None:
        readings = study(30, 3)
        anova, ranges = by_anova(readings), by_average_and_range(readings)
        assert ranges.equipment == pytest.approx(anova.equipment, rel=0.1)
        assert ranges.part == pytest.approx(anova.part, rel=0.2)

    def test_one_operator_has_no_reproducibility(self) -> None:
        readings = study(10, 1)
        for found in (by_anova(readings), by_average_and_range(readings)):
            assert found.appraiser == 0
            assert found.grr == found.equipment
        assert [line.source for line in by_anova(readings).table] == ["part", "repeatability", "total"]

    def test_squares_add_up(self) -> None:
        table = {line.source: line for line in by_anova(study(10, 3)).table}
        parts = ("part", "operator", "interaction", "repeatability")
        assert sum(table[source].squares for source in parts) == pytest.approx(table["total"].squares)
        assert sum(table[source].freedom for source in parts) == table["total"].freedom

    def test_few_ranges_are_divided_by_duncans_constant(self) -> None:
        readings = study(5, 3, 2)
        found = by_average_and_range(readings)
        assert found.equipment == pytest.approx(np.ptp(readings, axis=2).mean() / d2_star(2, 15))
        many = study(8, 2, 2)
        assert by_average_and_range(many).equipment == pytest.approx(np.ptp(many, axis=2).mean() / d2(2))

    @given(shift=st.floats(-1e3, 1e3), scale=st.sampled_from([-2.0, 0.001, 10.0]))
    def test_they_move_and_stretch_with_their_readings(self, shift: float, scale: float) -> None:
        readings = study(6, 3, 2, both=1.0)
        for evaluate in (by_anova, by_average_and_range):
            before, after = evaluate(readings), evaluate(shift + scale * readings)
            for name in ("equipment", "appraiser", "part", "grr"):
                assert getattr(after, name) == pytest.approx(abs(scale) * getattr(before, name), rel=1e-6, abs=1e-9)
            assert after.ndc == before.ndc

    @pytest.mark.parametrize(("shape", "what"), [((1, 3, 2), "parts"), ((5, 0, 2), "operators"), ((5, 3, 1), "trials")])
    def test_half_a_study_is_refused_by_what_it_lacks(self, shape: tuple[int, int, int], what: str) -> None:
        with pytest.raises(Refused) as refused:
            by_anova(np.ones(shape))
        assert (refused.value.reason, refused.value.what) == (Reason.INCOMPLETE_STUDY, what)

    def test_a_missing_reading_and_equal_readings_are_refused(self) -> None:
        readings = study(5, 2)
        readings[0, 0, 0] = np.nan
        tenth = np.repeat(np.arange(5.0)[:, None, None] * 0.3, 4, axis=1).reshape(5, 2, 2) + 0.1
        noise = tenth + np.random.default_rng(1).normal(0, 1e-16, (5, 2, 2))
        for wrong in (readings, np.ones((5, 2, 2)), tenth, noise):
            for evaluate in (by_anova, by_average_and_range):
                with pytest.raises(Refused):
                    evaluate(wrong)
        with pytest.raises(ValueError, match="shape"):
            crossed.by_anova([[1.0, 2.0]])

    def test_percentages(self) -> None:
        found = by_anova(study(10, 3))
        assert found.percent(found.total) == pytest.approx(100)
        assert found.percent_tolerance(0.001, 0.060) == pytest.approx(10)


class TestSingle:
    def test_bias_takes_from_cgk_what_it_takes_of_the_tolerance(self) -> None:
        rng = np.random.default_rng(31)
        values = rng.normal(size=50)
        values = (values - values.mean()) / values.std(ddof=1)
        # s = 1 µm, bias 1 µm, tolerance 60 µm: 20 % of it are 12 µm; 12/6 = 2, (6 - 1)/3.
        found = single.type_one(0.001 * values + 25.001, 25.0, 0.060, resolution=0.0001)
        assert (found.cg, found.cgk) == pytest.approx((2.0, 5 / 3))
        assert found.resolved
        assert found.capable()
        assert not found.capable(1.67)
        assert found.bias.significant
        assert not found.few

    def test_a_coarse_gauge_is_reported(self) -> None:
        for resolution in (0.01, None):  # as it is entered, or as the values show it
            found = single.type_one([1.0, 1.01, 1.02] * 4, 1.01, 0.1, resolution=resolution)
            assert not found.resolved
            assert not found.capable(0.1)
            assert found.few

    @pytest.mark.parametrize(
        "values",
        [[39.9921] * 49 + [39.992101], [1.0, 1.01] * 15, [1.0] * 27 + [1.01, 1.02, 0.99], [0.1 + 0.2, 0.3] * 15],
    )
    def test_values_that_hide_their_scatter_have_no_cg(self, values: list[float]) -> None:
        """The first had Cg 3771 and was called capable."""
        with pytest.raises(Refused):
            single.type_one(values, values[0], 0.016)

    def test_refusals(self) -> None:
        wrongs: list[Callable[[], object]] = [
            lambda: single.type_one([1.0] * 9, 1.0, 0.1),
            lambda: single.type_one([1.0] * 30, 1.0, 0.1),
            lambda: single.type_one([1.0, 1.1] * 15, 1.0, 0.0),
        ]
        for wrong in wrongs:
            with pytest.raises(Refused):
                wrong()


class TestLinearity:
    def test_a_line_that_was_put_in_comes_out(self) -> None:
        rng = np.random.default_rng(41)
        taken = {size: size + 0.01 - 0.002 * size + rng.normal(0, 0.001, 50) for size in (1.0, 5.0, 9.0)}
        found = linearity.linearity(taken)
        assert found.slope.value == pytest.approx(-0.002, abs=2e-4)
        assert found.intercept.value == pytest.approx(0.01, abs=1e-3)
        value, low, high = found.line_at(5.0)
        assert low < 0.0 + value < high
        assert high - low < found.line_at(20.0)[2] - found.line_at(20.0)[1]

    def test_a_bias_that_is_the_same_at_all_sizes_is_a_bias(self) -> None:
        """1 mm at every size: no slope, and the zero line far outside the band (AIAG)."""
        rng = np.random.default_rng(42)
        found = linearity.linearity({size: size + 1 + rng.normal(0, 0.002, 10) for size in (10.0, 20, 30, 40, 50)})
        assert not found.by_size
        assert not found.holds_zero
        assert found.biased_at == (10.0, 20.0, 30.0, 40.0, 50.0)
        assert found.average_interval[0] > 0.99
        assert not found.acceptable

    def test_biases_beside_the_line_are_no_equal_bias(self) -> None:
        """Up and down by 10 µm: slope and average are 0, yet the gauge errs by size."""
        rng = np.random.default_rng(43)
        steps = {10.0: 0.01, 20.0: -0.02, 30.0: 0.02, 40.0: -0.02, 50.0: 0.01}
        found = linearity.linearity({size: size + step + rng.normal(0, 0.002, 10) for size, step in steps.items()})
        assert found.slope.p_value > 0.3
        assert found.bent
        assert found.by_size
        assert not found.acceptable

    def test_the_zero_line_may_leave_the_band_between_the_sizes_alone(self) -> None:
        found = linearity.linearity({0.0: [0.9, -0.9, 0.7, -0.1], 10.0: [10.9, 9.1, 10.7, 9.9]})
        assert found.holds_zero
        for shift in np.linspace(0, 1, 101):
            found = linearity.linearity({x: [x + shift + e for e in (0.9, -0.9, 0.7, -0.7)] for x in (0.0, 10.0)})
            line = [found.line_at(x) for x in np.linspace(0, 10, 201)]
            assert found.holds_zero == all(low <= 0 <= high for _value, low, high in line)

    def test_a_good_gauge_is_accepted_and_false_alarms_are_few(self) -> None:
        rng = np.random.default_rng(44)
        good = [
            linearity.linearity({x: x + rng.normal(0, 0.001, 10) for x in (10.0, 20.0, 30.0, 40.0, 50.0)}).acceptable
            for _study in range(200)
        ]
        assert np.mean(good) > 0.75  # five looks at 5 %, most of them at the same thing

    def test_aiag_says_not_linear(self) -> None:
        """AIAG MSA, 4th ed., table III-B 4: the band leaves zero out but at 6 mm; slope and intercept are significant."""
        cases = json.loads((Path(__file__).parents[3] / "app/quality/proof/cases/gauge.json").read_text())
        case = next(each for each in cases if each.get("kind") == "linearity" and 10 in each["given"]["references"])
        found = linearity.linearity(dict(zip(case["given"]["references"], case["given"]["readings"], strict=True)))
        assert (found.acceptable, found.by_size, found.holds_zero) == (False, True, False)
        assert found.biased_at == (2.0, 4.0, 8.0, 10.0)

    @pytest.mark.parametrize("slope", [0.0, 0.001])
    def test_decimal_noise_is_no_significance(self, slope: float) -> None:
        """A bias of exactly 0.1 at five sizes answered *errs by size, p < 0.001*."""
        for repeats in (1, 10):
            with pytest.raises(Refused) as refused:
                linearity.linearity({x: [x + 0.1 + slope * x] * repeats for x in (10.0, 20.0, 30.0, 40.0, 50.0)})
            assert refused.value.reason is Reason.NO_VARIATION

    def test_repeats_that_are_the_same_count_once(self) -> None:
        """Ten times the same value is no evidence ten times over."""
        with pytest.raises(Refused):
            linearity.linearity({x: [x + e] * 10 for x, e in ((10.0, 0.1), (20.0, 0.12), (30.0, 0.15), (40.0, 0.15))})

    def test_refusals(self) -> None:
        for wrong in ({1.0: [1.0, 1.1]}, {1.0: [1.0], 2.0: [2.1]}, {1.0: [1.0, 1.0], 2.0: [2.0, 2.0]}):
            with pytest.raises(Refused):
                linearity.linearity(wrong)


SIZES = st.lists(st.integers(-400, 400), min_size=12, max_size=40).filter(
    lambda values: len(set(values)) > 3 and max(map(values.count, values)) <= 0.8 * len(values)
)
MOVES = {"shift": st.floats(-1e3, 1e3), "scale": st.sampled_from([-3.0, -1.0, 0.001, 25.4])}


@given(values=SIZES, **MOVES)
def test_bias_and_cg_do_not_know_unit_sign_or_zero(values: list[int], shift: float, scale: float) -> None:
    before = single.type_one([value / 100 for value in values], 0.5, 40.0)
    moved = [shift + scale * value / 100 for value in values]
    after = single.type_one(moved, shift + scale * 0.5, abs(scale) * 40.0)
    assert (after.cg, after.cgk) == pytest.approx((before.cg, before.cgk), rel=1e-6, abs=1e-9)
    assert after.bias.bias == pytest.approx(scale * before.bias.bias, rel=1e-6, abs=1e-9)
    assert after.bias.p_value == pytest.approx(before.bias.p_value, rel=1e-5, abs=1e-9)
    assert after.cgk <= after.cg + 1e-12


@given(values=SIZES, **MOVES)
def test_linearity_does_not_know_unit_sign_or_zero(values: list[int], shift: float, scale: float) -> None:
    def study(scale: float, shift: float) -> linearity.Linearity:
        return linearity.linearity(
            {
                shift + scale * size: [shift + scale * (size + value / 1000) for value in values[place::3]]
                for place, size in enumerate((10.0, 30.0, 50.0))
            }
        )

    try:
        before = study(1.0, 0.0)
    except Refused:
        return
    after = study(scale, shift)
    assert after.slope.value == pytest.approx(before.slope.value, rel=1e-5, abs=1e-9)
    assert after.r_squared == pytest.approx(before.r_squared, rel=1e-5, abs=1e-7)
    assert after.average_bias == pytest.approx(scale * before.average_bias, rel=1e-5, abs=1e-7)
    assert after.slope.p_value == pytest.approx(before.slope.p_value, rel=1e-4, abs=1e-9)


def test_negative_variances_are_reported() -> None:
    rng = np.random.default_rng(8)
    found = [by_anova(rng.normal(size=(8, 2, 3))) for _ in range(40)]
    told = {name for study in found for name in study.zeroed}
    assert told >= {"part", "appraiser"}
    for study in found:
        for name in study.zeroed:
            assert getattr(study, name) == 0.0
    assert by_anova(study_with_everything()).zeroed == ()
    ranges = [by_average_and_range(rng.normal(size=(8, 2, 3))) for _ in range(40)]
    assert any(each.zeroed == ("appraiser",) and each.appraiser == 0.0 for each in ranges)


def study_with_everything() -> np.ndarray:
    parts, operators = np.arange(10.0), np.array([0.0, 1.0, 3.0])
    rng = np.random.default_rng(9)
    made: np.ndarray = parts[:, None, None] * 5 + operators[None, :, None] + rng.normal(0, 0.2, (10, 3, 3))
    return made


class TestZeroRange:
    def test_it_reaches_as_far_as_chance(self) -> None:
        assert zero_range.suggest(0.001).zero_range == 0.003
        assert zero_range.suggest(0.001, repeats=4).zero_range == 0.0015

    def test_never_below_what_the_signal_path_does(self) -> None:
        floor = zero_range_floor(SignalPath.PLC, feed=600, delay=0.25)
        found = zero_range.suggest(0.00001, floor=floor)
        assert found.zero_range >= floor
        assert found.governs is zero_range.Governs.SIGNAL_PATH

    def test_parts_that_scatter_more_than_the_gauge_govern(self) -> None:
        found = zero_range.suggest(0.0003, process=0.002, averaging_limit=0.005)
        assert (found.zero_range, found.governs, found.fits) == (0.006, zero_range.Governs.PROCESS, False)
        assert zero_range.suggest(0.0003, process=0.0001).governs is zero_range.Governs.REPEATABILITY

    def test_it_is_rounded_up_to_what_the_control_takes(self) -> None:
        assert zero_range.suggest(0.00034, resolution=0.001).zero_range == 0.002
        assert zero_range.suggest(0.001, resolution=0.001).zero_range == 0.003

    def test_nothing_comes_of_nothing(self) -> None:
        with pytest.raises(Refused):
            zero_range.suggest(0.0)
