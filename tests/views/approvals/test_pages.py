"""The queue of what waits for a person: by posts and in Chromium."""

from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.pages.looks import boxes
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
        assert "Pick a reason" in operator.send(path, 422, numbers=str(first), reason="")
        operator.send(path, 422, numbers="", reason="x")
        operator.send(path, 404, numbers="99999", reason="x")
        operator.send(path, 422, numbers="-1 x 9999999999999999999", reason="x")
        operator.send(f"/corrections/{shop.machine}/tools/99", 404, numbers="1", reason="x")
        viewer = Person(server, "viewer")
        viewer.open(path, 403)
        viewer.send(path, 403, numbers=str(first), reason="x")
        assert "View only" in viewer.open("/corrections")
        assert shop.correction(first)["status"] == "awaiting_approval"

    def test_the_number_in_the_navigation(self, shop: Shop, operator: Person) -> None:
        before = operator.open("/todo/count")
        awaiting(shop, 20.0)
        after = operator.open("/todo/count")
        assert before != after
        assert 'id="to-do-count"' in operator.open("/")


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

    @pytest.mark.parametrize("width", [800, pytest.param(1280, marks=pytest.mark.long)])
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
            targets = ".approval-verbs a, .card-head .button, .page-head .button, main form button"
            assert min(box["height"] for box in boxes(page, targets)) >= 48
