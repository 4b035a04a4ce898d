"""Minimum zones against exhaustive search: every zone is borne by few touches, so all few can be tried."""

from collections.abc import Iterator
from itertools import combinations, permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.geometry.discs import circumscribed, inscribed
from app.core.geometry.minimum_zones import (
    minimum_zone_axis,
    minimum_zone_circle,
    minimum_zone_line,
    minimum_zone_plane,
)
from app.core.geometry.points import Degenerate, Floats, Reason
from tests.chance import examples
from tests.core.geometry.test_fits import rotation

seeds = st.integers(0, 2**32 - 1)


def lobed(random: np.random.Generator, count: int, size: float) -> Floats:
    angles = np.linspace(0, 2 * np.pi, count, endpoint=False) + random.uniform(-0.1, 0.1, count)
    reach = 25 + random.uniform(-size, size, count)
    found: Floats = np.column_stack([np.cos(angles), np.sin(angles)]) * reach[:, None]
    return found


def narrowest_strip(points: Floats) -> float:
    """Over every direction given by two points: one edge of the narrowest strip runs through two."""
    widths = []
    for a, b in combinations(points, 2):
        along = (b - a) / np.linalg.norm(b - a)
        widths.append(np.ptp(points @ np.array([-along[1], along[0]])))
    return float(min(widths))


def normals(points: Floats) -> Iterator[Floats]:
    """Of every slab that may be the narrowest: three on one side, or two on either."""
    for three in combinations(points, 3):
        yield np.cross(three[1] - three[0], three[2] - three[0])
    for a, b, c, d in permutations(points, 4):
        if a[0] <= b[0] and c[0] <= d[0] and a[0] <= c[0]:
            yield np.cross(b - a, d - c)


def narrowest_slab(points: Floats) -> float:
    widths = [np.ptp(points @ normal) / np.linalg.norm(normal) for normal in normals(points) if normal.any()]
    return float(min(widths))


def narrowest_ring(points: Floats) -> float:
    """Over every centre as far from two points as from each other, and from two further ones."""
    widths = []
    for a, b, c, d in permutations(range(len(points)), 4):
        if a < b and c < d and a < c:
            rows = 2 * np.array([points[b] - points[a], points[d] - points[c]])
            squares = (points**2).sum(axis=1)
            try:
                centre = np.linalg.solve(rows, np.array([squares[b] - squares[a], squares[d] - squares[c]]))
            except np.linalg.LinAlgError:
                continue
            if np.linalg.norm(centre) < 5:
                widths.append(np.ptp(np.linalg.norm(points - centre, axis=1)))
    return float(min(widths))


class TestExhaustively:
    @examples(50)
    @given(seeds, st.integers(3, 12))
    def test_a_strip(self, seed: int, count: int) -> None:
        random = np.random.default_rng(seed)
        points = np.column_stack([np.sort(random.uniform(0, 100, count)), random.uniform(-0.02, 0.02, count)])
        assert minimum_zone_line(points).width == pytest.approx(narrowest_strip(points), abs=1e-9)

    @examples(25)
    @given(seeds, st.integers(4, 7))
    def test_a_slab(self, seed: int, count: int) -> None:
        random = np.random.default_rng(seed)
        points = np.column_stack([random.uniform(0, 100, (count, 2)), random.uniform(-0.02, 0.02, count)])
        assert minimum_zone_plane(points).width == pytest.approx(narrowest_slab(points), abs=1e-9)

    @examples(25)
    @given(seeds, st.integers(5, 7), st.sampled_from([0.001, 0.02, 0.2]))
    def test_a_ring(self, seed: int, count: int, size: float) -> None:
        points = lobed(np.random.default_rng(seed), count, size)
        ring = minimum_zone_circle(points)
        assert ring.width == pytest.approx(narrowest_ring(points), abs=1e-9)
        distances = np.linalg.norm(points - ring.centre, axis=1)
        assert [ring.inner, ring.outer] == pytest.approx([distances.min(), distances.max()])

    @examples(25)
    @given(seeds, st.integers(4, 12))
    def test_the_smallest_circle_about_points(self, seed: int, count: int) -> None:
        points = np.random.default_rng(seed).normal(size=(count, 2))
        disc = circumscribed(points)
        assert np.linalg.norm(points - disc.centre, axis=1).max() == pytest.approx(disc.radius, abs=1e-9)
        on = [points[at] - disc.centre for at in disc.at]
        if len(on) == 2:  # as a diameter
            assert np.abs(on[0] + on[1]).max() < 1e-9
        else:  # a triangle without an obtuse angle
            turns = np.sort(np.arctan2([p[1] for p in on], [p[0] for p in on]))
            assert np.diff(turns, append=turns[0] + 2 * np.pi).max() <= np.pi + 1e-9

    @examples(50)
    @given(seeds)
    def test_the_largest_circle_among_them_rests_on_three_round_it(self, seed: int) -> None:
        points = lobed(np.random.default_rng(seed), 9, 0.05)
        disc = inscribed(points)
        assert np.linalg.norm(points - disc.centre, axis=1).min() == pytest.approx(disc.radius)
        turns = np.sort([np.arctan2(*(points[at] - disc.centre)[::-1]) for at in disc.at])
        assert len(turns) >= 2
        assert np.diff(turns, append=turns[0] + 2 * np.pi).max() <= np.pi + 1e-6


