"""Attempts that failed; how they slow the next one down is in tests/access/test_sign_in.py."""

from datetime import UTC, datetime, timedelta

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.access.attempts import note_attempt
from app.access.tables import LoginFailure


def test_they_are_kept_for_a_day(session: Session) -> None:
    for hours in (23, 25):
        session.add(LoginFailure(name=f"{hours} h", address="here", at=datetime.now(UTC) - timedelta(hours=hours)))
    session.flush()
    note_attempt(session, "now", "there", timedelta(hours=1), lambda _failures: None, ())
    kept = set(session.scalars(select(LoginFailure.name)))
    assert kept == {"23 h", "now"}
