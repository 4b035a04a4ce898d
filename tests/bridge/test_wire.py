"""The connections to the server: kept, closed by the other side, silent, cut in the middle of an answer."""

import asyncio
import ssl
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import httpx
import pytest

from app.bridge import server_side
from app.bridge.certificates import new_pair
from app.bridge.checking import check
from app.bridge.configuration import configuration_from
from app.bridge.unit import ended
from app.bridge.wire import Wire
from app.simulators.controls.model import Model
from inband_client import AsyncClient, Unavailable, Untrusted
from tests.bridge.plant import store_in, unit_of, until
from tests.loops import run

FOLDER = {
    "kind": "folder",
    "unit": "mm",
    "secret": "key",
    "corrections": "none",
    "characteristics": {"1": "bore"},
    "folder": {"path": "/", "format": "csv"},
}
ANSWER = b"HTTP/1.1 200 OK\r\nContent-Length: 12\r\n\r\n" + b'{"items":[]}'
TO_THE_END = b'HTTP/1.0 200 OK\r\nConnection: close\r\n\r\n{"items":[]}'
CHUNKED = b'HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n5\r\n{"ite\r\n7\r\nms":[]}\r\n0\r\n\r\n'


class Server:
    """One that answers as it is told. heard: every request; connections: how many were made."""

    def __init__(self, *answers: bytes | None) -> None:
        self.answers = list(answers)
        self.heard: list[bytes] = []
        self.connections = 0
        self.port = 0
        self.tasks: set[asyncio.Task[None] | None] = set()

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.connections += 1
        self.tasks.add(asyncio.current_task())
        try:
            await self._answers(reader, writer)
        finally:
            writer.transport.abort()

    async def _answers(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while head := await self._request(reader):
            self.heard.append(head)
            answer = self.answers.pop(0)
            if answer is None:
                await reader.read()  # silent until the other side hangs up
                break
            for byte in range(0, len(answer), 7):  # in pieces
                writer.write(answer[byte : byte + 7])
                await writer.drain()
            if b"close" in answer or not answer.endswith((b"}", b"\n")):
                await writer.drain()
                writer.close()
                await writer.wait_closed()
                break

    async def _request(self, reader: asyncio.StreamReader) -> bytes:
        try:
            head = await reader.readuntil(b"\r\n\r\n")
        except (asyncio.IncompleteReadError, OSError):
            return b""
        length = next((int(line[15:]) for line in head.split(b"\r\n") if line.lower().startswith(b"content-length")), 0)
        return head + await reader.readexactly(length)


@asynccontextmanager
async def server(*answers: bytes | None, secure: ssl.SSLContext | None = None) -> AsyncIterator[Server]:
    there = Server(*answers)
    listening = await asyncio.start_server(there.serve, "127.0.0.1", 0, ssl=secure)
    there.port = listening.sockets[0].getsockname()[1]
    try:
        yield there
    finally:
        listening.close()
        await ended([task for task in there.tasks if task is not None])
        await asyncio.sleep(0)  # connections are closed by the loop


def client(port: int, wire: Wire, scheme: str = "http", timeout: float = 10.0) -> AsyncClient:
    return AsyncClient(f"{scheme}://127.0.0.1:{port}", "key", patience=0.0, transport=wire, timeout=timeout)


def trusting() -> Wire:
    return Wire(ssl.create_default_context())


def test_one_connection_serves_several_clients_one_after_the_other() -> None:
    async def story() -> None:
        wire = trusting()
        async with server(ANSWER, CHUNKED, ANSWER) as there:
            for each in (client(there.port, wire), client(there.port, wire)):
                assert await each.get("/machines", limit=3) == {"items": []}
                await each.close()
            assert await client(there.port, wire).post("/readings", {"a": "ü"}) == {"items": []}
            assert there.connections == 1
            assert there.heard[0].startswith(b"GET /api/v1/machines?limit=3 HTTP/1.1\r\n")
            assert b"authorization: bearer key" in there.heard[0].lower()
            assert there.heard[2].endswith('{"a":"ü"}'.encode())
            wire.close()

    run(story())


def test_requests_at_the_same_time_have_connections_of_their_own() -> None:
    async def story() -> None:
        wire = trusting()
        async with server(ANSWER, ANSWER) as there:
            each = client(there.port, wire)
            await asyncio.gather(each.get("/a"), each.get("/b"))
            assert there.connections == 2
            wire.close()

    run(story())


def test_a_connection_that_the_server_has_closed_is_not_used_again() -> None:
    async def story() -> None:
        wire = trusting()
        closing = ANSWER.replace(b"OK\r\n", b"OK\r\nConnection: close\r\n")
        async with server(closing, ANSWER) as there:
            each = client(there.port, wire)
            assert await each.get("/a") == await each.get("/b")
            assert there.connections == 2
            wire.close()

    run(story())


@pytest.mark.parametrize(
    "answer",
    [
        TO_THE_END,
        b"HTTP/1.1 100 Continue\r\n\r\n" + ANSWER,
        b"HTTP/1.1 103 Early Hints\r\nLink: </a>\r\n\r\n" + CHUNKED,
    ],
    ids=["ends with the connection", "100", "103"],
)
def test_answers_of_proxies_are_read_whole(answer: bytes) -> None:
    async def story() -> None:
        wire = trusting()
        async with server(answer, ANSWER) as there:
            each = client(there.port, wire)
            assert await each.get("/a") == await each.get("/b") == {"items": []}
            wire.close()

    run(story())


@pytest.mark.parametrize("empty", [b"204 No Content", b"304 Not Modified"])
def test_an_answer_without_content_leaves_the_connection_usable(empty: bytes) -> None:
    async def story() -> None:
        wire = trusting()
        async with server(b"HTTP/1.1 %b\r\n\r\n" % empty, ANSWER) as there, httpx.AsyncClient(transport=wire) as each:
            for status, content in ((int(empty[:3]), b""), (200, b'{"items":[]}')):
                answer = await each.get(f"http://127.0.0.1:{there.port}/a")
                assert (answer.status_code, answer.content) == (status, content)
            assert there.connections == 1
            wire.close()

    run(story())


def test_an_answer_that_nobody_asked_for_is_not_taken_for_the_next() -> None:
    async def story() -> None:
        wire = trusting()
        foreign = ANSWER.replace(b"items", b"other")
        async with server(ANSWER + foreign, ANSWER) as there:
            each = client(there.port, wire)
            assert await each.get("/a") == await each.get("/b") == {"items": []}
            assert there.connections == 2
            wire.close()

    run(story())


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: x\r\nConnection: Upgrade\r\n\r\n", "No answer"),
        (CHUNKED[:-9], "without a whole answer"),
        (None, "no answer in time"),
        (ANSWER[:-3], "without a whole answer"),
        (b"SSH-2.0-OpenSSH\r\n", "HTTP"),
    ],
)
def test_no_answer_is_reported_and_the_next_request_has_a_new_connection(answer: bytes | None, words: str) -> None:
    async def story() -> None:
        wire = trusting()
        async with server(answer, ANSWER) as there:
            with pytest.raises(Unavailable, match=words):
                await client(there.port, wire, timeout=0.5).get("/a")
            assert await client(there.port, wire).get("/b") == {"items": []}
            assert there.connections == 2
            wire.close()

    run(story())


