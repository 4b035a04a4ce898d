"""Set-up error: the printed formulas, simulated displacements recovered, layouts that do not hold, touches that misfit."""

from math import degrees, hypot, pi, radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.geometry import in_plane
from app.core.geometry.alignment import Alignment, Method, Touch, align
from app.core.geometry.frames import angles_of, applied, frame, from_angles, inverse, on_pallet, turned, vector_of
from app.core.geometry.layout import Loose, NotLaidOut
from app.core.geometry.points import Degenerate, Floats
from tests.chance import by_chance, examples, runs, seed

Face = tuple[tuple[float, float, float], tuple[float, float, float]]
SIX: list[Face] = [
    ((10, 10, 0), (0, 0, 1)),
    ((180, 15, 0), (0, 0, 1)),
    ((90, 120, 0), (0, 0, 1)),
    ((20, 0, -15), (0, 1, 0)),
    ((170, 0, -15), (0, 1, 0)),
    ((0, 60, -15), (1, 0, 0)),
]
MORE: list[Face] = [*SIX, ((30, 125, 0), (0, 0, 1)), ((100, 0, -15), (0, 1, 0)), ((0, 100, -15), (1, 0, 0))]
lengths = st.floats(-3, 3)
small = st.floats(-0.02, 0.02)
directions = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda each: hypot(*each) > 0.01)


def touched(faces: list[Face], motion: Floats, noise: list[float] | None = None) -> list[Touch]:
    """Points at which a probe that moves along the nominal normal meets the faces of the moved part."""
    found = []
    for at, (nominal, normal) in enumerate(faces):
        n, r = np.array(normal, dtype=float), np.array(nominal, dtype=float)
        facing = motion[:3, :3] @ n
        reach = float(facing @ (applied(motion, r[None, :])[0] - r) / (facing @ n))
        found.append(Touch.off_by(nominal, normal, reach + (noise[at] if noise else 0.0)))
    return found


class TestTip:
    def test_centres_of_the_tip_say_the_same_as_points_on_the_faces(self) -> None:
        """A tip of 6 mm stands 3 mm before each face of the turned part, along the normal that the face then has."""
        motion = frame(from_angles(0.4, -0.7, 5.0), [2.0, -1.0, 0.5])
        surface, centres = [], []
        for nominal, normal in MORE:
            point = applied(motion, np.array([nominal], dtype=float))[0]
            surface.append(Touch(nominal, normal, tuple(point)))
            centre = point + 3.0 * motion[:3, :3] @ np.array(normal, dtype=float)
            centres.append(Touch.by_tip(nominal, normal, tuple(centre), 6.0))
        for found in (align(surface), align(centres)):
            assert found.motion == pytest.approx(motion, abs=1e-9)
            assert found.rms == pytest.approx(0, abs=1e-9)


class TestPrinted:
    def test_the_formulas_by_hand(self) -> None:
        """Points 1–3 at (0, 0), (100, 0), (0, 50) with 0.01, 0.03, 0.02: c = 10 µm, lambda = 10 µm/50 mm,
        beta = -20 µm/100 mm. Points 4, 5 at x = 0, 100 with 0.00, 0.05: gamma = 50 µm/100 mm, b = 0. a = 0.007."""
        faces: list[Face] = [
            ((0, 0, 0), (0, 0, 1)),
            ((100, 0, 0), (0, 0, 1)),
            ((0, 50, 0), (0, 0, 1)),
            ((0, 0, 0), (0, 1, 0)),
            ((100, 0, 0), (0, 1, 0)),
            ((0, 0, 0), (1, 0, 0)),
        ]
        felt = [0.01, 0.03, 0.02, 0.0, 0.05, 0.007]
        touches = [Touch.off_by(*face, deviation=d) for face, d in zip(faces, felt, strict=True)]
        for method in (Method.PRINTED, Method.SMALL):
            found = align(touches, method)
            assert found.shift == pytest.approx((0.007, 0.0, 0.01), abs=1e-12)
            assert found.turns == pytest.approx(tuple(map(degrees, (0.0002, -0.0002, 0.0005))), abs=1e-12)
        assert align(touches).difference < 1e-4
        assert align(touches).deviations == pytest.approx(felt, abs=1e-12)

    def test_the_rows_of_lambda_and_beta_as_printed_in_the_source_are_swapped(self) -> None:
        """A part that is only tilted about X: the source's second row would call it beta."""
        tilted = align(touched(SIX, frame(turned([1e-4, 0, 0]), [0, 0, 0])), Method.PRINTED)
        assert tilted.turns[0] == pytest.approx(degrees(1e-4), rel=1e-6)
        assert abs(tilted.turns[1]) < 1e-9

    def test_short_form_and_rows_differ_where_points_do_not_lie_at_z_0(self) -> None:
        tilted = touched(SIX, frame(turned([0, 1e-3, 0]), [0, 0, 0]))
        printed, rows = align(tilted, Method.PRINTED), align(tilted, Method.SMALL)
        assert abs(rows.shift[0]) < 2e-5
        assert printed.shift[0] == pytest.approx(-0.015, abs=1e-4)  # takes beta·z of point 6 for a shift

    def test_the_short_form_asks_for_3_2_1(self) -> None:
        for faces in (MORE, [*SIX[:4], SIX[5], SIX[4]]):
            with pytest.raises(NotLaidOut) as refused:
                align(touched(faces, np.eye(4)), Method.PRINTED)
            assert refused.value.why is Loose.NOT_321


