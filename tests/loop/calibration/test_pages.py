"""The pages of calibration: by links and posts, and in Chromium."""

import re
from html import unescape
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.loop.calibration.test_calibrations import RING, calibrate, ring
from tests.pages.looks import boxes
from tests.shop import Person, Shop

GAUGE: dict[str, Any] = {
    "do": "",
    "gauge_size": "199,852",
    "touches": "199,870 199,874\n199.872",
    "zero_range": "0,001",
    "averaging_limit": "0.01",
    "confidence_limit": "1",
    "weighting_factor": "2",
    "path_factor": "1",
    "surface": "free",
    "probe_type": "",
    "axis": "X",
    "direction": "",
    "tool_memory": "",
}


def place(shop: Shop) -> str:
    return f"/calibration/{shop.machine}/averages/5"


def probe(shop: Shop) -> str:
    return f"/calibration/{shop.machine}/probes/32"


def _cells(page: str) -> dict[str, list[str]]:
    """The rows of the tables of a page by their first cell."""
    rows = [
        [
            unescape(re.sub(r"<[^>]*>", "", cell)).strip().replace("\u00a0", " ")
            for cell in re.findall(r"<td.*?</td>", row, re.DOTALL)
        ]
        for row in re.findall(r"<tr.*?</tr>", page, re.DOTALL)
    ]
    return {cells[0]: cells[1:] for cells in rows if cells}


