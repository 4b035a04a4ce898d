"""The queue of what waits for a person, the page of a tool, and the alarms that ask about offsets: by posts and in Chromium."""

from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.shop import Person, Shop


def awaiting(shop: Shop, *micrometres: float) -> list[int]:
    key = f"{shop.characteristic}-a"
    shop.add(key, mode="approval", tool_memory=4, average_memory=6)
    return [shop.read(each, key)["correction"]["number"] for each in micrometres]


class TestQueue:
    def test_it_says_what_is_decided_about(self, shop: Shop, operator: Person) -> None:
        first, second = awaiting(shop, 20.0, 50.0)
        held = shop.read(350.0)["correction"]["number"]
        text = operator.open(f"/corrections?machine={shop.machine}")
        for number in (first, second, held):
            assert f'id="correction-{number}"' in text
        assert "Approve all 2" in text
        assert "−50.0" in text  # their sum
        assert "−0.0500" in text  # the offset with both
        assert "beyond the tolerance" in text  # why
        assert f"/readings/{1}" in text
        assert f'href="/alarms/{shop.alarms()[-1]["id"]}"' in text  # the held one is decided at its alarm
        assert text.index(f'id="correction-{first}"') < text.index(f'id="correction-{held}"')
        other = operator.open("/corrections")
        assert f'id="correction-{first}"' in other
        operator.open("/corrections?machine=nowhere", 404)

    def test_one_by_one_and_back_to_the_queue(self, shop: Shop, operator: Person) -> None:
        first, second = awaiting(shop, 20.0, 50.0)
        path = f"/machines/{shop.machine}/corrections/"
        assert 'name="from" value="queue"' in operator.open(f"{path}{first}?do=approve&from=queue")
        text = operator.send(f"{path}{first}", 200, **{"do": "approve", "reason": "agrees", "from": "queue"})
        assert f"Correction {first} is approved" in text
        assert "Corrections that wait for a decision" in text
        operator.send(f"{path}{second}", 200, **{"do": "rejected", "reason": "false", "from": "queue"})
        assert [shop.correction(n)["status"] for n in (first, second)] == ["pending", "rejected"]
        late = operator.send(f"{path}{second}", 200, **{"do": "approve", "reason": "agrees", "from": "queue"})
        assert "Nothing was done" in late
        assert f"rejected by {operator.name}" in late

    def test_all_of_a_tool_are_those_that_were_shown(self, shop: Shop, operator: Person) -> None:
        first, second = awaiting(shop, 20.0, 50.0)
        path = f"/corrections/{shop.machine}/tools/4"
        question = operator.open(path)
        assert f'name="numbers" value="{first} {second}"' in question
        assert "goes from" in question
        later = shop.read(90.0, f"{shop.characteristic}-a")["correction"]["number"]
        text = operator.send(path, numbers=f"{first} {second}", reason="Process is known")
        assert "is approved" in text
        assert [shop.correction(n)["status"] for n in (first, second, later)] == [
            "pending",
            "pending",
            "awaiting_approval",
        ]
        assert "is approved" in operator.send(
            path, numbers=f"{first} {second}", reason="Process is known"
        )  # sent twice

    def test_who_comes_too_late_approves_none(self, shop: Shop, operator: Person, server: Any) -> None:
        first, second = awaiting(shop, 20.0, 50.0)
        other = Person(server, "operator")
        path = f"/corrections/{shop.machine}/tools/4"
        operator.open(path)
        other.send(f"/machines/{shop.machine}/corrections/{second}", do="rejected", reason="chip")
        text = operator.send(path, numbers=f"{first} {second}", reason="Process is known")
        assert "Nothing was done" in text
        assert f"rejected by {other.name}" in text
        assert shop.correction(first)["status"] == "awaiting_approval"
        other.send(path, numbers=str(first), reason="x")
        operator.open(path, 404)

    def test_bad_forms(self, shop: Shop, operator: Person, server: Any) -> None:
        (first,) = awaiting(shop, 20.0)
        path = f"/corrections/{shop.machine}/tools/4"
        assert "Is missing" in operator.send(path, 422, numbers=str(first), reason="")
        operator.send(path, 422, numbers="", reason="x")
        operator.send(path, 404, numbers="99999", reason="x")
        operator.send(path, 422, numbers="-1 x 9999999999999999999", reason="x")
        operator.send(f"/corrections/{shop.machine}/tools/99", 404, numbers="1", reason="x")
        viewer = Person(server, "viewer")
        viewer.open(path, 403)
        viewer.send(path, 403, numbers=str(first), reason="x")
        assert "You may look" in viewer.open("/corrections")
        assert shop.correction(first)["status"] == "awaiting_approval"

    def test_the_number_in_the_navigation(self, shop: Shop, operator: Person) -> None:
        before = operator.open("/todo/count")
        awaiting(shop, 20.0)
        after = operator.open("/todo/count")
        assert before != after
        assert 'id="to-do-count"' in operator.open("/")


