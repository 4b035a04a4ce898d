from collections.abc import Callable
from typing import Any

import pytest

from app.core.acceptance import accepted, sections_outside
from app.core.parameters import Parameters
from app.core.probing import TouchError, Touches, measured_value, points_expected, sections_of, start_and_end

Made = Callable[..., Parameters]


def test_repeats_are_averaged_at_each_point_and_points_over_the_part(shaft: Made) -> None:
    parameters = shaft(variant="indexed", repeats=2)
    value, points, _fault = measured_value(parameters, [[39.998, 39.9982], [39.9979, 39.9981]])
    assert points == (39.9981, 39.998)
    assert value == 39.99805


def test_two_points_give_their_distance(shaft: Made) -> None:
    parameters = shaft(variant="two_point")
    assert measured_value(parameters, [[-20.003], [19.995]]).value == 39.998
    assert measured_value(parameters, [[19.995], [-20.003]]).value == 39.998


@pytest.mark.parametrize(
    ("touches", "code", "point", "repeat"),
    [
        ([], "points", 1, None),
        ([[39.99, 39.99]], "points", 2, None),
        ([[39.99, 39.99], [39.99]], "repeats", 2, 2),
        ([[39.99, 39.99], []], "repeats", 2, 1),
        ([[39.99, 39.99], None], "repeats", 2, 1),
        ([[39.99, None], [39.99, 39.99]], "missing", 1, 2),
        ([[39.99, 39.99], [None, None]], "missing", 2, 1),
        ([[39.99, 39.99], [39.99, 40.993]], "window", 2, 2),
        ([[38.991, 39.99], [39.99, 39.99]], "window", 1, 1),
    ],
)
def test_touches_that_cannot_be_believed_are_a_fault_naming_point_and_repeat(
    shaft: Made, touches: Touches, code: str, point: int, repeat: int | None
) -> None:
    _value, points, fault = measured_value(shaft(variant="indexed", repeats=2), touches)
    assert fault is not None
    assert (fault.code, fault.point, fault.repeat, points) == (code, point, repeat, ())
    again = TouchError(**fault.as_dict())  # type: ignore[arg-type]
    assert again.as_dict() == fault.as_dict()


@pytest.mark.parametrize(
    ("touches", "code", "point", "repeat"),
    [
        ([[39.99, 39.99], [39.99, 39.99], [39.99, 39.99]], "points", 3, None),
        ([[39.99, 39.99, 39.99], [39.99, 39.99]], "repeats", 1, 3),
        ([[39.99], [39.99, None, 39.99]], "repeats", 2, 3),
    ],
)
def test_more_touches_than_there_can_be_are_refused(
    shaft: Made, touches: Touches, code: str, point: int, repeat: int | None
) -> None:
    with pytest.raises(TouchError) as caught:
        measured_value(shaft(variant="indexed", repeats=2), touches)
    assert (caught.value.code, caught.value.point, caught.value.repeat) == (code, point, repeat)


@pytest.mark.parametrize(
    ("given", "touches", "value"),
    [
        # by hand, target 39.992, a = 1 mm: what is there counts; of nothing the end of the measuring move
        ({"variant": "indexed"}, [[40.0], None], 40.0),
        ({"variant": "round", "points": 3}, [[40.0], [None], [40.002]], 40.001),
        ({}, [[38.0]], 38.0),
        ({"feature": "inside"}, [[None]], 40.992),
        ({"feature": "outside"}, [[None]], 38.992),
        ({"feature": "outside", "direction": "positive"}, [], 38.992),
        ({"axis": "Z", "direction": "positive"}, [[]], 40.992),
        ({"axis": "Z", "direction": "negative"}, [None], 38.992),
        ({"variant": "two_point", "feature": "inside"}, [[-20.0], [None]], 40.992),
        ({"variant": "two_point"}, [[-20.0], [22.0]], 42.0),
        (
            {"variant": "two_point", "accept": {"n": 2, "m": 3}},
            [[-20.0], [20.0], [-20.0], None, [-20.0], [20.002]],
            40.001,
        ),
    ],
)
def test_a_fault_has_the_value_of_what_was_touched(
    shaft: Made, given: dict[str, Any], touches: Touches, value: float
) -> None:
    found = measured_value(shaft(**given), touches)
    assert (found.value, found.fault is not None) == (value, True)


