"""The operator's board: as plain links and posts, and in a real browser with two touches."""

import re
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.pages.looks import boxes
from tests.shop import Person, Shop


def kinds(text: str) -> list[str]:
    return re.findall(r'class="alarm-kind"[^>]*><a[^>]*>([^<]+)<', text)


class TestWithoutScripts:
    def test_the_most_urgent_is_first_and_says_what_is_wrong(self, shop: Shop, operator: Person) -> None:
        shop.read(20.0)
        shop.read(350.0)
        text = operator.open(f"/alarms?machine={shop.machine}")
        assert kinds(text) == ["Tool worn", "Oversize"]
        assert "deviation +20.0" in text
        assert "tool 3 is worn" in text
        assert '−330<span class="unit">µm' in text  # the held correction: 20 µm are on their way already

    def test_its_readings_from_the_first_to_the_last(self, shop: Shop, operator: Person) -> None:
        """A link is as wide as a finger: digits alone would leave a blank before what follows."""
        shop.read(20.0)
        shop.read(20.0)
        (alarm,) = shop.alarms()
        said = re.sub(r"\s+", " ", re.sub("<[^>]*>", "", operator.open(f"/alarms/{alarm['id']}")))
        assert f"Seat {shop.characteristic}, from 1 to 2 Deviation" in said

    def test_two_steps_from_alarm_to_what_followed(self, shop: Shop, operator: Person) -> None:
        number = shop.read(350.0)["correction"]["number"]
        (alarm,) = shop.alarms()
        question = operator.open(f"/alarms/{alarm['id']}?action=keep_cutting")
        assert f"Correction {number} of −350\N{NO-BREAK SPACE}µm" in question
        assert "is released" in question
        done = operator.send(
            f"/alarms/{alarm['id']}/acknowledge", action="keep_cutting", comment="Edge looked at", more="by Ana"
        )
        assert f"Correction {number} of −350\N{NO-BREAK SPACE}µm" in done
        assert operator.name in done
        after = shop.call("GET", f"/alarms/{alarm['id']}")
        assert (after["comment"], after["acknowledged_by"]) == ("Edge looked at: by Ana", operator.name)
        assert shop.correction(number)["status"] == "pending"

    def test_a_typed_offset_may_have_a_comma(self, shop: Shop, operator: Person) -> None:
        shop.read(350.0)
        path = f"/alarms/{shop.alarms()[0]['id']}/acknowledge"
        refused = operator.send(path, 422, action="tool_replaced", comment="New insert", offset="5 mm")
        assert "Must be a number" in refused
        assert 'value="5 mm"' in refused
        operator.send(path, action="tool_replaced", comment="New insert", offset="0,05")
        assert shop.tool()["offset"] == 0.05

    def test_a_comment_is_needed(self, shop: Shop, operator: Person) -> None:
        shop.read(20.0)
        (alarm,) = shop.alarms()
        operator.send(f"/alarms/{alarm['id']}/acknowledge", 422, action="noted")
        assert shop.alarms() == [alarm]

    def test_sent_twice_is_done_once_and_looks_the_same(self, shop: Shop, operator: Person) -> None:
        shop.read(20.0)
        path = f"/alarms/{shop.alarms()[0]['id']}/acknowledge"
        first = operator.send(path, action="noted", comment="Seen")
        again = operator.send(path, action="noted", comment="Seen")
        assert "Nothing else was changed." in first
        assert "Nothing else was changed." in again
        assert "Already acknowledged by another user" not in again

    def test_who_comes_second_learns_who_was_first(self, shop: Shop, operator: Person, server: Any) -> None:
        number = shop.read(350.0)["correction"]["number"]
        path = f"/alarms/{shop.alarms()[0]['id']}/acknowledge"
        operator.send(path, action="keep_cutting", comment="Edge good")
        late = Person(server, "operator").send(path, action="tool_replaced", comment="New insert")
        assert "Already acknowledged by another user" in late
        assert operator.name in late
        assert "Edge good" in late
        assert shop.correction(number)["status"] == "pending"

    def test_viewers_see_no_buttons_and_may_not_post(self, shop: Shop, server: Any) -> None:
        shop.read(20.0)
        (alarm,) = shop.alarms()
        viewer = Person(server, "viewer")
        assert "data-confirm" not in viewer.open("/alarms")
        assert 'id="confirm"' not in viewer.open(f"/alarms/{alarm['id']}?action=noted")
        viewer.send(f"/alarms/{alarm['id']}/acknowledge", 403, action="noted", comment="x")
        assert shop.alarms() == [alarm]

    def test_a_form_without_the_token_changes_nothing(self, shop: Shop, operator: Person) -> None:
        shop.read(20.0)
        (alarm,) = shop.alarms()
        path = f"/alarms/{alarm['id']}/acknowledge"
        assert operator.browser.post(path, data={"action": "noted", "comment": "x"}).status_code == 403
        assert shop.alarms() == [alarm]

    def test_history_pages_newest_first(self, shop: Shop, operator: Person) -> None:
        for _turn in range(52):
            shop.read(20.0)
            shop.acknowledge(shop.alarms()[-1]["id"], "noted")
        text = operator.open(f"/alarms/history?machine={shop.machine}")
        older = re.search(r'href="(/alarms/history\?[^"]*before=[^"]+)"', text)
        assert older is not None
        numbers = [int(n) for n in re.findall(r'class="cell-link" href="/alarms/(\d+)"', text)]
        assert numbers == sorted(numbers, reverse=True)
        assert len(numbers) == 50
        rest = operator.open(older[1].replace("&amp;", "&"))
        assert len(re.findall(r'class="cell-link"', rest)) == 2

    def test_the_number_in_the_navigation(self, shop: Shop, operator: Person) -> None:
        before = int(re.search(r'data-count="(\d+)"', operator.open("/todo/count"))[1])  # type: ignore[index]
        shop.read(20.0)
        assert f'data-count="{before + 1}"' in operator.open("/todo/count")

    @pytest.mark.parametrize("path", ["/alarms/999999", "/alarms?machine=nowhere", "/alarms/0?action=noted"])
    def test_what_is_not_there_is_a_page_in_words(self, operator: Person, path: str) -> None:
        assert "There is no" in operator.open(path, 404)

    def test_an_action_that_makes_no_sense_asks_nothing(self, shop: Shop, operator: Person) -> None:
        shop.read(20.0)
        (alarm,) = shop.alarms()
        assert 'id="confirm"' not in operator.open(f"/alarms/{alarm['id']}?action=keep_cutting")

    def test_every_kind_of_alarm_has_its_sentence(self, shop: Shop, operator: Person) -> None:
        shop.add(f"{shop.characteristic}-l", max_total=0.01, average_memory=6, tool_memory=4)
        shop.read(20.0, f"{shop.characteristic}-l")
        shop.read(-20.0)
        shop.correction(2 - 1, "applied", offset_after=0.5)
        shop.read(1500.0)
        text = operator.open(f"/alarms?machine={shop.machine}")
        assert set(kinds(text)) == {"Oversize", "Undersize", "Offset limit", "Offset differs", "Probe fault"}
        assert "have come to their limit ±10" in text
        assert "The machine holds 0.5000" in text


