"""Requests whose bodies come in pieces, and how much of them the application asked for."""

import asyncio
from contextlib import suppress
from typing import Any, NamedTuple

from starlette.types import Message

from app.language.times import keep_time_of
from tests.in_process import Direct, InProcess

PIECE = 4000
"""Bytes of a piece."""


class Sent(NamedTuple):
    """The answer, and the bytes of the body that were read before it."""

    status: int
    read: int
    text: str


def send(
    server: InProcess,
    method: str,
    path: str,
    size: int,
    kind: str,
    caller: dict[str, str],
    *,
    announced: bool = False,
    leaves: bool = False,
) -> Sent:
    """Send a body of this size. caller: the headers by which one is known; announced: with its length, else in pieces until it ends.

    leaves: the connection ends before the body does.
    """
    direct = server.transport
    assert isinstance(direct, Direct)
    headers = (
        caller | {"Host": "inband.test", "Content-Type": kind} | ({"Content-Length": str(size)} if announced else {})
    )
    return direct.portal.call(arrive, direct, method, path, size, headers, leaves)


async def arrive(direct: Direct, method: str, path: str, size: int, headers: dict[str, str], leaves: bool) -> Sent:
    """As one of many in the same event loop; see `send`."""
    keep_time_of(direct.time)
    read, said = 0, list[Message]()

    async def receive() -> Message:
        nonlocal read
        if read >= size:
            if leaves:
                return {"type": "http.disconnect"}
            await asyncio.Event().wait()  # nobody hangs up
        piece = b"[" * min(PIECE, size - read)
        read += len(piece)
        return {"type": "http.request", "body": piece, "more_body": leaves or read < size}

    async def send(message: Message) -> None:
        said.append(message)

    scope: dict[str, Any] = {
        "type": "http",
        "asgi": {"version": "3.0"},
        "http_version": "1.1",
        "method": method,
        "scheme": "http",
        "server": ("inband.test", 80),
        "client": ("127.0.0.1", 1),
        "root_path": "",
        "path": path,
        "raw_path": path.encode(),
        "query_string": b"",
        "headers": [(name.lower().encode(), value.encode()) for name, value in headers.items()],
    }
    with suppress(Exception):
        await direct.asgi(scope, receive, send)
    text = b"".join(part.get("body", b"") for part in said[1:]).decode()
    return Sent(said[0]["status"] if said else 500, read, text)
