"""Work zero and size: by hand, from simulated parts, and what is refused."""

from math import cos, radians, sin

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from app.core.geometry.edges import Approach, EdgeKind, Problem, Touch, Unfit
from app.core.geometry.points import Degenerate, Reason
from app.core.geometry.work_zero import Height, Notice, Shift, find_zero, four_records, judge_shift, zero_in_z
from tests.chance import by_chance, runs, seed

LEFT, RIGHT, DOWN, UP = Approach.MINUS_X, Approach.PLUS_X, Approach.MINUS_Y, Approach.PLUS_Y
lengths = st.floats(-2000, 2000)
angles = st.floats(-40, 40)


def turned(x: float, y: float, angle: float, about: tuple[float, float]) -> tuple[float, float]:
    c, s = cos(radians(angle)), sin(radians(angle))
    return about[0] + c * x - s * y, about[1] + s * x + c * y


def rectangle(
    kind: EdgeKind, centre: tuple[float, float], size: tuple[float, float], angle: float, tip: float
) -> list[Touch]:
    """Two touches on each side of a turned rectangle: where the tip's centre stood."""
    inside = 1 if kind.inside else -1
    reach = [half / 2 - inside * tip / 2 for half in size]
    touches = []
    for side, approach in ((1, RIGHT if kind.inside else LEFT), (-1, LEFT if kind.inside else RIGHT)):
        for along in (-0.3, 0.35):
            x, y = turned(side * reach[0], along * size[1], angle, centre)
            touches.append(Touch(x, y, approach))
    for side, approach in ((1, UP if kind.inside else DOWN), (-1, DOWN if kind.inside else UP)):
        for along in (-0.35, 0.3):
            x, y = turned(along * size[0], side * reach[1], angle, centre)
            touches.append(Touch(x, y, approach))
    return touches


