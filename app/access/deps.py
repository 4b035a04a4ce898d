"""Callers of routes, by key or by the browser's session, and the role that a route asks for.

    def approve(session: SessionDep, caller: Operator, ...): ...

`Viewer`, `Operator`, `Engineer`, `Admin` let in people (and keys) with at least that role. A route that machines' own
keys may use asks for `AnyCaller` and then says ``caller.must_at(machine.id, "operator")``.
"""

import secrets
from base64 import urlsafe_b64decode, urlsafe_b64encode
from contextlib import suppress
from operator import xor
from typing import Annotated, Any, NamedTuple

from fastapi import Depends, Request
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session
from starlette.concurrency import run_in_threadpool

from app.access.audit.actions import acts
from app.access.callers import Caller, Role
from app.access.devices import Device, device_of
from app.access.keys import KeyRing
from app.access.queries import SignedIn, signed_in
from app.db.engine import Database, database_of
from app.errors import NotAllowed, NotSignedIn
from app.language.i18n import _
from app.web.deps import MOST_FIELDS, SAFE_METHODS, SESSION_COOKIE, STATION_COOKIE, SessionDep

__all__ = [
    "Admin",
    "AnyCaller",
    "AtStation",
    "Caller",
    "Engineer",
    "Operator",
    "Station",
    "Viewer",
    "recognise",
    "require",
]


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


async def get_caller(request: Request, session: SessionDep) -> Caller:
    """Return the caller, by key or by the browser's session.

    Raises `NotSignedIn`; `NotAllowed` for a change without the form's token (a foreign page may have sent it).
    """
    secret = bearer(request)
    if secret is not None:
        ring: KeyRing = request.app.state.key_ring
        caller = await ring.lookup(secret)
        if caller is None:
            raise NotSignedIn(
                _("This key is not known, or was revoked."),
                _("Ask an administrator for a new key: Set-up, machine, keys."),
            )
        request.state.person = caller  # a page says to whom it is shown, whoever that is
        acts(caller.person_id, caller.key_id)
        return caller
    token = request.cookies.get(SESSION_COOKIE)
    browser = await run_in_threadpool(_browser, request, session, token) if token else None
    if browser is None:
        raise NotSignedIn(
            _("Not signed in."), _("Sign in in the browser, or send a key: Authorization: Bearer YOUR-KEY")
        )
    _remember(request, browser)
    caller = browser.caller
    acts(caller.person_id, caller.key_id)
    if request.method not in SAFE_METHODS:
        await _check_token(request, caller.csrf)
    return caller


def _browser(request: Request, session: Session, token: str) -> SignedIn | None:
    """Look up who is signed in, always where it is written: no copy may let in whoever was signed out or disabled just now."""
    primary = database_of(session).copy_of
    if primary is None:
        return signed_in(session, token, request.app.state.waiting)
    with primary.begin() as own:
        return signed_in(own, token, request.app.state.waiting)


def _remember(request: Request, browser: SignedIn) -> None:
    """Keep for the frame of the page to whom it is shown, and the numbers of its navigation."""
    request.state.person, request.state.waiting = browser.caller, browser.waiting
    request.state.csrf = masked(browser.caller.csrf)


async def recognise(request: Request) -> None:
    """Look up who is signed in, if that can be told, for a page without a caller of its own ("there is nothing here")."""
    token = request.cookies.get(SESSION_COOKIE)
    if token is None or getattr(request.state, "person", None) is not None:
        return

    def look_up() -> SignedIn | None:
        database: Database = request.app.state.database
        with database.begin() as session:
            return signed_in(session, token, request.app.state.waiting)

    with suppress(SQLAlchemyError):
        browser = await run_in_threadpool(look_up)
        if browser is not None:
            _remember(request, browser)


async def _check_token(request: Request, expected: str) -> None:
    token = request.headers.get("x-csrf-token")
    if token is None and _is_form(request):
        field = (await request.form(max_fields=MOST_FIELDS)).get("csrf")
        token = field if isinstance(field, str) else None
    if token is None or not secrets.compare_digest(_unmasked(token), expected.encode()):
        raise NotAllowed(
            _(
                "The form did not carry the token of your session, so another site may have sent it. Nothing was changed."
            ),
            _("Load the page again and repeat what you did."),
        )


def masked(token: str) -> str:
    """A session's token as a page has it: other letters each time.

    Pages are compressed and repeat what an address says; of the same letters in each the length would tell, guess by guess
    (BREACH, https://breachattack.com).
    """
    pad = secrets.token_bytes(len(token))
    return urlsafe_b64encode(pad + bytes(map(xor, pad, token.encode()))).decode()


def _unmasked(token: str) -> bytes:
    """The session's token of a masked one; of anything else some bytes that are no token."""
    try:
        pad_and_token = urlsafe_b64decode(token)
    except ValueError:
        return b""
    half = len(pad_and_token) // 2
    return bytes(map(xor, pad_and_token[:half], pad_and_token[half:]))


def _is_form(request: Request) -> bool:
    return request.headers.get("content-type", "").startswith(
        ("application/x-www-form-urlencoded", "multipart/form-data")
    )


AnyCaller = Annotated[Caller, Depends(get_caller)]


def require(role: Role) -> Any:
    """Let nobody in below this role. Use the aliases below."""

    def caller_with_role(caller: AnyCaller) -> Caller:
        caller.must(role)
        return caller

    caller_with_role.__name__ = f"require_{role}"
    return Depends(caller_with_role)


class AtStation(NamedTuple):
    """A viewer of the station of a machine: a person who is signed in, or the device that is bound to it."""

    caller: Caller | None
    device: Device | None

    def must_act(self) -> None:
        """Raises `NotAllowed` for a person without the role operator. On a device it is asked who acts."""
        if self.caller is not None:
            self.caller.must("operator")

    @property
    def may_act(self) -> bool:
        return self.caller is None or self.caller.may("operator")


async def get_at_station(request: Request, session: SessionDep, machine: str) -> AtStation:
    """Return the device of this machine, or whoever is signed in. A device is nobody: no other route knows its cookie.

    Raises what `get_caller` raises; `NotSignedIn` for a device that is not bound any more, `NotAllowed` for that of another
    machine.
    """
    token = request.cookies.get(STATION_COOKIE)
    device = await run_in_threadpool(device_of, session, token) if token else None
    if device is not None and device.machine == machine:
        request.state.csrf = masked(device.csrf)
        if request.method not in SAFE_METHODS:
            await _check_token(request, device.csrf)
        return AtStation(None, device)
    if device is not None and SESSION_COOKIE not in request.cookies:
        raise NotAllowed(
            _("This device is bound to machine {machine}.").format(machine=device.machine),
            _("Open /station/{machine}, or have it bound again: Set-up, Stations.").format(machine=device.machine),
        )
    if token and device is None and SESSION_COOKIE not in request.cookies:
        ended = NotSignedIn(_("This device is not bound to a machine any more."))
        ended.page = "/station"
        raise ended
    caller = await get_caller(request, session)
    caller.must("viewer")
    return AtStation(caller, None)


Station = Annotated[AtStation, Depends(get_at_station)]
Viewer = Annotated[Caller, require("viewer")]
Operator = Annotated[Caller, require("operator")]
Engineer = Annotated[Caller, require("engineer")]
Admin = Annotated[Caller, require("admin")]
