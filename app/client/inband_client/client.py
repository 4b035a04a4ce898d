"""The client for programs with threads."""

import threading
import time
from collections.abc import Iterable, Iterator, Sequence
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


class Client:
    """Calls an Inband server, and waits for it when it is unreachable. Several threads may share one.

    url: of the server, with the prefix of a plant if it has one (``https://inband.example/p/east``). key: of the machine, or
    of a role. patience: seconds for which a call is tried again after 5xx, 429, a time-out or a cut line, if trying again
    can do no harm; None for ever. timeout: seconds for one attempt. verify: the certificate of the authority that signed
    the server's, as a file (PEM), where it is one of your own. stop: an event of yours that ends all waiting, as `stop()`.
    transport: what carries the requests, in place of connections of this client's own; `verify` is then the transport's.

    Every call raises `ProblemError`, `Unavailable` when patience has run out, and `Stopped`.
    """

    def __init__(
        self,
        url: str,
        key: str,
        *,
        patience: float | None = PATIENCE,
        timeout: float = TIMEOUT,
        verify: Verify = True,
        stop: threading.Event | None = None,
        transport: httpx.BaseTransport | None = None,
    ) -> None:
        self._http = httpx.Client(transport=transport, **options(url, key, verify=verify, timeout=timeout))
        self._patience = patience
        self._stop = stop or threading.Event()

    def __enter__(self) -> Self:
        """Use it for a block of statements."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Hang up."""
        self.close()

    def close(self) -> None:
        """Hang up."""
        self._http.close()

    def stop(self) -> None:
        """End the waiting of every call, from any thread; these and all later ones raise `Stopped`.

        A call that the server is answering ends within its timeout, and `follow` with the next heartbeat, in five seconds.
        """
        self._stop.set()

    # --- readings

    def push(self, reading: ReadingLike | None = None, /, **fields: Unpack[ReadingFields]) -> Decision:
        """Push one reading, as a `Reading`, a mapping, or by fields; the decision, once it is stored durably.

        One without a `key` gets one, so that trying again stores it once. Raises `Conflict` if the key was used with another
        value, `Invalid` with every wrong field.
        """
        return self._answer(calls.push(reading, fields))

    def push_many(self, readings: Iterable[ReadingLike], *, decisions: bool = True, chunk: int = 1000) -> Batch:
        """Push readings in the order in which they are to be decided, a chunk at a time.

        Of a chunk all are stored or none. If one is refused, the chunks before it are stored: put the reading right and
        push them all again, with the same keys. Errors count positions from the first of all readings.
        """
        pushed = calls.NOTHING
        for before, call in calls.push_many(readings, chunk, decisions=decisions):
            try:
                pushed += self._answer(call)
            except ProblemError as error:
                raise calls.counted_on(error, before)  # noqa: B904 - the same error
        return pushed

    def readings(
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
    ) -> Iterator[StoredReading]:
        """Stored readings in the order of their arrival (`oldest` or `newest` first), page after page.

        start, end: measured between these. zone, action: one, or a list of those that are wanted.
        """
        query: dict[str, Any] = {"characteristic": characteristic, "machine": machine, "part": part, "start": start}
        query |= {"end": end, "zone": zone, "action": action, "order": order}
        yield from self._items(calls.readings(query))

    # --- corrections

    def pending(self, machine: str) -> list[Correction]:
        """Corrections that the machine is to apply, oldest first."""
        return list(self._items(calls.pending(machine)))

    def confirm(
        self,
        machine: str,
        number: int,
        offset_after: float | None = None,
        applied_at: datetime | str | None = None,
        mapping: str | None = None,
    ) -> Correction:
        """Say that a correction is in the offset. Confirming twice is harmless.

        offset_after: the offset that the control holds now, mm; one that is not expected raises an alarm.
        mapping: names how the offset was written, up to 64 letters, such as the hash of a bridge's mapping.
        """
        return self._answer(calls.confirm(machine, number, offset_after, applied_at, mapping))

    def reject(self, machine: str, number: int, reason: str) -> Correction:
        """Say that a correction will not be applied.

        Raises `Conflict` if that was decided before, also by an attempt of this call whose answer was lost: then
        `error.document["correction_status"]` is ``rejected``.
        """
        return self._answer(calls.reject(machine, number, reason))

    # --- the machine

    def heartbeat(self, machine: str, **state: Any) -> dict[str, Any]:
        """Say that the program beside a machine is alive: `version`, `waiting`, `oldest_waiting_at`, `quarantined`,
        `clock_offset`, `state`, `detail`, as far as they are known.
        """
        return self._answer(calls.heartbeat(machine, state))

    def report_offset(
        self, machine: str, tool_memory: int, offset: float, *, none_applied: bool = False
    ) -> dict[str, Any]:
        """Report the offset that the control holds in this location R10, mm.

        none_applied: no pending correction is in it, so that none of them can explain another offset than the known one.
        """
        return self._answer(calls.report_offset(machine, tool_memory, offset, none_applied=none_applied))

    def report_fault(self, machine: str, kind: str, text: str | None = None, *, active: bool = True) -> dict[str, Any]:
        """Report a fault (`battery_low`, `receiver`, `probe_not_ready`, `other`), or its end."""
        return self._answer(calls.report_fault(machine, kind, text, active=active))

    # --- live events

    def follow(self, after: int | None = None, *, heartbeats: bool = False) -> Iterator[Event]:
        """Live events as they come, for ever; after a cut the client comes back and resumes where it was.

        after: resume behind this `event_id`. Each event comes at least once. `hello` says that you are connected: what you look
        up from then on is followed without a gap. `resync` says that more was missed than the server keeps. heartbeats: tell of
        those too, which come every five seconds of quiet.
        """
        feed, attempts = Feed(after), self._attempts("GET /events", repeat=True)
        while True:
            self._check()
            feed.cut()
            try:
                timeout = httpx.Timeout(SILENCE)
                with self._http.stream("GET", "/events", headers=feed.headers, timeout=timeout) as response:
                    if not response.is_success:
                        response.read()
                        pause = attempts.refused(response)
                    else:
                        for chunk in response.iter_bytes():
                            self._check()
                            attempts.begin()
                            for event in feed.events(chunk):
                                if heartbeats or event.kind != HEARTBEAT:
                                    yield event
                        pause = feed.pause
            except httpx.RequestError as error:
                pause = attempts.failed(error)
            self._wait(pause)

    # --- the rest of the contract

    def get(self, path: str, **query: Any) -> Any:
        """The JSON of any address below ``/api/v1``."""
        return self.call("GET", path, **query)

    def post(self, path: str, json: Any = None, *, repeat: bool = False, **query: Any) -> Any:
        """Post JSON to any address below ``/api/v1``; the JSON of the answer.

        repeat: it may be tried again even when an attempt may have been carried out. Without that only one that surely was
        not is tried again, and otherwise `Unavailable` says that it may have happened.
        """
        return self.call("POST", path, json, repeat=repeat, **query)

    def call(self, method: str, path: str, json: Any = None, *, repeat: bool | None = None, **query: Any) -> Any:
        """Any method; GET, PUT, PATCH and DELETE are tried again unless `repeat` says otherwise."""
        return self._answer(calls.call(method, path, json, query=query, repeat=repeat))

    def items(self, path: str, **query: Any) -> Iterator[dict[str, Any]]:
        """Everything in a list, page after page."""
        pages: Call[Page[dict[str, Any]]] = calls.pages(path, query)
        yield from self._items(pages)

    # --- underneath

    def _items(self, call: Call[Page[Item]]) -> Iterator[Item]:
        following: Call[Page[Item]] | None = call
        while following is not None:
            page = self._answer(following)
            yield from page.items
            following = calls.next_page(following, page)

    def _answer(self, call: Call[Answer]) -> Answer:
        attempts = self._attempts(str(call), repeat=call.repeat)
        while True:
            self._check()
            try:
                response = self._http.request(call.method, call.path, params=call.query, json=call.json)
            except httpx.RequestError as error:
                pause = attempts.failed(error)
            else:
                if response.is_success:
                    return answer_of(call, response)
                pause = attempts.refused(response)
            self._wait(pause)

    def _attempts(self, call: str, *, repeat: bool) -> Attempts:
        return Attempts(call, repeat=repeat, patience=self._patience, clock=time.monotonic)

    def _check(self) -> None:
        if self._stop.is_set():
            raise Stopped("the client was stopped")

    def _wait(self, seconds: float) -> None:
        self._stop.wait(seconds)
        self._check()
