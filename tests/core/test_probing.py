from collections.abc import Callable

import pytest

from app.core.acceptance import accepted
from app.core.parameters import Parameters
from app.core.probing import TouchError, measured_value

Made = Callable[..., Parameters]


def test_repeats_are_averaged_at_each_point_and_points_over_the_part(shaft: Made) -> None:
    parameters = shaft(variant="indexed", repeats=2)
    value, points = measured_value(parameters, [[39.998, 39.9982], [39.9979, 39.9981]])
    assert points == (39.9981, 39.998)
    assert value == 39.99805


def test_two_points_give_their_distance(shaft: Made) -> None:
    parameters = shaft(variant="two_point")
    assert measured_value(parameters, [[-20.003], [19.995]]).value == 39.998
    assert measured_value(parameters, [[19.995], [-20.003]]).value == 39.998


@pytest.mark.parametrize(
    ("touches", "code", "point", "repeat"),
    [
        ([], "points", None, None),
        ([[39.99, 39.99]], "points", None, None),
        ([[39.99, 39.99], [39.99, 39.99], [39.99, 39.99]], "points", None, None),
        ([[39.99, 39.99], [39.99]], "repeats", 2, None),
        ([[39.99, 39.99], []], "repeats", 2, None),
        ([[39.99, 39.99], [39.99, 40.993]], "window", 2, 2),
        ([[38.991, 39.99], [39.99, 39.99]], "window", 1, 1),
    ],
)
def test_touches_that_do_not_fit_are_refused_naming_point_and_repeat(
    shaft: Made, touches: list[list[float]], code: str, point: int | None, repeat: int | None
) -> None:
    with pytest.raises(TouchError) as caught:
        measured_value(shaft(variant="indexed", repeats=2), touches)
    assert (caught.value.code, caught.value.point, caught.value.repeat) == (code, point, repeat)


def test_the_window_grows_with_the_path_factor_and_its_edge_is_inside(shaft: Made) -> None:
    assert measured_value(shaft(), [[40.992]]).value == 40.992
    with pytest.raises(TouchError):
        measured_value(shaft(), [[40.992001]])
    assert measured_value(shaft(path_factor=2), [[41.992]]).value == 41.992


def test_two_of_three_sections_inside_make_a_good_part(shaft: Made) -> None:
    parameters = shaft(variant="along", points=3, accept={"n": 2, "m": 3})
    assert accepted(parameters, [40.0, 39.984, 39.983])
    assert not accepted(parameters, [40.0, 40.001, 39.983])
    assert accepted(parameters, [40.001, 39.985, 39.9841], empirical_value=0.001)
    assert accepted(shaft(), [41.0]), "with one of one the zones alone judge"
