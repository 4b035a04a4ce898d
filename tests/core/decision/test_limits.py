import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from app.core.decision.limits import (
    Limits,
    Zone,
    classify,
    in_nanometres,
    nanometres,
    reaches,
    within,
    within_tolerance,
)
from app.core.parameters import Parameters

LIMITS = Limits(1_000, 5_300, 8_000, 300_000, 1_000_000)
SEVERITY = {
    Zone.ZERO: 0,
    Zone.AVERAGE: 1,
    Zone.FULL: 2,
    Zone.OVERSIZE: 3,
    Zone.UNDERSIZE: 3,
    Zone.WEAR: 4,
    Zone.PROBE_FAULT: 5,
}
MIRROR = {Zone.OVERSIZE: Zone.UNDERSIZE, Zone.UNDERSIZE: Zone.OVERSIZE}
deviations = st.floats(-2, 2)


@given(st.lists(st.floats(0, 3), min_size=5, max_size=5).map(sorted), deviations, deviations)
def test_a_larger_deviation_is_never_in_a_milder_zone(borders: list[float], one: float, other: float) -> None:
    limits = Limits(*(round(border * 1e6) for border in borders))
    smaller, larger = sorted((one, other), key=abs)
    assert SEVERITY[classify(smaller, limits)] <= SEVERITY[classify(larger, limits)]


@given(deviations)
def test_zones_are_symmetric_about_the_target(deviation: float) -> None:
    zone = classify(deviation, LIMITS)
    assert classify(-deviation, LIMITS) is MIRROR.get(zone, zone)


def test_a_value_on_a_limit_belongs_to_the_inner_zone_but_wear_and_fault_are_reached() -> None:
    on_limit = {
        0.001: Zone.ZERO,
        0.0053: Zone.AVERAGE,
        0.008: Zone.FULL,
        0.3: Zone.WEAR,
        1.0: Zone.PROBE_FAULT,
    }
    assert {value: classify(value, LIMITS) for value in on_limit} == on_limit
    beyond = {
        0.001001: Zone.AVERAGE,
        0.005301: Zone.FULL,
        0.008001: Zone.OVERSIZE,
        0.299999: Zone.OVERSIZE,
        0.999999: Zone.WEAR,
    }
    assert {value: classify(value, LIMITS) for value in beyond} == beyond
    assert classify(-0.008001, LIMITS) is Zone.UNDERSIZE


@given(st.integers(-1_000_000, 1_000_000), st.floats(-0.49e-6, 0.49e-6))
def test_less_than_half_a_nanometre_changes_nothing(size: int, noise: float) -> None:
    assert classify(size / 1e6 + noise, LIMITS) is classify(size / 1e6, LIMITS)


def test_binary_fractions_do_not_move_a_value_off_its_limit() -> None:
    limits = Limits.of(
        Parameters(
            target=0, tolerance_width=0.6, zero_range=0.1, averaging_limit=0.2, wear_limit=0.4, confidence_limit=1
        )
    )
    assert classify(0.1 + 0.2, limits) is Zone.FULL
    assert within_tolerance(0.1 + 0.2, limits)
    assert not within_tolerance(0.300001, limits)


NEAR_LIMITS = st.one_of(deviations, st.integers(-2_200_000, 2_200_000).map(lambda half: half / 2e6))


@given(st.lists(NEAR_LIMITS), st.sampled_from(LIMITS))
def test_arrays_are_judged_as_numbers_are(sizes: list[float], limit: int) -> None:
    whole = in_nanometres(np.array(sizes))
    assert whole.tolist() == [nanometres(size) for size in sizes]
    assert within(whole, limit).tolist() == [within(nanometres(size), limit) for size in sizes]
    assert reaches(whole, limit).tolist() == [reaches(nanometres(size), limit) for size in sizes]


@given(NEAR_LIMITS)
def test_the_zones_are_made_of_the_two_rules(deviation: float) -> None:
    size, zone = nanometres(deviation), classify(deviation, LIMITS)
    assert within(size, LIMITS.tolerance) == (zone in {Zone.ZERO, Zone.AVERAGE, Zone.FULL})
    assert reaches(size, LIMITS.wear) == (zone in {Zone.WEAR, Zone.PROBE_FAULT})
