"""The variants' own results against numbers worked out by hand, and what must hold of them whatever is touched."""

from collections.abc import Callable
from math import fsum
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.parameters import Parameters
from app.core.probing import measured_value
from app.core.variants import Results, fitted_points, results_of

Made = Callable[..., Parameters]
touch = st.floats(39.0, 40.98).map(lambda value: round(value, 6))


def results(parameters: Parameters, touches: list[list[float]]) -> Results:
    found = results_of(parameters, touches, measured_value(parameters, touches).points)
    assert found is not None
    return found


def test_the_half_difference_of_two_sides_is_run_out(shaft: Made) -> None:
    """Sides 40.010 and 39.994 of the part, indexed by 180°: (40.010 - 39.994) / 2."""
    assert results(shaft(variant="indexed", index=180), [[40.010], [39.994]]) == Results(run_out=0.008)
    assert results(shaft(variant="indexed", index=120, points=3), [[40.0], [39.998], [40.004]]).run_out == 0.003


def test_the_range_round_the_part_indicates_out_of_roundness(shaft: Made) -> None:
    """Four points round: the greatest 40.003, the smallest 39.997."""
    found = results(shaft(variant="round", points=4, index=90), [[40.0], [40.003], [39.999], [39.997]])
    assert found == Results(out_of_roundness=0.006)


def test_the_slope_along_the_part_is_taper(shaft: Made) -> None:
    """By hand: y - mean = -3, 0, -1, 4 µm; i - mean = -1.5, -0.5, 0.5, 1.5; sum = 10 / 5 = 2 µm from point to point."""
    found = results(shaft(variant="along", points=4, index=12.5), [[39.997], [40.0], [39.999], [40.004]])
    assert found == Results(taper=0.006, slope=0.00016, straightness=0.003)  # beside the line: 0, 1, -2 and 1 µm: 3 µm
    assert fitted_points([39.997, 40.0, 39.999, 40.004]) == pytest.approx([39.997, 39.999, 40.001, 40.003])


def test_towards_smaller_z_the_slope_changes_its_sign_and_the_taper_over_the_length_does_not(shaft: Made) -> None:
    found = results(shaft(variant="along", points=3, index=-10), [[39.99], [39.992], [39.994]])
    assert (found.taper, found.slope) == (0.004, -0.0002)


def test_without_a_spacing_there_is_no_slope_per_millimetre(shaft: Made) -> None:
    found = results(shaft(variant="along", points=2), [[39.99], [39.994]])
    assert (found.taper, found.slope) == (0.004, None)


def test_repeats_tell_how_well_the_probe_repeats_itself(shaft: Made) -> None:
    """Ranges 2 and 4 µm. Squares about the means: 0.002²/2 and 0.004²/2, pooled over 2: sqrt(5e-6) = 2.236 µm."""
    found = results(shaft(repeats=2, points=2, variant="round"), [[40.0, 40.002], [39.998, 40.002]])
    assert (found.repeat_range, found.repeat_deviation) == (0.004, 0.002236068)


@pytest.mark.parametrize("parameters", [{}, {"variant": "two_point"}, {"variant": "round"}])
def test_where_the_variant_says_nothing_there_is_nothing(shaft: Made, parameters: dict[str, Any]) -> None:
    made = shaft(**parameters)
    touches = [[-20.0], [19.99]] if made.variant == "two_point" else [[39.99]]
    assert results_of(made, touches, measured_value(made, touches).points) is None


def test_sections_out_of_tolerance_are_counted_with_the_empirical_value(shaft: Made) -> None:
    """Limits 39.984 and 40.000, EV +1 µm: 40.001 lies on the limit and is good, 40.0011 and 39.9849 are outside."""
    parameters = shaft(points=3, accept={"n": 2, "m": 3})
    good = results_of(parameters, [[40.001], [40.0011], [39.99]], [40.001, 40.0011, 39.99], empirical_value=0.001)
    assert good == Results(sections_outside=1, rejected=False)
    bad = results_of(parameters, [[40.001], [40.0011], [39.9849]], [40.001, 40.0011, 39.9849], empirical_value=0.001)
    assert bad == Results(sections_outside=2, rejected=True)


@given(st.lists(touch, min_size=2, max_size=20), st.floats(0.5, 50))
def test_the_slope_is_that_of_the_least_squares_line(points: list[float], spacing: float) -> None:
    parameters = _bore("along", len(points), spacing)
    found = results(parameters, [[point] for point in points])
    slope, _height = np.polyfit(np.arange(len(points)) * spacing, points, 1)
    assert found.slope == pytest.approx(slope, abs=2e-9)
    assert found.taper == pytest.approx(slope * spacing * (len(points) - 1), abs=2e-9)


@given(st.lists(touch, min_size=2, max_size=20), st.randoms())
def test_round_the_part_the_order_of_the_points_does_not_matter(points: list[float], shuffler: Any) -> None:
    parameters = _bore("round", len(points), 30.0)
    before = results(parameters, [[point] for point in points])
    shuffler.shuffle(points)
    assert results(parameters, [[point] for point in points]) == before
    assert before.out_of_roundness is not None
    assert before.out_of_roundness >= 0


@given(touch, touch)
def test_the_run_out_is_how_far_each_side_lies_from_the_value(one: float, other: float) -> None:
    parameters = _bore("indexed", 2, 180.0)
    touches = [[one], [other]]
    value = measured_value(parameters, touches).value
    assert results(parameters, touches).run_out == pytest.approx(abs(one - value), abs=2e-9)


@given(st.lists(st.lists(touch, min_size=3, max_size=3), min_size=2, max_size=6))
def test_the_deviation_of_the_repeats_is_pooled_over_the_points(touches: list[list[float]]) -> None:
    found = results(_bore("round", len(touches), 60.0, repeats=3), touches)
    variances = [np.var(repeats, ddof=1) for repeats in touches]
    assert found.repeat_deviation == pytest.approx((fsum(variances) / len(variances)) ** 0.5, abs=2e-9)
    assert found.repeat_range == pytest.approx(max(np.ptp(repeats) for repeats in touches), abs=2e-9)


def _bore(variant: str, points: int, index: float, repeats: int = 1) -> Parameters:
    from app.core.parameters import read

    drawing = {"target": 40.0, "tolerance_width": 0.016, "zero_range": 0, "wear_limit": 0.3, "confidence_limit": 1.0}
    return read(drawing | {"variant": variant, "points": points, "index": index, "repeats": repeats})[0]
