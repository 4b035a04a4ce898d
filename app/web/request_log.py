"""Every request has an id; those that fail, are refused or take long have a line in the log."""

import asyncio
import itertools
import logging
import re
import secrets
from http import HTTPStatus
from time import perf_counter

from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.errors import PROBLEM_JSON, InbandError, ServerEnding
from app.logs import REQUEST, without_secrets

log = logging.getLogger(__name__)

HEADER = b"x-request-id"
LONGEST_REASON = 300  # characters
STREAMS = frozenset({"/api/v1/events"})  # they last as long as a client listens
_SANE = re.compile(rb"[A-Za-z0-9._-]{1,64}")


class RequestLog:
    """ASGI middleware, the outermost. `slow`: seconds from which a request that went well is logged too."""

    def __init__(self, app: ASGIApp, slow: float) -> None:
        self.app = app
        self.slow = slow
        self._begin = secrets.token_hex(4)
        self._numbers = itertools.count(1)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        number = self._id(scope)
        REQUEST.set(number)
        status, begun = 0, perf_counter()

        async def sending(message: Message) -> None:
            nonlocal status
            if not status and message["type"] == "http.response.start":
                status = message["status"]
                message["headers"] = [*message["headers"], (HEADER, number.encode())]
            await send(message)

        try:
            await self.app(scope, receive, sending)
        except asyncio.CancelledError:  # nothing else cancels a request
            if status:
                raise
            error = ServerEnding()
            note_reason(scope, error)
            await JSONResponse(error.as_problem(), error.status, error.headers, PROBLEM_JSON)(scope, receive, sending)
        finally:
            seconds = perf_counter() - begun
            if status >= HTTPStatus.BAD_REQUEST or (seconds >= self.slow and scope["path"] not in STREAMS):
                _note(scope, status, seconds)

    def _id(self, scope: Scope) -> str:
        """The caller's own if it can be written into a log as it is, else a new one."""
        for name, value in scope["headers"]:
            if name == HEADER and _SANE.fullmatch(value):
                return str(value, "ascii")
        return f"{self._begin}-{next(self._numbers):x}"


def note_reason(scope: Scope, error: InbandError, cause: BaseException | None = None) -> None:
    """Say why a request is refused or fails, for its line in the log. cause: what the driver of the database raised."""
    state = scope.setdefault("state", {})
    state["refusal"] = error
    state["cause"] = cause


def _note(scope: Scope, status: int, seconds: float) -> None:
    state = scope.get("state", {})
    error: InbandError | None = state.get("refusal")
    if status == HTTPStatus.INTERNAL_SERVER_ERROR and error is not None:
        return  # it has been logged, with its trace
    caller = scope.get("caller") or state.get("person")
    client = scope.get("client")
    about = {
        "method": scope["method"],
        "path": scope.get("root_path", "") + without_secrets(scope["path"]),
        "status": status,
        "seconds": round(seconds, 4),
        "caller": getattr(caller, "name", None),
        "address": client[0] if client else None,
        "kind": error.kind if error else None,
    }
    words = f"{about['method']} {about['path']} {status or 'broken off'} in {seconds:.3f} s"
    if about["caller"]:
        words += f" for {about['caller']}"
    if about["address"]:
        words += f" from {about['address']}"
    if status >= HTTPStatus.BAD_REQUEST:
        words += f": {_reason(status, error, state.get('cause'))}"
    else:
        words += ": slow"
    level = (
        logging.WARNING
        if status >= HTTPStatus.INTERNAL_SERVER_ERROR or status < HTTPStatus.BAD_REQUEST
        else logging.INFO
    )
    log.log(level, "%s", words, extra=about)


def _reason(status: int, error: InbandError | None, cause: BaseException | None) -> str:
    if error is None:
        return HTTPStatus(status).phrase
    detail = error.detail if len(error.detail) <= LONGEST_REASON else f"{error.detail[:LONGEST_REASON]}…"
    return f"{detail} ({type(cause).__name__})" if cause else detail