class TestAxis:
    def test_three_centres_in_a_bow(self) -> None:
        zone = minimum_zone_axis([(0.0, 0.0, 0.0), (0.01, 0.0, 10.0), (0.0, 0.0, 20.0)])
        assert 2 * zone.radius == pytest.approx(0.01, abs=1e-9)

    @examples(25)
    @given(seeds)
    def test_no_straight_line_nearby_has_a_narrower_cylinder(self, seed: int) -> None:
        random = np.random.default_rng(seed)
        points = np.column_stack([random.normal(0, 0.01, (6, 2)), np.linspace(0, 100, 6)])
        zone = minimum_zone_axis(points)
        for _ in range(60):
            bent = zone.direction + random.normal(0, 10 ** random.uniform(-7, -3), 3)
            bent /= np.linalg.norm(bent)
            about = points - (zone.point + random.normal(0, 10 ** random.uniform(-5, -2), 3))
            reach = np.linalg.norm(about - np.outer(about @ bent, bent), axis=1).max()
            assert reach >= zone.radius * (1 - 1e-5)

    @examples(20)
    @given(seeds, st.floats(-5000, 5000))
    def test_zones_do_not_mind_being_moved(self, seed: int, far: float) -> None:
        random = np.random.default_rng(seed)
        points = random.uniform(-1, 1, (9, 3)) * np.array([80.0, 50.0, 0.02])
        turn, shift = rotation(random), np.array([far, -far, far / 3])
        moved = points @ turn.T + shift
        assert minimum_zone_plane(moved).width == pytest.approx(minimum_zone_plane(points).width, abs=1e-8)
        bow = np.column_stack([random.normal(0, 0.01, (6, 2)), np.linspace(0, 100, 6)])
        here, there = minimum_zone_axis(bow), minimum_zone_axis(bow @ turn.T + shift)
        assert there.radius == pytest.approx(here.radius, rel=1e-5, abs=1e-8)


class TestNothingToFind:
    def test_a_true_circle_line_and_plane_have_zones_of_nothing(self) -> None:
        angles = np.linspace(0, 2 * np.pi, 8, endpoint=False)
        round_points = np.column_stack([10 + 5 * np.cos(angles), 5 * np.sin(angles)])
        assert minimum_zone_circle(round_points).width < 1e-9
        assert minimum_zone_line([(x, 2 * x) for x in range(6)]).width < 1e-9
        assert minimum_zone_plane([(x, y, x - y) for x in range(3) for y in range(3)]).width < 1e-9
        assert minimum_zone_axis([(0, 0, z) for z in range(4)]).radius < 1e-9

    def test_touches_on_one_side_carry_no_inscribed_circle(self) -> None:
        half = [(5 * np.cos(a), 5 * np.sin(a)) for a in np.linspace(0, 3, 6)]
        with pytest.raises(Degenerate) as refused:
            inscribed(half)
        assert refused.value.reason is Reason.SHORT_ARC
