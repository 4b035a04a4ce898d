"""Everything that is refused or fails, as an answer: RFC 9457 for programs, a page for people. Never a stack trace."""

import errno
import logging
import re
from collections.abc import Awaitable, Callable, Collection, Sequence
from functools import cache
from typing import Any, NamedTuple, cast
from urllib.parse import quote, urlsplit

import psycopg
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.routing import iter_route_contexts
from sqlalchemy import exc as sql
from starlette.exceptions import HTTPException
from starlette.middleware.exceptions import ExceptionMiddleware
from starlette.requests import ClientDisconnect
from starlette.responses import JSONResponse, RedirectResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.db.connections import held_up
from app.errors import (
    PROBLEM_JSON,
    Busy,
    Conflict,
    DatabaseAway,
    DiskFull,
    InbandError,
    Invalid,
    MethodNotAllowed,
    NotAllowed,
    NotFound,
    NotSignedIn,
    OutcomeUnknown,
    Unexpected,
)
from app.language.i18n import _, negotiate, speaking
from app.logs import REQUEST
from app.web.deps import SAFE_METHODS
from app.web.json_bodies import MOST_ERRORS
from app.web.problem import problem_page
from app.web.request_log import note_reason
from app.web.validation import field_errors

log = logging.getLogger("inband")

FOR_PROGRAMS = ("/api/", "/health/", "/metrics")
ALREADY_TAKEN = "23505"
BAD_DATA = "22"
NO_ROOM = "53100"


def is_for_programs(path: str) -> bool:
    """Tell if a program reads answers from this path, or from this one below a plant.

    >>> is_for_programs("/api/v1/machines"), is_for_programs("/p/none/api/v1/machines"), is_for_programs("/p/none/machines")
    (True, True, False)
    """
    path = re.sub(r"\A/p/[^/]*", "", path)
    return path.startswith(FOR_PROGRAMS) or path == "/api"


def local_path(path: str | None, default: str = "/") -> str:
    r"""A path of this site to go to next, and nothing else: ``//evil.example`` and ``https://…`` become the default.

    >>> local_path("/alarms?state=active"), local_path("//evil.example"), local_path("/\\evil.example")
    ('/alarms?state=active', '/', '/')
    """
    if not path or not re.fullmatch(r"/(?![/\\])[^\\\x00-\x1f\x7f]*", path) or path.startswith("/sign-"):
        return default
    return path


def answer(request: Request, error: InbandError, cause: BaseException | None = None) -> Response:
    """The answer for an error of ours, as a document or as a page. cause: what it was made of, for the log."""
    note_reason(request.scope, error, cause)
    if is_for_programs(request.url.path):
        return JSONResponse(error.as_problem(), error.status, error.headers, media_type=PROBLEM_JSON)
    if isinstance(error, NotSignedIn):
        return _to_sign_in(request) if error.page == NotSignedIn.page else RedirectResponse(error.page, 303)
    return problem_page(request, error.as_problem(), error.headers)


def _to_sign_in(request: Request) -> Response:
    """People are asked to sign in and brought back to where they were; a form that was sent, to its page."""
    address = request.url.path + (f"?{request.url.query}" if request.url.query else "")
    if request.method not in {"GET", "HEAD"}:
        referer = urlsplit(request.headers.get("referer", ""))
        below = referer.path.removeprefix(request.scope.get("root_path", ""))
        address = below if referer.netloc == request.headers.get("host") else "/"
    where = local_path(address)
    return RedirectResponse("/sign-in" if where == "/" else f"/sign-in?next={quote(where, safe='/')}", 303)


async def _inband(request: Request, error: Exception) -> Response:
    assert isinstance(error, InbandError)
    return answer(request, error)


