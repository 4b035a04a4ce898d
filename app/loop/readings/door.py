"""The door that single readings come in by: a thin ASGI route in front of the application.

It does what the documented route `POST /api/v1/readings` (in `api.py`) says, for callers with a key, without the layers
of a web framework between the socket and the writer. Everything else goes on to the application.
"""

import asyncio
from collections.abc import Awaitable, Callable
from datetime import UTC, datetime
from typing import Any

import msgspec
from starlette.requests import Request
from starlette.types import ASGIApp, Receive, Scope, Send

from app.access.callers import Caller
from app.db.engine import Database
from app.errors import FieldError, InbandError, Invalid, NotFound, NotSignedIn, TooLarge
from app.language.i18n import _
from app.loop.readings import queries
from app.loop.readings.answers import answer
from app.loop.readings.miscounted import TooManyTouches
from app.loop.readings.records import Entry
from app.loop.readings.schemas import ReadingIn, decode_one
from app.loop.readings.writer.columnar import Outcome
from app.loop.readings.writer.group_commit import Writer
from app.loop.readings.writer.pending import Stored, Verdict
from app.web.json_bodies import ON_THE_LOOP
from app.web.problems import unforeseen
from app.web.request_log import note_reason

PATH = "/api/v1/readings"
LARGEST_BODY = 256 * 1024
_json = msgspec.json.Encoder()

Lookup = Callable[[str], Awaitable[Caller | None]]
"""The caller with a secret; None if it is not known."""


class Directory:
    """Places of characteristics by key. Neither key nor machine ever changes, so what is known stays known."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._entries: dict[str, Entry] = {}
        self._age = database.connections.age

    def known(self, characteristic: str) -> Entry | None:
        """The entry if it has been looked up before, in the server that answers now."""
        if self._age != self._database.connections.age:
            self._age = self._database.connections.age
            self._entries.clear()
        return self._entries.get(characteristic)

    def look_up(self, characteristic: str) -> Entry:
        """The entry, from the database if need be. Raises `NotFound`."""
        entry = self.known(characteristic)
        if entry is None:
            with self._database.begin() as session:
                entry = queries.entry_of(session, characteristic)
            if entry is None:
                raise NotFound(
                    _("There is no characteristic %(key)s.") % {"key": characteristic},
                    _("Check the key under Set-up, or create the characteristic first."),
                    errors=[FieldError("characteristic", _("There is no characteristic with this key."))],
                )
            self._entries[characteristic] = entry
        return entry


class ReadingsDoor:
    """ASGI middleware: answers single readings that come with a key."""

    def __init__(self, app: ASGIApp, lookup: Lookup, directory: Directory, writer: Writer, database: Database) -> None:
        self.app = app
        self.lookup = lookup
        self.directory = directory
        self.writer = writer
        self.database = database

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["path"] != PATH or scope["method"] != "POST" or scope["query_string"]:
            await self.app(scope, receive, send)
            return
        secret = _bearer(scope)
        if secret is None:
            await self.app(scope, receive, send)
            return
        try:
            status, body, headers = await self._receive(secret, scope, receive)
        except InbandError as error:
            note_reason(scope, error)
            status, body, headers = error.status, _json.encode(error.as_problem()), error.headers
        except Exception as error:  # noqa: BLE001 - nobody behind us would answer
            await (await unforeseen(Request(scope), error))(scope, receive, send)
            return
        kind = b"application/json" if status < 400 else b"application/problem+json"
        await send(
            {
                "type": "http.response.start",
                "status": status,
                "headers": [
                    (b"content-type", kind),
                    (b"content-length", str(len(body)).encode()),
                    *((name.lower().encode(), value.encode()) for name, value in headers.items()),
                ],
            }
        )
        await send({"type": "http.response.body", "body": body})

    async def _receive(self, secret: str, scope: Scope, receive: Receive) -> tuple[int, bytes, dict[str, str]]:
        caller = await self.lookup(secret)
        if caller is None:
            raise NotSignedIn(
                _("This key is not known, or was revoked."), _("Make a key for the machine under Set-up and send it.")
            )
        scope["caller"] = caller
        body = await _body(receive)
        caller.must_somewhere("operator")
        reading = await decoded(body)
        status, value = await store_reading(caller, reading, self.directory, self.writer, self.database)
        return status, _json.encode(value), {}


async def decoded(body: bytes) -> ReadingIn:
    """The reading in a body; a large one is read on a thread. Raises `Invalid`."""
    now = datetime.now(UTC)
    return decode_one(body, now) if len(body) <= ON_THE_LOOP else await asyncio.to_thread(decode_one, body, now)


async def store_reading(
    caller: Caller, reading: ReadingIn, directory: Directory, writer: Writer, database: Database
) -> tuple[int, dict[str, Any]]:
    """Decide and store one reading: status and answer. Raises `InbandError`."""
    entry = directory.known(reading.characteristic)
    if entry is None:
        entry = await asyncio.to_thread(directory.look_up, reading.characteristic)
    caller.must_at(entry.machine_id, "operator")
    outcome = await writer.submit(entry, reading)
    if isinstance(outcome, TooManyTouches) and caller.kind == "machine":  # a person reads the answer
        await asyncio.to_thread(writer.refused, outcome.entry, outcome.touch.as_dict())
    return await answer_to(outcome, database)


async def answer_to(outcome: Outcome, database: Database) -> tuple[int, dict[str, Any]]:
    """An outcome as status and answer: 201 for a new reading, 200 for one sent again. Raises what it refuses with."""
    if isinstance(outcome, InbandError):
        raise outcome
    if isinstance(outcome, Stored):
        return 200, await asyncio.to_thread(_stored, database, outcome)
    assert isinstance(outcome, Verdict)  # columns are made of batches only
    return 201, answer_of(outcome)


def _stored(database: Database, stored: Stored) -> dict[str, Any]:
    with database.begin() as session:
        return queries.first_answers(session, stored.entry, [stored.sequence])[stored.sequence]


def answer_of(verdict: Verdict) -> dict[str, Any]:
    """The answer to a reading that was stored just now."""
    correction = verdict.correction
    return answer(
        verdict.stream.entry.characteristic,
        verdict.record(),
        verdict.parameters,
        correction=(correction.tool_memory, correction.amount) if correction else None,
        alarms=[(alarm.id or 0, alarm.kind) for alarm in verdict.alarms],
        results=verdict.results,
        measure_next=verdict.measure_next,
        touches=verdict.reading.touches,
    )


def _bearer(scope: Scope) -> str | None:
    for name, value in scope["headers"]:
        if name == b"authorization":
            scheme, _space, secret = value.decode("latin-1").partition(" ")
            return secret.strip() if scheme.lower() == "bearer" else None
    return None


async def _body(receive: Receive) -> bytes:
    parts: list[bytes] = []
    size = 0
    while True:
        message = await receive()
        if message["type"] == "http.disconnect":
            raise Invalid(_("The connection was closed before the reading was complete."))
        part = message.get("body", b"")
        size += len(part)
        if size > LARGEST_BODY:
            raise TooLarge(
                _("A single reading has at most %(limit)s kB.") % {"limit": LARGEST_BODY // 1024},
                _("Send many readings to /api/v1/readings/batch."),
            )
        parts.append(part)
        if not message.get("more_body"):
            return parts[0] if len(parts) == 1 else b"".join(parts)