class TestRecovered:
    @given(lengths, lengths, lengths, small, small, small, st.sampled_from([SIX, MORE]))
    def test_a_small_displacement(
        self, a: float, b: float, c: float, x: float, y: float, z: float, faces: list[Face]
    ) -> None:
        motion = frame(turned([x, y, z]), [a, b, c])
        found = align(touched(faces, motion))
        assert np.abs(found.motion - motion).max() < 1e-9
        assert np.degrees(vector_of(motion[:3, :3])) == pytest.approx(found.turns, abs=1e-9)
        assert max(map(abs, found.residuals)) < 1e-9

    @pytest.mark.parametrize("turn", [(5.0, -3.0, 20.0), (-12.0, 8.0, -30.0)])
    def test_a_large_one_exactly_while_small_angles_miss(self, turn: tuple[float, float, float]) -> None:
        motion = frame(from_angles(*turn), [4.0, -2.0, 1.0])
        exact, rows = align(touched(MORE, motion)), align(touched(MORE, motion), Method.SMALL)
        assert exact.angles == pytest.approx(turn, abs=1e-8)
        assert exact.shift == pytest.approx((4.0, -2.0, 1.0), abs=1e-8)
        assert exact.difference > 1.0
        assert np.abs(rows.motion - motion).max() > 0.01

    @examples(50)
    @given(lengths, lengths, lengths, st.floats(-180, 180), st.floats(-1000, 1000))
    def test_it_does_not_matter_how_the_machine_lies(
        self, a: float, b: float, c: float, angle: float, far: float
    ) -> None:
        """Rigid-motion invariance: part, touches and displacement all seen from another frame."""
        motion = frame(turned([0.002, -0.001, 0.003]), [a, b, c])
        seen = frame(from_angles(20.0, -10.0, angle), [far, -far, far / 2])
        touches = [
            Touch(
                tuple(applied(seen, [t.nominal])[0]),
                tuple(seen[:3, :3] @ np.array(t.normal)),
                tuple(applied(seen, [t.measured])[0]),
            )
            for t in touched(MORE, motion)
        ]
        expected = seen @ motion @ inverse(seen)
        assert np.abs(align(touches).motion - expected).max() < 1e-7
        assert align(touches).condition == pytest.approx(align(touched(MORE, motion)).condition, rel=1e-6)

    def test_three_touches_on_the_base_alone(self) -> None:
        motion = frame(turned([0.001, 0.0005, 0]), [0, 0, 0.2])
        found = align(touched(SIX[:3], motion), solve_for=("c", "lambda", "beta"))
        assert found.shift[2] == pytest.approx(0.2, abs=1e-4)
        assert found.turns[:2] == pytest.approx((degrees(0.001), degrees(0.0005)), abs=1e-5)
        assert found.solved_for == ("c", "lambda", "beta")
        assert found.turns[2] == pytest.approx(0, abs=1e-4)

    @runs(200, 1_500)
    def test_stated_uncertainties_cover_what_happens(self, runs: int) -> None:
        random, sigma = np.random.default_rng(seed(7)), 0.003
        motion = frame(turned([0.001, -0.002, 0.004]), [0.3, -0.2, 0.1])
        stated = align(touched(MORE, motion), repeatability=sigma).uncertainty
        inside = dict.fromkeys(stated, 0)
        for _ in range(runs):
            found = align(touched(MORE, motion, random.normal(0, sigma, len(MORE)).tolist()))
            off = np.concatenate(
                [np.subtract(found.shift, motion[:3, 3]), np.subtract(found.turns, np.degrees([0.001, -0.002, 0.004]))]
            )
            for name, each in zip(stated, off, strict=True):
                inside[name] += abs(each) <= stated[name]
        assert len(stated) == 6
        for name, count in inside.items():
            assert count / runs == pytest.approx(0.954, abs=by_chance(0.954, runs)), name


