"""Results of other measuring systems as readings of a characteristic, so that charts, alarms and reports work on them.

A result is asked for in the transaction that stores it, and pushed after its commit like any reading: decided, numbered,
answered. Its key, e.g. `work-zero:12:x`, makes pushing it again harmless, so what a crash has left is pushed by a chore.
"""

import logging
from collections.abc import Mapping
from datetime import datetime
from typing import NamedTuple

from sqlalchemy import Engine, select
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.core.parameters import LARGEST_LENGTH
from app.db.engine import Database, psycopg_url
from app.errors import DatabaseAway, InbandError, OutcomeUnknown
from app.readings import queries
from app.readings.ground import Stored, Verdict
from app.readings.keeper import store_batch
from app.readings.records import Entry
from app.readings.schemas import ReadingIn
from app.readings.tables import ResultReading

log = logging.getLogger(__name__)

MOST_AT_ONCE = 100


class Source(NamedTuple):
    """What the results belong to: the beginning of their keys (`work-zero:12`), when they were measured, which part."""

    key: str
    measured_at: datetime
    part: str | None = None


def ask_for(session: Session, entries: Mapping[str, Entry], values: Mapping[str, float], source: Source) -> None:
    """Ask for readings of these results, mm; `push_results` makes them after the commit."""
    rows = [
        {
            "machine_id": entries[result].machine_id,
            "characteristic_id": entries[result].characteristic_id,
            "key": f"{source.key}:{result}",
            "measured": value,
            "measured_at": source.measured_at,
            "part": source.part,
        }
        for result, value in values.items()
        if result in entries and abs(value) <= LARGEST_LENGTH
    ]
    if rows:
        session.execute(insert(ResultReading).values(rows).on_conflict_do_nothing())


def push_results(database: Database) -> None:
    """Make what was asked for into readings at once, after the commit that asked; what cannot be now, the chore does.

    Never raises: what asked is stored, and an error in its place would say that it is not. The request that calls it
    should hold no connection: many that each wait for a second one wait for each other.
    """
    try:
        with database.begin() as own:
            push_waiting(own)
    except Exception:
        log.exception("results are not readings yet; that is tried again within a minute")


def push_waiting(session: Session) -> bool:
    """Push what waits, `MOST_AT_ONCE` at a time; whether there may be more. Its transaction holds no machine.

    What is refused is kept with the reason; what the database was away for goes on waiting.
    """
    waiting = session.scalars(
        select(ResultReading)
        .where(ResultReading.sequence.is_(None), ResultReading.refused.is_(None))
        .order_by(ResultReading.asked_at, ResultReading.key)
        .limit(MOST_AT_ONCE)
        .with_for_update(skip_locked=True)
    ).all()
    if not waiting:
        return False
    engine = session.get_bind()
    assert isinstance(engine, Engine)
    dsn = psycopg_url(engine.url).set(drivername="postgresql").render_as_string(hide_password=False)
    for each in waiting:
        entry = queries.entry_by_id(session, each.machine_id, each.characteristic_id)
        reading = ReadingIn(
            characteristic=entry.characteristic,
            measured=each.measured,
            measured_at=each.measured_at,
            part=each.part,
            key=each.key,
        )
        try:
            (outcome,) = store_batch(dsn, {}, [(entry, reading)])
        except (DatabaseAway, OutcomeUnknown):
            return False
        except InbandError as refusal:
            each.refused = refusal.detail
        else:
            assert isinstance(outcome, Stored | Verdict)  # columns are made of greater batches only
            each.sequence = outcome.sequence if isinstance(outcome, Stored) else outcome.record().sequence
    session.flush()
    return len(waiting) == MOST_AT_ONCE
