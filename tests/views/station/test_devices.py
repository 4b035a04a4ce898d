"""A tablet that is bound to a machine: it looks and does nothing by itself; whoever acts on it says who they are."""

import re
from collections.abc import Iterator
from typing import Any

import httpx
import pytest
from playwright.sync_api import Browser, expect
from sqlalchemy import select

from app.access import devices
from app.access.identification import FREE
from app.access.tables import Person as PersonOnRecord
from tests.pages.looks import live
from tests.pictures import picture
from tests.servers import TLS, Server
from tests.shop import PASSWORD, Person, Shop

PIN, BADGE = "2746", "0004711882"
COOKIE = "inband_station"


class Tablet:
    """A browser without scripts that is bound to the machine of a shop."""

    def __init__(self, server: Server, shop: Shop) -> None:
        with server.database.begin() as session:
            self.code = devices.make_code(session, shop.machine, "Tablet at the door", "tests")
        self.shop, self.here = shop, f"/station/{shop.machine}"
        self.browser: httpx.Client = server.client()
        answer = self.browser.post("/station", data={"code": self.code.lower()})
        assert (answer.status_code, answer.headers["location"]) == (303, self.here), answer.text
        self.flags = answer.headers["set-cookie"].lower()

    def open(self, path: str = "", status: int = 200) -> str:
        answer = self.browser.get(self.here + path)
        assert answer.status_code == status, answer.text
        return answer.text

    def send(self, path: str, status: int = 303, **fields: str) -> str:
        found = re.search(r'name="csrf" content="([^"]+)"', self.open())
        assert found is not None
        answer = self.browser.post(self.here + path, data={"csrf": found[1], **fields})
        assert answer.status_code == status, answer.text
        assert ("retry-after" in answer.headers) is (status == 429)
        return answer.text

    def acknowledge(self, status: int = 303, **who: str) -> str:
        """The first active alarm of the machine is noted."""
        alarm = self.shop.alarms()[0]["id"]
        return self.send(f"/alarms/{alarm}", status, action="noted", comment="Seen", **who)


@pytest.fixture
def tablet(server: Server, shop: Shop) -> Tablet:
    return Tablet(server, shop)


@pytest.fixture(scope="module")
def milica(server: Server, admin: Person) -> Iterator[Person]:
    """An operator with a PIN and a badge."""
    person = Person(server, "operator")
    assert "The PIN is set" in person.send("/account/pin", password=PASSWORD, pin=PIN)
    number = _number(server, person)
    assert "The badge is bound" in admin.send("/setup/stations/badges", person=number, code=BADGE)
    yield person
    admin.send(f"/setup/stations/badges/{number}/remove")


def _number(server: Server, person: Person) -> str:
    with server.database.begin() as session:
        return str(session.scalars(select(PersonOnRecord.id).where(PersonOnRecord.name == person.name)).one())


def _last_entry(shop: Shop, action: str) -> Any:
    entries = shop.call("GET", "/audit?limit=50")["items"]
    return next(entry for entry in entries if entry["action"] == action)


class TestBinding:
    def test_a_code_binds_once(self, server: Server, tablet: Tablet) -> None:
        answer = server.client().post("/station", data={"code": tablet.code})
        assert answer.status_code == 422
        assert "was used already" in answer.text
        assert COOKIE not in answer.headers.get("set-cookie", "")

    def test_a_code_grows_old(self, server: Server, shop: Shop) -> None:
        with server.database.begin() as session:
            code = devices.make_code(session, shop.machine, "Old", "tests")
            session.connection().exec_driver_sql(
                "UPDATE station_device SET created_at = now() - interval '31 minutes' WHERE token_hash IS NULL"
            )
        assert server.client().post("/station", data={"code": code}).status_code == 422

    def test_the_cookie_goes_to_stations_only(self, tablet: Tablet) -> None:
        assert "path=/station" in tablet.flags
        assert "httponly" in tablet.flags
        assert "samesite=lax" in tablet.flags

    def test_the_token_is_nowhere_in_the_database(self, server: Server, tablet: Tablet) -> None:
        token = tablet.browser.cookies[COOKIE]
        with server.database.begin() as session:
            rows = session.connection().exec_driver_sql("SELECT d::text FROM station_device d").scalars().all()
        assert rows
        assert not [row for row in rows if token in row or tablet.code.replace("-", "") in row]

    def test_anyone_who_is_signed_in_on_it_is_signed_out(self, server: Server, shop: Shop) -> None:
        person = Person(server, "admin")
        text = person.send("/setup/stations", machine=shop.machine, name="Tablet")
        code = re.search(r"<code[^>]*>([A-Z2-9-]+)</code>", text)
        assert code is not None
        assert "Oversize" not in person.send("/station", code=code[1])
        person.open(f"/station/{shop.machine}")
        assert person.browser.get("/account", follow_redirects=False).status_code == 303

    def test_only_administrators_bind(self, operator: Person, shop: Shop) -> None:
        operator.open("/setup/stations", 403)
        operator.send("/setup/stations", 403, machine=shop.machine, name="Mine")
        operator.send("/setup/stations/badges", 403, person="1", code=BADGE)

    def test_it_is_listed_and_revoked(self, tablet: Tablet, admin: Person) -> None:
        text = admin.open("/setup/stations")
        row = next(part for part in text.split("<tr") if tablet.here in part)
        assert "Tablet at the door" in row
        revoke = re.search(r"/setup/stations/\d+/revoke", row)
        assert revoke is not None
        tablet.open()
        assert "is revoked" in admin.send(revoke[0])
        assert tablet.browser.get(tablet.here).headers["location"] == "/station"
        assert "not bound to a machine any more" in tablet.browser.get("/station").text
        assert tablet.here not in admin.open("/setup/stations")


