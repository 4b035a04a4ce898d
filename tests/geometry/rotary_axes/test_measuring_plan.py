"""The measuring plan: over REST, on its page, and from a program text to the page."""

import re
from html import unescape
from typing import Any

import pytest

from tests.shop import Person, Shop

C = {"axis": "C", "start": -90.0, "end": 180.0, "points": 4}


def test_a_plan_is_answered_with_positions_and_program(shop: Shop) -> None:
    a = {"axis": "A", "start": -30.0, "end": 90.0, "points": 4, "teeth": 3.0}
    body: dict[str, Any] = {"cycle": 452, "ball_radius": 12.5, "feed": "FMAX", "retract_height": 50.0, "axes": [C, a]}
    answer = shop.call("POST", "/kinematics/measuring-plans", **body)
    assert answer["order"] == ["A", "C"]
    assert answer["axes"][0]["positions"] == [-30.0, 9.0, 51.0, 90.0]
    assert [(each["code"], each["field"]) for each in answer["warnings"]] == [("moved_to_teeth", "axes[1]")]
    read = shop.call("POST", "/programs/read", text=answer["text"])
    assert (read["control"], read["program"]["kind"], read["not_understood"]) == ("heidenhain", "kinematics", 0)
    assert read["programs"][1]["parameters"] == {"cycle": 452} | answer["values"]


def test_what_cycle_452_does_not_have_is_warned_of_when_it_is_left_out(shop: Shop) -> None:
    body: dict[str, Any] = {"cycle": 452, "ball_radius": 12.5, "axes": [C], "preset": 2, "mode": 1}
    answer = shop.call("POST", "/kinematics/measuring-plans", **body)
    assert "Q406" not in answer["text"]
    assert [(each["code"], each["field"]) for each in answer["warnings"]] == [
        ("only_451", "mode"),
        ("only_451", "preset"),
    ]
    assert "Q431 = 2 is left out" in answer["warnings"][1]["text"]
    assert shop.call("POST", "/kinematics/measuring-plans", **body | {"cycle": 451})["warnings"] == []


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"ball_radius": 100.0}, "ball_radius"),
        ({"axes": [C | {"points": 13}]}, "axes[0].points"),
        ({"axes": [C | {"start": -360.0}]}, "axes[0].start"),
        ({"feed": "FAST"}, "feed"),
        ({"axes": [C | {"teeth": 3.0}]}, "retract_height"),
        ({"axes": [C | {"travel": [-45.0, 200.0]}]}, "axes[0]"),
        ({"axes": [C, C]}, "body"),
    ],
)
def test_what_the_control_would_refuse_is_named(shop: Shop, change: dict[str, Any], field: str) -> None:
    body: dict[str, Any] = {"cycle": 452, "ball_radius": 12.5, "axes": [C]} | change
    problem = shop.call("POST", "/kinematics/measuring-plans", 422, **body)
    assert field in [each["field"].removeprefix("body.") or "body" for each in problem["errors"]] or any(
        each["field"].startswith(field) for each in problem["errors"]
    )


def test_a_call_that_was_read_opens_as_a_plan(engineer: Person) -> None:
    person = engineer
    text = "13 TCH PROBE 452 PRESET COMPENSATION ~\n Q407=+12.5 ~\n Q253=FMAX ~\n Q419=-90 ~\n Q420=+90 ~\n Q422=+2"
    page = person.send("/setup/programs", text=text, do="read")
    assert "radius of the sphere" in page
    found = re.search(r'href="(/kinematics/measuring-plan\?[^"]+)"', page)
    assert found is not None
    plan = person.open(unescape(found[1]))
    assert "Axis C is measured at 2 different angles" in plan
    assert "Q253=FMAX" in plan
    assert "FUNCTION TCPM" in plan
    wrong = person.open("/kinematics/measuring-plan?Q407=12. 5&Q422=4&Q420=180", 422)
    assert 'value="12. 5"' in wrong
    assert "Measuring plan" in person.open("/kinematics")
