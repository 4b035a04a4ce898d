"""Query strings of pages. Forms send their empty fields along: what is empty was not said. And where nobody says of which readings
a page is, it is of those that the person keeps for the session.
"""

import re
from http import HTTPStatus
from urllib.parse import parse_qsl, urlencode

from starlette.datastructures import MutableHeaders, QueryParams
from starlette.requests import cookie_parser
from starlette.types import ASGIApp, Message, Receive, Scope, Send

EMPTY_SAYS_SOMETHING = ("/api/", "/import/", "/kinematics/measuring-plan", "/control/freeze")
"""Parts of the paths at which an empty parameter is not the same as none: it takes a value away that is there beforehand."""
PERIOD = ("last", "first", "through", "from", "to")
"""The fields of an address that say of which readings a page is."""
OF_READINGS = re.compile(r"/characteristics/[^/]+(/control|/capability|/what-if|/report)?$|/compare$")
KEPT, KEEP = "inband_period", "keep"
"""The cookie with the period of the session; and the field that keeps it (`yes`) or lets it go (`no`)."""
LONGEST = 200  # characters of it


def said_period(query: QueryParams) -> dict[str, str]:
    """The readings that an address asks for, to be said again by the ways to other pages; empty where it says nothing."""
    return {name: query[name] for name in PERIOD if query.get(name)}


class PageQueries:
    """ASGI middleware: the query string as a page is to read it."""

    def __init__(self, app: ASGIApp, *, secure: bool) -> None:
        self.app = app
        self._secure = secure

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["method"] not in {"GET", "HEAD"}:
            await self.app(scope, receive, send)
            return
        if scope["query_string"] and not any(part in scope["path"] for part in EMPTY_SAYS_SOMETHING):
            fields = scope["query_string"].split(b"&")
            scope["query_string"] = b"&".join(field for field in fields if field.partition(b"=")[1:] != (b"=", b""))
        if OF_READINGS.search(scope["path"]) and "/api/" not in scope["path"]:
            send = _with_period(scope, send, secure=self._secure)
        await self.app(scope, receive, send)


def _with_period(scope: Scope, send: Send, *, secure: bool) -> Send:
    """Fill in the period that is kept, where none is said; keep the one that is said, where that is asked for."""
    query = QueryParams(scope["query_string"])
    said, keep = said_period(query), query.get(KEEP)
    if keep in {"yes", "no"}:
        return _answering(scope, send, urlencode(said) if keep == "yes" else "", secure=secure)
    kept = kept_period(dict(scope["headers"]).get(b"cookie", b""))
    if kept and not said:
        scope["query_string"] = b"&".join(filter(None, (scope["query_string"], urlencode(kept).encode())))
    return send


def kept_period(cookies: bytes) -> dict[str, str]:
    """The period that the session keeps, by its cookie; empty without one."""
    kept = cookie_parser(cookies.decode("latin-1")).get(KEPT, "")[:LONGEST]
    return {name: value for name, value in parse_qsl(kept) if name in PERIOD}


def _answering(scope: Scope, send: Send, period: str, *, secure: bool) -> Send:
    """Send the cookie along, of this session or one that is over; not with a page that refuses the period."""
    end = ("" if period else "; Max-Age=0") + ("; Secure" if secure else "")
    cookie = f"{KEPT}={period[:LONGEST]}; Path={scope.get('root_path') or '/'}; HttpOnly; SameSite=Lax{end}"

    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start" and message["status"] < HTTPStatus.BAD_REQUEST:
            MutableHeaders(scope=message).append("set-cookie", cookie)
        await send(message)

    return sending
