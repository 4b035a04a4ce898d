"""Long tables sort by their headers and are filtered by a field; of many pages the server filters by name."""

import re

import pytest
from playwright.sync_api import Page, expect

from app.loop.notes.pages import ON_PAGE as NOTES_ON_PAGE
from app.views.set_up.characteristic_pages import ON_PAGE
from tests.servers import Server
from tests.shop import Person, Shop

pytestmark = pytest.mark.own_server
NAMES = ["Mill 10", "Mill 9", *(f"Lathe {letter}" for letter in "KJIHGFEDCBA")]


@pytest.fixture(scope="module")
def hall(server: Server) -> Shop:
    """More machines than a screen is long, and characteristics of one."""
    shop = Shop(server)
    for number, name in enumerate(NAMES):
        shop.call("POST", "/machines", 201, key=f"sorted-{number}", name=name, control="other")
    for key in ("ring-a", "ring-b", "disc_c"):
        shop.add(key, tool_memory=0, average_memory=0)
    return shop


@pytest.mark.browser
def test_headers_sort_and_a_field_filters(hall: Shop, viewer: Person, page: Page) -> None:
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
    expect(rows.first).to_contain_text(hall.machine)
    expect(name).not_to_have_attribute("aria-sort", re.compile(".*"))
    page.get_by_label("Show rows with").fill("mill 10")
    expect(page.locator("#machines tbody tr:visible")).to_have_count(1)
    page.get_by_label("Show rows with").fill("")
    expect(page.locator("#machines tbody tr:visible")).to_have_count(len(NAMES) + 1)


@pytest.mark.browser
def test_cards_of_a_phone_name_their_columns_and_sort_where_they_are_seen(
    hall: Shop, viewer: Person, page: Page
) -> None:
    written = viewer.open("/setup/machines")
    assert re.search(r'<td[^>]* data-label="Characteristics">', written), "without scripts, too"
    viewer.sign_in(page)
    page.set_viewport_size({"width": 390, "height": 844})
    page.goto("/setup/machines")
    rows = page.locator("#machines tbody tr")
    sort_by = page.get_by_label("Sort by").first
    chosen = "choice => choice.selectedOptions[0].text"
    assert sort_by.evaluate(chosen) == "usual order"
    sort_by.select_option("Name ▾")
    expect(rows.first).to_contain_text("Mill 10")
    sort_by.select_option("Name ▴")
    expect(rows.last).to_contain_text("Mill 10")
    page.get_by_label("Show rows with").focus()
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.closest('tbody') !== null"), "no head that nobody sees is between"
    page.goto("/setup/characteristics?q=ring")
    page.locator("summary", has_text="Sort by usual order").click()
    page.locator(".sort-by").get_by_role("link", name="Characteristic").click()
    expect(page.locator(".sort-by [aria-current]")).to_have_count(1)
    expect(page.locator(".sort-by summary")).to_have_text("Sort by Characteristic ▴")
    for target in (20.001, 20.002):
        hall.call("PATCH", "/characteristics/disc_c", parameters={"target": target}, reason="Moved")
    page.goto("/setup/characteristics/disc_c")
    assert page.locator("#all-versions-sort").evaluate(chosen) == "Version ▾", "an order of a column has its name"


def test_the_server_filters_by_name_where_a_list_has_pages(hall: Shop, viewer: Person) -> None:
    def listed(query: str) -> list[str]:
        return re.findall(r'<code class="quiet">([^<]+)</code>', viewer.open(f"/setup/characteristics?{query}"))

    assert listed("q=RING") == ["ring-a", "ring-b"]
    assert listed("q=RING%20b%20lathe") == ["ring-b"]  # each word, wherever it stands in the row
    assert listed("q=ring&sort=-name") == ["ring-b", "ring-a"]
    assert listed("q=ring&sort=no-column") == ["ring-a", "ring-b"]
    assert listed("q=_") == ["disc_c"]
    assert listed(f"q=ring-b&machine={hall.machine}") == ["ring-b"]
    assert listed("q=ring&machine=sorted-0") == []
    assert listed("q=zzz") == []


