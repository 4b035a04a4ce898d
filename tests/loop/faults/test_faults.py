"""Faults that a machine reports itself: an alarm that the machine ends."""

from typing import Any

from tests.shop import Person, Shop


def report(shop: Shop, status: int = 201, **fault: Any) -> Any:
    return shop.call("POST", f"/machines/{shop.machine}/faults", status, client=shop.machine_client, **fault)


def test_a_fault_is_an_alarm_until_the_machine_says_that_it_is_over(shop: Shop, server: Any) -> None:
    first = report(shop, kind="battery_low", text="Probe battery low")
    assert (first["active"], first["count"]) == (True, 1)
    assert report(shop, 200, kind="battery_low", text="Probe battery low")["count"] == 2
    other = report(shop, kind="receiver")
    assert other["alarm"] != first["alarm"]
    alarms = {alarm["id"]: alarm for alarm in shop.alarms()}
    assert alarms[first["alarm"]]["kind"] == "machine_fault"
    assert alarms[first["alarm"]]["text"].endswith("battery of the probe is low. “Probe battery low”")
    page = Person(server, "operator").open(f"/alarms?machine={shop.machine}")
    assert "battery of the probe is low" in page
    assert f"/calibration/{shop.machine}" not in page, "a fault is about no place of calibration"
    assert report(shop, 200, kind="battery_low", active=False)["alarm"] == first["alarm"]
    ended = shop.call("GET", f"/alarms/{first['alarm']}")
    assert (ended["state"], ended["outcome"][0]["code"]) == ("acknowledged", "fault_over")
    assert [alarm["id"] for alarm in shop.alarms()] == [other["alarm"]]


def test_the_end_of_a_fault_that_nobody_knew_changes_nothing(shop: Shop) -> None:
    assert report(shop, 200, kind="other", active=False) == {
        "kind": "other",
        "active": False,
        "alarm": None,
        "count": 0,
    }
    assert shop.alarms() == []


def test_a_fault_of_another_machine_and_an_unknown_kind_are_refused(shop: Shop, server: Any) -> None:
    other = Shop(server)
    path = f"/machines/{other.machine}/faults"
    shop.call("POST", path, 403, client=shop.machine_client, kind="receiver")
    assert report(shop, 422, kind="on_fire")["errors"][0]["field"] == "kind"
    assert other.alarms() == []
