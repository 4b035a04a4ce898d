"""uvicorn's HTTP protocol with limits on heads, silence and connections, and with one write for an answer.

uvicorn hands head and body of an answer to the transport one after the other, and each becomes a system call that wakes
the client; for a short answer that is a sizeable part of what it costs. And it reads a request's head however long it is
and however long it takes, so strangers could hold the door with some connections (bodies: see `app.web.limits`).
"""

import asyncio
import json
from functools import cache
from http import HTTPStatus
from importlib import import_module
from importlib.util import find_spec
from typing import Any, Literal, cast

from uvicorn.protocols.http.flow_control import FlowControl
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol, RequestResponseCycle

resource: Any = import_module("resource") if find_spec("resource") else None
"""Python's module of that name; Windows has none."""

LIVE = "/api/v1/events"
MOST_HEAD = 64 * 1024
"""Bytes of a request's line and headers; browsers send some hundreds."""
OTHER_FILES = 256
"""Open files kept for the database, logs and templates; all others may be connections."""
MOST_OF_WINDOWS = 512
"""Sockets that its `select` waits for at once."""
LINGER = 1.0
"""Seconds in which a refused client may read why, while what it still sends is thrown away."""


class GatheredWrites:
    """A transport that sends what is written within one turn of the event loop together."""

    def __init__(self, transport: asyncio.Transport) -> None:
        self._transport = transport
        self._call_soon = asyncio.get_running_loop().call_soon
        self._parts: list[bytes] = []

    def __getattr__(self, name: str) -> Any:
        return getattr(self._transport, name)

    def write(self, data: bytes) -> None:
        """Send this, with whatever else is written before the loop turns."""
        if not self._parts:
            self._call_soon(self._flush)
        self._parts.append(data)

    def close(self) -> None:
        """Send the rest and close."""
        self._flush()
        self._transport.close()

    def _flush(self) -> None:
        if self._parts:
            parts, self._parts = self._parts, []
            self._transport.write(b"".join(parts))


class TooLarge(Exception):
    """The head of a request is longer than `MOST_HEAD`."""