class TestWhatItMay:
    def test_it_opens_the_station_of_its_machine_and_nothing_else(self, server: Server, tablet: Tablet) -> None:
        other = Shop(server)
        tablet.shop.read(12.0)
        assert "+12.0" in tablet.open()
        assert tablet.browser.get("/station").headers["location"] == tablet.here
        refused = tablet.browser.get(f"/station/{other.machine}")
        assert refused.status_code == 403
        assert f"bound to machine {tablet.shop.machine}" in refused.text
        token = {COOKIE: tablet.browser.cookies[COOKIE]}
        for path in ("/", "/alarms", "/setup/stations", "/account", f"/machines/{tablet.shop.machine}/tools"):
            answer = httpx.get(
                server.url + path, cookies=token, headers={"Accept": "text/html"}, timeout=60, verify=TLS
            )
            assert answer.status_code in {303, 401}, path
        for path in ("/api/v1/machines", "/api/v1/alarms", "/api/v1/events", "/api/v1/people/me"):
            assert httpx.get(server.url + path, cookies=token, timeout=60, verify=TLS).status_code == 401, path
        pushed = httpx.post(
            f"{server.url}/api/v1/readings",
            cookies=token,
            json={"characteristic": tablet.shop.characteristic, "measured": 40.0},
            timeout=60,
            verify=TLS,
        )
        assert pushed.status_code == 401

    def test_it_acknowledges_nothing_by_itself(self, tablet: Tablet) -> None:
        tablet.shop.read(12.0)
        assert "Wrong name or PIN" in tablet.acknowledge(401)
        assert len(tablet.shop.alarms()) == 1

    def test_a_foreign_page_sends_nothing_in_its_name(self, tablet: Tablet, milica: Person) -> None:
        tablet.shop.read(12.0)
        alarm = tablet.shop.alarms()[0]["id"]
        fields = {"action": "noted", "comment": "Seen", "badge": BADGE}
        assert tablet.browser.post(f"{tablet.here}/alarms/{alarm}", data=fields).status_code == 403
        assert len(tablet.shop.alarms()) == 1