def test_the_server_sorts_a_list_of_several_pages_by_its_headers(hall: Shop, viewer: Person) -> None:
    for number in range(ON_PAGE + 1):
        hall.add(f"paged-{number:03}", tool_memory=0, average_memory=0, target=20.0 + number % 7)
    page = viewer.open("/setup/characteristics?q=paged&sort=-target")
    targets = [float(text) for text in re.findall(r"(2\d\.0000)", page)]
    assert targets == sorted(targets, reverse=True)
    assert len(targets) == ON_PAGE
    assert re.search(r'aria-sort="descending"><a class="sorts" href="[^"]*sort=target"', page)
    on = re.search(r'href="([^"]+)" rel="next"', page)
    assert on is not None
    assert re.findall(r"(2\d\.0000)", viewer.open(on[1].replace("&amp;", "&"))) == ["20.0000"]


def test_the_server_filters_lists_that_have_pages(hall: Shop, viewer: Person) -> None:
    """Notes and alarms that stand on a later page are found; what no row holds is said."""
    for number in range(NOTES_ON_PAGE + 1):
        hall.call("POST", "/notes", 201, machine=hall.machine, text="A rare bird" if number == 0 else f"Note {number}")
    assert "A rare bird" not in viewer.open("/notes")
    assert "A rare bird" in viewer.open("/notes?q=BIRD%20lathe")
    assert "No row holds" in viewer.open("/notes?q=no-such-word")
    assert "A rare bird" in viewer.open("/notes?q=%20%00bird")  # what cannot be stored is no word
    for key in ("worn", "small"):
        hall.add(key, tool_memory=11, average_memory=0)
    hall.read(350.0, "worn")
    hall.read(-12.0, "small")
    history = viewer.open("/alarms/history?q=tool%20worn")
    assert "Seat worn" in history
    assert "Seat small" not in history


@pytest.mark.parametrize(
    "path",
    [
        "/alarms/history",
        "/alignments",
        "/calibration",
        "/connections",
        "/gauges",
        "/machines",
        "/notes",
        "/overview",
        "/proposals",
        "/setup/characteristics",
        "/work-zeros",
    ],
)
def test_a_filter_that_no_row_holds_says_so(hall: Shop, viewer: Person, path: str) -> None:
    hall.read(0.0)
    page = viewer.open(f"{path}?q=no-such-word")
    assert "No row holds “no-such-word”" in page
    assert 'value="no-such-word"' in page


@pytest.mark.browser
def test_all_ticks_only_what_the_filter_shows(hall: Shop, viewer: Person, page: Page) -> None:
    viewer.sign_in(page)
    page.goto("/reports")
    page.get_by_label("Show those with").fill("ring-a")
    page.get_by_role("button", name="All", exact=True).click()
    chosen = page.locator("input[name=characteristic]:checked")
    expect(chosen).to_have_count(1)
    page.get_by_label("Show those with").fill("")
    expect(chosen).to_have_value("ring-a")


@pytest.mark.browser
def test_a_choice_in_a_row_counts_by_what_is_chosen(server: Server, page: Page) -> None:
    for number in range(12):
        server.person(f"clerk-{number}", "viewer")
    server.person("foreman", "operator")
    Person(server, "admin").sign_in(page)
    page.goto("/setup/people")
    rows = page.locator("#all-people tbody tr:visible")
    page.get_by_label("Show rows with").fill("foreman")
    expect(rows).to_have_count(1)
    role = rows.get_by_role("combobox").evaluate("choice => choice.selectedOptions[0].text")
    page.get_by_label("Show rows with").fill(role)
    expect(rows).to_have_count(1)
    page.get_by_label("Show rows with").fill("clerk-1")
    expect(rows).to_have_count(3)  # clerk-1, clerk-10, clerk-11


def test_the_record_of_changes_is_filtered_by_any_word_of_it(hall: Shop, engineer: Person) -> None:
    hall.call("PATCH", f"/machines/{hall.machine}", name="Lathe renamed")
    assert engineer.open("/setup/audit?q=MACHINE%20CHANGED").count("machine changed") == 1
    assert "machine changed" not in engineer.open("/setup/audit?q=ring-a")
    assert "Characteristic ring-a" in engineer.open("/setup/audit?q=ring-a").replace("<wbr>", "")
    assert "Nothing recorded here" in engineer.open("/setup/audit?q=%25")
