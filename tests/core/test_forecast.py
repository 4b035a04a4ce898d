"""Parts left: by hand, by its properties, and how often the interval holds on tool lives that it was not tuned on."""

from collections import Counter
from math import inf

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.forecast import (
    ENOUGH,
    LOOKS,
    NO_RECORD,
    PUBLIC_WIDENING,
    STEEP,
    Record,
    backtest,
    cone,
    forecast,
    needed_at,
    taught,
    widening_after,
)
from app.core.wear import Fit, Values, fit
from app.quality.proof.wear_lives import life, operation, steeper
from tests.chance import by_chance, runs, seed

WIDENINGS = st.floats(0, 4)


def line(count: int, slope: float, scatter: float, seed: int) -> Values:
    values: Values = slope * np.arange(count) + np.random.default_rng(seed).normal(0.0, scatter, count)
    return values


def fitted(curve: Values) -> Fit:
    found = fit(np.arange(1, len(curve) + 1), curve)
    assert found is not None
    return found


def test_the_forecast_reaches_the_limit_where_the_line_does() -> None:
    told = forecast(fitted(line(100, 0.0001, 0.00001, seed=1)), 0.0199)
    assert told is not None
    assert told.parts == pytest.approx(100, abs=1)
    assert told.low < told.parts < told.high


def test_the_interval_by_hand() -> None:
    """A line of 100 parts known exactly, 100 parts ahead: soonest after 100 / (3 + 3 / 2), latest after 100 x (1.5 + 1) parts, to the power."""
    straight = fitted(line(100, 0.0001, 0.0000001, seed=1))
    for widening, low, high in (
        (1.0, 100 / 4.5, 250),
        (2.0, 100 / 4.5**2, 625),
        (0.5, 100 / 4.5**0.5, 100 * 2.5**0.5),
        (0.0, 100, 100),
    ):
        told = forecast(straight, 0.0199, widening)
        assert told is not None
        assert told.low == pytest.approx(low, rel=0.02)
        assert told.high == pytest.approx(high, rel=0.02)


def test_near_the_end_a_steep_end_is_allowed_for() -> None:
    """However near the limit is: wear three times as fast from the next part on is inside the interval."""
    straight = fitted(line(400, 0.0001, 0.0000001, seed=1))
    told = forecast(straight, straight.level + 0.001)
    assert told is not None
    assert told.parts == pytest.approx(10, rel=0.01)
    assert told.low < 10 / STEEP


def test_far_ahead_the_soonest_end_keeps_in_proportion() -> None:
    """A limit forty times as far as was seen: at most six times as fast, not at once."""
    straight = fitted(line(100, 0.0001, 0.0000001, seed=1))
    near, far = forecast(straight, straight.level + 0.01, 1.0), forecast(straight, straight.level + 0.4, 1.0)
    assert near is not None
    assert far is not None
    assert far.low > 4000 / (2 * STEEP)
    assert far.low > 30 * near.low


def test_the_cone_comes_to_the_limit_after_the_parts_of_the_interval() -> None:
    """Both ends: the chart and the number say the same, wider where edges before missed."""
    found = fitted(line(60, -0.0002, 0.002, seed=3))
    for widening in (0.5, 1.0, 1.7):
        told = forecast(found, -0.024, widening)
        assert told is not None
        slow, fast = cone(found, np.array([told.low, told.high]), widening)
        assert fast[0] == pytest.approx(-0.024, rel=0.01)
        assert slow[1] == pytest.approx(-0.024, rel=0.01)


def test_no_wear_no_number() -> None:
    assert forecast(fitted(line(60, 0.0, 0.001, seed=3)), 0.05) is None


def test_a_limit_that_was_passed_is_reached() -> None:
    told = forecast(fitted(line(100, 0.0001, 0.0001, seed=1)), 0.005)
    assert told is not None
    assert told.parts == told.low == 0


# --- properties


