"""Results of the variants, charted beside the value; touches drawn on the part; rejects counted; the hand's own mark."""

from typing import Any

import pytest
from playwright.sync_api import Page, expect
from sqlalchemy import text

from app.charts import to_plotly
from app.core.parameters import Parameters, read
from app.views.characteristic.figures import (
    HandPoint,
    ResultPoint,
    ResultRange,
    angle_of,
    residuals_of,
    result_figure,
    touches_picture,
    zone_chart,
)
from tests.pages.looks import boxes, resize
from tests.servers import Server
from tests.shop import Person, Shop

pytestmark = pytest.mark.own_server  # results without readings, by the hundred thousand

LINE = {"points": 3, "accept": {"n": 2, "m": 3}, "zero_range": 0, "weighting_factor": 1, "average_memory": 0}


def bore(**more: Any) -> Parameters:
    return read({"R32": 40.0, "R35": 0.016, "R33": 0, "R37": 0.3, "R36": 1.0} | more)[0]


def figure_of(*what: Any) -> dict[str, Any]:
    return to_plotly(result_figure(*what))


class TestFigures:
    def test_results_are_drawn_in_micrometres_and_excluded_ones_hollow(self) -> None:
        points = [ResultPoint(1, 0.004), ResultPoint(2, 0.006, excluded=True, link="/x")]
        figure = figure_of("run_out", "Run-out", points)
        (trace,) = figure["data"]
        assert (trace["x"], trace["y"]) == ([1, 2], [4.0, 6.0])
        assert trace["marker"]["symbol"] == ["circle", "circle-open"]
        assert trace["customdata"] == [None, "/x"]
        assert figure["layout"]["yaxis"]["rangemode"] == "tozero"
        assert figure_of("taper", "Taper", points)["layout"]["yaxis"]["rangemode"] == "normal"

    def test_of_very_many_every_extreme_is_drawn(self) -> None:
        blocks = [ResultRange(1, 500, 0.001, 0.02, 0.003), ResultRange(501, 1000, 0.0, 0.004, 0.002)]
        lower, upper, mean = figure_of("run_out", "Run-out", [], blocks)["data"]
        assert (lower["y"], upper["y"], mean["y"]) == ([1.0, 0.0], [20.0, 4.0], [3.0, 2.0])

    def test_without_results_the_chart_says_so(self) -> None:
        figure = figure_of("run_out", "Run-out", [])
        assert "Nothing yet" in figure["layout"]["annotations"][0]["text"]

    def test_the_hand_has_a_mark_of_its_own(self) -> None:
        hands = [HandPoint(3, 0.002, True, "ana"), HandPoint(4, 0.02, False, "ana")]
        figure = to_plotly(zone_chart([], bore(), hands=hands))
        (trace,) = [trace for trace in figure["data"] if trace.get("meta") == "by-hand"]
        assert trace["marker"]["symbol"] == ["star", "star-open"]
        assert "scrap" in trace["text"][1]

    def test_residuals_are_from_the_mean_and_along_the_part_from_the_line(self) -> None:
        assert residuals_of(bore(R25=2), [40.0, 40.003, 39.997]) == pytest.approx([0, 0.003, -0.003])
        along = residuals_of(bore(R25=3), [40.0, 40.002, 40.004, 40.002])
        assert along == pytest.approx([-0.0008, 0.0004, 0.0016, -0.0012])
        assert residuals_of(bore(variant="two_point"), [-20.0, 20.0]) == [0.0, 0.0]

    @pytest.mark.parametrize(
        ("given", "points", "degrees"),
        [
            ({"R25": 1}, 2, [0, 180]),
            ({"R25": 2}, 4, [0, 90, 180, 270]),
            ({"R25": 2, "R26": 30}, 3, [0, 30, 60]),
        ],
    )
    def test_points_lie_where_the_part_was_turned_to(
        self, given: dict[str, Any], points: int, degrees: list[float]
    ) -> None:
        assert [angle_of(bore(**given), at, points) for at in range(points)] == degrees

    @pytest.mark.parametrize("variant", ["indexed", "round", "along", "two_point", "single"])
    def test_every_variant_has_a_picture_that_says_its_points(self, variant: str) -> None:
        picture = touches_picture(bore(variant=variant), [39.998, 40.004])
        assert picture.count('class="touch"') == 2
        assert "39.9980" in picture
        assert touches_picture(bore(variant=variant), [40.0]) == ""

    def test_equal_points_have_no_residuals_to_enlarge(self) -> None:
        assert 'class="touch"' in touches_picture(bore(R25=2), [40.0, 40.0])


