"""Parameters that routes share: a session of the database, the settings, the address of the server, numbers, words, forms."""

import socket
from collections.abc import AsyncIterator, Iterator, Mapping
from typing import Annotated, cast
from urllib.parse import urlsplit

from fastapi import Depends, Query, Request, Response, params
from pydantic import AfterValidator
from sqlalchemy.orm import Session
from starlette.datastructures import FormData

from app.db.engine import Database
from app.db.replica import MustSee, Replica
from app.errors import FieldError, Invalid, NotAllowed
from app.language.i18n import _
from app.settings import Settings, is_loopback
from app.web.fields import LARGEST_ID

Number = Annotated[int | None, Query(ge=0, le=LARGEST_ID)]
Before = Annotated[int | None, Query(ge=1, le=LARGEST_ID)]
"""Number of the last item of the part before."""
Word = Annotated[str | None, Query(max_length=64)]
Sought = Annotated[str, Query(max_length=200), AfterValidator(lambda typed: typed.replace("\0", "").strip())]
"""Words that the rows of a list have to hold."""
SESSION_COOKIE = "inband_session"
STATION_COOKIE = "inband_station"
"""Of a device that is bound to a machine; sent to the pages below /station only."""
MOST_FIELDS = 3_000
"""Of a form of the one who is signed in: lists of characteristics to choose from are long. It is read once, where its token is checked."""
SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
WRITTEN_COOKIE = "inband_written"
"""Place in the log of the database at which the last change of this browser ends; see `app.web.own_changes`."""
EVENT_HEADER = "X-Inband-Event"
"""Number of the live event that made a page look again."""


def keep_cookie(answer: Response, settings: Settings, name: str, value: str, seconds: float, path: str = "/") -> None:
    """Let the browser keep a secret, which no script reads and no other site sends along."""
    answer.set_cookie(
        name,
        value,
        max_age=round(seconds),
        path=path,
        httponly=True,
        samesite="lax",
        secure=settings.secure_cookies,
    )


def may_read_replica(request: Request) -> None:
    request.state.may_read_replica = request.method in SAFE_METHODS


FROM_REPLICA = cast("params.Depends", Depends(may_read_replica))
"""For routers of heavy reading: charts, statistics, reports, exports, searches. A copy of the database will do for it."""


def get_session(request: Request) -> Iterator[Session]:
    """One transaction for the request, committed before the answer leaves; on the copy of the database, nothing but reading.

    A page that refuses (`app.web.templates.page` with a status of 400 and more) keeps nothing of what was begun.
    """
    replica: Replica | None = request.app.state.replica
    if replica is not None and getattr(request.state, "may_read_replica", False):
        wanted = _must_see(request)
        reading = None if wanted is None else replica.begin(wanted)
        if reading is not None:
            request.state.behind = replica.behind
            with reading:
                yield reading
            return
    database: Database = request.app.state.database
    with database.begin() as session:
        yield session
        if getattr(request.state, "refused", False):
            session.rollback()


def get_door_session(request: Request) -> Iterator[Session]:
    """The same on a connection that pages do not use."""
    doors: Database = request.app.state.doors
    with doors.begin() as session:
        yield session


def _must_see(request: Request) -> MustSee | None:
    """Return what a copy must have for this request; None if it has to be answered by the server that is written to.

    `Cache-Control: no-cache` asks for that: a page that is loaded again, or a program that reads what it has just written.
    """
    if "no-cache" in request.headers.get("cache-control", ""):
        return None
    return MustSee(_place(request.cookies.get(WRITTEN_COOKIE)), _place(request.headers.get(EVENT_HEADER)))


def _place(text: str | None) -> int:
    return min(int(text), LARGEST_ID) if text and text.isascii() and text.isdigit() and len(text) < 20 else 0


MOST_SESSIONS, MOST_AT_DOORS, MOST_IN_TURN = 22, 8, 4
"""Requests of one process that have a session at once, those of machines, and those of anybody; others wait without a thread.

Together fewer than the 40 threads that answer: a request needs one for each of its steps. If all of them waited for a
connection, or for a lock, none would be left for the one who holds it.
"""
SessionDep = Annotated[Session, Depends(get_session, scope="function", max_concurrency=MOST_SESSIONS)]
DoorSessionDep = Annotated[Session, Depends(get_door_session, scope="function", max_concurrency=MOST_AT_DOORS)]
"""For what machines do round by round: fetching and confirming corrections, heartbeats."""


async def _turn() -> AsyncIterator[None]:
    yield


IN_TURN = cast("params.Depends", Depends(_turn, scope="function", max_concurrency=MOST_IN_TURN))
"""For what strangers may ask and what takes a thread: signing in, health, metrics."""


def get_settings(request: Request) -> Settings:
    return cast("Settings", request.app.state.settings)


SettingsDep = Annotated[Settings, Depends(get_settings)]


def get_address(request: Request, settings: SettingsDep) -> str:
    """Address of this server: the one an administrator set, or the one that this request came by.

    Of a request only a host is believed that leads nowhere else: this computer by its name or loopback, or the address of the
    socket. Any other may have been made up, and the link would lead the one who gets it to a stranger.
    """
    if settings.public_url:
        return settings.address
    came_by = request.base_url
    own, port = request.scope.get("server") or (settings.host, settings.port)
    if came_by.hostname in {own, "localhost", socket.gethostname().lower()} or is_loopback(came_by.hostname or ""):
        return str(came_by).rstrip("/")
    host = f"[{own}]" if ":" in own else own
    return f"{came_by.scheme}://{host}" + (f":{port}" if port else "") + str(request.scope.get("root_path", ""))


AddressDep = Annotated[str, Depends(get_address)]


def from_this_site(request: Request, settings: SettingsDep) -> None:
    """Guards forms that are sent before anybody is signed in.

    Raises `NotAllowed` when the browser says that another site sent it.
    """
    origin = request.headers.get("origin")
    if origin is None or request.headers.get("sec-fetch-site") == "same-origin":
        return
    own = {request.headers.get("host"), urlsplit(settings.address).netloc}
    if urlsplit(origin).netloc not in own:
        raise NotAllowed(
            _("This was sent from another site ({origin}).").format(origin=origin[:200]),
            _("Open Inband itself and send it from there."),
        )


def texts(form: FormData) -> dict[str, str]:
    """The text fields of a form; the last of a name counts. Line ends become plain ones.

    Raises `Invalid` for characters that cannot be stored.
    """
    fields = {
        name: value.replace("\r\n", "\n")
        for name, value in form.multi_items()
        if isinstance(value, str) and name != "csrf"
    }
    wrong = [name for name, value in fields.items() if "\0" in value or "\0" in name]
    if wrong:
        raise Invalid(
            _("The form holds the character U+0000, which cannot be stored."),
            errors=[FieldError(name.replace("\0", ""), _("holds the character U+0000; remove it")) for name in wrong],
        )
    return fields


async def get_form(request: Request) -> Mapping[str, str]:
    """The text fields of the form that was sent, without the token."""
    return texts(await request.form(max_files=1, max_fields=200))


FormDep = Annotated[Mapping[str, str], Depends(get_form)]