async def _validation(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    own = _resource(request.app, request.url.path)
    if own is not None and request.scope.get("endpoint") not in own.endpoints:
        return answer(
            request, _method_not_allowed(request)
        )  # the word was taken for a number of the neighbour's address
    return answer(request, Invalid.of(field_errors(error.errors()[:MOST_ERRORS]), said=3))


async def _http(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    if error.status_code == NotFound.status and (elsewhere := _without_slash(request)) is not None:
        return elsewhere
    if not is_for_programs(request.url.path):
        await request.app.state.recognise(request)
    return answer(request, _of_http(request, error))


def _of_http(request: Request, error: HTTPException) -> InbandError:
    path = request.url.path
    if error.status_code == NotFound.status:
        return NotFound(
            _("There is nothing at {path}.").format(path=path),
            _("Check the address; the documentation of the API lists them all."),
        )
    if error.status_code == NotAllowed.status:
        return NotAllowed(str(error.detail))
    if error.status_code == MethodNotAllowed.status:
        return _method_not_allowed(request)
    if 400 <= error.status_code < 500:
        return Invalid(
            _("The request cannot be read: {detail}").format(detail=error.detail), _("Correct it and send it again.")
        )
    return InbandError(str(error.detail))


def _method_not_allowed(request: Request) -> MethodNotAllowed:
    own = _resource(request.app, request.url.path)
    allowed = ", ".join(own.methods if own else ())
    return MethodNotAllowed(
        _("{method} cannot be used here.").format(method=request.method),
        _("Use one of these methods: {allowed}.").format(allowed=allowed),
        allowed=allowed,
    )


class _Resource(NamedTuple):
    """Resource at an address: its methods, and the functions that answer them."""

    methods: Collection[str]
    endpoints: Collection[Any]


def _resource(app: FastAPI, path: str) -> _Resource | None:
    """The resource at a path, by the most literal of the templates that fit: `/people/me` is not `/people/{person}`."""
    fitting = [route for route in _routes(app) if route.path_regex.match(path)]
    if not fitting:
        return None
    template = min(
        (route.path for route in fitting), key=lambda template_path: (template_path.count("{"), -len(template_path))
    )
    same = [route for route in fitting if route.path == template]
    methods = {method for route in same for method in route.methods or ()}
    return _Resource(
        [template_path for template_path in ("GET", "POST", "PUT", "PATCH", "DELETE") if template_path in methods],
        [route.endpoint for route in same],
    )


@cache
def _routes(app: FastAPI) -> Sequence[Route]:
    contexts = iter_route_contexts(app.routes)
    return [context.original_route for context in contexts if isinstance(context.original_route, Route)]


def _without_slash(request: Request) -> Response | None:
    """The way to a page whose address was typed with a slash at its end. It names no host: that of a request is not ours."""
    path = request.url.path.rstrip("/")
    if path in {"", request.url.path} or _resource(request.app, path) is None:
        return None
    query = f"?{request.url.query}" if request.url.query else ""
    return RedirectResponse(f"{quote(path)}{query}", 307)


async def _database(request: Request, error: Exception) -> Response:
    """Answer an error of the driver by its cause: none of ours (away, busy), the request, another request, or our fault."""
    cause = error.orig if isinstance(error, sql.DBAPIError) else error
    state = getattr(cause, "sqlstate", None) or ""
    if state == NO_ROOM:
        return answer(request, DiskFull(), cause)
    away = isinstance(cause, psycopg.OperationalError | psycopg.InterfaceError) or isinstance(error, sql.TimeoutError)
    if away or (isinstance(error, sql.DBAPIError) and error.connection_invalidated):
        if getattr(request.state, "behind", None) is not None:
            return _read_elsewhere(request, error)
        if _in_commit(request, error):
            look = _(
                "Wait a moment, load the page or the list again, and see whether it was stored before you repeat it."
            )
            return answer(request, OutcomeUnknown(look), cause)
        return answer(request, Busy() if held_up(cause) else DatabaseAway(), cause)
    if state == ALREADY_TAKEN:
        return answer(
            request,
            Conflict(
                _("Another user has just stored something under the same name."), _("Load it again and look first.")
            ),
        )
    if isinstance(cause, psycopg.DataError) or state.startswith(BAD_DATA):
        return answer(
            request, Invalid(_("A value of the request cannot be stored."), _("Correct it and send it again."))
        )
    return incident(request, error)


def _system(request: Request, error: Exception) -> Response:
    """Answer an error of the operating system: a full disk is said to be one."""
    if isinstance(error, OSError) and error.errno in {errno.ENOSPC, errno.EDQUOT}:
        return answer(request, DiskFull(), error)
    return incident(request, error)


def _read_elsewhere(request: Request, error: Exception) -> Response:
    """Answer the same request from the server that is written to: the copy it was reading has ended the query or is gone."""
    request.app.state.replica.failed(error)
    request.state.behind = None
    again: Any = ExceptionMiddleware(
        request.app.router, request.app.exception_handlers
    )  # all that is asked of it: to be called
    return cast("Response", again)


def _in_commit(request: Request, error: Exception) -> bool:
    """Tell if the connection was lost during a commit: SQLAlchemy names no statement for a commit."""
    return (
        request.method not in SAFE_METHODS
        and isinstance(error, sql.DBAPIError)
        and error.connection_invalidated
        and error.statement is None
    )


async def unforeseen(request: Request, error: Exception) -> Response:
    """The answer to an error that is not one of our own."""
    if isinstance(error, sql.DBAPIError | sql.TimeoutError | psycopg.Error):
        return await _database(request, error)
    return _system(request, error)


def incident(request: Request, error: BaseException) -> Response:
    """An unhandled error: logged in full under the id of the request, reported with nothing but that id."""
    number = REQUEST.get() or "-"
    log.error("unhandled error in %s %s", request.method, request.url.path, exc_info=error)
    return answer(
        request,
        Unexpected(
            _("An unexpected error. Nothing of this request was stored."),
            _("Try again. If it happens again, tell your administrator the request number {number}.").format(
                number=number
            ),
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
            except ClientDisconnect:
                return  # nobody is left to answer
            except Exception as error:
                if started:
                    raise  # half an answer has left; the server must break the connection
                await _system(request, error)(scope, receive, send)


Recognise = Callable[[Request], Awaitable[None]]


def add_problem_handlers(app: FastAPI, recognise: Recognise) -> None:
    """Make every error of this application an answer.

    recognise: looks up who is signed in, for pages that no route makes.
    """
    app.state.recognise = recognise
    app.add_exception_handler(InbandError, _inband)
    app.add_exception_handler(RequestValidationError, _validation)
    app.add_exception_handler(HTTPException, _http)
    for of_database in (sql.DBAPIError, sql.TimeoutError, psycopg.Error):
        app.add_exception_handler(of_database, _database)
    app.add_middleware(LastResort)
