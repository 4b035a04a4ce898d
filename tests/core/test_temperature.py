"""Size at 20 °C: the equation and the budget of GUM H.1, and what holds for all temperatures."""

from math import sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.temperature import HIGHEST, LOWEST, REFERENCE, AtReference, Expansion, Missing, at_reference

NANOMETRE = 1e-6
temperatures = st.floats(LOWEST, HIGHEST)
coefficients = st.floats(-5, 200)
sizes = st.floats(0.001, 3000)


def found(size: float, part: float, machine: float | None, expansion: Expansion) -> AtReference:
    at = at_reference(size, part, machine, expansion)
    assert isinstance(at, AtReference)
    return at


def test_the_budget_of_an_end_gauge_as_the_gum_publishes_it() -> None:
    """JCGM 100:2008, H.1.4 and H.1.7: a gauge of 50 mm, 16.6 nm of temperature, 2.9 nm of coefficients, 11.7 nm of their product."""
    of_temperature = Expansion(11.5, temperature_uncertainty=0.05 / sqrt(3))
    assert (found(50.0, 20.0, None, of_temperature).uncertainty or 0) / NANOMETRE == pytest.approx(16.6, abs=0.05)
    spread = sqrt(0.2**2 + (0.5 / sqrt(2)) ** 2)
    of_coefficients = Expansion(0.0, coefficient_uncertainty=1 / sqrt(3), temperature_uncertainty=spread)
    both = (found(50.0, REFERENCE - 0.1, None, of_coefficients).uncertainty or 0) / NANOMETRE
    assert both == pytest.approx(sqrt(2.9**2 + 11.7**2), abs=0.05)


def test_steel_on_a_scale_of_glass() -> None:
    """100 mm of steel that is 10 K too warm has grown by 11.5 µm, and a scale of glass 5 K too warm shows 4 µm too little."""
    at = found(100.0, 30.0, 25.0, Expansion(11.5, scale_coefficient=8.0))
    assert at.correction == pytest.approx(-0.0115 + 0.004, abs=2e-6)
    assert at.size == pytest.approx(100.0 + at.correction, abs=1e-12)
    assert at.uncertainty is None


@given(sizes, coefficients, st.none() | coefficients)
def test_at_20_degrees_nothing_is_corrected(size: float, coefficient: float, scale: float | None) -> None:
    at = found(size, REFERENCE, REFERENCE, Expansion(coefficient, scale_coefficient=scale))
    assert at.correction == 0
    assert at.size == pytest.approx(size, abs=1e-9)


@given(sizes, temperatures, coefficients)
def test_a_part_warmed_up_again_has_its_size(size: float, part: float, coefficient: float) -> None:
    cold = found(size, part, None, Expansion(coefficient)).size
    assert cold * (1 + coefficient * 1e-6 * (part - REFERENCE)) == pytest.approx(size, abs=2e-9, rel=1e-12)


@given(sizes, temperatures, coefficients)
def test_a_scale_that_expands_as_the_part_does_hides_it(size: float, warm: float, coefficient: float) -> None:
    assert found(size, warm, warm, Expansion(coefficient, scale_coefficient=coefficient)).correction == 0


@given(sizes, temperatures, temperatures, coefficients, coefficients, st.floats(0, 5), st.floats(0, 5))
def test_the_uncertainty_is_that_of_first_order_and_never_less(
    size: float,
    part: float,
    machine: float,
    coefficient: float,
    scale: float,
    of_coefficient: float,
    of_temperature: float,
) -> None:
    expansion = Expansion(coefficient, of_coefficient, scale, of_temperature)
    first = size * 1e-6 * sqrt(
        ((part - 20) ** 2 + (machine - 20) ** 2) * of_coefficient**2 + (coefficient**2 + scale**2) * of_temperature**2
    )  # fmt: skip
    assert (found(size, part, machine, expansion).uncertainty or 0) >= first - 1e-9


@given(st.floats(-1e6, LOWEST - 1e-6) | st.floats(HIGHEST + 1e-6, 1e6), temperatures)
def test_what_no_part_can_have_gives_no_size(wrong: float, right: float) -> None:
    both = Expansion(11.5, scale_coefficient=8.0)
    assert at_reference(40.0, wrong, right, both) is Missing.NOT_BELIEVED
    assert at_reference(40.0, right, wrong, both) is Missing.NOT_BELIEVED
    assert isinstance(at_reference(40.0, right, wrong, Expansion(11.5)), AtReference), "the scale does not count"


def test_what_is_missing_is_named() -> None:
    both = Expansion(11.5, scale_coefficient=8.0)
    assert at_reference(40.0, 24.0, 22.0, Expansion()) is Missing.COEFFICIENT
    assert at_reference(40.0, None, 22.0, both) is Missing.PART_TEMPERATURE
    assert at_reference(40.0, 24.0, None, both) is Missing.MACHINE_TEMPERATURE


def test_the_length_that_expands_may_be_another_one() -> None:
    assert found(0.002, 30.0, None, Expansion(11.5, length=100.0)).correction == pytest.approx(-0.011499, abs=1e-6)
