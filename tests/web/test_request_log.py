"""The log of a server: what it tells of requests, by which id, and what it never tells."""

import json
import re
from collections.abc import Iterator
from typing import Any, NamedTuple

import pytest

from app.logs import without_secrets
from tests.servers import RunServer, Server
from tests.shop import PASSWORD, Shop, unique


@pytest.fixture(scope="module")
def server(run_server: RunServer) -> Iterator[Server]:
    """One that logs as JSON."""
    with run_server(log_format="json") as running:
        yield running


class Ended(NamedTuple):
    """A server that logged as text, all of it, and has ended."""

    lines: list[str]
    secrets: list[str]
    slow: str
    """The id of a request that was slow: here, each is."""


@pytest.fixture(scope="module")
def ended(run_server: RunServer) -> Ended:
    """Keys, passwords, cookies, tokens of forms, the link of an invitation: all that comes up in a session."""
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("INBAND_SLOW_REQUEST", "0.000001")  # a second by default
        with run_server(log_format="text", log_level="debug") as server:
            link = re.search(r"/invitation/(\S+)", server.stderr.read_text())
            assert link is not None
            shop = Shop(server)
            keys = [server.key("viewer"), server.key(machine=shop.machine)]
            server.person("Anna", "operator", PASSWORD)
            client = server.client()
            client.post("/sign-in", data={"name": "Anna", "password": "wrong-password"})
            client.post("/sign-in", data={"name": "Anna", "password": PASSWORD})
            secrets = [PASSWORD, "wrong-password", client.cookies["inband_session"], *keys, link[1], "w" * 43]
            client.get("/")
            client.post("/account/password", data={"old": PASSWORD, "new": "short"})
            client.post("/corrections", data={"csrf": "forged-token"})
            server.client("inband_" + "w" * 43).get("/api/v1/machines")
            server.client(keys[0]).post("/api/v1/machines", json={"key": "x", "name": PASSWORD})
            server.client(keys[1]).post("/api/v1/readings", json={"characteristic": "nope", "measured": 40.0})
            server.client().get(f"/invitation/{link[1]}")
            server.client().get(f"/invitation/{link[1]}/nothing")
            server.client().post(f"/invitation/{link[1]}", data={"name": "Eva", "password": "a", "again": "b"})
            server.client().get("/a%0a2026-01-01T00:00:00Z%20ERROR%20app%3a%20forged%1b[31m")
            slow = server.client(keys[0]).get("/api/v1/machines").headers["x-request-id"]
            assert server.stop() == 0
            lines = server.stderr.read_text().splitlines()
    return Ended(lines, [*secrets, "forged-token"], slow)


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
    common_shop: Shop, server: Server, method: str, path: str, body: Any, status: int
) -> None:
    answer = common_shop.admin.request(method, path, json=body)
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


def test_the_id_of_the_caller_is_taken_if_it_can_be(common_shop: Shop, server: Server) -> None:
    for sent, taken in (("order-17.a_B", True), ("a b", False), ("x" * 65, False), ("a\tb", False)):
        answer = common_shop.admin.get("/api/v1/machines/nope", headers={"X-Request-ID": sent})
        assert (answer.headers["x-request-id"] == sent) == taken
        assert len(logged(server, answer.headers["x-request-id"])) == 1


def test_what_goes_well_has_an_id_and_no_line(common_shop: Shop, server: Server) -> None:
    for answer in (
        common_shop.machine_client.post(
            "/api/v1/readings", json={"characteristic": common_shop.characteristic, "measured": 40.0}
        ),
        common_shop.admin.get("/health/live"),
    ):
        assert answer.is_success
        assert [line for line in logged(server, answer.headers["x-request-id"]) if line["status"] < 300] == []


def test_what_takes_long_has_a_line(ended: Ended) -> None:
    (line,) = [line for line in ended.lines if ended.slow in line]
    assert " WARNING " in line
    assert "GET /api/v1/machines 200" in line
    assert "slow" in line


def test_nobody_writes_lines_of_their_own_into_it(ended: Ended) -> None:
    assert any("forged" in line for line in ended.lines)
    assert not any(line.startswith("2026-01-01") for line in ended.lines)
    assert not any("\x1b[31m" in line for line in ended.lines)


def test_sign_ins_are_reported_by_name_and_by_address(common_shop: Shop, server: Server) -> None:
    anna = unique("Anna")
    server.person(anna, "operator", PASSWORD)
    client = server.client()
    for name, password, words in (
        (anna, "wrong-password-1", f"sign-in of {anna} from 127.0.0.1 refused"),
        ("hunter2hunter2", "wrong-password-2", "sign-in of an unknown name from 127.0.0.1 refused"),
        (anna.lower(), PASSWORD, "signed in from 127.0.0.1"),
    ):
        answer = client.post("/sign-in", data={"name": name, "password": password})
        assert any(words in line["message"] for line in logged(server, answer.headers["x-request-id"]))
    assert "hunter2hunter2" not in server.stderr.read_text()


def test_a_whole_session_leaves_no_secret_in_it(ended: Ended) -> None:
    lines = [
        line for line in ended.lines if re.match(r"\d{4}-", line)
    ]  # the link of the invitation is no line of the log
    assert len(lines) > 8
    told = "\n".join(lines)
    assert [secret for secret in ended.secrets if secret in told] == []


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


def test_it_begins_and_ends_with_what_runs_and_where(ended: Ended) -> None:
    words = [line.partition(": ")[2] for line in ended.lines if re.match(r"\d{4}-", line) and " INFO " in line]
    assert words[0].startswith("Inband 0.")
    for part in ("listen on 127.0.0.1 port", "PostgreSQL 18", "1 worker", "data folder"):
        assert part in words[0]
    assert words[-2:] == ["Inband ends", "Inband has ended"]