class ServerProtocol(HttpToolsProtocol):
    """Protocol that `inband serve` runs for each connection.

    A head that is too long is answered 431, one that does not arrive within ``head_patience`` seconds 408, and a body that
    falls silent for ``body_patience`` seconds, or comes in slower than ``body_rate`` bytes a second beyond these, is not waited
    for either; nor is one that has not ended ``body_patience`` seconds after it began although it is answered. Where there are more connections than files are left for, the one
    that has been silent longest makes room; if none is silent, the new one is answered 503.
    """

    head_patience = 10.0
    body_patience = 30.0
    body_rate = 1000.0

    waits_for: Literal["head", "body", "answer", "nothing"] = "head"
    _head_bytes = 0
    _body_bytes = 0
    _body_since = 0.0
    heard_at = 0.0
    _timer: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override] # uvicorn's own signature
        """Put the gathering transport between uvicorn and the socket."""
        super().connection_made(cast("asyncio.Transport", GatheredWrites(transport)))
        self.heard_at = self.loop.time()
        self._timer = self.loop.call_later(self.head_patience, self._give_up)
        if len(self.connections) > most_connections() and not self._make_room():
            self._refuse(
                HTTPStatus.SERVICE_UNAVAILABLE,
                "The server has as many connections as it can serve. Try again in some seconds.",
            )

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the timer with the connection."""
        self._stop_timer()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Read on, within the limits."""
        if self.waits_for == "nothing":
            return
        super().data_received(data)
        if self.waits_for in {"answer", "nothing"} or self.transport.is_closing():
            return
        self.heard_at = self.loop.time()
        if self.waits_for == "head":
            self._head_bytes += len(data)
            if self._head_bytes > MOST_HEAD:
                self.send_400_response("")
                return
        else:
            self._body_bytes += len(data)
        if self._timer is None:
            patience = self.head_patience if self.waits_for == "head" else self.body_patience
            self._timer = self.loop.call_later(patience, self._give_up)

    def on_message_begin(self) -> None:
        """Count the bytes of this head."""
        self.waits_for, self._head_bytes = "head", 0
        super().on_message_begin()

    def on_headers_complete(self) -> None:
        """Refuse a head that came in one piece and is too long all the same."""
        self._stop_timer()
        self._head_bytes = len(self.url) + sum(len(name) + len(value) + 4 for name, value in self.headers)
        if self._head_bytes > MOST_HEAD:
            raise TooLarge
        self.waits_for = "body"
        self._body_bytes, self._body_since = 0, self.loop.time()
        super().on_headers_complete()

    def on_header(self, name: bytes, value: bytes) -> None:
        """Take one header. None of our cookies holds a backslash.

        Python before 3.11.10 unquotes a cookie with many in the square of their number (CVE-2024-7592): ten seconds for 64 kB.
        """
        super().on_header(name, value.replace(b"\\", b"") if name.lower() == b"cookie" else value)

    def on_message_complete(self) -> None:
        """Leave the connection to uvicorn's own time limit between two requests."""
        self._stop_timer()
        self.waits_for = "answer"
        super().on_message_complete()

    def send_400_response(self, msg: str) -> None:
        """Answer bytes that are no request, or too many of them."""
        if self._head_bytes > MOST_HEAD:
            self._refuse(
                HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE,
                f"The request's line and headers are longer than {MOST_HEAD // 1024} KiB. Send data in the body.",
            )
        else:
            self._refuse(HTTPStatus.BAD_REQUEST, msg or "This is not an HTTP request.")

    def shutdown(self) -> None:
        """End the stream of a live page at once: it would be waited for in vain, then cut off with a traceback."""
        super().shutdown()
        cycle: RequestResponseCycle | None = self.cycle  # none before the first request; uvicorn does not type that
        if cycle is not None and not cycle.response_complete and cycle.scope["path"] == LIVE:
            self.transport.close()

    def _give_up(self) -> None:
        """Close a connection that has kept its request back for too long."""
        self._timer = None
        if self.transport.is_closing():
            return
        if self.waits_for == "body":
            flow: FlowControl = self.flow
            now = self.loop.time()
            cycle: RequestResponseCycle = self.cycle
            answered = cycle.response_complete
            if flow.read_paused:  # we are the ones who do not read
                self._body_bytes, self._body_since = 0, now
            in_all = self._body_since + (0.0 if answered else self._body_bytes / self.body_rate)
            left = min(self.heard_at, in_all) + self.body_patience - now
            if left > 0 or flow.read_paused:
                self._timer = self.loop.call_later(max(left, 1.0), self._give_up)
                return
            if answered:
                self.transport.close()
                return
        if self.waits_for == "head" and not self._head_bytes:
            self.transport.close()  # it has asked for nothing, so nothing is answered
            return
        self._refuse(HTTPStatus.REQUEST_TIMEOUT, "The request did not arrive in time. Send it again.")

    def _make_room(self) -> bool:
        """Close the connection that has sent no whole head for the longest time; False if there is none."""
        silent = [
            other
            for other in self.connections
            if isinstance(other, ServerProtocol)
            and other is not self
            and other.waits_for == "head"
            and not other.transport.is_closing()
        ]
        if not silent:
            return False
        min(silent, key=lambda other: other.heard_at).transport.close()
        return True

    def _refuse(self, status: HTTPStatus, detail: str) -> None:
        """Answer with a problem document and close; what still comes in is not read."""
        self.waits_for = "nothing"
        self._stop_timer()
        cycle: RequestResponseCycle | None = self.cycle
        if cycle is not None and not cycle.response_complete:
            self.transport.close()  # an answer is being written, or its handler waits for the rest of the body
            return
        problem: dict[str, object] = {
            "type": "about:blank",
            "title": status.phrase,
            "status": status.value,
            "detail": detail,
            "errors": [],
        }
        body = json.dumps(problem).encode()
        retry = "Retry-After: 5\r\n" if status == HTTPStatus.SERVICE_UNAVAILABLE else ""
        head = (
            f"HTTP/1.1 {status.value} {status.phrase}\r\nContent-Type: application/problem+json\r\n{retry}"
            f"Content-Length: {len(body)}\r\nConnection: close\r\n\r\n"
        )
        self.transport.write(head.encode("ascii") + body)
        self.loop.call_later(LINGER, self.transport.close)

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


@cache
def most_connections() -> int:
    """Return how many connections this process may serve: the files it may open, less those it needs itself."""
    if resource is None:
        return MOST_OF_WINDOWS - OTHER_FILES
    soft, _hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    return 2**31 if soft == resource.RLIM_INFINITY else max(soft - OTHER_FILES, soft // 2)


def raise_file_limit() -> None:
    """Let this process open as many files as the system allows; the usual 1,024 are few for a plant's live pages."""
    if resource is None:
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    target = 65_536 if hard == resource.RLIM_INFINITY else min(hard, 65_536)
    if soft != resource.RLIM_INFINITY and soft < target:
        resource.setrlimit(resource.RLIMIT_NOFILE, (target, hard))