def touched(shop: Shop, name: str, *values: float) -> Any:
    return shop.call("POST", "/readings", 201, characteristic=name, touches=[[value] for value in values])


class TestApi:
    def test_the_figure_is_of_the_variants_own_result(self, shop: Shop) -> None:
        name = f"{shop.characteristic}-r"
        shop.add(name, variant="round", points=2, repeats=1, average_memory=0)
        touched(shop, name, 40.0, 40.002)
        touched(shop, name, 40.0, 40.005)
        figure = shop.call("GET", f"/characteristics/{name}/figures/results")
        assert figure["data"][0]["y"] == [2.0, 5.0]
        assert figure["layout"]["yaxis"]["title"]["text"] == "Out-of-roundness, µm"
        empty = shop.call("GET", f"/characteristics/{name}/figures/results?result=taper")
        assert "Nothing yet" in empty["layout"]["annotations"][0]["text"]
        shop.call("GET", f"/characteristics/{name}/figures/results?result=colour", 422)

    def test_of_hundreds_of_thousands_the_extremes_are_drawn(self, shop: Shop, server: Server) -> None:
        name = f"{shop.characteristic}-r"
        shop.add(name, variant="round", points=2, average_memory=0)
        touched(shop, name, 40.0, 40.001)
        with server.database.begin() as session:
            where = session.execute(
                text("SELECT machine_id, id FROM characteristic WHERE key = :key"), {"key": name}
            ).one()
            session.execute(
                text(
                    "INSERT INTO reading_results (machine_id, characteristic_id, sequence, out_of_roundness) "
                    "SELECT :machine, :characteristic, n, CASE n WHEN 123456 THEN 0.5 ELSE 0.002 END "
                    "FROM generate_series(2, 300000) n"
                ),
                {"machine": where[0], "characteristic": where[1]},
            )
            session.execute(text("UPDATE stream SET sequence = 300000 WHERE characteristic_id = :id"), {"id": where[1]})
        figure = shop.call("GET", f"/characteristics/{name}/figures/results?last=all")
        lower, upper, _mean = figure["data"]
        assert len(upper["y"]) <= 1_001
        assert (min(lower["y"]), max(upper["y"])) == (1.0, 500.0)

    def test_rejects_are_counted_in_all_and_since_the_tool_change(self, shop: Shop) -> None:
        name = f"{shop.characteristic}-l"
        shop.add(name, **LINE)
        touched(shop, name, 40.02, 40.02, 40.0)
        touched(shop, name, 40.02, 40.0, 40.0)
        shop.call("POST", f"/machines/{shop.machine}/tools/3/change", offset=0.0, reason="worn")
        touched(shop, name, 40.02, 40.02, 40.02)
        counted = shop.call("GET", f"/characteristics/{name}/statistics")
        assert (counted["rejected"], counted["sections_outside"]) == (2, 6)
        assert (counted["rejected_since_tool_change"], counted["sections_outside_since_tool_change"]) == (1, 3)
        shop.call("POST", f"/readings/{name}/3/exclude", reason="chip")
        counted = shop.call("GET", f"/characteristics/{name}/statistics")
        assert (counted["rejected"], counted["rejected_since_tool_change"]) == (1, 0)
        plain = shop.call("GET", f"/characteristics/{shop.characteristic}/statistics")
        assert plain["rejected"] is None

    def test_rejected_parts_correct_where_the_setting_allows_it(self, shop: Shop) -> None:
        """D = mean of 40.03, 40.03, 40.0 less 40.0 = 20 µm."""
        name = f"{shop.characteristic}-l"
        shop.add(name, **LINE, rejected_may_correct=True)
        answer = touched(shop, name, 40.03, 40.03, 40.0)
        assert (answer["results"]["rejected"], answer["correction"]["amount"]) == (True, -0.02)
        assert {alarm["kind"] for alarm in answer["alarms"]} == {"acceptance", "oversize"}