class TestWithoutScripts:
    def test_pairs_that_are_all_equal_leave_a_way_by_hand_with_a_reason(self, shop: Shop, operator: Person) -> None:
        for number in range(5):
            shop.call(
                "POST",
                f"/machines/{shop.machine}/averages/5/pairs",
                201,
                machine_value=40.002 + number,
                external_value=40.0 + number,
                instrument="CMM",
            )
        shown = operator.open(place(shop))
        assert f"{place(shop)}/suggestion/0" not in shown
        assert "sets the empirical value by hand, with the reason" in shown
        address = f"/machines/{shop.machine}/averages/5/edit"
        assert f'href="{address}"' in shown
        operator.open(address)
        operator.send(address, 422, empirical_value="0,002", reason="")
        operator.send(address, 200, empirical_value="0,002", reason="The certificate of the master says so")
        average = shop.call("GET", f"/machines/{shop.machine}/averages/5")
        assert average["empirical_value"] == 0.002

    def test_every_place_with_its_state(self, shop: Shop, operator: Person) -> None:
        shop.add(f"{shop.characteristic}-b", average_memory=6)
        calibrate(shop)
        ring(shop, sections=[], first_move_triggered=True)
        shown = (
            operator.open(f"/calibration?machine={shop.machine}")
            .partition(f'id="machine-{shop.machine}"')[2]
            .partition("</section>")[0]
        )
        states = [state for state in ("proposed", "never", "refused") if f'data-state="{state}"' in shown]
        assert states == ["proposed", "never", "refused"]
        assert place(shop) in shown
        assert probe(shop) in shown

    def test_of_many_machines_a_page_shows_some(self, shop: Shop, operator: Person) -> None:
        for number in range(27):
            shop.call("POST", "/machines", 201, key=f"{shop.machine}-{number:02}", name="One of many", control="other")
        first = operator.open("/calibration")  # of all machines of this server
        assert first.count('id="machine-') - first.count('id="machine-picker"') == 25
        assert 'href="/calibration?after=25"' in first
        second = operator.open("/calibration?after=25")
        assert 'href="/calibration" rel="prev"' in second
        assert operator.open(f"/calibration?machine={shop.machine}-26").count(f'id="machine-{shop.machine}') == 1
        assert "There is no machine" in operator.open("/calibration?machine=nowhere", 404)

    def test_a_form_that_says_what_nobody_knows_is_a_calibration(self, shop: Shop, operator: Person) -> None:
        """A stored calibration is never answered by an error."""
        assert "Calibration 1 is stored" in operator.send(place(shop), **GAUGE | {"do": "x" * 5000})

    def test_a_calibration_is_typed_in_and_accepted(self, shop: Shop, operator: Person) -> None:
        assert "Not calibrated yet" in operator.open(place(shop))
        text = operator.send(place(shop), **GAUGE)
        assert "Calibration 1 is stored" in text
        assert "the empirical value becomes +20.0" in text
        assert 'value="199.852"' in text  # for the next time
        asked = operator.open(f"{place(shop)}/accept/1")
        assert 'id="confirm"' in asked
        assert "from +0.0" in asked
        text = operator.send(f"{place(shop)}/accept/1", reason="Stylus replaced", more="ruby 2 mm")
        assert "Calibration 1 is accepted" in text
        assert "Stylus replaced: ruby 2 mm" in text
        made = shop.call("GET", f"/machines/{shop.machine}/calibrations/1")
        assert (made["by"], made["accepted"]["reason"]) == (operator.name, "Stylus replaced: ruby 2 mm")
        late = operator.send(f"{place(shop)}/accept/1", 409, reason="Seen")
        assert f"accepted by {operator.name}" in late
        operator.open(f"{place(shop)}/accept/1", 404)

    def test_what_is_wrong_is_said_and_nothing_typed_is_lost(self, shop: Shop, operator: Person) -> None:
        text = operator.send(place(shop), 422, **(GAUGE | {"averaging_limit": "0.001", "touches": "199.872"}))
        assert "R34 = 0.001 must be larger than R33 = 0.001" in text
        assert "199.872</textarea>" in text
        text = operator.send(place(shop), 422, **(GAUGE | {"touches": "x", "gauge_size": ""}))
        assert "must be a number" in text or "Must be a number" in text
        text = operator.send(place(shop), 422, **(GAUGE | {"touches": " "}))
        assert "type a size in mm for each touch" in text
        assert shop.call("GET", f"/machines/{shop.machine}/calibrations")["items"] == []

    def test_a_refused_one_stands_on_the_page_with_its_reason(self, shop: Shop, operator: Person) -> None:
        text = operator.send(place(shop), **(GAUGE | {"touches": "200.852"}))
        assert "confidence limit" in text
        assert 'data-state="refused"' in text
        assert shop.alarms() == []  # who typed it sees it

    def test_one_calibration_shows_what_l92_leaves(self, shop: Shop, operator: Person) -> None:
        """R42 to R49, each touch, the settings; what it is not about stays on its own page."""
        calibrate(shop, tool_memory=30, probe_type="radial")
        calibrate(shop, touches=[199.852, None])
        ring(shop)
        history = operator.open(place(shop))
        assert f'href="{place(shop)}/1"' in history
        shown = _cells(operator.open(f"{place(shop)}/1"))
        assert [shown[f"R{number}"] for number in (42, 43, 44, 46, 47, 49)] == [
            ["size of the gauge", "199.8520 mm"],
            ["measured, mean", "199.8720 mm"],
            ["difference", "+20.0 µm"],
            ["average memory location", "5"],
            ["location of the probe's offset", "30"],
            ["average of the difference", "+10.0 µm"],
        ]
        assert (shown["1"], shown["3"]) == (["199.8700 mm", "+18.0 µm"], ["199.8720 mm", "+20.0 µm"])
        text = operator.open(f"{place(shop)}/1")
        assert all(word in text for word in ("radial", "R36", "To be accepted", f'href="{place(shop)}/accept/1"'))
        missing = operator.open(f"{place(shop)}/2")
        assert _cells(missing)["2"] == ["no touch", "–"]
        assert "Touch 2 is missing" in missing
        ringed = _cells(operator.open(f"{probe(shop)}/3"))
        assert (ringed["1"], ringed["R44"][1]) == (["24.0130 mm", "−23.9910 mm", "30.0020 mm"], "+12.0 µm")
        for elsewhere in (f"{place(shop)}/3", f"{probe(shop)}/1", f"{place(shop)}/9", f"{place(shop)}/0"):
            operator.open(elsewhere, 404)

    def test_the_ring_is_typed_in(self, shop: Shop, operator: Person) -> None:
        sections: dict[str, Any] = {
            f"{side}_{number}": str(section[side])
            for number, section in enumerate(RING["sections"], 1)
            for side in ("plus", "minus")
        }
        fields: dict[str, Any] = {
            "nominal": "30",
            "upper_deviation": "0,01",
            "lower_deviation": "−0.01",
            "radius_term": "6",
        }
        text = operator.send(probe(shop), **fields, **sections)
        assert "+12.0" in text
        assert "is +0.0120\N{NO-BREAK SPACE}mm off the spindle axis: its X offset becomes +0.0120" in text
        operator.send(f"{probe(shop)}/accept/1", reason="Calibrated as planned")
        assert shop.tool(32)["offset"] == 0.012
        text = operator.send(probe(shop), **fields, first_move_triggered="true")
        assert "not a bore" in text
        text = operator.send(probe(shop), 422, **fields, plus_1="24.01")
        assert "Section 1, −X" in text
        text = operator.send(probe(shop), 422, **fields, **{name: sections[name] for name in ("plus_1", "minus_1")})
        assert "3 are needed" in text
        assert shop.call("GET", f"/machines/{shop.machine}/calibrations?tool_memory=32")["items"][-1]["number"] == 2

    def test_pairs_are_pasted_all_or_none_and_the_suggestion_is_accepted(self, shop: Shop, operator: Person) -> None:
        fields: dict[str, Any] = {"do": "pairs", "instrument": "CMM", "characteristic": ""}
        lines = "40.0021\t40.0\n40,0030; 40,0\n40.0024 40.0\n\n40.0028 40.0\n40.0027 40.0\n"
        text = operator.send(place(shop), 422, **fields, lines=f"{lines}40.0\n")
        assert "Line 7: two numbers are needed" in text
        assert shop.call("GET", f"/machines/{shop.machine}/averages/5/pairs")["items"] == []
        text = operator.send(place(shop), **fields, lines=lines)
        assert "5 pairs are stored" in text
        assert "+2.6" in text
        asked = operator.open(f"{place(shop)}/suggestion/0")
        assert 'name="empirical_value" value="0.002600000"' in asked
        late = operator.send(f"{place(shop)}/suggestion/0", 409, reason="Compared", empirical_value="0.0025")
        assert "another one by now" in late
        operator.send(f"{place(shop)}/suggestion/0", reason="Compared with a micrometer", empirical_value="0.002600000")
        assert shop.call("GET", f"/machines/{shop.machine}/averages/5")["empirical_value"] == 0.0026

    def test_pairs_name_readings_and_one_is_excluded(self, shop: Shop, operator: Person) -> None:
        shop.read(2.0)
        fields: dict[str, Any] = {"do": "pairs", "instrument": "CMM", "characteristic": shop.characteristic}
        text = operator.send(place(shop), **fields, lines="1 40.0005")
        assert f"/characteristics/{shop.characteristic}/readings/1" in text
        (pair,) = shop.call("GET", f"/machines/{shop.machine}/averages/5/pairs")["items"]
        assert pair["difference"] == 0.0015
        assert "40.0020" in operator.open(f"{place(shop)}/exclude/{pair['id']}")
        assert "Another part" in operator.send(f"{place(shop)}/exclude/{pair['id']}", reason="Another part")
        operator.send(place(shop), 422, **(fields | {"characteristic": "nowhere"}), lines="1 40.0")
        text = operator.send(place(shop), 422, **fields, lines="1 40.0\n99 40.0")
        assert "has no reading 99" in text
        assert len(shop.call("GET", f"/machines/{shop.machine}/averages/5/pairs")["items"]) == 1

    def test_engineers_plan(self, shop: Shop, operator: Person) -> None:
        engineer = Person(shop.server, "engineer")
        fields: dict[str, Any] = {"do": "plan", "due_parts": "500", "due_days": "7,5", "acceptance": "automatic"}
        operator.send(place(shop), 403, **fields)
        text = engineer.send(place(shop), **fields)
        assert "The plan is set" in text
        assert "in 500 parts" in text
        assert "Due_parts" not in engineer.send(place(shop), 422, **(fields | {"due_parts": "0"}))

    def test_the_reading_says_where_its_empirical_value_came_from(self, shop: Shop, operator: Person) -> None:
        calibrate(shop)
        operator.send(f"{place(shop)}/accept/1", reason="Stylus replaced")
        shop.read(20.5)
        text = operator.open(f"/characteristics/{shop.characteristic}/readings/1")
        assert ">+20.0" in text
        assert f"{operator.name}" in text
        assert "Calibration 1: Stylus replaced" in text
        assert place(shop) in text

    def test_viewers_see_it_and_change_nothing(self, shop: Shop) -> None:
        viewer = Person(shop.server, "viewer")
        calibrate(shop)
        text = viewer.open(place(shop))
        assert "Calibrate</button>" not in text
        assert "/accept/1" not in text
        viewer.send(place(shop), 403, **GAUGE)
        viewer.open(f"{place(shop)}/accept/1", 403)

    @pytest.mark.parametrize(
        "path", ["averages/21", "averages/0", "probes/33", "nothing/5", "averages/x", "averages/5/burn/1"]
    )
    def test_there_is_no_such_page(self, shop: Shop, operator: Person, path: str) -> None:
        status = operator.browser.get(f"/calibration/{shop.machine}/{path}").status_code
        assert status in {404, 422}

    def test_the_way_to_a_probe(self, shop: Shop, operator: Person) -> None:
        text = operator.open(f"/calibration/probes?machine={shop.machine}&tool=32")
        assert "R10 = 32" in text


