"""Largest size of a request. Past its limit a request is not read on, and is answered 413."""

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

MEGABYTE = 1_000_000
DEFAULT = MEGABYTE
LARGER: dict[str, int] = {
    "/api/v1/readings/batch": 32 * MEGABYTE,
    "/api/v1/readings/aqdef": 64 * MEGABYTE,
    "/import": 64 * MEGABYTE,
}
"""Paths, by their beginning, that take more than the default."""


def limit_of(path: str) -> int:
    """The bytes that a request to this path may have."""
    return next((limit for beginning, limit in LARGER.items() if path.startswith(beginning)), DEFAULT)


class BodyLimit:
    """ASGI middleware. (Starlette's own answers 413 as plain text only.)"""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        limit = limit_of(scope["path"])
        announced = Headers(scope=scope).get("content-length", "")
        total = int(announced) if announced.isascii() and announced.isdigit() else 0
        too_large = total > limit
        total = 0

        async def receive_limited() -> Message:
            nonlocal total
            message = {"type": "http.request"} if too_large else await receive()
            if message["type"] == "http.request":
                total += len(message.get("body", b""))
                if too_large or total > limit:
                    # An HTTPException, because FastAPI makes a 400 of any other error while it reads a body.
                    raise HTTPException(413, f"{limit // MEGABYTE} MB")
            return message

        await self.app(scope, receive_limited, send)
