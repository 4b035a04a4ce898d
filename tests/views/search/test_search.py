"""One search for all that has a name, over REST, as a page, and with suggestions in the browser."""

import re
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.servers import Server
from tests.shop import Person, Shop, unique

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
    assert ("part", "Serial-0001") not in found(searched, "erial"), (
        "parts are found by the beginning or the end of their name"
    )
    assert found(searched, "0002") == [("part", "Serial-0002")]
    assert ("part", "Serial-0002") in found(searched, "002"), "shorter than the index knows"
    assert ("part", "Serial-0002") in found(searched, "AL-0002"), "in other letters"
    assert found(searched, "Serial-0")[:2] == [("part", "Serial-0001"), ("part", "Serial-0002")]
    assert found(searched, ODD) == [("part", ODD)]
    assert found(searched, "cpk")[0] == ("help", "/help/reference/glossary#term-cpk")
    assert ("page", "/overview") in found(searched, "cpk")
    assert ("page", "/calibration") in found(searched, "probe calibration")
    assert found(searched, "%") == [("page", "/gauges")], "%GRR, and no wildcard"
    for nothing in ("_", "zzzz", "9" * 60):
        assert found(searched, nothing) == []


def test_as_people_type_it(searched: Shop) -> None:
    number = searched.machine.removeprefix("lathe-")
    key = searched.another("seat", tool_memory=7)
    searched.call("PATCH", f"/machines/{searched.machine}/tools/7", name="Finishing tool")
    searched.call("PATCH", f"/characteristics/{key}", name="Bearing seat Ø40 h6")
    bore = searched.another("bore", tool_memory=0, average_memory=0)
    searched.call("PATCH", f"/characteristics/{bore}", name="Bore Ø30 H7")
    for typed in ("bore 30", "BORE Ø30", "30 bore", "bore30", f"bore 30 lathe{number}", bore.replace("-", "")):
        assert found(searched, typed)[0] == ("characteristic", bore), typed
    for typed in ("seat 40", "bearing seat 40", "seat h6"):
        assert found(searched, typed)[0] == ("characteristic", key), typed
    assert ("report", bore) in found(searched, "report bore 30")
    for typed in (f"lathe{number}", f"Lathe {number}", f"LATHE-{number}"):
        assert found(searched, typed)[0] == ("machine", searched.machine), typed
    for typed in (f"t7 lathe{number}", f"lathe {number} tool 7", "finishing", f"finishing lathe{number}"):
        assert ("tool", f"{searched.machine}/7") in found(searched, typed), typed
    alarm = str(searched.alarms()[0]["id"])
    assert ("alarm", alarm) in found(searched, f"worn lathe{number}")
    assert ("alarm", alarm) not in found(searched, "worn mill-99")
    assert ("help", "/help/how-to/run-rules") in found(searched, "switch rules")
    assert ("help", "/help/how-to/back-up") in found(searched, "restore back-up")
    assert ("page", "/help") in found(searched, "manual")


def test_rights(searched: Shop, server: Server) -> None:
    assert ("page", "/setup/people") in found(searched, "people")
    assert ("page", "/setup/people") not in found(searched, "people", server.client(server.key("viewer")))
    person = Person(server, "viewer")
    assert found(searched, person.name.upper())[0] == ("person", person.name)
    assert ("person", person.name) not in found(searched, person.name, person.browser)
    engineer = Person(server, "engineer")
    assert ("person", person.name) in found(searched, person.name, engineer.browser)
    assert f"/setup/audit?actor={person.name}" in engineer.open(f"/search?q={person.name}")
    assert person.name in engineer.open(f"/setup/audit?actor={person.name}")
    assert searched.machine_client.get("/api/v1/search?q=a").status_code == 403
    assert searched.admin.get("/api/v1/search").status_code == 422
    assert searched.admin.get("/api/v1/search?q=a%00").status_code == 422


def test_the_page_of_a_part(searched: Shop, viewer: Person) -> None:
    (item,) = searched.call("GET", "/search?q=Serial-0001")["items"]
    text = viewer.open(item["path"])
    readings = re.findall(r'class="row-name" href="(/characteristics/[^"]+/readings/\d+)"', text)
    assert readings == [f"/characteristics/{searched.characteristic}{b}/readings/1" for b in ("-b", "")]
    assert "Pending" in text or "Superseded" in text, "the page says what became of the correction"
    assert text.count('class="tolerance-bar"') == 2
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


def test_without_a_name_the_parts_measured_last_are_listed(server: Server, viewer: Person) -> None:
    shop, part = Shop(server), unique("Last")
    shop.read(6.0, part=part)
    shop.read(0.5, part=part)
    text = viewer.open("/parts")
    (row,) = re.findall(rf'<tr data-key="{part}".*?</tr>', text, re.DOTALL)
    assert f'href="/parts?part={part}"' in row
    assert "Full" in row, "the worst of its zones"
    assert f'placeholder="{part}"' in text, "an example of the plant's own"
