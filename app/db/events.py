"""Telling everybody what changed: one row per transaction in the journal, and a NOTIFY that wakes the listeners.

The number of an event is taken under a lock that is held until the commit, so numbers come in the order of the
commits and a client that saw number n has missed nothing before it.
"""

from typing import Any

import msgspec
from sqlalchemy import text
from sqlalchemy.orm import Session

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

    Call it last in a transaction: commits of other transactions that publish wait until this one ends.
    """
    session.flush()
    session.execute(_WRITE, {"changes": msgspec.json.encode(changes).decode()})
    session.execute(_NOTIFY)
