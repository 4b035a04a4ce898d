"""The lathe line's alarm: at least two of three sections outside, measured by hand and confirmed."""

from typing import Any

import pytest

from tests.servers import Server
from tests.shop import Person, Shop

LINE = {
    "points": 3,
    "accept": {"n": 2, "m": 3},
    "zero_range": 0,
    "weighting_factor": 1,
    "average_memory": 0,
    "feature": "inside",
}
BAD = [[40.0081], [40.009], [40.001]]


@pytest.fixture
def line(shop: Shop) -> Shop:
    """With a bore that is measured in three sections."""
    shop.add(f"{shop.characteristic}-bore", **LINE)
    return shop


def rejected(line: Shop, **more: Any) -> Any:
    """A part that is not accepted; the alarm about it."""
    name = f"{line.characteristic}-bore"
    answer = line.call("POST", "/readings", 201, characteristic=name, touches=BAD, **more)
    (number,) = [alarm["id"] for alarm in answer["alarms"] if alarm["kind"] == "acceptance"]
    return line.call("GET", f"/alarms/{number}")


def test_the_alarm_says_how_many_sections_are_outside(line: Shop) -> None:
    alarm = rejected(line)
    assert alarm["text"] == "At least 2 of 3 sections lie outside the tolerance: the part is not accepted."
    assert alarm["what_to_do"] == "Measure it by hand and confirm."
    assert (alarm["data"]["m"], alarm["data"]["least"], alarm["data"]["outside"]) == (3, 2, 2)


def test_what_the_operator_measures_stands_beside_the_machines_value(line: Shop) -> None:
    alarm = rejected(line)
    done = line.acknowledge(
        alarm["id"], "measured_by_hand", hand_measured=40.0062, hand_verdict="good", comment="bore gauge"
    )
    (followed,) = done["outcome"]
    assert followed["text"] == "Reading 1 was measured by hand: 40.0062\xa0mm, the part is good."
    reading = line.call("GET", f"/readings/{line.characteristic}-bore/1")
    (by_hand,) = reading["by_hand"]
    assert (by_hand["measured"], by_hand["verdict"], by_hand["alarm"], by_hand["comment"]) == (
        *(40.0062, "good"),
        alarm["id"],
        "bore gauge",
    )
    assert reading["measured"] == 40.006033333
    assert reading["excluded"] is None, "that the part is good by hand is recorded, nothing more"
    assert reading["results"]["rejected"] is True


def test_of_several_readings_the_last_is_meant_or_the_one_that_is_named(line: Shop) -> None:
    for _each in range(3):
        alarm = rejected(line)
    line.acknowledge(alarm["id"], "noted", 422, hand_verdict="good", hand_sequence=4)
    line.acknowledge(alarm["id"], "noted", hand_verdict="bad", hand_sequence=2)
    name = f"{line.characteristic}-bore"
    found = line.call("GET", f"/characteristics/{name}/hand-measurements")["items"]
    assert [(each["sequence"], each["verdict"]) for each in found] == [(2, "bad")]
    alarm = rejected(line)
    line.acknowledge(alarm["id"], "noted", hand_verdict="good")
    assert line.call("GET", f"/readings/{name}/4")["by_hand"][0]["verdict"] == "good"


@pytest.mark.parametrize(
    ("said", "field"),
    [
        ({"hand_measured": 4000.0}, "hand_measured"),
        ({"hand_measured": "40.0"}, "hand_measured"),
        ({"hand_verdict": "so-so"}, "hand_verdict"),
        ({"hand_sequence": 1}, "hand_measured"),  # of which reading, but not what
    ],
)
def test_what_cannot_be_meant_leaves_the_alarm_active(line: Shop, said: dict[str, Any], field: str) -> None:
    alarm = rejected(line)
    problem = line.acknowledge(alarm["id"], "noted", 422, **said)
    assert problem["errors"][0]["field"] == field
    assert line.call("GET", f"/alarms/{alarm['id']}")["state"] == "active"
    assert line.call("GET", f"/readings/{line.characteristic}-bore/1")["by_hand"] == []


