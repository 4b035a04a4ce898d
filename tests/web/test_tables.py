"""Long tables sort by their headers and are filtered by a field; of many pages the server filters by name."""

import re

import pytest
from playwright.sync_api import Page, expect

from tests.conftest import Server
from tests.shop import Person, Shop

NAMES = ["Mill 10", "Mill 9", *(f"Lathe {letter}" for letter in "KJIHGFEDCBA")]


@pytest.fixture(scope="module")
def shop(server: Server) -> Shop:
    """More machines than a screen is long, and characteristics of one."""
    shop = Shop(server)
    for number, name in enumerate(NAMES):
        shop.call("POST", "/machines", 201, key=f"sorted-{number}", name=name, control="other")
    for key in ("ring-a", "ring-b", "disc_c"):
        shop.add(key, tool_memory=0, average_memory=0)
    return shop


@pytest.mark.browser
def test_headers_sort_and_a_field_filters(shop: Shop, viewer: Person, page: Page) -> None:
    viewer.sign_in(page)
    page.goto("/setup/machines")
    rows = page.locator("#machines tbody tr")
    name, counts = (page.locator("#machines th", has_text=text) for text in ("Name", "Characteristics"))
    name.get_by_role("button").click()
    expect(name).to_have_attribute("aria-sort", "ascending")
    expect(rows.last).to_contain_text("Mill 10")  # numbers in names count as numbers
    name.get_by_role("button").click()
    expect(name).to_have_attribute("aria-sort", "descending")
    expect(rows.first).to_contain_text("Mill 10")
    counts.get_by_role("button").focus()
    page.keyboard.press("Enter")
    page.keyboard.press("Enter")
    expect(rows.first).to_contain_text(shop.machine)
    expect(name).not_to_have_attribute("aria-sort", re.compile(".*"))
    page.get_by_label("Show rows with").fill("mill 10")
    expect(page.locator("#machines tbody tr:visible")).to_have_count(1)
    page.get_by_label("Show rows with").fill("")
    expect(page.locator("#machines tbody tr:visible")).to_have_count(len(NAMES) + 1)


def test_the_server_filters_by_name_where_a_list_has_pages(shop: Shop, viewer: Person) -> None:
    def listed(query: str) -> list[str]:
        return re.findall(r'<code class="quiet">([^<]+)</code>', viewer.open(f"/setup/characteristics?{query}"))

    assert listed("q=RING") == ["ring-a", "ring-b"]
    assert listed("q=_") == ["disc_c"]
    assert listed(f"q=ring-b&machine={shop.machine}") == ["ring-b"]
    assert listed("q=ring&machine=sorted-0") == []
    assert listed("q=zzz") == []