class TestHowWell:
    def test_six_touches_check_nothing_and_more_do(self) -> None:
        six, more = align(touched(SIX, np.eye(4))), align(touched(MORE, np.eye(4)))
        assert six.leverage == pytest.approx([1.0] * 6)
        assert max(more.leverage) < 1
        assert sum(more.leverage) == pytest.approx(6)
        six, more = (align(touched(faces, np.eye(4)), repeatability=0.001) for faces in (SIX, MORE))
        assert all(more.uncertainty[name] < six.uncertainty[name] for name in six.uncertainty)

    def test_near_touches_make_a_bad_condition_and_the_advice_helps(self) -> None:
        near = [*SIX[:3], ((88.0, 0.0, -15.0), (0.0, 1.0, 0.0)), ((92.0, 0.0, -15.0), (0.0, 1.0, 0.0)), SIX[5]]
        found = align(touched(near, np.eye(4)))
        assert found.condition > 30
        assert found.advice is not None
        assert (
            abs(found.advice.normal[1]) == 1 or abs(found.advice.normal[0]) == 1
        )  # something that feels the turn about Z
        better = align(touched([*near, (found.advice.place, found.advice.normal)], np.eye(4)))
        assert better.condition < found.condition / 5
        assert found.advice.gain > 5
        assert abs(found.weakest[5]) > 0.9

    def test_the_touch_that_does_not_fit_is_named(self) -> None:
        motion = frame(turned([0.001, -0.002, 0.004]), [0.3, -0.2, 0.1])
        random = np.random.default_rng(5)
        noise = random.normal(0, 0.001, len(MORE)).tolist()
        assert align(touched(MORE, motion, noise), repeatability=0.001).misfits == ()
        noise[6] += 0.05
        assert align(touched(MORE, motion, noise), repeatability=0.001).misfits == ((1, 2, 3, 7),)
        more = [*MORE, ((150.0, 110.0, 0.0), (0.0, 0.0, 1.0))]  # a fifth on the face tells which
        assert align(touched(more, motion, [*noise, 0.0]), repeatability=0.001).misfits == ((7,),)
        assert align(touched(SIX, motion, noise[:6]), repeatability=0.001).misfits == ()

    def test_and_without_knowing_the_probe(self) -> None:
        faces = [
            *MORE,
            ((150.0, 110.0, 0.0), (0.0, 0.0, 1.0)),
            ((60.0, 0.0, -5.0), (0.0, 1.0, 0.0)),
            ((0.0, 20.0, -5.0), (1.0, 0.0, 0.0)),
        ]
        rounding = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1e-10] + [0.0] * (len(faces) - 7)
        assert align(touched(faces, np.eye(4), rounding)).misfits == ()
        noise = np.random.default_rng(2).normal(0, 0.001, len(faces))
        assert align(touched(faces, np.eye(4), noise.tolist())).misfits == ()
        noise[8] += 0.1
        assert align(touched(faces, np.eye(4), noise.tolist())).misfits == ((9,),)

    @runs(150, 1_000)
    def test_good_touches_are_seldom_named(self, runs: int) -> None:
        random = np.random.default_rng(seed(11))
        named = sum(
            bool(align(touched(MORE, np.eye(4), random.normal(0, 0.002, 9).tolist()), repeatability=0.002).misfits)
            for _ in range(runs)
        )
        assert named / runs <= 0.05 + by_chance(0.05, runs)


