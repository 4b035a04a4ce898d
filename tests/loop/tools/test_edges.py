"""Tool edges: what is in a location, its lives against the plan, and its sister that goes on."""

from typing import Any

import pytest

from app.core.plausibility import uncorrected
from app.db.engine import Database
from app.jobs.actions import run_jobs
from app.loop.tools.jobs import JOBS
from tests.shop import Shop

SETTINGS: dict[str, Any] = {
    "edge": "D1",
    "name": "T03 finishing",
    "kind": "DCMT 11T304",
    "planned_parts": 3,
    "planned_total": 0.05,
    "sister": 13,
}


def path(shop: Shop, more: str = "", number: int = 3) -> str:
    return f"/machines/{shop.machine}/tools/{number}{more}"


def rounds(server: Any) -> None:
    database: Database = server.database
    run_jobs(database, JOBS)


def codes(alarm: Any) -> list[str]:
    return [item["code"] for item in alarm["outcome"]]


class TestSettings:
    def test_what_is_said_is_kept_and_on_record(self, shop: Shop) -> None:
        made = shop.call("PATCH", path(shop), **SETTINGS)
        assert {name: made[name] for name in SETTINGS} == SETTINGS
        assert (made["life_used"], made["parts_left"]) == (0.0, 3)
        changed = shop.admin.patch(f"/api/v1{path(shop)}", json={"planned_parts": None, "edge": "D2"}).json()
        assert (changed["planned_parts"], changed["edge"], changed["sister"]) == (None, "D2", 13)
        entries = shop.call("GET", f"/audit?subject=tool/{shop.machine}/3")["items"]
        assert [entry["action"] for entry in entries] == ["tool described"] * 2
        assert shop.tool(4)["name"] is None

    @pytest.mark.parametrize(
        ("field", "value"),
        [
            ("sister", 3),
            ("sister", 0),
            ("sister", 33),
            ("sister", "13"),
            ("planned_parts", 0),
            ("planned_parts", 1.5),
            ("planned_parts", 10**12),
            ("planned_total", 0),
            ("planned_total", -0.1),
            ("planned_total", "0.1"),
            ("name", ""),
            ("name", "x" * 201),
            ("edge", "a\nb"),
            ("colour", "red"),
        ],
    )
    def test_bad_ones_name_the_field(self, shop: Shop, field: str, value: Any) -> None:
        problem = shop.call("PATCH", path(shop), 422, **{field: value})
        assert problem["errors"][0]["field"] == field
        assert shop.tool()["sister"] is None

    def test_who_may(self, shop: Shop, server: Any) -> None:
        viewer = server.client(server.key("viewer"))
        shop.call("PATCH", path(shop), 403, client=viewer, name="x")
        shop.call("PATCH", path(shop), 403, client=shop.machine_client, name="x")
        shop.call("GET", path(shop, "/lives"), client=viewer)
        shop.call("PATCH", path(shop, number=33), 404, name="x")


class TestLives:
    def test_every_change_ends_one(self, shop: Shop) -> None:
        shop.call("PATCH", path(shop), edge="D1", name="T03")
        for _part in range(4):
            for item in shop.call("GET", f"/machines/{shop.machine}/corrections?status=pending")["items"]:
                shop.correction(item["number"], "applied")
            shop.read(6.0)
        shop.call("POST", path(shop, "/change"), reason="chipped")
        shop.read(1.0)
        shop.call("PATCH", path(shop), edge="D2")
        shop.call("POST", path(shop, "/change"), offset=0.1, reason="worn")
        found = shop.call("GET", path(shop, "/lives"))
        now, second, first = found["lives"]
        assert (first["parts"], first["total"], first["edge"], first["reason"]) == (4, -0.018, "D1", "chipped")
        assert first["began_at"] is None
        assert (second["parts"], second["total"], second["edge"], second["reason"]) == (1, 0.0, "D2", "worn")
        assert second["began_at"] == first["ended_at"]
        assert (now["parts"], now["total"], now["ended_at"], now["began_at"]) == (0, 0.0, None, second["ended_at"])
        assert second["seconds"] >= 0
        assert found["usual_parts"] == 2.5
        figure = shop.call("GET", path(shop, "/lives/figure"))
        bars = {trace["meta"]: trace["y"] for trace in figure["data"]}
        assert bars["parts"] == [4, 1, 0]
        assert bars["total"] == pytest.approx([-18.0, 0.0, 0.0])

    def test_left_and_used(self, shop: Shop) -> None:
        shop.call("PATCH", path(shop), planned_parts=10, planned_total=0.02)
        shop.correction(shop.read(8.0)["correction"]["number"], "applied")
        shop.read(0.0)
        tool = shop.tool()
        assert (tool["life_used"], tool["parts_left"]) == (0.4, 3)  # 8 of 20 µm in two parts: 12 µm are three more

    def test_a_reached_plan_raises_one_alarm_in_a_life(self, shop: Shop, server: Any) -> None:
        shop.call("PATCH", path(shop), planned_parts=2)
        shop.read(0.0)
        rounds(server)
        assert shop.alarms() == []
        shop.read(0.0)
        rounds(server)
        (alarm,) = shop.alarms()
        assert (alarm["kind"], alarm["tool_memory"], alarm["count"]) == ("tool_life", 3, 1)
        assert "has cut 2 parts" in alarm["text"]
        shop.acknowledge(alarm["id"], "noted")
        shop.read(0.0)
        rounds(server)
        assert shop.alarms() == []  # it was told
        shop.call("POST", path(shop, "/change"), reason="new")
        for _part in range(2):
            shop.read(0.0)
        rounds(server)
        (again,) = shop.alarms()
        assert codes(shop.acknowledge(again["id"], "tool_replaced"))[0] == "tool_restarted"
        shop.call("PATCH", path(shop), planned_total=0.005)
        shop.correction(shop.read(6.0)["correction"]["number"], "applied")
        rounds(server)
        (by_wear,) = shop.alarms()
        assert "−6.0" in by_wear["text"]
        assert "±5" in by_wear["text"]


