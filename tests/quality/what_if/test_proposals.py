"""The life of a proposed change: by programs, by people without scripts, and as a story in a browser."""

import re
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import psycopg
import pytest
from playwright.sync_api import Page, expect

from tests.quality.closed_loop import cut, scatter
from tests.servers import Server
from tests.shop import Person, Shop
from tests.waits import until

WHY = "Ana said: „Nula je premala“ & R33 < scatter; half the corrections"


@pytest.fixture
def ran(shop: Shop) -> Shop:
    """A loop that corrects too often."""
    changed = {"zero_range": 0.0003, "weighting_factor": 1}
    shop.call("PATCH", f"/characteristics/{shop.characteristic}", parameters=changed, reason="As found")
    cut(shop, scatter(36))
    return shop


def propose(shop: Shop, status: int = 201, **more: Any) -> Any:
    path = f"/characteristics/{shop.characteristic}/proposals"
    settings: dict[str, Any] = {"zero_range": 0.0025, "weighting_factor": 2, "reason": WHY}
    return shop.call("POST", path, status, **(settings | more))


def decide(shop: Shop, number: int, verb: str, status: int = 200, **who: Any) -> Any:
    return shop.call("POST", f"/proposals/{number}/{verb}", status, reason="Looked at the evidence", **who)


def current(shop: Shop) -> dict[str, Any]:
    found: dict[str, Any] = shop.call("GET", f"/characteristics/{shop.characteristic}")
    return found


def test_a_proposal_changes_nothing_until_it_is_approved(ran: Shop) -> None:
    before = current(ran)
    made = propose(ran)
    assert (made["status"], made["from_version"], made["reason"]) == ("open", 2, WHY)
    assert made["changes"] == {"zero_range": 0.0025, "weighting_factor": 2.0}
    evidence = made["evidence"]
    assert evidence["other"]["corrections"] < evidence["today"]["corrections"]
    assert evidence["measured_effect"]["text"]
    assert current(ran) == before

    approved = decide(ran, made["id"], "approve")
    assert (approved["status"], approved["made_version"]) == ("approved", 3)
    assert approved["evidence"] == evidence
    after = current(ran)
    assert (after["parameters_version"], after["parameters"]["zero_range"]) == (3, 0.0025)
    audit = ran.call("GET", f"/audit?subject=characteristic/{ran.characteristic}")["items"]
    reasons = {each["action"]: each["why"] for each in reversed(audit)}
    assert reasons["change proposed"] == WHY
    assert reasons["proposal approved"] == "Looked at the evidence"
    assert reasons["parameters changed"].startswith("Looked at the evidence")
    assert WHY in reasons["parameters changed"]


def test_what_is_proposed_twice_or_changes_nothing_is_refused(ran: Shop) -> None:
    made = propose(ran)
    assert str(made["id"]) in propose(ran, 409)["detail"]
    assert "already in force" in propose(ran, 422, zero_range=0.0003, weighting_factor=1)["detail"]
    assert propose(ran, zero_range=0.002)["id"] > made["id"]
    assert [each["field"] for each in propose(ran, 422, zero_range=0.003, reason="  ")["errors"]] == ["reason"]
    assert len(ran.call("GET", f"/characteristics/{ran.characteristic}/proposals?status=open")["items"]) == 2


def test_changed_parameters_make_it_outdated(ran: Shop) -> None:
    made = propose(ran)
    path = f"/characteristics/{ran.characteristic}"
    ran.call("PATCH", path, parameters={"zero_range": 0.0005}, reason="Meanwhile")
    assert ran.call("GET", f"/proposals/{made['id']}")["status"] == "outdated"
    assert "version 3 is in force" in decide(ran, made["id"], "approve", 409)["detail"]
    assert current(ran)["parameters"]["zero_range"] == 0.0005
    assert ran.call("GET", "/proposals?status=outdated&limit=1")["items"][0]["id"] == made["id"]
    assert decide(ran, made["id"], "reject")["status"] == "rejected"