def test_an_address_where_nobody_listens_is_reported() -> None:
    async def story() -> None:
        async with server() as there:
            pass
        with pytest.raises(Unavailable, match="No answer"):
            await client(there.port, trusting()).get("/a")

    run(story())


def signed_by_nobody(folder: Path) -> ssl.SSLContext:
    pair = new_pair("server", "127.0.0.1", "urn:inband:test")
    (folder / "key.pem").write_bytes(pair.key)
    (folder / "public.pem").write_text(ssl.DER_cert_to_PEM_cert(pair.certificate), encoding="ascii")
    secure = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    secure.load_cert_chain(folder / "public.pem", folder / "key.pem")
    return secure


def test_a_certificate_that_nobody_has_signed_is_refused(tmp_path: Path) -> None:
    async def story() -> None:
        async with server(ANSWER, secure=signed_by_nobody(tmp_path)) as there:
            each = client(there.port, trusting(), "https")
            with pytest.raises(Untrusted, match="is not trusted") as refused:
                await each.get("/a")
            _, words = server_side._sentence(unit_of(Model(), store_in(tmp_path)), refused.value)
            assert "if it is right, name the authority that signed the certificate in server.ca." in words
            content = {"server": {"url": f"https://127.0.0.1:{there.port}"}, "machine": {"mill-2": FOLDER}}
            found = await check(configuration_from(content, tmp_path))
            assert any(str(each).startswith("✗ mill-2: The certificate of 127.0.0.1") for each in found)
            assert any("in server.ca" in each.words for each in found)

    run(story())


def test_a_request_that_is_cancelled_leaves_no_connection_behind() -> None:
    async def story() -> None:
        wire = trusting()
        async with server(None, ANSWER) as there:
            asking = asyncio.create_task(client(there.port, wire).get("/a"))
            await until(lambda: there.heard, "the request is there")
            asking.cancel()
            with pytest.raises(asyncio.CancelledError):
                await asking
            assert await client(there.port, wire).get("/b") == {"items": []}
            assert there.connections == 2
            wire.close()

    run(story())
