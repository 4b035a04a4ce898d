"""Attempts to sign in or to identify oneself: noted before the secret is looked at, and slowed down when too many have failed.

They are counted in the database, so that all server processes count together. An attempt is struck out when it was right: a
hundred attempts at once are a hundred failures, not one. A place where a person has been right before is remembered: strangers
who guess there keep nobody out who belongs there.
"""

import zlib
from collections.abc import Callable, Sequence
from datetime import datetime, timedelta
from math import ceil
from typing import NamedTuple

from sqlalchemy import delete, func, select, update
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.access import queries
from app.access.queries import Failed, Failures
from app.access.tables import KnownPlace, LoginFailure

PLACES = 50
"""Places kept of a person, the latest."""


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


def note_attempt(
    session: Session, name: str, address: str, within: timedelta, refuse: Callable[[Failures], None]
) -> int:
    """Note an attempt with this name from this address; its number. `refuse` raises where one must wait."""
    for lock in sorted({_lock_number(name), _lock_number(address)}):
        session.execute(select(func.pg_advisory_xact_lock(7292, lock)))  # a class of their own: 7291 is the house's
    session.execute(delete(LoginFailure).where(LoginFailure.at < func.now() - timedelta(days=1)))
    refuse(queries.failures(session, name, address, within))
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