@pytest.mark.parametrize("verb", ["approve", "reject", "withdraw"])
def test_it_is_decided_once(ran: Shop, verb: str) -> None:
    made = propose(ran)
    assert decide(ran, made["id"], verb)["decided_why"] == "Looked at the evidence"
    for again in ("approve", "reject", "withdraw"):
        assert "already" in decide(ran, made["id"], again, 409)["detail"]
    assert current(ran)["parameters_version"] == (3 if verb == "approve" else 2)


def test_who_may_do_what(ran: Shop, server: Server) -> None:
    viewer, operator = (server.client(server.key(role)) for role in ("viewer", "operator"))
    propose(ran, 403, client=viewer)
    made = propose(ran, client=operator)
    for verb in ("approve", "reject"):
        decide(ran, made["id"], verb, 403, client=operator)
    decide(ran, made["id"], "withdraw", 403, client=viewer)
    propose(ran, 403, client=ran.machine_client)
    ana, ivo = Person(server, "operator"), Person(server, "operator")
    ivo.send(f"/proposals/{made['id']}", 403, do="withdraw", reason="Not mine")
    page = ana.send(f"/characteristics/{ran.characteristic}/what-if", r33="2,5", k="3", last="5000", reason="Mine")
    assert "is proposed" in page
    assert "Withdraw" in page
    assert "Approve</button>" not in page


def test_of_two_at_once_one_is_first(ran: Shop, server: Server) -> None:
    clients = [server.client(server.key("engineer")) for _each in range(4)]
    body = {"zero_range": 0.0025, "reason": WHY}
    path = f"/api/v1/characteristics/{ran.characteristic}/proposals"
    with ThreadPoolExecutor(4) as pool:
        sent = list(pool.map(lambda client: client.post(path, json=body), clients))
        assert sorted(each.status_code for each in sent) == [201, 409, 409, 409]
        (made,) = [each.json()["id"] for each in sent if each.status_code == 201]
        at = f"/api/v1/proposals/{made}/approve"
        decided = list(pool.map(lambda client: client.post(at, json={"reason": "Yes"}), clients))
    assert sorted(each.status_code for each in decided) == [200, 409, 409, 409]
    assert current(ran)["parameters_version"] == 3


def waiting(server: Server) -> int:
    """How many wait for a lock."""
    with psycopg.connect(server.database.dsn) as looking:
        (found,) = looking.execute(
            "SELECT count(*) FROM pg_stat_activity WHERE datname = current_database() AND wait_event_type = 'Lock'"
        ).fetchall()[0]
    return int(found)


@pytest.mark.several_connections
def test_what_one_approves_another_cannot_reject_at_the_same_moment(ran: Shop, server: Server) -> None:
    made = propose(ran)
    client = server.client(server.key("engineer"))

    def send(verb: str) -> int:
        path = f"/api/v1/proposals/{made['id']}/{verb}"
        answer: int = client.post(path, json={"reason": verb}, timeout=30).status_code
        return answer

    with psycopg.connect(server.database.dsn) as holding, ThreadPoolExecutor(4) as pool:
        holding.execute("SELECT 1 FROM machine_state FOR UPDATE")
        sent = [pool.submit(send, verb) for verb in ("approve", "reject", "reject", "approve")]
        until(lambda: waiting(server) >= len(sent))  # all of them have looked
        holding.rollback()
        answers = [each.result() for each in sent]
    assert sorted(answers) == [200, 409, 409, 409]
    found = ran.call("GET", f"/proposals/{made['id']}")
    assert (found["status"] == "approved") == (current(ran)["parameters_version"] == found["from_version"] + 1)


