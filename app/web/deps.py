"""What routes ask for: a session of the database, who calls, and the fields of a form.

    def approve(session: SessionDep, caller: Operator, ...): ...

`Viewer`, `Operator`, `Engineer`, `Admin` let in people (and keys) with at least that role. A route that machines' own
keys may use asks for `AnyCaller` and then says ``caller.must_at(machine.id, "operator")``.
"""

import secrets
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Annotated, Any, cast
from urllib.parse import urlsplit

from fastapi import Depends, Request
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import FormData

from app.db.engine import Database
from app.errors import FieldError, Invalid, NotAllowed, NotSignedIn
from app.people.callers import Caller, Role
from app.people.keys import KeyRing
from app.people.queries import signed_in
from app.settings import Settings
from app.web.i18n import _

__all__ = [
    "AddressDep",
    "Admin",
    "AnyCaller",
    "Caller",
    "Engineer",
    "FormDep",
    "KeyRing",
    "Operator",
    "SessionDep",
    "SettingsDep",
    "Viewer",
    "from_this_site",
    "require",
]

SESSION_COOKIE = "inband_session"
SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})


def get_session(request: Request) -> Iterator[Session]:
    """One transaction for the request, committed before the answer leaves."""
    database: Database = request.app.state.database
    with database.begin() as session:
        yield session


SessionDep = Annotated[Session, Depends(get_session, scope="function")]


def get_settings(request: Request) -> Settings:
    return cast("Settings", request.app.state.settings)


SettingsDep = Annotated[Settings, Depends(get_settings)]


def get_address(request: Request, settings: SettingsDep) -> str:
    """How people reach this server: the address an administrator set, else the one that this request came by."""
    return settings.public_url or str(request.base_url).rstrip("/")


AddressDep = Annotated[str, Depends(get_address)]


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
    """Who calls: by key or by the browser's session.

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
        return caller
    token = request.cookies.get(SESSION_COOKIE)
    found = await run_in_threadpool(signed_in, session, token) if token else None
    if found is None:
        raise NotSignedIn(
            _("Nobody is signed in."), _("Sign in in the browser, or send a key: Authorization: Bearer YOUR-KEY")
        )
    caller, waiting = found
    request.state.person = caller
    request.state.csrf = caller.csrf
    request.state.waiting = waiting
    if request.method not in SAFE_METHODS:
        await _check_token(request, caller.csrf)
    return caller


async def recognise(request: Request) -> None:
    """For the frame of a page that no route makes, such as "there is nothing here": who is signed in, if that can be told."""
    token = request.cookies.get(SESSION_COOKIE)
    if token is None or getattr(request.state, "person", None) is not None:
        return

    def look() -> tuple[Caller, dict[str, int]] | None:
        database: Database = request.app.state.database
        with database.begin() as session:
            return signed_in(session, token)

    with suppress(SQLAlchemyError):
        found = await run_in_threadpool(look)
        if found is not None:
            request.state.person, request.state.waiting = found
            request.state.csrf = found[0].csrf


async def _check_token(request: Request, expected: str) -> None:
    given = request.headers.get("x-csrf-token")
    if given is None and _is_form(request):
        field = (await request.form()).get("csrf")
        given = field if isinstance(field, str) else None
    if given is None or not secrets.compare_digest(given.encode(errors="replace"), expected.encode()):
        raise NotAllowed(
            _(
                "The form did not carry the token of your session, so another site may have sent it. Nothing was changed."
            ),
            _("Load the page again and repeat what you did."),
        )


def _is_form(request: Request) -> bool:
    return request.headers.get("content-type", "").startswith(
        ("application/x-www-form-urlencoded", "multipart/form-data")
    )


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


AnyCaller = Annotated[Caller, Depends(get_caller)]


def require(role: Role) -> Any:
    """Let nobody in below this role. Use the aliases below."""

    def caller_with_role(caller: AnyCaller) -> Caller:
        caller.must(role)
        return caller

    caller_with_role.__name__ = f"require_{role}"
    return Depends(caller_with_role)


Viewer = Annotated[Caller, require("viewer")]
Operator = Annotated[Caller, require("operator")]
Engineer = Annotated[Caller, require("engineer")]
Admin = Annotated[Caller, require("admin")]


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
