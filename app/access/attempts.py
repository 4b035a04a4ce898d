"""Attempts to sign in or to identify oneself: noted before the secret is looked at, and slowed down when too many have failed.

They are counted in the database, so that all server processes count together. An attempt is struck out when it was right: a
hundred attempts at once are a hundred failures, not one. A place where a person has been right before is remembered: strangers
who guess there keep nobody out who belongs there.

Anyone who must wait is refused from memory for a second: guesses in a row ask the database once.
"""

import zlib
from collections.abc import Callable, Sequence
from datetime import datetime, timedelta
from functools import partial
from math import ceil
from time import monotonic
from typing import NamedTuple
from weakref import WeakKeyDictionary

from sqlalchemy import delete, func, select, update
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.access import queries
from app.access.queries import Failed, Failures
from app.access.tables import KnownPlace, LoginFailure
from app.db.engine import Database, database_of
from app.errors import TooManyRequests

PLACES = 50
"""Places kept of a person, the latest."""
BELIEVED = 1.0
"""Seconds in which a refusal is repeated without asking the database."""
MOST_REFUSED = 10_000
"""Refusals remembered of a database."""


class Wait(NamedTuple):
    """Seconds: the first wait, doubled with each further failure up to the longest."""

    first: float
    longest: float

    def left(self, failed: Failed, free: int, now: datetime) -> int:
        """Seconds still to wait, counted from the last of these failures; `free` of them cost nothing."""
        if failed.number < free or failed.last is None:
            return 0
        wait: float = min(self.longest, self.first * 2 ** min(failed.number - free, 20))
        return max(0, ceil(wait - (now - failed.last).total_seconds()))


class _Refused(NamedTuple):
    """A refusal: raises the same again, in the language of who is refused this time."""

    again: Callable[[], None]
    at: float


_refused: WeakKeyDictionary[Database, dict[tuple[str, ...], _Refused]] = WeakKeyDictionary()


def refuse_again(database: Database, *guess: str) -> None:
    """Raise `TooManyRequests` if `note_attempt` has raised it for the same guess a moment ago."""
    refused = _refused.get(database, {}).get(guess)
    if refused is not None and monotonic() - refused.at < BELIEVED:
        refused.again()


def note_attempt(
    session: Session,
    name: str,
    address: str,
    within: timedelta,
    refuse: Callable[[Failures], None],
    guess: tuple[str, ...],
) -> int:
    """Note an attempt with this name from this address; its number. `refuse` raises `TooManyRequests` where one must wait.

    guess: all that the refusal depends on, for `refuse_again`.
    """
    for lock in sorted({_lock_number(name), _lock_number(address)}):
        session.execute(select(func.pg_advisory_xact_lock(7292, lock)))  # a class of their own: 7291 is the house's
    session.execute(delete(LoginFailure).where(LoginFailure.at < func.now() - timedelta(days=1)))
    failures = queries.failures(session, name, address, within)
    try:
        refuse(failures)
    except TooManyRequests:
        of_database = _refused.setdefault(database_of(session), {})
        if len(of_database) >= MOST_REFUSED:
            of_database.clear()
        of_database[guess] = _Refused(partial(refuse, failures), monotonic())
        raise
    attempt = LoginFailure(name=name, address=address)
    session.add(attempt)
    session.flush()
    return attempt.id


def strike_out(session: Session, name: str, address: str) -> None:
    """Forget the failures with this name from this address: the secret was right."""
    session.execute(delete(LoginFailure).where(LoginFailure.name == name, LoginFailure.address == address))


def strike_out_one(session: Session, attempt: int) -> None:
    """Forget this attempt alone: it was right, and says nothing about the others."""
    session.execute(delete(LoginFailure).where(LoginFailure.id == attempt))


def count_once(session: Session, attempt: int, name: str, address: str) -> None:
    """Count this attempt and all earlier ones with this name from this address as one."""
    strike_out(session, name, address)
    session.execute(update(LoginFailure).where(LoginFailure.id == attempt).values(name=name))


def remember(session: Session, person_id: int, places: Sequence[str]) -> None:
    """Keep where a person has been right."""
    row = insert(KnownPlace).values([{"person_id": person_id, "place": place} for place in places])
    session.execute(
        row.on_conflict_do_update(index_elements=["person_id", "place"], set_={"last_at": row.excluded.last_at})
    )
    of_person = KnownPlace.person_id == person_id
    latest = select(KnownPlace.place).where(of_person).order_by(KnownPlace.last_at.desc()).limit(PLACES)
    session.execute(delete(KnownPlace).where(of_person, KnownPlace.place.not_in(latest)))


def _lock_number(text: str) -> int:
    return zlib.crc32(text.encode()) % 2_000_000_000