@pytest.mark.browser
class TestTwoTouches:
    def test_pick_and_confirm(self, shop: Shop, operator: Person, page: Page) -> None:
        number = shop.read(350.0)["correction"]["number"]
        (alarm,) = shop.alarms()
        operator.sign_in(page)
        page.goto(f"/alarms?machine={shop.machine}")
        card = page.locator(f"#alarm-{alarm['id']}")
        card.get_by_role("link", name="Keep cutting").click()  # the first touch
        dialog = page.get_by_role("dialog")
        expect(dialog).to_contain_text("is released")
        dialog.get_by_role("button", name="Keep cutting").click()  # the second
        expect(page.locator("main")).to_contain_text(f"Correction {number} of −350\N{NO-BREAK SPACE}µm")
        expect(card).to_have_count(0)
        expect(page.locator(".acknowledged")).to_contain_text(operator.name)
        assert "done" not in page.url
        assert shop.correction(number)["status"] == "pending"

    def test_a_new_alarm_appears_by_itself(self, shop: Shop, operator: Person, page: Page) -> None:
        operator.sign_in(page)
        page.goto(f"/alarms?machine={shop.machine}")
        expect(page.locator("main")).to_contain_text("No active alarms")
        expect(page.locator("live-status")).to_have_attribute("state", "live")
        shop.read(20.0)
        expect(page.locator(".alarm-kind")).to_have_text("Oversize")
        shop.acknowledge(shop.alarms()[0]["id"], "noted")
        expect(page.locator("main")).to_contain_text("No active alarms")

    @pytest.mark.long
    def test_one_may_change_ones_mind(self, shop: Shop, operator: Person, page: Page) -> None:
        shop.read(20.0)
        operator.sign_in(page)
        page.goto(f"/alarms?machine={shop.machine}")
        for leave in ("Not now", "Close"):
            page.get_by_role("link", name="False reading").click()
            page.get_by_role("dialog").get_by_role("link", name=leave).click()
            expect(page.get_by_role("dialog")).to_have_count(0)
        page.get_by_role("link", name="False reading").click()
        expect(page.get_by_role("dialog")).to_be_visible()
        page.keyboard.press("Escape")
        expect(page.get_by_role("dialog")).to_have_count(0)
        assert len(shop.alarms()) == 1

    @pytest.mark.long
    def test_targets_are_large_enough_for_gloves(self, shop: Shop, operator: Person, page: Page) -> None:
        shop.read(350.0)
        operator.sign_in(page)
        page.set_viewport_size({"width": 800, "height": 1280})
        page.goto(f"/alarms?machine={shop.machine}")
        page.get_by_role("link", name="Tool changed").click()
        dialog = page.get_by_role("dialog")
        expect(dialog).to_be_visible()
        for targets in (
            ".alarm-actions a",
            "dialog .chip, dialog .actions .button, dialog input:not([type=radio])",
        ):
            assert min(min(box["height"], box["width"]) for box in boxes(page, targets)) >= 48
        confirm = boxes(page, "dialog .actions button")[0]
        assert confirm["bottom"] < 1280
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")

    def test_the_keyboard_will_do(self, shop: Shop, operator: Person, page: Page) -> None:
        shop.read(20.0)
        operator.sign_in(page)
        page.goto(f"/alarms?machine={shop.machine}")
        page.get_by_role("link", name="Noted").focus()
        page.keyboard.press("Enter")
        expect(page.get_by_role("dialog")).to_be_visible()
        page.keyboard.press("Enter")
        expect(page.locator("main")).to_contain_text("Nothing else was changed.")
        assert shop.alarms() == []

    def test_who_changed_the_offset_is_asked_in_a_dialog(self, shop: Shop, operator: Person, page: Page) -> None:
        shop.correction(shop.read(6.0)["correction"]["number"], "applied", offset_after=0.01)
        operator.sign_in(page)
        page.goto(f"/alarms?machine={shop.machine}")
        page.get_by_role("link", name="Report the true offset").click()
        dialog = page.get_by_role("dialog")
        dialog.get_by_role("radio", name="−0.0060 mm").check()
        dialog.get_by_role("radio", name="Typed in by mistake").check()
        dialog.get_by_label("Who changed it").fill("Ana")
        dialog.get_by_role("button", name="Report the true offset").click()
        expect(page.locator("main")).to_contain_text("The offset of tool 3 is −0.0060")
        assert (shop.tool()["offset"], shop.tool()["paused_by"]) == (-0.006, None)
