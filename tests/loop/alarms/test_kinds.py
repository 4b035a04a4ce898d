"""The registry of alarm kinds: complete in every process, and each kind can be shown."""

import subprocess
import sys
from datetime import UTC, datetime
from typing import Any

import pytest

from app.core.decision.step import Code
from app.core.parameters import Parameters
from app.language.short import MOST_WORDS, in_short, words
from app.loop.alarm_response.wording import sentence
from app.loop.alarms.kinds import AlarmKind, kind_named, kinds, register
from app.loop.readings.records import Record
from app.loop.readings.wording import reason
from app.loop.tables.alarms import Alarm
from app.web import states
from app.web.templates import environment
from tests.shop import PARAMETERS, Shop


@pytest.mark.parametrize("kind", list(kinds()), ids=lambda kind: kind.name)
def test_every_kind_has_a_word_an_icon_and_advice(kind: AlarmKind) -> None:
    badge = environment().from_string('{% import "components.html" as ui %}{{ ui.badge(name) }}').render(name=kind.name)
    assert kind.word() in badge
    assert "<path" in badge
    assert kind.what_to_do()
    assert kind.actions
    assert states.tone_of(kind.name) == kind.tone


def test_a_process_that_uses_one_room_only_words_the_alarms_of_all() -> None:
    program = "from app.loop.alarm_response.wording import kind_word; print(kind_word('fixture_shifted'))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout == "Fixture shifted\n", done.stderr


def test_a_kind_of_a_newer_version_is_shown_by_its_name() -> None:
    kind = kind_named("coolant_low")
    assert (kind.word(), kind.sentence(Alarm(kind="coolant_low", data={"text": "Low."}))) == ("coolant_low", "Low.")
    assert "noted" in kind.actions


_AT = "2026-11-27T04:00:00+00:00"
_STEP = {"numbers": [17, 18], "amount": -0.0061, "asked": 0.0061, "done": -0.0058}
_GAIN: dict[str, Any] = {"gain": 0.47, "error": 0.12, "corrections": 14, "characteristic": "Bearing seat Ø40 h6"}
_SIZE: dict[str, Any] = {"deviation": 0.4123, "limit": 0.3}
DATA: dict[str, list[dict[str, Any]]] = {
    "oversize": [_SIZE, _SIZE | {"against": _STEP}],
    "undersize": [_SIZE],
    "tool_worn": [_SIZE],
    "probe_fault": [
        _SIZE,
        {"first_move_triggered": True},
        {"first_move_triggered": True, "feature": "outside"},
        {"first_move_triggered": True, "feature": "tool"},
        _SIZE | {"beyond_natural_limit": True},
        {"touch": {"code": "distance", "point": 2, "repeat": 1, "expected": 0.5, "got": 0.8}},
        {"touch": {"code": "missing", "point": 2, "repeat": 1, "expected": 1, "got": 0}},
    ],
    "touch_count": [{"touch": {"code": "points", "point": 4, "repeat": None, "expected": 3, "got": 4}}],
    "acceptance": [{"least": 2, "m": 3}, {}],
    "offset_limit": [_SIZE],
    "implausible": [_SIZE],
    "opposite_effect": [_GAIN | {"corrections": [_STEP, _STEP]}],
    "strong_effect": [_GAIN | {"corrections": [_STEP, _STEP], "parts": 9, "out": 8}],
    "still_out": [
        {"characteristic": "seat", "parts": 7, "corrected": 4, "deviations": [0.009, -0.0085, 0.009, -0.009, 0.0095]}
        | more
        for more in ({}, *({"gain": gain, "error": 0.12} for gain in (-1.0, 0.0, 0.5, 1.0, 2.0)))
    ],
    "early_effect": [
        {"characteristic": "seat", "share": 0.98, "error": 0.09, "after": 1, "lag": 7200.0, "by": by}
        for by in ("machined_at", "correction_in_effect", "confirmation")
    ]
    + [
        {"characteristic": "seat", "by": "clock", "before": before, "lag": 7200.0, "readings": 5}
        for before in (False, True)
    ]
    + [{"characteristic": "seat", "by": "clock", "before": True, "lag": 7200.0, "number": 17}],
    "correction_in_doubt": [
        {"characteristic": "seat", "number": 17, "of_tool": 7} | more
        for more in (
            {"why": "fell", "status": "rejected"},
            {"why": "not_issued", "machined_at": _AT, "issued_at": _AT},
            {"why": "applied_before", "applied_at": _AT, "issued_at": _AT, "lag": 7200.0},
            {"why": "clock", "lag": 7200.0, "readings": 5},
            {"why": "clock", "lag": 7200.0, "readings": 5, "before": True},
        )
    ],
    "offset_differs": [{"reported": -0.0142, "expected": -0.0061}, {"correction": 9, "reported": 1.0, "expected": 0.9}],
    "corrections_not_taken": [
        {"waiting": 1, "first": 12, "since": _AT},
        {"waiting": 4, "first": 12, "since": _AT, "bridge": True, "carried": False},
        {
            "waiting": 4,
            "first": 12,
            "since": _AT,
            "bridge": True,
            "said": "Tool 3 is in use: its wear is not written now.",
        },
    ],
    "unusual_gain": [_GAIN | {"verdict": verdict} for verdict in ("none", "weak", "strong", "opposite")],
    "characteristics_disagree": [{"down": "a", "up": "b", "mean_down": -0.02, "mean_up": 0.02, "times": 6}],
    "tool_life": [{"by": "parts", "parts": 520, "planned_parts": 500}, {"total": 0.21, "planned_total": 0.2}],
    "bridge_silent": [{"received_at": _AT}],
    "server_away": [{"from": _AT, "until": _AT}],
    "bridge_quarantine": [
        {"quarantined": n, "newest": "p-1", "characteristic": "seat", "reason": "Key is taken."} for n in (1, 4)
    ],
    "readings_late": [{"from": _AT, "until": _AT, "late": 24}],
    "bridge_backing_up": [{"state": "full", "waiting": 900}, {"waiting": 900, "oldest_waiting_at": _AT}],
    "machine_fault": [{"location": which} for which in ("battery_low", "receiver", "probe_not_ready", "other")],
    "calibration_overdue": [{"days": 31, "location": 5}, {"parts": 500, "location": 5, "memory": "tool"}],
    "fixture_shifted": [{"location": "vice-2", "shifts": {"x": 0.12, "y": -0.3}, "limit": 0.1, "zero": 8}],
    "kinematics_drift": [{"name": "c-tilt-x", "location": "c", "value": 0.02, "limit": 0.01, "run": 7}],
    "measurement_missed": [
        {"by": "parts", "parts": 12, "every": 10, "minutes_planned": 60},
        {"by": "minutes", "minutes": 75, "every": 10, "minutes_planned": 60},
        {"by": "shift"},
    ],
    "context_missing": [{"fields": ["order", "nest"], "readings": 1}, {"fields": ["batch"], "readings": 40}],
    "hunting": [],  # worded with the settings: by the tests of wear
    "signal": [],  # with the chart: by the tests of signals
    "calibration_refused": [],  # with the refusal: by the tests of calibration
}


