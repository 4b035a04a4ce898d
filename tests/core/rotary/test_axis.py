"""Position errors of an axis: known ones are found again, within the uncertainty that is stated."""

from math import degrees, hypot, sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from scipy.spatial.transform import Rotation

from app.core.rotary.axis import AXES, ERRORS, AxisFault, AxisName, NoAxis, Position, arc_of, estimate, rotation
from app.core.rotary.sphere import fit_sphere
from tests.chance import by_chance, runs, seed
from tests.core.rotary.simulated import positions

ANGLES = [-90.0, -45.0, 0.0, 45.0, 90.0, 135.0, 180.0]
BALLS: dict[AxisName, tuple[float, float, float]] = {
    "C": (180.0, 40.0, 60.0),
    "A": (60.0, 180.0, 40.0),
    "B": (40.0, 60.0, 180.0),
}
TRUE = (0.0123, -0.0081, 0.0021, -0.0013)
small = some.floats(-0.05, 0.05)
tilt = some.floats(-0.01, 0.01)


def values_of(found: Any) -> list[float]:
    return [found.errors[name].value for name in ERRORS[found.axis]]


class TestByHand:
    """The printed model, by hand: C at 0, 90, 180 and 270 degrees, ball at (100, 0, 0)."""

    def seen(self, *deviations: tuple[float, float, float]) -> list[Position]:
        turned = [(100, 0, 0), (0, 100, 0), (-100, 0, 0), (0, -100, 0)]
        return [
            Position(90.0 * n, (p[0] + d[0], p[1] + d[1], p[2] + d[2]))
            for n, (p, d) in enumerate(zip(turned, deviations, strict=True))
        ]

    def test_where_the_axis_stands(self) -> None:
        """(I - R) t with t = (0.010, 0.002): at 90° (t1 + t2, t2 - t1), at 180° 2 t."""
        found = estimate(
            "C",
            self.seen((0, 0, 0), (0.012, -0.008, 0), (0.02, 0.004, 0), (0.008, 0.012, 0)),
            (100, 0, 0),
            ball_known=True,
        )
        assert values_of(found) == pytest.approx([0.010, 0.002, 0, 0], abs=1e-12)
        squares = 0.012**2 + 0.008**2 + 0.02**2 + 0.004**2 + 0.008**2 + 0.012**2
        assert found.scatter_before == pytest.approx(sqrt(squares / 4), abs=1e-12)
        assert found.greatest_before == pytest.approx(hypot(0.02, 0.004), abs=1e-12)
        assert found.scatter_after == pytest.approx(0, abs=1e-12)
        assert found.radius == pytest.approx(hypot(99.99, 0.002), abs=1e-9)
        assert (found.freedom, found.arc) == (8, 270.0)

    def test_how_it_leans(self) -> None:
        """w x R p0 - R (w x p0): EB0C = 0.001 rad lets the ball fall by -0.001 x, less what it had at 0."""
        found = estimate("C", self.seen((0, 0, 0), (0, 0, 0.1), (0, 0, 0.2), (0, 0, 0.1)), (100, 0, 0), ball_known=True)
        assert values_of(found) == pytest.approx([0, 0, 0, degrees(0.001)], abs=1e-12)


def test_an_axis_without_residuals_states_no_standard_deviation() -> None:
    ball = (100.0, 0.0, 50.0)
    seen = positions("C", ball, [0.0, 90.0, 180.0, 270.0], errors=(0.0, 0.0, 0.0, 0.0), shift=(0, 0, 0))
    found = estimate("C", seen, ball)
    assert {each.deviation for each in found.errors.values()} == {None}
    assert found.half_width("EX0C") is None


