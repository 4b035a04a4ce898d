"""Keys of wall screens: each opens the wall screen, which is looked at, and no other page or route.

They are no keys of programs (`app.access.keys`): nothing else looks for them. A secret has 256 random bits, is shown once, and is
kept as its SHA-256.
"""

import secrets
from collections.abc import Sequence
from typing import NamedTuple

from fastapi import Request
from sqlalchemy import select, text
from sqlalchemy.orm import Session
from sqlalchemy.sql import func

from app.access import names
from app.access.audit.actions import record
from app.access.new_keys import PREFIX, digest
from app.access.recognition import bearer
from app.access.tables import WallScreen
from app.errors import Conflict, NotFound
from app.language.i18n import _

MOST_SCREENS = 100

_USED = text(
    "UPDATE wall_screen SET last_used_at = now() "
    "WHERE id = :id AND (last_used_at IS NULL OR last_used_at < now() - interval '1 minute')"
)


class NewScreen(NamedTuple):
    """A wall screen just made; its key is shown only this once."""

    screen: WallScreen
    key: str


def add_screen(session: Session, name: str, actor: str) -> NewScreen:
    """Make a key for a wall screen. Raises `Invalid` for a name that cannot be used, `Conflict` where there are too many."""
    name = names.seen(name)
    if len(screens(session, limit=MOST_SCREENS)) >= MOST_SCREENS:
        raise Conflict(_("There are {n} wall screens already.").format(n=MOST_SCREENS), _("Revoke one first."))
    key = f"{PREFIX}wall_{secrets.token_urlsafe(32)}"
    screen = WallScreen(secret_hash=digest(key), name=name, created_by=actor)
    session.add(screen)
    session.flush()
    session.refresh(screen)
    record(session, actor, "wall screen made", f"wall-screen/{screen.id}", None, {"name": name})
    return NewScreen(screen, key)


def revoke_screen(session: Session, number: int, actor: str) -> None:
    """End a key: its screen shows nothing from its next look on. Revoking twice is harmless. Raises `NotFound`."""
    screen = session.get(WallScreen, number, with_for_update=True)
    if screen is None:
        raise NotFound(_("There is no wall screen {n}.").format(n=number), _("Choose one of the list."))
    if screen.revoked_at is None:
        screen.revoked_at = session.scalar(select(func.now()))
        session.flush()
        record(session, actor, "wall screen revoked", f"wall-screen/{number}", {"name": screen.name}, None)


def screens(session: Session, after: int = 0, limit: int | None = None) -> Sequence[WallScreen]:
    """Wall screens whose key is valid, the oldest first."""
    query = select(WallScreen).where(WallScreen.revoked_at.is_(None), WallScreen.id > after)
    return session.scalars(query.order_by(WallScreen.id).limit(limit)).all()


def screen_of(session: Session, key: str) -> int | None:
    """Number of the wall screen with this key; None for one that is not known or was revoked."""
    found = select(WallScreen.id).where(WallScreen.secret_hash == digest(key), WallScreen.revoked_at.is_(None))
    return session.scalar(found)


def screen_at(request: Request, session: Session) -> int | None:
    """Number of the wall screen that calls, noted as used; None for a key that is not known or was revoked.

    Raises `NotSignedIn` for another way of authorization.
    """
    number = screen_of(session, bearer(request) or "")
    if number is not None:
        session.execute(_USED, {"id": number})
    return number
