"""Telling everybody what changed: one row per transaction in the journal, and a NOTIFY that wakes the listeners.

The number of an event is taken under a lock that is held until the commit, so numbers come in the order of the
commits and a client that saw number n has missed nothing before it. Everybody's commits wait for that lock, machines' too, so
a session takes it with its last statement, whenever its changes were published; what is rolled back never takes it.
"""

from typing import Any

import msgspec
from sqlalchemy import event, text
from sqlalchemy.orm import Session, SessionTransaction

CHANNEL = "'inband ' || current_schema()"
"""As SQL. Several plants may lie in one database, each in a schema: of another plant's events nobody is woken."""

# The end of a statement that writes: `changes` is an SQL expression for the list of changes, `after` what the lock waits for.
WRITTEN = """
held AS MATERIALIZED (SELECT pg_advisory_xact_lock(7291, 'event'::regclass::oid::int4) {after}),
written AS (INSERT INTO event (changes) SELECT {changes}::jsonb FROM held RETURNING id)
"""
# The writer of readings puts it behind its own inserts, so that telling costs it no statement.
PUBLISHED = f"{WRITTEN} SELECT pg_notify({CHANNEL}, id::text) FROM written"  # noqa: S608 - made of constants
_WRITE = text("WITH " + WRITTEN.format(changes="CAST(:changes AS text)", after="") + "SELECT FROM written")
# By itself: with Citus the table may lie on another node, where nobody listens.
_NOTIFY = text(f"SELECT pg_notify({CHANNEL}, '')")


def publish(session: Session, *changes: dict[str, Any]) -> None:
    """Say what this transaction changes, e.g. ``{"kind": "alarm", "machine": "lathe-1", "characteristic": "shaft-d40"}``.

    It is written with the commit, as one row with all that the transaction has published; not where it, or the savepoint in
    which this was called, is rolled back.
    """
    if not session.in_transaction():
        session.begin()  # whose end the changes share
    inside = session.get_nested_transaction()
    session.info.setdefault(_UNWRITTEN, []).extend((inside, dict(change)) for change in changes)


_UNWRITTEN = "changes that are published with the commit"


@event.listens_for(Session, "before_commit")
def _write(session: Session) -> None:
    if session.in_nested_transaction():
        return  # a savepoint is released, nothing is committed
    unwritten = session.info.pop(_UNWRITTEN, ())
    if unwritten:
        session.flush()
        session.execute(_WRITE, {"changes": msgspec.json.encode([change for _inside, change in unwritten]).decode()})
        session.execute(_NOTIFY)


@event.listens_for(Session, "after_soft_rollback")
def _forget_savepoint(session: Session, ended: SessionTransaction) -> None:
    kept = [(inside, change) for inside, change in session.info.get(_UNWRITTEN, ()) if not _lies_in(inside, ended)]
    session.info[_UNWRITTEN] = kept


@event.listens_for(Session, "after_transaction_end")
def _forget(session: Session, ended: SessionTransaction) -> None:
    if ended.parent is None:
        session.info.pop(_UNWRITTEN, None)


def _lies_in(inside: SessionTransaction | None, ended: SessionTransaction) -> bool:
    """Tell if a savepoint is this one, or one within it."""
    while inside is not None and inside is not ended:
        inside = inside.parent
    return inside is ended