class TestWhoActs:
    @pytest.mark.parametrize("how", ["PIN", "badge"])
    def test_it_is_done_in_that_persons_name(self, tablet: Tablet, admin: Person, milica: Person, how: str) -> None:
        tablet.shop.read(12.0)
        who = {"other_name": milica.name, "pin": PIN} if how == "PIN" else {"badge": BADGE}
        tablet.acknowledge(303, **who)
        assert tablet.shop.alarms("acknowledged")[0]["acknowledged_by"] == milica.name
        entry = _last_entry(tablet.shop, "alarm acknowledged")
        assert entry["actor"] == milica.name
        assert entry["person_id"] is not None
        at_device = f"Tablet at the door (station device {entry['device_id']})"
        assert at_device in admin.open("/setup/audit?q=alarm+acknowledged")
        assert f'value="{milica.name}"' in tablet.open("/tools/3/change")  # to be chosen by one touch from now on

    def test_a_correction_is_approved_by_who_shows_a_badge(self, tablet: Tablet, milica: Person) -> None:
        shop, key = tablet.shop, f"{tablet.shop.characteristic}-approval"
        shop.add(key, mode="approval", tool_memory=4, average_memory=6)
        number = shop.read(6.0, key)["correction"]["number"]
        assert "Who are you?" in tablet.open(f"/corrections/{number}?do=approve")
        fields: dict[str, Any] = {"do": "approve", "reason": "As expected"}
        assert "Wrong name or PIN" in tablet.send(f"/corrections/{number}", 401, **fields)
        assert shop.correction(number)["status"] == "awaiting_approval"
        tablet.send(f"/corrections/{number}", **fields, badge=BADGE)
        assert shop.correction(number)["decided_by"] == milica.name
        assert _last_entry(shop, "correction approved")["device_id"] is not None

    def test_for_one_action(self, tablet: Tablet, milica: Person) -> None:
        tablet.shop.read(12.0)
        tablet.send("/tools/3/change", offset="0", reason="New insert", badge=BADGE)
        assert _last_entry(tablet.shop, "tool changed")["device_id"] is not None
        tablet.acknowledge(401)

    def test_the_role_decides(self, server: Server, tablet: Tablet) -> None:
        looks = Person(server, "viewer")
        looks.send("/account/pin", password=PASSWORD, pin="8351")
        tablet.shop.read(12.0)
        assert "This needs the role operator" in tablet.acknowledge(403, other_name=looks.name, pin="8351")
        assert len(tablet.shop.alarms()) == 1

    def test_who_has_no_access_any_more_is_nobody(self, server: Server, tablet: Tablet) -> None:
        gone = Person(server, "operator")
        gone.send("/account/pin", password=PASSWORD, pin="8351")
        number = _number(server, gone)
        tablet.shop.call("PATCH", f"/people/{number}", disabled=True)
        tablet.shop.read(12.0)
        tablet.acknowledge(401, other_name=gone.name, pin="8351")

    def test_the_next_one_finds_no_name_filled_in(self, tablet: Tablet, milica: Person) -> None:
        tablet.send("/note", text="Chips", who=milica.name, pin=PIN)
        refused = tablet.send("/note", 401, text="Chips again", other_name="Nobody", pin=PIN)
        assert "Chips again" in refused, "what was written stays"
        who = refused[refused.index("Who are you?") :]
        assert milica.name in who, "the names of this device are offered"
        assert "Nobody" not in who
        assert "checked" not in who

    def test_no_name_is_distinguished_from_another(self, tablet: Tablet, milica: Person) -> None:
        tablet.shop.read(12.0)
        notes = []
        for name in (milica.name, "nobody", ""):
            text = tablet.acknowledge(401, other_name=name, pin="9999")
            assert "9999" not in text
            found = re.search(r'role="alert">.*?<div>(.*?)</div>', text, re.DOTALL)
            assert found is not None
            notes.append(found[1])
        assert len(set(notes)) == 1

    def test_a_pin_is_locked_by_person_and_device(self, server: Server, tablet: Tablet, milica: Person) -> None:
        tablet.shop.read(12.0)
        for _try in range(FREE):
            tablet.acknowledge(401, other_name=milica.name, pin="9999")
        text = tablet.acknowledge(429, other_name=milica.name, pin=PIN)
        assert re.search(r"The PIN is locked on this device until \d\d? \w{3} \d{4} \d\d:\d\d", text)
        Tablet(server, tablet.shop).acknowledge(other_name=milica.name, pin=PIN)  # not on another one
        assert tablet.shop.alarms() == []

    def test_no_pin_or_badge_comes_into_the_log(self, server: Server, tablet: Tablet, milica: Person) -> None:
        tablet.shop.read(12.0)
        tablet.acknowledge(401, other_name=milica.name, pin="83518351")
        tablet.acknowledge(badge=BADGE)
        log = server.stderr.read_text()
        assert "83518351" not in log
        assert BADGE not in log


