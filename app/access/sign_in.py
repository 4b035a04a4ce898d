"""Signing in and out of a browser, and slowing down who guesses.

Strangers who guess keep nobody out: from a place where a person has signed in before (a browser by its cookie, an address)
only the failures with that name from that place count. All other places share what is left to guessing.
"""

import secrets
from datetime import UTC, datetime, timedelta
from functools import partial
from ipaddress import IPv6Address, ip_address
from typing import NamedTuple

from sqlalchemy import delete, func
from sqlalchemy.orm import Session

from app.access import names, queries
from app.access.attempts import Wait, note_attempt, refuse_again, remember, strike_out
from app.access.audit.actions import Acting, record
from app.access.new_keys import digest
from app.access.passwords import LONGEST, matches
from app.access.tables import BrowserSession, Person
from app.db.engine import Database
from app.errors import InbandError, TooManyRequests
from app.language.i18n import _

COUNTED = timedelta(minutes=15)
"""Time that a failure counts."""
FREE = {"pair": 5, "address": 20, "name": 50, "name anywhere": 500}
"""Failures before one must wait: of a name from one place, from one address; of a name from anywhere, for an address with
`OWN_FAILURES`, and for every place from which nobody of that name has signed in before."""
OWN_FAILURES = 3
WAIT = Wait(first=5.0, longest=300.0)


class SignInRefused(InbandError):
    """Wrong name or password. Which of the two is wrong is not said."""

    status = 401
    kind = "sign-in-refused"
    title = "Not signed in"


class SignedIn(NamedTuple):
    """The new session: its token is for the cookie alone. device: the token by which this browser is known, if it is new."""

    token: str
    expires_at: datetime
    device: str = ""


def sign_in(database: Database, name: str, password: str, address: str, hours: int, device: str = "") -> SignedIn:
    """Begin a browser session. address: where the request came from; device: the token of its browser, if it has one.

    Runs transactions of its own, because a failure must be kept although the request fails.
    Raises `SignInRefused`, or `TooManyRequests` after too many failures.
    """
    name = _typed(name)
    place, here = _place(address), f"device {digest(device).hex()}"
    counted_as = names.as_stored(name).casefold()[:200]
    guess = (counted_as, place, here)
    refuse_again(database, *guess)
    with database.begin() as session:
        person = _person(session, name)
        known_here = person is not None and device != "" and queries.known_place(session, person.id, here)
        counted_at = here if known_here else place
        known = known_here or (person is not None and queries.known_place(session, person.id, place))
        note_attempt(session, counted_as, counted_at, COUNTED, partial(_refuse, known=known), guess)
    usable = person is not None and person.disabled_at is None
    right = matches(password[: LONGEST + 1], person.password_hash if person is not None and usable else None)
    if not right or person is None:
        with database.begin() as session:
            subject = "people" if person is None else f"person/{person.name}"
            record(session, "sign-in", "sign-in failed", subject, after={"address": address})
        raise SignInRefused(
            _("Wrong name or password."),
            _("Type both again. If you have forgotten the password, ask an administrator for a new one."),
        )
    with database.begin() as session:
        strike_out(session, counted_as, counted_at)
        new_device = "" if counted_at == here else secrets.token_urlsafe(32)
        remember(session, person.id, [place, f"device {digest(new_device).hex()}" if new_device else here])
        by = Acting(person_id=person.id)
        record(session, person.name, "signed in", f"person/{person.name}", after={"address": address}, by=by)
        return begin_session(session, person.id, hours)._replace(device=new_device)


def knows(database: Database, name: str) -> bool:
    """Tell if a person of this name, as typed, may be known here: for a sign-in to several plants."""
    with database.begin() as session:
        return _person(session, _typed(name)) is not None


def _typed(name: str) -> str:
    """The name as far as it can be stored."""
    return name.replace("\0", "").strip()[:400].encode(errors="replace").decode()


def _person(session: Session, name: str) -> Person | None:
    return queries.person_named(session, names.as_stored(name)) or queries.person_named(session, name)


def _place(address: str) -> str:
    """The address as it is counted: of IPv6 the network, because anyone who has one address there has them all."""
    try:
        parsed = ip_address(address)
    except ValueError:
        return address[:200]
    if isinstance(parsed, IPv6Address):
        if parsed.ipv4_mapped is not None:
            return str(parsed.ipv4_mapped)
        return f"{IPv6Address(int(parsed) >> 64 << 64)}/64"
    return str(parsed)


def begin_session(session: Session, person_id: int, hours: int) -> SignedIn:
    """A session for a person who has just shown who they are."""
    session.execute(delete(BrowserSession).where(BrowserSession.expires_at < func.now()))
    token, expires_at = secrets.token_urlsafe(32), datetime.now(UTC) + timedelta(hours=hours)
    session.add(
        BrowserSession(
            token_hash=digest(token), person_id=person_id, csrf=secrets.token_urlsafe(32), expires_at=expires_at
        )
    )
    return SignedIn(token, expires_at)


def sign_out(session: Session, token: str, name: str) -> None:
    """End the session of this browser."""
    record(session, name, "signed out", f"person/{name}")
    session.execute(delete(BrowserSession).where(BrowserSession.token_hash == digest(token)))


def _refuse(failures: queries.Failures, *, known: bool) -> None:
    """Raises `TooManyRequests` where one must wait."""
    waits = [(failures.pair, FREE["pair"])]
    if not known:
        of_name = FREE["name"] if failures.address.number >= OWN_FAILURES else FREE["name anywhere"]
        waits += [(failures.address, FREE["address"]), (failures.name, of_name)]
    left = max(WAIT.left(failed, free, failures.now) for failed, free in waits)
    if left > 0:
        raise TooManyRequests(
            _("Too many sign-ins have failed."),
            _("Wait {n} seconds, then try again.").format(n=left),
            retry_after=left,
        )
