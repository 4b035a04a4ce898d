"""Acknowledging alarms over HTTP, on a real server: what follows from each action, once, and who was first."""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx
import pytest

from tests.shop import Shop


def codes(alarm: Any) -> list[str]:
    return [item["code"] for item in alarm["outcome"]]


class TestList:
    def test_oldest_first_with_filters(self, shop: Shop) -> None:
        shop.read(20.0)
        shop.read(350.0)
        shop.read(1500.0)
        ids = [alarm["id"] for alarm in shop.alarms()]
        assert ids == sorted(ids)
        assert [alarm["kind"] for alarm in shop.alarms()] == ["oversize", "tool_worn", "probe_fault"]
        path = f"/alarms?machine={shop.machine}"
        assert [a["id"] for a in shop.call("GET", f"{path}&kind=tool_worn")["items"]] == [ids[1]]
        first = shop.call("GET", f"{path}&limit=2")
        assert [a["id"] for a in first["items"]] == ids[:2]
        assert [a["id"] for a in shop.call("GET", f"{path}&after={first['next']}")["items"]] == ids[2:]
        assert len(shop.call("GET", f"/alarms?characteristic={shop.characteristic}")["items"]) == 3
        shop.acknowledge(ids[0], "noted")
        assert [alarm["id"] for alarm in shop.alarms()] == ids[1:]
        assert [alarm["id"] for alarm in shop.alarms("acknowledged")] == ids[:1]
        assert len(shop.alarms("all")) == 3

    def test_a_repetition_counts_and_raises_no_second_alarm(self, shop: Shop) -> None:
        shop.read(350.0)
        shop.read(360.0)
        (alarm,) = shop.alarms()
        assert (alarm["count"], alarm["sequence"], alarm["last_sequence"]) == (2, 1, 2)
        assert alarm["held_correction"] == {"number": 2, "amount": -0.36}
        assert "tool 3" in alarm["text"]
        assert alarm == shop.call("GET", f"/alarms/{alarm['id']}")

    def test_what_is_not_there(self, shop: Shop) -> None:
        for number in ("0", "999999", "99999999999999999999"):
            shop.call("GET", f"/alarms/{number}", 404)
            shop.call("POST", f"/alarms/{number}/acknowledge", 404, action="noted", comment="x")
        shop.call("GET", "/alarms?machine=nowhere", 404)
        shop.call("GET", "/alarms?characteristic=nothing", 404)
        shop.call("GET", "/alarms?state=open", 422)

    def test_a_machine_sees_its_own(self, shop: Shop, server: Any) -> None:
        shop.read(20.0)
        other = Shop(server)
        seen = shop.call("GET", "/alarms", client=shop.machine_client)["items"]
        assert {alarm["machine"] for alarm in seen} == {shop.machine}
        assert shop.call("GET", "/alarms", client=other.machine_client)["items"] == []
        shop.call("GET", f"/alarms?machine={shop.machine}", 403, client=other.machine_client)
        shop.call("GET", f"/alarms/{seen[0]['id']}", 403, client=other.machine_client)


