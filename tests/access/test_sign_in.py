"""Signing in and out of a browser: passwords, throttling, the token of forms, the end of sessions."""

import re
import threading
from typing import Any

import httpx
import psycopg
import pytest
from playwright.sync_api import Page, expect
from sqlalchemy import delete, func, update

from app.access import actions, attempts, passwords
from app.access.new_keys import digest
from app.access.queries import still_granted
from app.access.sign_in import SignInRefused, sign_in
from app.access.tables import BrowserSession, LoginFailure
from app.db.engine import Database
from app.errors import TooManyRequests
from app.web.live import Access
from app.web.problems import local_path
from tests.loops import run

PASSWORD = "correct horse battery"


pytestmark = pytest.mark.own_server
"""Of failures from one address, that of all tests, only so many are free."""


@pytest.fixture(scope="module")
def people(server: Any) -> Any:
    for role in ("viewer", "engineer", "admin"):
        server.person(role.title(), role, PASSWORD)
    return server


def signed_in(server: Any, name: str, password: str = PASSWORD) -> httpx.Client:
    client: httpx.Client = server.client()
    answer = client.post("/sign-in", data={"name": name, "password": password, "next": "/setup"})
    assert (answer.status_code, answer.headers["location"]) == (303, "/setup"), answer.text
    return client


def token(page: str) -> str:
    found = re.search(r'name="csrf" value="([^"]+)"', page)
    assert found
    return found[1]


def test_the_cookie_is_for_the_browser_alone(people: Any) -> None:
    client = people.client()
    answer = client.post("/sign-in", data={"name": "viewer", "password": PASSWORD})  # any spelling of the name
    cookie = answer.headers["set-cookie"]
    assert cookie.startswith("inband_session=")
    assert "HttpOnly" in cookie
    assert "SameSite=lax" in cookie
    assert "Max-Age=43200" in cookie
    assert client.get("/setup/characteristics").status_code == 200
    assert client.get("/api/v1/machines").status_code == 200


def test_signing_out_ends_the_session_not_only_the_cookie(people: Any) -> None:
    client = signed_in(people, "Viewer")
    stolen = client.cookies["inband_session"]
    csrf = token(client.get("/account").text)
    assert client.post("/sign-out", data={"csrf": csrf}).headers["location"] == "/sign-in"
    thief = people.client(Cookie=f"inband_session={stolen}")
    assert thief.get("/api/v1/machines").status_code == 401


def test_a_key_is_not_signed_out(people: Any) -> None:
    refused = people.client(people.key()).post("/sign-out")
    assert (refused.status_code, "revokes it" in refused.text) == (403, True)


def test_a_session_ends_by_itself(people: Any) -> None:
    client = signed_in(people, "Viewer")
    assert client.get("/api/v1/machines").status_code == 200
    own = Access(digest(client.cookies["inband_session"]), None, "viewer")

    async def listens() -> bool:
        async with await psycopg.AsyncConnection.connect(people.database.dsn) as connection:
            return own in await still_granted(connection, [own])

    assert run(listens())
    with people.database.begin() as session:
        ended = update(BrowserSession).where(BrowserSession.token_hash == own.session)
        session.execute(ended.values(expires_at=func.now()))
    assert client.get("/api/v1/machines").status_code == 401
    assert client.get("/setup").headers["location"].startswith("/sign-in")
    assert not run(listens()), "and what it listens to"


@pytest.mark.browser
def test_name_and_password_are_typed_in_a_browser(people: Any, page: Page, complaints: list[str]) -> None:
    page.goto("/setup/characteristics")
    page.wait_for_url(re.compile("/sign-in"))
    page.get_by_label("Name").fill("Engineer")
    page.get_by_label("Password").fill("wrong horse")
    page.get_by_role("button", name="Sign in").click()
    expect(page.get_by_role("alert")).to_contain_text("Wrong name or password")
    complaints.clear()  # the browser tells the console of every 401
    expect(page.get_by_label("Name")).to_have_value("Engineer")
    page.get_by_label("Password").fill(PASSWORD)
    page.get_by_label("Password").press("Enter")
    page.wait_for_url("**/setup/characteristics")  # where they wanted to go
    expect(page.get_by_role("heading", level=1, name="Set-up", exact=True)).to_be_visible()


