"""Attempts to sign in or to identify oneself: noted before the secret is looked at, and slowed down when too many have failed.

They are counted in the database, so that all server processes count together. An attempt is struck out when it was right: a
hundred attempts at once are a hundred failures, not one.
"""

import zlib
from collections.abc import Callable
from datetime import datetime, timedelta
from math import ceil
from typing import NamedTuple

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from app.access import queries
from app.access.queries import Failed, Failures
from app.access.tables import LoginFailure


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


def _lock_number(text: str) -> int:
    return zlib.crc32(text.encode()) % 2_000_000_000
