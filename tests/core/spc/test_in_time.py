"""Models in time, stability and the process without corrections: hand cases, invariances, and what made readings are called."""

from collections import Counter
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.spc.capability import Limits, expected, expected_ppm, observed
from app.core.spc.in_time import FEWEST, Location, Model, brown_forsythe, decompose, in_time, successive
from app.core.spc.refusal import Floats, Reason, Refused
from app.core.spc.rules import RuleName
from app.core.spc.spread import freedom_of_moving_ranges
from app.core.spc.stability import of_readings, stability
from app.core.spc.uncompensated import scatter, uncompensated
from tests.chance import examples

N = 1000
PLACE = np.arange(N)


def white(seed: int, count: int = N) -> Floats:
    return np.random.default_rng(seed).normal(size=count)


MADE: dict[Model, Callable[[int], Floats]] = {
    Model.A1: white,
    Model.A2: lambda seed: np.random.default_rng(seed).exponential(size=N),
    Model.B: lambda seed: white(seed) * np.where(PLACE < 500, 1.0, 2.5),
    Model.C1: lambda seed: white(seed) + np.repeat(white(seed + 1000, 200), 5),
    Model.C3: lambda seed: white(seed) + PLACE / 400,
    Model.C4: lambda seed: white(seed) + 4 * ((PLACE / 60) % 1) + PLACE / 1000,
    Model.D: lambda seed: white(seed) * np.where(PLACE < 500, 1.0, 2.5) + PLACE / 200,
}


@pytest.mark.parametrize("model", MADE)
def test_a_process_is_called_what_it_was_made_as(model: Model) -> None:
    """Tests at 1 % err now and then; these twenty are the same in every run."""
    called = Counter(in_time(MADE[model](seed)).model for seed in range(20))
    assert called[model] >= 17, called


def test_few_readings_equal_ones_and_many() -> None:
    with pytest.raises(Refused) as refused:
        in_time(white(1, FEWEST - 1))
    assert (refused.value.reason, refused.value.missing) == (Reason.TOO_FEW_READINGS, 1)
    with pytest.raises(Refused) as refused:
        in_time([3.0] * 100)
    assert refused.value.reason is Reason.NO_VARIATION
    with pytest.raises(Refused):
        in_time([*white(1, 99), float("nan")])
    assert in_time(white(2, 60)).few
    many = in_time(white(3, 300_000))
    assert (many.spread, many.subgroups, many.model) == (True, 200, Model.A1)


@given(seed=st.integers(0, 99), shift=st.sampled_from([-40.0, 0.0, 1000.0]), scale=st.sampled_from([-1.0, 0.001, 7.0]))
@examples(30)
def test_the_model_knows_no_unit_and_no_mirror(seed: int, shift: float, scale: float) -> None:
    made = white(seed, 200) + np.arange(200) / 100
    before, after = in_time(made), in_time(scale * made + shift)
    assert (before.model, before.location, before.scatter_changes) == (
        after.model,
        after.location,
        after.scatter_changes,
    )
    assert after.between.statistic == pytest.approx(before.between.statistic, rel=1e-6)
    assert after.slope == pytest.approx(scale * before.slope, rel=1e-6, abs=1e-12)


def test_squares_add_up() -> None:
    random = np.random.default_rng(20261121)
    groups = [random.normal(size=size) + size for size in (3, 5, 4, 7)]
    parts = decompose(groups, [1, 2, 4, 8])
    every = np.concatenate(groups)
    assert parts.between + parts.within == pytest.approx(((every - every.mean()) ** 2).sum())
    assert parts.regression + parts.lack_of_fit == pytest.approx(parts.between)
    assert parts.regression >= 0
    with pytest.raises(Refused):
        decompose([[1.0, 2.0], [3.0, 4.0]], [1, 2])


def test_scatter_that_differs_is_seen_and_a_moving_mean_is_none() -> None:
    assert brown_forsythe([white(1, 50), 3 * white(2, 50)]).significant
    assert not brown_forsythe([white(1, 50), white(2, 50) + 100]).significant
    assert np.isnan(brown_forsythe([[1.0, 2.0], [5.0, 6.0]]).statistic), (
        "two of each are as far from their median always"
    )


