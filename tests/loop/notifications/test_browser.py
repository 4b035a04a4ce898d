"""Notifications in a person's browsers: what waits, who has shown it, and what a real browser does."""

from typing import Any

import pytest
from playwright.sync_api import BrowserContext, Page, expect
from sqlalchemy import select, text
from sqlalchemy.orm import Session

from app.access.callers import Caller
from app.access.tables import Person as PersonRow
from app.db.engine import Database
from app.loop.notifications import sending
from app.loop.notifications.browser_actions import set_browser, take
from app.loop.notifications.means import Job
from app.loop.notifications.queries import own
from app.loop.notifications.schemas import PageIn, RouteIn
from app.loop.notifications.tables import Delivery, NotificationRoute, Receiver
from app.settings import Settings
from tests.servers import Server
from tests.shop import Person, Shop, unique
from tests.waits import until

# --- one step at a time


def caller_named(session: Session, name: str) -> Caller:
    person = PersonRow(name=name, role="viewer", password_hash="-")
    session.add(person)
    session.flush()
    return Caller("person", name, role="viewer", person_id=person.id)


@pytest.fixture
def mia(database: Database) -> Caller:
    """Somebody whose browsers are notified of every alarm, and after them a mail address; one alarm is active."""
    with database.begin() as session:
        caller = caller_named(session, "Mia")
        row = set_browser(session, caller, Settings())
        mail = Receiver(name="Leader", means="mail", address="leader@example.com", created_by="tests")
        session.add(mail)
        session.flush()
        steps: Any = [{"receivers": [row.id]}, {"after": 60, "receivers": [mail.id]}]
        rule = RouteIn(name="All", steps=steps).model_dump(mode="json", exclude={"name", "enabled"})
        session.add(NotificationRoute(name="All", rule=rule, created_by="tests"))
        session.execute(text("INSERT INTO machine (key, name, control) VALUES ('m', 'M', 'other')"))
        session.execute(
            text("INSERT INTO alarm (machine_id, tool_memory, kind) SELECT id, 1, 'offset_limit' FROM machine")
        )
    return caller


def planned(database: Database) -> list[Job]:
    with database.begin() as session:
        return sending.plan(session, "http://inband.test", frozenset())


def taken(database: Database, caller: Caller, *shown: int) -> list[int]:
    with database.begin() as session:
        return [each.id for each in take(session, PageIn(shown=list(shown)), caller)]


def states(database: Database) -> list[str]:
    with database.begin() as session:
        return list(session.scalars(select(Delivery.state).order_by(Delivery.id)))


def late(database: Database) -> None:
    """Let the time go by in which a page has to show a message."""
    with database.begin() as session:
        session.execute(text("UPDATE receiver SET busy_until = busy_until - interval '11 seconds'"))


def test_a_message_waits_for_a_page_and_is_delivered_when_one_has_shown_it(database: Database, mia: Caller) -> None:
    assert planned(database) == [], "no server has to send it"
    (number,) = taken(database, mia)
    assert states(database) == ["sending"], "to fetch it is not yet to show it"
    assert taken(database, mia, number) == [number], "another browser of hers shows it too"
    assert states(database) == ["delivered"]
    late(database)
    assert planned(database) == [], "neither late nor sent again"
    assert states(database) == ["delivered"]


def test_nobody_else_gets_it_or_says_that_it_was_shown(database: Database, mia: Caller) -> None:
    with database.begin() as session:
        ben = caller_named(session, "Ben")
        set_browser(session, ben, Settings())
    planned(database)
    (number,) = taken(database, mia)
    assert taken(database, ben, number) == []
    assert taken(database, Caller("key", "erp", role="viewer"), number) == []
    assert states(database) == ["sending"]


def test_without_an_open_page_it_fails_and_the_next_step_begins(database: Database, mia: Caller) -> None:
    planned(database)
    late(database)
    (job,) = planned(database)
    assert job.address == "leader@example.com"
    with database.begin() as session:
        (failed,) = session.scalars(select(Delivery).where(Delivery.state == "failed"))
        assert failed.answer == "No open page of Inband has shown it."


def test_a_page_that_opens_ends_the_pause_after_failures(database: Database, mia: Caller) -> None:
    for _failure in range(5):
        with database.begin() as session:
            session.execute(text("UPDATE receiver SET retry_at = NULL"))
        planned(database)
        late(database)
    planned(database)
    assert states(database).count("sending") == 1, "the mail; the browsers pause"
    assert taken(database, mia) == []
    planned(database)
    assert len(taken(database, mia)) == 1


def test_one_that_was_shown_late_is_delivered(database: Database, mia: Caller) -> None:
    planned(database)
    (number,) = taken(database, mia)
    late(database)
    planned(database)
    taken(database, mia, number)
    assert states(database)[0] == "delivered"
    with database.begin() as session:
        row = own(session, mia.person_id, "browser")
        assert row is not None
        assert row.failures == 0


def test_a_mail_address_and_browsers_are_two_receivers_of_one_person(server: Server) -> None:
    viewer = Person(server, "viewer")
    viewer.send("/account/notifications", address=f"{viewer.name}@example.com")
    assert "Your browsers show notifications." in viewer.send("/account/notifications/browser")
    path = "/api/v1/notifications/me/browser"
    mail, mine = (viewer.browser.get(each).json() for each in ("/api/v1/notifications/me", path))
    assert (mail["means"], mine["means"], mine["address"], mine["person"]) == ("mail", "browser", "", mail["person"])
    quiet: dict[str, Any] = {"quiet-begins": "20:00", "quiet-ends": "06:00"}
    viewer.send("/account/notifications/browser", **quiet)
    assert viewer.browser.get(path).json()["quiet"][0]["begins"] == "20:00"
    assert viewer.browser.get("/api/v1/notifications/me").json()["quiet"] == []
    assert (
        "must be a time" in viewer.send("/account/notifications/browser", 422, **quiet | {"quiet-begins": "25"}).lower()
    )
    viewer.send("/account/notifications/browser", do="delete")
    assert viewer.browser.get(path).status_code == 404
    assert viewer.browser.get("/api/v1/notifications/me").status_code == 200