@given(
    slope=st.floats(0.00001, 0.01),
    scatter=st.floats(0, 0.002),
    count=st.integers(12, 120),
    ahead=st.floats(1, 5_000),
    further=st.floats(1, 10),
    narrow=WIDENINGS,
    wide=WIDENINGS,
)
def test_the_interval_holds_the_line_grows_with_widening_and_never_turns_back(
    slope: float, scatter: float, count: int, ahead: float, further: float, narrow: float, wide: float
) -> None:
    found = fitted(line(count, slope, scatter, seed=count))
    limit = found.at(ahead)
    narrow, wide = sorted((narrow, wide))
    small, large = forecast(found, limit, narrow), forecast(found, limit, wide)
    farther = forecast(found, found.at(ahead * further), narrow)
    if small is None or large is None or farther is None:
        return
    assert 0 <= large.low <= small.low <= small.parts * (1 + 1e-9)
    assert small.parts * (1 - 1e-9) <= small.high <= large.high
    assert small.low <= farther.low * (1 + 1e-9)
    assert small.high <= farther.high * (1 + 1e-9)


@given(scale=st.sampled_from([0.001, 0.5, 1000.0]), sign=st.sampled_from([-1.0, 1.0]), widening=WIDENINGS)
def test_unit_and_direction_change_nothing(scale: float, sign: float, widening: float) -> None:
    curve = line(80, 0.0002, 0.001, seed=7)
    one, other = (
        forecast(fitted(curve), 0.03, widening),
        forecast(fitted(curve * scale * sign), 0.03 * scale * sign, widening),
    )
    assert one is not None
    assert other == pytest.approx(one, rel=1e-6)


@given(st.lists(st.floats(0, 6), max_size=60), st.integers(0, 20))
def test_until_there_are_lives_enough_nothing_is_narrower_than_public_series_need(
    needed: list[float], lives: int
) -> None:
    widening = widening_after(lives, taught(needed))
    assert (widening >= PUBLIC_WIDENING) or lives >= ENOUGH
    assert sum(each > taught(needed) for each in needed) <= 0.05 * len(needed)
    assert Record(lives, 0, 0, widening).is_enough == (lives >= ENOUGH)


# --- the record


def abrupt(parts: int, seed: int, steep: float = 60.0) -> Values:
    """An edge that wears 2 x `steep` times as fast in the last tenth of its life."""
    t = np.arange(1, parts + 1) / parts
    curve: Values = (0.5 * t + steep * np.maximum(0, t - 0.9)) + np.random.default_rng(seed).normal(0, 0.005, parts)
    return curve


def test_the_forecasts_of_edges_before_widen_the_next() -> None:
    record = backtest([(np.arange(1, n + 1), abrupt(n, n)) for n in (150, 260, 340)])
    assert record.lives == 3
    assert record.held < record.tested
    assert record.widening > PUBLIC_WIDENING
    curve = abrupt(300, 1)
    alone, warned = (forecast(fitted(curve[:240]), 6.5, widening) for widening in (PUBLIC_WIDENING, record.widening))
    assert alone is not None
    assert warned is not None
    assert alone.low > 60 >= warned.low


def test_even_edges_narrow_the_next_once_they_are_enough() -> None:
    lives = [(np.arange(1, 201), line(200, 0.0001, 0.0005, seed)) for seed in range(ENOUGH)]
    few, many = backtest(lives[:-1]), backtest(lives)
    assert (few.lives, few.held, few.is_enough) == (ENOUGH - 1, few.tested, False)
    assert few.widening == PUBLIC_WIDENING
    assert many.is_enough
    assert many.widening < PUBLIC_WIDENING


def test_each_forecast_of_the_record_knows_the_lives_before_it_only() -> None:
    """The first abrupt edge misses; the next is forewarned: what it held is counted as it would have been shown then."""
    lives = [(np.arange(1, 301), abrupt(300, seed)) for seed in (1, 2)]
    first, both = backtest(lives[:1]), backtest(lives)
    assert first.held < first.tested
    assert both.tested - first.tested == both.held - first.held == first.tested


