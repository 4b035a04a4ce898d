"""Notifications in the whole application: mail, webhook, apprise, routes, shifts, and maintenance."""

import re
import socket
import sys
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from io import BytesIO
from types import ModuleType
from typing import Any

import pytest
from PIL import Image, ImageColor
from sqlalchemy import select, text
from sqlalchemy.orm import Session

from app.access.tables import Person
from app.language.times import begin_of_shift, end_of_shift
from app.loop.notifications import means, notifier, sending
from app.loop.notifications.means import Answer, Job, Message, deliver
from app.loop.notifications.picture import OUT
from app.loop.notifications.tables import Receiver
from app.settings import Settings
from tests.databases import NewDatabase, drop_database
from tests.in_process import InProcess, in_process
from tests.loop.notifications.sinks import NETWORKS, Hooks, Mails
from tests.loops import run
from tests.shop import Shop, unique
from tests.waits import until


@pytest.fixture(scope="module")
def plant(new_database: NewDatabase, hooks: Hooks, mails: tuple[Mails, str]) -> Iterator[InProcess]:
    """The whole application, which looks twenty times a second."""
    url = new_database()
    settings: dict[str, Any] = {
        "mail_server": mails[1],
        "mail_security": "none",
        "public_url": "https://inband.test",
    } | NETWORKS
    with pytest.MonkeyPatch.context() as quick:
        quick.setattr(notifier, "EVERY", 0.05)
        quick.setattr(notifier, "END_WITHIN", 0.1)
        with in_process(url, **settings) as running:
            yield running
    drop_database(url)


@pytest.fixture
def shop(plant: InProcess) -> Shop:
    return Shop(plant)


def receiver(shop: Shop, address: str, kind: str = "webhook", **more: Any) -> Any:
    return shop.call("POST", "/notifications/receivers", 201, name=unique("andon"), means=kind, address=address, **more)


def route(shop: Shop, *steps: tuple[int, Any], **more: Any) -> Any:
    """A route of this machine's alarms: after so many minutes to this receiver."""
    made = [{"after": after, "receivers": [to["id"]]} for after, to in steps]
    rule = {"name": unique("route"), "machines": [shop.machine], "steps": made}
    return shop.call("POST", "/notifications/routes", 201, **rule | more)


def deliveries(shop: Shop, to: Any, state: str | None = None) -> list[Any]:
    found = shop.call("GET", f"/notifications/deliveries?receiver={to['id']}")["items"]
    return [each for each in found if state in (None, each["state"])]


def later(shop: Shop, to: Any, minutes: float = 1) -> None:
    """Let so much time pass for a receiver."""
    columns = ("last_at", "retry_at")
    moved = ", ".join(f"{each} = {each} - :by" for each in columns)
    with shop.server.database.begin() as session:
        by = {"by": timedelta(minutes=minutes), "id": to["id"]}
        session.execute(text(f"UPDATE receiver SET {moved} WHERE id = :id"), by)  # noqa: S608 - names of this file
        session.execute(text("UPDATE announced SET at = at - :by WHERE receiver_id = :id"), by)


def flood(shop: Shop, number: int, kind: str = "hunting") -> None:
    """So many alarms at once, each about another tool."""
    with shop.server.database.begin() as session:
        session.execute(
            text(
                "INSERT INTO alarm (machine_id, tool_memory, kind)"
                " SELECT id, n, :kind FROM machine, generate_series(1, :number) n WHERE key = :key"
            ),
            {"number": number, "key": shop.machine, "kind": kind},
        )