class TestInABrowser:
    def test_a_calibration_arrives_and_is_accepted_in_the_dialog(
        self, shop: Shop, operator: Person, page: Page
    ) -> None:
        operator.sign_in(page)
        page.goto(place(shop))
        expect(page.locator("live-status")).to_have_attribute("state", "live")
        expect(page.locator("#now")).to_contain_text("Never calibrated")
        calibrate(shop, client=shop.machine_client)
        expect(page.locator("#now")).to_contain_text("To be accepted")
        page.locator("#now").get_by_role("link", name="Accept").click()
        dialog = page.get_by_role("dialog")
        dialog.get_by_role("radio", name="Stylus replaced").check()
        dialog.get_by_role("button", name="Accept").click()
        expect(page.locator("main")).to_contain_text("Calibration 1 is accepted")
        expect(page.locator("#now")).to_contain_text("+20.0")
        expect(page.locator("plotly-chart .main-svg").first).to_be_visible()
        expect(page.locator("#history")).to_contain_text("Stylus replaced")

    @pytest.mark.long
    def test_pairs_are_pasted_and_accepted(self, shop: Shop, operator: Person, page: Page) -> None:
        operator.sign_in(page)
        page.goto(place(shop))
        page.get_by_role("textbox", name="External gauge").fill("Measuring machine")
        page.get_by_label("Pairs, one a line").fill("\n".join(f"40.00{25 + n} 40.0" for n in range(5)))
        page.get_by_role("button", name="Add pairs").click()
        expect(page.locator("#suggestion")).to_contain_text("+2.7")
        page.get_by_role("link", name="Accept +2.7").click()
        dialog = page.get_by_role("dialog")
        dialog.get_by_role("radio", name="Compared with the CMM").check()
        dialog.get_by_role("button", name="Accept").click()
        expect(page.locator("main")).to_contain_text("The empirical value is accepted")
        expect(page.locator("#now")).to_contain_text("+2.7")

    def test_everything_to_press_is_large_enough_on_a_narrow_panel(
        self, shop: Shop, operator: Person, page: Page
    ) -> None:
        calibrate(shop)
        operator.sign_in(page)
        page.set_viewport_size({"width": 800, "height": 1280})
        for path in ("/calibration", place(shop), probe(shop)):
            page.goto(path)
            assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
            targets = "main .button, main .row-name, .nav a"
            assert min(box["height"] for box in boxes(page, targets)) >= 48