def test_a_form_keeps_what_was_typed(ran: Shop, server: Server) -> None:
    engineer = Person(server, "engineer")
    path = f"/characteristics/{ran.characteristic}/what-if"
    page = engineer.open(f"{path}?r33=9&k=many&last=5000", 422)
    assert 'value="many"' in page
    assert 'value="9"' in page
    assert 'aria-invalid="true"' in page
    page = engineer.send(path, 422, r33="2.5", last="5000", reason="")
    assert 'value="2.5"' in page
    made = propose(ran)
    page = engineer.send(f"/proposals/{made['id']}", 422, do="approve", reason=" ")
    assert "Approve</button>" in page
    assert current(ran)["parameters_version"] == 2
    assert "approve, reject or withdraw" in engineer.send(f"/proposals/{made['id']}", 422, do="", reason="x")


def test_it_is_shown_where_decisions_wait_and_where_parameters_are_set_up(ran: Shop, server: Server) -> None:
    engineer = Person(server, "engineer")
    made = propose(ran)
    assert "proposed" in engineer.open("/corrections")
    setup = engineer.open(f"/setup/characteristics/{ran.characteristic}")
    assert f"/proposals/{made['id']}" in setup
    assert "Nula je premala" in setup
    assert f"/proposals/{made['id']}" in engineer.open("/proposals")
    decide(ran, made["id"], "reject")
    assert f"/proposals/{made['id']}" not in engineer.open(f"/setup/characteristics/{ran.characteristic}")
    assert f"/proposals/{made['id']}" in engineer.open("/proposals?status=rejected")


def test_from_the_map_to_a_new_version(ran: Shop, server: Server, page: Page) -> None:
    """An engineer looks for fewer corrections, walks the map by keyboard, proposes a setting and approves it."""
    engineer = Person(server, "engineer")
    engineer.sign_in(page)
    page.goto(f"/characteristics/{ran.characteristic}")
    page.get_by_role("navigation", name="Pages of this characteristic").get_by_role("link", name="What if").click()
    expect(page.get_by_text("Do corrections act in full?")).to_be_visible()
    expect(page.locator("setting-map .at-today")).to_have_count(1)
    expect(page.locator("setting-map td a").nth(30)).to_be_visible()

    page.get_by_role("navigation", name="Goal").get_by_role("link", name="Corrections").click()
    expect(page.locator("a[data-chosen]")).to_be_focused()  # today's, as nothing else is chosen yet
    today = page.locator("a[data-chosen]").get_attribute("aria-label") or ""
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowUp")
    focused = page.locator("setting-map a:focus")
    chosen = focused.get_attribute("aria-label") or ""
    assert chosen != today
    assert page.locator("setting-map a[tabindex='0']").count() == 1
    page.keyboard.press("Enter")
    expect(page.locator("a[data-chosen]")).to_have_attribute("aria-label", chosen)
    expect(page.get_by_role("columnheader", name="Selected settings")).to_be_visible()

    cell = page.locator("setting-map td a[title^='k 2, R33 ±2']").first
    title = cell.get_attribute("title") or ""
    assert re.search(r" of \d+ readings, \d+ to \d+", title)
    cell.click()
    expect(page.locator("a[data-chosen]")).to_have_attribute("title", title)
    page.get_by_label("Reason").fill(WHY)
    page.get_by_role("button", name="Propose the change").click()
    expect(page.get_by_text("The change is proposed.")).to_be_visible()
    expect(page.get_by_text(WHY)).to_be_visible()

    page.goto("/corrections")
    page.get_by_role("link", name="Look at the evidence").click()
    page.get_by_role("row", name=ran.characteristic).get_by_role("link").first.click()
    page.get_by_label("Reason").fill("Agreed with the shop floor")
    page.get_by_role("button", name="Approve").click()
    expect(page.get_by_text("in force as a new version")).to_be_visible()
    page.get_by_role("link", name="version 3").click()
    expect(page.locator("#versions")).to_contain_text("Agreed with the shop floor")
    assert current(ran)["parameters"]["weighting_factor"] == 2.0


def test_no_cell_needs_a_script(ran: Shop, server: Server) -> None:
    engineer = Person(server, "engineer")
    path = f"/characteristics/{ran.characteristic}/what-if"
    text = engineer.open(path)
    assert text.count("<td data-level") > 200
    assert f'href="{path}?k=2&amp;r33=' in text
