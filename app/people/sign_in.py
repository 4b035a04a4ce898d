"""Signing in and out of a browser, and slowing down who guesses.

Failures are counted in the database, so that all server processes count together. An attempt is noted before the password
is looked at and struck out when it was right: a hundred attempts at once are a hundred failures, not one.
"""

import secrets
import zlib
from datetime import UTC, datetime, timedelta
from math import ceil
from typing import NamedTuple

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from app.db.engine import Database
from app.errors import InbandError, TooManyRequests
from app.people import queries
from app.people.keys import digest
from app.people.passwords import LONGEST, matches
from app.people.tables import BrowserSession, LoginFailure
from app.web.i18n import _

COUNTED = timedelta(minutes=15)
"""How long a failure counts."""
FREE = {"pair": 5, "address": 20, "name": 50}
"""Failures before one must wait: of a name from one address, from one address, of a name from anywhere."""
FIRST_WAIT, LONGEST_WAIT = 5.0, 300.0
"""Seconds; the wait doubles with each further failure."""


class SignInRefused(InbandError):
    """Name and password do not belong together. Which of the two is wrong is not said."""

    status = 401
    kind = "sign-in-refused"
    title = "Not signed in"


class SignedIn(NamedTuple):
    """The new session: its token is for the cookie alone."""

    token: str
    expires_at: datetime


def sign_in(database: Database, name: str, password: str, address: str, hours: int) -> SignedIn:
    """Begin a browser session.

    Runs transactions of its own, because a failure must be kept although the request fails.
    Raises `SignInRefused`, or `TooManyRequests` after too many failures.
    """
    name = name.strip().replace("\0", "")[:200]
    counted_as = name.casefold().encode(errors="replace").decode()
    with database.begin() as session:
        noted = _note_attempt(session, counted_as, address)
        person = queries.person_named(session, name) if name.isprintable() else None
    usable = person is not None and person.disabled_at is None
    right = matches(password[: LONGEST + 1], person.password_hash if person is not None and usable else None)
    if not right or person is None:
        raise SignInRefused(
            _("Name and password do not belong together."),
            _("Type both again. If you have forgotten the password, ask an administrator for a new one."),
        )
    with database.begin() as session:
        session.execute(
            delete(LoginFailure).where(
                (LoginFailure.id == noted) | ((LoginFailure.name == counted_as) & (LoginFailure.address == address))
            )
        )
        return begin_session(session, person.id, hours)


def begin_session(session: Session, person_id: int, hours: int) -> SignedIn:
    """A session for somebody who has just shown who they are."""
    session.execute(delete(BrowserSession).where(BrowserSession.expires_at < func.now()))
    token, expires_at = secrets.token_urlsafe(32), datetime.now(UTC) + timedelta(hours=hours)
    session.add(
        BrowserSession(
            token_hash=digest(token), person_id=person_id, csrf=secrets.token_urlsafe(32), expires_at=expires_at
        )
    )
    return SignedIn(token, expires_at)


def sign_out(session: Session, token: str) -> None:
    """End the session of this browser."""
    session.execute(delete(BrowserSession).where(BrowserSession.token_hash == digest(token)))


def _note_attempt(session: Session, name: str, address: str) -> int:
    for lock in sorted({_lock_number(name), _lock_number(address)}):
        session.execute(select(func.pg_advisory_xact_lock(7292, lock)))  # a class of their own: 7291 is the house's
    session.execute(delete(LoginFailure).where(LoginFailure.at < func.now() - timedelta(days=1)))
    found = queries.failures(session, name, address, COUNTED)
    wait = max(_wait(found.pair, FREE["pair"]), _wait(found.address, FREE["address"]), _wait(found.name, FREE["name"]))
    if wait and found.last is not None:
        left = ceil(wait - (found.now - found.last).total_seconds())
        if left > 0:
            raise TooManyRequests(
                _("Too many sign-ins have failed."),
                _("Wait {n} seconds, then try again.").format(n=left),
                retry_after=left,
            )
    attempt = LoginFailure(name=name, address=address)
    session.add(attempt)
    session.flush()
    return attempt.id


def _lock_number(text: str) -> int:
    return zlib.crc32(text.encode()) % 2_000_000_000


def _wait(failed: int, free: int) -> float:
    return 0.0 if failed < free else min(LONGEST_WAIT, FIRST_WAIT * 2 ** min(failed - free, 10))
