"""What the clients do when answers are late, lost or strange: against a server that plays a script."""

import json
import shutil
import socketserver
import ssl
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import httpx
import pytest

from inband_client import Event, NotFound, ProblemError, Stopped, Unavailable, Untrusted
from inband_client.attempts import LONGEST_ASKED, Attempts, problem_of
from inband_client.connection import options
from inband_client.feed import Feed
from tests.client.conftest import Connect, Either

DECISION = {
    "characteristic": "c",
    "sequence": 1,
    "measured": 40.0,
    "deviation": 0.0,
    "zone": "zero",
    "action": "none",
    "reason": {"code": "within_zero_range", "text": "within"},
    "of_a_newer_server": [1, 2],
}
AWAY = {
    "type": "urn:inband:problem:database-away",
    "title": "The database is unreachable",
    "detail": "Nothing was stored.",
}
UNKNOWN = {"type": "urn:inband:problem:outcome-unknown", "title": "Unknown", "detail": "Nobody knows."}
CUT = None
Step = bytes | None | Callable[[], bytes]


def answer(status: int, document: Any = None, *, kind: str = "application/json", **headers: str) -> bytes:
    """A whole answer; the line is closed after it."""
    body = document if isinstance(document, bytes) else json.dumps(document).encode()
    lines = [f"HTTP/1.1 {status} Said", f"Content-Type: {kind}", f"Content-Length: {len(body)}", "Connection: close"]
    lines += [f"{name.replace('_', '-')}: {value}" for name, value in headers.items()]
    return "\r\n".join([*lines, "", ""]).encode() + body


def stream(text: str) -> bytes:
    """Server-sent events, and then a cut line."""
    return f"HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\n\r\n{text}".encode()


class Script(socketserver.ThreadingTCPServer):
    """Answers requests one after the other by a script, and keeps what was asked; after its end it cuts the line."""

    daemon_threads = True
    allow_reuse_address = True

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), Line)
        self.steps: list[Step] = []
        self.asked: list[tuple[str, dict[str, str], bytes]] = []
        self.url = f"http://127.0.0.1:{self.server_address[1]}"

    @property
    def bodies(self) -> list[Any]:
        return [json.loads(body) for _line, _headers, body in self.asked]


class Line(socketserver.StreamRequestHandler):
    server: Script

    def handle(self) -> None:
        first = self.rfile.readline().decode().strip()
        if not first:
            return
        headers = {}
        while line := self.rfile.readline().decode().strip():
            name, _colon, value = line.partition(": ")
            headers[name.lower()] = value
        body = self.rfile.read(int(headers.get("content-length", 0)))
        self.server.asked.append((first, headers, body))
        step = self.server.steps.pop(0) if self.server.steps else CUT
        said = step() if callable(step) else step
        if said is not None:
            with suppress(OSError):  # whom it is for did not wait
                self.wfile.write(said)


@pytest.fixture
def script() -> Iterator[Script]:
    with Script() as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True)
        thread.start()
        yield server
        server.shutdown()
        thread.join()


@pytest.fixture(scope="session")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A certificate of 127.0.0.1 that nobody has signed but itself, with its key."""
    if (openssl := shutil.which("openssl")) is None:
        pytest.skip("there is no openssl here")
    path = tmp_path_factory.mktemp("certificate") / "own.pem"
    names = ["-subj", "/CN=127.0.0.1", "-addext", "subjectAltName=IP:127.0.0.1"]
    command: list[str | Path] = [
        openssl,
        "req",
        "-x509",
        "-newkey",
        "rsa:2048",
        "-nodes",
        "-days",
        "2",
        *names,
        "-keyout",
        path,
    ]
    made = subprocess.run([*command, "-out", path.with_suffix(".crt")], capture_output=True, text=True)
    assert made.returncode == 0, made.stderr
    path.write_text(path.read_text() + path.with_suffix(".crt").read_text())
    return path


@pytest.fixture
def tls(script: Script, certificate: Path) -> Script:
    """The same with https."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificate)
    script.socket = context.wrap_socket(script.socket, server_side=True)
    script.url = script.url.replace("http:", "https:")
    return script


@pytest.fixture
def client(connect: Connect, script: Script) -> Either:
    return connect(script.url, "key")


