"""Signing in and out of a browser: passwords, throttling, the token of forms, the end of sessions."""

import re
import threading
import time
from typing import Any

import httpx
import pytest

from app.db.engine import Database
from app.errors import TooManyRequests
from app.people import actions
from app.people.sign_in import SignInRefused, sign_in
from app.web.problems import local_path

PASSWORD = "correct horse battery"


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
def test_what_is_wrong_is_not_told(people: Any, name: str, password: str) -> None:
    answer = people.client().post("/sign-in", data={"name": name, "password": password})
    if "\0" in name:
        assert answer.status_code == 422
    else:
        assert answer.status_code in {401, 429}
        if answer.status_code == 401:
            assert "Name and password do not belong together" in answer.text
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
        assert self.refused(database, "ANA", PASSWORD) in {4, 5}, "the right password waits too"
        assert self.refused(database, "Ana", PASSWORD, "10.0.0.2") is None, "not from elsewhere"

    def test_a_right_password_forgets_the_failures(self, database: Database) -> None:
        self.add(database)
        for _round in range(3):
            for _attempt in range(4):
                assert self.refused(database, "Ana") is None
            assert sign_in(database, "Ana", PASSWORD, "10.0.0.1", 12).token

    def test_one_address_trying_many_names(self, database: Database) -> None:
        waits = [self.refused(database, f"name {number}") for number in range(22)]
        assert waits[:20] == [None] * 20
        assert waits[20] is not None

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


def test_a_name_that_nobody_has_takes_as_long(database: Database) -> None:
    with database.begin() as session:
        actions.add_person(session, name="Ana", role="viewer", password=PASSWORD, actor="tests")

    def seconds(name: str) -> float:
        best = 9.0
        for attempt in range(3):
            began = time.perf_counter()
            with pytest.raises(SignInRefused):
                sign_in(database, name, "wrong", f"10.0.1.{attempt}", 12)
            best = min(best, time.perf_counter() - began)
        return best

    seconds("warm up")
    assert seconds("nobody") == pytest.approx(seconds("Ana"), rel=0.6)


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