@pytest.mark.parametrize("kind", list(kinds()), ids=lambda kind: kind.name)
def test_what_is_read_in_passing_has_fifteen_words_at_most_and_nothing_is_broken_off(kind: AlarmKind) -> None:
    said = [kind.sentence(Alarm(kind=kind.name, tool_memory=3, data=data)) for data in DATA[kind.name]]
    for text in (*said, kind.what_to_do()):
        assert words(in_short(text)) <= MOST_WORDS, in_short(text)
        assert not in_short(text).endswith("…"), text


def test_one_whose_numbers_are_missing_keeps_no_page_from_the_others() -> None:
    assert sentence(Alarm(id=1, kind="hunting", data={})) == "Hunting: its numbers cannot be read."


def test_so_it_is_with_every_reason_of_a_decision() -> None:
    parameters = Parameters(**PARAMETERS, max_total=0.2, plausible_jump=0.03)
    now = datetime(2026, 11, 27, tzinfo=UTC)
    for code in Code:
        record = Record(
            1, 1, 7, 40.0061, 0.0061, 0.0061, 0.0002, 0.0003, now, now, None, 1, 4, 18, 3, False, "full", "correct", code,
            None, None, None, None, None,
        )  # fmt: skip
        text = reason(record, parameters)["text"]
        assert words(in_short(text)) <= MOST_WORDS, in_short(text)
        assert not in_short(text).endswith("…"), text


def test_a_name_is_taken_once() -> None:
    with pytest.raises(ValueError, match="two alarm kinds are called signal"):
        register(kind_named("signal"))


def test_a_tool_is_called_worn_by_what_its_part_shows(shop: Shop) -> None:
    shop.read(-299.0)
    shop.read(1.5)
    (worn,) = [each for each in shop.alarms() if each["kind"] == "tool_worn"]
    assert worn["text"].startswith(
        "Deviation +2\xa0µm counts as +300.5\xa0µm, which has reached the wear limit ±300\xa0µm"
    )
    assert "one of them is in the offset already" in worn["text"]