class TestToolReplaced:
    def test_drops_the_correction_and_begins_a_new_life(self, shop: Shop) -> None:
        shop.correction(shop.read(20.0)["correction"]["number"], "applied")
        shop.read(1.0)
        held = shop.read(350.0)["correction"]["number"]
        assert shop.average() != 0.0
        alarm = next(a for a in shop.alarms() if a["kind"] == "tool_worn")
        done = shop.acknowledge(alarm["id"], "tool_replaced", comment="new insert", offset=0.05)
        assert codes(done) == ["tool_restarted", "corrections_superseded", "averages_restarted"]
        assert done["outcome"][0] | {"text": ""} == {
            "code": "tool_restarted",
            "tool": 3,
            "offset": 0.05,
            "parts": 3,
            "text": "",
        }
        assert all(item["text"] for item in done["outcome"])
        assert (done["state"], done["action"], done["comment"]) == ("acknowledged", "tool_replaced", "new insert")
        assert done["held_correction"] is None
        assert shop.correction(held)["status"] == "superseded"
        tool = shop.tool()
        assert (tool["offset"], tool["total"], tool["parts"]) == (0.05, 0.0, 0)
        assert shop.average() == 0.0

    def test_starts_at_zero_unless_said(self, shop: Shop) -> None:
        shop.call("PUT", f"/machines/{shop.machine}/tools/3", offset=0.3, reason="x")
        shop.read(350.0)
        shop.acknowledge(shop.alarms()[0]["id"], "tool_replaced")
        assert shop.tool()["offset"] == 0.0

    def test_two_alarms_of_one_worn_tool_change_it_once(self, shop: Shop) -> None:
        shop.add(f"{shop.characteristic}-b", average_memory=6)
        shop.read(350.0)
        shop.read(350.0, f"{shop.characteristic}-b")
        first, second = shop.alarms()
        shop.acknowledge(first["id"], "tool_replaced", offset=0.2)
        new = shop.read(6.0)["correction"]["number"]
        done = shop.acknowledge(second["id"], "tool_replaced")
        assert codes(done) == ["tool_changed_already"]
        assert shop.tool()["offset"] == 0.2
        assert shop.correction(new)["status"] == "pending"

    def test_an_alarm_raised_since_the_change_changes_the_tool_again(self, shop: Shop) -> None:
        shop.read(350.0)
        shop.call("POST", f"/machines/{shop.machine}/tools/3/change", reason="worn")
        shop.read(350.0)
        (alarm,) = shop.alarms()
        assert codes(shop.acknowledge(alarm["id"], "tool_replaced"))[0] == "tool_restarted"

    def test_an_offset_in_another_unit_is_asked_about(self, shop: Shop) -> None:
        shop.read(350.0)
        (alarm,) = shop.alarms()
        done = shop.acknowledge(alarm["id"], "tool_replaced", offset=50.0)
        assert codes(done)[:2] == ["tool_restarted", "offset_far"]
        assert "is it µm" in done["outcome"][1]["text"]

    def test_not_without_a_tool(self, shop: Shop) -> None:
        shop.add(f"{shop.characteristic}-m", tool_memory=0)
        shop.read(20.0, f"{shop.characteristic}-m")
        (alarm,) = shop.alarms()
        problem = shop.acknowledge(alarm["id"], "tool_replaced", 422)
        assert problem["errors"][0]["field"] == "action"
        assert "R10 = 0" in problem["detail"]
        assert shop.alarms()[0]["id"] == alarm["id"]


class TestKeepCutting:
    def test_releases_the_held_correction(self, shop: Shop) -> None:
        number = shop.read(350.0)["correction"]["number"]
        done = shop.acknowledge(shop.alarms()[0]["id"], "keep_cutting", comment="edge good")
        assert codes(done) == ["correction_released"]
        correction = shop.correction(number)
        assert (correction["status"], correction["status_reason"]) == ("pending", "edge good")
        assert shop.correction(number, "applied")["offset_after"] == -0.35

    def test_when_it_was_superseded_nothing_is_released(self, shop: Shop) -> None:
        shop.read(350.0)
        shop.read(20.0)
        alarm = next(a for a in shop.alarms() if a["kind"] == "tool_worn")
        assert codes(shop.acknowledge(alarm["id"], "keep_cutting")) == ["nothing_held"]

    def test_after_readings_within_the_wear_limit_it_is_dropped(self, shop: Shop) -> None:
        """One bad touch looks like a worn tool; 350 µm on an edge that cuts well would spoil the next part."""
        number = shop.read(350.0)["correction"]["number"]
        for _part in range(3):
            assert shop.read(0.2)["correction"] is None
        alarm = next(a for a in shop.alarms() if a["kind"] == "tool_worn")
        assert codes(shop.acknowledge(alarm["id"], "keep_cutting")) == ["correction_withdrawn", "readings_disagree"]
        assert shop.correction(number)["status"] == "rejected"

    def test_a_reading_that_lies_in_the_wear_zone_again_speaks_for_it(self, shop: Shop) -> None:
        shop.read(350.0)
        shop.read(0.2)
        newer = shop.read(352.0)["correction"]["number"]
        alarm = next(a for a in shop.alarms() if a["kind"] == "tool_worn")
        assert codes(shop.acknowledge(alarm["id"], "keep_cutting")) == ["correction_released"]
        assert shop.correction(newer)["status"] == "pending"

    def test_the_held_correction_of_another_characteristic_stays_held(self, shop: Shop) -> None:
        shop.add(f"{shop.characteristic}-b", average_memory=6)
        shop.read(350.0)
        number = shop.read(350.0, f"{shop.characteristic}-b")["correction"]["number"]
        first, second = shop.alarms()
        assert (first["held_correction"], second["held_correction"]["number"]) == (None, number)
        assert codes(shop.acknowledge(first["id"], "keep_cutting")) == ["nothing_held"]
        assert shop.correction(number)["status"] == "held"


