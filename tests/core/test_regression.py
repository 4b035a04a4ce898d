"""Multiple regression: a certified case, coverage of its intervals, and what holds for all data."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.regression import LEVEL, LeftOut, regression
from app.core.spc.refusal import Refused

# NIST Statistical Reference Datasets, linear regression, "Longley" (Longley 1967, J. Am. Stat. Assoc. 62, 819): level of
# difficulty high, for its columns are nearly collinear. https://www.itl.nist.gov/div898/strd/lls/data/Longley.shtml
LONGLEY = np.array([
    [60323, 83.0, 234289, 2356, 1590, 107608, 1947],
    [61122, 88.5, 259426, 2325, 1456, 108632, 1948],
    [60171, 88.2, 258054, 3682, 1616, 109773, 1949],
    [61187, 89.5, 284599, 3351, 1650, 110929, 1950],
    [63221, 96.2, 328975, 2099, 3099, 112075, 1951],
    [63639, 98.1, 346999, 1932, 3594, 113270, 1952],
    [64989, 99.0, 365385, 1870, 3547, 115094, 1953],
    [63761, 100.0, 363112, 3578, 3350, 116219, 1954],
    [66019, 101.2, 397469, 2904, 3048, 117388, 1955],
    [67857, 104.6, 419180, 2822, 2857, 118734, 1956],
    [68169, 108.4, 442769, 2936, 2798, 120445, 1957],
    [66513, 110.8, 444546, 4681, 2637, 121950, 1958],
    [68655, 112.6, 482704, 3813, 2552, 123366, 1959],
    [69564, 114.2, 502601, 3931, 2514, 125368, 1960],
    [69331, 115.7, 518173, 4806, 2572, 127852, 1961],
    [70551, 116.9, 554894, 4007, 2827, 130081, 1962],
])  # fmt: skip
CERTIFIED = {
    "x1": (15.0618722713733, 84.9149257747669),
    "x2": (-0.358191792925910e-01, 0.334910077722432e-01),
    "x3": (-2.02022980381683, 0.488399681651699),
    "x4": (-1.03322686717359, 0.214274163161675),
    "x5": (-0.511041056535807e-01, 0.226073200069370),
    "x6": (1829.15146461355, 455.478499142212),
}


def columns_of(rng: np.random.Generator, count: int) -> dict[str, Any]:
    slow = np.cumsum(rng.normal(size=count)) / 5
    return {"slow": slow, "saw": np.arange(count) % 17 * 1.0, "mixed": slow + rng.normal(size=count)}


def test_the_certified_values_of_longley() -> None:
    columns = {f"x{at}": LONGLEY[:, at] for at in range(1, 7)}
    found = regression(LONGLEY[:, 0], columns, independent=True)
    for name, (value, error) in CERTIFIED.items():
        assert found.effects[name].value == pytest.approx(value, rel=1e-9)
        assert found.effects[name].standard_error == pytest.approx(error, rel=1e-9)
    assert found.scatter == pytest.approx(304.854073561965, rel=1e-9)
    assert found.r_squared == pytest.approx(0.995479004577296, rel=1e-12)
    assert found.effects["x2"].inflation == pytest.approx(1788.5, abs=0.1)
    assert {name for name, effect in found.effects.items() if effect.inflated} == {"x1", "x2", "x3", "x5", "x6"}


@given(st.integers(0, 2**32 - 1), st.integers(40, 200))
def test_exact_effects_are_found_again_whatever_the_levels(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    columns, groups = columns_of(rng, count), np.arange(count) // 23
    true = {"slow": 0.8, "saw": -0.05, "mixed": 0.3}
    y = np.asarray(sum(effect * columns[name] for name, effect in true.items()))
    found = regression(y + 100.0 * rng.normal(size=groups.max() + 1)[groups], columns, groups)
    for name, effect in true.items():
        assert found.effects[name].value == pytest.approx(effect, abs=1e-9)
    assert found.r_squared == pytest.approx(1.0)


@given(st.integers(0, 2**32 - 1), st.floats(0.001, 1000))
def test_units_change_the_effect_and_nothing_else(seed: int, unit: float) -> None:
    rng = np.random.default_rng(seed)
    columns, y = columns_of(rng, 80), rng.normal(size=80)
    plain, scaled = regression(y, columns), regression(y, columns | {"slow": columns["slow"] * unit + 7})
    for name, effect in plain.effects.items():
        other = scaled.effects[name]
        by = unit if name == "slow" else 1.0
        assert other.value * by == pytest.approx(effect.value, rel=1e-6, abs=1e-9)
        assert (other.p_value, other.inflation, other.share) == pytest.approx(
            (effect.p_value, effect.inflation, effect.share), rel=1e-6, abs=1e-9
        )
        assert effect.inflation >= 1 - 1e-9
        assert 0 <= effect.share <= plain.r_squared + 1e-9


def test_intervals_hold_although_neighbours_are_alike() -> None:
    """Scatter with an autocorrelation of 0.5, a slow temperature: 95 % intervals hold at least 9 of 10 times, plain ones do not."""
    held = plain = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        noise = rng.normal(size=300)
        for at in range(1, 300):
            noise[at] += 0.5 * noise[at - 1]
        slow = np.sin(np.arange(300) / 40) * 3
        columns = {"slow": slow, "saw": np.arange(300) % 50 * 1.0}
        y = 0.4 * slow + noise
        effect, naive = (regression(y, columns, independent=each).effects["slow"] for each in (False, True))
        held += effect.low <= 0.4 <= effect.high
        plain += naive.low <= 0.4 <= naive.high
    assert held / 200 >= LEVEL - 0.05
    assert plain / 200 < 0.85


def test_what_cannot_be_distinguished_gets_no_effect() -> None:
    rng = np.random.default_rng(1)
    x = rng.normal(size=60)
    other = rng.normal(size=60)
    columns = {"x": x, "other": other, "same": 3 * x - 2, "still": np.full(60, 21.5)}
    found = regression(x + 0.5 * other + rng.normal(size=60), columns)
    assert found.left_out == {"x": LeftOut.DETERMINED, "same": LeftOut.DETERMINED, "still": LeftOut.CONSTANT}
    assert list(found.effects) == ["other"], "nobody can say if it is x or the same"
    nearly = regression(x + rng.normal(size=60), {"x": x, "nearly": x + rng.normal(size=60) / 100})
    assert all(effect.inflated and not effect.significant for effect in nearly.effects.values())
    assert nearly.r_squared > 0.3, "together they explain, apart neither is said to"


def test_too_few_and_too_equal_readings_are_refused() -> None:
    x = np.arange(9.0)
    with pytest.raises(Refused, match="9 of 10"):
        regression(x, {"x": x})
    with pytest.raises(Refused, match="no_variation"):
        regression(np.full(50, 0.003), {"x": np.arange(50.0)})
