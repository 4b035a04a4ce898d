"""Readings in messages of JSON, in Inband's form and in that of others."""

import json
from typing import Any

import pytest

from app.bridge.fields import Form
from app.bridge.messages import Found, foreign_readings, own_reading
from app.files.formats.cell_values import Unreadable

NAMES = {"d40": "shaft-1", "d20": "bore-1", "1": "shaft-1", "*": "shaft-1"}
FORM = Form(1.0)


def foreign(content: object, fields: dict[str, str], names: dict[str, str] = NAMES) -> list[Found]:
    return foreign_readings(json.dumps(content).encode(), "mill-3", fields, names, FORM)


def own(**content: Any) -> Found:
    return own_reading(json.dumps(content).encode(), NAMES, FORM)


def test_numbers_are_taken_for_names_and_keys_and_the_sender_hears_of_them_as_it_wrote_them() -> None:
    found = own(characteristic=1, measured=40, key=17, part=812)
    assert found == Found("17", 17, {"characteristic": "shaft-1", "measured": 40, "part": "812"})


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (
            {"characteristic": True},
            "characteristic = true is not of the kind that a reading has there: a text or a whole number",
        ),
        ({"characteristic": 1.5}, "characteristic = 1.5 is not of the kind"),
        ({"key": False}, "key = false is not of the kind"),
        (
            {"first_move_triggered": 1},
            "first_move_triggered = 1 is not of the kind that a reading has there: true or false",
        ),
    ],
)
def test_a_wrong_kind_is_shown_as_it_was_written(content: dict[str, Any], words: str) -> None:
    fault = own(**({"characteristic": "1", "measured": 40, "key": "a"} | content)).fault
    assert fault is not None
    assert words in fault


def test_members_of_others_are_mapped_wherever_they_stand() -> None:
    content = {"head": {"serial": "S-1"}, "sizes": [{"v": "40.012"}], "unit": "mm", "ok": True}
    [found] = foreign(content, {"measured": "sizes.0.v", "part": "head.serial"})
    assert found.body == {"characteristic": "shaft-1", "measured": 40.012, "part": "S-1"}
    assert found.key == found.said
    assert found.key is not None
    assert found.key.startswith("mill-3:")
    [other] = foreign(content | {"sizes": [{"v": 40.013}]}, {"measured": "sizes.0.v", "part": "head.serial"})
    assert other.key != found.key
    [keyed] = foreign({"v": 40.0, "id": 12}, {"measured": "v", "key": "id"})
    assert (keyed.key, keyed.said, keyed.body) == ("12", 12, {"characteristic": "shaft-1", "measured": 40.0})


def test_members_that_characteristics_names_are_readings_each() -> None:
    first, second = foreign({"id": "a", "d40": 40.01, "d20": 20.02, "other": 3}, {"key": "id"})
    assert (first.key, first.body) == ("a:d40", {"characteristic": "shaft-1", "measured": 40.01})
    assert (second.key, second.body) == ("a:d20", {"characteristic": "bore-1", "measured": 20.02})


@pytest.mark.parametrize(
    ("content", "fields", "words"),
    [
        ({"v": 1.0}, {"measured": "v"}, "no key, no time and no part"),
        ({"v": "x", "p": 1}, {"measured": "v", "part": "p"}, 'measured = "x" is not a number'),
        ({"v": {"d41": 1.0}, "p": 1}, {"measured": "v.d40", "part": "p"}, "no value at 'v.d40'"),
        ({"v": 1.0, "c": "d9", "p": 1}, {"measured": "v", "characteristic": "c", "part": "p"}, "'d9' is not named in"),
        ({"v": 1.0, "t": "2026-11-23 06:00"}, {"measured": "v", "measured_at": "t"}, "does not say in which time zone"),
        ({"p": 1}, {"part": "p"}, "none of the members that characteristics names"),
        ([1], {"measured": "v"}, "is no JSON object"),
    ],
)
def test_what_is_no_reading_is_said(content: object, fields: dict[str, str], words: str) -> None:
    [found] = foreign(content, fields)
    assert found.fault is not None
    assert words in found.fault


@pytest.mark.parametrize(
    ("sent", "context"),
    [(sent, {"part_temperature": 24.5}) for sent in (24.5, "24.5", "24.5 °C", "24.5C")]
    + [(sent, None) for sent in ("----", "21,5", "76.1 °F", "", None)],
)
def test_a_temperature_is_a_circumstance_and_costs_no_reading(sent: object, context: object) -> None:
    [found] = foreign({"v": 40.0, "id": 12, "t": sent}, {"measured": "v", "key": "id", "part_temperature": "t"})
    assert found.fault is None
    assert found.body.get("context") == context
    assert bool(found.left_out) == bool(sent and not context), "what is left out is said"


def test_a_cell_of_a_sensor_that_failed_costs_no_reading() -> None:
    assert Form(1.0, sheet=True).value("part_temperature", "#N/A") is None
    with pytest.raises(Unreadable):
        Form(1.0, sheet=True).value("measured", "#N/A")
