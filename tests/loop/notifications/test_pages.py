"""The pages of notifications, as an administrator works them, and everybody their own."""

import re
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from app.loop.notifications.tables import Delivery, Receiver
from tests.servers import Server
from tests.shop import Person, Shop, unique


@pytest.fixture(scope="module")
def admin(server: Server) -> Person:
    return Person(server, "admin")


def receiver_named(shop: Shop, name: str) -> Any:
    items = shop.call("GET", "/notifications/receivers?limit=1000")["items"]
    return next((each for each in items if each["name"] == name), None)


def added(shop: Shop, admin: Person, **more: str) -> Any:
    name = unique("Anna")
    fields: dict[str, Any] = {
        "name": name,
        "means": "mail",
        "address": "anna@example.com",
        "quiet-begins": "",
        "quiet-ends": "",
    }
    admin.send("/setup/notifications/receivers", **fields | more)
    return receiver_named(shop, name)


def test_a_receiver_is_added_tested_and_its_delivery_is_seen(shop: Shop, admin: Person, page: Page) -> None:
    name = unique("Anna")
    admin.sign_in(page)
    page.goto("/setup/notifications")
    page.get_by_label("Name", exact=True).fill(name)
    page.get_by_label("Address", exact=True).fill("anna@example.com")
    page.get_by_role("button", name="Add receiver").click()
    expect(page.get_by_role("status").filter(has_text="Added.")).to_be_visible()
    row = page.locator("#receivers tr").filter(has_text=name)
    row.get_by_role("button", name="Send a test").dispatch_event("click")  # in one step: the part may be swapped
    expect(page.get_by_role("status").filter(has_text="A test is sent within seconds")).to_be_visible()
    delivery = page.locator("#delivery-list tr").filter(has_text=name)
    expect(delivery).to_contain_text("INBAND_MAIL_SERVER")  # of this server, which has none; it comes by itself
    expect(row).to_contain_text("1 failure")


def test_changes_that_were_taken_hide_no_delivery(shop: Shop, admin: Person) -> None:
    """An andon takes one every few seconds; whether a mail has arrived must still be seen."""
    name = unique("andon")
    with shop.server.database.begin() as session:
        row = Receiver(name=name, means="webhook", address="http://127.0.0.1:9/", created_by="tests")
        session.add(row)
        session.flush()
        for about, state, subject in (
            ("alarms", "delivered", "Oversize"), ("changes", "failed", "7 changes"), ("changes", "delivered", "9 changes")
        ):  # fmt: skip
            session.add(Delivery(receiver_id=row.id, about=about, subject=f"{subject} {name}", state=state))
    page = admin.open("/setup/notifications")
    assert f"Oversize {name}" in page
    assert f"7 changes {name}" in page
    assert f"9 changes {name}" not in page
    assert f"9 changes {name}" in admin.open("/setup/notifications?show=all")


def test_a_route_is_made_changed_and_deleted(shop: Shop, admin: Person) -> None:
    anna, name = added(shop, admin), unique("Night")
    step: dict[str, Any] = {f"step-1-{anna['id']}": "true", "after-1": "0"}
    fields: dict[str, Any] = {
        "name": name,
        "enabled": "true",
        "kind-tool_worn": "true",
        "tone-stop": "true",
        "machines": f" {shop.machine}, ",
        "hours-begins": "22:00",
        "hours-ends": "06:00",
        "day-1": "true",
        "day-2": "true",
        "repeat": "10",
        "hold_off": "5",
        "digest": "",
    }
    text = admin.send("/setup/notifications/routes/new", 422, **fields)
    assert "steps" in text or "Is missing" in text or "at least" in text.lower()
    text = admin.send("/setup/notifications/routes/new", **fields | step)
    assert name in text
    assert "Mon, Tue 22:00–06:00" in text
    (made,) = [each for each in shop.call("GET", "/notifications/routes?limit=1000")["items"] if each["name"] == name]
    assert made["hours"] == [{"days": [1, 2], "begins": "22:00", "ends": "06:00"}]
    assert (made["machines"], made["kinds"], made["tones"]) == ([shop.machine], ["tool_worn"], ["stop"])
    assert (made["on_days_off"], made["repeat"], made["digest"]) == (False, 10, 0)
    path = f"/setup/notifications/routes/{made['id']}"
    form = admin.open(path)
    ticked = re.findall(r'name="([\w-]+)" value="true" checked', form)
    assert set(ticked) == {"enabled", "kind-tool_worn", "tone-stop", "day-1", "day-2", f"step-1-{anna['id']}"}
    assert "names this receiver" in admin.send(f"/setup/notifications/receivers/{anna['id']}/delete", 409)
    assert "there is no machine" in admin.send(path, 422, **fields | step | {"machines": "nowhere"}).lower()
    admin.send(path, **fields | step | {"repeat": "20"})
    assert shop.call("GET", f"/notifications/routes/{made['id']}")["repeat"] == 20
    admin.send(path, do="delete")
    shop.call("GET", f"/notifications/routes/{made['id']}", 404)
    admin.send(f"/setup/notifications/receivers/{anna['id']}/delete")
    assert receiver_named(shop, anna["name"]) is None


