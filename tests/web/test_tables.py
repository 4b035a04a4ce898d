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


@pytest.mark.browser
def test_a_choice_in_a_row_counts_by_what_is_chosen(server: Server, shop: Shop, page: Page) -> None:
    for number in range(12):
        server.person(f"clerk-{number}", "viewer")
    Person(server, "engineer")
    Person(server, "admin").sign_in(page)
    page.goto("/setup/people")
    rows = page.locator("#all-people tbody tr:visible")
    page.get_by_label("Show rows with").fill("engineer-")
    expect(rows).to_have_count(1)
    role = rows.get_by_role("combobox").evaluate("choice => choice.selectedOptions[0].text")
    page.get_by_label("Show rows with").fill(role)
    expect(rows).to_have_count(1)
    page.get_by_label("Show rows with").fill("clerk-1")
    expect(rows).to_have_count(3)  # clerk-1, clerk-10, clerk-11


def test_the_record_of_changes_is_filtered_by_any_word_of_it(shop: Shop, engineer: Person) -> None:
    shop.call("PATCH", f"/machines/{shop.machine}", name="Lathe renamed")
    assert engineer.open("/setup/audit?q=MACHINE%20CHANGED").count("machine changed") == 1
    assert "machine changed" not in engineer.open("/setup/audit?q=ring-a")
    assert "characteristic/ring-a" in engineer.open("/setup/audit?q=ring-a")
    assert "Nothing recorded here" in engineer.open("/setup/audit?q=%25")