class TestSecrets:
    @pytest.mark.parametrize("pin", ["123", "1111", "1212", "1234", "9876", "12a4", "1234567890123"])
    def test_a_pin_that_is_guessed_is_refused(self, milica: Person, pin: str) -> None:
        text = milica.send("/account/pin", 422, password=PASSWORD, pin=pin)
        assert "digits" in text
        assert f'value="{pin}"' not in text

    def test_a_pin_is_set_with_the_password_only(self, milica: Person) -> None:
        assert "Is not your present password" in milica.send("/account/pin", 422, password="wrong wrong", pin="8351")

    def test_a_pin_is_removed(self, server: Server, tablet: Tablet) -> None:
        person = Person(server, "operator")
        person.send("/account/pin", password=PASSWORD, pin="8351")
        assert "The PIN is removed" in person.send("/account/pin", password=PASSWORD, remove="true")
        tablet.shop.read(12.0)
        tablet.acknowledge(401, other_name=person.name, pin="8351")

    def test_a_new_password_ends_the_pin_and_asks_about_badges(self, server: Server, admin: Person) -> None:
        person = Person(server, "operator")
        number = _number(server, person)
        form: Any = {"old": PASSWORD, "new": "battery horse correct", "again": "battery horse correct"}
        person.send("/account/pin", password=PASSWORD, pin="8351")
        assert "my badges" not in person.open("/account")
        for code in ("7700112244", "7700112255"):
            admin.send("/setup/stations/badges", person=number, code=code)
        text = person.send("/account/password", **form)
        assert "PIN for the stations of machines has been removed" in text
        assert "Remove my badges too" in text
        text = admin.send(f"/setup/people/{number}/password")
        assert "2 badges still identify" in text
        assert "PIN" not in text.partition("<main")[2], "it has none any more"
        assert f"/setup/stations/badges/{number}/remove" in text

    def test_badges_are_removed_with_the_old_password(self, server: Server, admin: Person, tablet: Tablet) -> None:
        person = Person(server, "operator")
        admin.send("/setup/stations/badges", person=_number(server, person), code="7700112266")
        form: Any = {"old": PASSWORD, "new": "battery horse correct", "again": "battery horse correct"}
        assert "Remove my badges too" not in person.send("/account/password", **form, remove_badges="true")
        tablet.shop.read(12.0)
        tablet.acknowledge(401, badge="7700112266")

    def test_a_badge_is_of_one_person(self, server: Server, admin: Person, milica: Person, tablet: Tablet) -> None:
        other = Person(server, "operator")
        number = _number(server, other)
        assert "bound to a user already" in admin.send("/setup/stations/badges", 409, person=number, code=BADGE)
        assert "Must have" in admin.send("/setup/stations/badges", 422, person=number, code="12")
        admin.send("/setup/stations/badges", person=number, code="7700112233")
        assert "are removed" in admin.send(f"/setup/stations/badges/{number}/remove")
        tablet.shop.read(12.0)
        assert "Badge not known" in tablet.acknowledge(401, badge="7700112233")


def test_photos_are_sent_by_the_person_who_acknowledges(tablet: Tablet, milica: Person) -> None:
    tablet.shop.read(12.0)
    number = tablet.shop.alarms()[0]["id"]
    path = f"/alarms/{number}/photos"
    found = re.search(r'name="csrf" content="([^"]+)"', tablet.open())
    assert found is not None

    def send(machine: str, size: int = 0, **who: str) -> httpx.Response:
        files = {"photo": ("photo.jpg", picture("JPEG", (900, 600)) + bytes(size))}
        head = {"X-Sent-By": "script"}
        return tablet.browser.post(f"{machine}{path}", data={"csrf": found[1], **who}, files=files, headers=head)

    assert send(tablet.here).status_code == 401
    assert send(tablet.here, badge=BADGE, size=100_000).status_code == 204, "more than a form of a device"
    (made,) = tablet.shop.call("GET", path)["items"]
    assert (made["made_by"], made["width"]) == (milica.name, 900)
    assert "photo-box" in tablet.open(f"/alarms/{number}?action=noted")
    assert send(tablet.here, badge=BADGE, size=9_000_000).status_code == 413
    other = Shop(tablet.shop.server)
    assert send(f"/station/{other.machine}", badge=BADGE).status_code == 403


@pytest.fixture
def kiosk(browser: Browser, server: Server) -> Iterator[Any]:
    context = browser.new_context(base_url=server.url, viewport={"width": 800, "height": 1280}, has_touch=True)
    context.set_default_timeout(60_000)
    yield context.new_page()
    context.close()


def test_a_scanned_badge_acknowledges_by_two_touches(kiosk: Any, server: Server, shop: Shop, milica: Person) -> None:
    with server.database.begin() as session:
        code = devices.make_code(session, shop.machine, "Kiosk", "tests")
    kiosk.goto(f"/station?code={code}")
    kiosk.get_by_role("button", name="Bind").tap()
    live(kiosk)
    shop.read(12.5)
    kiosk.get_by_role("link", name="Noted").tap()
    expect(kiosk.get_by_label("Scan your badge")).to_be_focused()
    kiosk.keyboard.type(BADGE)
    kiosk.keyboard.press("Enter")
    expect(kiosk.get_by_role("status").filter(has_text=f"Oversize: Noted, {milica.name}")).to_be_visible()
    live(kiosk)
    shop.read(12.5)  # the stream of the device goes on
    expect(kiosk.locator(".station-alarm h2")).to_contain_text("Oversize")
