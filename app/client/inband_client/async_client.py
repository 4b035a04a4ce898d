"""The client for programs with a loop of asyncio. What each call means, `Client` says."""

import asyncio
import time
from collections.abc import AsyncIterator, Iterable, Sequence
from contextlib import suppress
from datetime import datetime
from types import TracebackType
from typing import Any, Self, TypeVar, Unpack

import httpx

from inband_client import calls
from inband_client.attempts import Attempts, answer_of
from inband_client.calls import Call, Page, ReadingLike
from inband_client.connection import PATIENCE, TIMEOUT, Verify, options
from inband_client.errors import ProblemError, Stopped
from inband_client.feed import HEARTBEAT, SILENCE, Feed
from inband_client.values import Batch, Correction, Decision, Event, ReadingFields, StoredReading

Answer = TypeVar("Answer")
Item = TypeVar("Item")


class AsyncClient:
    """`Client` for asyncio: the same methods and options. Cancelling the task that waits for one ends it at once.

    transport: what carries the requests, in place of connections of this client's own; `verify` is then the transport's.
    """

    def __init__(
        self,
        url: str,
        key: str,
        *,
        patience: float | None = PATIENCE,
        timeout: float = TIMEOUT,
        verify: Verify = True,
        stop: asyncio.Event | None = None,
        transport: httpx.AsyncBaseTransport | None = None,
    ) -> None:
        self._http = httpx.AsyncClient(transport=transport, **options(url, key, verify=verify, timeout=timeout))
        self._patience = patience
        self._stop = stop or asyncio.Event()

    async def __aenter__(self) -> Self:
        """Use it for a block of statements."""
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Hang up."""
        await self.close()

    async def close(self) -> None:
        """Hang up."""
        await self._http.aclose()

    def stop(self) -> None:
        """End the waiting of every call, from any task of this loop; these and all later ones raise `Stopped`."""
        self._stop.set()

    # --- readings

    async def push(self, reading: ReadingLike | None = None, /, **fields: Unpack[ReadingFields]) -> Decision:
        """As `Client.push`."""
        return await self._answer(calls.push(reading, fields))

    async def push_many(self, readings: Iterable[ReadingLike], *, decisions: bool = True, chunk: int = 1000) -> Batch:
        """As `Client.push_many`."""
        pushed = calls.NOTHING
        for before, call in calls.push_many(readings, chunk, decisions=decisions):
            try:
                pushed += await self._answer(call)
            except ProblemError as error:
                raise calls.counted_on(error, before)  # noqa: B904 - the same error
        return pushed

    async def readings(
        self,
        *,
        characteristic: str | None = None,
        machine: str | None = None,
        part: str | None = None,
        start: datetime | str | None = None,
        end: datetime | str | None = None,
        zone: str | Sequence[str] | None = None,
        action: str | Sequence[str] | None = None,
        order: str = "oldest",
    ) -> AsyncIterator[StoredReading]:
        """As `Client.readings`."""
        query: dict[str, Any] = {"characteristic": characteristic, "machine": machine, "part": part, "start": start}
        query |= {"end": end, "zone": zone, "action": action, "order": order}
        async for reading in self._items(calls.readings(query)):
            yield reading

    # --- corrections

    async def pending(self, machine: str) -> list[Correction]:
        """As `Client.pending`."""
        return [correction async for correction in self._items(calls.pending(machine))]

    async def confirm(
        self,
        machine: str,
        number: int,
        offset_after: float | None = None,
        applied_at: datetime | str | None = None,
        mapping: str | None = None,
    ) -> Correction:
        """As `Client.confirm`."""
        return await self._answer(calls.confirm(machine, number, offset_after, applied_at, mapping))

    async def reject(self, machine: str, number: int, reason: str) -> Correction:
        """As `Client.reject`."""
        return await self._answer(calls.reject(machine, number, reason))

    # --- the machine

    async def heartbeat(self, machine: str, **state: Any) -> dict[str, Any]:
        """As `Client.heartbeat`."""
        return await self._answer(calls.heartbeat(machine, state))

    async def report_offset(
        self, machine: str, tool_memory: int, offset: float, *, none_applied: bool = False
    ) -> dict[str, Any]:
        """As `Client.report_offset`."""
        return await self._answer(calls.report_offset(machine, tool_memory, offset, none_applied=none_applied))

    async def report_fault(
        self, machine: str, kind: str, text: str | None = None, *, active: bool = True
    ) -> dict[str, Any]:
        """As `Client.report_fault`."""
        return await self._answer(calls.report_fault(machine, kind, text, active=active))

    # --- live events

    async def follow(self, after: int | None = None, *, heartbeats: bool = False) -> AsyncIterator[Event]:
        """As `Client.follow`."""
        feed, attempts = Feed(after), self._attempts("GET /events", repeat=True)
        while True:
            self._check()
            feed.cut()
            try:
                timeout = httpx.Timeout(SILENCE)
                async with self._http.stream("GET", "/events", headers=feed.headers, timeout=timeout) as response:
                    if not response.is_success:
                        await response.aread()
                        pause = attempts.refused(response)
                    else:
                        async for chunk in response.aiter_bytes():
                            self._check()
                            attempts.begin()
                            for event in feed.events(chunk):
                                if heartbeats or event.kind != HEARTBEAT:
                                    yield event
                        pause = feed.pause
            except httpx.RequestError as error:
                pause = attempts.failed(error)
            await self._wait(pause)

    # --- the rest of the contract

    async def get(self, path: str, **query: Any) -> Any:
        """As `Client.get`."""
        return await self.call("GET", path, **query)

    async def post(self, path: str, json: Any = None, *, repeat: bool = False, **query: Any) -> Any:
        """As `Client.post`."""
        return await self.call("POST", path, json, repeat=repeat, **query)

    async def call(self, method: str, path: str, json: Any = None, *, repeat: bool | None = None, **query: Any) -> Any:
        """As `Client.call`."""
        return await self._answer(calls.call(method, path, json, query=query, repeat=repeat))

    async def items(self, path: str, **query: Any) -> AsyncIterator[dict[str, Any]]:
        """As `Client.items`."""
        pages: Call[Page[dict[str, Any]]] = calls.pages(path, query)
        async for item in self._items(pages):
            yield item

    # --- underneath

    async def _items(self, call: Call[Page[Item]]) -> AsyncIterator[Item]:
        following: Call[Page[Item]] | None = call
        while following is not None:
            page = await self._answer(following)
            for item in page.items:
                yield item
            following = calls.next_page(following, page)

    async def _answer(self, call: Call[Answer]) -> Answer:
        attempts = self._attempts(str(call), repeat=call.repeat)
        while True:
            self._check()
            try:
                response = await self._http.request(call.method, call.path, params=call.query, json=call.json)
            except httpx.RequestError as error:
                pause = attempts.failed(error)
            else:
                if response.is_success:
                    return answer_of(call, response)
                pause = attempts.refused(response)
            await self._wait(pause)

    def _attempts(self, call: str, *, repeat: bool) -> Attempts:
        return Attempts(call, repeat=repeat, patience=self._patience, clock=time.monotonic)

    def _check(self) -> None:
        if self._stop.is_set():
            raise Stopped("the client was stopped")

    async def _wait(self, seconds: float) -> None:
        with suppress(TimeoutError):
            await asyncio.wait_for(self._stop.wait(), seconds)
        self._check()