class TestFalseReading:
    def test_excludes_the_readings_and_withdraws_what_they_asked_for(self, shop: Shop) -> None:
        shop.read(1.0)
        average = shop.average()
        shop.read(350.0)
        shop.read(0.0)
        number = shop.read(360.0)["correction"]["number"]
        after = shop.average()
        (alarm,) = shop.alarms()
        done = shop.acknowledge(alarm["id"], "false_reading", comment="chip on the stylus")
        assert codes(done) == ["readings_excluded", "correction_withdrawn"]
        assert done["outcome"][0]["sequences"] == [2, 4]
        assert shop.correction(number)["status"] == "rejected"
        assert shop.average() == after != average
        excluded = [
            item["sequence"]
            for item in shop.call("GET", f"/readings?characteristic={shop.characteristic}")["items"]
            if item["excluded"]
        ]
        assert excluded == [2, 4]

    def test_a_pending_correction_of_the_reading_is_withdrawn(self, shop: Shop) -> None:
        number = shop.read(20.0)["correction"]["number"]
        shop.acknowledge(shop.alarms()[0]["id"], "false_reading")
        assert shop.correction(number)["status"] == "rejected"

    def test_an_applied_one_stays_and_it_is_said(self, shop: Shop) -> None:
        number = shop.read(20.0)["correction"]["number"]
        shop.correction(number, "applied")
        done = shop.acknowledge(shop.alarms()[0]["id"], "false_reading")
        assert codes(done) == ["readings_excluded", "correction_applied"]
        assert shop.tool()["offset"] == -0.02

    def test_a_reading_excluded_before_is_no_trouble(self, shop: Shop) -> None:
        shop.read(350.0)
        shop.call("POST", f"/readings/{shop.characteristic}/1/exclude", reason="seen at once")
        done = shop.acknowledge(shop.alarms()[0]["id"], "false_reading")
        assert codes(done) == ["readings_excluded_before", "correction_withdrawn"]

    def test_the_offset_limit_names_its_reading(self, shop: Shop) -> None:
        shop.add(f"{shop.characteristic}-l", max_total=0.01, average_memory=6)
        shop.read(20.0, f"{shop.characteristic}-l")
        alarm = next(a for a in shop.alarms() if a["kind"] == "offset_limit")
        done = shop.acknowledge(alarm["id"], "false_reading")
        assert done["outcome"][0]["characteristic"] == f"{shop.characteristic}-l"

    def test_not_for_an_alarm_without_readings(self, shop: Shop) -> None:
        shop.correction(shop.read(6.0)["correction"]["number"], "applied", offset_after=0.5)
        (alarm,) = shop.alarms()
        problem = shop.acknowledge(alarm["id"], "false_reading", 422)
        assert problem["errors"][0]["field"] == "action"
        assert codes(shop.acknowledge(alarm["id"], "noted")) == ["offset_set", "averages_restarted", "tool_resumed"]


class TestPause:
    @pytest.mark.parametrize("action", ["noted", "false_reading", "tool_replaced", "keep_cutting"])
    def test_a_paused_characteristic_goes_on(self, shop: Shop, action: str) -> None:
        shop.read(1500.0)
        paused = shop.read(20.0)
        assert (paused["reason"]["code"], paused["correction"]) == ("paused", None)
        alarm = next(a for a in shop.alarms() if a["kind"] == "probe_fault")
        done = shop.acknowledge(alarm["id"], action)
        assert {"code": "resumed", "characteristic": shop.characteristic}.items() <= done["outcome"][-1].items()
        assert shop.read(20.0)["correction"] is not None

    def test_another_alarm_leaves_it_paused(self, shop: Shop) -> None:
        shop.read(20.0)
        shop.read(1500.0)
        alarm = next(a for a in shop.alarms() if a["kind"] == "oversize")
        shop.acknowledge(alarm["id"], "noted")
        assert shop.read(20.0)["reason"]["code"] == "paused"


