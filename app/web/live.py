"""Live events: one listener per process reads the journal when it is woken, and feeds every open page.

The listener asks at most ten times a second, however many readings arrive. A client that comes back with
``Last-Event-ID`` is sent first what it has missed; if that is more than the journal keeps or more than is sensible to
send, it gets a ``resync`` and loads its page again.
"""

import asyncio
import logging
from collections.abc import AsyncIterator, Awaitable, Callable, Collection, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import msgspec
import psycopg
from psycopg import AsyncConnection
from starlette.requests import Request
from starlette.responses import StreamingResponse

from app.db.connections import TRIFLE, Connections
from app.db.events import CHANNEL
from app.db.outage import Outage

log = logging.getLogger(__name__)

PAUSE = 0.1  # s between two looks into the journal
IDLE = 0.5  # s, while no page is open
LOOK = 1.0  # s between two looks if anyone who listens still may
HEARTBEAT = 5.0  # s; a page that hears nothing for longer says so
KEPT_HOURS = 6
MOST_MISSED = 1000  # transactions that a client which comes back is informed one by one
MOST_WAITING = 1000  # events that a slow client may be behind
ABOUT = ("kind", "machine", "characteristic", "tool", "id", "number", "average_memory", "excluded")


class Message(NamedTuple):
    """One published change, ready to be sent; the machine it concerns, None if it concerns everybody."""

    number: int
    machine: str | None
    frame: bytes


class Access(NamedTuple):
    """By what a client listens: the SHA-256 of a browser's session, or the number of a key; and the role it gave then."""

    session: bytes | None
    key: int | None
    role: str | None


StillGranted = Callable[[AsyncConnection[Any], Collection[Access]], Awaitable[Collection[Access]]]
"""Asks the database which of these accesses are still granted as they are."""


class Live:
    """The open pages of one process and the journal they are fed from."""

    def __init__(self, connections: Connections, still_granted: StillGranted) -> None:
        self._connections = connections
        self._still_granted = still_granted
        self._clients: dict[asyncio.Queue[Message | None], Access] = {}
        self._opened = asyncio.Event()  # the first page, after a time without
        self._last: int | None = None  # the last event that was passed on; None before the journal was seen
        self._server: tuple[Any, ...] | None = None  # whose journal that was
        self._tasks: list[asyncio.Task[None]] = []
        self.closing = asyncio.Event()

    @property
    def newest(self) -> int | None:
        """The number of an event that was passed on; what is read from now on knows of it. None as long as none is known."""
        return self._last

    def start(self) -> None:
        """Begin to listen; call it on the loop that serves requests."""
        loop = asyncio.get_running_loop()
        self._tasks = [
            loop.create_task(self._listen(), name="live events"),
            loop.create_task(self._tidy()),
            loop.create_task(self._guard(), name="access to live events"),
        ]

    async def stop(self) -> None:
        """Let every open page go, so that the server can end."""
        self.closing.set()
        self._let_go()
        for task in self._tasks:
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task

    def _let_go(self) -> None:
        for client in self._clients:
            client.put_nowait(None)

    async def _guard(self) -> None:
        """End the streams of those whose access has ended or changed, in whichever process that was done."""
        while True:
            try:
                async with await self._connections.connect_async(application_name="inband-live") as conn:
                    while True:
                        await asyncio.sleep(LOOK)
                        if self._clients:
                            async with asyncio.timeout(HEARTBEAT):
                                await self._end_those_without_access(conn)
            except TimeoutError:  # it cannot be determined who may still listen
                self._let_go()
            except psycopg.Error as error:
                log.debug("access to live events cannot be checked: %s", error)
                await asyncio.sleep(LOOK)
            except Exception:
                log.exception("unhandled error in the access to live events")
                await asyncio.sleep(LOOK)

    async def _end_those_without_access(self, conn: AsyncConnection[Any]) -> None:
        listening = dict(self._clients)  # who opens a page while the database answers was not asked about
        granted = await self._still_granted(conn, set(listening.values()))
        for client, access in listening.items():
            if access not in granted:
                while not client.empty():  # what waits is not reported any more
                    client.get_nowait()
                client.put_nowait(None)

    async def _listen(self) -> None:
        outage = Outage(log, "live events")
        while True:
            listening = False
            try:
                async with await self._connections.connect_async(application_name="inband-live") as conn:
                    await _wake_up_on_events(conn)
                    listening = True
                    await self._look_whose(conn)
                    outage.is_over()
                    while True:
                        await self._pass_on(conn)
                        async for _ in conn.notifies(timeout=HEARTBEAT, stop_after=1):
                            pass
                        await self._rest()
            except psycopg.Error as error:
                outage.goes_on(error)
                if not listening:  # the database is unreachable: no page may go on calling itself live
                    self._let_go()
                await asyncio.sleep(1)
            except Exception:
                log.exception("unhandled error in live events")
                await asyncio.sleep(1)

    async def _look_whose(self, conn: AsyncConnection[Any]) -> None:
        """See which server answers. The journal of another one may lack what was passed on, and number other events so."""
        server = await (await conn.execute(TRIFLE)).fetchone()
        if self._last is None or server != self._server:
            self._last, self._server = await _newest(conn), server
            self._let_go()  # anyone who comes back loads again

    async def _rest(self) -> None:
        if self._clients:
            await asyncio.sleep(PAUSE)
            return
        self._opened.clear()
        with suppress(TimeoutError):
            await asyncio.wait_for(self._opened.wait(), IDLE)

    async def _pass_on(self, conn: AsyncConnection[Any]) -> None:
        if not self._clients:
            newest = await _newest(conn)
            if not self._clients:  # still nobody, who would miss what lies between
                self._last = newest
                return
        cursor = await conn.execute("SELECT id, changes FROM event WHERE id > %s ORDER BY id", (self._last,))
        latest: dict[tuple[Any, ...], tuple[int, dict[str, Any]]] = {}
        for number, changes in await cursor.fetchall():
            self._last = number
            for change in changes:
                # Of a hundred readings of one characteristic since the last look, the last one says it all.
                about = tuple(map(change.get, ABOUT))
                latest.pop(about, None)
                latest[about] = (number, change)
        for message in _messages(list(latest.values())):
            for client in self._clients:
                if client.qsize() < MOST_WAITING:
                    client.put_nowait(message)
                elif client.qsize() == MOST_WAITING:
                    client.put_nowait(_resync(message.number))

    async def _tidy(self) -> None:
        while True:
            try:
                async with await self._connections.connect_async() as conn:
                    await conn.execute("DELETE FROM event WHERE at < now() - make_interval(hours => %s)", (KEPT_HOURS,))
            except psycopg.Error as error:
                log.warning("old events could not be deleted: %s", error)
            await asyncio.sleep(600)

    async def stream(self, access: Access, after: int | None, machine: str | None = None) -> AsyncIterator[bytes]:
        """Server-sent events from now on, or from number `after` on; of one machine, or of all. They end with the access."""
        client: asyncio.Queue[Message | None] = asyncio.Queue()
        self._clients[client] = access
        self._opened.set()
        try:
            yield b"retry: 2000\n\n"
            known = self._last if after is None else after
            yield _frame("hello", {}, known)
            sent = 0 if known is None else known
            if after is not None:
                for message in await self._missed(after):
                    sent = message.number
                    if message.machine in {None, machine} or machine is None:
                        yield message.frame
            while not self.closing.is_set():
                try:
                    async with asyncio.timeout(HEARTBEAT):
                        next_message = await client.get()
                except TimeoutError:
                    # Anyone who hears nothing because nothing concerns him is kept up to date all the same.
                    yield _frame("heartbeat", {}, self._last if client.empty() else None)
                    continue
                if next_message is None:
                    return
                if next_message.number > sent and (next_message.machine in {None, machine} or machine is None):
                    yield next_message.frame
        finally:
            self._clients.pop(client, None)

    async def _missed(self, after: int) -> list[Message]:
        """Everything since event `after`, or one `resync`."""
        try:
            async with await self._connections.connect_async() as conn:
                cursor = await conn.execute("SELECT min(id), max(id) FROM event")
                row = await cursor.fetchone()
                oldest, newest = row if row and row[0] is not None else (0, 0)
                if after > newest or after < oldest - 1:
                    return [_resync(newest)]
                cursor = await conn.execute(
                    "SELECT id, changes FROM event WHERE id > %s ORDER BY id LIMIT %s", (after, MOST_MISSED + 1)
                )
                rows = await cursor.fetchall()
        except psycopg.Error:
            return [_resync(after)]
        if len(rows) > MOST_MISSED:
            return [_resync(newest)]
        return _messages([(number, change) for number, changes in rows for change in changes])


