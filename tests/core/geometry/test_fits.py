"""Circle, line, plane by least squares: published numbers, reference data whose solution is known, refusals.

Published examples lie in app/quality/proof/cases/geometry.json and run in tests/quality/proof. Here are reference pairs made as M. G. Cox
and A. B. Forbes do (Strategies for testing assessment software, NPL DITC 211/92): an element is chosen, points are laid
about it with residuals orthogonal to everything the element could change by, so that its least-squares fit is that very
element, to the last digit.
"""

from math import cos, radians, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.geometry.circle import fit_circle
from app.core.geometry.line import fit_line, line_through
from app.core.geometry.plane import fit_plane
from app.core.geometry.points import Degenerate, Floats, Reason
from tests.chance import examples

seeds = st.integers(0, 2**32 - 1)
places = st.floats(-5000, 5000)


def rotation(random: np.random.Generator) -> Floats:
    """Any rotation of space."""
    found, upper = np.linalg.qr(random.normal(size=(3, 3)))
    found = found * np.sign(np.diag(upper))
    return found if np.linalg.det(found) > 0 else found * np.array([1.0, 1.0, -1.0])


def orthogonal_to(jacobian: Floats, random: np.random.Generator, size: float) -> Floats:
    """Residuals that no change of the element takes anything off."""
    basis = np.linalg.qr(jacobian)[0]
    residuals = random.normal(size=len(jacobian))
    for _ in range(2):
        residuals -= basis @ (basis.T @ residuals)
    found: Floats = residuals * size / np.abs(residuals).max()
    return found


class TestReferencePairs:
    @given(seeds, places, places, st.floats(1, 500), st.floats(1e-4, 0.2))
    def test_a_circle(self, seed: int, x: float, y: float, radius: float, size: float) -> None:
        random = np.random.default_rng(seed)
        angles = np.linspace(0, 2 * np.pi, 12, endpoint=False) + random.uniform(-0.2, 0.2, 12)
        units = np.column_stack([np.cos(angles), np.sin(angles)])
        off = orthogonal_to(np.column_stack([units, np.ones(12)]), random, size * radius / 10)
        found = fit_circle(np.array([x, y]) + units * (radius + off)[:, None])
        assert found.centre == pytest.approx([x, y], abs=1e-9)
        assert found.radius == pytest.approx(radius, abs=1e-9)
        assert found.residuals == pytest.approx(off, abs=1e-9)

    @examples(40)
    @given(seeds, st.floats(60, 320), st.floats(1, 500))
    def test_a_circle_from_an_arc(self, seed: int, arc: float, radius: float) -> None:
        random = np.random.default_rng(seed)
        angles = np.radians(np.linspace(0, arc, 15))
        units = np.column_stack([np.cos(angles), np.sin(angles)])
        off = orthogonal_to(np.column_stack([units, np.ones(15)]), random, 1e-4 * radius)
        found = fit_circle(np.array([40.0, -7.0]) + units * (radius + off)[:, None])
        assert found.centre == pytest.approx([40.0, -7.0], abs=1e-8 * radius)
        assert found.arc == pytest.approx(arc, abs=0.5)

    @given(seeds, places, places, places)
    def test_a_line_in_space(self, seed: int, x: float, y: float, z: float) -> None:
        random = np.random.default_rng(seed)
        turn = rotation(random)
        along = np.sort(random.uniform(-100, 100, 9))
        levers = np.column_stack([np.ones(9), along])
        off = np.column_stack([orthogonal_to(levers, random, 0.05) for _ in range(2)])
        points = np.array([x, y, z]) + np.column_stack([off, along]) @ turn.T
        found = fit_line(points, 3)
        assert abs(found.direction @ turn[:, 2]) == pytest.approx(1, abs=1e-13)
        assert line_through(np.array([x, y, z]), turn[:, 2], found.point[None]).residuals == pytest.approx(0, abs=1e-8)
        assert found.residuals == pytest.approx(np.hypot(*off.T), abs=1e-8)

    @given(seeds, places, places, places)
    def test_a_plane(self, seed: int, x: float, y: float, z: float) -> None:
        random = np.random.default_rng(seed)
        turn = rotation(random)
        flat = random.uniform(-100, 100, (10, 2))
        off = orthogonal_to(np.column_stack([np.ones(10), flat]), random, 0.05)
        points = np.array([x, y, z]) + np.column_stack([flat, off]) @ turn.T
        found = fit_plane(points)
        assert abs(found.normal @ turn[:, 2]) == pytest.approx(1, abs=1e-13)
        assert (found.point - np.array([x, y, z])) @ turn[:, 2] == pytest.approx(0, abs=1e-8)
        side = np.sign(found.normal @ turn[:, 2])
        assert found.residuals * side == pytest.approx(off, abs=1e-8)


