"""Work zeros in a real browser: with gloves on at the panel, mixed up, pasted, a vice that shifts, computed again."""

import re
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.pages.looks import boxes, live
from tests.shop import Person, Shop


def type_pocket(page: Page, shop: Shop, shift: float = 0.0) -> None:
    page.get_by_label("Machine").select_option(shop.machine)
    page.get_by_label("Tip diameter").fill("6")
    for number, axis, place in ((1, "X", -353.012), (2, "X", -259.008), (3, "Y", -181.254), (4, "Y", -127.246)):
        field = page.get_by_role("group", name=f"Point {number}").get_by_label(axis, exact=True)
        field.fill(f"{place + (shift if axis == 'X' else 0):.3f}")


class TestAtThePanel:
    def test_a_pocket_typed_with_gloves_on_becomes_a_text(self, shop: Shop, operator: Person, page: Page) -> None:
        page.set_viewport_size({"width": 800, "height": 1280})
        operator.sign_in(page)
        page.goto("/")
        page.get_by_role("navigation", name="Main").get_by_role("link", name="Machines").click()
        page.get_by_role("navigation", name="Of all machines").get_by_role("link", name="Work zero").click()
        page.get_by_role("link", name="Probe a part").first.click()
        page.get_by_role("navigation", name="Shape").get_by_role("link", name="Pocket").click()
        page.wait_for_url("**kind=pocket**")  # and for its scripts
        type_pocket(page, shop)
        # The keypad has no minus: the number is typed, its sign put on.
        first = page.get_by_role("group", name="Point 1")
        first.get_by_label("X", exact=True).fill("353.012")
        first.get_by_role("button", name="Other sign of X").click()
        expect(first.get_by_label("X", exact=True)).to_have_value("−353.012")
        page.get_by_label("Vice or fixture").fill("vice-left")
        page.get_by_role("textbox", name="Z at contact").fill("-201.5")
        page.get_by_role("textbox", name="Feeler gauge").fill("0,1")
        page.get_by_role("textbox", name="Tool length").fill("98.25")
        targets = "main button, main [role=button], main input, main select"
        assert min(box["height"] for box in boxes(page, targets)) >= 48
        page.get_by_role("button", name="Compute the zero and save").click()
        expect(page.get_by_role("heading", level=1)).to_contain_text("G54 Pocket")
        for value in ("−306.010", "−154.250", "−299.850", "100.004", "60.008"):
            expect(page.locator(".found")).to_contain_text(value)
        text = page.get_by_label("Text for Sinumerik")
        expect(text).to_have_value(re.compile(r"\$P_UIFR\[1\]=CTRANS\(X,-306\.01,Y,-154\.25,Z,-299\.85\)"))
        page.locator("summary", has_text="Fanuc").click()
        expect(page.get_by_label("Text for Fanuc")).to_have_value(
            re.compile(r"G90 G10 L2 P1 X-306\.01 Y-154\.25 Z-299\.85")
        )
        expect(page.locator("svg.touch-picture .tip")).to_have_count(4)
        assert page.evaluate("document.documentElement.scrollWidth") <= 800

        # The same part once more: only the touches are typed again.
        page.get_by_role("link", name="Probe again").click()
        expect(page.get_by_label("Tip diameter")).to_have_value("6")
        expect(page.get_by_label("Vice or fixture")).to_have_value("vice-left")
        expect(page.get_by_role("group", name="Point 1").get_by_label("X", exact=True)).to_have_value("")

    def test_touches_mixed_up_are_named_and_nothing_is_lost(
        self, shop: Shop, operator: Person, page: Page, complaints: list[str]
    ) -> None:
        operator.sign_in(page)
        page.goto("/work-zeros/new?kind=pocket")
        type_pocket(page, shop)
        for number, place in ((1, "-259.008"), (2, "-353.012")):
            page.get_by_role("group", name=f"Point {number}").get_by_label("X", exact=True).fill(place)
        page.get_by_role("button", name="Compute the zero and save").click()
        expect(page.get_by_role("alert").first).to_contain_text("Nothing was stored")
        complaints.clear()  # the browser's own words for the 422
        for number, place in ((1, "-259.008"), (2, "-353.012")):
            group = page.get_by_role("group", name=f"Point {number}")
            expect(group).to_contain_text("wrong side")
            expect(group.get_by_label("X", exact=True)).to_have_value(place)
        expect(page.get_by_role("group", name="Point 3")).not_to_contain_text("wrong side")
        expect(page.get_by_label("Tip diameter")).to_have_value("6")
        assert shop.call("GET", f"/work-zeros?machine={shop.machine}")["items"] == []

    def test_what_is_no_number_is_said_at_its_touch(
        self, shop: Shop, operator: Person, page: Page, complaints: list[str]
    ) -> None:
        operator.sign_in(page)
        page.goto("/work-zeros/new?kind=pocket")
        type_pocket(page, shop)
        page.get_by_role("group", name="Point 3").get_by_label("Y", exact=True).fill("-181.2.54")
        page.get_by_label("Vice or fixture").fill("Šrafštok <1>")
        page.get_by_role("button", name="Compute the zero and save").click()
        expect(page.get_by_role("group", name="Point 3")).to_contain_text("Y:")
        complaints.clear()  # the browser's own words for the 422
        expect(page.locator("#f-fixture-error")).to_be_visible()
        expect(page.get_by_label("Vice or fixture")).to_have_value("Šrafštok <1>")

    def test_sent_twice_it_is_one_zero(self, shop: Shop, operator: Person) -> None:
        operator.open("/work-zeros/new")
        sent: dict[str, Any] = {
            "machine": shop.machine,
            "kind": "bore",
            "tip": "6",
            "work_offset": "G55",
            "key": "page-once",
        }
        for _ in range(2):
            told = operator.send("/work-zeros/new", lines="R1=12 R2=60 R3=7 R4=43", **sent)
            assert "66.000" in told
        assert len(shop.call("GET", f"/work-zeros?machine={shop.machine}")["items"]) == 1
        told = operator.send("/work-zeros/new", 409, lines="R1=12 R2=60 R3=7 R4=44", **sent)
        assert "was sent with the key" in told


