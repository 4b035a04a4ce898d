"""One search for all that has a name, over REST, as a page, and with suggestions in the browser."""

import re
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.conftest import Server
from tests.shop import Person, Shop

pytestmark = pytest.mark.own_server

ODD = "../7 ?&#%<b> ö"


@pytest.fixture(scope="module")
def searched(server: Server) -> Shop:
    searched = Shop(server)
    searched.add(f"{searched.characteristic}-b", tool_memory=0, average_memory=0)
    for part in ("Serial-0001", "Serial-0002", ODD):
        searched.read(6.0, part=part)
        searched.read(0.0, f"{searched.characteristic}-b", part=part)
    searched.read(350.0)
    return searched


def found(searched: Shop, q: str, client: Any = None) -> list[tuple[str, str]]:
    answer = (client or searched.admin).get("/api/v1/search", params={"q": q})
    assert answer.status_code == 200, answer.text
    return [(item["kind"], item["key"]) for item in answer.json()["items"]]


def test_by_name_key_number_and_beginning(searched: Shop) -> None:
    alarm = str(searched.alarms()[0]["id"])
    assert found(searched, searched.machine.upper())[0] == ("machine", searched.machine)
    assert found(searched, searched.characteristic)[:2] == [
        ("characteristic", searched.characteristic),
        ("characteristic", f"{searched.characteristic}-b"),
    ]
    assert ("report", searched.characteristic) in found(searched, f"report {searched.characteristic}")
    assert ("tool", f"{searched.machine}/3") in found(searched, "T3")
    assert ("tool", f"{searched.machine}/3") in found(searched, "tool 3")
    assert ("alarm", alarm) in found(searched, alarm)
    assert ("alarm", alarm) in found(searched, "worn")
    assert ("part", "Serial-0001") not in found(searched, "erial"), "parts are found by the beginning of their name"
    assert found(searched, "Serial-0") == [("part", "Serial-0001"), ("part", "Serial-0002")]
    assert found(searched, ODD) == [("part", ODD)]
    assert found(searched, "cpk") == [("page", "/overview")]
    assert found(searched, "probe calibration") == [("page", "/calibration")]
    assert found(searched, "%") == [("page", "/gauges")], "%GRR, and no wildcard"
    for nothing in ("_", "zzzz", "9" * 60):
        assert found(searched, nothing) == []


def test_rights(searched: Shop, server: Server) -> None:
    assert ("page", "/setup/people") in found(searched, "people")
    assert ("page", "/setup/people") not in found(searched, "people", server.client(server.key("viewer")))
    assert searched.machine_client.get("/api/v1/search?q=a").status_code == 403
    assert searched.admin.get("/api/v1/search").status_code == 422
    assert searched.admin.get("/api/v1/search?q=a%00").status_code == 422


def test_the_page_of_a_part(searched: Shop, viewer: Person) -> None:
    (item,) = searched.call("GET", "/search?q=Serial-0001")["items"]
    text = viewer.open(item["path"])
    readings = re.findall(r'class="row-name" href="(/characteristics/[^"]+/readings/\d+)"', text)
    assert readings == [f"/characteristics/{searched.characteristic}{b}/readings/1" for b in ("-b", "")]
    assert "Pending" in text or "Superseded" in text, "the page says what became of the correction"
    for path in readings:
        viewer.open(path)
    number = searched.correction(1)["number"]
    searched.correction(number, "applied", offset_after=-0.006)
    assert "offset then −0.0060 mm" in viewer.open(item["path"])
    answer = searched.admin.get("/api/v1/search", params={"q": ODD})
    assert "Nothing was measured" not in viewer.open(answer.json()["items"][0]["path"])
    assert viewer.open("/parts/Serial-0001") == text or "Serial-0001" in viewer.open("/parts/Serial-0001")
    assert "Nothing was measured" in viewer.open("/parts?part=serial-0001")
    viewer.open("/parts?part=" + "x" * 129, 422)


def test_the_page_of_results_works_without_script(searched: Shop, viewer: Person) -> None:
    text = viewer.open(f"/search?q={searched.machine}")
    assert f'href="/machines/{searched.machine}"' in text
    assert 'action="/search"' in text
    assert "Nothing is called that" in viewer.open("/search?q=zzzz")


ONCE_MORE = """() => {
    const box = document.querySelector("search-box");
    box.querySelector("[role=option]").dataset.before = "the next answer";
    box.querySelector("input").dispatchEvent(new Event("input"));
}"""
"""The answer to what is typed comes once more, late."""


@pytest.mark.browser
def test_by_keyboard(searched: Shop, viewer: Person, page: Page) -> None:
    viewer.sign_in(page)
    page.goto("/overview")
    field = page.get_by_role("combobox", name="Search")
    page.keyboard.press("/")
    expect(field).to_be_focused()
    page.keyboard.type("Serial-0")
    options = page.get_by_role("option")
    expect(options).to_have_count(2)
    page.keyboard.press("Escape")
    expect(options).to_have_count(0)
    expect(field).to_be_focused()
    page.keyboard.press("Escape")
    expect(field).not_to_be_focused()
    page.keyboard.press("/")
    expect(options).to_have_count(2)
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowDown")
    expect(options.nth(1)).to_have_attribute("aria-selected", "true")
    page.evaluate(ONCE_MORE)
    expect(page.locator("[data-before]")).to_have_count(0)
    expect(options.nth(1)).to_have_attribute("aria-selected", "true")
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", name="Part Serial-0002")).to_be_visible()
    page.wait_for_load_state()  # the script that hears keys
    page.keyboard.press("/")
    page.keyboard.type(searched.machine)
    page.keyboard.press("Enter")
    page.wait_for_url("**/search?q=*")
    page.get_by_role("link", name=re.compile("^Lathe")).first.click()
    page.wait_for_url(f"**/machines/{searched.machine}")