class TestTryingAgain:
    def test_the_same_reading_is_sent_with_the_same_key_until_it_is_answered(
        self, client: Either, script: Script
    ) -> None:
        script.steps = [
            answer(503, AWAY, Retry_After="0"),
            CUT,
            answer(500, b"oops"),
            answer(429),
            answer(201, DECISION),
        ]
        decision = client.push(characteristic="c", measured=40.0)
        assert decision.sequence == 1
        assert decision.extra == {"of_a_newer_server": [1, 2]}
        assert len(script.bodies) == 5
        assert len({body["key"] for body in script.bodies}) == 1

    def test_an_answer_that_is_late_is_asked_for_again(self, connect: Connect, script: Script) -> None:
        release = threading.Event()

        def late() -> bytes:
            release.wait(30)
            return answer(201, DECISION)

        script.steps = [late, answer(201, DECISION | {"sequence": 2})]
        assert connect(script.url, "key", timeout=1.0).push(characteristic="c", measured=40.0).sequence == 2
        release.set()
        assert script.bodies[0] == script.bodies[1]

    def test_what_may_have_happened_is_not_repeated_unless_that_is_harmless(
        self, client: Either, script: Script
    ) -> None:
        for step in (CUT, answer(503, UNKNOWN), answer(502, b"<html>proxy</html>", kind="text/html")):
            script.steps, script.asked = [step, answer(201, {})], []
            with pytest.raises(Unavailable, match="may have been carried out") as lost:
                client.post("/machines", {"key": "m"})
            assert lost.value.may_have_happened
            assert len(script.asked) == 1
        script.steps, script.asked = [CUT, answer(201, {"done": True})], []
        assert client.post("/machines/m/tools/3/change", {"offset": 0.0}, repeat=True) == {"done": True}

    def test_what_surely_did_not_happen_is_repeated(self, client: Either, script: Script) -> None:
        script.steps = [answer(429, Retry_After="0"), answer(503, AWAY), answer(201, {"key": "m"})]
        assert client.post("/machines", {"key": "m"}) == {"key": "m"}

    def test_a_refusal_is_not_repeated(self, client: Either, script: Script) -> None:
        script.steps = [answer(404, {"title": "Not found", "detail": "There is no machine."})]
        with pytest.raises(NotFound, match=r"^GET /machines/m/corrections: 404 Not found\. There is no machine\.$"):
            client.pending("m")
        assert len(script.asked) == 1

    def test_patience_ends_and_says_what_came_last(self, connect: Connect, script: Script) -> None:
        script.steps = [answer(503, AWAY, X_Request_ID="r-17", Retry_After="9")]
        with pytest.raises(Unavailable, match=r"503 Nothing was stored") as given_up:
            connect(script.url, "key", patience=5).push(characteristic="c", measured=40.0)
        assert (given_up.value.status, given_up.value.request_id) == (503, "r-17")
        assert given_up.value.may_have_happened is False
        assert isinstance(given_up.value.__cause__, ProblemError)

    def test_one_attempt_is_made_without_any_patience(self, connect: Connect, script: Script) -> None:
        with pytest.raises(Unavailable, match="No answer: ") as given_up:
            connect(script.url, "key", patience=0).push(characteristic="c", measured=40.0)
        assert given_up.value.may_have_happened is True
        assert len(script.asked) == 1