def test_values_that_take_turns_do_not_follow_each_other() -> None:
    assert successive(np.sin(PLACE / 20)).significant
    assert successive([1.0, -1.0] * 20).p_value > 0.99
    assert in_time(white(5)).location is Location.CONSTANT


def test_stability_counts_against_chance() -> None:
    assert sum(not of_readings(white(seed)).in_control for seed in range(100)) <= 2
    drifting = of_readings(white(1) + PLACE / 300)
    assert not drifting.in_control
    assert {each.rule for each in drifting.beyond_chance} >= {RuleName.NELSON_2}
    beyond = stability([4.0] * 5 + [0.1, -0.1] * 200)
    (first, *_others) = beyond.fired
    assert (first.rule, first.signals) == (RuleName.NELSON_1, 1), "a run of points is one signal"
    only = stability(white(3), [RuleName.NELSON_1, RuleName.NELSON_8])
    assert [each.rule for each in only.fired] == [RuleName.NELSON_1]


def test_fallout_by_sides() -> None:
    limits = Limits(-3.0, 3.0)
    sides = expected(limits, 0.5, 1.0)
    assert sides.total == pytest.approx(expected_ppm(limits, 0.5, 1.0))
    assert sides.above > sides.below
    found = observed(limits, np.array([-4.0, -3.0, 0.0, 3.0, 5.0, 6.0]))
    assert found.below == pytest.approx(1e6 / 6)
    assert found.above == pytest.approx(2e6 / 6)
    assert observed(Limits(None, 3.0), np.array([-9.0, 4.0])).below == 0


class TestWithoutCorrections:
    def test_wear_is_put_back_and_scatter_is_not(self) -> None:
        """0.2 µm of wear a part over lives of 100 parts: sd 100 x 0.2/sqrt(12) = 5.8 µm, scatter 1 µm."""
        noise = white(7, 500) * 0.001
        wearing = noise + np.arange(500) % 100 * 0.0002
        found = uncompensated(wearing, np.arange(500) % 100 == 0, noise, Limits(-0.008, 0.008))
        assert found.lives == 5
        assert found.tool.value == pytest.approx(0.0059, rel=0.05)
        assert found.ideal_sigma.value == pytest.approx(0.001, rel=0.1)
        assert found.ideal is not None
        assert found.ideal.value == pytest.approx(0.016 / 0.006, rel=0.1)
        assert found.gain == pytest.approx(5.9, rel=0.1)
        assert found.price == pytest.approx(1.0, rel=0.1)

    def test_steps_and_changes_of_tool_are_no_scatter(self) -> None:
        calm = white(8, 200)
        stepped = calm + np.where(np.arange(200) >= 100, 500.0, 0.0)
        one, two = np.arange(200) == 0, np.arange(200) % 100 == 0
        assert scatter(stepped, one).value == pytest.approx(scatter(calm, one).value, rel=0.02)
        found = scatter(calm + 9 * (np.arange(200) >= 100), two)
        assert found.groups <= 198
        assert found.degrees_of_freedom == pytest.approx(2 * freedom_of_moving_ranges(100))

    def test_too_few_or_equal_readings_are_refused(self) -> None:
        with pytest.raises(Refused):
            uncompensated(np.empty(0), np.empty(0, np.bool_), white(1, 30), Limits(-1, 1))
        with pytest.raises(Refused):
            uncompensated(np.zeros(30), np.arange(30) == 0, white(1, 30), Limits(-1, 1))


def test_signals_are_sized_as_well_as_counted() -> None:
    values = white(11, 200) * 0.002
    assert of_readings(values).in_control
    values[120] += 0.9
    gross = of_readings(values)
    assert not gross.in_control
    assert gross.gross == 1
    assert gross.farthest > 50
    assert gross.beyond_chance == (), "one signal in 200 readings is no more than chance explains"
