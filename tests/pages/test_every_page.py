"""Every page of the house, opened as people open it and looked at: no console error, no foreign request, nothing wider than
the screen, tabs in one line on the smallest, nothing that axe finds, no pale words, targets as large as a finger on phones and
tablets, and beside the machine on any screen.

The list is held against the routes of the application, so a new page is in it or the test fails.
"""

import io
from collections.abc import Iterator
from typing import Any, NamedTuple
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, Page, expect
from pypdf import PdfReader

from app.access import devices
from tests.browsers import new_page
from tests.pages.house import ADDRESSES, PAGES, furnished, routes, values_of
from tests.pages.looks import (
    SIZES,
    STATES,
    State,
    opened,
    pale_words,
    resize,
    small_targets,
    too_wide,
    violations,
)
from tests.pages.words import flaws_in
from tests.servers import Server
from tests.shop import Person, Shop

pytestmark = pytest.mark.own_server  # pages of the whole plant show this house and nothing else

SIGNED_OUT = {"/sign-in", "/invitation/{token}"}
OPENED_ELSEWHERE = {"/import/{token}"}  # needs a file that was sent; tests/loop/readings/importing
PARTS = {  # only ever fetched into a page
    "/plant-summary",
    "/todo/count",
    "/todo/not-reached",
    "/wall/now",
    "/setup/fit",
    "/setup/named",
    "/station/{machine}/events",
    "/station/{machine}/pictures/{picture}",
    "/characteristics/{characteristic}/readings/{sequence}/panel",
}
# Pages that are worked beside the machine, with gloves. Reading 3 has the dialog of a measurement by hand.
BESIDE_THE_MACHINE = {
    "/",
    "/plant/{machine}",
    "/station/{machine}",
    "/station/{machine}/alarms/{alarm}?action=measured_by_hand",
    "/station/{machine}/tools/3/change",
    "/station/{machine}/context",
    "/station/{machine}/sizes",
    "/alarms",
    "/alarms/{alarm}",
    "/alarms/{alarm}?action=keep_cutting",
    "/alarms/history",
    "/todo",
    "/connections",
    "/machines/{machine}/connection",
    "/machines/{machine}/touch-tests/{touch_test}",
    "/corrections",
    "/corrections/{machine}/tools/5",
    "/machines/{machine}/tools/3/change",
    "/characteristics/{characteristic}/readings/3",
    "/account",
}


SAMPLE = {
    "/",
    "/characteristics/{characteristic}",
    "/characteristics/{characteristic}/readings/3",
    "/station/{machine}",
}
"""Pages that axe sees also in the short run."""


USUAL = {addresses[0] for addresses in PAGES.values()} | BESIDE_THE_MACHINE | SAMPLE
"""Addresses that are looked at in the short run: each page once, and what is worked with gloves."""


class Looks(NamedTuple):
    """How a page is looked at while it is open: from the smallest screen on, because a chart grows when it has room."""

    sizes: tuple[str, ...]
    states: tuple[State, ...]
    fingers: tuple[str, ...]
    beside_the_machine: tuple[str, ...]


SHORT = Looks(("phone-zoomed", "desk"), (), ("phone",), ("phone",))
WHOLE = Looks(tuple(sorted(SIZES, key=SIZES.__getitem__)), STATES, ("phone", "panel"), ("phone", "panel", "desk"))


def pages_of_the_house() -> set[str]:
    """The addresses that answer with a page: GET routes that are not for programs."""
    return {path for path in routes() if not path.startswith(("/api/v1/", "/health/", "/metrics"))}


def test_no_page_is_forgotten() -> None:
    assert pages_of_the_house() == set(PAGES) | SIGNED_OUT | OPENED_ELSEWHERE | PARTS
    assert set(ADDRESSES) >= BESIDE_THE_MACHINE | SAMPLE


@pytest.fixture(scope="module")
def house(server: Server) -> Shop:
    return furnished(server)


@pytest.fixture(scope="module")
def values(house: Shop) -> dict[str, Any]:
    return values_of(house)


@pytest.fixture(scope="module")
def visitor(browser: Browser, server: Server, admin: Person) -> Iterator[tuple[Page, list[str]]]:
    """The one browser in which somebody goes from page to page, and what it complained about."""
    complaints: list[str] = []
    with new_page(browser, server.url, complaints) as page:
        admin.sign_in(page)
        yield page, complaints


@pytest.mark.parametrize(
    ("address", "looks"),
    [pytest.param(address, SHORT, id=f"{address}-short") for address in sorted(USUAL)]
    + [pytest.param(address, WHOLE, id=f"{address}-whole", marks=pytest.mark.long) for address in ADDRESSES],
)
def test_a_page_is_in_order(
    visitor: tuple[Page, list[str]], values: dict[str, Any], address: str, looks: Looks
) -> None:
    page, complaints = visitor
    resize(page, looks.sizes[0])
    page.emulate_media(color_scheme="light")
    opened(page, address.format(**values))
    high = page.locator(".tabs").evaluate_all("all => all.filter((tabs) => tabs.clientHeight > 64).length")
    headings = page.locator("h1").count()
    wide = {}
    for size in looks.sizes:
        resize(page, size)
        if more := too_wide(page):
            wide[size] = more
    pale = pale_words(page)
    axe = violations(page, STATES if address in SAMPLE else looks.states)
    small = {}
    for size in looks.fingers if address not in BESIDE_THE_MACHINE else looks.beside_the_machine:
        resize(page, size)
        if found := small_targets(page):
            small[size] = found
    said, complaints[:] = complaints[:], []
    assert (said, headings, high, wide, pale, axe, small) == ([], 1, 0, {}, [], {}, {}), page.url


