"""A tool measured by the probe: its length is a reading that speaks of wear, and may correct its own offset."""

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


def test_a_tool_has_a_location(setter: Shop) -> None:
    path = f"/characteristics/{setter.machine}-length"
    refused = setter.call("PATCH", path, 422, parameters={"tool_memory": 0}, reason="tried")
    assert [error["field"] for error in refused["errors"]] == ["parameters.tool_memory"]


@pytest.fixture
def presetter(shop: Shop) -> Shop:
    """The length of tool 5 is measured and corrects its offset; no part does."""
    shop.add(f"{shop.machine}-length", **{**LENGTH, "mode": "automatic", "tool_memory": 5, "factor": 1.0})
    return shop


def total(shop: Shop) -> float:
    return round(1000 * float(shop.tool(5)["offset"]), 6)


def test_the_offset_becomes_what_the_tool_differs_by_however_often_it_is_measured(presetter: Shop) -> None:
    """Each of these lengths is off by all that was corrected before, too, in effect or not."""
    length = f"{presetter.machine}-length"
    first = presetter.read(-8.0, length)
    assert (first["correction"]["amount"], first["decided_deviation"]) == (-0.008, -0.008)
    again = presetter.read(-8.0, length)
    assert (again["action"], again["decided_deviation"]) == ("none", 0.0), "it is pending"
    presetter.correction(first["correction"]["number"], "applied")
    after = presetter.read(-8.0, length)
    assert (after["action"], after["decided_deviation"], after["alarms"]) == ("none", 0.0, [])
    assert after["reason"]["notes"] == ["corrections_of_tool"]
    worn = presetter.read(-14.0, length)
    assert (worn["correction"]["amount"], worn["zone"]) == (-0.006, "full")
    presetter.correction(worn["correction"]["number"], "applied")
    assert (presetter.read(-14.0, length)["action"], total(presetter)) == ("none", -14.0)
    assert presetter.alarms() == []
    presetter.call("POST", f"/machines/{presetter.machine}/tools/5/change", offset=0.0, reason="insert")
    assert presetter.read(3.0, length)["decided_deviation"] == 0.003
    replayed = presetter.call("POST", f"/characteristics/{length}/what-if", delay=0)
    assert replayed["likeness"]["replayed"]["corrections"] == replayed["truly"]["corrections"] == 3
    for figures in (replayed["likeness"]["replayed"], replayed["truly"]):
        assert figures["rejects"] == figures["undersize"] == 0, "sizes of tools are no parts"


def test_a_tool_that_wears_by_more_than_its_tolerance_is_corrected_each_time(presetter: Shop) -> None:
    """None of its sizes comes back, for a longer offset makes no tool longer: it is not *still out of tolerance*."""
    for times in range(1, 8):
        answer = presetter.read(-30.0 * times, f"{presetter.machine}-length")
        assert (answer["action"], answer["correction"]["amount"]) == ("correct", -0.03), times
        presetter.correction(answer["correction"]["number"], "applied")


def test_a_worn_tool_is_worn_though_its_offset_has_it(presetter: Shop) -> None:
    length = f"{presetter.machine}-length"
    for size in (-150.0, -290.0):
        number = presetter.read(size, length)["correction"]["number"]
        presetter.correction(number, "applied")
    answer = presetter.read(-310.0, length)
    assert (answer["zone"], answer["action"], answer["correction"]["amount"]) == ("wear", "hold", -0.02)
    assert "-310" in answer["reason"]["text"].replace("\N{MINUS SIGN}", "-")
    assert [alarm["kind"] for alarm in presetter.alarms() if alarm["kind"] == "tool_worn"]


def test_an_offset_that_was_set_by_hand_waits_for_the_tool_change(presetter: Shop) -> None:
    """What somebody has typed may have the wear in it, or not: corrected once more, the next part is scrap."""
    length, tool = f"{presetter.machine}-length", f"/machines/{presetter.machine}/tools/5"
    presetter.read(-8.0, length)
    presetter.call("PUT", tool, offset=-0.008, reason="measured by hand")
    answer = presetter.read(-8.0, length)
    assert (answer["action"], answer["reason"]["code"]) == ("none", "offset_by_hand")
    presetter.call("POST", f"{tool}/change", offset=0.0, reason="insert")
    late = presetter.read(-8.0, length, measured_at="2026-01-05T10:00:00Z")
    assert (late["action"], late["reason"]["code"]) == ("none", "before_tool_change")
    assert presetter.read(-6.0, length)["correction"]["amount"] == -0.006


def test_parts_and_the_size_of_the_tool_do_not_correct_one_offset(setter: Shop) -> None:
    """The second is refused, whichever it is: each would take back what the other has corrected."""
    path = f"/characteristics/{setter.machine}-length"
    refused = setter.call("PATCH", path, 422, parameters={"mode": "automatic", "factor": 1}, reason="tried")
    [error] = refused["errors"]
    assert (error["field"], "is corrected by" in error["message"]) == ("parameters.tool_memory", True)
    setter.call("PATCH", path, parameters={"mode": "automatic", "tool_memory": 5, "factor": 1}, reason="own")
    part = {"tool_memory": 5, "average_memory": 9}
    setter.call("PATCH", f"/characteristics/{setter.characteristic}", 422, parameters=part, reason="tried")


def test_a_negative_factor_of_a_tool_needs_a_person_for_each_correction(setter: Shop) -> None:
    """No size shows that it is wrong: the first correction of a tool that is 0.2 mm short makes a part that is 0.4 mm off."""
    path, wrong = f"/characteristics/{setter.machine}-length", {"tool_memory": 5, "factor": -1}
    refused = setter.call("PATCH", path, 422, parameters={"mode": "automatic"} | wrong, reason="tried")
    [error] = refused["errors"]
    assert (error["field"], "use the mode approval" in error["message"]) == ("parameters.factor", True)
    warned = setter.call("PATCH", path, parameters={"mode": "approval"} | wrong, reason="this control counts down")
    assert [each["code"] for each in warned["warnings"]] == ["factor_of_tool"]
    answer = setter.read(-8.0, f"{setter.machine}-length")
    assert (answer["correction"]["status"], answer["correction"]["amount"]) == ("awaiting_approval", 0.008)