@pytest.mark.parametrize(
    ("name", "password"),
    [
        ("Viewer", "wrong"),
        ("Viewer", ""),
        ("Nobody", PASSWORD),
        ("", ""),
        ("Viewer\0", PASSWORD),
        ("V%", "x"),
        ("'--", "x"),
    ],
)
def test_what_is_wrong_is_not_revealed(people: Any, name: str, password: str) -> None:
    answer = people.client().post("/sign-in", data={"name": name, "password": password})
    if "\0" in name:
        assert answer.status_code == 422
    else:
        assert answer.status_code in {401, 429}
        if answer.status_code == 401:
            assert "Wrong name or password" in answer.text
    assert "set-cookie" not in answer.headers


def test_a_form_of_another_site_is_refused(people: Any) -> None:
    data = {"name": "Viewer", "password": PASSWORD}
    assert people.client().post("/sign-in", data=data, headers={"Origin": "https://evil.example"}).status_code == 403
    assert people.client().post("/sign-in", data=data, headers={"Origin": "null"}).status_code == 403
    assert people.client().post("/sign-in", data=data, headers={"Origin": people.url}).status_code == 303


class TestToken:
    def test_every_change_by_cookie_needs_the_token(self, people: Any) -> None:
        client = signed_in(people, "Engineer")
        body = {"key": "by-form", "name": "x", "control": "other"}
        for data in (body, body | {"csrf": ""}, body | {"csrf": "guess"}, body | {"csrf": "gu\u00e4ss"}):
            assert client.post("/setup/machines/new", data=data).status_code == 403
        assert client.post("/api/v1/machines", json=body).status_code == 403
        assert client.get("/api/v1/machines/by-form").status_code == 404
        csrf = token(client.get("/setup/machines/new").text)
        made = client.post("/setup/machines/new", data=body | {"csrf": csrf})
        assert (made.status_code, made.headers["location"]) == (303, "/setup/machines/by-form?done=added")
        changed = client.patch("/api/v1/machines/by-form", json={"name": "y"}, headers={"X-CSRF-Token": csrf})
        assert changed.status_code == 200

    def test_the_token_of_somebody_else_is_none(self, people: Any) -> None:
        other = token(signed_in(people, "Viewer").get("/account").text)
        answer = signed_in(people, "Engineer").post(
            "/setup/machines/new", data={"key": "x", "name": "x", "control": "other", "csrf": other}
        )
        assert answer.status_code == 403

    def test_a_key_needs_none(self, people: Any) -> None:
        client = people.client(people.key("engineer"))
        assert client.post("/api/v1/machines", json={"key": "k1", "name": "x", "control": "other"}).status_code == 201


