"""The log of a server: what it tells of requests, by which id, and what it never tells."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from app.logs import without_secrets
from tests.conftest import NewDatabase, RunServer, Server
from tests.shop import Shop

PASSWORD = "correct horse battery"


@pytest.fixture(scope="module")
def server(run_server: RunServer) -> Iterator[Server]:
    with run_server(log_format="json") as running:
        yield running


def logged(server: Server, request_id: str) -> list[dict[str, Any]]:
    """The lines that belong to a request."""
    lines = [json.loads(line) for line in server.stderr.read_text().splitlines() if line.startswith("{")]
    return [line for line in lines if line.get("request_id") == request_id]


@pytest.mark.parametrize(
    ("method", "path", "body", "status"),
    [
        ("GET", "/api/v1/machines/nope", None, 404),
        ("POST", "/api/v1/machines", {"key": "m"}, 422),
        ("POST", "/api/v1/readings", {"characteristic": "nope", "measured": 1}, 404),
        ("GET", "/nope", None, 404),
    ],
)
def test_a_refusal_is_one_line_with_its_reason_under_the_id_that_was_answered(
    shop: Shop, server: Server, method: str, path: str, body: Any, status: int
) -> None:
    answer = shop.admin.request(method, path, json=body)
    assert answer.status_code == status
    number = answer.headers["x-request-id"]
    (line,) = logged(server, number)
    assert (line["method"], line["path"], line["status"], line["level"]) == (method, path, status, "info")
    assert line["address"] == "127.0.0.1"
    if path.startswith("/api/"):
        assert answer.json()["request_id"] == number
        assert answer.json()["detail"] in line["message"]
        assert line["caller"] == "key a test's key"
    else:
        assert number in answer.text


def test_the_id_of_the_caller_is_taken_if_it_can_be(shop: Shop, server: Server) -> None:
    for sent, taken in (("order-17.a_B", True), ("a b", False), ("x" * 65, False), ("a\tb", False)):
        answer = shop.admin.get("/api/v1/machines/nope", headers={"X-Request-ID": sent})
        assert (answer.headers["x-request-id"] == sent) == taken
        assert len(logged(server, answer.headers["x-request-id"])) == 1


def test_what_goes_well_has_an_id_and_no_line(shop: Shop, server: Server) -> None:
    for answer in (
        shop.machine_client.post("/api/v1/readings", json={"characteristic": shop.characteristic, "measured": 40.0}),
        shop.admin.get("/health/live"),
    ):
        assert answer.is_success
        assert [line for line in logged(server, answer.headers["x-request-id"]) if line["status"] < 300] == []


def test_what_takes_long_has_a_line(run_server: RunServer, new_database: NewDatabase) -> None:
    """A second is long by default; here everything is."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("INBAND_SLOW_REQUEST", "0.000001")
        with run_server(log_format="text") as server:
            answer = server.client(server.key()).get("/api/v1/machines")
            (line,) = [
                each for each in server.stderr.read_text().splitlines() if answer.headers["x-request-id"] in each
            ]
    assert " WARNING " in line
    assert "GET /api/v1/machines 200" in line
    assert "slow" in line


def test_nobody_writes_lines_of_their_own_into_it(shop: Shop, server: Server, run_server: RunServer) -> None:
    with run_server(log_format="text") as other:
        other.client().get("/a%0a2026-01-01T00:00:00Z%20ERROR%20app%3a%20forged%1b[31m")
        assert "forged" in other.stderr.read_text()
        assert not any(line.startswith("2026-01-01") for line in other.stderr.read_text().splitlines())
        assert "\x1b[31m" not in other.stderr.read_text()


def test_sign_ins_are_told_by_name_and_by_address(shop: Shop, server: Server) -> None:
    server.person("Anna", "operator", PASSWORD)
    client = server.client()
    for name, password, words in (
        ("Anna", "wrong-password-1", "sign-in of Anna from 127.0.0.1 refused"),
        ("hunter2hunter2", "wrong-password-2", "sign-in of an unknown name from 127.0.0.1 refused"),
        ("anna", PASSWORD, "signed in from 127.0.0.1"),
    ):
        answer = client.post("/sign-in", data={"name": name, "password": password})
        assert any(words in line["message"] for line in logged(server, answer.headers["x-request-id"]))
    assert "hunter2hunter2" not in server.stderr.read_text()


def test_a_whole_session_leaves_no_secret_in_it(run_server: RunServer) -> None:
    """Keys, passwords, cookies, tokens of forms, links of invitations, the address of the database."""
    with run_server(log_format="text", log_level="debug") as server:
        link = re.search(r"/invitation/(\S+)", server.stderr.read_text())
        assert link is not None
        secrets = [PASSWORD, "wrong-password"]
        shop = Shop(server)
        keys = [server.key("viewer"), server.key(machine=shop.machine)]
        server.person("Anna", "operator", PASSWORD)
        client = server.client()
        client.post("/sign-in", data={"name": "Anna", "password": "wrong-password"})
        client.post("/sign-in", data={"name": "Anna", "password": PASSWORD})
        secrets += [client.cookies["inband_session"], *keys]
        client.get("/")
        client.post("/account/password", data={"old": PASSWORD, "new": "short"})
        client.post("/corrections", data={"csrf": "forged-token"})
        server.client("inband_" + "w" * 43).get("/api/v1/machines")
        server.client(keys[0]).post("/api/v1/machines", json={"key": "x", "name": PASSWORD})
        server.client(keys[1]).post("/api/v1/readings", json={"characteristic": "nope", "measured": 40.0})
        server.client().get(f"/invitation/{link[1]}")
        server.client().get(f"/invitation/{link[1]}/nothing")
        server.client().post(f"/invitation/{link[1]}", data={"name": "Eva", "password": "a", "again": "b"})
        server.stop()
        lines = [line for line in server.stderr.read_text().splitlines() if re.match(r"\d{4}-", line)]
    assert len(lines) > 8
    told = "\n".join(lines)
    assert [secret for secret in (*secrets, link[1], "w" * 43, "forged-token") if secret in told] == []


@pytest.mark.parametrize(
    ("text", "kept", "gone"),
    [
        ("no connection to postgresql://me:hun@ter2@db:5432/x", "db:5432/x", "ter2"),
        ("postgresql+psycopg://me:hunter2@/x?host=/run", "/x?host=/run", "hunter2"),
        ("user=me password=hunter2 host=db", "host=db", "hunter2"),
        ("Authorization: Bearer inband_abc", "Authorization", "inband_abc"),
        ("(x) [SQL: INSERT INTO t] [parameters: {'password_hash': 'hunter2'}]", "INSERT INTO t", "hunter2"),
    ],
)
def test_what_is_known_to_be_secret_is_taken_out(text: str, kept: str, gone: str) -> None:
    said = without_secrets(text)
    assert kept in said
    assert gone not in said


def test_it_begins_and_ends_with_what_runs_and_where(run_server: RunServer, tmp_path: Path) -> None:
    with run_server(log_format="json") as server:
        server.stop()
        lines = [json.loads(line) for line in server.stderr.read_text().splitlines() if line.startswith("{")]
    words = [line["message"] for line in lines]
    assert words[0].startswith("Inband 0.")
    for part in ("listen on 127.0.0.1 port", "PostgreSQL 18", "1 worker", "data folder"):
        assert part in words[0]
    assert words[-2:] == ["Inband ends", "Inband has ended"]