class TestAVice:
    def test_that_shifts_is_seen_and_raises_an_alarm(
        self, shop: Shop, engineer: Person, page: Page, complaints: list[str]
    ) -> None:
        engineer.sign_in(page)
        for shift in (0.0, 0.012):
            page.goto("/work-zeros/new?kind=pocket&fixture=vice")
            type_pocket(page, shop, shift)
            page.get_by_role("button", name="Compute the zero and save").click()
            expect(page.get_by_role("heading", level=1)).to_contain_text("G54")
        page.get_by_role("link", name="History of vice").click()
        expect(page.locator("plotly-chart .main-svg").first).to_be_visible()
        expect(page.locator(".found")).to_contain_text("No limit is set")
        page.get_by_label("Warning beyond").fill("10")
        page.get_by_label("Alarm beyond").fill("5")
        page.get_by_label("Reason").fill("the vice creeps")
        page.get_by_role("button", name="Save monitoring").click()
        expect(page.get_by_role("alert")).to_contain_text("Nothing was changed")
        complaints.clear()  # the browser's own words for the 422
        page.get_by_label("Alarm beyond").fill("30")
        page.get_by_role("button", name="Save monitoring").click()
        expect(page.locator(".found")).to_contain_text("Shifted")
        expect(page.locator(".found")).to_contain_text("+12.0")
        assert shop.alarms() == []

        # Another zero comes from the machine while the page is open: it is told by itself.
        live(page)
        touches = [{"x": -352.962, "approach": "-X"}, {"x": -258.958, "approach": "+X"}]
        shop.call(
            "POST", "/work-zeros", 201, shop.machine_client,
            machine=shop.machine, kind="pocket", tip=6.0, fixture="vice", touches=touches,
        )  # fmt: skip
        expect(page.locator(".found")).to_contain_text("Shifted too far")
        expect(page.locator("#history tbody tr")).to_have_count(3)
        (alarm,) = shop.alarms()
        assert alarm["kind"] == "fixture_shifted"
        page.goto(f"/alarms?machine={shop.machine}")
        expect(page.locator("main")).to_contain_text("Fixture vice has shifted by X +50.0 µm")
        page.get_by_role("link", name="history of vice").first.click()
        expect(page.get_by_role("heading", level=1)).to_contain_text("vice")
        page.goto(f"/work-zeros?machine={shop.machine}")
        expect(page.get_by_role("row").filter(has_text="Shifted too far")).to_contain_text("+50.0")

    def test_its_zeros_become_readings(self, shop: Shop, operator: Person) -> None:
        vice = f"{shop.characteristic}-x"
        shop.add(vice, target=-306.01, tool_memory=0, average_memory=0, mode="measure_only")
        sent: dict[str, Any] = {
            "machine": shop.machine,
            "kind": "pocket",
            "tip": "6",
            "work_offset": "G54",
            "as_x": vice,
        }
        told = operator.send("/work-zeros/new", lines="-X -353.012\n+X -259.008", **sent)
        assert f"/characteristics/{vice}/readings/1" in told
        told = operator.send("/work-zeros/new", 422, lines="-X -353.012\n+X -259.008", **(sent | {"as_x": "nowhere"}))
        assert "no characteristic" in told


class TestAgain:
    @pytest.mark.long
    def test_with_another_tip(self, shop: Shop, operator: Person, page: Page, complaints: list[str]) -> None:
        operator.sign_in(page)
        page.goto("/work-zeros/new?kind=pocket")
        type_pocket(page, shop)
        page.get_by_role("button", name="Compute the zero and save").click()
        page.get_by_text("Compute again").first.click()
        page.get_by_label("Points to leave out").fill("9")
        page.get_by_label("Reason").fill("the tip was calibrated since")
        page.get_by_role("button", name="Compute again").click()
        expect(page.locator("main")).to_contain_text("There is no point 9")
        complaints.clear()  # the browser's own words for the 422
        page.get_by_label("Points to leave out").fill("")
        page.get_by_label("Tip diameter").fill("5.998")
        page.get_by_role("button", name="Compute again").click()
        expect(page.locator(".found")).to_contain_text("100.002")
        page.get_by_role("link", name=re.compile("work zero \\d+")).click()
        expect(page.get_by_role("link", name=re.compile("which replaces it"))).to_be_visible()

    def test_a_viewer_only_looks(self, shop: Shop, operator: Person, viewer: Person) -> None:
        operator.send(
            "/work-zeros/new", machine=shop.machine, kind="pocket", tip="6", work_offset="G54", lines="-X -353\n+X -259"
        )
        (made,) = shop.call("GET", f"/work-zeros?machine={shop.machine}")["items"]
        for address in ("/work-zeros", f"/work-zeros/{made['id']}"):
            assert "Probe a" not in viewer.open(address)
            assert "Compute again" not in viewer.open(address)
        viewer.open("/work-zeros/new", 403)
        viewer.send(f"/work-zeros/{made['id']}/recompute", 403, reason="x")
        for missing in (
            "/work-zeros/999999999",
            "/work-zeros/fixtures/nowhere/vice",
            f"/work-zeros/fixtures/{shop.machine}/x",
        ):
            viewer.open(missing, 404)
