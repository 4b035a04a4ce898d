"""Form in a real browser: the published example typed in and seen through, the trend, and what bad input leaves standing."""

import re

import pytest
from playwright.sync_api import Page, expect

from tests.shop import Person, Shop, unique

OVAL = "10.01 0\n0 9.99\n-10.01 0\n0 -9.99"


class TestInABrowser:
    def test_the_published_example_is_tried_and_seen_through(self, shop: Shop, operator: Person, page: Page) -> None:
        operator.sign_in(page)
        page.goto("/forms")
        page.get_by_role("link", name="New measurement").click()
        page.get_by_role("link", name="Published example").click()
        page.get_by_label("Machine").select_option(shop.machine)
        feature = unique("bore-d56")
        page.get_by_role("textbox", name="Feature").fill(feature)
        page.get_by_role("button", name="Evaluate and save").click()
        expect(page.get_by_role("heading", level=1)).to_contain_text("Straightness of an axis")
        expect(page.locator("main")).to_contain_text(
            "155.5 µm is more than the tolerance 5.0 µm; these points do not show how certain"
        )
        told = page.get_by_role("alert").filter(has_text="Suspect point")
        expect(told).to_contain_text("Section 2, point 1")
        expect(told).to_contain_text("With X near 23.898")
        expect(page.locator("plotly-chart .main-svg").first).to_be_visible()
        expect(page.get_by_text("suspect", exact=True)).to_have_count(1)

        # Put right, from what is there already.
        page.get_by_role("link", name="Enter again, changed").click()
        touches = page.get_by_label("Probed points, mm")
        text = touches.input_value()
        assert "23.99 -7.346" in text
        touches.fill(text.replace("23.99 -7.346", "23.896 -7.346"))
        page.get_by_role("button", name="Evaluate and save").click()
        expect(page.get_by_role("alert").filter(has_text="Suspect point")).to_have_count(0)

        page.get_by_role("link", name="Trend").click()
        expect(page.locator("tbody tr")).to_have_count(2)
        expect(page.locator("plotly-chart .main-svg").first).to_be_visible()
        page.goto("/forms")
        expect(page.get_by_role("row").filter(has_text=feature)).to_contain_text("Not good")

    def test_pasted_from_a_spreadsheet_with_decimal_commas(self, shop: Shop, operator: Person, page: Page) -> None:
        operator.sign_in(page)
        page.goto(f"/forms/new?machine={shop.machine}&kind=roundness")
        page.get_by_role("textbox", name="Feature").fill("seat")
        page.get_by_label("Probed points, mm").fill("Z 5\n" + OVAL.replace(".", ",").replace(" ", "\t"))
        page.get_by_label("Tolerance").fill("25")
        page.get_by_role("button", name="Evaluate and save").click()
        expect(page.locator("main")).to_contain_text(
            "20.0 µm is within the tolerance 25.0 µm; these points do not show how certain"
        )
        expect(page.get_by_role("row").filter(has_text="Largest inscribed circle")).to_contain_text("20.0")
        page.get_by_role("button", name="Compute again").click()
        expect(page.locator(".evaluations li")).to_have_count(2)


class TestWithoutScripts:
    @pytest.mark.parametrize(
        ("touches", "words"),
        [
            ("1 1\nzwei drei\n3 3", "line 2 is not a valid point"),
            ("", "needs sections"),
            ("0 0\n1 1\n2 2\n3 3", "one straight line"),
            ("0 0\n0 0\n0 0\n0 0", "coincide"),
            ("25 0\n24.98 1\n24.92 2\n24.82 3", "arc"),
            ("1 2\n3 4", "4 points or more"),
            ("1e9 0\n0 1\n-1 0\n0 -1", "at most"),
            ("nan 0\n0 1\n-1 0\n0 -1", "line 1 is not a valid point"),
        ],
    )
    def test_bad_touches_are_reported_and_nothing_typed_is_lost(
        self, shop: Shop, operator: Person, touches: str, words: str
    ) -> None:
        page = operator.send(
            "/forms/new",
            422,
            machine=shop.machine,
            feature="kućište-“5”",
            kind="roundness",
            touches=touches,
            tolerance="5",
        )
        assert words in page or "feature" in page
        page = operator.send(
            "/forms/new", 422, machine=shop.machine, feature="bad", kind="roundness", touches=touches, tolerance="7.5"
        )
        assert words in page
        assert 'value="7.5"' in page
        assert touches[:5] in page
        assert operator.open(f"/forms/features/{shop.machine}/bad", 404)

    def test_a_viewer_sees_and_does_not_measure(self, shop: Shop, operator: Person) -> None:
        made = operator.send(
            "/forms/new", machine=shop.machine, feature="looked-at", kind="roundness", touches=OVAL, method=""
        )
        number = re.search(r"/forms/(\d+)/figure", made)
        assert number is not None
        viewer = Person(shop.server, "viewer")
        assert "looked-at" in viewer.open("/forms")
        assert "Compute again" not in viewer.open(f"/forms/{number[1]}")
        viewer.open("/forms/new", 403)
        viewer.send("/forms/new", 403, machine=shop.machine, feature="x", kind="roundness", touches=OVAL)
