"""What comes back is read tolerantly; what cannot be read is an error of one kind, whatever it is."""

from contextlib import suppress
from dataclasses import fields
from datetime import UTC, datetime
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from inband_client import Alarm, Batch, Correction, Decision, Event, Reading, Reason, StoredReading, calls
from inband_client.values import Unreadable, read

KINDS: list[type[Any]] = [Alarm, Batch, Correction, Decision, Event, Reason, StoredReading]
NAMES = sorted({each.name for kind in KINDS for each in fields(kind)})
SCALARS = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=20)
JSON = st.recursive(
    SCALARS,
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(NAMES) | st.text(max_size=8), inner, max_size=6)
    ),
    max_leaves=20,
)
DECISION = {
    "characteristic": "c",
    "sequence": 8,
    "measured": 40,
    "deviation": 0.006,
    "zone": "full",
    "action": "correct",
    "reason": {"code": "full_deviation", "text": "…", "notes": ["late"]},
    "correction": {"number": 18, "tool_memory": 3, "amount": -0.006, "status": "pending"},
    "alarms": [{"id": 4, "kind": "oversize"}],
    "measured_at": "2026-11-21T07:15:02.120Z",
    "outstanding": [17],
}


@given(kind=st.sampled_from(KINDS), document=JSON)
def test_any_document_is_a_value_or_one_error(kind: type[Any], document: Any) -> None:
    with suppress(Unreadable):
        assert isinstance(read(kind, document), kind)


@given(
    st.dictionaries(st.text(max_size=12).filter(lambda name: name not in NAMES or name == "extra"), JSON, max_size=4)
)
def test_fields_of_a_newer_server_are_kept_aside_at_every_depth(more: dict[str, Any]) -> None:
    document = DECISION | {"reason": DECISION["reason"] | more, "alarms": [{"id": 4, "kind": "oversize"} | more]}  # type: ignore[operator]
    decision = read(Decision, document | more)
    assert decision.extra == decision.reason.extra == decision.alarms[0].extra == more
    assert read(Decision, DECISION) == Decision(
        characteristic="c",
        sequence=8,
        measured=40.0,
        deviation=0.006,
        zone="full",
        action="correct",
        reason=Reason(code="full_deviation", text="…", notes=("late",)),
        correction=Correction(number=18, tool_memory=3, amount=-0.006, status="pending"),
        alarms=(Alarm(id=4, kind="oversize"),),
        measured_at=datetime(2026, 11, 21, 7, 15, 2, 120_000, tzinfo=UTC),
        outstanding=(17,),
    )


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"sequence": "8"}, r"Decision\.sequence: '8' stands where int is expected"),
        ({"late": 1}, r"Decision\.late: 1 stands where bool is expected"),
        ({"sequence": True}, r"Decision\.sequence: True stands where int"),
        ({"measured_at": 5}, r"Decision\.measured_at: 5 stands where a time is expected"),
        ({"alarms": [{"id": 4}]}, r"Decision\.alarms: Alarm lacks kind"),
        ({"reason": None}, r"Decision\.reason: Reason is None and not an object"),
    ],
)
def test_what_cannot_be_read_is_named_by_its_place(change: dict[str, Any], said: str) -> None:
    with pytest.raises(Unreadable, match=said):
        read(Decision, DECISION | change)


def test_a_reading_is_written_with_what_was_given_and_nothing_else() -> None:
    moment = datetime(2026, 11, 21, 8, tzinfo=UTC)
    call = calls.push(None, {"characteristic": "c", "touches": ((39.99, 40.0), (40.01,)), "measured_at": moment})
    assert call.json.pop("key")
    assert call.json == {
        "characteristic": "c",
        "touches": [[39.99, 40.0], [40.01]],
        "measured_at": "2026-11-21T08:00:00+00:00",
    }
    reading = Reading(characteristic="c", measured=40.0)
    assert calls.push(reading, {}).json == {"characteristic": "c", "measured": 40.0, "key": reading.key}


def test_a_time_without_an_offset_is_refused() -> None:
    naive = datetime(2026, 11, 21, 8)  # noqa: DTZ001 - that is the point
    with pytest.raises(ValueError, match=r"has no offset.*datetime\.now\(UTC\)"):
        calls.push(Reading(characteristic="c", measured=40.0, measured_at=naive), {})


def test_a_push_of_nothing_or_of_two_things_is_a_mistake_of_the_program() -> None:
    reading: dict[str, Any] = {"characteristic": "c", "measured": 1.0}
    with pytest.raises(TypeError, match="one reading, or its fields by name"):
        calls.push(None, {})
    with pytest.raises(TypeError, match="one reading, or its fields by name"):
        calls.push(reading, reading)
    for chunk in (0, 10_001):
        with pytest.raises(ValueError, match="1 to 10,000 readings at once"):
            list(calls.push_many([], chunk, decisions=True))


def test_what_is_not_given_is_not_sent() -> None:
    """A server that does not know a field would refuse it."""
    assert calls.confirm("m", 3, None, None, None).json == {}
    assert calls.confirm("m", 3, 0.01, None, "abc").json == {"offset_after": 0.01, "mapping": "abc"}
    assert calls.heartbeat("m", {"version": "1", "waiting": 0, "detail": None}).json == {"version": "1", "waiting": 0}