class TestThePlan:
    def plan(self) -> Attempts:
        return Attempts("GET /x", repeat=True, patience=None, clock=lambda: 0.0, jitter=lambda: 1.0)

    def test_pauses_double_up_to_a_limit_and_are_spread(self) -> None:
        plan = self.plan()
        pauses = [plan.failed(httpx.ReadError("cut")) for _attempt in range(9)]
        assert pauses == [0.2, 0.4, 0.8, 1.6, 3.2, 6.4, 10.0, 10.0, 10.0]
        spread = Attempts("GET /x", repeat=True, patience=None, clock=lambda: 0.0, jitter=lambda: 0.0)
        assert spread.failed(httpx.ReadError("cut")) == 0.1

    @pytest.mark.parametrize(
        ("said", "pause"),
        [
            ("7", 7.0),
            ("86400", LONGEST_ASKED),
            ("soon", 0.2),
            ("Sat, 01 Jan 2000 00:00:00 GMT", 0.2),
            ("²", 0.2),
        ],
    )
    def test_retry_after_is_honoured_within_reason(self, said: str, pause: float) -> None:
        headers = [(b"Retry-After", said.encode("latin-1"))]
        assert self.plan().refused(httpx.Response(503, headers=headers)) == pause

    def test_a_success_between_brings_patience_back(self) -> None:
        now = [0.0]
        plan = Attempts("GET /x", repeat=True, patience=5, clock=lambda: now[0], jitter=lambda: 1.0)
        plan.failed(httpx.ReadError("cut"))
        now[0] = 100.0
        plan.begin()
        assert plan.failed(httpx.ReadError("cut")) == 0.2
        now[0] = 105.0
        with pytest.raises(Unavailable, match=r"2 attempts in 5 s"):
            plan.failed(httpx.ReadError("cut"))


class TestStrangeAnswers:
    @pytest.mark.parametrize(
        "said",
        [
            answer(200, b"<html>Sign in to our network</html>", kind="text/html"),
            answer(200, b"\xff\xfe{", kind="application/json"),
            answer(200, []),
            answer(200, {"items": 3}),
            answer(200, {"items": [{"number": "eleven"}]}),
            answer(200, {"items": [{"number": 11}]}),
            answer(204, b""),
        ],
    )
    def test_an_answer_of_somebody_else_is_an_error_that_says_so(
        self, client: Either, script: Script, said: bytes
    ) -> None:
        script.steps = [said]
        with pytest.raises(ProblemError, match=r"cannot be read.*Check that the address is that of an Inband server"):
            client.pending("m")

    def test_another_address_is_named_and_the_key_not_carried_there(self, client: Either, script: Script) -> None:
        script.steps = [answer(308, b"", Location="https://inband.example/api/v1/readings")]
        with pytest.raises(ProblemError, match=r"sends this call to another address: https://inband\.example/api"):
            client.push(characteristic="c", measured=1.0)
        assert len(script.asked) == 1

    def test_each_sentence_of_a_refusal_ends(self) -> None:
        document = {"title": "Cannot be used", "detail": "state: must be one of these", "what_to_do": "Correct it."}
        error = problem_of("POST /x", httpx.Response(422, json=document))
        assert str(error) == "POST /x: 422 Cannot be used. state: must be one of these. Correct it."

    @pytest.mark.parametrize("document", [b"", b"[]", b'"no"', b'{"errors": [3, {}], "detail": 4, "title": null}'])
    def test_a_refusal_without_a_problem_document_is_read_all_the_same(self, document: bytes) -> None:
        error = problem_of("GET /x", httpx.Response(404, content=document))
        assert isinstance(error, NotFound)
        assert str(error).startswith("GET /x: 404")

    def test_a_certificate_that_is_not_trusted_is_reported_at_once(
        self, connect: Connect, tls: Script, certificate: Path
    ) -> None:
        tls.steps = [answer(200, {"items": [], "next": None})]
        with pytest.raises(Untrusted, match=r"certificate of 127\.0\.0\.1 is not trusted: self.signed"):
            connect(tls.url, "key", patience=None).pending("m")
        assert connect(tls.url, "key", verify=certificate.with_suffix(".crt")).pending("m") == []


