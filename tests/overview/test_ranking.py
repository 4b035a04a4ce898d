"""What needs somebody first stands first, for reasons that can be told."""

from dataclasses import replace
from math import inf

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.state import State
from app.overview.ranking import Told, Why

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