class TestByHand:
    def test_a_web_of_two_sides(self) -> None:
        """Outside the tip's diameter comes off: |X2 - X1| - 6, as the source's R17."""
        touches = [Touch(-53.0, None, RIGHT), Touch(53.0, None, LEFT), Touch(None, -33.0, UP), Touch(None, 37.0, DOWN)]
        zero = find_zero(EdgeKind.WEB, touches, 6.0)
        assert (zero.x, zero.y, zero.length, zero.width, zero.rotation) == (0.0, 2.0, 100.0, 64.0, None)
        assert max(map(abs, zero.residuals)) < 1e-12

    def test_a_bore_and_a_boss_in_pairs(self) -> None:
        """R15 = (R1+R2)/2, R16 = (R3+R4)/2, R17 = |R2-R1|; with a tip of 6 a bore is 6 larger, a boss 6 smaller.

        By hand: the tip's centre at X 12 and 60, Y 7 and 55 of a bore: zero 36, 31, diameter 48 + 6. Moved outwards.
        """
        bore = [Touch(12.0, None, LEFT), Touch(60.0, None, RIGHT), Touch(None, 7.0, DOWN), Touch(None, 55.0, UP)]
        zero = find_zero(EdgeKind.BORE, bore, 6.0, repeatability=0.001)
        assert (zero.x, zero.y, zero.diameter) == (36.0, 31.0, 54.0)
        assert zero.notices == (Notice.CHORDS,)
        assert zero.uncertainty["x"] == pytest.approx(0.002 / 2**0.5)
        boss = [Touch(12.0, None, RIGHT), Touch(60.0, None, LEFT), Touch(None, 7.0, UP), Touch(None, 55.0, DOWN)]
        zero = find_zero(EdgeKind.BOSS, boss, 6.0)
        assert (zero.x, zero.y, zero.diameter) == (36.0, 31.0, 42.0)
        two = find_zero(EdgeKind.BORE, bore[:2], 6.0)
        assert (two.x, two.y, two.diameter, two.length) == (36.0, None, 54.0, 54.0)
        two = find_zero(EdgeKind.BOSS, [Touch(33, 5, LEFT), Touch(-13, 5, RIGHT)], 6.0)
        assert (two.x, two.y, two.diameter) == (10.0, None, 40.0)

    def test_a_chord_beside_the_middle_leaves_the_zero_right(self) -> None:
        """The tip's path has a radius of 25; the pair in X runs 7 beside the middle: half a chord of 24."""
        touches = [Touch(-24.0, None, LEFT), Touch(24.0, None, RIGHT), Touch(None, -18.0, DOWN), Touch(None, 32.0, UP)]
        zero = find_zero(EdgeKind.BORE, touches, 6.0)
        assert (zero.x, zero.y, zero.diameter, zero.length, zero.width) == (0.0, 7.0, 56.0, 54.0, 56.0)

    def test_a_boss_of_four_touches(self) -> None:
        zero = find_zero(EdgeKind.BOSS, [Touch(33, 5), Touch(-13, 5), Touch(10, 28), Touch(10, -18)], 6.0)
        assert (zero.x, zero.y) == (10.0, 5.0)
        assert zero.diameter == pytest.approx(40.0, abs=1e-9)

    def test_the_printed_macro_for_a_round_part(self) -> None:
        """R14 = 2*SQRT(POT(R1-R15)+POT(R3-R16))+6 with R1..R4 = 12, 60, 7, 43: half chords 24 and 18, so 2·30 + 6."""
        zero = find_zero(EdgeKind.BORE, four_records(EdgeKind.BORE, 12.0, 60.0, 7.0, 43.0), 6.0)
        assert (zero.x, zero.y) == (36.0, 25.0)
        assert zero.diameter == pytest.approx(66.0, abs=1e-9)

    def test_z_by_the_macro(self) -> None:
        """#509 = #508 - #2 - #[11000+#4120]."""
        assert zero_in_z(Height(-201.5, 0.1, 98.25)) == -299.85
        touches = [Touch(-47, None, LEFT), Touch(53, None, RIGHT)]
        assert find_zero(EdgeKind.POCKET, touches, 6.0, height=Height(-201.5, 0.1, 98.25)).z == -299.85

    def test_a_corner_along_the_axes(self) -> None:
        """The part lies at larger X and Y; the tip comes from outside, so half of it lies between."""
        zero = find_zero(EdgeKind.CORNER, [Touch(97.0, None, RIGHT), Touch(None, 47.0, UP)], 6.0)
        assert (zero.x, zero.y, zero.rotation) == (100.0, 50.0, None)

    def test_a_turned_corner_of_three_touches(self) -> None:
        """The long side rises by 1 in 100; tip 0, so the corner lies where the two lines meet."""
        touches = [Touch(10.0, 0.1, UP), Touch(110.0, 1.1, UP), Touch(0.0, 50.0, RIGHT)]
        zero = find_zero(EdgeKind.CORNER, touches, 0.0)
        assert zero.rotation == pytest.approx(0.572938698, abs=1e-9)  # arctan 0.01
        # The other side is square to it: x = 0.5 - 0.01 y with y = 0.01 x
        assert zero.x == pytest.approx(0.5 / 1.0001, abs=1e-9)
        assert zero.y == pytest.approx(0.005 / 1.0001, abs=1e-9)

    def test_a_corner_that_is_not_square_says_so(self) -> None:
        touches = [Touch(0, 0, UP), Touch(100, 0, UP), Touch(0, 10, RIGHT), Touch(1, 110, RIGHT)]
        zero = find_zero(EdgeKind.CORNER, touches, 0.0, repeatability=0.001)
        assert zero.rotation == 0.0
        assert zero.squareness == pytest.approx(-0.572938698, abs=1e-9)
        assert zero.notices == (Notice.NOT_SQUARE,)


