"""Addresses of a plant that is served below a prefix: stripped off requests, put before those of answers.

The pages of a plant write addresses from its root on, as if it were alone. Here every attribute of HTML that holds an address
gets the prefix, likewise ``Location``; JSON keeps paths from the root of the plant. Assets are the same for all plants. Cookies
are distinguished by the key of the plant in their name: the overview of all plants has to see them.
"""

import re
from collections.abc import Iterable, Mapping

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

ADDRESS = re.compile(rb"((?:\s(?:href|src|action|formaction)|<meta name=\"events\" content)=\")/(?!/|static/|plants\b)")
"""An attribute that begins with a path of the plant. Text between tags cannot look like that: its quotes are escaped."""
COOKIE = "inband_"
SHARED = frozenset({"inband_theme"})


class UnderPrefix:
    """ASGI middleware inside the compression of one plant's application: adds the prefix to the addresses of its answers."""

    def __init__(self, app: ASGIApp, prefix: str) -> None:
        self.app = app
        self.prefix = prefix

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        start: Message | None = None  # of a page, held back until its length is known
        page = bytearray()

        async def sending(message: Message) -> None:
            nonlocal start
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                location = headers.get("location", "")
                if location.startswith("/") and not location.startswith("//"):
                    headers["location"] = self.prefix + location
                if headers.get("content-type", "").startswith("text/html"):
                    start = message
                    return
            if start is None:
                await send(message)
                return
            page.extend(message.get("body", b""))
            if message.get("more_body"):
                return
            body = ADDRESS.sub(rb"\g<1>" + self.prefix.encode() + b"/", bytes(page))
            if "content-length" in (headers := MutableHeaders(scope=start)) and page:
                headers["content-length"] = str(len(body))
            await send(start)
            await send({**message, "body": body})

        await self.app(scope, receive, sending)


class OwnCookies:
    """ASGI middleware around the application of one plant: of the cookies it sees and sets its own alone."""

    def __init__(self, app: ASGIApp, key: str, prefix: str) -> None:
        self.app = app
        self.mark = f".{key}"
        self.prefix = prefix

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return

        async def sending(message: Message) -> None:
            if message["type"] == "http.response.start":
                message = {**message, "headers": [self._set(name, value) for name, value in message["headers"]]}
            await send(message)

        headers = [(name, self._seen(value) if name == b"cookie" else value) for name, value in scope["headers"]]
        await self.app({**scope, "headers": headers}, receive, sending)

    def _seen(self, header: bytes) -> bytes:
        seen = []
        for part in header.split(b";"):
            name, mark, value = part.strip().partition(b"=")
            text = name.decode("latin-1")
            if text.startswith(COOKIE) and text not in SHARED:
                if not text.endswith(self.mark):
                    continue
                name = name.removesuffix(self.mark.encode())
            seen.append(name + mark + value)
        return b"; ".join(seen)

    def _set(self, name: bytes, value: bytes) -> tuple[bytes, bytes]:
        if name.lower() != b"set-cookie" or not value.startswith(COOKIE.encode()):
            return name, value
        cookie, _mark, rest = value.decode("latin-1").partition("=")
        if cookie in SHARED:
            return name, value
        # The session is sent everywhere, for the overview; what belongs to some pages only, to those of this plant.
        rest = re.sub(r"(?i)(;\s*path=)(/[^;]+)", rf"\g<1>{self.prefix}\g<2>", rest)
        return name, f"{cookie}{self.mark}={rest}".encode("latin-1")


def cookies_of(header: str, name: str, keys: Iterable[str]) -> Mapping[str, str]:
    """The values of one cookie by plant, of those plants whose cookie the browser has sent."""
    sent = dict(part.strip().split("=", 1) for part in header.split(";") if "=" in part)
    return {key: sent[f"{name}.{key}"] for key in keys if f"{name}.{key}" in sent}