class TestMail:
    def test_an_alarm_is_mailed_with_its_words_and_its_link(self, shop: Shop, mails: tuple[Mails, str]) -> None:
        address = f"{unique('anna')}@example.com"
        anna = receiver(shop, address, "mail")
        route(shop, (0, anna))
        shop.read(350)
        (mail,) = until(lambda: mails[0].to(address))
        (alarm,) = shop.call("GET", f"/alarms?machine={shop.machine}")["items"]
        assert mail.startswith(f"Tool worn: Lathe {shop.machine[6:]}, Seat {shop.characteristic}, tool 3\n")
        for words in (alarm["text"], alarm["what_to_do"], f"https://inband.test/alarms/{alarm['id']}"):
            assert words in mail
        (done,) = until(lambda: deliveries(shop, anna, "delivered"))
        assert done["alarms"] == [alarm["id"]]
        assert done["answer"] == "The mail server has taken it."

    def test_it_says_the_steps_of_the_reaction_plan(self, shop: Shop, mails: tuple[Mails, str]) -> None:
        address = f"{unique('iva')}@example.com"
        steps = [{"text": "Zaustavi mašinu „odmah“"}, {"text": "Pozovi <Đoku>"}]
        plan: dict[str, Any] = {"characteristic": shop.characteristic, "steps": steps, "reason": "Prvi"}
        shop.call("POST", "/reactions/plans", 201, name=unique("plan"), **plan)
        route(shop, (0, receiver(shop, address, "mail")))
        shop.read(20)
        (mail,) = until(lambda: mails[0].to(address))
        assert "\n1. Zaustavi mašinu „odmah“\n2. Pozovi <Đoku>\nhttps://" in mail.replace("\r", "")

    def test_it_shows_the_last_readings(self, shop: Shop, mails: tuple[Mails, str]) -> None:
        address = f"{unique('mia')}@example.com"
        route(shop, (0, receiver(shop, address, "mail")))
        shop.push([0.5, -2.0, 3.0, 6.0])
        shop.read(12)
        until(lambda: mails[0].to(address))
        (mail,) = (each for each in mails[0].mails if each["To"] == address)
        (attached,) = mail.iter_attachments()  # type: ignore[attr-defined]
        assert (attached.get_content_type(), attached.get_filename()) == ("image/png", "readings.png")
        with Image.open(BytesIO(attached.get_content())) as picture:
            assert picture.size == (640, 220)
            colours = {colour for _number, colour in picture.getcolors(100_000) or ()}
        assert ImageColor.getrgb(OUT) in colours, "the part out of tolerance is marked"

    def test_it_is_repeated_until_somebody_acknowledges_it(self, shop: Shop, mails: tuple[Mails, str]) -> None:
        address = f"{unique('ben')}@example.com"
        ben = receiver(shop, address, "mail")
        route(shop, (0, ben), repeat=5)
        shop.read(350)
        until(lambda: deliveries(shop, ben, "delivered"))
        later(shop, ben, 5)
        assert until(lambda: mails[0].to(address)[1:])[0].startswith("Reminder: Tool worn")
        until(lambda: len(deliveries(shop, ben, "delivered")) == 2)
        (alarm,) = shop.call("GET", f"/alarms?machine={shop.machine}")["items"]
        shop.call("POST", f"/alarms/{alarm['id']}/acknowledge", action="noted", comment="Seen")
        later(shop, ben, 60)
        shop.read(20)  # another alarm, which alone is in the next message
        assert until(lambda: mails[0].to(address)[2:])[0].startswith("Oversize")

    def test_a_flood_is_one_message_with_the_count(self, shop: Shop, mails: tuple[Mails, str]) -> None:
        address = f"{unique('cleo')}@example.com"
        cleo = receiver(shop, address, "mail")
        route(shop, (0, cleo))
        flood(shop, 300)
        (mail,) = until(lambda: mails[0].to(address))
        assert mail.startswith("300 alarms: Hunting …\n")
        assert mail.count("https://inband.test/alarms/") == 20
        assert "… and 280 more: https://inband.test/alarms" in mail
        until(lambda: deliveries(shop, cleo, "delivered"))
        shop.read(350)
        later(shop, cleo)
        assert until(lambda: mails[0].to(address)[1:])[0].startswith("Tool worn")

    def test_what_stops_a_machine_waits_for_no_minute_once(self, shop: Shop, mails: tuple[Mails, str]) -> None:
        address = f"{unique('gil')}@example.com"
        gil = receiver(shop, address, "mail")
        route(shop, (0, gil))
        flood(shop, 1)  # which stops nothing
        until(lambda: deliveries(shop, gil, "delivered"))
        flood(shop, 1, "early_effect")
        subjects = [mail.partition("\n")[0] for mail in until(lambda: mails[0].to(address)[1:])]
        assert subjects == [f"Early effect: Lathe {shop.machine[6:]}, tool 1"]
        until(lambda: len(deliveries(shop, gil, "delivered")) == 2)
        flood(shop, 1, "opposite_effect")
        witness = receiver(shop, f"{unique('witness')}@example.com", "mail")
        route(shop, (0, witness))
        until(lambda: deliveries(shop, witness, "delivered"))
        assert len(deliveries(shop, gil)) == 2, "planned together, it was held back"
        later(shop, gil)
        assert until(lambda: mails[0].to(address)[2:])[0].startswith("Opposite effect")

    def test_a_test_can_be_sent(self, shop: Shop, mails: tuple[Mails, str]) -> None:
        address = f"{unique('eve')}@example.com"
        eve = receiver(shop, address, "mail", away_until=(datetime.now(UTC) + timedelta(days=9)).isoformat())
        asked = shop.call("POST", f"/notifications/receivers/{eve['id']}/test", 202)
        assert (asked["about"], asked["state"]) == ("test", "waiting")
        until(lambda: shop.call("GET", f"/notifications/deliveries/{asked['id']}")["state"] == "delivered")
        assert "Notifications arrive here." in mails[0].to(address)[0]