def test_two_points_are_expected_within_the_window_about_their_distance(shaft: Made) -> None:
    parameters = shaft(variant="two_point", repeats=2)
    on_the_edge = measured_value(parameters, [[-20.0, -20.0], [20.992, 18.992]])
    assert on_the_edge.value == 39.992
    fault = measured_value(parameters, [[-20.0, -20.0], [20.0, 21.0]]).fault
    assert fault is not None
    assert (fault.code, fault.point, fault.repeat, fault.got) == ("distance", 2, 2, 41.0)


def test_a_touch_may_be_missing_at_one_of_two_points_too(shaft: Made) -> None:
    fault = measured_value(shaft(variant="two_point"), [[None], [20.0]]).fault
    assert fault is not None
    assert (fault.code, fault.point, fault.repeat) == ("missing", 1, 1)


def test_sections_of_two_points_each_are_distances(shaft: Made) -> None:
    """Three sections of a bore, each touched at -X and at +X: value and sections by hand."""
    parameters = shaft(variant="two_point", accept={"n": 2, "m": 3})
    assert points_expected(parameters) == 6
    value, points, _fault = measured_value(parameters, [[-20.0], [19.99], [-20.003], [19.999], [-19.995], [19.995]])
    assert sections_of(parameters, points) == (39.99, 40.002, 39.99)
    assert value == 39.994


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        # nobody gave R31: start = programmed + a, in the positive half (L93)
        ({"feature": "outside"}, (41.992, 37.992)),
        ({"feature": "inside"}, (37.992, 41.992)),
        ({"axis": "Z"}, (41.992, 37.992)),
        # by hand, a = 1 mm x 2: an outside surface is free outward, a bore inward
        ({"feature": "outside", "direction": "negative"}, (41.992, 37.992)),
        ({"feature": "inside", "direction": "positive"}, (37.992, 41.992)),
        ({"feature": "outside", "direction": "positive"}, (-41.992, -37.992)),
        ({"feature": "inside", "direction": "negative"}, (-37.992, -41.992)),
        ({"axis": "Z", "direction": "negative"}, (41.992, 37.992)),
        ({"axis": "Z", "direction": "positive", "feature": "inside"}, (37.992, 41.992)),
    ],
)
def test_the_probe_starts_on_the_free_side_and_ends_behind_the_surface(
    shaft: Made, given: dict[str, Any], expected: tuple[float, float]
) -> None:
    assert start_and_end(shaft(path_factor=2, **given)) == expected


def test_the_window_grows_with_the_path_factor_and_its_edge_is_inside(shaft: Made) -> None:
    assert measured_value(shaft(), [[40.992]]).value == 40.992
    assert measured_value(shaft(), [[40.992]]).fault is None
    assert measured_value(shaft(), [[40.992001]]).fault is not None
    assert measured_value(shaft(path_factor=2), [[41.992]]).value == 41.992


def test_two_of_three_sections_inside_make_a_good_part(shaft: Made) -> None:
    parameters = shaft(variant="along", points=3, accept={"n": 2, "m": 3})
    assert accepted(parameters, [40.0, 39.984, 39.983])
    assert not accepted(parameters, [40.0, 40.001, 39.983])
    assert accepted(parameters, [40.001, 39.985, 39.9841], empirical_value=0.001)
    assert sections_outside(parameters, [40.0, 40.001, 39.983]) == 2
    assert sections_outside(parameters, [40.0, 39.984, 39.992]) == 0, "a value on the limit is good"
    assert accepted(shaft(), [41.0]), "with one of one the zones alone judge"