def test_a_route_that_the_form_cannot_hold_is_not_shortened_by_it(shop: Shop, admin: Person) -> None:
    anna = added(shop, admin)
    steps = [{"after": minutes, "receivers": [anna["id"]], "groups": [], "on_duty": []} for minutes in range(5)]
    body: dict[str, Any] = {"name": unique("Long"), "machines": [shop.machine], "steps": steps}
    made = shop.call("POST", "/notifications/routes", 201, **body)
    path = f"/setup/notifications/routes/{made['id']}"
    assert "Change it by REST" in admin.open(path)
    step: dict[str, Any] = {f"step-1-{anna['id']}": "true"}
    admin.send(path, 409, name="Short", **step)
    assert shop.call("GET", f"/notifications/routes/{made['id']}")["steps"] == steps


def test_the_secret_of_a_webhook_is_shown_once(shop: Shop, admin: Person) -> None:
    name = unique("Andon")
    fields: dict[str, Any] = {
        "name": name,
        "means": "webhook",
        "address": "https://andon.example/x",
        "events-tool": "true",
    }
    text = admin.send("/setup/notifications/receivers", **fields)
    (secret,) = re.findall(r'<code id="webhook-secret">([\w-]{43})</code>', text)
    assert secret not in admin.open("/setup/notifications")
    made = receiver_named(shop, name)
    assert made["events"] == ["tool"]
    admin.send(f"/setup/notifications/receivers/{made['id']}/delete")  # other tests of this server change tools
    bad = admin.send("/setup/notifications/receivers", 422, **fields | {"address": "ftp://andon"})
    assert "Must be an address such as https://" in bad


def test_everybody_says_where_they_get_mail(shop: Shop, server: Server) -> None:
    viewer = Person(server, "viewer")
    viewer.open("/setup/notifications", 403)
    fields: dict[str, Any] = {"address": f"{viewer.name}@example.com", "quiet-begins": "20:00", "quiet-ends": "06:00"}
    assert "Saved." in viewer.send("/account/notifications", **fields)
    mine = viewer.browser.get("/api/v1/notifications/me").json()
    assert not mine["shift_report"]
    viewer.send("/account/notifications", **fields, shift_report="true")
    assert viewer.browser.get("/api/v1/notifications/me").json()["shift_report"]
    assert "checked" in viewer.open("/account/notifications")
    assert mine["quiet"] == [{"days": [1, 2, 3, 4, 5, 6, 7], "begins": "20:00", "ends": "06:00"}]
    assert receiver_named(shop, viewer.name)["person"] == mine["person"]
    assert "Must be one mail address" in viewer.send("/account/notifications", 422, **fields | {"address": "anna"})
    viewer.send("/account/notifications", do="delete")
    assert receiver_named(shop, viewer.name) is None
    assert viewer.browser.get("/api/v1/notifications/me").status_code == 404


@pytest.mark.parametrize(
    ("page", "fields"), [("", {"address": "anna@example.com"}), ("/browser", dict[str, str]())], ids=["mail", "browser"]
)
def test_what_ones_own_form_does_not_hold_is_kept(server: Server, page: str, fields: dict[str, Any]) -> None:
    """Who is on holiday, and quiet at the weekend, is not called on Sunday because they ticked the report of the shift."""
    viewer, path = Person(server, "viewer"), f"/api/v1/notifications/me{page}"
    quiet = [{"days": [6, 7], "begins": "00:00", "ends": "00:00"}, {"days": [1, 2], "begins": "20:00", "ends": "06:00"}]
    given = fields | {"quiet": quiet, "away_until": "2099-01-01T00:00:00Z"}
    set_up = viewer.browser.put(path, json=given, headers={"X-CSRF-Token": viewer.csrf()}).json()
    text = viewer.open("/account/notifications")
    assert "Sat, Sun all day; Mon, Tue 20:00–06:00" in text
    assert re.search(r"Away until .*>1 Jan 2099", text)
    shown: dict[str, Any] = {"quiet-begins": "00:00", "quiet-ends": "00:00"}
    viewer.send(f"/account/notifications{page}", **fields | shown)
    kept = viewer.browser.get(path).json()
    assert (kept["quiet"], kept["away_until"]) == (set_up["quiet"], set_up["away_until"]) == (quiet, kept["away_until"])
    viewer.send(f"/account/notifications{page}", **fields | shown | {"quiet-begins": "21:00", "quiet-ends": "05:00"})
    changed = viewer.browser.get(path).json()
    assert (len(changed["quiet"]), changed["away_until"]) == (1, set_up["away_until"])


def test_a_refused_form_names_the_list_that_is_empty_and_the_day_that_is_none(admin: Person) -> None:
    assert "Steps: must have at least one entry" in admin.send("/setup/notifications/routes/new", 422, name="Nobody")
    assert "Members: must have at least one entry" in admin.send("/setup/notifications/groups/new", 422, name="Empty")
    page = admin.send("/setup/notifications/days-off", 422, country="", days="2026-12-24\n31.31.2026")
    assert "Must be a day, for example 2026-11-21" in page
