"""Tool memory in the browser: what waits, what is done to it, by links and posts and in Chromium."""

import re
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.pages.looks import boxes
from tests.shop import Person, Shop


def page_of(shop: Shop) -> str:
    return f"/machines/{shop.machine}/tools"


class TestWithoutScripts:
    def test_what_waits_and_both_tables(self, shop: Shop, operator: Person) -> None:
        number = shop.read(20.0)["correction"]["number"]
        text = operator.open(page_of(shop))
        assert f'id="correction-{number}"' in text
        assert f"/machines/{shop.machine}/corrections/{number}?do=applied" in text
        for table, locations in (("all-tools", 32), ("all-averages", 20)):
            shown = text.partition(f'id="{table}"')[2].partition("</ol>")[0]
            assert [int(number) for number in re.findall(r'class="place">(\d+)<', shown)] == list(
                range(1, locations + 1)
            )

    @pytest.mark.parametrize(
        ("verb", "fields", "status"),
        [
            ("applied", {}, "applied"),
            ("applied", {"offset_after": "−0,02"}, "applied"),
            ("rejected", {"reason": "False reading", "more": "seen by hand"}, "rejected"),
        ],
    )
    def test_deciding(self, shop: Shop, operator: Person, verb: str, fields: dict[str, Any], status: str) -> None:
        number = shop.read(20.0)["correction"]["number"]
        path = f"/machines/{shop.machine}/corrections/{number}"
        assert 'id="confirm"' in operator.open(f"{path}?do={verb}")
        text = operator.send(path, do=verb, **fields)
        assert f"Correction {number} is {status}" in text
        after = shop.correction(number)
        assert (after["status"], after["applied_by" if verb == "applied" else "decided_by"]) == (status, operator.name)
        if verb == "rejected":
            assert after["status_reason"] == "False reading: seen by hand"
        else:
            assert shop.alarms()[0]["kind"] == "oversize"
            assert len(shop.alarms()) == 1

    def test_approve_and_release(self, shop: Shop, operator: Person) -> None:
        shop.add(f"{shop.characteristic}-a", mode="approval", tool_memory=4, average_memory=6)
        awaiting = shop.read(6.0, f"{shop.characteristic}-a")["correction"]["number"]
        held = shop.read(350.0)["correction"]["number"]
        for number, verb in ((awaiting, "approve"), (held, "release")):
            operator.send(f"/machines/{shop.machine}/corrections/{number}", do=verb, reason="looked at")
            assert shop.correction(number)["status"] == "pending"

    def test_who_comes_too_late_learns_how_it_stands(self, shop: Shop, operator: Person) -> None:
        number = shop.read(20.0)["correction"]["number"]
        shop.correction(number, "rejected", reason="limit of the control")
        text = operator.send(f"/machines/{shop.machine}/corrections/{number}", do="applied")
        assert "Nothing was done" in text
        assert "limit of the control" in text

    def test_sent_twice_looks_the_same(self, shop: Shop, operator: Person) -> None:
        number = shop.read(20.0)["correction"]["number"]
        path = f"/machines/{shop.machine}/corrections/{number}"
        for _turn in range(2):
            assert "is rejected" in operator.send(path, do="rejected", reason="x")

    def test_a_reason_is_needed(self, shop: Shop, operator: Person) -> None:
        number = shop.read(20.0)["correction"]["number"]
        text = operator.send(f"/machines/{shop.machine}/corrections/{number}", 422, do="rejected")
        assert "Pick a reason, or write one." in text
        assert shop.correction(number)["status"] == "pending"

    def test_something_else_is_refused(self, shop: Shop, operator: Person) -> None:
        number = shop.read(20.0)["correction"]["number"]
        operator.send(f"/machines/{shop.machine}/corrections/{number}", 404, do="burn", reason="x")
        operator.open(f"{page_of(shop)}/3/burn", 404)
        operator.open(f"{page_of(shop)}/33/edit", 404)
        operator.open(f"/machines/{shop.machine}/averages/0/edit", 404)

    def test_set_the_offset_and_change_the_tool(self, shop: Shop, operator: Person) -> None:
        number = shop.read(20.0)["correction"]["number"]
        assert f"Correction {number} was computed" in operator.open(f"{page_of(shop)}/3/edit")
        text = operator.send(f"{page_of(shop)}/3/edit", offset="0,25", reason="Set at the control")
        assert "Set at the control" in text
        assert shop.tool()["offset"] == 0.25
        assert shop.correction(number)["status"] == "superseded"
        operator.send(f"{page_of(shop)}/3/edit", 422, offset="", reason="x")
        text = operator.send(f"{page_of(shop)}/3/change", reason="New insert")
        assert "starts a new life" in text
        assert "after 1 part" in text
        assert shop.tool()["offset"] == 0.0

    def test_set_an_empirical_value(self, shop: Shop, operator: Person) -> None:
        path = f"/machines/{shop.machine}/averages/5/edit"
        assert "0.0000" in operator.open(path)
        operator.send(path, empirical_value="0.002", reason="Compared with a gauge")
        assert shop.call("GET", f"/machines/{shop.machine}/averages/5")["empirical_value"] == 0.002

    def test_viewers_see_no_buttons_and_may_not_post(self, shop: Shop, server: Any) -> None:
        number = shop.read(20.0)["correction"]["number"]
        viewer = Person(server, "viewer")
        assert "data-confirm" not in viewer.open(page_of(shop))
        viewer.open(f"/machines/{shop.machine}/corrections/{number}?do=applied")
        viewer.open(f"{page_of(shop)}/3/edit", 403)
        viewer.send(f"/machines/{shop.machine}/corrections/{number}", 403, do="applied")
        viewer.send(f"{page_of(shop)}/3/change", 403, reason="x")
        assert shop.correction(number)["status"] == "pending"

    def test_history_pages(self, shop: Shop, operator: Person) -> None:
        for at in range(30):
            shop.call("PUT", f"/machines/{shop.machine}/tools/9", offset=at / 1000, reason=f"step {at}")
        text = operator.open(f"{page_of(shop)}?tool=9")
        assert "step 29" in text
        assert "step 15" not in text
        older = re.search(r'href="([^"]*before=[^"]+)"', text)
        assert older is not None
        rest = operator.open(older[1].replace("&amp;", "&"))
        assert "step 15" in rest
        assert "step 29" not in rest

    def test_the_choice_of_machine(self, shop: Shop, operator: Person, server: Any) -> None:
        other = Shop(server)
        text = operator.open(page_of(shop))
        assert f"/machines/{shop.machine}/tools" in text
        assert f"/machines/{other.machine}/tools" in text
        operator.open("/machines/nowhere/tools", 404)
        operator.open(f"{page_of(shop)}?tool=1000", 422)