class TestMaintenance:
    def test_nobody_is_notified_before_it_ends(self, shop: Shop, mails: tuple[Mails, str]) -> None:
        address = f"{unique('una')}@example.com"
        una = receiver(shop, address, "mail")
        route(shop, (0, una))
        made = shop.call("POST", "/maintenance", 201, machine=shop.machine, reason="New bearing")
        shop.read(350)  # worn: it does not stop
        other = Shop(shop.server)
        witness = receiver(other, f"{unique('witness')}@example.com", "mail")
        route(other, (0, witness), machines=[shop.machine, other.machine])
        other.read(350)
        until(lambda: deliveries(other, witness, "delivered"))
        assert [each["alarms"] for each in deliveries(other, witness)] == [
            [shop.call("GET", f"/alarms?machine={other.machine}")["items"][0]["id"]]
        ], "the other machine's alone"
        assert mails[0].to(address) == []
        shop.call("POST", f"/maintenance/{made['id']}/end")
        assert until(lambda: mails[0].to(address))[0].startswith("Tool worn")

    def test_an_alarm_that_stops_goes_all_the_same(self, shop: Shop, mails: tuple[Mails, str]) -> None:
        address = f"{unique('uwe')}@example.com"
        route(shop, (0, receiver(shop, address, "mail")))
        shop.call("POST", "/maintenance", 201, machine=shop.machine, reason="New bearing")
        flood(shop, 1)
        shop.read(15_000)  # a probe fault
        (mail,) = until(lambda: mails[0].to(address))
        assert mail.startswith("Probe fault"), "and the one that does not stop is not in it"


