"""What needs somebody first stands first, for reasons that can be told."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.spc.capability import Limits, capability
from app.overview.ranking import FEWEST, Told, Why, ppk
from app.plant.state import State

CALM = Told(State.IN_BAND, 0, 0, 1.7, None, hunting=False, per_shift=0.0)
told = st.builds(
    Told,
    state=st.sampled_from(State),
    alarms=st.integers(0, 3),
    signals=st.integers(0, 3),
    ppk=st.none() | st.floats(-3, 5),
    parts_left=st.none() | st.floats(0, 1000),
    hunting=st.booleans(),
    per_shift=st.floats(0, 10),
    old=st.booleans(),
)


@pytest.mark.parametrize(
    ("changes", "reasons"),
    [
        ({}, ()),
        ({"ppk": None}, ()),
        ({"state": State.TOOL_WORN, "alarms": 1}, (Why.STOPPED,)),
        ({"state": State.OVERSIZE, "alarms": 1}, (Why.OUTSIDE, Why.ALARM)),
        ({"state": State.AWAITING_APPROVAL}, (Why.OUTSIDE,)),
        ({"signals": 1, "ppk": 0.99}, (Why.SIGNAL, Why.NOT_CAPABLE)),
        ({"ppk": 1.0}, (Why.BARELY_CAPABLE,)),
        ({"ppk": 1.33}, ()),
        ({"parts_left": 100.0}, (Why.WEAR,)),
        ({"parts_left": 101.0}, ()),
        ({"hunting": True, "per_shift": 1.1, "old": True}, (Why.HUNTING, Why.LOUD, Why.OLD)),
    ],
)
def test_reasons(changes: dict[str, object], reasons: tuple[Why, ...]) -> None:
    assert replace(CALM, **changes).reasons == reasons  # type: ignore[arg-type]


@given(told, told)
def test_the_more_urgent_reason_comes_first_whatever_else_is_said(one: Told, other: Told) -> None:
    first = min(one, other, key=lambda each: each.rank)
    urgent = [each.reasons[0] if each.reasons else inf for each in (one, other)]
    assert (first.reasons[0] if first.reasons else inf) == min(urgent)


@given(st.integers(FEWEST, 300), st.floats(-0.02, 0.02), st.integers(0, 10_000))
def test_ppk_is_what_the_page_of_capability_says(count: int, mean: float, seed: int) -> None:
    values = np.random.default_rng(seed).normal(mean, 0.002, size=count)
    squares = float(((values - values.mean()) ** 2).sum())
    index = capability(values, Limits(-0.008, 0.008)).ppk
    assert ppk(float(values.mean()), squares, count, 0.008) == pytest.approx(index.value, rel=1e-9)


def test_of_too_few_readings_or_of_equal_ones_no_index_is_told() -> None:
    assert ppk(0.0, 1e-6, FEWEST - 1, 0.008) is None
    assert ppk(0.0, 0.0, 100, 0.008) is None
