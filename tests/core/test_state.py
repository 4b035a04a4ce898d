"""In which state a characteristic is: the most urgent thing wins, and calm states grow old."""

from datetime import UTC, datetime, timedelta
from typing import Any

import pytest

from app.core.parameters import Parameters, read
from app.core.state import CharacteristicState, Known, state_of
from tests.shop import PARAMETERS

NOW = datetime(2026, 11, 21, 8, tzinfo=UTC)


def parameters(**other: Any) -> Parameters:
    return read(PARAMETERS | other)[0]


def known(**other: Any) -> Known:
    values: dict[str, Any] = {
        "parameters": parameters(),
        "readings": 7,
        "zone": "zero",
        "deviation": 0.0002,
        "paused": False,
        "alarms": set(),
        "corrections": set(),
        "trend": [0.0002, -0.0003, 0.0002],
        "since": NOW - timedelta(minutes=20),
        "last_at": NOW,
    }
    return Known(**values | other)


@pytest.mark.parametrize(
    ("facts", "state"),
    [
        ({}, CharacteristicState.IN_BAND),
        ({"paused": True, "alarms": {"tool_worn"}, "corrections": {"held"}}, CharacteristicState.PROBE_FAULT),
        ({"alarms": {"tool_worn", "oversize"}, "corrections": {"held"}}, CharacteristicState.TOOL_WORN),
        ({"corrections": {"held", "pending"}}, CharacteristicState.HELD),
        ({"readings": 0, "deviation": None}, CharacteristicState.NO_DATA),
        ({"deviation": 0.0081}, CharacteristicState.OVERSIZE),
        ({"deviation": -0.0081, "zone": "zero"}, CharacteristicState.UNDERSIZE),
        ({"deviation": 0.008}, CharacteristicState.IN_BAND),
        ({"deviation": 0.0081, "excluded": True}, CharacteristicState.IN_BAND),  # declared false: no part was so large
        ({"deviation": 1.0, "zone": "probe_fault"}, CharacteristicState.IN_BAND),  # acknowledged: it was no size at all
        ({"deviation": 0.9999}, CharacteristicState.OVERSIZE),
        ({"deviation": 1.2, "trend": [-0.002] * 7 + [1.2]}, CharacteristicState.DRIFTING_DOWN),
        ({"deviation": 0.0081, "excluded": True, "corrections": {"held"}}, CharacteristicState.HELD),
        ({"corrections": {"awaiting_approval", "pending"}}, CharacteristicState.AWAITING_APPROVAL),
        ({"corrections": {"pending"}}, CharacteristicState.CORRECTING),
        ({"trend": [0.0011] * 7}, CharacteristicState.DRIFTING_UP),
        ({"trend": [0.009] + [-0.002] * 7}, CharacteristicState.DRIFTING_DOWN),
        ({"trend": [0.0011] * 6 + [0.001]}, CharacteristicState.IN_BAND),
        ({"trend": [0.0011] * 6}, CharacteristicState.IN_BAND),
        ({"parameters": parameters(tool_memory=0)}, CharacteristicState.MEASURE_ONLY),
        ({"alarms": {"oversize"}}, CharacteristicState.IN_BAND),  # the part after it was good; the alarm stands beside
    ],
)
def test_the_most_urgent_thing_is_said(facts: dict[str, Any], state: CharacteristicState) -> None:
    assert state_of(known(**facts)) is state


@pytest.mark.parametrize(
    ("facts", "minutes"),
    [
        ({}, 100),  # three readings in twenty minutes: one is missed after ten times ten minutes
        ({"since": NOW - timedelta(seconds=20)}, 15),  # a fast machine: not sooner than after a quarter of an hour
        ({"trend": [0.0002], "since": NOW}, 15),
    ],
)
def test_what_is_known_grows_old(facts: dict[str, Any], minutes: int) -> None:
    assert known(**facts).old_from == NOW + timedelta(minutes=minutes)


def test_what_was_never_known_cannot_grow_old() -> None:
    assert known(readings=0, deviation=None, last_at=None, since=None, trend=[]).old_from is None
