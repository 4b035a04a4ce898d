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

from app.access.audit.actions import acts
from app.access.callers import Caller, Role
from app.access.devices import Device
from app.access.recognition import browser_of, caller_of, device_at
from app.errors import NotAllowed, NotSignedIn
from app.language.i18n import _
from app.web.deps import MOST_FIELDS, SAFE_METHODS, SESSION_COOKIE, STATION_COOKIE
from app.web.json_bodies import checked_first

LONGEST_TOKEN = 400
"""Characters of a token that is looked at; ours have some 120."""

__all__ = [
    "Admin",
    "AnyCaller",
    "AtStation",
    "Caller",
    "Engineer",
    "Operator",
    "OperatorOrMachine",
    "Station",
    "Viewer",
    "recognise",
    "require",
]


async def get_caller(request: Request) -> Caller:
    """Return the caller, by key or by the browser's session.

    Raises `NotSignedIn`; `NotAllowed` for a change without the form's token (a foreign page may have sent it).
    """
    caller = await caller_of(request)
    _remember(request, caller)
    acts(caller.person_id, caller.key_id)
    if caller.csrf and request.method not in SAFE_METHODS:
        await _check_token(request, caller.csrf)
    return caller


def _remember(request: Request, caller: Caller) -> None:
    """Keep for the frame of the page to whom it is shown, no matter who."""
    request.state.person = caller
    if caller.csrf:
        request.state.csrf = masked(caller.csrf)


async def recognise(request: Request) -> None:
    """Look up who is signed in, if that can be found out, for a page without a caller of its own ("there is nothing here")."""
    if getattr(request.state, "person", None) is not None:
        return
    with suppress(SQLAlchemyError):
        browser = await browser_of(request)
        if browser is not None:
            _remember(request, browser.caller)


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
    if len(token) > LONGEST_TOKEN:
        return b""
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

    async def check(request: Request) -> None:
        (await caller_of(request)).must(role)

    caller_with_role.__name__ = f"require_{role}"
    checked_first(caller_with_role, check)
    return Depends(caller_with_role)


def operator_or_machine(caller: AnyCaller) -> Caller:
    """Let in the keys of machines, and nobody below the role operator. Which machine it is about, the route asks."""
    caller.must_somewhere("operator")
    return caller


async def _check_operator_or_machine(request: Request) -> None:
    (await caller_of(request)).must_somewhere("operator")


checked_first(operator_or_machine, _check_operator_or_machine)


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


async def get_at_station(request: Request, machine: str) -> AtStation:
    """Return the device of this machine, or the user who is signed in. A device is nobody: no other route knows its cookie.

    Raises what `get_caller` raises; `NotSignedIn` for a device that is not bound any more, `NotAllowed` for that of another
    machine.
    """
    device = await device_at(request)
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
    if STATION_COOKIE in request.cookies and device is None and SESSION_COOKIE not in request.cookies:
        ended = NotSignedIn(_("This device is not bound to a machine any more."))
        ended.page = "/station"
        raise ended
    caller = await get_caller(request)
    caller.must("viewer")
    return AtStation(caller, None)


Station = Annotated[AtStation, Depends(get_at_station)]
Viewer = Annotated[Caller, require("viewer")]
Operator = Annotated[Caller, require("operator")]
OperatorOrMachine = Annotated[Caller, Depends(operator_or_machine)]
Engineer = Annotated[Caller, require("engineer")]
Admin = Annotated[Caller, require("admin")]
