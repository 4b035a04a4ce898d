"""A tool measured by the probe: its length is a reading that speaks of wear, and corrects nothing."""

from typing import Any

import pytest

from tests.shop import Shop

LENGTH = {"feature": "tool", "mode": "measure_only", "average_memory": 0, "axis": "Z"}


@pytest.fixture
def setter(shop: Shop) -> Shop:
    """It measures the length of a tool as well."""
    shop.add(f"{shop.machine}-length", **LENGTH)
    return shop


def test_corrections_of_the_offset_do_not_touch_the_wear_of_a_measured_tool(setter: Shop) -> None:
    length = f"{setter.machine}-length"
    for part in range(1, 41):
        correction = setter.read(6.0)["correction"]  # the part asks for a correction of the same tool
        if correction:
            setter.correction(correction["number"], "applied")
        answer = setter.read(-0.1 * part, length)
        assert (answer["action"], answer["correction"]) == ("none", None)
    wear = setter.call("GET", f"/characteristics/{length}/wear")
    assert wear["wear_per_part"]["value"] == pytest.approx(-0.0001, rel=0.05)
    assert setter.alarms() == []


def test_a_worn_length_raises_the_alarm_of_its_tool(setter: Shop) -> None:
    answer = setter.read(-310.0, f"{setter.machine}-length")
    assert (answer["zone"], answer["correction"]) == ("wear", None)
    (alarm,) = setter.alarms()
    assert (alarm["kind"], alarm["tool_memory"]) == ("tool_worn", 3)


@pytest.mark.parametrize(("field", "change"), [("mode", {"mode": "automatic"}), ("tool_memory", {"tool_memory": 0})])
def test_a_tool_has_a_location_and_is_only_measured(setter: Shop, field: str, change: dict[str, Any]) -> None:
    path, reason = f"/characteristics/{setter.machine}-length", "tried"
    refused = setter.call("PATCH", path, 422, parameters=change, reason=reason)
    assert [error["field"] for error in refused["errors"]] == [f"parameters.{field}"]
