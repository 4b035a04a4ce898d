"""Everything that is refused or fails, as an answer: RFC 9457 for programs, a page for people. Never a stack trace."""

import logging
import re
import secrets
from urllib.parse import quote, urlsplit

import psycopg
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from sqlalchemy import exc as sql
from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse, RedirectResponse, Response
from starlette.routing import Match
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.errors import (
    Conflict,
    DatabaseAway,
    InbandError,
    Invalid,
    MethodNotAllowed,
    NotAllowed,
    NotFound,
    NotSignedIn,
    TooLarge,
    Unexpected,
)
from app.web.deps import recognise
from app.web.i18n import _, negotiate, speaking
from app.web.limits import MEGABYTE, limit_of
from app.web.problem import problem_page
from app.web.validation import field_errors

log = logging.getLogger("inband")

PROBLEM_JSON = "application/problem+json"
FOR_PROGRAMS = ("/api/", "/health/", "/metrics")
ALREADY_TAKEN = "23505"
BAD_DATA = "22"


def is_for_programs(path: str) -> bool:
    """Whether an answer from this path is read by a program."""
    return path.startswith(FOR_PROGRAMS) or path == "/api"


def local_path(path: str | None, default: str = "/") -> str:
    r"""A path of this site to go to next, and nothing else: ``//evil.example`` and ``https://…`` become the default.

    >>> local_path("/alarms?state=active"), local_path("//evil.example"), local_path("/\\evil.example")
    ('/alarms?state=active', '/', '/')
    """
    if not path or not re.fullmatch(r"/(?![/\\])[^\\\x00-\x1f\x7f]*", path) or path.startswith("/sign-"):
        return default
    return path


def answer(request: Request, error: InbandError) -> Response:
    """The answer for an error of ours, as a document or as a page."""
    if is_for_programs(request.url.path):
        return JSONResponse(error.as_problem(), error.status, error.headers, media_type=PROBLEM_JSON)
    if isinstance(error, NotSignedIn):
        return _to_sign_in(request)
    return problem_page(request, error.as_problem(), error.headers)


def _to_sign_in(request: Request) -> Response:
    """People are asked to sign in and brought back to where they were; a form that was sent, to its page."""
    wanted = request.url.path + (f"?{request.url.query}" if request.url.query else "")
    if request.method not in {"GET", "HEAD"}:
        referer = urlsplit(request.headers.get("referer", ""))
        wanted = referer.path if referer.netloc == request.headers.get("host") else "/"
    where = local_path(wanted)
    return RedirectResponse("/sign-in" if where == "/" else f"/sign-in?next={quote(where, safe='/')}", 303)


async def _inband(request: Request, error: Exception) -> Response:
    assert isinstance(error, InbandError)
    return answer(request, error)


async def _validation(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    errors = field_errors(error.errors())
    detail = "; ".join(f"{field}: {message}" for field, message in errors[:3])
    return answer(request, Invalid(detail, errors=errors))


async def _http(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    if not is_for_programs(request.url.path):
        await recognise(request)
    return answer(request, _of_http(request, error))


def _of_http(request: Request, error: HTTPException) -> InbandError:
    path = request.url.path
    if error.status_code == NotFound.status:
        return NotFound(
            _("There is nothing at {path}.").format(path=path),
            _("Check the address; the documentation of the API lists them all."),
        )
    if error.status_code == TooLarge.status:
        return TooLarge(
            _("The request is larger than the {limit} MB that are taken here.").format(
                limit=limit_of(path) // MEGABYTE
            ),
            _("Send it in several smaller requests."),
        )
    if error.status_code == NotAllowed.status:
        return NotAllowed(str(error.detail))
    if error.status_code == MethodNotAllowed.status:
        allowed = ", ".join(_methods(request))
        return MethodNotAllowed(
            _("{method} cannot be used here.").format(method=request.method),
            _("Use one of these methods: {allowed}.").format(allowed=allowed),
            allowed=allowed,
        )
    if 400 <= error.status_code < 500:
        return Invalid(
            _("The request cannot be read: {detail}").format(detail=error.detail), _("Correct it and send it again.")
        )
    return InbandError(str(error.detail))


def _methods(request: Request) -> list[str]:
    """What can be done at this address. (Starlette names the methods of the first route that fits, not of all.)"""
    return [
        method
        for method in ("GET", "POST", "PUT", "PATCH", "DELETE")
        if any(route.matches({**request.scope, "method": method})[0] is Match.FULL for route in request.app.routes)
    ]


async def _database(request: Request, error: Exception) -> Response:
    """What the driver says, told apart by who is to blame: nobody (away, busy), the request, another request, or we."""
    cause = error.orig if isinstance(error, sql.DBAPIError) else error
    state = getattr(cause, "sqlstate", None) or ""
    away = isinstance(cause, psycopg.OperationalError | psycopg.InterfaceError) or isinstance(error, sql.TimeoutError)
    if away or (isinstance(error, sql.DBAPIError) and error.connection_invalidated):
        log.warning("database away or busy: %s %s: %s", request.method, request.url.path, type(cause).__name__)
        return answer(request, DatabaseAway())
    if state == ALREADY_TAKEN:
        return answer(
            request,
            Conflict(
                _("Somebody else has just stored something under the same name."), _("Load it again and look first.")
            ),
        )
    if isinstance(cause, psycopg.DataError) or state.startswith(BAD_DATA):
        return answer(
            request, Invalid(_("A value of the request cannot be stored."), _("Correct it and send it again."))
        )
    return incident(request, error)


async def unforeseen(request: Request, error: Exception) -> Response:
    """The answer to an error that is not one of our own."""
    if isinstance(error, sql.DBAPIError | sql.TimeoutError | psycopg.Error):
        return await _database(request, error)
    return incident(request, error)


def incident(request: Request, error: BaseException) -> Response:
    """An error nobody foresaw: logged in full under a number, told with nothing but that number."""
    number = secrets.token_hex(4)
    log.error("incident %s: %s %s", number, request.method, request.url.path, exc_info=error)
    return answer(
        request,
        Unexpected(
            _("An error that nobody foresaw. Nothing of this request was stored."),
            _("Try again. If it happens again, tell your administrator the incident number {number}.").format(
                number=number
            ),
            incident=number,
        ),
    )


class LastResort:
    """ASGI middleware: speaks the caller's language, and answers what no handler took."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        started = False

        async def sending(message: Message) -> None:
            nonlocal started
            started = started or message["type"] == "http.response.start"
            await send(message)

        request = Request(scope, receive)
        with speaking(negotiate(request.headers.get("accept-language"))):
            try:
                await self.app(scope, receive, sending)
            except Exception as error:
                if started:
                    raise  # half an answer has left; the server must break the connection
                await incident(request, error)(scope, receive, send)


def add_problem_handlers(app: FastAPI) -> None:
    """Make every error of this application an answer."""
    app.add_exception_handler(InbandError, _inband)
    app.add_exception_handler(RequestValidationError, _validation)
    app.add_exception_handler(HTTPException, _http)
    for of_database in (sql.DBAPIError, sql.TimeoutError, psycopg.Error):
        app.add_exception_handler(of_database, _database)
    app.add_middleware(LastResort)