class TestTool:
    def test_the_page_and_its_form(self, shop: Shop, operator: Person) -> None:
        shop.correction(shop.read(20.0)["correction"]["number"], "applied")
        path = f"/machines/{shop.machine}/tools/3"
        assert "−0.0200" in operator.open(path)
        text = operator.send(
            path, name="T03 finishing", edge="D1", kind="", sister="13", planned_parts="4", planned_total="25,5"
        )
        assert "is saved" in text
        tool = shop.tool()
        assert (tool["name"], tool["kind"], tool["sister"], tool["planned_parts"], tool["planned_total"]) == (
            "T03 finishing",
            None,
            13,
            4,
            0.0255,
        )
        assert "78" in text  # 20 of 25.5 µm
        assert "Switch to sister 13" in text
        text = operator.send(path, name="", edge="", kind="", sister="", planned_parts="", planned_total="")
        assert shop.tool()["planned_total"] is None
        for field, value in (("sister", "3"), ("sister", "x"), ("planned_parts", "-1"), ("planned_total", "much")):
            operator.send(path, 422, **{field: value})
        operator.open(f"/machines/{shop.machine}/tools/33", 404)

    def test_switching_to_the_sister(self, shop: Shop, operator: Person) -> None:
        shop.call("PATCH", f"/machines/{shop.machine}/tools/3", sister=13)
        path = f"/machines/{shop.machine}/tools/3/sister"
        assert "Select tool 13 at the machine" in operator.open(path)
        assert "Tool 13 goes on" in operator.send(path, reason="Edge worn")
        assert shop.tool(13)["characteristics"] == [shop.characteristic]
        operator.open(path, 404)  # nothing is left to be switched

    def test_a_pause_is_shown_everywhere(self, shop: Shop, operator: Person) -> None:
        shop.correction(shop.read(6.0)["correction"]["number"], "applied", offset_after=0.5)
        (alarm,) = shop.alarms()
        for page in (
            f"/machines/{shop.machine}/tools/3",
            f"/machines/{shop.machine}/tools?tool=3",
            f"/characteristics/{shop.characteristic}",
        ):
            text = operator.open(page)
            assert f"paused by alarm {alarm['id']}" in text, page
            assert f"/alarms/{alarm['id']}" in text, page
        assert 'data-state="paused"' in operator.open(f"/plant/{shop.machine}")


@pytest.mark.browser
class TestInABrowser:
    def test_a_correction_appears_and_all_are_approved(self, shop: Shop, operator: Person, page: Page) -> None:
        operator.sign_in(page)
        page.goto(f"/corrections?machine={shop.machine}")
        expect(page.locator("#approvals")).to_contain_text("Nothing waits for a decision")
        expect(page.locator("live-status")).to_have_attribute("state", "live")
        first, second = awaiting(shop, 20.0, 50.0)
        expect(page.locator(f"#correction-{second}")).to_contain_text("−30.0")
        expect(page.locator(f"#correction-{first} .band-picture")).to_be_visible()
        page.get_by_role("link", name="Approve all 2").click()
        dialog = page.get_by_role("dialog")
        dialog.get_by_role("radio", name="Process is known").check()
        dialog.get_by_role("button", name="Approve all").click()
        expect(page.locator("main")).to_contain_text("All that awaited approval for tool 4 is approved")
        assert {shop.correction(n)["status"] for n in (first, second)} == {"pending"}

    def test_who_changed_the_offset_is_asked_in_a_dialog(self, shop: Shop, operator: Person, page: Page) -> None:
        shop.correction(shop.read(6.0)["correction"]["number"], "applied", offset_after=0.01)
        operator.sign_in(page)
        page.goto(f"/alarms?machine={shop.machine}")
        page.get_by_role("link", name="Say which offset is true").click()
        dialog = page.get_by_role("dialog")
        dialog.get_by_role("radio", name="−0.0060 mm").check()
        dialog.get_by_role("radio", name="Typed in by mistake").check()
        dialog.get_by_label("Who changed it").fill("Ana")
        dialog.get_by_role("button", name="Say which offset is true").click()
        expect(page.locator("main")).to_contain_text("The offset of tool 3 is −0.0060")
        assert (shop.tool()["offset"], shop.tool()["paused_by"]) == (-0.006, None)

    @pytest.mark.parametrize("width", [800, 1280])
    def test_everything_is_large_enough_for_a_finger(
        self, shop: Shop, operator: Person, page: Page, width: int
    ) -> None:
        awaiting(shop, 20.0, 50.0)
        shop.read(350.0)
        operator.sign_in(page)
        page.set_viewport_size({"width": width, "height": 1280})
        for address in (f"/corrections?machine={shop.machine}", f"/machines/{shop.machine}/tools/3"):
            page.goto(address)
            assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
            for target in page.locator(
                ".approval-verbs a, .card-head .button, .page-head .button, main form button"
            ).all():
                box = target.bounding_box()
                assert box is not None
                assert box["height"] >= 48
