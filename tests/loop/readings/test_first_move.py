"""A probe that triggers on its first move, where there should have been air: the reading stops the machine whatever its value."""

from typing import Any

import pytest

from tests.shop import Shop


def test_it_stops_the_machine_and_says_why(shop: Shop) -> None:
    shop.read(3.0)
    answer = shop.read(3.0, first_move_triggered=True, key="n999")
    assert (answer["zone"], answer["action"], answer["correction"]) == ("probe_fault", "stop", None)
    assert answer["reason"]["code"] == "first_move_triggered"
    assert "no bore" not in answer["reason"]["text"], "a shaft is measured from outside"
    assert answer["average_after"] == answer["average_before"]
    (alarm,) = shop.alarms()
    assert alarm["kind"] == "probe_fault"
    assert alarm["text"].startswith("The first move of the probe triggered")
    assert shop.read(3.0)["reason"]["code"] == "paused"
    again = shop.call(
        "POST", "/readings", characteristic=shop.characteristic, measured=40.003, first_move_triggered=True, key="n999"
    )
    assert again["sequence"] == answer["sequence"]


@pytest.mark.parametrize(
    ("feature", "words"),
    [("inside", "there is no bore here"), ("outside", "triggered beside the part"), ("tool", "came to the tool")],
)
def test_reason_and_alarm_speak_of_what_is_measured(shop: Shop, feature: str, words: str) -> None:
    key = f"{feature}-{shop.machine}"
    shop.add(key, feature=feature, mode="measure_only" if feature == "tool" else "automatic")
    answer = shop.read(3.0, key, first_move_triggered=True)
    assert words in answer["reason"]["text"]
    (alarm,) = shop.alarms()
    assert words in alarm["text"]
    assert alarm["text"].endswith("Compensation is paused.")


def test_among_many_quiet_ones_only_it_stops(shop: Shop) -> None:
    many = [{"characteristic": shop.characteristic, "measured": 40.0005} for _ in range(200)]
    many[150]["first_move_triggered"] = True
    answer = shop.server.client(shop.server.key(machine=shop.machine)).post(
        "/api/v1/readings/batch?decisions=true", json=many
    )
    codes = [item["reason"]["code"] for item in answer.json()["items"]]
    assert codes == ["within_zero_range"] * 150 + ["first_move_triggered"] + ["paused"] * 49


def test_the_position_may_be_left_out_or_be_touches(shop: Shop) -> None:
    """A program comes to this line once a year: no refusal may keep it from being heard."""
    answer = shop.call("POST", "/readings", 201, characteristic=shop.characteristic, first_move_triggered=True)
    assert (answer["action"], answer["measured"]) == ("stop", 41.0), "outside, the move begins a = 1 mm off the part"
    touched: dict[str, Any] = {"first_move_triggered": True, "touches": [[40.5]]}
    answer = shop.call("POST", "/readings", 201, characteristic=shop.characteristic, **touched)
    assert (answer["action"], answer["measured"], answer["reason"]["code"]) == ("stop", 40.5, "first_move_triggered")


@pytest.mark.parametrize(
    ("field", "body"),
    [
        ("measured", {"first_move_triggered": False}),
        ("measured", {"first_move_triggered": True, "measured": 40.0, "touches": [[40.0]]}),
        ("first_move_triggered", {"measured": 40.0, "first_move_triggered": "yes"}),
    ],
)
def test_what_it_cannot_be_sent_with_is_named(shop: Shop, field: str, body: dict[str, Any]) -> None:
    refused = shop.call("POST", "/readings", 422, characteristic=shop.characteristic, **body)
    assert field in [error["field"] for error in refused["errors"]]
