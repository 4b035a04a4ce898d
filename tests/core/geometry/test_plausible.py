"""Implausible measurements are warned of, and a plausible set-up is not."""

from math import cos, radians, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.geometry.alignment import Touch, align
from app.core.geometry.frames import applied, frame, from_angles
from app.core.geometry.in_plane import Hole, two_holes, two_points
from app.core.geometry.plausible import Bounds, alignment_warnings, plane_warnings, zero_warnings
from app.core.geometry.work_zero import Notice, Zero
from app.core.warning import CodedWarning
from tests.core.geometry.test_alignment import MORE, SIX, touched

BOUNDS = Bounds()
Places = list[tuple[float, float]]


def of_touches(touches: list[Touch], repeatability: float | None = None) -> list[CodedWarning]:
    return alignment_warnings(touches, align(touches, repeatability=repeatability), BOUNDS, repeatability)


def codes(warnings: list[CodedWarning]) -> list[tuple[str, str | None]]:
    return [(each.code, each.field) for each in warnings]


class TestTouches:
    @given(st.floats(-1.4, 1.4), st.floats(-1.4, 1.4), st.floats(-1.4, 1.4), st.floats(-2, 2), st.floats(-2, 2))
    def test_a_set_up_within_the_bounds_is_not_warned_of(
        self, x: float, y: float, z: float, a: float, c: float
    ) -> None:
        assert of_touches(touched(MORE, frame(from_angles(x, y, z), [a, -a, c]))) == []

    def test_half_a_metre_typed_for_half_a_millimetre_is_named(self) -> None:
        touches = [Touch.off_by(place, normal, 500.0 if at == 2 else 0.0) for at, (place, normal) in enumerate(SIX)]
        assert codes(of_touches(touches)) == [
            ("touch_far_off", "touches[2]"),
            ("turned_far", None),
            ("shifted_far", None),
        ]

    def test_two_exchanged_touches_are_named(self) -> None:
        touches = [Touch.off_by(place, normal, 0.01) for place, normal in MORE]
        touches[1], touches[4] = (
            touches[1]._replace(measured=touches[4].measured),
            touches[4]._replace(measured=touches[1].measured),
        )
        assert ("points_exchanged", "touches[1]") in codes(of_touches(touches))

    def test_measured_in_inches(self) -> None:
        touches = [Touch(place, normal, (place[0] / 25.4, place[1] / 25.4, place[2] / 25.4)) for place, normal in MORE]
        assert codes(of_touches(touches))[0] == ("looks_like_inches", "touches")

    def test_residuals_are_held_against_the_repeatability(self) -> None:
        touches = [Touch.off_by(place, normal, 0.05 if at == 6 else 0.0) for at, (place, normal) in enumerate(MORE)]
        assert of_touches(touches) == []  # nobody has stated how well the probe repeats
        assert "touch_does_not_fit" in dict(codes(of_touches(touches, 0.001)))


class TestInThePlane:
    def test_two_points_exchanged(self) -> None:
        nominal: Places = [(0, 0), (100, 0)]
        measured: Places = [(100, 0.2), (0, 0.1)]
        found = plane_warnings(nominal, measured, two_points(nominal, measured), "side", BOUNDS)
        assert codes(found)[:2] == [("points_exchanged", "side[0]"), ("turned_far", None)]
        assert found[1].values["turn"] == pytest.approx(180, abs=0.1)

    def test_two_holes_in_inches(self) -> None:
        nominal: Places = [(0, 0), (254, 0)]
        measured: Places = [(0, 0), (10, 0)]
        holes = two_holes(nominal, [Hole(each) for each in measured])
        assert codes(plane_warnings(nominal, measured, holes, "holes", BOUNDS)) == [
            ("looks_like_inches", "holes"),
            ("shifted_far", None),
        ]
        turned_round = plane_warnings(
            measured, nominal, two_holes(measured, [Hole(each) for each in nominal]), "holes", BOUNDS
        )
        assert turned_round[0].values["which"] == "nominal"

    def test_the_wrong_hole(self) -> None:
        nominal: Places = [(0, 0), (100, 0)]
        measured: Places = [(0, 0), (108, 0)]
        holes = two_holes(nominal, [Hole(each) for each in measured])
        assert codes(plane_warnings(nominal, measured, holes, "holes", BOUNDS)) == [("holes_apart", "holes")]

    @given(st.floats(-4.9, 4.9), st.floats(-7, 7))
    def test_far_from_the_origin_a_turn_is_no_shift(self, turn: float, shift: float) -> None:
        nominal: Places = [(3000, 2000), (3100, 2000)]
        middle = np.array([3050.0, 2000.0, 0.0])
        rotation = from_angles(0, 0, turn)
        motion = frame(rotation, middle - rotation @ middle + [shift, shift, 0])
        measured: Places = [(x, y) for x, y, _z in applied(motion, [[*each, 0.0] for each in nominal]).tolist()]
        assert plane_warnings(nominal, measured, two_points(nominal, measured), "side", BOUNDS) == []


class TestZeros:
    def test_one_that_is_in_order(self) -> None:
        assert zero_warnings(Zero(x=3.0, y=-2.0, rotation=1.0), BOUNDS, feeler=0.1, before={"x": 3.1, "y": -2.0}) == []

    @pytest.mark.parametrize(
        ("zero", "more", "code", "field"),
        [
            (Zero(x=0.0, y=0.0, rotation=12.0), {}, "turned_far", None),
            (Zero(x=100.0, y=0.0), {"before": {"x": 80.0, "y": 0.0}}, "shifted_far", None),
            (Zero(x=4.0, y=8.0), {"before": {"x": 101.6, "y": 203.0}}, "looks_like_inches", None),
            (Zero(x=0.0, z=1.0), {"feeler": 5.0}, "feeler_unusual", "feeler"),
            (Zero(x=0.0, residuals=(0.0, 0.1), notices=(Notice.MISFIT,)), {}, "touch_does_not_fit", None),
            (Zero(x=0.0, squareness=2.0, notices=(Notice.NOT_SQUARE,)), {}, "not_square", None),
        ],
    )
    def test_one_that_is_not(self, zero: Zero, more: dict[str, object], code: str, field: str | None) -> None:
        assert codes(zero_warnings(zero, BOUNDS, **more)) == [(code, field)]  # type: ignore[arg-type]


def test_turned_by_exactly_the_limit_is_plausible() -> None:
    turn = radians(5.0 - 1e-9)
    measured: Places = [(0, 0), (100 * cos(turn), 100 * sin(turn))]
    nominal: Places = [(0, 0), (100, 0)]
    assert plane_warnings(nominal, measured, two_points(nominal, measured), "side", BOUNDS) == []
