"""The load by alarms: cases worked out by hand, and what holds for any alarms."""

import json
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.alarm_load import (
    CHATTERS_WITHIN,
    FLOOD,
    Annunciation,
    chattering,
    counts,
    floods,
    load,
    noisiest,
)

MIDNIGHT = datetime(2026, 3, 5, tzinfo=UTC)
CASES = json.loads((Path(__file__).parent / "cases" / "alarm_load.json").read_text())["cases"]


def at(minutes: float) -> datetime:
    return MIDNIGHT + timedelta(minutes=minutes)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["name"])
def test_cases(case: Any) -> None:
    found = load(map(at, case["raised"]), MIDNIGHT, at(case["minutes"]))
    assert found.mean == pytest.approx(case["mean"])
    assert (found.alarms, found.most, found.over) == (len(case["raised"]), case["most"], case["over"])
    assert [(flood.begin, flood.end, flood.alarms) for flood in found.floods] == [
        (at(begin), at(end), alarms) for begin, end, alarms in case["floods"]
    ]
    assert found.verdict == case["verdict"]


@given(st.lists(st.integers(0, 599), max_size=60))
def test_every_alarm_is_counted_once_and_every_busy_interval_is_in_a_flood(minutes: list[int]) -> None:
    rates = counts(map(at, minutes), MIDNIGHT, at(600))
    assert len(rates) == 60
    assert sum(rates) == len(minutes)
    found = floods(rates, MIDNIGHT)
    for number, rate in enumerate(rates):
        inside = sum(flood.begin <= at(10 * number) < flood.end for flood in found)
        assert inside <= 1
        assert inside or rate <= FLOOD
    assert all(earlier.end <= later.begin for earlier, later in pairwise(found))


@given(st.lists(st.integers(0, 300), min_size=1, max_size=12))
def test_what_is_said_to_chatter_while_active_has_happened_three_times_in_a_minute(seconds: list[int]) -> None:
    """An active alarm keeps the first time, the last and the count: it is never accused of what cannot be shown."""
    moments = sorted(MIDNIGHT + timedelta(seconds=each) for each in seconds)
    alarm = Annunciation("a", moments[0], None, len(moments), moments[-1])
    truly = any(last - first <= CHATTERS_WITHIN for first, last in zip(moments, moments[2:], strict=False))
    assert truly or not chattering([alarm])
    raised = [Annunciation("a", moment, moment) for moment in moments]
    assert bool(chattering(raised)) is truly


def test_what_is_noisy_comes_first() -> None:
    alarms = [Annunciation("b", at(0), at(1)), Annunciation("a", at(2)), Annunciation("b", at(30), at(31))]
    assert [(noise.cause, noise.alarms, noise.chatters) for noise in noisiest(alarms)] == [
        ("b", 2, False),
        ("a", 1, False),
    ]
    assert noisiest([]) == []