class TestRecovered:
    @pytest.mark.parametrize("axis", AXES)
    @pytest.mark.parametrize("known", [False, True])
    def test_without_scatter(self, axis: AxisName, known: bool) -> None:
        seen = positions(axis, BALLS[axis], ANGLES, errors=TRUE, shift=(0, 0, 0) if known else (0.003, -0.004, 0.005))
        found = estimate(axis, seen, BALLS[axis], ball_known=known)
        assert values_of(found) == pytest.approx(TRUE, abs=2e-6)  # the model is linear, the axis is not
        assert found.scatter_after < 2e-6
        assert found.scatter_before > 0.01
        if not known:
            assert found.shift is not None
            assert [each.value for each in found.shift] == pytest.approx([0.003, -0.004, 0.005], abs=3e-6)

    @given(some.tuples(small, small, tilt, tilt), some.tuples(small, small, small), some.sampled_from(AXES))
    def test_whatever_they_are(self, true: Any, shift: Any, axis: AxisName) -> None:
        found = estimate(axis, positions(axis, BALLS[axis], ANGLES, errors=true, shift=shift), BALLS[axis])
        assert values_of(found) == pytest.approx(true, abs=4e-5)
        assert found.scatter_after < 4e-5

    @pytest.mark.parametrize("axis", AXES)
    def test_backlash(self, axis: AxisName) -> None:
        seen = positions(axis, BALLS[axis], ANGLES, errors=TRUE, backlash=0.002, both=True)
        found = estimate(axis, seen, BALLS[axis])
        assert found.backlash is not None
        assert found.backlash.value == pytest.approx(0.002, abs=1e-7)
        assert values_of(found) == pytest.approx(TRUE, abs=2e-6)
        one_sided = [each for each in seen if each.approach > 0]
        assert estimate(axis, one_sided, BALLS[axis]).backlash is None

    @runs(150, 2_000)
    @pytest.mark.parametrize(("axis", "both"), [("A", False), ("B", True), ("C", False)])
    def test_within_the_stated_uncertainty(self, axis: AxisName, both: bool, runs: int) -> None:
        """Of 95 % intervals, 95 % hold the truth."""
        inside, noises, first = 0, [], seed(0)
        for run in range(runs):
            seen = positions(
                axis,
                BALLS[axis],
                ANGLES,
                errors=TRUE,
                shift=(0.002, 0, 0.001),
                noise=0.002,
                both=both,
                seed=first + run,
            )
            found = estimate(axis, seen, BALLS[axis])
            for name, true in zip(ERRORS[axis], TRUE, strict=True):
                inside += abs(found.errors[name].value - true) <= (found.half_width(name) or 0.0)
            noises.append(found.noise**2)
        assert inside / runs / len(TRUE) == pytest.approx(0.95, abs=by_chance(0.95, runs))
        assert sqrt(float(np.mean(noises))) == pytest.approx(0.002, rel=1.2 / sqrt(runs))

    @runs(100, 1_500)
    @pytest.mark.parametrize("around", [3, 4, 8])
    @pytest.mark.parametrize("besides", [0.0, 0.001])
    def test_within_the_stated_uncertainty_from_touches(self, around: int, besides: float, runs: int) -> None:
        """One touch on top leaves Z less sure than X and Y; the axis itself does not come back quite."""
        random, first = np.random.default_rng(seed(around)), seed(0)
        directions = [(np.cos(2 * np.pi * n / around), np.sin(2 * np.pi * n / around), 0.0) for n in range(around)]
        directions.append((0.0, 0.0, 1.0))
        inside = dict.fromkeys(ERRORS["C"], 0)
        for run in range(runs):
            seen, squares, free = [], 0.0, 0
            for place in positions(
                "C", BALLS["C"], ANGLES, errors=TRUE, shift=(0.002, 0, 0), noise=besides, seed=first + run
            ):
                radii = 12.5 + random.normal(0, 0.001, len(directions))
                ball = fit_sphere(
                    [np.add(place.centre, np.multiply(r, d)) for r, d in zip(radii, directions, strict=True)]
                )
                seen.append(Position(place.angle, ball.centre, 0, ball.spread))
                squares, free = squares + sum(r**2 for r in ball.residuals), free + len(directions) - 4
            found = estimate("C", seen, BALLS["C"], touch=sqrt(squares / free) if free else None)
            for name, true in zip(ERRORS["C"], TRUE, strict=True):
                inside[name] += abs(found.errors[name].value - true) <= (found.half_width(name) or 0.0)
        for name, hits in inside.items():
            # Four touches leave nothing over that would say how well they touch: all coordinates count as sure as the least.
            most = 0.99 if around == 3 else 0.95
            assert 0.95 - by_chance(0.95, runs) <= hits / runs <= most + by_chance(most, runs), name

    def test_exact_touches_weigh_nothing(self) -> None:
        """The scatter is not that of the points then, so every coordinate is as sure as the others."""
        plain = positions("C", BALLS["C"], ANGLES, errors=TRUE, noise=0.001)
        spread = ((0.5, 0.0, 0.0), (0.0, 0.5, 0.0), (0.0, 0.0, 1.25))
        weighed = estimate("C", [each._replace(spread=spread) for each in plain], BALLS["C"], touch=0.0)
        assert values_of(weighed) == pytest.approx(values_of(estimate("C", plain, BALLS["C"])), abs=1e-12)

    def test_a_nominal_centre_that_nobody_says(self) -> None:
        seen = positions("C", BALLS["C"], ANGLES, errors=TRUE, noise=0.001)
        said, found = estimate("C", seen, BALLS["C"]), estimate("C", seen)
        assert values_of(found) == pytest.approx(values_of(said), abs=1e-6)
        assert found.scatter_after == pytest.approx(said.scatter_after, abs=1e-9)

    def test_an_angle_error_is_seen_where_it_is(self) -> None:
        seen = positions("C", BALLS["C"], ANGLES)
        turned = rotation("C", 0.01) @ np.array(seen[3].centre)
        seen[3] = Position(seen[3].angle, tuple(turned.tolist()))
        found = estimate("C", seen, BALLS["C"], ball_known=True)
        assert 0.004 < found.angle_error < 0.01


