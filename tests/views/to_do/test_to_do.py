"""What waits for a person: one list, one count, wherever it stands."""

import re
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.servers import Server
from tests.shop import Person, Shop

pytestmark = pytest.mark.own_server


@pytest.fixture(scope="module")
def waits(common_shop: Shop) -> Shop:
    """An alarm that holds a correction, a correction that awaits approval, and a proposal."""
    shop = common_shop
    shop.push([0.4, 0.0, 0.2, 350.0])
    shop.add(f"{shop.characteristic}-a", tool_memory=5, average_memory=6, mode="approval")
    shop.read(6.0, f"{shop.characteristic}-a")
    shop.call(
        "POST", f"/characteristics/{shop.characteristic}/proposals", 201, zero_range=0.002, reason="Fewer corrections"
    )
    return shop


def counted(text: str) -> int:
    found = re.search(r'data-to-do="(\d+)"', text)
    assert found is not None
    return int(found[1])


def kinds(text: str) -> list[str]:
    return re.findall(r'<tr data-kind="(\w+)"', text)


def test_the_count_is_the_length_of_the_list_wherever_it_stands(waits: Shop, operator: Person) -> None:
    page = operator.open("/todo")
    assert kinds(page) == ["alarm", "correction", "proposal"], "a held correction belongs to its alarm"
    assert counted(page) == counted(operator.open("/todo/count")) == counted(operator.open("/")) == 3


def test_by_machine_and_by_role(
    waits: Shop, server: Server, operator: Person, engineer: Person, viewer: Person
) -> None:
    other = Shop(server)
    assert kinds(operator.open(f"/todo?machine={other.machine}")) == []
    assert len(kinds(operator.open(f"/todo?machine={waits.machine}"))) == 3
    assert kinds(operator.open("/todo?mine=true")) == ["alarm", "correction"]
    assert len(kinds(engineer.open("/todo?mine=true"))) == 3
    assert kinds(viewer.open("/todo?mine=true")) == []
    operator.open("/todo?machine=nowhere", 404)
    assert re.findall(r">(All|Mine) (\d+)</a>", operator.open("/todo")) == [("All", "3"), ("Mine", "2")]


def test_machines_and_pickers_have_the_same_count(waits: Shop, server: Server, operator: Person) -> None:
    Shop(server)  # a picker stands where there is something to pick
    link = re.escape(f'href="/todo?machine={waits.machine}"') + "[^>]*>"
    assert re.search(link + r"\s*<svg.*?</svg>\s*3</a>", operator.open("/machines"), re.DOTALL)
    assert re.search(link + r'[^<]*<span class="tab-count">3</span>', operator.open("/todo"))


@pytest.mark.long
def test_the_chosen_machine_is_carried_along(waits: Shop, operator: Person) -> None:
    def links(text: str) -> list[str]:
        return re.findall(r'<li>\s*<a href="([^"]*)"', text.split('aria-label="Main"')[1])[:5]

    key = waits.machine
    whole = ["/", "/todo", "/overview", "/machines", "/setup"]
    chosen = [
        "/",
        f"/todo?machine={key}",
        f"/overview?machine={key}",
        f"/machines/{key}",
        f"/setup/characteristics?machine={key}",
    ]
    assert links(operator.open("/alarms")) == whole
    for path in ("/alarms", "/gauges", "/proposals"):
        assert links(operator.open(f"{path}?machine={key}")) == chosen
    assert links(operator.open(f"/machines/{key}/tools")) == [*chosen[:3], "/machines", chosen[4]], "back to the list"
    assert links(operator.open("/machines/nowhere", 404)) == whole
    assert f'href="/gauges?machine={key}"' in operator.open(f"/overview?machine={key}")
    proposals = operator.open(f"/proposals?machine={key}")
    assert "Fewer corrections" in proposals
    assert f'href="/todo?machine={key}"' in proposals
    for path in chosen:
        operator.open(path)


def test_each_leads_to_its_next_action(waits: Shop, engineer: Person) -> None:
    for path in re.findall(
        r'<a class="button " href="(/(?:alarms|corrections|proposals)[^"]+)"', engineer.open("/todo")
    ):
        engineer.open(path)


def test_a_correction_is_decided_from_its_row(waits: Shop, operator: Person, viewer: Person) -> None:
    waits.add(f"{waits.characteristic}-row", tool_memory=7, average_memory=8, mode="approval")
    number = waits.read(6.0, f"{waits.characteristic}-row")["correction"]["number"]
    here = f"/machines/{waits.machine}/corrections/{number}"
    assert f'href="{here}?do=approve&amp;from=todo"' in operator.open("/todo")
    assert f'href="{here}?do=approve' not in viewer.open("/todo")
    fields: dict[str, Any] = {"do": "approve", "reason": "As expected", "from": "todo"}
    assert f"Correction {number} is approved" in operator.send(here, **fields)
    fields["do"] = "rejected"
    waits.correction(number, "applied")
    assert "someone else had already decided" in operator.send(here, **fields)


def test_the_count_in_the_bar_follows_proposals(page: Page, waits: Shop, engineer: Person) -> None:
    engineer.sign_in(page)
    page.goto("/machines")
    expect(page.locator("live-status")).to_have_attribute("state", "live")
    before = counted(engineer.open("/todo/count"))
    count = page.locator("#to-do-count [data-to-do]")
    expect(count).to_have_attribute("data-to-do", str(before))
    proposal = waits.call(
        "POST", f"/characteristics/{waits.characteristic}/proposals", 201, zero_range=0.003, reason="Fewer still"
    )
    expect(count).to_have_attribute("data-to-do", str(before + 1))
    waits.call("POST", f"/proposals/{proposal['id']}/reject", reason="Too wide")
    expect(count).to_have_attribute("data-to-do", str(before))
    page.goto("/todo")
    expect(page.locator("live-status")).to_have_attribute("state", "live")
    expect(page.get_by_role("link", name=f"All {before}")).to_be_visible()
    again = waits.call(
        "POST", f"/characteristics/{waits.characteristic}/proposals", 201, zero_range=0.003, reason="Few"
    )
    expect(page.get_by_role("link", name=f"All {before + 1}")).to_be_visible()
    waits.call("POST", f"/proposals/{again['id']}/reject", reason="Too wide")
    expect(page.get_by_role("link", name=f"All {before}")).to_be_visible()


@pytest.mark.browser
@pytest.mark.parametrize("picker", [".picker", ".period-picker"])
def test_a_picker_is_closed_by_escape_and_by_a_click_beside_it(
    picker: str, page: Page, waits: Shop, server: Server, viewer: Person
) -> None:
    Shop(server)
    viewer.sign_in(page)
    page.goto(f"/characteristics/{waits.characteristic}" if picker == ".period-picker" else "/alarms")
    opened = page.locator(f"details{picker}[open]")
    expect(page.locator("live-status")).to_have_attribute("state", "live")
    for close in ("Escape", "a click beside"):
        page.locator(f"{picker} > summary").click()
        expect(opened).to_have_count(1)
        if close == "Escape":
            page.keyboard.press(close)
        else:
            page.locator("h1").click()
        expect(opened).to_have_count(0)


def test_old_addresses_lead_on(waits: Shop, operator: Person) -> None:
    assert "Machines" in operator.open("/tools")
    for path in ("/alarms", "/corrections", "/proposals", "/alarms/history"):
        text = operator.open(path)
        assert "<h1>" in text
        assert re.search(r'<a href="/todo" aria-current="true">', text)