@pytest.mark.parametrize("address", ADDRESSES)
def test_the_words_of_a_page_are_in_order(house: Shop, admin: Person, values: dict[str, Any], address: str) -> None:
    assert flaws_in(admin.open(address.format(**values))) == []


@pytest.mark.parametrize(
    ("written", "flaws"),
    [
        ("<p>Sent <b>twice</b> .</p><p>Cut&nbsp; short</p>", ["blank before a mark", "two blanks"]),
        ("<p>8.3…10.3 µm ( all)</p>", ["blank after a bracket", "range of dots"]),
        ("<td>12.5 mm</td><td class=num>12.5 mm</td><td>12.5&nbsp;mm</td>", ["number broken from its unit"]),
        ("<p>p = &lt; 0.001, ± +3</p>", ["two signs"] * 2),
        ("<td>None</td><p>F = nan, 3 to {high}</p><p>None was missed.</p>", ["word of the program"] * 3),
        ("<p><a>Done.</a><b>More</b> 3mm</p>", ["words without a blank", "number without a blank"]),
        ("<p>0, 1 … 20;\n  a <code>b  ;</code>, c</p><i title='{}'></i>", ["word of the program"]),
    ],
)
def test_flaws_of_words_are_found(written: str, flaws: list[str]) -> None:
    assert [found.partition(":")[0] for found in flaws_in(written)] == flaws


PRINTED = {"/", "/overview", "/characteristics/{characteristic}"}
"""Pages whose paper is looked at in the short run, too."""

CONTROLS = """() => [...document.querySelectorAll(
    "button, .button, .tabs, .choice, .picker, .rail, .foot, .chart-strip, form[method=get], form[method=get] *")]
    .filter((each) => each.checkVisibility() && !each.matches("a.sorts, .why > button")).map((each) => each.outerHTML.slice(0, 120))"""
MOST_SHEETS = 24  # of a page of this house
BOOKS = {"/api/docs"}
"""Pages that print all that is folded in, hundreds of sheets: who prints one wants the book."""


@pytest.mark.parametrize(
    "address",
    [address if address in PRINTED else pytest.param(address, marks=pytest.mark.long) for address in ADDRESSES],
)
def test_a_page_prints_without_controls_and_with_whole_words(
    visitor: tuple[Page, list[str]], values: dict[str, Any], address: str
) -> None:
    page, complaints = visitor
    resize(page, "desk")
    opened(page, address.format(**values))
    page.emulate_media(media="print")
    controls = page.evaluate(CONTROLS)
    page.emulate_media(media="null")
    sheets, broken = {}, {}
    for way in ("upright", "across"):
        printed = PdfReader(io.BytesIO(page.pdf(format="A4", landscape=way == "across"))).pages
        sheets[way] = len(printed)
        lines = [line.strip() for sheet in printed for line in sheet.extract_text().splitlines()]
        letters = "".join("x" if len(line) == 1 and line.isalpha() else " " for line in lines)
        if "xxxx" in letters:
            broken[way] = lines[letters.index("xxxx") - 1 :][:20]
    complaints.clear()
    assert (controls, broken) == ([], {})
    assert address in BOOKS or max(sheets.values()) <= MOST_SHEETS, sheets


@pytest.mark.parametrize("size", SIZES)
def test_pages_before_signing_in(page: Page, house: Shop, size: str) -> None:
    resize(page, size)
    invitation = house.call("POST", "/people/invitations", 201, role="viewer")["url"]
    for address in ("/sign-in", urlsplit(invitation).path):
        opened(page, address)
        expect(page.locator("h1")).to_have_count(1)
        assert too_wide(page) == 0, address


def test_axe_finds_nothing_before_signing_in(page: Page) -> None:
    opened(page, "/sign-in")
    assert violations(page) == {}


def test_targets_of_a_station_are_as_large_as_a_finger(
    page: Page, server: Server, house: Shop, values: dict[str, Any]
) -> None:
    """Before it is bound to a machine, and where it is asked who acts, by PIN or badge."""
    resize(page, "phone")
    with server.database.begin() as session:
        code = devices.make_code(session, house.machine, "Tablet", "tests")
    found = {}
    for address in ("/sign-in", f"/station?code={code}"):
        opened(page, address)
        found[address] = small_targets(page)
    page.get_by_role("button", name="Bind").click()
    expect(page.locator(".station-page")).to_be_visible()
    opened(page, f"/station/{house.machine}/alarms/{values['alarm']}?action=noted")
    found["who"] = small_targets(page)
    assert {address: small for address, small in found.items() if small} == {}


@pytest.mark.parametrize("owner", ["viewer", "machine"])
def test_a_key_in_place_of_a_sign_in_meets_no_fault(
    server: Server, house: Shop, values: dict[str, Any], owner: str
) -> None:
    client = server.client(server.key("viewer") if owner == "viewer" else server.key(machine=house.machine))
    answers = {address: client.get(address.format(**values)).status_code for address in USUAL}
    assert {address: status for address, status in answers.items() if status >= 500} == {}


def test_contrast_themes_of_the_system_show_what_is_chosen(page: Page, house: Shop, admin: Person) -> None:
    page.emulate_media(forced_colors="active")
    admin.sign_in(page)
    opened(page, f"/characteristics/{house.characteristic}")
    choices = page.locator("nav.choice").evaluate_all(
        "all => all.map((one) => [...one.querySelectorAll('a')].map("
        "(link) => getComputedStyle(link).backgroundColor + (link.ariaCurrent ? ' chosen' : '')))"
    )
    assert choices
    assert {len(set(grounds)) for grounds in choices} == {2}, choices
    chart = page.locator("plotly-chart").first  # marks and bands on their own ground
    assert chart.evaluate("chart => getComputedStyle(chart).forcedColorAdjust") == "none"