class TestNotLaidOut:
    @pytest.mark.parametrize(
        ("faces", "why", "at", "move"),
        [
            (SIX[:5], Loose.TOO_FEW, (), None),
            (
                [((10, 10, 0), (0, 0, 1)), ((50, 50, 0), (0, 0, 1)), ((90, 90, 0), (0, 0, 1)), *SIX[3:]],
                Loose.COLLINEAR_BASE,
                (1, 2, 3),
                2,
            ),
            ([*SIX[:3], SIX[3], ((20, 0, -40), (0, 1, 0)), SIX[5]], Loose.SAME_PLACE, (4, 5), 5),
            ([*SIX[:5], ((50, 0, -9), (0, 1, 0))], Loose.PARALLEL_NORMALS, (4, 5, 6), 6),
            (
                [*SIX[:3], ((9, 9, 0), (0, 0, -1)), ((90, 9, 0), (0, 0, 1)), ((9, 99, 0), (0, 0, 1))],
                Loose.PARALLEL_NORMALS,
                (1, 2, 3, 4, 5, 6),
                5,
            ),
        ],
    )
    def test_with_a_reason_and_what_to_move(
        self, faces: list[Face], why: Loose, at: tuple[int, ...], move: int | None
    ) -> None:
        with pytest.raises(NotLaidOut) as refused:
            align([Touch.off_by(*face, deviation=0.0) for face in faces])
        assert (refused.value.why, refused.value.at, refused.value.move) == (why, at, move)

    def test_the_touch_to_move_is_one_that_is_not_missed(self) -> None:
        guiding = [((x, 0, 0), (0, -1, 0)) for x in (20, 120, 60)]
        faces: list[Face] = [*[((x, y, 0), (0, 0, 1)) for x, y in ((0, 0), (50, 0), (100, 100))], *guiding]
        with pytest.raises(NotLaidOut) as refused:
            align([Touch.off_by(*face, deviation=0.0) for face in faces])
        assert refused.value.move in {4, 5, 6}  # three touches of the base are needed, two of the guide
        assert refused.value.helpful is not None
        faces[refused.value.move - 1] = refused.value.helpful[:2]
        assert align([Touch.off_by(*face, deviation=0.0) for face in faces]).condition < 100

    def test_the_free_motion_is_known_and_the_advice_stops_it(self) -> None:
        faces: list[Face] = [((10, 10, 0), (0, 0, 1)), ((50, 10, 0), (0, 0, 1)), ((90, 10, 0), (0, 0, 1)), *SIX[3:]]
        with pytest.raises(NotLaidOut) as refused:
            align([Touch.off_by(*face, deviation=0.0) for face in faces])
        assert abs(refused.value.free[3]) > 0.5  # about X
        assert refused.value.helpful is not None
        place, normal, _gain = refused.value.helpful
        assert align([Touch.off_by(*face, deviation=0.0) for face in [*faces, (place, normal)]]).condition < 100

    @pytest.mark.parametrize(
        "touch",
        [
            Touch((0, 0, 0), (0, 0, 0), (0, 0, 0)),
            Touch((float("nan"), 0, 0), (0, 0, 1), (0, 0, 0)),
            Touch((0, 0, 0), (0, 0, 1), (float("inf"), 0, 0)),
            Touch((1e9, 0, 0), (0, 0, 1), (0, 0, 0)),
        ],
    )
    def test_what_is_no_touch(self, touch: Touch) -> None:
        with pytest.raises(Degenerate):
            align([*touched(MORE, np.eye(4)), touch])
        with pytest.raises(Degenerate):
            align([])


