"""A browser keeps where in the log of the database its last change ended, so that no copy that lacks it is shown to it."""

from sqlalchemy.exc import SQLAlchemyError
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.db.replica import Replica
from app.web.deps import SAFE_METHODS, WRITTEN_COOKIE
from app.web.fields import LARGEST_ID

KEPT = 3600
"""Seconds that a browser keeps the place of its last change; a copy that lags longer is not read."""


class OwnChanges:
    """ASGI middleware: a browser that has changed something keeps the place in the log of the database at which that ends.

    An answer that was read from the copy says in `X-Inband-Behind` how many seconds it may be old.
    """

    def __init__(self, app: ASGIApp, replica: Replica, *, secure: bool) -> None:
        self.app = app
        self.replica = replica
        self.secure = secure

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return

        async def sending(message: Message) -> None:
            if message["type"] == "http.response.start":
                behind = scope.get("state", {}).get("behind")
                if behind is not None:
                    MutableHeaders(scope=message)["X-Inband-Behind"] = f"{behind:.1f}"
                elif scope["method"] not in SAFE_METHODS and not _has_key(scope):
                    MutableHeaders(scope=message).append("Set-Cookie", await self._cookie())
            await send(message)

        await self.app(scope, receive, sending)

    async def _cookie(self) -> str:
        try:
            place = await run_in_threadpool(self.replica.written)
        except SQLAlchemyError:  # it may have been stored all the same: no copy is known to have it
            place = LARGEST_ID
        secure = "; Secure" if self.secure else ""
        return f"{WRITTEN_COOKIE}={place}; Path=/; Max-Age={KEPT}; HttpOnly; SameSite=Lax{secure}"


def _has_key(scope: Scope) -> bool:
    return any(name == b"authorization" for name, _value in scope["headers"])
