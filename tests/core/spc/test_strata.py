"""Strata: numbers of each, and a test that drift does not deceive."""

import numpy as np
import pytest

from app.core.spc.capability import Limits, capability
from app.core.spc.refusal import Refused
from app.core.spc.strata import Difference, NoAnswer, differ, strata

LIMITS = Limits(-8.0, 8.0, 0.0)


def test_each_stratum_has_the_numbers_of_its_readings_alone() -> None:
    rng = np.random.default_rng(1)
    values, labels = rng.normal(0, 1, 300), rng.integers(-1, 3, 300)
    labels[:5] = 2
    found = strata(values, labels, ["A", "B", "C", "nothing"], LIMITS, 0.95)
    assert [each.name for each in found] == ["A", "B", "C"]
    for at, each in enumerate(found):
        of = values[labels == at]
        assert (each.readings, each.mean, each.sigma) == (len(of), of.mean(), of.std(ddof=1))
        assert each.ppk == capability(of, LIMITS).ppk


def test_few_readings_have_a_mean_and_no_index() -> None:
    (one,) = strata(np.array([1.0]), np.array([0]), ["A"], LIMITS, 0.95)
    assert (one.mean, one.sigma) == (1.0, None)
    assert isinstance(one.ppk, Refused)


@pytest.mark.parametrize("drift", [0.0, 0.02], ids=["steady", "a tool that wears by two sigma in a hundred parts"])
def test_where_strata_do_not_differ_one_test_in_a_hundred_says_so(drift: float) -> None:
    rng, tests = np.random.default_rng(7), 600
    alarms = 0
    for _test in range(tests):
        values = rng.normal(0, 1, 120) + drift * (np.arange(120) % 100)
        found = differ(values, rng.integers(0, 3, 120))
        assert isinstance(found, Difference)
        alarms += found.test.significant
    assert alarms <= 15, "of 600 at 1 %: 15 or more in one of a thousand such runs"


def test_a_nest_that_is_off_is_found_under_a_drift_ten_times_as_large() -> None:
    rng = np.random.default_rng(3)
    nest = np.arange(400) % 4
    values = rng.normal(0, 1, 400) + np.linspace(0, 20, 400) + 2.0 * (nest == 2)
    found = differ(values, nest)
    assert isinstance(found, Difference)
    assert found.test.significant
    assert found.apart == pytest.approx(2.0, abs=0.5)
    assert (found.strata, found.test.freedom) == (4, 3)


def test_orders_one_after_the_other_are_not_blamed_for_the_wear_between_them() -> None:
    values = np.random.default_rng(5).normal(0, 1, 400) + np.linspace(0, 20, 400)
    assert differ(values, np.arange(400) // 100) is NoAnswer.APART
    assert differ(values, np.zeros(400, np.int64)) is NoAnswer.ONE
    assert differ(values, np.full(400, -1)) is NoAnswer.ONE
    assert differ(np.zeros(400), np.arange(400) % 2) is NoAnswer.NO_VARIATION


def test_a_stratum_with_too_few_neighbours_is_left_out_of_the_test() -> None:
    rng = np.random.default_rng(9)
    labels = np.arange(300) % 2
    labels[7] = 2
    found = differ(rng.normal(0, 1, 300), labels)
    assert isinstance(found, Difference)
    assert found.strata == 2


def test_groups_of_strata_that_never_met_are_tested_but_not_measured_against_each_other() -> None:
    rng = np.random.default_rng(11)
    labels = np.concatenate((np.arange(100) % 2, 2 + np.arange(100) % 2))
    found = differ(rng.normal(0, 1, 200) + 5 * (labels == 3), labels)
    assert isinstance(found, Difference)
    assert (found.test.significant, found.test.freedom, found.apart) == (True, 2, None)


@pytest.mark.parametrize("nests", [2, 3, 5, 10])
@pytest.mark.parametrize("wear", [0.05, 0.1])
def test_nests_in_turn_are_not_blamed_for_the_wear_from_one_to_the_next(nests: int, wear: float) -> None:
    """A pallet: the last nest is always cut later than the first, and the tool is changed before a pallet."""
    rng, part = np.random.default_rng(13), np.arange(3_000)
    found = [differ(rng.normal(0, 1, 3_000) + wear * (part % 100), part % nests) for _study in range(12)]
    assert {(each.test.freedom, each.strata) for each in found if isinstance(each, Difference)} == {(nests - 1, nests)}
    assert sum(each.test.significant for each in found if isinstance(each, Difference)) <= 1


def test_nests_that_lie_in_a_slope_are_found_while_the_tool_wears() -> None:
    part = np.arange(2_000)
    found = differ(np.random.default_rng(15).normal(0, 1, 2_000) + 0.1 * (part % 10) - 0.03 * (part % 300), part % 10)
    assert isinstance(found, Difference)
    assert found.test.significant
    assert found.apart == pytest.approx(0.9, abs=0.4)


@pytest.mark.parametrize("strata", [2, 3, 5, 8])
def test_of_many_readings_no_direction_is_counted_twice(strata: int) -> None:
    rng = np.random.default_rng(17)
    found = differ(rng.normal(0, 1, 20_000), rng.integers(0, strata, 20_000))
    assert isinstance(found, Difference)
    assert (found.test.freedom, found.apart is None) == (strata - 1, False)


def test_readings_far_apart_are_no_neighbours_though_those_between_say_nothing() -> None:
    rng, labels = np.random.default_rng(19), np.full(5_000, -1)
    labels[::50] = rng.integers(0, 2, 100)
    assert differ(rng.normal(0, 1, 5_000) + 0.01 * (np.arange(5_000) % 700), labels) is NoAnswer.APART


def test_of_no_reading_there_are_no_two_strata() -> None:
    assert differ(np.array([]), np.array([], np.int64)) is NoAnswer.ONE