class TestSimulated:
    @given(
        lengths,
        lengths,
        st.floats(10, 900),
        st.floats(10, 900),
        angles,
        st.floats(0, 8),
        st.sampled_from([EdgeKind.POCKET, EdgeKind.WEB]),
    )
    def test_a_turned_rectangle_is_found(
        self, x: float, y: float, length: float, width: float, angle: float, tip: float, kind: EdgeKind
    ) -> None:
        assume(max(length, width) < 3 * min(length, width))
        zero = find_zero(kind, rectangle(kind, (x, y), (length, width), angle, tip), tip)
        found = (zero.x, zero.y, zero.length, zero.width, zero.rotation)
        assert found == pytest.approx((x, y, length, width, angle), abs=2e-8)
        assert max(map(abs, zero.residuals)) < 1e-8

    @given(lengths, lengths, angles, st.floats(0, 8))
    def test_a_turned_corner_is_found(self, x: float, y: float, angle: float, tip: float) -> None:
        touches = []
        for along in (20.0, 90.0):
            touches.append(Touch(*turned(along, -tip / 2, angle, (x, y)), UP))
            touches.append(Touch(*turned(-tip / 2, along, angle, (x, y)), RIGHT))
        zero = find_zero(EdgeKind.CORNER, touches, tip)
        assert (zero.x, zero.y, zero.rotation, zero.squareness) == pytest.approx((x, y, angle, 0.0), abs=2e-8)

    @runs(300, 5_000)
    @pytest.mark.parametrize("kind", [EdgeKind.POCKET, EdgeKind.WEB, EdgeKind.CORNER, EdgeKind.BORE])
    def test_stated_uncertainties_cover_what_happens(self, kind: EdgeKind, runs: int) -> None:
        """Within what is stated, two standard deviations, lie 95.4 % of simulated zeros."""
        random, sigma = np.random.default_rng(seed(3)), 0.002
        if kind is EdgeKind.BORE:
            true = [Touch(30 * cos(radians(t)), 30 * sin(radians(t))) for t in (10, 80, 190, 300)]
        elif kind is EdgeKind.CORNER:
            true = [Touch(20, -3, UP), Touch(120, -3, UP), Touch(-3, 15, RIGHT), Touch(-3, 80, RIGHT)]
        else:
            true = rectangle(kind, (0, 0), (120, 80), 0.0, 6.0)
        exact = find_zero(kind, true, 6.0, repeatability=sigma)
        assert exact.uncertainty
        inside = dict.fromkeys(exact.uncertainty, 0)
        for _ in range(runs):
            noisy = []
            for touch in true:
                off = random.normal(0, sigma)
                x, y = touch.x or 0.0, touch.y or 0.0
                if touch.approach is None:
                    r = np.hypot(x, y)
                    noisy.append(Touch(x * (1 + off / r), y * (1 + off / r)))
                else:
                    noisy.append(
                        Touch(
                            x + off * (touch.approach.axis == 0), y + off * (touch.approach.axis == 1), touch.approach
                        )
                    )
            found = find_zero(kind, noisy, 6.0)
            for name, stated in exact.uncertainty.items():
                inside[name] += abs(getattr(found, name) - getattr(exact, name)) <= stated
        for name, count in inside.items():
            assert count / runs == pytest.approx(0.954, abs=by_chance(0.954, runs)), name

    def test_a_short_arc_is_pointed_at(self) -> None:
        arc = [Touch(20 * cos(radians(t)), 20 * sin(radians(t))) for t in (0, 40, 80)]
        assert find_zero(EdgeKind.BORE, arc, 4.0).notices == (Notice.ONE_SIDED,)