def test_an_alarm_without_a_reading_has_nothing_to_measure(line: Shop) -> None:
    correction = line.read(7.0)["correction"]
    line.correction(correction["number"], "applied", offset_after=1.0)
    (alarm,) = [each for each in line.alarms() if each["kind"] == "offset_differs"]
    problem = line.acknowledge(alarm["id"], "noted", 422, hand_measured=40.0)
    assert [error["field"] for error in problem["errors"]] == ["hand_measured"]


def test_the_operators_page_asks_for_it_and_keeps_what_was_typed(line: Shop, server: Server) -> None:
    operator = Person(server, "operator")
    alarm = rejected(line)
    page = operator.open(f"/alarms/{alarm['id']}?action=measured_by_hand")
    assert "Measured by hand?" in page
    path = f"/alarms/{alarm['id']}/acknowledge"
    again = operator.send(
        path, 422, action="measured_by_hand", comment="Plug gauge", hand_measured="forty", hand_verdict="good"
    )
    assert 'value="forty"' in again
    assert 'value="good" checked' in again
    done = operator.send(
        path, action="measured_by_hand", comment="Plug gauge", hand_measured="40,0062", hand_verdict="good"
    )
    assert "Reading 1 was measured by hand: 40.0062" in done
    (by_hand,) = line.call("GET", f"/readings/{line.characteristic}-bore/1")["by_hand"]
    assert (by_hand["measured"], by_hand["by"]) == (40.0062, operator.name)


def test_measured_by_hand_is_not_taken_without_a_size_or_a_verdict(line: Shop, server: Server) -> None:
    alarm = rejected(line)
    problem = line.acknowledge(alarm["id"], "measured_by_hand", 422)
    assert [error["field"] for error in problem["errors"]] == ["hand_measured"]
    operator = Person(server, "operator")
    again = operator.send(f"/alarms/{alarm['id']}/acknowledge", 422, action="measured_by_hand", comment="Plug gauge")
    assert "say the size in mm, or in hand_verdict whether the part is good or scrap" in again
    assert line.call("GET", f"/alarms/{alarm['id']}")["state"] == "active"
    done = line.acknowledge(alarm["id"], "measured_by_hand", hand_verdict="bad")
    assert done["action"] == "measured_by_hand"
    assert done["outcome"][0]["text"] == "Reading 1 was measured by hand: the part is scrap."


def test_noted_is_an_action_of_its_own_that_claims_nothing(line: Shop, server: Server) -> None:
    alarm = rejected(line)
    operator = Person(server, "operator")
    page = operator.open(f"/alarms/{alarm['id']}?action=noted")
    assert "Noted?" in page
    assert "by hand" not in page.split('id="confirm"')[1].split("</section>")[0]
    done = operator.send(f"/alarms/{alarm['id']}/acknowledge", action="noted", comment="Seen")
    assert "Noted" in done
    assert line.call("GET", f"/readings/{line.characteristic}-bore/1")["by_hand"] == []


def test_no_words_are_put_into_anybodys_mouth(line: Shop, server: Server) -> None:
    """The choice made in advance repeats the action and no more; a reason for an approval is never chosen."""
    operator = Person(server, "operator")
    worn = line.read(400.0)["alarms"][0]["id"]
    for action, chosen in (("tool_replaced", "Tool changed"), ("keep_cutting", "Keep cutting"), ("noted", "Seen")):
        assert f'value="{chosen}" checked' in operator.open(f"/alarms/{worn}?action={action}")
    held = line.call("GET", f"/alarms/{worn}")["held_correction"]["number"]
    path = f"/machines/{line.machine}/corrections/{held}"
    ask = operator.open(f"{path}?do=release")
    assert "Edge looked at, still good" in ask
    assert "checked" not in ask.split('id="confirm"')[1].split("</section>")[0]
    assert "Pick a reason, or write one" in operator.send(path, 422, do="release")
    assert line.correction(held)["status"] == "held"


def test_an_offset_that_nobody_has_said_is_called_assumed(line: Shop) -> None:
    worn = line.read(400.0)["alarms"][0]["id"]
    done = line.acknowledge(worn, "tool_replaced")
    assert "No offset was entered; 0.0000\xa0mm is assumed." in [each["text"] for each in done["outcome"]]
