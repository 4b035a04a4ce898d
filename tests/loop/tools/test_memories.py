"""Tool memory and average memory over HTTP: manual edits, tool changes, empirical values, and what follows from them."""

from datetime import UTC, datetime, timedelta
from typing import Any

import pytest

from app.charts import to_plotly
from app.loop.tools.figures import OffsetChange, offset_figure
from tests.shop import Shop


def path(shop: Shop, number: int | str = 3) -> str:
    return f"/machines/{shop.machine}/tools/{number}"


class TestTools:
    def test_a_new_machine_has_32_tools_at_zero(self, shop: Shop) -> None:
        page = shop.call("GET", f"/machines/{shop.machine}/tools")
        assert [tool["tool_memory"] for tool in page["items"]] == list(range(1, 33))
        assert page["next"] is None
        assert {tool["offset"] for tool in page["items"]} == {0.0}
        assert page["items"][2]["characteristics"] == [shop.characteristic]
        part = shop.call("GET", f"/machines/{shop.machine}/tools?after=30&limit=1")
        assert ([tool["tool_memory"] for tool in part["items"]], part["next"]) == ([31], "31")

    @pytest.mark.parametrize("number", [0, 33, -1, 10**20])
    def test_other_locations_are_404_in_words(self, shop: Shop, number: int) -> None:
        problem = shop.call("GET", path(shop, number), 404)
        assert "R10 goes from 1 to 32" in problem["detail"]
        shop.call("PUT", path(shop, number), 404, offset=1.0, reason="x")
        shop.call("POST", f"{path(shop, number)}/change", 404, reason="x")
        shop.call("GET", f"{path(shop, number)}/figure", 404)

    def test_edit_sets_the_offset_and_drops_what_was_computed_before(self, shop: Shop) -> None:
        number = shop.read(20.0)["correction"]["number"]
        shop.read(20.5)  # cut before that correction: counts as 0.5 µm
        assert shop.average() == 0.00025
        answer = shop.call("PUT", path(shop), offset=0.25, reason="set at the control")
        assert answer["offset"] == 0.25
        assert answer["superseded"] == [number]
        assert str(number) in answer["note"]
        assert answer["open_corrections"] == []
        assert answer["parts"] == 2
        assert answer["reset_at"] is not None
        assert answer["changed_at"] is None
        assert shop.average() == 0.0
        gone = shop.correction(number)
        assert (gone["status"], gone["status_reason"], gone["superseded_by"]) == (
            "superseded",
            "set at the control",
            None,
        )
        assert "superseded by" in shop.correction(number, "applied", 409)["detail"]

    def test_edit_drops_held_and_awaiting_ones_too_and_leaves_other_tools_alone(self, shop: Shop) -> None:
        held = shop.read(350.0)["correction"]["number"]
        shop.add(f"{shop.characteristic}-b", mode="approval", tool_memory=3, average_memory=6)
        awaiting = shop.read(20.0, f"{shop.characteristic}-b")["correction"]["number"]
        shop.add(f"{shop.characteristic}-c", tool_memory=4, average_memory=7)
        other = shop.read(20.0, f"{shop.characteristic}-c")["correction"]["number"]
        assert shop.correction(held)["status"] == "superseded"  # by the newer one, at once
        again = shop.read(350.0)["correction"]["number"]
        answer = shop.call("PUT", path(shop), offset=0.0, reason="x")
        assert answer["superseded"] == [awaiting, again]
        assert shop.correction(other)["status"] == "pending"

    def test_change_begins_a_new_life(self, shop: Shop) -> None:
        number = shop.read(20.0)["correction"]["number"]
        shop.correction(number, "applied")
        shop.read(20.0)
        assert (shop.tool()["parts"], shop.tool()["total"]) == (2, -0.02)
        answer = shop.call("POST", f"{path(shop)}/change", offset=-0.5, reason="worn")
        assert (answer["offset"], answer["total"], answer["parts"]) == (-0.5, 0.0, 0)
        assert answer["superseded"] == [number + 1]
        assert answer["changed_at"] == answer["reset_at"]
        shop.read(0.0)
        assert shop.tool()["parts"] == 1

    def test_the_offset_of_a_new_tool_is_zero_unless_said(self, shop: Shop) -> None:
        shop.call("PUT", path(shop), offset=0.25, reason="x")
        assert shop.call("POST", f"{path(shop)}/change", reason="worn")["offset"] == 0.0

    def test_parts_cut_before_the_change_correct_nothing(self, shop: Shop) -> None:
        before = datetime.now(UTC) - timedelta(minutes=1)
        shop.call("POST", f"{path(shop)}/change", reason="worn")
        answer = shop.read(20.0, machined_at=before.isoformat())
        assert (answer["reason"]["code"], answer["correction"]) == ("before_tool_change", None)

    def test_an_alarm_about_the_old_tool_stays(self, shop: Shop) -> None:
        shop.read(350.0)
        shop.call("POST", f"{path(shop)}/change", reason="worn")
        (alarm,) = shop.alarms()
        assert (alarm["kind"], alarm["held_correction"]) == ("tool_worn", None)

    @pytest.mark.parametrize(
        "body",
        [
            {"offset": 1.0},
            {"reason": "x"},
            {"offset": 1e9, "reason": "x"},
            {"offset": "1", "reason": "x"},
            {"offset": None, "reason": "x"},
            {"offset": 1.0, "reason": ""},
            {"offset": 1.0, "reason": "a\u0000b"},
            {"offset": 1.0, "reason": "x", "total": 0},
        ],
    )
    def test_bad_edits_are_refused(self, shop: Shop, body: dict[str, Any]) -> None:
        problem = shop.call("PUT", path(shop), 422, **body)
        assert problem["errors"]
        assert shop.tool()["offset"] == 0.0
        assert shop.tool()["reset_at"] is None

    def test_who_may(self, shop: Shop, server: Any) -> None:
        shop.call("PUT", path(shop), client=shop.machine_client, offset=0.1, reason="typed in at the control")
        shop.call("POST", f"{path(shop)}/change", client=shop.machine_client, reason="sister tool")
        for client in (server.client(server.key("viewer")), Shop(server).machine_client):
            shop.call("PUT", path(shop), 403, client=client, offset=0.2, reason="x")
            shop.call("POST", f"{path(shop)}/change", 403, client=client, reason="x")
        shop.call("GET", path(shop), 403, client=Shop(server).machine_client)

    def test_all_of_it_is_on_record(self, shop: Shop) -> None:
        number = shop.read(20.0)["correction"]["number"]
        shop.call("POST", f"{path(shop)}/change", offset=0.1, reason="chipped")
        (entry,) = shop.call("GET", f"/audit?subject=tool/{shop.machine}/3")["items"]
        assert (entry["action"], entry["why"]) == ("tool changed", "chipped")
        assert (entry["before"]["offset"], entry["after"]["offset"]) == (0.0, 0.1)
        assert entry["after"]["superseded"] == [number]

    def test_the_figure_shows_every_step(self, shop: Shop) -> None:
        empty = shop.call("GET", f"{path(shop)}/figure")
        assert empty["layout"]["annotations"]
        shop.correction(shop.read(20.0)["correction"]["number"], "applied")
        shop.correction(shop.read(50.0)["correction"]["number"], "applied", offset_after=0.5)
        shop.call("PUT", path(shop), offset=0.1, reason="set")
        shop.call("POST", f"{path(shop)}/change", reason="worn")
        figure = shop.call("GET", f"{path(shop)}/figure?theme=dark", client=shop.machine_client)
        assert figure["data"][0]["y"] == [-0.02, 0.5, 0.1, 0.0]
        assert [trace["meta"] for trace in figure["data"][1:5]] == ["correction", "edit", "change", "reported"]