@pytest.mark.browser
class TestInABrowser:
    def test_a_correction_appears_and_is_marked_applied(self, shop: Shop, operator: Person, page: Page) -> None:
        operator.sign_in(page)
        page.goto(page_of(shop))
        expect(page.locator("#queue")).to_contain_text("No correction waits")
        expect(page.locator("live-status")).to_have_attribute("state", "live")
        number = shop.read(20.0)["correction"]["number"]
        waiting = page.locator(f"#correction-{number}")
        expect(waiting).to_contain_text("−20.0")
        waiting.get_by_role("link", name="Mark applied").click()
        page.get_by_role("dialog").get_by_role("button", name="Mark applied").click()
        expect(page.locator("main")).to_contain_text(f"Correction {number} is applied")
        expect(page.locator("#tool-now")).to_contain_text("−0.0200")
        expect(page.locator("#steps")).to_contain_text(operator.name)
        expect(page.locator("plotly-chart .main-svg").first).to_be_visible()

    @pytest.mark.long
    def test_the_tool_shown_stays_when_another_matters_more(self, shop: Shop, operator: Person, page: Page) -> None:
        """Its number, its offset and its buttons belong together, whatever is corrected meanwhile."""
        other = f"{shop.characteristic}-2"
        shop.add(other, tool_memory=2, average_memory=6)
        shop.correction(shop.read(20.0, other)["correction"]["number"], "applied")
        operator.sign_in(page)
        page.goto(page_of(shop))
        expect(page.locator("#tool h2")).to_have_text("Tool 2")
        expect(page.locator("live-status")).to_have_attribute("state", "live")
        shop.read(20.0)  # a correction of tool 3 waits: without a word about the tool, it would be shown first
        expect(page.locator("#queue")).to_contain_text("to tool 3")
        shop.correction(shop.read(-30.0, other)["correction"]["number"], "applied")
        expect(page.locator("#tool-now")).to_contain_text("+0.0100")
        expect(page.locator("#tool-now")).to_contain_text("R10 = 2")
        expect(page.locator("#tool h2")).to_have_text("Tool 2")

    def test_a_tool_change_in_the_dialog(self, shop: Shop, operator: Person, page: Page) -> None:
        operator.sign_in(page)
        page.goto(f"{page_of(shop)}?tool=3")
        page.get_by_role("link", name="Tool changed").click()
        dialog = page.get_by_role("dialog")
        dialog.get_by_role("radio", name="New tool").check()
        dialog.get_by_label("Offset of the new tool").fill("0.125")
        dialog.get_by_role("button", name="Tool changed").click()
        expect(page.locator("#steps")).to_contain_text("New tool")
        assert shop.tool()["offset"] == 0.125

    def test_nothing_sticks_out_of_a_narrow_panel(self, shop: Shop, operator: Person, page: Page) -> None:
        shop.read(20.0)
        operator.sign_in(page)
        page.set_viewport_size({"width": 800, "height": 1280})
        page.goto(page_of(shop))
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        targets = ".waiting-verbs a, .tool-card .button, .tabs a, .cells a"
        assert min(box["height"] for box in boxes(page, targets)) >= 48
