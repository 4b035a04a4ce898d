"""Strangers at the door: heads without end, requests that never arrive, more connections than files."""

import asyncio
import json
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from select import select
from typing import Any

import httpx
import pytest
import uvicorn
from starlette.requests import Request

from app.web import protocol
from app.web.protocol import MOST_HEAD, ServerProtocol
from tests.servers import TLS
from tests.waits import until

PATIENCE = 0.8  # seconds; `ServerProtocol` has more


class Impatient(ServerProtocol):
    head_patience = PATIENCE
    body_patience = PATIENCE
    body_rate = 2.0


class Held:
    """Requests that are answered when the test says so."""

    def __init__(self) -> None:
        self.count = 0
        self.answered = threading.Event()


held = Held()


async def application(scope: dict[str, Any], receive: Any, send: Any) -> None:
    """Answers with the number of bytes it was sent; `/slow` takes its time, and `/held` waits until somebody says so.

    `/cookies` answers with the ms that reading them takes, `/early` before it has read a body.
    """
    body, more = b"", scope["path"] != "/early"
    while more:
        message = await receive()
        if message["type"] == "http.disconnect":
            return
        body, more = body + message.get("body", b""), message.get("more_body", False)
    if scope["path"] == "/slow":
        await asyncio.sleep(3 * PATIENCE)
    if scope["path"] == "/held":
        held.count += 1
        while not held.answered.is_set():  # noqa: ASYNC110 - set by another thread
            await asyncio.sleep(0.01)
    if scope["path"] == "/cookies":
        begun = time.thread_time()
        assert Request(scope).cookies["b"] == "1"
        body = b"x" * round(1000 * (time.thread_time() - begun))
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": str(len(body)).encode()})


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    config = uvicorn.Config(
        application, http=Impatient, ws="none", lifespan="off", log_level="critical", loop="app.web.accepting:Loop"
    )
    server = uvicorn.Server(config)
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
        thread.start()
        while not server.started:
            time.sleep(0.01)
        yield listening.getsockname()[1]
        server.should_exit = True
        thread.join()


def connected(port: int) -> socket.socket:
    client = socket.create_connection(("127.0.0.1", port))
    client.settimeout(60)
    return client


def heard(client: socket.socket) -> bytes:
    """All that the server says until it closes."""
    parts = []
    with suppress(ConnectionResetError):
        while part := client.recv(65_536):
            parts.append(part)
    return b"".join(parts)


def problem(answer: bytes) -> dict[str, Any]:
    head, _, body = answer.partition(b"\r\n\r\n")
    assert b"application/problem+json" in head
    found: dict[str, Any] = json.loads(body)
    assert str(found["status"]).encode() in head.split(b"\r\n")[0]
    return found