class TestPages:
    def test_the_page_of_a_characteristic_charts_results_and_counts_rejects(self, shop: Shop, server: Server) -> None:
        name = f"{shop.characteristic}-l"
        shop.add(name, **LINE | {"variant": "along", "index": -8})
        touched(shop, name, 40.02, 40.02, 40.0)
        viewer = Person(server, "viewer")
        page = viewer.open(f"/characteristics/{name}")
        assert "Taper over the length" in page
        assert "Parts rejected" in page
        assert "starts at" in page
        assert "1 rejected by this tool" in viewer.open(f"/plant/{shop.machine}")
        assert "Parts rejected" not in viewer.open(f"/characteristics/{shop.characteristic}")

    def test_results_to_choose_from_take_one_line_of_a_phone(self, shop: Shop, server: Server, page: Page) -> None:
        name = f"{shop.characteristic}-r"
        shop.add(name, variant="round", points=2, repeats=2, average_memory=0)
        shop.call("POST", "/readings", 201, characteristic=name, touches=[[40.0, 40.001], [40.002, 40.002]])
        Person(server, "viewer").sign_in(page)
        resize(page, "phone")
        page.goto(f"/characteristics/{name}")
        expect(page.get_by_role("heading", name="Out-of-roundness")).to_be_visible()
        tops = {box["top"] for box in boxes(page, "#results .choice a")}
        assert (len(boxes(page, "#results .choice a")), len(tops)) == (3, 1)

    def test_a_reading_shows_every_touch_and_where_it_lies(self, shop: Shop, server: Server) -> None:
        name = f"{shop.characteristic}-i"
        shop.add(name, variant="indexed", index=180, repeats=2, average_memory=0)
        shop.call("POST", "/readings", 201, characteristic=name, touches=[[40.004, 40.006], [39.998, 40.0]])
        page = Person(server, "viewer").open(f"/characteristics/{name}/readings/1")
        assert "180°" in page
        assert "touches-picture" in page
        assert "Run-out" in page
        assert "−1.00 µm" in page, "a touch from the mean of its point"

    def test_an_operator_enters_what_was_measured_by_hand(self, shop: Shop, server: Server, page: Page) -> None:
        shop.read(10.0)
        operator = Person(server, "operator")
        operator.sign_in(page)
        page.goto(f"/characteristics/{shop.characteristic}/readings/1")
        page.get_by_role("button", name="Enter a measurement").click()
        dialog = page.get_by_role("dialog", name="Measured by hand")
        dialog.get_by_label("Size").fill("40,0021")
        good = dialog.locator(".chip", has_text="good")
        assert min(box["height"] for box in boxes(page, "dialog .chip")) >= 48
        good.click()
        dialog.get_by_role("button", name="Save").click()
        page.get_by_text("40.0021").first.wait_for()
        (kept,) = shop.call("GET", f"/readings/{shop.characteristic}/1")["by_hand"]
        assert (kept["measured"], kept["verdict"], kept["by"]) == (40.0021, "good", operator.name)
        page.locator("plotly-chart .plot .legendtext", has_text="Measured by hand").first.wait_for()

    def test_what_cannot_be_meant_is_reported_in_the_dialog(self, shop: Shop, server: Server) -> None:
        shop.read(10.0)
        path = f"/characteristics/{shop.characteristic}/readings/1/by-hand"
        page = Person(server, "operator").send(path, 422, measured="4000", comment="")
        assert "lies more than 10 mm from the target" in page
        assert 'value="4000"' in page