def test_an_address_does_not_fit_browsers_and_a_key_has_none(shop: Shop, server: Server) -> None:
    viewer = Person(server, "viewer")
    viewer.send("/account/notifications/browser")
    number = viewer.browser.get("/api/v1/notifications/me/browser").json()["id"]
    path = f"/notifications/receivers/{number}"
    assert "fetches" in shop.call("PATCH", path, 422, address="https://andon.example")["detail"]
    body: dict[str, Any] = {"name": "Screen", "means": "browser", "address": "anywhere"}
    shop.call("POST", "/notifications/receivers", 422, **body)
    shop.call("PUT", "/notifications/me/browser", 404, quiet=[])
    assert shop.call("POST", "/notifications/me/browser/messages", shown=[1]) == {"items": []}


# --- in a browser

STUB = """
window.notices = [];
window.Notification = class {
  static permission = localStorage.getItem("permission") ?? "default";
  static async requestPermission() {
    const answer = localStorage.getItem("will answer") ?? "granted";
    localStorage.setItem("permission", answer);
    return Notification.permission = answer;
  }
  constructor(title, options) {
    window.notices.push({ title, ...options });
    window.newest = this;
    queueMicrotask(() => this.onshow?.());
  }
  close() {}
};
"""
"""Notifications that no desktop is needed for; what the person permitted stays for all pages of the browser."""
BUTTON = "Notify me in this browser"


def notified(context: BrowserContext) -> list[Any]:
    """What all pages of a browser have shown."""
    return [each for page in context.pages for each in page.evaluate("window.notices")]


def test_an_alarm_is_shown_once_in_a_browser_that_permits_it(shop: Shop, server: Server, page: Page) -> None:
    operator = Person(server, "operator")
    operator.sign_in(page)
    page.context.add_init_script(STUB)
    page.goto("/account/notifications")
    page.get_by_role("button", name=BUTTON).click()
    expect(page.get_by_role("status").filter(has_text="This browser shows them")).to_be_visible()
    expect(page.get_by_role("button", name=BUTTON)).to_be_hidden()
    page.context.new_page().goto("/account/notifications")  # a second tab
    number = operator.browser.get("/api/v1/notifications/me/browser").json()["id"]
    rule: dict[str, Any] = {"machines": [shop.machine], "steps": [{"receivers": [number]}]}
    shop.call("POST", "/notifications/routes", 201, name=unique("route"), **rule)
    shop.read(350)
    expect(page.locator("#last-notification")).to_contain_text("delivered. A page of Inband has shown it.")
    (alarm,) = shop.call("GET", f"/alarms?machine={shop.machine}")["items"]
    (notice,) = notified(page.context)
    assert notice["title"].startswith(f"Tool worn: Lathe {shop.machine[6:]}")
    assert notice["body"] == f"{alarm['text']} {alarm['what_to_do']}"
    assert notice["tag"] == f"inband-{alarm['id']}"
    (shower,) = [each for each in page.context.pages if each.evaluate("window.notices.length")]
    with page.context.expect_page() as opened:
        shower.evaluate("window.newest.onclick()")
    expect(opened.value).to_have_url(f"{server.url}/alarms/{alarm['id']}")


def test_a_test_is_shown(server: Server, page: Page) -> None:
    viewer = Person(server, "viewer")
    viewer.send("/account/notifications/browser")
    viewer.sign_in(page)
    page.context.add_init_script(STUB + 'window.Notification.permission = "granted";')
    page.goto("/account/notifications")
    page.get_by_role("button", name="Send a test").click()
    expect(page.locator("#last-notification")).to_contain_text("Inband: test – delivered")
    until(lambda: [each["title"] for each in notified(page.context)] == ["Inband: test"])


@pytest.mark.parametrize(
    ("script", "words"),
    [
        ('localStorage.setItem("permission", "denied");' + STUB, "This browser refuses notifications"),
        ("delete window.Notification;", "has no notifications"),
        ('Object.defineProperty(window, "isSecureContext", { value: false });', "only to pages that it opens by https"),
    ],
)
def test_a_browser_that_shows_none_says_why(viewer: Person, page: Page, script: str, words: str) -> None:
    viewer.sign_in(page)
    page.add_init_script(script)
    page.goto("/account/notifications")
    expect(page.get_by_role("status").filter(has_text=words)).to_be_visible()
    expect(page.get_by_role("button", name=BUTTON)).to_be_hidden()


def test_a_person_who_refuses_is_no_receiver(server: Server, page: Page) -> None:
    viewer = Person(server, "viewer")
    viewer.sign_in(page)
    page.add_init_script('localStorage.setItem("will answer", "denied");' + STUB)
    page.goto("/account/notifications")
    page.get_by_role("button", name=BUTTON).click()
    expect(page.get_by_role("status").filter(has_text="This browser refuses notifications")).to_be_visible()
    assert viewer.browser.get("/api/v1/notifications/me/browser").status_code == 404