class TestSister:
    def test_its_characteristics_go_on_with_it(self, shop: Shop) -> None:
        other = f"{shop.characteristic}-b"
        shop.add(other, average_memory=6)
        shop.call("PATCH", path(shop), sister=13)
        for key in (shop.characteristic, other, shop.characteristic):
            shop.read(0.8, key)
        waiting = shop.read(20.0)["correction"]["number"]
        done = shop.call("POST", path(shop, "/switch"), reason="edge worn")
        assert done == {
            "machine": shop.machine,
            "tool": 3,
            "sister": 13,
            "characteristics": sorted([shop.characteristic, other]),
            "superseded": [waiting],
            "averages": [5, 6],
        }
        assert (shop.average(5), shop.average(6)) == (0.0, 0.0)
        for key in (shop.characteristic, other):
            current = shop.call("GET", f"/characteristics/{key}")
            assert current["parameters"]["tool_memory"] == 13
        answer = shop.read(20.0)
        assert answer["correction"]["tool_memory"] == 13
        assert answer["parameters_version"] == 2
        old, new = shop.tool(3), shop.tool(13)
        assert (old["parts"], old["characteristics"]) == (3, [])  # three parts of the one that counted most
        assert (new["parts"], new["characteristics"]) == (1, sorted([shop.characteristic, other]))
        shop.call("POST", path(shop, "/change"), reason="new insert")
        assert shop.call("GET", path(shop, "/lives"))["lives"][1]["parts"] == 3
        assert shop.tool(3)["parts"] == 0, "the new insert has cut nothing yet"

    def test_parts_cut_before_say_nothing_about_the_sister(self, shop: Shop) -> None:
        shop.call("PATCH", path(shop), sister=13)
        number = shop.read(20.0)["correction"]["number"]
        shop.correction(number, "applied")
        shop.call("POST", path(shop, "/switch"), reason="worn")
        before = shop.call("GET", path(shop, "", 13))["reset_at"]
        late = shop.read(30.0, machined_at="2026-01-01T00:00:00Z", measured_at="2026-01-01T00:00:01Z")
        assert before is not None
        assert late["reason"]["code"] == "before_tool_change"

    def test_without_one_or_twice(self, shop: Shop) -> None:
        problem = shop.call("POST", path(shop, "/switch"), 409, reason="worn")
        assert "has no sister" in problem["detail"]
        shop.call("PATCH", path(shop), sister=13)
        shop.call("POST", path(shop, "/switch"), reason="worn")
        problem = shop.call("POST", path(shop, "/switch"), 409, reason="worn")
        assert "any more" in problem["detail"]

    def test_at_the_alarm_of_a_worn_tool(self, shop: Shop) -> None:
        other = f"{shop.characteristic}-b"
        shop.add(other, average_memory=6)
        shop.call("PATCH", path(shop), sister=13)
        shop.read(350.0)
        shop.read(350.0, other)
        first, second = shop.alarms()
        done = shop.acknowledge(first["id"], "sister_tool", comment="edge broken")
        assert codes(done) == ["switched", "corrections_superseded", "averages_restarted"]
        assert "Tool 13 goes on for tool 3" in done["outcome"][0]["text"]
        assert codes(shop.acknowledge(second["id"], "sister_tool")) == ["switched_already"]
        assert shop.tool(13)["characteristics"] == sorted([shop.characteristic, other])
        entries = shop.call("GET", f"/audit?subject=characteristic/{other}")["items"]
        assert [entry["why"] for entry in entries if entry["action"] == "parameters changed"] == ["edge broken"]

    def test_an_alarm_of_a_tool_without_one(self, shop: Shop) -> None:
        shop.read(350.0)
        shop.acknowledge(shop.alarms()[0]["id"], "sister_tool", 409)
        assert len(shop.alarms()) == 1


def test_what_the_level_is_made_of() -> None:
    assert uncorrected(0.0, -0.018, -1.0) == 0.018