class TestRules:
    def test_noted_leaves_the_correction_held_and_says_so(self, shop: Shop) -> None:
        number = shop.read(350.0)["correction"]["number"]
        assert codes(shop.acknowledge(shop.alarms()[0]["id"], "noted")) == ["still_held"]
        assert shop.correction(number)["status"] == "held"

    def test_twice_is_refused_and_says_who_was_first(self, shop: Shop) -> None:
        shop.read(20.0)
        (alarm,) = shop.alarms()
        first = shop.acknowledge(alarm["id"], "noted", comment="part set aside")
        problem = shop.acknowledge(alarm["id"], "false_reading", 409)
        assert first["acknowledged_by"] in problem["detail"]
        assert "part set aside" in problem["detail"]
        assert (problem["acknowledged_by"], problem["action"]) == (first["acknowledged_by"], "noted")
        assert shop.call("GET", f"/alarms/{alarm['id']}") == first

    def test_of_two_at_once_one_is_first(self, shop: Shop, server: Any) -> None:
        shop.read(350.0)
        (alarm,) = shop.alarms()
        clients: list[httpx.Client] = [server.client(server.key("operator")) for _ in range(4)]
        with ThreadPoolExecutor(4) as pool:
            answers = list(
                pool.map(
                    lambda pair: pair[0].post(
                        f"/api/v1/alarms/{alarm['id']}/acknowledge", json={"action": pair[1], "comment": "x"}
                    ),
                    zip(clients, ["tool_replaced", "keep_cutting", "false_reading", "noted"], strict=True),
                )
            )
        assert sorted(answer.status_code for answer in answers) == [200, 409, 409, 409]
        entries = shop.call("GET", f"/audit?subject=alarm/{alarm['id']}")["items"]
        assert [entry["action"] for entry in entries] == ["alarm acknowledged"]

    def test_a_new_alarm_may_come_after_it(self, shop: Shop) -> None:
        shop.read(20.0)
        (first,) = shop.alarms()
        shop.acknowledge(first["id"], "noted")
        shop.read(50.0)
        (second,) = shop.alarms()
        assert second["id"] > first["id"]
        assert second["count"] == 1

    @pytest.mark.parametrize(
        ("body", "field"),
        [
            ({"action": "noted"}, "comment"),
            ({"comment": "x"}, "action"),
            ({"action": "ignore", "comment": "x"}, "action"),
            ({"action": "noted", "comment": " "}, "comment"),
            ({"action": "noted", "comment": "x", "offset": 0.1}, "offset"),
            ({"action": "tool_replaced", "comment": "x", "offset": 1e9}, "offset"),
            ({"action": "tool_replaced", "comment": "x", "offset": "0"}, "offset"),
            ({"action": "noted", "comment": "x", "by": "me"}, "by"),
        ],
    )
    def test_bad_bodies_name_the_field_and_change_nothing(self, shop: Shop, body: dict[str, Any], field: str) -> None:
        shop.read(20.0)
        (alarm,) = shop.alarms()
        problem = shop.call("POST", f"/alarms/{alarm['id']}/acknowledge", 422, **body)
        assert problem["errors"][0]["field"] == field
        assert shop.alarms() == [alarm]

    def test_operators_acknowledge_viewers_and_machines_do_not(self, shop: Shop, server: Any) -> None:
        shop.read(20.0)
        (alarm,) = shop.alarms()
        path = f"/alarms/{alarm['id']}/acknowledge"
        for client in (server.client(server.key("viewer")), shop.machine_client):
            shop.call("POST", path, 403, client=client, action="noted", comment="x")
        operator = server.client(server.key("operator"))
        shop.call("POST", path, client=operator, action="noted", comment="x")