class TestSense:
    def seen(self) -> list[Position]:
        return positions("C", BALLS["C"], ANGLES, errors=TRUE, shift=(0.001, 0.002, 0), noise=0.001, both=True)

    @given(some.floats(-180, 180))
    def test_all_turned_about_the_axis_turns_the_errors(self, angle: float) -> None:
        turn = rotation("C", angle)
        before = estimate("C", self.seen(), BALLS["C"])
        moved = [Position(p.angle, tuple((turn @ p.centre).tolist()), p.approach) for p in self.seen()]
        after = estimate("C", moved, (turn @ BALLS["C"]).tolist())
        for first, second in ((0, 1), (2, 3)):
            turned = turn @ [*values_of(before)[first : second + 1], 0.0]
            assert values_of(after)[first : second + 1] == pytest.approx(turned[:2].tolist(), abs=1e-9)
        assert after.scatter_before == pytest.approx(before.scatter_before, abs=1e-9)
        assert after.scatter_after == pytest.approx(before.scatter_after, abs=1e-9)

    def test_a_table_that_is_only_shifted_changes_nothing(self) -> None:
        """Along the axis, nominal and measured alike: the lean tells where the axis stands at another height."""
        before = estimate("C", self.seen(), BALLS["C"])
        up = [Position(p.angle, (p.centre[0], p.centre[1], p.centre[2] + 100), p.approach) for p in self.seen()]
        after = estimate("C", up, (BALLS["C"][0], BALLS["C"][1], BALLS["C"][2] + 100))
        assert values_of(after)[2:] == pytest.approx(values_of(before)[2:], abs=1e-9)
        assert after.radius == pytest.approx(before.radius, abs=1e-9)
        lean = np.radians(values_of(before)[2:])
        assert values_of(after)[0] == pytest.approx(values_of(before)[0] - 100 * lean[1], abs=1e-6)
        assert values_of(after)[1] == pytest.approx(values_of(before)[1] + 100 * lean[0], abs=1e-6)

    @pytest.mark.parametrize(("axis", "turns"), [("A", 1), ("B", 2)])
    def test_the_axes_are_the_same_but_for_their_letters(self, axis: AxisName, turns: int) -> None:
        """X to Y to Z: what C says of X and Y, A says of Y and Z, to the last digit."""

        def moved(point: Any) -> tuple[float, float, float]:
            x, y, z = np.roll(np.asarray(point), turns).tolist()
            return x, y, z

        of_c = estimate("C", self.seen(), BALLS["C"])
        other = estimate(axis, [p._replace(centre=moved(p.centre)) for p in self.seen()], moved(BALLS["C"]))
        assert list(other.errors.values()) == list(of_c.errors.values())
        assert other.backlash == of_c.backlash
        assert other.measured == tuple(moved(each) for each in of_c.measured)
        assert other.shift is not None
        assert of_c.shift is not None
        assert other.shift == tuple(of_c.shift[(n - turns) % 3] for n in range(3))

    def test_the_rotation_is_a_rotation(self) -> None:
        for axis, vector in zip(AXES, np.eye(3), strict=True):
            assert rotation(axis, 37).tolist() == pytest.approx(
                Rotation.from_rotvec(np.radians(37) * vector).as_matrix(), abs=1e-15
            )


class TestRefused:
    @pytest.mark.parametrize(
        ("angles", "ball", "fault"),
        [
            ([], (100, 0, 0), AxisFault.TOO_FEW),
            ([0, 90], (100, 0, 0), AxisFault.TOO_FEW),
            ([0, 90, 450, 0], (100, 0, 0), AxisFault.TOO_FEW),  # 450° is 90° once more
            ([0, 10, 20, 30, 40, 50], (100, 0, 0), AxisFault.ONE_SIDED_ARC),
            ([350, 355, 0, 5, 10], (100, 0, 0), AxisFault.ONE_SIDED_ARC),
            ([0, 90, 180, 270], (0.2, 0.1, 50), AxisFault.ON_AXIS),
        ],
    )
    def test_with_a_reason(self, angles: list[float], ball: Any, fault: AxisFault) -> None:
        with pytest.raises(NoAxis) as caught:
            estimate("C", positions("C", ball, angles), ball)
        assert caught.value.fault is fault

    def test_arcs(self) -> None:
        assert arc_of([0, 120, 240]) == 240
        assert arc_of([-10, 10]) == 20
        assert arc_of([5]) == 0