class TestFollowing:
    def test_a_cut_line_is_taken_up_where_it_was(self, client: Either, script: Script) -> None:
        script.steps = [
            stream('retry: 10\n\nid: 7\nevent: hello\ndata: {}\n\nevent: reading\nid: 8\ndata: {"machine":"m",'
                   '"sequence":3}\n\nevent: alarm\nid: 9\nda'),
            answer(503, AWAY, Retry_After="0"),
            stream('id: 8\nevent: hello\ndata: {}\n\nevent: heartbeat\ndata: {}\n\nevent: alarm\nid: 9\ndata: {"id":4}\n\n'),
        ]  # fmt: skip
        events = client.follow()
        told = [next(events) for _event in range(4)]
        assert [event.kind for event in told] == ["hello", "reading", "hello", "alarm"]
        assert told[1] == Event(kind="reading", event_id=8, machine="m", sequence=3)
        assert told[3].id == 4
        resumed = [headers.get("last-event-id") for _line, headers, _body in script.asked]
        assert resumed == [None, "8", "8"]

    def test_anyone_who_follows_after_a_number_says_so_and_hears_heartbeats_if_asked(
        self, client: Either, script: Script
    ) -> None:
        script.steps = [stream("event: heartbeat\ndata: {}\n\n")]
        assert next(client.follow(41, heartbeats=True)).kind == "heartbeat"
        assert script.asked[0][1]["last-event-id"] == "41"

    def test_a_revoked_key_ends_it(self, client: Either, script: Script) -> None:
        script.steps = [stream("retry: 0\n\nevent: hello\ndata: {}\n\n"), answer(401, {"detail": "unknown key"})]
        events = client.follow()
        assert next(events).kind == "hello"
        with pytest.raises(ProblemError, match="401"):
            next(events)

    def test_it_can_be_stopped(self, client: Either, script: Script) -> None:
        script.steps = [stream("retry: 60000\n\nevent: hello\ndata: {}\n\n")]
        events = client.follow()
        assert next(events).kind == "hello"
        threading.Timer(0.2, client.stop).start()
        with pytest.raises(Stopped):
            next(events)

    def test_bytes_may_come_in_any_pieces(self) -> None:
        text = 'retry: 500\r\n\r\n: comment\n\nid: 5\nevent: tool\ndata: {"tool":\ndata: 3, "name": "Ø 40\u2028"}\n\ndata: x\n\n'
        for size in (1, 2, 3, 7, 1000):
            feed, raw = Feed(None), text.encode()
            events = [event for at in range(0, len(raw), size) for event in feed.events(raw[at : at + size])]
            tool = Event(kind="tool", event_id=5, tool=3, extra={"name": "Ø 40\u2028"})
            assert events == [tool, Event(kind="message")]
            assert (feed.last, feed.pause) == (5, 0.5)

    def test_a_field_of_another_type_than_today_is_reported_all_the_same(self) -> None:
        (event,) = Feed(None).events(b'event: tool\ndata: {"tool": "T3"}\n\n')
        assert event == Event(kind="tool", extra={"tool": "T3"})


class TestAddresses:
    @pytest.mark.parametrize(
        "url", ["", "inband.example", "ftp://inband.example", "http://", "https://h/?x=1", "https://a:b@h"]
    )
    def test_what_is_no_address_is_refused_with_an_example(self, connect: Connect, url: str) -> None:
        with pytest.raises(ValueError, match=r"write it as https://|give the key as the second argument"):
            connect(url, "key")

    @pytest.mark.parametrize("key", ["", " ", "two words", "schlüssel", "a\nb"])
    def test_what_is_no_key_is_refused(self, connect: Connect, key: str) -> None:
        with pytest.raises(ValueError, match="This is no key"):
            connect("http://127.0.0.1:1", key)

    def test_a_plants_prefix_and_names_with_strange_letters_stay_in_the_path(
        self, connect: Connect, script: Script
    ) -> None:
        script.steps = [answer(200, {"items": [], "next": None})]
        assert connect(f"{script.url}/p/east/", "key").pending("a/b?c") == []
        assert script.asked[0][0].startswith(
            "GET /p/east/api/v1/machines/a%2Fb%3Fc/corrections?limit=1000&status=pending"
        )

    def test_a_proxy_of_the_office_is_none_of_ours(
        self, connect: Connect, script: Script, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setenv("HTTP_PROXY", "http://127.0.0.1:9")
        monkeypatch.delenv("NO_PROXY", raising=False)
        script.steps = [answer(200, {"items": [], "next": None})]
        assert connect(script.url, "key").pending("m") == []
        assert script.asked[0][1]["authorization"] == "Bearer key"

    def test_a_file_that_is_no_certificate_is_named(self, tmp_path: Path) -> None:
        with pytest.raises(ValueError, match="There is no file"):
            options("https://h", "key", verify=tmp_path / "ca.pem", timeout=1)
        (tmp_path / "ca.pem").write_text("no certificate")
        with pytest.raises(ValueError, match="holds no certificate"):
            options("https://h", "key", verify=tmp_path / "ca.pem", timeout=1)