class TestWebhook:
    def test_it_is_signed(self, shop: Shop, hooks: Hooks) -> None:
        path = f"/{unique('hook')}"
        andon = receiver(shop, hooks.url + path)
        route(shop, (0, andon))
        shop.read(350)
        until(lambda: hooks.at(path))
        (post,) = [post for post in hooks.posts if post.path == path]
        assert post.signed_with(andon["secret"])
        assert not post.signed_with("another secret")
        assert abs(int(post.headers["x-inband-timestamp"]) - datetime.now(UTC).timestamp()) < 60
        (alarm,) = post.json["alarms"]
        assert (alarm["kind"], alarm["machine"], alarm["tool"]) == ("tool_worn", shop.machine, 3)
        assert (post.json["type"], post.json["count"], post.json["reminder"]) == ("alarms", 1, False)
        assert "secret" not in shop.call("GET", f"/notifications/receivers/{andon['id']}")

    @pytest.mark.parametrize(
        ("way", "answer"),
        [("500", "500 Internal Server Error"), ("302", "302 leads to another"), ("hang", "no answer within 2 s")],
    )
    def test_where_it_fails_the_next_step_follows_at_once(
        self,
        shop: Shop,
        hooks: Hooks,
        mails: tuple[Mails, str],
        way: str,
        answer: str,
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        if way == "hang":
            monkeypatch.setattr(means, "LIMIT", 2.0)
        path, address = f"/{unique('hook')}-{way}", f"{unique('fay')}@example.com"
        broken, fay = receiver(shop, hooks.url + path), receiver(shop, address, "mail")
        route(shop, (0, broken), (30, fay))
        shop.read(350)
        assert until(lambda: mails[0].to(address))[0].startswith("Tool worn")
        failed = deliveries(shop, broken)[-1]
        assert failed["state"] == "failed"
        assert failed["answer"].startswith(answer)
        assert hooks.at(path.removesuffix("-302")) == [] or way != "302"
        now = shop.call("GET", f"/notifications/receivers/{broken['id']}")
        assert now["failures"] >= 1
        assert now["retry_at"] is not None
        hooks.mended.add(path)
        later(shop, broken, 10)
        until(lambda: deliveries(shop, broken, "delivered"))
        assert shop.call("GET", f"/notifications/receivers/{broken['id']}")["failures"] == 0

    def test_one_that_hangs_keeps_nobody_waiting(self, shop: Shop, hooks: Hooks) -> None:
        stuck = [receiver(shop, f"{hooks.url}/{unique('hook')}-hang") for _each in range(3)]
        path = f"/{unique('hook')}"
        fine = receiver(shop, hooks.url + path)
        route(shop, *((0, each) for each in (*stuck, fine)))
        shop.read(350)
        until(lambda: deliveries(shop, fine, "delivered"))
        assert shop.read(1)["sequence"] == 2

    def test_changes_come_in_order_and_none_is_lost(self, shop: Shop, hooks: Hooks) -> None:
        path = f"/{unique('mes')}-500"
        mes = receiver(shop, hooks.url + path, events=["reading", "correction", "alarm", "tool"])
        shop.read(6)
        until(lambda: deliveries(shop, mes, "failed"))
        shop.read(350)
        hooks.mended.add(path)
        later(shop, mes, 10)
        got = until(lambda: hooks.at(path))[0]["changes"]
        mine = [(each["kind"], each.get("sequence")) for each in got if each["machine"] == shop.machine]
        assert mine[0] == ("reading", 1)
        assert ("reading", 2) in mine
        assert {"correction", "alarm"} <= {kind for kind, _sequence in mine}
        numbers = [each["event"] for each in got]
        assert numbers == sorted(numbers)
        (first,) = [each for each in got if each.get("sequence") == 1 and each["machine"] == shop.machine]
        assert first["link"].endswith(f"/api/v1/readings/{shop.characteristic}/1")
        until(lambda: deliveries(shop, mes, "delivered"))
        shop.read(1)
        again = until(lambda: hooks.at(path)[1:])[0]["changes"]
        assert min(each["event"] for each in again) > max(numbers)


def test_a_dead_mail_server_disturbs_nothing(new_database: NewDatabase, hooks: Hooks, monkeypatch: Any) -> None:
    monkeypatch.setattr(notifier, "EVERY", 0.05)
    with socket.socket() as nobody:
        nobody.bind(("127.0.0.1", 0))  # and does not listen
        url = new_database()
        with in_process(url, mail_server=f"127.0.0.1:{nobody.getsockname()[1]}", **NETWORKS) as running:
            shop = Shop(running)
            path = f"/{unique('hook')}"
            mail, andon = receiver(shop, "anna@example.com", "mail"), receiver(shop, hooks.url + path)
            route(shop, (0, mail), (0, andon))
            shop.read(350)
            until(lambda: deliveries(shop, andon, "delivered"))
            failed = until(lambda: deliveries(shop, mail, "failed"))[0]
            assert "no mail server listens at" in failed["answer"]
            assert shop.read(1)["sequence"] == 2
    drop_database(url)


def test_a_route_of_an_older_version_has_not_changed_when_it_is_saved(shop: Shop) -> None:
    """Keys that came later are what they are without being stored."""
    made = route(shop, (0, receiver(shop, "old@example.com", "mail")))
    with shop.server.database.begin() as session:
        session.execute(
            text(
                "UPDATE notification_route SET rule = jsonb_set(rule, '{steps}',"
                " jsonb_build_array((rule -> 'steps' -> 0) - 'groups' - 'on_duty')) - 'digest' WHERE id = :id"
            ),
            {"id": made["id"]},
        )
    path = f"/notifications/routes/{made['id']}"
    same = {name: value for name, value in made.items() if name not in {"id", "created_at", "created_by"}}
    shop.call("PUT", path, **same)
    written = shop.call("GET", f"/audit?subject=notification-route/{made['id']}")["items"]
    assert [each["action"] for each in written] == ["route added"]
    shop.call("PUT", path, **same | {"repeat": 5})
    (changed, _added) = shop.call("GET", f"/audit?subject=notification-route/{made['id']}")["items"]
    assert {name for name in changed["after"] if changed["before"][name] != changed["after"][name]} == {"repeat"}


@pytest.mark.parametrize("address", ["https://10.1.2.3/x", "http://[::ffff:10.1.2.3]/x", "https://169.254.169.254/"])
def test_a_webhook_inside_the_network_is_refused_when_it_is_added(shop: Shop, address: str) -> None:
    """Whoever adds it is the one who can put it right; a delivery that fails at night reaches nobody."""
    andon = receiver(shop, "https://no-such-name.invalid/x")  # a name may be entered before the name service knows it
    add: dict[str, Any] = {"name": "Andon", "means": "webhook", "address": address}
    change: dict[str, Any] = {"address": address}
    for method, path, sent in (
        ("POST", "/notifications/receivers", add),
        ("PATCH", f"/notifications/receivers/{andon['id']}", change),
    ):
        problem = shop.call(method, path, 422, **sent)
        assert [each["field"] for each in problem["errors"]] == ["address"]
        assert "INBAND_WEBHOOK_NETWORKS" in problem["errors"][0]["message"]
    assert shop.call("GET", f"/notifications/receivers/{andon['id']}")["address"] == andon["address"]


class TestSetUp:
    def test_who_may(self, plant: InProcess, shop: Shop) -> None:
        engineer = plant.client(plant.key("engineer"))
        for path in ("routes", "receivers", "deliveries"):
            shop.call("GET", f"/notifications/{path}", 403, client=engineer)
        shop.call("PUT", "/notifications/me", 404, address="key@example.com")  # a key is no person

    def test_names_that_nothing_has_are_refused(self, shop: Shop) -> None:
        body: dict[str, Any] = {
            "name": "Night",
            "kinds": ["tool_worm"],
            "machines": ["mill-99"],
            "characteristics": ["none"],
        }
        absent = [{"receivers": [99999]}]
        answer = shop.call("POST", "/notifications/routes", 422, **body, steps=absent)
        assert [each["field"] for each in answer["errors"]] == ["kinds", "machines", "characteristics"]
        shop.call("POST", "/notifications/routes", 404, name="Night", steps=absent)
        steps = [{"after": 5, "receivers": [1]}, {"after": 1, "receivers": [1]}]
        answer = shop.call("POST", "/notifications/routes", 422, name="Night", steps=steps)
        assert answer["errors"][0]["field"] == "steps"

    @pytest.mark.parametrize(
        ("means", "address"),
        [
            ("mail", "anna"),
            ("mail", "anna@example.com\nBcc: all@example.com"),
            ("mail", "Anna <anna@example.com>"),
            ("webhook", "file:///etc/passwd"),
            ("webhook", "https://user:password@andon.example"),
            ("webhook", "https://[::1"),
            ("webhook", "https://andon.example:99999/"),
            ("webhook", "https://andon.example/a b"),
            ("apprise", "ntfy://topic"),
        ],
    )
    def test_addresses_that_cannot_be_are_refused(self, shop: Shop, means: str, address: str) -> None:
        body: dict[str, Any] = {"name": "X", "means": means, "address": address}
        assert shop.call("POST", "/notifications/receivers", 422, **body)["errors"][0]["field"] == "address"

    def test_a_route_is_changed_and_deleted(self, shop: Shop, hooks: Hooks) -> None:
        andon = receiver(shop, f"{hooks.url}/x")
        made = route(shop, (0, andon))
        path = f"/notifications/routes/{made['id']}"
        got = shop.admin.get(f"/api/v1{path}")
        assert got.json() == made
        night = {"days": [1, 2, 3, 4, 5], "begins": "22:00", "ends": "06:00"}
        body = {"name": "Night", "hours": [night], "steps": made["steps"], "enabled": False}
        tag = {"If-Match": got.headers["ETag"]}
        assert shop.admin.put(f"/api/v1{path}", json=body, headers=tag).json()["hours"] == [night]
        assert shop.admin.put(f"/api/v1{path}", json=body, headers=tag).status_code == 412
        shop.call("DELETE", f"/notifications/receivers/{andon['id']}", 409)
        shop.call("DELETE", path, 204)
        shop.call("DELETE", f"/notifications/receivers/{andon['id']}", 204)
        shop.call("GET", path, 404)

    def test_the_record_of_changes_holds_no_address_and_no_secret(self, shop: Shop) -> None:
        address = f"{unique('grace')}@example.com"
        grace = receiver(shop, address, "mail")
        path = f"/notifications/receivers/{grace['id']}"
        shop.call("PATCH", path, name="Grace", address=f"new-{address}")
        assert shop.call("GET", path)["address"] == f"new-{address}"
        shop.call("PATCH", path, 422, events=["alarm"])
        entries = shop.call("GET", f"/audit?subject=receiver/{grace['id']}")["items"]
        assert {each["action"] for each in entries} == {"receiver added", "receiver changed"}
        assert address not in str(entries)


class TestShifts:
    """The mail at the end of a shift."""

    @pytest.fixture
    def anna(self, session: Session) -> Receiver:
        """Somebody who wants it, and has had it up to the shift before yesterday's last."""
        person = Person(name="anna", role="viewer", password_hash="-")
        session.add(person)
        session.flush()
        last = begin_of_shift(datetime.now(UTC) - sending.SETTLED)
        before = begin_of_shift(last - timedelta(seconds=1))
        row = Receiver(
            name="anna",
            means="mail",
            address="anna@example.com",
            person_id=person.id,
            created_by="anna",
            shift_report=True,
            shift_reported=before,
        )
        session.add(row)
        session.flush()
        session.refresh(row)
        return row

    @staticmethod
    def planned(session: Session) -> list[Job]:
        return sending.plan_shifts(session, "https://inband.test", lambda _s, end, address: (f"until {end}", address))

    def test_it_is_sent_once_and_again_where_it_did_not_arrive(self, session: Session, anna: Receiver) -> None:
        due = end_of_shift(anna.shift_reported or anna.created_at)
        (job,) = self.planned(session)
        assert (job.shift_end, job.message.subject) == (due, f"until {due}")
        assert self.planned(session) == []  # it is on its way
        sending.end(session, job, Answer(delivered=False, text="421 not now"))
        assert self.planned(session) == []  # it pauses, as after every failure
        anna.retry_at = None
        session.flush()
        (again,) = self.planned(session)
        assert again.shift_end == due
        sending.end(session, again, Answer(delivered=True, text="250 OK"))
        assert due not in {job.shift_end for job in self.planned(session)}

    def test_not_in_quiet_hours_not_of_an_empty_shift_and_not_who_does_not_want_it(
        self, session: Session, anna: Receiver
    ) -> None:
        always = {"days": [1, 2, 3, 4, 5, 6, 7], "begins": "00:00", "ends": "00:00"}
        anna.quiet = [always]
        session.flush()
        assert self.planned(session) == []
        anna.quiet = []
        reported = anna.shift_reported
        assert sending.plan_shifts(session, "", lambda _session, _end, _address: None) == []
        assert anna.shift_reported != reported
        anna.shift_reported, anna.shift_report = reported, False
        session.flush()
        assert self.planned(session) == []

    def test_it_comes_with_the_words_of_the_page(self, plant: InProcess, shop: Shop, mails: tuple[Mails, str]) -> None:
        name = unique("ben")
        plant.person(name, "viewer")
        end = begin_of_shift(datetime.now(UTC) - sending.SETTLED)
        shop.read(12.0, measured_at=(end - timedelta(minutes=30)).isoformat(), part="p1")
        address = f"{name}@example.com"
        with plant.database.begin() as session:
            ben = session.scalars(select(Person).where(Person.name == name)).one()
            session.add(
                Receiver(
                    name=name,
                    means="mail",
                    address=address,
                    person_id=ben.id,
                    created_by=name,
                    shift_report=True,
                    shift_reported=begin_of_shift(end - timedelta(seconds=1)),
                )
            )
        (mail, *_later) = until(lambda: mails[0].to(address))
        assert re.match(r"Shift \d+ \w+ \d{4} \d\d:\d\d to \d\d:\d\d: ", mail)
        assert re.search(r": [1-9]\d* parts?, [1-9]\d* out of tolerance\n", mail)
        assert "https://inband.test/shift?at=" in mail


class TestApprise:
    PERMITTED = Settings(allow_apprise=True)

    def test_where_it_is_missing_it_says_how_to_install_it(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(sys.modules, "apprise", None)
        job = Job(1, 1, "test", "apprise", "ntfy://topic", None, Message("Test", "Text"))
        assert "pip install --require-hashes -r libraries-with-extras.txt" in run(deliver(job, self.PERMITTED)).text

    def test_it_is_given_the_message(self, monkeypatch: pytest.MonkeyPatch) -> None:
        sent: list[Any] = []

        class Apprise:
            def add(self, url: str) -> bool:
                sent.append(url)
                return True

            def notify(self, **message: str) -> bool:
                sent.append(message)
                return True

        module = ModuleType("apprise")
        module.Apprise = Apprise  # type: ignore[attr-defined]
        monkeypatch.setitem(sys.modules, "apprise", module)
        job = Job(1, 1, "test", "apprise", "ntfy://topic", None, Message("Tool worn", "Text"))
        assert run(deliver(job, self.PERMITTED)).delivered
        assert sent == ["ntfy://topic", {"title": "Tool worn", "body": "Text"}]
        assert not run(deliver(job, Settings())).delivered