class TestSlowingDown:
    """In the database itself, as two server processes would."""

    def refused(self, database: Database, name: str, password: str = "wrong", address: str = "10.0.0.1") -> int | None:
        """Seconds to wait, None if the password was looked at."""
        try:
            sign_in(database, name, password, address, 12)
        except TooManyRequests as error:
            return error.retry_after
        except SignInRefused:
            return None
        return None

    def add(self, database: Database, name: str = "Ana") -> None:
        with database.begin() as session:
            actions.add_person(session, name=name, role="viewer", password=PASSWORD, actor="tests")

    def test_after_five_failures_one_waits_longer_and_longer(self, database: Database) -> None:
        self.add(database)
        assert [self.refused(database, "Ana") for _attempt in range(5)] == [None] * 5
        assert (self.refused(database, "ANA", PASSWORD) or 0) > 0, "the right password waits too"
        assert self.refused(database, "Ana", PASSWORD, "10.0.0.2") is None, "not from elsewhere"

    def test_who_must_wait_is_refused_for_a_second_without_asking_the_database(
        self, database: Database, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        self.add(database)
        wait = [self.refused(database, "Ana") for _attempt in range(6)][-1]
        with monkeypatch.context() as unreachable:
            unreachable.setattr(Database, "begin", None)
            assert self.refused(database, "ana", PASSWORD) == wait
            with pytest.raises(TypeError):
                self.refused(database, "Ana", PASSWORD, "10.0.0.2")
        with database.begin() as session:
            session.execute(delete(LoginFailure))
        monkeypatch.setattr(attempts, "BELIEVED", 0)
        assert sign_in(database, "Ana", PASSWORD, "10.0.0.1", 12).token

    def test_a_right_password_forgets_the_failures(self, database: Database) -> None:
        self.add(database)
        for _round in range(3):
            for _attempt in range(4):
                assert self.refused(database, "Ana") is None
            assert sign_in(database, "Ana", PASSWORD, "10.0.0.1", 12).token

    def test_a_right_password_elsewhere_forgets_nothing_here(self, database: Database) -> None:
        self.add(database)
        for _attempt in range(5):
            assert self.refused(database, "Ana") is None
        assert sign_in(database, "Ana", PASSWORD, "10.0.0.2", 12).token
        assert self.refused(database, "Ana") is not None

    def test_a_right_password_forgets_the_failures_of_a_known_browser(self, database: Database) -> None:
        self.add(database)
        device = sign_in(database, "Ana", PASSWORD, "10.0.0.1", 12).device
        for _round in range(3):
            for _attempt in range(4):
                with pytest.raises(SignInRefused):
                    sign_in(database, "Ana", "wrong", "10.0.0.1", 12, device)
            assert sign_in(database, "Ana", PASSWORD, "10.0.0.1", 12, device).token

    def test_a_place_is_known_of_who_was_there(self, database: Database) -> None:
        """Whoever guesses from where a colleague signs in waits as anywhere; the colleague does not."""
        self.add(database)
        self.add(database, "Bojan")
        assert sign_in(database, "Bojan", PASSWORD, "10.0.0.1", 12).token
        with database.begin() as session:
            session.add_all(LoginFailure(name=f"name {number}", address="10.0.0.1") for number in range(20))
        assert self.refused(database, "Ana", PASSWORD) is not None
        assert sign_in(database, "Bojan", PASSWORD, "10.0.0.1", 12).token

    def test_one_address_trying_many_names(self, database: Database) -> None:
        waits = [self.refused(database, f"name {number}") for number in range(22)]
        assert waits[:20] == [None] * 20
        assert waits[20] is not None

    def attack(self, database: Database, addresses: int, attempts: int = 5) -> None:
        """Strangers guess Ana's password, each until he has to wait."""
        with database.begin() as session:
            for address in range(addresses):
                for _attempt in range(attempts):
                    session.add(LoginFailure(name="ana", address=f"10.9.{address // 250}.{address % 250}"))

    def test_strangers_keep_nobody_out(self, database: Database) -> None:
        self.add(database)
        first = sign_in(database, "Ana", PASSWORD, "10.0.0.1", 12)
        self.attack(database, 200)
        assert self.refused(database, "Ana", "wrong", "10.9.0.1"), "whoever guesses waits"
        assert sign_in(database, "Ana", PASSWORD, "10.0.0.1", 12).token, "from an address where she was before"
        self.attack(database, 200)
        for _attempt in range(9):
            self.refused(database, "Ana", "wrong", "10.0.0.9")
        assert sign_in(database, "Ana", PASSWORD, "10.0.0.9", 12, first.device).token, (
            "by her browser, beside one who guesses"
        )

    def test_strangers_keep_nobody_out_of_a_new_place(self, database: Database) -> None:
        self.add(database)
        self.attack(database, 40)
        for _typed in range(2):
            assert self.refused(database, "Ana", "wrong", "10.0.0.7") is None
        assert sign_in(database, "Ana", PASSWORD, "10.0.0.7", 12).token

    def test_guessing_from_very_many_places_is_bounded(self, database: Database) -> None:
        self.add(database)
        self.attack(database, 100)
        assert self.refused(database, "Ana", "wrong", "10.0.0.8") is not None

    def test_a_known_browser_guesses_no_more_than_others(self, database: Database) -> None:
        self.add(database)
        device = sign_in(database, "Ana", PASSWORD, "10.0.0.1", 12).device
        refusals = []
        for attempt in range(7):
            try:
                sign_in(database, "Ana", "wrong", f"10.0.1.{attempt}", 12, device)
            except TooManyRequests:
                refusals.append(attempt)
            except SignInRefused:
                pass
        assert refusals == [5, 6]

    def test_addresses_of_one_network_count_together(self, database: Database) -> None:
        refused = [self.refused(database, "Ana", "wrong", f"2001:db8:1:2::{number:x}") for number in range(1, 7)]
        assert [each is None for each in refused] == [True] * 5 + [False]

    def test_a_hundred_at_once_are_not_one(self, database: Database) -> None:
        self.add(database)
        looked_at: list[bool] = []

        def attempt() -> None:
            looked_at.append(self.refused(database, "Ana") is None)

        threads = [threading.Thread(target=attempt) for _attempt in range(20)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert looked_at.count(True) == 5

    def test_the_page_says_how_long(self, people: Any) -> None:
        client = people.client()
        answers = [client.post("/sign-in", data={"name": "Guess", "password": "x"}) for _attempt in range(6)]
        assert [answer.status_code for answer in answers] == [401] * 5 + [429]
        assert 1 <= int(answers[-1].headers["retry-after"]) <= 5
        assert "Wait" in answers[-1].text


def test_a_name_that_nobody_has_takes_as_long(database: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock is not asked, which a busy computer shifts: the costs are those of the hashes that are computed."""
    with database.begin() as session:
        actions.add_person(session, name="Ana", role="viewer", password=PASSWORD, actor="tests")
        gone = actions.add_person(session, name="Gone", role="viewer", password=PASSWORD, actor="tests")
        actions.disable_person(session, gone.id, actor="tests")
    costs: list[str] = []

    class Counting:
        def verify(self, password: str, password_hash: str) -> bool:
            costs.append(password_hash.rpartition("$")[0].rpartition("$")[0])  # method, version, memory, rounds, lanes
            return hashing.verify(password, password_hash)

    hashing = passwords._hashing
    passwords.matches("warm up", None)
    monkeypatch.setattr(passwords, "_hashing", Counting())
    for name in ("Ana", "nobody", "Gone"):
        with pytest.raises(SignInRefused):
            sign_in(database, name, "wrong", "10.0.1.1", 12)
    assert len(costs) == 3
    assert len(set(costs)) == 1


@pytest.mark.parametrize(
    "path",
    [
        "//evil.example",
        "/\\evil.example",
        "https://evil.example",
        "javascript:alert(1)",
        "",
        None,
        "evil",
        "/a\nb",
        "/sign-in",
    ],
)
def test_signing_in_leads_nowhere_else(path: str | None) -> None:
    assert local_path(path) == "/"


def test_a_local_path_is_kept() -> None:
    assert local_path("/characteristics/a?last=50&scale=true") == "/characteristics/a?last=50&scale=true"


def test_a_stolen_session_does_not_find_the_password_out(people: Any) -> None:
    client = signed_in(people, "Viewer")
    csrf = token(client.get("/account").text)
    data = {"csrf": csrf, "new": "another good one", "again": "another good one"}
    answers = [client.post("/account/password", data=data | {"old": f"guess {number}"}) for number in range(5)]
    assert [answer.status_code for answer in answers] == [422] * 4 + [303]
    assert answers[-1].headers["location"] == "/sign-in?ended=password"
    assert "wrong 5 times" in client.get("/sign-in?ended=password").text
    assert client.post("/account/password", data=data | {"old": PASSWORD}).headers["location"].startswith("/sign-in")
    signed_in(people, "Viewer")  # the password is still the old one


def test_sign_ins_are_on_record(people: Any) -> None:
    admin = people.client(people.key())
    client = signed_in(people, "Engineer")
    number = client.get("/api/v1/people/me").json()["id"]
    people.client().post("/sign-in", data={"name": "Engineer", "password": "wrong"})
    people.client().post("/sign-in", data={"name": "my password in the wrong field", "password": "x"})
    client.post("/sign-out", data={"csrf": token(client.get("/account").text)})
    entries = admin.get("/api/v1/audit?limit=4").json()["items"]
    assert [(each["actor"], each["action"], each["subject"], each["person_id"]) for each in reversed(entries)] == [
        ("Engineer", "signed in", "person/Engineer", number),
        ("sign-in", "sign-in failed", "person/Engineer", None),
        ("sign-in", "sign-in failed", "people", None),
        ("Engineer", "signed out", "person/Engineer", number),
    ]
    assert entries[-1]["after"] == {"address": "127.0.0.1"}
    own = admin.get(f"/api/v1/audit?person={number}").json()["items"]
    assert {each["person_id"] for each in own} == {number}


def test_links_and_redirects_name_no_foreign_host(people: Any) -> None:
    evil = people.client(people.key(), Host="evil.example")
    link = evil.post("/api/v1/people/invitations", json={"role": "viewer"}).json()["url"]
    assert link.startswith(people.url)
    assert evil.get("/api/v1/machines/?limit=3").headers["location"] == "/api/v1/machines?limit=3"
    port = people.url.rpartition(":")[2]
    near = people.client(people.key(), Host=f"localhost:{port}")
    link = near.post("/api/v1/people/invitations", json={"role": "viewer"}).json()["url"]
    assert link.startswith(f"http://localhost:{port}/")