class TestRefused:
    @pytest.mark.parametrize(
        ("kind", "touches", "why", "at"),
        [
            (EdgeKind.POCKET, [Touch(1, None, RIGHT)], Problem.TOO_FEW, ()),
            (EdgeKind.POCKET, [Touch(1, None, RIGHT), Touch(9, None, None)], Problem.NO_APPROACH, (2,)),
            (EdgeKind.POCKET, [Touch(1, None, RIGHT), Touch(9, None, RIGHT)], Problem.NO_COORDINATE, (1,)),
            (EdgeKind.POCKET, [Touch(1, 0, RIGHT), Touch(1, 9, RIGHT)], Problem.ONE_SIDE, (1, 2)),
            (EdgeKind.POCKET, [Touch(9, None, LEFT), Touch(1, None, RIGHT)], Problem.WRONG_SIDE, (1, 2)),
            (EdgeKind.WEB, [Touch(-9, None, LEFT), Touch(9, None, RIGHT)], Problem.WRONG_SIDE, (1, 2)),
            (EdgeKind.WEB, [Touch(5, None, LEFT), Touch(5, None, RIGHT)], Problem.SAME_PLACE, (1, 2)),
            (EdgeKind.WEB, [Touch(4, None, LEFT), Touch(-1, None, RIGHT)], Problem.SMALLER_THAN_TIP, ()),
            (EdgeKind.WEB, [Touch(4, None, LEFT), Touch(None, 1, UP)], Problem.ONE_SIDE, (1,)),
            (EdgeKind.CORNER, [Touch(4, None, LEFT), Touch(8, None, LEFT)], Problem.NO_COORDINATE, (1,)),
            (EdgeKind.CORNER, [Touch(4, 0, LEFT), Touch(8, 0, LEFT), Touch(0, 0, UP)], Problem.SAME_PLACE, (1, 2)),
            (EdgeKind.CORNER, [Touch(4, 0, LEFT), Touch(8, 0, RIGHT), Touch(0, 0, UP)], Problem.WRONG_SIDE, (1, 2)),
            (EdgeKind.CORNER, [Touch(0, 0, UP), Touch(10, 30, UP), Touch(5, 9, RIGHT)], Problem.TURNED_TOO_FAR, ()),
            (EdgeKind.BOSS, [Touch(3, 0), Touch(-3, 0), Touch(0, 3)], Problem.SMALLER_THAN_TIP, ()),
            (EdgeKind.BORE, [Touch(9, 0, LEFT), Touch(-9, 0), Touch(0, 9)], Problem.WRONG_SIDE, (1,)),
            (EdgeKind.BORE, [Touch(9, None, LEFT), Touch(1, None, RIGHT)], Problem.WRONG_SIDE, (1, 2)),
            (EdgeKind.BOSS, [Touch(9, None, RIGHT), Touch(1, None, LEFT)], Problem.WRONG_SIDE, (1, 2)),
            (EdgeKind.BOSS, [Touch(0, None, RIGHT), Touch(5, None, LEFT)], Problem.SMALLER_THAN_TIP, ()),
            (EdgeKind.BORE, [Touch(1, None, LEFT), Touch(None, 1, UP)], Problem.ONE_SIDE, (1,)),
            (EdgeKind.BORE, [Touch(9, None), Touch(-9, 0), Touch(0, 9)], Problem.NO_COORDINATE, (1,)),
        ],
    )
    def test_with_the_touches_that_are_meant(
        self, kind: EdgeKind, touches: list[Touch], why: Problem, at: tuple[int, ...]
    ) -> None:
        with pytest.raises(Unfit) as refused:
            find_zero(kind, touches, 6.0)
        assert (refused.value.why, refused.value.at) == (why, at)

    @pytest.mark.parametrize(
        ("touches", "reason"),
        [
            ([Touch(0, 0), Touch(5, 0)], Reason.TOO_FEW),
            ([Touch(0, 0), Touch(0, 0), Touch(5, 0)], Reason.COINCIDENT),
            ([Touch(0, 0), Touch(5, 0), Touch(10, 0)], Reason.COLLINEAR),
            ([Touch(float("nan"), 0), Touch(5, 0), Touch(10, 9)], Reason.NOT_FINITE),
        ],
    )
    def test_a_bore_without_a_circle(self, touches: list[Touch], reason: Reason) -> None:
        with pytest.raises(Degenerate) as refused:
            find_zero(EdgeKind.BORE, touches, 6.0)
        assert refused.value.reason is reason


@pytest.mark.parametrize(
    ("shifts", "limits", "state"),
    [
        ([], (0.01, 0.03), Shift.UNKNOWN),
        ([0.5], (None, None), Shift.UNKNOWN),
        ([0.01], (0.01, 0.03), Shift.STEADY),
        ([0.006, 0.008000001], (0.01, None), Shift.WARNING),
        ([0.018, -0.024], (0.01, 0.03), Shift.WARNING),
        ([0.031], (None, 0.03), Shift.ALARM),
    ],
)
def test_shifts_against_limits(shifts: list[float], limits: tuple[float | None, float | None], state: Shift) -> None:
    assert judge_shift(shifts, *limits) is state


def test_a_touch_that_does_not_fit_is_reported_where_the_repeatability_is_known() -> None:
    around = [(20 * cos(angle), 20 * sin(angle)) for angle in range(7)]
    good = [Touch(x, y) for x, y in around]
    chip = [Touch(x + 0.05 * (at == 2), y) for at, (x, y) in enumerate(around)]
    assert find_zero(EdgeKind.BORE, good, 6.0, repeatability=0.001).notices == ()
    assert find_zero(EdgeKind.BORE, chip, 6.0).notices == ()
    found = find_zero(EdgeKind.BORE, chip, 6.0, repeatability=0.001)
    assert found.notices == (Notice.MISFIT,)
    assert int(np.abs(found.residuals).argmax()) == 2
