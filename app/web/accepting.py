"""Connections taken some at a time: a thousand that open in one instant are a hundred turns of the event loop.

The loop's own way takes all that wait in one turn, and who is answered waits until the last of them has its protocol: a twentieth
of a second for a thousand.
"""

import asyncio
import logging
import socket
from collections.abc import Callable
from contextlib import suppress
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or find_spec("uvloop"):
    from uvloop import Loop as Base
else:
    Base = asyncio.SelectorEventLoop  # Windows' proactor waits for no PostgreSQL

AT_ONCE = 8
"""Connections taken in one turn of the event loop."""
REST = 1.0
"""Seconds until connections are taken again after the system has refused one: it has no files or memory left."""

log = logging.getLogger(__name__)


class Acceptor:
    """Takes the connections of a listening socket, as asyncio's own server does."""

    def __init__(self, listening: socket.socket, protocol: Callable[[], asyncio.Protocol], backlog: int) -> None:
        self.sockets = [listening]
        self._loop = asyncio.get_running_loop()
        self._protocol = protocol
        self._opening: set[asyncio.Task[object]] = set()
        self._resting: asyncio.TimerHandle | None = None
        listening.setblocking(False)
        listening.listen(backlog)
        self._begin()

    def close(self) -> None:
        """Take no more."""
        if self._resting is not None:
            self._resting.cancel()
        for listening in self.sockets:
            self._loop.remove_reader(listening)
            listening.close()
        self.sockets = []

    async def wait_closed(self) -> None:
        """Wait for those that were taken and have no protocol yet."""
        await asyncio.gather(*self._opening, return_exceptions=True)

    def _begin(self) -> None:
        self._resting = None
        for listening in self.sockets:
            self._loop.add_reader(listening, self._take, listening)

    def _take(self, listening: socket.socket) -> None:
        for _connection in range(AT_ONCE):
            try:
                connection, _address = listening.accept()
            except (BlockingIOError, InterruptedError, ConnectionAbortedError):
                return
            except OSError as error:
                log.warning("no connection can be taken for %g s: %s", REST, error.strerror)
                self._loop.remove_reader(listening)
                self._resting = self._loop.call_later(REST, self._begin)
                return
            connection.setblocking(False)
            with suppress(OSError):
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            opening = self._loop.create_task(self._loop.connect_accepted_socket(self._protocol, connection))
            self._opening.add(opening)
            opening.add_done_callback(self._opened)

    def _opened(self, opening: asyncio.Task[object]) -> None:
        self._opening.discard(opening)
        if not opening.cancelled():
            opening.exception()  # seen: the other side is gone already


class Loop(Base):
    """The event loop of a server process."""

    async def create_server(self, protocol_factory: Any, *given: Any, **named: Any) -> Any:
        """Take connections of a socket by an `Acceptor`, of all else as ever."""
        sock = named.get("sock")
        if sock is None or named.get("ssl") is not None:
            return await super().create_server(protocol_factory, *given, **named)
        return Acceptor(sock, protocol_factory, named["backlog"])