class TestInPlane:
    @given(st.floats(-179, 179), st.floats(-500, 500), st.floats(-500, 500))
    def test_two_holes_recover_shift_and_turn(self, angle: float, x: float, y: float) -> None:
        motion = frame(from_angles(0, 0, angle), [x, y, 0])
        nominal = [(10.0, 20.0), (110.0, 50.0)]
        holes = [
            in_plane.Hole((float(p[0]), float(p[1]))) for p in applied(motion, [(*place, 0.0) for place in nominal])
        ]
        found = in_plane.two_holes(nominal, holes)
        assert np.abs(found.motion - motion).max() < 1e-9
        assert found.off == pytest.approx(0, abs=1e-9)

    def test_holes_from_their_touches(self) -> None:
        """Two 30 mm holes 100 apart on a part that is turned by 30'; tip 6, four and three touches."""
        motion = frame(from_angles(0, 0, 0.5), [2.0, -1.0, 0.0])
        holes = []
        for place, turns in (((0.0, 0.0), (0, 90, 180, 270)), ((100.0, 0.0), (20, 150, 260))):
            centre = applied(motion, [(*place, 0.0)])[0]
            ring = [(centre[0] + 12 * np.cos(radians(t)), centre[1] + 12 * np.sin(radians(t))) for t in turns]
            holes.append(in_plane.Hole.from_touches(ring, 6.0))
        found = in_plane.two_holes([(0, 0), (100, 0)], holes, 0.001)
        assert found.angle == pytest.approx(0.5, abs=1e-9)
        assert [hole.diameter for hole in holes] == pytest.approx([30.0, 30.0])
        # each centre of four touches: sigma²/2 across; of three about 2/3: gamma = 2·sqrt(0.5 + v)·1 µm/100 mm
        assert found.uncertainty["gamma"] == pytest.approx(
            degrees(2e-5 * hypot(0.5**0.5, holes[1].cofactors[1] ** 0.5)), rel=1e-2
        )

    def test_two_points_turn_a_side_and_leave_it_along(self) -> None:
        found = in_plane.two_points([(0, 0), (200, 0)], [(0, 0.0), (200, 0.2)], 0.001)
        assert found.angle == pytest.approx(degrees(np.arctan(0.001)), abs=1e-9)
        assert found.motion[:2, 3] == pytest.approx([0, 0], abs=1e-9)
        assert found.uncertainty["gamma"] == pytest.approx(degrees(2e-3 * 2**0.5 / 200), rel=1e-6)

    def test_the_table_takes_the_turn_and_the_frame_the_rest(self) -> None:
        motion = frame(from_angles(0.02, -0.01, 0.7), [1.0, 2.0, 3.0])
        for clockwise, position in ((True, 90.7), (False, 89.3)):
            done = in_plane.by_table(motion, in_plane.Table((300.0, 200.0), 90.0, clockwise))
            assert done.position == pytest.approx(position)
            assert angles_of(done.motion[:3, :3])[2] == pytest.approx(0, abs=1e-9)
            # A point of the part: displaced, then turned back about the table's axis.
            there = applied(motion, [[50.0, 60.0, 7.0]])[0] - [300, 200, 0]
            expected = from_angles(0, 0, -0.7) @ there + [300, 200, 0]
            assert applied(done.motion, [[50.0, 60.0, 7.0]])[0] == pytest.approx(expected)

    def test_coincident_points_are_refused(self) -> None:
        with pytest.raises(Degenerate):
            in_plane.two_points([(0, 0), (0, 0)], [(0, 0), (1, 1)])


NEAR_HALF_A_TURN = st.builds(lambda small, sign: pi - sign * 10.0**-small, st.floats(1, 16), st.sampled_from([0, 1]))


class TestRotationVectors:
    @given(directions, st.floats(0, pi) | NEAR_HALF_A_TURN)
    def test_the_vector_makes_the_rotation_again(self, direction: tuple[float, float, float], angle: float) -> None:
        way = np.array(direction) / np.linalg.norm(direction)
        rotation = turned(way * angle)
        vector = vector_of(rotation)
        assert np.abs(turned(vector) - rotation).max() < 1e-12
        assert np.linalg.norm(vector) == pytest.approx(angle, abs=1e-9)
        if pi - angle > 1e-6:  # nearer to half a turn both senses are the same
            assert vector == pytest.approx(way * angle, abs=1e-9)

    def test_half_a_turn_about_z(self) -> None:
        made = in_plane.two_points([(0, 0), (100, 0)], [(100, 0), (0, 0)])
        assert np.degrees(vector_of(made.motion[:3, :3])) == pytest.approx([0, 0, 180])


class TestPallets:
    @given(small, small, small, lengths, lengths, st.floats(-180, 180))
    def test_composed_as_a_point_feels_it(
        self, x: float, y: float, z: float, a: float, b: float, pose_angle: float
    ) -> None:
        pallet, part = frame(turned([x, y, z]), [a, b, 0.1]), frame(turned([z, x, y]), [b, 0.2, a])
        pose = frame(from_angles(0, 0, pose_angle), [500.0, 300.0, 100.0])
        r = np.array([[20.0, -30.0, 40.0]])  # of the part, in the pallet's coordinates
        machine = applied(pallet, applied(pose, applied(part, r)))
        nominal = applied(pose, r)
        assert applied(on_pallet(pallet, part, pose), nominal)[0] == pytest.approx(machine[0], abs=1e-9)

    def test_measured_from_end_to_end(self) -> None:
        """Touches of the part on the pallet that lies off give what the two errors compose to."""
        pallet, part = frame(turned([0.001, 0, 0.002]), [0.1, 0.2, 0.3]), frame(turned([0, 0.003, 0]), [0.0, 0.1, 0.0])
        whole: Alignment = align(touched(MORE, pallet @ part))
        separate = on_pallet(align(touched(MORE, pallet)).motion, align(touched(MORE, part)).motion)
        assert np.abs(whole.motion - separate).max() < 1e-9
