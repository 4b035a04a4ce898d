"""Simulated controls that are reached by TCP: how they listen, work, lose their connections, and end."""

import asyncio
import contextlib

from app.simulators.controls.model import Model


class TcpControl:
    """A control that listens on a port of this computer. A kind of it says what is done with a connection, and what beside."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.port = 0
        self._server: asyncio.Server | None = None
        self._connected: dict[asyncio.StreamWriter, asyncio.Task[None] | None] = {}
        self._working: asyncio.Task[None] | None = None

    async def start(self, port: int) -> None:
        """Listen; 0 takes a free port."""
        self._server = await asyncio.start_server(self._serve, "127.0.0.1", port)
        self.port = self._server.sockets[0].getsockname()[1]
        self._working = asyncio.create_task(self._work())

    async def stop(self) -> None:
        """End it, with all connections."""
        if self._server is not None:
            self._server.close()
        tasks = [task for task in (self._working, *self._connected.values()) if task is not None]
        self.cut()
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def cut(self) -> None:
        """The network fails: every connection ends."""
        for writer in self._connected:
            writer.transport.abort()

    @property
    def connections(self) -> int:
        """Number of connections by TCP."""
        return len(self._connected)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._connected[writer] = asyncio.current_task()
        try:
            with contextlib.suppress(OSError, asyncio.IncompleteReadError, asyncio.LimitOverrunError):
                await self._talk(reader, writer)
        finally:
            del self._connected[writer]
            with contextlib.suppress(OSError):
                writer.close()

    async def _talk(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Answer one connection until it ends."""

    async def _work(self) -> None:
        """Work of the control beside its connections."""