def test_edges_that_tell_nothing_widen_nothing() -> None:
    short = (np.arange(1, 21), line(20, 0.001, 0.0001, seed=1))
    flat = (np.arange(1, 101), line(100, 0.0, 0.001, seed=1))
    assert backtest([]) == backtest([short, flat]) == NO_RECORD


def test_an_edge_that_broke_in_the_end_is_judged_by_its_wear_until_then() -> None:
    curve = line(200, 0.0001, 0.0005, seed=2)
    whole = backtest([(np.arange(1, 201), curve)])
    curve[-3:] += 0.4
    assert backtest([(np.arange(1, 201), curve)]).held == whole.held == 4


def test_the_exponent_is_the_one_that_just_holds() -> None:
    """All forecasts of the edge that taught it hold with it, and not with less. Its level is the median of its last five parts."""
    curve = abrupt(300, 1, steep=6)
    needed = max(exponent for _moment, exponent in needed_at(np.arange(1, 301), curve))
    level = float(np.median(curve[-5:]))

    def hold(widening: float) -> list[bool]:
        made = [(now, forecast(fitted(curve[:now]), level, widening)) for now in (90, 150, 210, 270)]
        return [told is not None and told.low <= 298 - now <= told.high for now, told in made]

    assert all(hold(needed * (1 + 1e-9)))
    assert not all(hold(needed - 0.001))


# --- how often it holds


@runs(60, 1_000)
@pytest.mark.parametrize("before", [0, 1, ENOUGH])
def test_at_each_moment_of_a_life_nine_in_ten_forecasts_hold(before: int, runs: int) -> None:
    """On tools that nothing was tuned on: so many edges of the same operation before it, then one that is left out of them."""
    rng = np.random.default_rng(seed(11))
    held: Counter[float] = Counter()
    told: Counter[float] = Counter()
    for _operation in range(runs):
        of = operation(rng)
        made = (life(of, rng) for _tool in range(before))
        widening = backtest([(np.arange(1, len(curve) + 1), curve) for curve in made]).widening
        curve = life(of, rng)
        for share in LOOKS:
            now = int(len(curve) * share)
            found = fit(np.arange(1, now + 1), curve[:now])
            said = None if found is None else forecast(found, 1.0, widening)
            if said is not None:
                told[share] += 1
                held[share] += said.low <= len(curve) - now <= said.high
    for share in LOOKS:
        assert told[share] > 0.9 * runs
        assert held[share] / told[share] >= 0.9 - by_chance(0.9, told[share]) / 3, share


@runs(20, 600)
@pytest.mark.parametrize(("before", "most"), [(0, 0.6), (ENOUGH, 0.75)])
def test_a_steeper_end_than_any_that_it_was_tuned_on_is_held_as_well(before: int, most: float, runs: int) -> None:
    """30 to 60 % of the wear in the last 5 to 25 % of the life for a first edge; after edges like it, up to 75 %."""
    rng = np.random.default_rng(seed(12))
    held: Counter[float] = Counter()
    told: Counter[float] = Counter()
    for _operation in range(runs):
        of = steeper(rng, most)
        made = (life(of, rng) for _tool in range(before))
        widening = backtest([(np.arange(1, len(curve) + 1), curve) for curve in made]).widening
        curve = life(of, rng)
        for share in LOOKS:
            now = int(len(curve) * share)
            said = forecast(fitted(curve[:now]), 1.0, widening)
            if said is not None:
                told[share] += 1
                held[share] += said.low <= len(curve) - now <= said.high
    for share in LOOKS:
        assert held[share] / told[share] >= 0.9 - by_chance(0.9, told[share]) / 3, share


def test_nobody_can_say_is_no_number() -> None:
    """A slope that is barely known has no upper end."""
    found = fitted(line(20, 0.0004, 0.0025, seed=4))
    told = forecast(found, 0.1)
    assert found.is_wear
    assert told is None or told.high == inf or told.high > told.parts
