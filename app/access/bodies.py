"""Bodies of requests: read when it is known from the head who sends them, and no further than that caller may send.

So a stranger's body is not read at all, but for a few kB on the pages that are for everybody; and a body that comes in slowly
keeps nothing waiting but itself: it is complete before a route begins, which takes a thread, a session and a connection.
"""

import asyncio
from collections.abc import Iterable
from http import HTTPStatus
from typing import NamedTuple
from urllib.parse import unquote_plus
from weakref import WeakValueDictionary

from fastapi import FastAPI, Request
from starlette.routing import BaseRoute, Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.access.callers import Caller
from app.access.recognition import caller_of, device_at
from app.errors import FieldError, InbandError, NotAllowed, NotSignedIn, TooLarge
from app.language.i18n import _
from app.web.deps import SAFE_METHODS, STATION_COOKIE
from app.web.limits import DEFAULT, FORM, Takes, taken_by, too_large


def read_after_recognition(app: FastAPI) -> None:
    """Put `BodyLimit` around the routes that the application has, where what it raises becomes an answer."""
    app.router.middleware_stack = BodyLimit(app.router.middleware_stack, app.router.routes)


PIECE = 8000
"""Bytes of a form that are taken apart in one turn of the event loop: some milliseconds."""
MOST_ESCAPED = 50_000
"""Bytes of one field of a form that do not stand for themselves: all of it is made a text in one turn, some 15 ms. Pages whose
fields take longer texts send their form as multipart, in which everything stands for itself."""
HELD_BACK = 0.3
"""Seconds that anyone who has guessed too often waits for the refusal."""
NOBODY = "nobody"
_PLAIN = bytes(set(range(128)) - {ord("%")})


class Allowance(NamedTuple):
    """Bytes that are read of a body, and what is said of one that is longer."""

    most: int
    beyond: InbandError


class BodyLimit:
    """ASGI middleware around the routes of an application.

    Forms of one device or of one unknown address are answered one after the other, and so are all requests that are refused because
    nobody is known to send them: a hundred that come at once are a hundred turns of the event loop with readings in between. A guess
    takes as much processor as ten readings, so the answer to one too many is held back; its turn ends before.
    """

    def __init__(self, app: ASGIApp, routes: Iterable[BaseRoute]) -> None:
        self.app = app
        self._turns: WeakValueDictionary[str, asyncio.Lock] = WeakValueDictionary()
        self._declared = [
            (route.path_regex, route.methods or (), taken)
            for route in routes
            if isinstance(route, Route) and (taken := taken_by(route.endpoint)) is not None
        ]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["method"] in SAFE_METHODS:
            await self.app(scope, receive, send)
            return
        request = Request(scope)
        taken = self._taken(scope)
        allowance = await _allowance(request, taken)
        turn = NOBODY if allowance.most < 0 else ""
        if _announced(request) > allowance.most:
            receive = _refusing(allowance.beyond)
        elif request.headers.get("content-type", "").startswith("multipart/"):
            receive = _counted(receive, allowance)
        else:
            receive = await _read(receive, allowance, _is_form(request))
            turn = turn or _place(request, taken)
        if not turn:
            await self.app(scope, receive, send)
            return
        late: list[Message] = []

        async def send_in_time(message: Message) -> None:
            if late or message.get("status") == HTTPStatus.TOO_MANY_REQUESTS:
                late.append(message)
            else:
                await send(message)

        async with self._turns.setdefault(turn, asyncio.Lock()):
            await asyncio.sleep(0)  # others of this place wait now, whatever the application does at once
            await self.app(scope, receive, send_in_time)
        if late:
            await asyncio.sleep(HELD_BACK)
        for message in late:
            await send(message)

    def _taken(self, scope: Scope) -> Takes:
        path, method = scope["path"], scope["method"]
        return next(
            (taken for regex, methods, taken in self._declared if method in methods and regex.match(path)), DEFAULT
        )