class TestAverages:
    def test_twenty_locations(self, shop: Shop) -> None:
        page = shop.call("GET", f"/machines/{shop.machine}/averages")
        assert [item["average_memory"] for item in page["items"]] == list(range(1, 21))
        assert page["items"][4]["characteristics"] == [shop.characteristic]

    def test_characteristics_share_one(self, shop: Shop) -> None:
        shop.add(f"{shop.characteristic}-b")
        assert len(shop.call("GET", f"/machines/{shop.machine}/averages/5")["characteristics"]) == 2

    @pytest.mark.parametrize("location", [0, 21, -1, 10**20])
    def test_others_are_404_in_words(self, shop: Shop, location: int) -> None:
        problem = shop.call("GET", f"/machines/{shop.machine}/averages/{location}", 404)
        assert "R11 goes from 1 to 20" in problem["detail"]
        put = f"/machines/{shop.machine}/averages/{location}"
        shop.call("PUT", put, 404, empirical_value=0.1, reason="x")

    def test_an_empirical_value_begins_the_average_again_and_counts(self, shop: Shop) -> None:
        shop.read(1.0)
        assert shop.average() == 0.0005
        put = f"/machines/{shop.machine}/averages/5"
        answer = shop.call("PUT", put, empirical_value=0.002, reason="CMM")
        assert (answer["empirical_value"], answer["average"]) == (0.002, 0.0)
        assert answer["updated_at"] is not None
        assert shop.read(2.5)["deviation"] == 0.0005
        (entry,) = shop.call("GET", f"/audit?subject=average/{shop.machine}/5")["items"]
        assert (entry["before"]["average"], entry["after"]["empirical_value"]) == (0.0005, 0.002)

    @pytest.mark.parametrize(
        "body", [{"empirical_value": 1e300, "reason": "x"}, {"empirical_value": 0.1}, {"reason": "x"}]
    )
    def test_bad_values_are_refused(self, shop: Shop, body: dict[str, Any]) -> None:
        shop.call("PUT", f"/machines/{shop.machine}/averages/5", 422, **body)

    def test_who_may(self, shop: Shop, server: Any) -> None:
        put = f"/machines/{shop.machine}/averages/5"
        shop.call("PUT", put, 403, client=server.client(server.key("viewer")), empirical_value=0.1, reason="x")
        shop.call("PUT", put, client=shop.machine_client, empirical_value=0.1, reason="calibration cycle")


