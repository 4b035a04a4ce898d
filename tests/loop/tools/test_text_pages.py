"""The page of corrections as program text: copied, fetched, applied; with and without scripts, in the real browser."""

import re
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.pages.looks import live
from tests.shop import Person, Shop


def hidden_fields(text: str) -> dict[str, str]:
    return dict(re.findall(r'<input type="hidden" name="(?!csrf)(\w+)" value="([^"]*)">', text))


class TestCorrections:
    def address(self, shop: Shop) -> str:
        return f"/machines/{shop.machine}/corrections/program"

    def test_copied_fetched_and_applied(self, shop: Shop, operator: Person, page: Page) -> None:
        shop.read(6.1)
        operator.sign_in(page)
        page.goto(f"/machines/{shop.machine}/tools")
        page.get_by_role("link", name="As program text").click()
        expect(page.locator("#corrections-text")).to_have_value(re.compile(r"\$TC_DP12\[3,1\]=-0\.0061"))
        page.get_by_role("button", name="Mark fetched").click()
        expect(page.locator("#in-text")).to_contain_text("Fetched")
        expect(page.get_by_role("button", name="Marked as fetched")).to_be_disabled()
        page.goto(f"/machines/{shop.machine}/tools")
        expect(page.locator("#correction-1")).to_contain_text("fetched")
        page.goto(self.address(shop))
        page.get_by_role("link", name="All of these are applied now").click()
        page.get_by_role("dialog").get_by_role("button", name="All are applied").click()
        expect(page.get_by_text("1 correction is applied now.")).to_be_visible()
        assert shop.correction(1)["status"] == "applied"
        assert shop.tool()["offset"] == -0.0061

    @pytest.mark.long
    def test_what_comes_later_is_announced_and_not_slipped_in(self, shop: Shop, operator: Person, page: Page) -> None:
        shop.read(6.1)
        operator.sign_in(page)
        page.goto(self.address(shop))
        before = page.locator("#corrections-text").input_value()
        live(page)
        shop.read(20.0, correction_in_effect=0)
        expect(page.locator("#newer")).to_contain_text("have changed since")
        assert page.locator("#corrections-text").input_value() == before
        page.get_by_role("button", name="Mark fetched").click()
        expect(page.locator("#in-text tbody tr")).to_have_count(2)
        assert shop.correction(1)["fetched_at"]
        assert shop.correction(2)["fetched_at"] is None

    def test_a_correction_that_fell_is_called_back(self, shop: Shop, operator: Person, page: Page) -> None:
        shop.read(6.1)
        shop.call("POST", f"/machines/{shop.machine}/corrections/fetched", numbers=[1])
        operator.sign_in(page)
        page.goto(f"/machines/{shop.machine}/tools")
        page.locator("#correction-1").get_by_role("link", name="Reject").click()
        dialog = page.get_by_role("dialog")
        expect(dialog).to_contain_text("was fetched as program text")
        dialog.get_by_role("radio", name="Set by hand instead").check()
        dialog.get_by_role("button", name="Reject").click()
        page.wait_for_url("**/tools?**")
        assert shop.correction(1)["status"] == "rejected"
        page.goto(self.address(shop))
        expect(page.get_by_role("alert")).to_contain_text("must not be run any more")
        page.goto(f"/machines/{shop.machine}/corrections/1")
        expect(page.locator("#correction")).to_contain_text("Take the text back")

    def test_fetched_while_somebody_was_asked(self, shop: Shop, operator: Person) -> None:
        """The question was answered before anybody had fetched: it is asked again, with the warning, and nothing fell."""
        shop.read(6.1)
        shop.call("POST", f"/machines/{shop.machine}/corrections/fetched", numbers=[1])
        text = operator.send(f"/machines/{shop.machine}/corrections/1", do="rejected", reason="False reading")
        assert "was fetched as program text" in text
        assert shop.correction(1)["status"] == "pending"
        operator.send(f"/machines/{shop.machine}/corrections/1", 200, **hidden_fields(text), reason="False reading")
        assert shop.correction(1)["status"] == "rejected"

    def test_applied_twice_from_an_old_page_is_harmless(self, shop: Shop, operator: Person) -> None:
        shop.read(6.1)
        fields = hidden_fields(operator.open(f"{self.address(shop)}?do=applied"))
        assert fields["numbers"] == "1"
        operator.send(self.address(shop), 200, **fields)
        assert "had been confirmed before" in operator.send(self.address(shop), 200, **fields)
        assert shop.tool()["offset"] == -0.0061

    @pytest.mark.parametrize(
        ("fields", "status"),
        [
            ({}, 404),
            ({"do": "applied"}, 404),
            ({"do": "applied", "numbers": "x ٣ 0 -1 99999999999999999999"}, 404),
            ({"do": "applied", "numbers": "77"}, 404),
            ({"do": "fetched", "numbers": "77"}, 404),
            ({"do": "dance", "numbers": "1"}, 404),
            ({"do": "fetched", "numbers": "1", "form": "g10"}, 200),
        ],
    )
    def test_bad_input_is_a_page_in_words(
        self, shop: Shop, operator: Person, fields: dict[str, str], status: int
    ) -> None:
        shop.read(6.1)
        operator.send(self.address(shop), status, **fields)
        assert shop.correction(1)["status"] == "pending"

    def test_a_viewer_sees_and_does_nothing(self, shop: Shop, server: Any) -> None:
        shop.read(6.1)
        viewer = Person(server, "viewer")
        text = viewer.open(f"{self.address(shop)}?do=applied")
        assert "corrections-text" in text
        assert "Mark fetched" not in text
        viewer.send(self.address(shop), 403, do="fetched", numbers="1")

    def test_every_form_and_no_other(self, shop: Shop, operator: Person) -> None:
        for form in ("turning", "milling", "list"):
            operator.open(f"{self.address(shop)}?form={form}")
        operator.open(f"{self.address(shop)}?form=g10", 422)
        operator.open(f"{self.address(shop)}?form=x", 422)