@pytest.mark.parametrize("pieces", [1, 40])
def test_a_head_without_end_is_refused(port: int, pieces: int) -> None:
    with connected(port) as client:
        client.sendall(b"GET / HTTP/1.1\r\nHost: x\r\nLong: ")
        for _ in range(pieces):
            client.sendall(b"a" * (4 * MOST_HEAD // pieces))
            time.sleep(0.001)
        client.sendall(b"\r\n\r\n")
        assert problem(heard(client))["status"] == 431


def test_a_head_of_the_usual_size_is_served(port: int) -> None:
    long = {"Long": "a" * (MOST_HEAD // 2)}
    answer = httpx.post(f"http://127.0.0.1:{port}/", headers=long, content=b"x" * 300_000, timeout=60, verify=TLS)
    assert answer.text == "300000"


@pytest.mark.parametrize("sign", ["\\", "\\1", "\\\\", '\\"'])
def test_a_cookie_of_backslashes_holds_up_nobody(port: int, sign: str) -> None:
    """Read for whoever asks for anything; 64 kB of them took ten seconds of the event loop."""
    cookie = {"Cookie": f'b=1; a="{sign * (MOST_HEAD * 3 // 4 // len(sign))}"'}
    answer = httpx.get(f"http://127.0.0.1:{port}/cookies", headers=cookie, timeout=60, verify=TLS)
    assert int(answer.text) < 1000  # ms of a processor; some 2 are needed


def test_anyone_who_says_nothing_is_let_go(port: int) -> None:
    with connected(port) as client:
        assert heard(client) == b""


def test_a_head_that_does_not_arrive_is_answered(port: int) -> None:
    with connected(port) as client:
        for part in (b"GET / HTTP/1.1\r\n", b"Host: x\r\n"):
            client.sendall(part)
        assert problem(heard(client))["status"] == 408


def test_a_second_request_has_as_much_time_as_the_first(port: int) -> None:
    with connected(port) as client:
        client.sendall(b"GET / HTTP/1.1\r\nHost: x\r\n\r\n")
        assert client.recv(65_536).endswith(b"0\r\n\r\n")
        client.sendall(b"GET / HTTP/1.1\r\n")
        assert problem(heard(client))["status"] == 408


def test_a_body_that_falls_silent_is_let_go(port: int) -> None:
    with connected(port) as client:
        client.sendall(b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 10\r\n\r\n12345")
        assert heard(client) == b""


def test_a_slow_body_and_a_slow_answer_are_waited_for(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    patience = 4.0  # a busy computer may lay a pause of its own between two bytes
    monkeypatch.setattr(Impatient, "body_patience", patience)
    with connected(port) as client:
        client.sendall(b"POST /slow HTTP/1.1\r\nHost: x\r\nConnection: close\r\nContent-Length: 16\r\n\r\n")
        for _ in range(4):
            time.sleep(patience / 3.5)
            client.sendall(b"xxxx")
        assert heard(client).partition(b"\r\n\r\n")[2] == b"2\r\n16\r\n0\r\n\r\n"


def test_a_body_that_drips_in_is_let_go(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is never silent, and would hold its connection for hours."""
    monkeypatch.setattr(Impatient, "body_rate", 1000.0)
    with connected(port) as client, pytest.raises(ConnectionError):
        client.sendall(b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 100000\r\n\r\n")
        deadline = time.monotonic() + 20
        while time.monotonic() < deadline:
            time.sleep(PATIENCE / 20)
            client.sendall(b"x")


def test_a_body_that_goes_on_after_its_answer_is_not_taken_for_ever(port: int) -> None:
    """A stranger hears 401 at once, and could go on sending as long as the wires carry it."""
    with connected(port) as client:
        client.sendall(b"POST /early HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n")
        assert client.recv(65_536).startswith(b"HTTP/1.1 200")
        deadline = time.monotonic() + 20
        with pytest.raises(ConnectionError):
            while time.monotonic() < deadline:
                client.sendall(b"64\r\n" + b"x" * 100 + b"\r\n")
                time.sleep(PATIENCE / 100)


def test_a_body_that_ends_after_its_answer_leaves_the_connection_to_the_next_request(
    port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Impatient, "head_patience", 30.0)
    monkeypatch.setattr(Impatient, "body_patience", 30.0)
    with connected(port) as client:
        client.sendall(b"POST /early HTTP/1.1\r\nHost: x\r\nContent-Length: 10\r\n\r\n12345")
        assert client.recv(65_536).startswith(b"HTTP/1.1 200")
        client.sendall(b"67890GET / HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n")
        assert heard(client).startswith(b"HTTP/1.1 200")


class TestMoreConnectionsThanFiles:
    @pytest.fixture(autouse=True)
    def few(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(protocol, "most_connections", lambda: 3)
        monkeypatch.setattr(Impatient, "head_patience", 30.0)  # they are not let go by themselves

    def test_the_silent_make_room(self, port: int) -> None:
        with ExitStack() as end:
            silent = [end.enter_context(connected(port)) for _ in range(6)]
            assert httpx.get(f"http://127.0.0.1:{port}/", timeout=60, verify=TLS).text == "0"
            # Of those that came within one round of the server's loop, none has been silent longer than another.
            until(lambda: len(select(silent, [], [], 0)[0]) >= 4)
            assert [heard(client) for client in select(silent, [], [], 0)[0]] == [b""] * 4

    def test_where_all_are_served_a_new_one_is_asked_to_come_back(self, port: int) -> None:
        held.answered.clear()
        busy, before = [connected(port) for _ in range(3)], held.count
        for client in busy:
            client.sendall(b"GET /held HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n")
        until(lambda: held.count == before + len(busy))
        refused = httpx.get(f"http://127.0.0.1:{port}/", timeout=60, verify=TLS)
        assert (refused.status_code, refused.headers["retry-after"]) == (503, "5")
        held.answered.set()
        for client in busy:
            assert heard(client).startswith(b"HTTP/1.1 200")
            client.close()
