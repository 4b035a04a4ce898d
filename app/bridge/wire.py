"""The way to the server: one set of connections for all machines, in place of httpx's own.

The requests of a bridge are small and many, and answered at once. What `httpx` does for one of them beneath its client costs
five times as much processor as all the rest of it; this does the same with the parser that the server uses.
"""

import asyncio
import ssl
import time
from collections import deque
from types import TracebackType
from typing import Any, Final, Self

import httpx
from httptools import HttpParserError, HttpParserUpgrade, HttpResponseParser

KEPT: Final = 4.0
"""s: a connection that was idle for longer is not used again; servers close theirs after 5 s or more."""
Origin = tuple[bytes, bytes, int | None]


class Wire(httpx.AsyncBaseTransport):
    """Requests over HTTP/1.1, each over a connection of its own while it lasts; connections are kept for the next.

    Answers are read whole: it is neither for live events nor for HEAD. trusted: whom to trust with https.
    """

    def __init__(self, trusted: ssl.SSLContext) -> None:
        self._trusted = trusted
        self._idle: dict[Origin, deque[_Connection]] = {}

    async def handle_async_request(self, request: httpx.Request) -> httpx.Response:
        """Send a request, and wait for its answer. Raises `httpx.TransportError`."""
        timeout: dict[str, float | None] = request.extensions.get("timeout", {})
        content = await request.aread()
        url = request.url
        lines = [b"%b %b HTTP/1.1\r\n" % (request.method.encode(), url.raw_path)]
        lines += [b"%b: %b\r\n" % header for header in request.headers.raw]
        origin = (url.raw_scheme, url.raw_host, url.port)
        connection = self._kept(origin) or await self._connected(url, timeout.get("connect"))
        try:
            async with asyncio.timeout(timeout.get("read")):
                answer = await connection.ask(b"".join((*lines, b"\r\n", content)))
        except TimeoutError as error:
            connection.close()
            raise httpx.ReadTimeout("no answer in time") from error
        except BaseException:
            connection.close()
            raise
        if connection.usable:
            connection.idle_since = time.monotonic()
            self._idle.setdefault(origin, deque()).append(connection)
        else:
            connection.close()
        return answer

    def _kept(self, origin: Origin) -> "_Connection | None":
        """The connection that was used last; those that were idle for too long are closed."""
        idle = self._idle.get(origin, deque())
        oldest = time.monotonic() - KEPT
        while idle and (idle[0].idle_since < oldest or not idle[0].usable):
            idle.popleft().close()
        while idle:
            if (connection := idle.pop()).usable:
                return connection
        return None

    async def _connected(self, url: httpx.URL, within: float | None) -> "_Connection":
        secure = url.scheme == "https"
        try:
            async with asyncio.timeout(within):
                _, connection = await asyncio.get_running_loop().create_connection(
                    _Connection,
                    url.raw_host.decode("ascii"),
                    url.port or (443 if secure else 80),
                    ssl=self._trusted if secure else None,
                )
        except TimeoutError as error:
            raise httpx.ConnectTimeout("no connection in time") from error
        except OSError as error:
            raise httpx.ConnectError(str(error)) from error
        return connection

    async def aclose(self) -> None:
        """Nothing: the connections are everybody's. `close` ends them."""

    def close(self) -> None:
        """End the connections that are idle."""
        for idle in self._idle.values():
            while idle:
                idle.pop().close()

    async def __aenter__(self) -> Self:
        """Use it for a block of statements, or for a client."""
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None = None,
        error: BaseException | None = None,
        trace: TracebackType | None = None,
    ) -> None:
        """Nothing, as `aclose`."""


class _Connection(asyncio.Protocol):
    """One connection. usable: another request may be sent over it."""

    def __init__(self) -> None:
        self.usable = True
        self.idle_since = 0.0
        self._transport: asyncio.Transport | None = None
        self._waits: asyncio.Future[httpx.Response] | None = None
        self._until_end = False  # the answer ends with the connection
        self._parser: Any = None

    def ask(self, request: bytes) -> "asyncio.Future[httpx.Response]":
        """Send a request; what is answered has to be awaited before the next one."""
        if self._transport is None or self._transport.is_closing():
            raise httpx.WriteError("the connection was closed")
        self._headers: list[tuple[bytes, bytes]] = []
        self._body: list[bytes] = []
        self._until_end = False
        self._parser = HttpResponseParser(self)
        self._waits = asyncio.get_running_loop().create_future()
        self._transport.write(request)
        return self._waits

    def close(self) -> None:
        """Hang up."""
        self.usable = False
        if self._transport is not None:
            self._transport.abort()

    # --- what asyncio calls

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport

    def data_received(self, data: bytes) -> None:
        """Take a part of an answer."""
        if self._waits is None or self._waits.done():
            self.close()  # nobody asked
            return
        try:
            self._parser.feed_data(data)
        except (HttpParserError, HttpParserUpgrade) as error:
            self._failed(httpx.RemoteProtocolError(str(error)))
            self.close()

    def connection_lost(self, error: Exception | None) -> None:
        """Inform those who wait."""
        self.usable = False
        if error is not None:
            self._failed(httpx.ReadError(str(error)))
        elif self._until_end:
            self._answered()
        else:
            self._failed(httpx.RemoteProtocolError("the server closed the connection without a whole answer"))

    def _failed(self, error: httpx.TransportError) -> None:
        if self._waits is not None and not self._waits.done():
            self._waits.set_exception(error)

    # --- what the parser calls

    def on_message_begin(self) -> None:
        """See whether an answer was asked for; what follows one unasked would be taken for the next."""
        self.usable = self.usable and self._waits is not None and not self._waits.done()

    def on_header(self, name: bytes, value: bytes) -> None:
        """Take a header."""
        self._headers.append((name, value))

    def on_headers_complete(self) -> None:
        """See where the content ends."""
        self._until_end = not {name.lower() for name, _ in self._headers} & {b"content-length", b"transfer-encoding"}

    def on_body(self, body: bytes) -> None:
        """Take a part of the content."""
        self._body.append(body)

    def on_message_complete(self) -> None:
        """Hand the answer over; one that only says to go on waiting (1xx) is passed over."""
        if self._parser.get_status_code() < 200:
            self._headers.clear()
            return
        self.usable = self.usable and self._parser.should_keep_alive()
        self._answered()

    def _answered(self) -> None:
        self._until_end = False
        if self._waits is not None and not self._waits.done():
            status = self._parser.get_status_code()
            self._waits.set_result(httpx.Response(status, headers=self._headers, content=b"".join(self._body)))