class TestInvariance:
    @given(seeds, places, places, st.floats(0, 360))
    def test_a_circle_moves_with_its_points(self, seed: int, x: float, y: float, angle: float) -> None:
        random = np.random.default_rng(seed)
        around = random.uniform(0, 2 * np.pi) + np.linspace(0, 5, 9)
        points = np.column_stack([np.cos(around), np.sin(around)]) * random.uniform(24.9, 25.1, 9)[:, None]
        turn = np.array([[cos(radians(angle)), -sin(radians(angle))], [sin(radians(angle)), cos(radians(angle))]])
        here, there = fit_circle(points), fit_circle(points @ turn.T + np.array([x, y]))
        assert there.radius == pytest.approx(here.radius, abs=1e-9)
        assert there.centre == pytest.approx(turn @ here.centre + np.array([x, y]), abs=1e-8)
        assert there.residuals == pytest.approx(here.residuals, abs=1e-8)

    @given(seeds, places, places, places)
    def test_a_plane_and_a_line_too(self, seed: int, x: float, y: float, z: float) -> None:
        random = np.random.default_rng(seed)
        points = random.uniform(-1, 1, (12, 3)) * np.array([100.0, 40.0, 0.05])
        turn, shift = rotation(random), np.array([x, y, z])
        moved = points @ turn.T + shift
        assert fit_plane(moved).range == pytest.approx(fit_plane(points).range, abs=1e-8)
        assert abs(fit_plane(moved).normal @ (turn @ fit_plane(points).normal)) == pytest.approx(1, abs=1e-12)
        assert fit_line(moved, 3).rms == pytest.approx(fit_line(points, 3).rms, abs=1e-8)
        assert abs(fit_line(moved, 3).direction @ (turn @ fit_line(points, 3).direction)) == pytest.approx(1, abs=1e-12)


def ring(angles: list[float], radius: float = 25.0) -> list[tuple[float, float]]:
    return [(radius * cos(radians(a)), radius * sin(radians(a))) for a in angles]


class TestRefused:
    @pytest.mark.parametrize(
        ("points", "reason", "at"),
        [
            ([], Reason.TOO_FEW, ()),
            ([(0, 0), (1, 1)], Reason.TOO_FEW, ()),
            ([(0, 0), (1, 1), (2, 2), (5, 5)], Reason.COLLINEAR, ()),
            ([(1e6, 1e6), (1e6 - 1, 1e6 - 1), (1e6 - 2, 1e6 - 2)], Reason.COLLINEAR, ()),
            ([(0, 0), (1, 0), (0, 0)], Reason.COINCIDENT, (1, 3)),
            ([(3, 3), (3, 3), (3, 3)], Reason.COINCIDENT, (1, 2)),
            ([(0, 0), (1, 0), (0, float("nan"))], Reason.NOT_FINITE, (3,)),
            ([(0, 0), (float("inf"), 0), (0, 1)], Reason.NOT_FINITE, (2,)),
            ([(0, 0), (1, 0), (0, 2e6)], Reason.TOO_FAR, (3,)),
            (ring([0, 5, 10, 15]), Reason.SHORT_ARC, ()),
            (ring([0, 0.01, 0.02]), Reason.SHORT_ARC, ()),
        ],
    )
    def test_points_that_carry_no_circle(
        self, points: list[tuple[float, float]], reason: Reason, at: tuple[int, ...]
    ) -> None:
        with pytest.raises(Degenerate) as refused:
            fit_circle(points)
        assert (refused.value.reason, refused.value.at) == (reason, at)

    def test_a_one_sided_arc_says_how_short_it_is(self) -> None:
        with pytest.raises(Degenerate) as refused:
            fit_circle(ring([10, 15, 20, 29]))
        assert [refused.value.have, refused.value.needed] == pytest.approx([19, 30], abs=0.01)
        assert fit_circle(ring([10, 15, 20, 41])).radius == pytest.approx(25, abs=1e-9)

    def test_points_that_carry_no_plane_and_no_line(self) -> None:
        for solid, reason in (
            ([(0, 0, 0), (1, 1, 1), (2, 2, 2)], Reason.COLLINEAR),
            ([(0, 0, 0), (1, 1, 1), (0, 0, 0)], Reason.COINCIDENT),
            ([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)], Reason.NO_DIRECTION),
        ):
            with pytest.raises(Degenerate) as refused:
                fit_plane(solid)
            assert refused.value.reason is reason
        for points, reason in (
            ([(1, 1), (1, 1)], Reason.COINCIDENT),
            ([(1, 1)], Reason.TOO_FEW),
            ([(1, 1), (1, -1), (-1, 1), (-1, -1)], Reason.NO_DIRECTION),
        ):
            with pytest.raises(Degenerate) as refused:
                fit_line(points)
            assert refused.value.reason is reason
