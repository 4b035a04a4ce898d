"""The ball from its touches."""

from math import cos, pi, sin, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from app.core.rotary.sphere import NoSphere, SphereFault, fit_sphere, radius_is_wrong

RADIUS = 12.5


def touched(
    count: int = 6, centre: tuple[float, float, float] = (0, 0, 0), noise: float = 0.0, seed: int = 1
) -> list[list[float]]:
    """As cycle 452 touches: so many points in the plane of the equator, one from above."""
    around = [[RADIUS * cos(2 * pi * n / count), RADIUS * sin(2 * pi * n / count), 0.0] for n in range(count)]
    random = np.random.default_rng(seed)
    points = np.array([*around, [0, 0, RADIUS]])
    directions = points / RADIUS
    made: list[list[float]] = (
        points + np.array(centre) + directions * random.normal(0, noise, (count + 1, 1))
    ).tolist()
    return made


@given(some.tuples(*[some.floats(-2000, 2000)] * 3), some.integers(3, 8))
def test_a_perfect_ball_anywhere(centre: tuple[float, float, float], count: int) -> None:
    found = fit_sphere(touched(count, centre))
    assert found.centre == pytest.approx(centre, abs=1e-8)
    assert found.radius == pytest.approx(RADIUS, abs=1e-8)
    assert found.form < 1e-7


def test_the_stated_scatter_is_the_true_one() -> None:
    found = [fit_sphere(touched(8, noise=0.002, seed=seed)) for seed in range(400)]
    assert sqrt(np.mean([(each.deviation or 0) ** 2 for each in found])) == pytest.approx(0.002, rel=0.06)
    assert np.mean([each.centre[0] for each in found]) == pytest.approx(0, abs=0.0003)


def test_four_touches_say_nothing_of_scatter() -> None:
    assert fit_sphere(touched(3)).deviation is None


@pytest.mark.parametrize(
    ("touches", "fault"),
    [
        ([], SphereFault.TOO_FEW),
        (touched(3)[:3], SphereFault.TOO_FEW),
        (touched(8)[:8], SphereFault.FLAT),  # the equator alone
        ([[1, 2, 3]] * 5, SphereFault.FLAT),
        ([[n, 2 * n, 3 * n] for n in range(5)], SphereFault.FLAT),
    ],
)
def test_degenerate_touches_are_refused(touches: list[list[float]], fault: SphereFault) -> None:
    with pytest.raises(NoSphere) as caught:
        fit_sphere(touches)
    assert caught.value.fault is fault


@pytest.mark.parametrize(
    ("measured", "limit", "wrong"), [(12.51, 0.01, False), (12.4899, 0.01, True), (13, None, False), (12.5, 0, False)]
)
def test_the_radius_is_held_against_the_calibrated_one(measured: float, limit: float | None, wrong: bool) -> None:
    assert radius_is_wrong(measured, RADIUS, limit) is wrong