async def _wake_up_on_events(conn: AsyncConnection[Any]) -> None:
    cursor = await conn.execute(f"SELECT quote_ident({CHANNEL})")
    (channel,) = await cursor.fetchone() or ("",)
    await conn.execute(f"LISTEN {channel}".encode())


async def _newest(conn: AsyncConnection[Any]) -> int:
    cursor = await conn.execute("SELECT coalesce(max(id), 0) FROM event")
    row = await cursor.fetchone()
    return int(row[0]) if row else 0


def _messages(changes: Sequence[tuple[int, dict[str, Any]]]) -> list[Message]:
    """The changes of some transactions, in order. Only the last one of a transaction carries its number.

    Anyone who is cut off between two of them comes back with the number before, and is sent both again.
    """
    messages = []
    for at, (number, change) in enumerate(changes):
        last = at + 1 == len(changes) or changes[at + 1][0] != number
        messages.append(
            Message(number, change.get("machine"), _frame(change["kind"], change, number if last else None))
        )
    return messages


def _resync(number: int) -> Message:
    return Message(number, None, _frame("resync", {}, number))


def _frame(kind: str, change: dict[str, Any], number: int | None) -> bytes:
    head = "" if number is None else f"id: {number}\n"
    return f"{head}event: {kind}\ndata: {msgspec.json.encode(change).decode()}\n\n".encode()


def stream(
    request: Request, access: Access, machine: str | None, last_event_id: str | None, after: int | None = None
) -> StreamingResponse:
    """The events of one machine, or of all, as an answer; they end with the access."""
    live: Live = request.app.state.live
    if last_event_id is not None and last_event_id.isascii() and last_event_id.isdigit() and len(last_event_id) < 19:
        after = int(last_event_id)

    async def frames() -> AsyncIterator[bytes]:
        async for frame in live.stream(access, after, machine):
            yield frame

    return StreamingResponse(
        frames(), media_type="text/event-stream", headers={"Cache-Control": "no-store", "X-Accel-Buffering": "no"}
    )
