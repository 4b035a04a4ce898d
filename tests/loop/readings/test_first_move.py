"""A probe that triggers on its first move: there is no bore, and the reading stops the machine whatever its value."""

from typing import Any

import pytest

from tests.shop import Shop


def test_it_stops_the_machine_and_says_why(shop: Shop) -> None:
    shop.read(3.0)
    answer = shop.read(3.0, first_move_triggered=True, key="n999")
    assert (answer["zone"], answer["action"], answer["correction"]) == ("probe_fault", "stop", None)
    assert answer["reason"]["code"] == "first_move_triggered"
    assert "no bore" in answer["reason"]["text"]
    assert answer["average_after"] == answer["average_before"]
    (alarm,) = shop.alarms()
    assert alarm["kind"] == "probe_fault"
    assert alarm["text"].startswith("The first move of the probe triggered")
    assert shop.read(3.0)["reason"]["code"] == "paused"
    again = shop.call(
        "POST", "/readings", characteristic=shop.characteristic, measured=40.003, first_move_triggered=True, key="n999"
    )
    assert again["sequence"] == answer["sequence"]


def test_among_many_quiet_ones_only_it_stops(shop: Shop) -> None:
    many = [{"characteristic": shop.characteristic, "measured": 40.0005} for _ in range(200)]
    many[150]["first_move_triggered"] = True
    answer = shop.server.client(shop.server.key(machine=shop.machine)).post(
        "/api/v1/readings/batch?decisions=true", json=many
    )
    codes = [item["reason"]["code"] for item in answer.json()["items"]]
    assert codes == ["within_zero_range"] * 150 + ["first_move_triggered"] + ["paused"] * 49


@pytest.mark.parametrize(
    ("field", "body"),
    [
        ("measured", {"first_move_triggered": True}),
        ("touches", {"first_move_triggered": True, "touches": [[40.0]]}),
        ("first_move_triggered", {"measured": 40.0, "first_move_triggered": "yes"}),
    ],
)
def test_what_it_cannot_be_sent_with_is_named(shop: Shop, field: str, body: dict[str, Any]) -> None:
    refused = shop.call("POST", "/readings", 422, characteristic=shop.characteristic, **body)
    assert field in [error["field"] for error in refused["errors"]]
