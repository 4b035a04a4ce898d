"""Callers, recognised from the head of a request alone: by key, by the browser's session, or by the device. Asked once a request."""

from collections.abc import Callable
from typing import TypeVar, cast

from anyio import CapacityLimiter, to_thread
from fastapi import Request
from sqlalchemy.orm import Session

from app.access.callers import Caller
from app.access.devices import Device, device_of
from app.access.keys import KeyRing
from app.access.queries import SignedIn, signed_in
from app.db.engine import Database
from app.errors import NotSignedIn
from app.language.i18n import _
from app.web.deps import SESSION_COOKIE, STATION_COOKIE

Answer = TypeVar("Answer")
MOST_LOOKUPS = 4
"""Browsers that one process looks up at once."""


class Lookups:
    """Short questions about callers, on threads and connections of their own: pages may hold all the others."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._limiter = CapacityLimiter(MOST_LOOKUPS)

    async def ask(self, question: Callable[[Session], Answer]) -> Answer:
        """Answer a question in a transaction of its own."""

        def answer() -> Answer:
            with self._database.begin() as session:
                return question(session)

        return await to_thread.run_sync(answer, limiter=self._limiter)


def bearer(request: Request) -> str | None:
    """The secret in `Authorization: Bearer`; None without that header.

    Raises `NotSignedIn` for any other way of authorization.
    """
    header = request.headers.get("authorization")
    if header is None:
        return None
    scheme, _space, secret = header.partition(" ")
    if scheme.lower() != "bearer" or not secret.strip():
        raise NotSignedIn(
            _("The Authorization header is not understood."), _("Send it as: Authorization: Bearer YOUR-KEY")
        )
    return secret.strip()


async def caller_of(request: Request) -> Caller:
    """The caller, by key or by the browser's session. Raises `NotSignedIn`."""
    known: Caller | NotSignedIn | None = getattr(request.state, "recognised", None)
    if known is None:
        try:
            known = await _look_up(request)
        except NotSignedIn as refusal:
            known = refusal
        request.state.recognised = known
    if isinstance(known, NotSignedIn):
        raise known
    return known


async def _look_up(request: Request) -> Caller:
    secret = bearer(request)
    if secret is not None:
        ring: KeyRing = request.app.state.key_ring
        caller = await ring.lookup(secret)
        if caller is None:
            raise NotSignedIn(
                _("This key is not known, or was revoked."),
                _("Ask an administrator for a new key: Set-up, machine, keys."),
            )
        return caller
    browser = await browser_of(request)
    if browser is None:
        raise NotSignedIn(
            _("Not signed in."), _("Sign in in the browser, or send a key: Authorization: Bearer YOUR-KEY")
        )
    return browser.caller


async def browser_of(request: Request) -> SignedIn | None:
    """Return the person who is signed in in this browser, and the numbers of the navigation; None for nobody.

    Asked where it is written: no copy of the database may let in a user who was signed out or disabled just now.
    """
    token = request.cookies.get(SESSION_COOKIE)
    if token is None:
        return None
    lookups: Lookups = request.app.state.lookups
    waiting = request.app.state.waiting
    request.state.newest_event = request.app.state.live.newest  # all that a page shows is read after this one
    browser = await lookups.ask(lambda session: signed_in(session, token, waiting))
    if browser is not None:
        request.state.waiting = browser.waiting
    return browser


async def device_at(request: Request) -> Device | None:
    """The device that a request comes from; None for another, or one that is not bound any more."""
    token = request.cookies.get(STATION_COOKIE)
    if token is None:
        return None
    if not hasattr(request.state, "device"):
        request.state.newest_event = request.app.state.live.newest
        lookups: Lookups = request.app.state.lookups
        request.state.device = await lookups.ask(lambda session: device_of(session, token))
    return cast("Device | None", request.state.device)
