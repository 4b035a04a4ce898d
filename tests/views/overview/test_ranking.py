"""The most urgent characteristic comes first, for reasons that can be explained."""

from dataclasses import replace
from math import inf

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.state import CharacteristicState
from app.views.overview.ranking import AttentionInputs, AttentionReason

CALM = AttentionInputs(CharacteristicState.IN_BAND, 0, 0, 1.7, None, hunting=False, per_shift=0.0)
inputs = st.builds(
    AttentionInputs,
    state=st.sampled_from(CharacteristicState),
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
        ({"state": CharacteristicState.TOOL_WORN, "alarms": 1}, (AttentionReason.STOPPED,)),
        ({"state": CharacteristicState.OVERSIZE, "alarms": 1}, (AttentionReason.OUTSIDE, AttentionReason.ALARM)),
        (
            {"state": CharacteristicState.AWAITING_APPROVAL, "alarms": 1},
            (AttentionReason.ALARM, AttentionReason.APPROVAL),
        ),
        ({"signals": 1, "ppk": 0.99}, (AttentionReason.SIGNAL, AttentionReason.NOT_CAPABLE)),
        ({"ppk": 1.0}, (AttentionReason.BARELY_CAPABLE,)),
        ({"ppk": 1.33}, ()),
        ({"parts_left": 100.0}, (AttentionReason.WEAR,)),
        ({"parts_left": 101.0}, ()),
        (
            {"hunting": True, "per_shift": 1.1, "old": True},
            (AttentionReason.HUNTING, AttentionReason.ALARM_FLOOD, AttentionReason.OLD),
        ),
    ],
)
def test_reasons(changes: dict[str, object], reasons: tuple[AttentionReason, ...]) -> None:
    assert replace(CALM, **changes).reasons == reasons  # type: ignore[arg-type]


@given(inputs, inputs)
def test_the_more_urgent_reason_comes_first_whatever_else_is_said(one: AttentionInputs, other: AttentionInputs) -> None:
    first = min(one, other, key=lambda each: each.rank)
    urgent = [each.reasons[0] if each.reasons else inf for each in (one, other)]
    assert (first.reasons[0] if first.reasons else inf) == min(urgent)
