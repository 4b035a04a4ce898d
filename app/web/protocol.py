"""uvicorn's HTTP protocol, with the head and the body of an answer in one write.

uvicorn hands the two to the transport one after the other, and each becomes a system call that wakes the client. For a
short answer that is a sizeable part of what it costs.
"""

import asyncio
from typing import Any, cast

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol, RequestResponseCycle

LIVE = "/api/v1/events"


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


class OneWriteProtocol(HttpToolsProtocol):
    """What `inband serve` runs."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override] # uvicorn's own signature
        """Put the gathering transport between uvicorn and the socket."""
        super().connection_made(cast("asyncio.Transport", GatheredWrites(transport)))

    def shutdown(self) -> None:
        """End the stream of a live page at once: it would be waited for in vain, then cut off with a traceback."""
        super().shutdown()
        cycle: RequestResponseCycle | None = self.cycle  # none before the first request; uvicorn does not type that
        if cycle is not None and not cycle.response_complete and cycle.scope["path"] == LIVE:
            self.transport.close()