async def _allowance(request: Request, taken: Takes) -> Allowance:
    if taken.by == "anybody":
        return Allowance(taken.most, too_large(taken.most))
    if await device_at(request) is not None:
        photos = taken.pictures and taken.by == "operator"  # what only engineers send, no tablet does
        most = taken.most if photos else FORM
        return Allowance(most, too_large(most, pictures=photos))
    try:
        caller = await caller_of(request)
    except NotSignedIn as refusal:
        return Allowance(-1, refusal)
    wrong = _not_allowed(caller, taken)
    if wrong is not None:
        return Allowance(min(taken.most, DEFAULT.most), wrong)
    return Allowance(taken.most, too_large(taken.most, pictures=taken.pictures))


def _place(request: Request, taken: Takes) -> str:
    """The token of the device, or the address of an unknown sender: forms of one place take turns. Empty for a known caller."""
    if token := request.cookies.get(STATION_COOKIE):
        return token
    return request.client.host if taken.by == "anybody" and request.client else ""


def _not_allowed(caller: Caller, taken: Takes) -> NotAllowed | None:
    """The refusal of a caller who may not send as much as the route takes."""
    if taken.by in {"anybody", "caller"}:
        return None
    try:
        if taken.by == "operator":  # which machines' own keys are as well
            caller.must_somewhere(taken.by)
        else:
            caller.must(taken.by)  # type: ignore[arg-type] # what is left is a role
    except NotAllowed as refusal:
        return refusal
    return None


def _announced(request: Request) -> int:
    length = request.headers.get("content-length", "")
    return int(length) if length.isascii() and length.isdigit() and len(length) < 20 else 0


def _refusing(refusal: InbandError) -> Receive:
    """A body whose reading is refused; a route that reads none answers as ever."""

    async def receive() -> Message:
        raise refusal

    return receive


def _counted(receive: Receive, allowance: Allowance) -> Receive:
    """A body that the route reads piece by piece, as far as it is allowed: a file."""
    total = 0

    async def counted() -> Message:
        nonlocal total
        message = await receive()
        total += len(message.get("body", b""))
        if total > allowance.most:
            raise allowance.beyond
        return message

    return counted


def _is_form(request: Request) -> bool:
    return request.headers.get("content-type", "").startswith("application/x-www-form-urlencoded")


async def _read(receive: Receive, allowance: Allowance, form: bool) -> Receive:
    """A body that has been read to its end, or as far as it is allowed. form: handed on in pieces, each with a turn of its own."""
    parts: list[bytes] = []
    total, more = 0, True
    while more:
        message = await receive()
        if message["type"] != "http.request":
            break
        part, more = message.get("body", b""), message.get("more_body", False)
        total += len(part)
        if total > allowance.most:
            return _refusing(allowance.beyond)
        parts.append(part)
    if more:
        return _replayed(receive, [message])
    body = b"".join(parts)
    if form and (field := _too_escaped(body)) is not None:
        return _refusing(_too_many_signs(field))
    size = PIECE if form else max(total, 1)
    pieces = [body[at : at + size] for at in range(0, total, size)] or [b""]
    last = len(pieces) - 1
    return _replayed(
        receive,
        [{"type": "http.request", "body": piece, "more_body": at < last} for at, piece in enumerate(pieces)],
    )


def _too_escaped(body: bytes) -> str | None:
    """The name of the field that holds more than `MOST_ESCAPED`, if one does."""
    if _escaped(body) <= MOST_ESCAPED:
        return None
    names = (field.partition(b"=")[0] for field in body.split(b"&") if _escaped(field) > MOST_ESCAPED)
    return next((unquote_plus(name[:60].decode("latin-1")) for name in names), None)


def _too_many_signs(field: str) -> TooLarge:
    wrong = _("holds more than {most} characters that are no plain letters or digits").format(most=MOST_ESCAPED)
    return TooLarge(
        f"{field}: {wrong}.",
        _(
            "Paste less at once. A program sends long texts as multipart/form-data, which has no such limit, or as JSON."
        ),
        errors=[FieldError(field, wrong)],
    )


def _escaped(body: bytes) -> int:
    return len(body.translate(None, _PLAIN))


def _replayed(receive: Receive, messages: list[Message]) -> Receive:
    heard = iter(messages)

    async def replay() -> Message:
        await asyncio.sleep(0)
        for message in heard:
            return message
        return await receive()

    return replay
