"""Live events: one listener per process reads the journal when it is woken, and feeds every open page.

The listener asks at most ten times a second, however many readings arrive. A client that comes back with
``Last-Event-ID`` is told first what it has missed; if that is more than the journal keeps or more than is sensible to
send, it gets a ``resync`` and loads its page anew.
"""

import asyncio
import logging
from collections.abc import AsyncIterator
from contextlib import suppress
from typing import Any

import msgspec
import psycopg
from psycopg import AsyncConnection

from app.db.events import CHANNEL

log = logging.getLogger(__name__)

PAUSE = 0.1  # s between two looks into the journal
HEARTBEAT = 5.0  # s; a page that hears nothing for longer says so
KEPT_HOURS = 6
MOST_MISSED = 1000  # transactions that a client which comes back is told one by one
MOST_WAITING = 1000  # events that a slow client may be behind

Message = tuple[int, str, dict[str, Any]]
"""Number, kind, and what changed."""


class Live:
    """The open pages of one process and the journal they are fed from."""

    def __init__(self, dsn: str) -> None:
        self._dsn = dsn
        self._clients: set[asyncio.Queue[Message | None]] = set()
        self._last = 0
        self._tasks: list[asyncio.Task[None]] = []
        self.closing = asyncio.Event()

    def start(self) -> None:
        """Begin to listen; call it on the loop that serves requests."""
        loop = asyncio.get_running_loop()
        self._tasks = [loop.create_task(self._listen(), name="live events"), loop.create_task(self._tidy())]

    async def stop(self) -> None:
        """Let every open page go, so that the server can end."""
        self.closing.set()
        for client in self._clients:
            client.put_nowait(None)
        for task in self._tasks:
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task

    async def _listen(self) -> None:
        while True:
            try:
                async with await AsyncConnection.connect(
                    self._dsn, autocommit=True, application_name="inband-live", connect_timeout=5
                ) as conn:
                    await conn.execute(f"LISTEN {CHANNEL}")
                    self._last = self._last or await _newest(conn)
                    while True:
                        await self._pass_on(conn)
                        async for _ in conn.notifies(timeout=HEARTBEAT, stop_after=1):
                            pass
                        await asyncio.sleep(PAUSE)
            except psycopg.Error as error:
                log.warning("live events are interrupted: %s", error)
                await asyncio.sleep(1)

    async def _pass_on(self, conn: AsyncConnection[Any]) -> None:
        cursor = await conn.execute("SELECT id, changes FROM event WHERE id > %s ORDER BY id", (self._last,))
        latest: dict[tuple[Any, ...], Message] = {}
        for number, changes in await cursor.fetchall():
            self._last = number
            for change in changes:
                # Of a hundred readings of one characteristic since the last look, the last one says it all.
                about = (
                    change["kind"],
                    change.get("machine"),
                    change.get("characteristic"),
                    change.get("tool"),
                    change.get("id", change.get("number")),
                )
                latest.pop(about, None)
                latest[about] = (number, change["kind"], change)
        for message in latest.values():
            for client in self._clients:
                if client.qsize() < MOST_WAITING:
                    client.put_nowait(message)
                elif client.qsize() == MOST_WAITING:
                    client.put_nowait((message[0], "resync", {}))

    async def _tidy(self) -> None:
        while True:
            try:
                async with await AsyncConnection.connect(self._dsn, autocommit=True, connect_timeout=5) as conn:
                    await conn.execute("DELETE FROM event WHERE at < now() - make_interval(hours => %s)", (KEPT_HOURS,))
            except psycopg.Error as error:
                log.warning("the journal of events could not be tidied: %s", error)
            await asyncio.sleep(600)

    async def stream(self, after: int | None, machine: str | None = None) -> AsyncIterator[bytes]:
        """Server-sent events from now on, or from number `after` on; of one machine, or of all."""
        client: asyncio.Queue[Message | None] = asyncio.Queue()
        self._clients.add(client)
        try:
            yield b"retry: 2000\n\n"
            sent = self._last if after is None else after
            yield _frame((sent, "hello", {}))
            if after is not None:
                async for message in self._missed(after):
                    sent = message[0]
                    if _concerns(message, machine):
                        yield _frame(message)
            while not self.closing.is_set():
                try:
                    async with asyncio.timeout(HEARTBEAT):
                        next_message = await client.get()
                except TimeoutError:
                    yield b"event: heartbeat\ndata: {}\n\n"
                    continue
                if next_message is None:
                    return
                if next_message[0] >= sent and _concerns(next_message, machine):
                    yield _frame(next_message)
        finally:
            self._clients.discard(client)

    async def _missed(self, after: int) -> AsyncIterator[Message]:
        try:
            async with await AsyncConnection.connect(self._dsn, autocommit=True, connect_timeout=5) as conn:
                cursor = await conn.execute("SELECT min(id), max(id) FROM event")
                row = await cursor.fetchone()
                oldest, newest = row if row and row[0] is not None else (0, 0)
                if after > newest or after < oldest - 1:
                    yield newest, "resync", {}
                    return
                cursor = await conn.execute(
                    "SELECT id, changes FROM event WHERE id > %s ORDER BY id LIMIT %s", (after, MOST_MISSED + 1)
                )
                rows = await cursor.fetchall()
        except psycopg.Error:
            yield after, "resync", {}
            return
        if len(rows) > MOST_MISSED:
            yield newest, "resync", {}
            return
        for number, changes in rows:
            for change in changes:
                yield number, change["kind"], change


async def _newest(conn: AsyncConnection[Any]) -> int:
    cursor = await conn.execute("SELECT coalesce(max(id), 0) FROM event")
    row = await cursor.fetchone()
    return int(row[0]) if row else 0


def _concerns(message: Message, machine: str | None) -> bool:
    return machine is None or message[2].get("machine") in (None, machine)


def _frame(message: Message) -> bytes:
    number, kind, change = message
    return f"id: {number}\nevent: {kind}\ndata: {msgspec.json.encode(change).decode()}\n\n".encode()
