"""Results of other measuring systems as readings of a characteristic, so that charts, alarms and reports work on them.

A result is asked for in the transaction that stores it, and pushed after its commit like any reading: decided, numbered,
answered. Its key, e.g. `work-zero:12:x`, makes pushing it again harmless, so what a crash has left is pushed by a periodic job.
"""

import logging
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from datetime import datetime
from typing import NamedTuple

from sqlalchemy import select
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.core.parameters import LARGEST_LENGTH
from app.db.engine import Database, database_of
from app.errors import DatabaseAway, InbandError, OutcomeUnknown
from app.jobs.actions import PeriodicJob, Unit
from app.loop.readings import queries
from app.loop.readings.records import Entry
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.batch import store_batch
from app.loop.readings.writer.pending import Stored, Verdict
from app.loop.tables.readings import ResultReading

log = logging.getLogger(__name__)

MOST_AT_ONCE = 100


class Source(NamedTuple):
    """The measurement that results belong to: the beginning of their keys (`work-zero:12`), when they were measured, which part."""

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


@contextmanager
def pushing(session: Session) -> Iterator[Session]:
    """A transaction of its own; the results that it asks for become readings after its commit.

    session: of the request. It is committed first, so that the request never holds two connections.
    """
    session.commit()
    database = database_of(session)
    with database.begin() as own:
        yield own
    push_results(database)


def push_results(database: Database) -> None:
    """Make what was asked for into readings at once, after the commit that asked; what cannot be now, the job does.

    Never raises: what asked is stored, and an error in its place would say that it is not. The request that calls it
    should hold no connection: many that each wait for a second one wait for each other.
    """
    try:
        with database.begin() as session:
            units = waiting_results(session)
    except Exception:
        log.exception("results are not readings yet; that is tried again within a minute")
        return
    for unit in units[:MOST_AT_ONCE]:
        try:
            with database.begin() as session:
                push_result(session, unit)
        except Exception:
            log.exception("%s is no reading yet; that is tried again within a minute", unit.subject)


def waiting_results(session: Session) -> list[Unit]:
    """Results that are to become readings, the oldest first."""
    waiting = (
        select(ResultReading.key, ResultReading.machine_id, ResultReading.characteristic_id)
        .where(ResultReading.sequence.is_(None), ResultReading.refused.is_(None))
        .order_by(ResultReading.asked_at, ResultReading.key)
    )
    return [
        Unit(f"result/{key}", (key, machine, characteristic), machine, characteristic)
        for key, machine, characteristic in session.execute(waiting)
    ]


def push_result(session: Session, unit: Unit) -> None:
    """Push one result. Its transaction holds no machine. What is refused is kept with the reason.

    Raises `DatabaseAway`, `OutcomeUnknown`: it goes on waiting.
    """
    key, machine_id, characteristic_id = unit.key
    result = session.scalars(
        select(ResultReading)
        .where(
            ResultReading.key == key,
            ResultReading.machine_id == machine_id,
            ResultReading.characteristic_id == characteristic_id,
            ResultReading.sequence.is_(None),
            ResultReading.refused.is_(None),
        )
        .with_for_update(skip_locked=True)
    ).one_or_none()
    if result is None:
        return
    entry = queries.entry_by_id(session, result.machine_id, result.characteristic_id)
    reading = ReadingIn(
        characteristic=entry.characteristic,
        measured=result.measured,
        measured_at=result.measured_at,
        part=result.part,
        key=result.key,
    )
    try:
        (outcome,) = store_batch(database_of(session), {}, [(entry, reading)])
    except (DatabaseAway, OutcomeUnknown):
        raise
    except InbandError as refusal:
        result.refused = refusal.detail
    else:
        assert isinstance(outcome, Stored | Verdict)  # columns are made of greater batches only
        result.sequence = outcome.sequence if isinstance(outcome, Stored) else outcome.record().sequence


JOB = PeriodicJob("results_become_readings", waiting_results, push_result)