def test_what_is_reported_late_draws_no_line_back_in_time() -> None:
    noon = datetime(2026, 11, 22, 12, tzinfo=UTC)
    changes = [OffsetChange(noon + timedelta(hours=hour), hour / 1000, "correction") for hour in (0, 2, 1)]
    line = to_plotly(offset_figure(changes))["data"][0]
    assert line["x"] == sorted(line["x"])
    assert line["y"] == [0.0, 0.001, 0.002]


def test_an_offset_and_an_empirical_value_typed_in_micrometres_are_warned_of(shop: Shop) -> None:
    tool, average = f"/machines/{shop.machine}/tools/3", f"/machines/{shop.machine}/averages/5"
    assert shop.call("PUT", tool, offset=0.4, reason="as on the control")["warnings"] == []
    told = shop.call("PUT", tool, offset=400, reason="as on the control")
    assert [(each["code"], each["field"]) for each in told["warnings"]] == [("offset_step", "offset")]
    assert told["offset"] == 400
    told = shop.call("PUT", tool, offset=15.748, reason="typed from an inch table")
    assert [(each["code"], each["field"]) for each in told["warnings"]] == [("looks_like_inches", "offset")]
    told = shop.call("POST", f"{tool}/change", offset=400, reason="new insert")
    assert [(each["code"], each["field"]) for each in told["warnings"]] == [("offset_step", "offset")]
    assert shop.call("PUT", average, empirical_value=0.0026, reason="CMM")["warnings"] == []
    (warned,) = shop.call("PUT", average, empirical_value=0.2, reason="CMM")["warnings"]
    assert (warned["code"], warned["field"]) == ("empirical_value_step", "empirical_value")
    assert "every size reads −197.4\u00a0µm from before, more than a tolerance of ± 0.0080\u00a0mm" in warned["text"]
    assert shop.call("PUT", average, empirical_value=0.204, reason="CMM")["warnings"] == []
    assert (
        shop.call("PUT", average, empirical_value=2.6, reason="CMM")["warnings"][0]["code"] == "empirical_value_large"
    )


@pytest.mark.parametrize("mode", ["automatic", "approval"])
def test_another_empirical_value_supersedes_what_was_computed_with_the_old_one(shop: Shop, mode: str) -> None:
    """A probe that reads 50 µm too much has asked for a correction that would now spoil the next part."""
    other, shared = (shop.another("bore", mode=mode, tool_memory=tool, average_memory=tool) for tool in (4, 5))
    numbers = [shop.read(50.0, key)["correction"]["number"] for key in (shop.characteristic, shared, other)]
    shop.call("PUT", f"/machines/{shop.machine}/averages/5", empirical_value=0.0, reason="as before")
    assert {shop.correction(number)["status"] for number in numbers} <= {"pending", "awaiting_approval"}
    shop.call("PUT", f"/machines/{shop.machine}/averages/5", empirical_value=0.05, reason="ring")
    fates = [shop.correction(number)["status"] for number in numbers]
    assert fates == ["superseded", "superseded", "pending" if mode == "automatic" else "awaiting_approval"]
    decided = shop.read(50.0)
    assert (decided["decided_deviation"], decided["action"], decided["outstanding"]) == (0.0, "none", [])
