"""Readings into files, row by row out of a server-side cursor: however many there are, few are in memory."""

import csv
from collections.abc import Iterator
from datetime import datetime
from typing import Any, TextIO

import msgspec
from sqlalchemy import select, text
from sqlalchemy.orm import Session

from app.formats.delimited import defused
from app.readings.records import Entry
from app.readings.tables import Exclusion, Reading, ReadingTouches

COLUMNS = (
    "sequence",
    "measured_at",
    "machined_at",
    "received_at",
    "part",
    "key",
    "measured",
    "deviation",
    "decided_deviation",
    "zone",
    "action",
    "code",
    "average_before",
    "average_after",
    "correction",
    "correction_in_effect",
    "parameters_version",
    "late",
    "excluded",
)
AT_ONCE = 2_000


def rows(
    session: Session,
    entry: Entry,
    *,
    since: datetime | None = None,
    until: datetime | None = None,
    last: int | None = None,
) -> Iterator[dict[str, Any]]:
    """Readings in the order of their arrival: measured from `since` on and before `until`, of the last `last`."""
    here = (Reading.machine_id == entry.machine_id, Reading.characteristic_id == entry.characteristic_id)
    query = (
        select(Reading, ReadingTouches.touches, Exclusion.reason)
        .outerjoin(
            ReadingTouches,
            (ReadingTouches.machine_id == Reading.machine_id)
            & (ReadingTouches.characteristic_id == Reading.characteristic_id)
            & (ReadingTouches.sequence == Reading.sequence),
        )
        .outerjoin(
            Exclusion,
            (Exclusion.machine_id == Reading.machine_id)
            & (Exclusion.characteristic_id == Reading.characteristic_id)
            & (Exclusion.sequence == Reading.sequence),
        )
        .where(*here)
        .order_by(Reading.sequence)
    )
    if since is not None:
        query = query.where(Reading.measured_at >= since)
    if until is not None:
        query = query.where(Reading.measured_at < until)
    if last is not None:
        newest = select(Reading.sequence).where(*here).order_by(Reading.sequence.desc()).offset(last).limit(1)
        before = session.scalar(newest)
        if before is not None:
            query = query.where(Reading.sequence > before)
    # Whoever reads the file may be slow.
    session.execute(text("SET LOCAL idle_in_transaction_session_timeout = 0"))
    for reading, touches, excluded in session.execute(query.execution_options(yield_per=AT_ONCE)):
        row = {name: getattr(reading, name) for name in COLUMNS if name not in {"decided_deviation", "excluded"}}
        yield row | {"decided_deviation": reading.decided, "excluded": excluded, "touches": touches}
        session.expunge(reading)


def write_csv(found: Iterator[dict[str, Any]], file: TextIO) -> int:
    """As CSV with a header; texts that a spreadsheet would take for a formula are defused. The number of rows."""
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(COLUMNS)
    count = 0
    for row in found:
        writer.writerow([_cell(row[name]) for name in COLUMNS])
        count += 1
    return count


def _cell(value: Any) -> Any:
    if isinstance(value, str):
        return defused(value)
    if isinstance(value, datetime):
        return value.isoformat()
    if isinstance(value, bool):
        return "true" if value else "false"
    return "" if value is None else value


def write_ndjson(found: Iterator[dict[str, Any]], file: TextIO) -> int:
    """One JSON object per line, with the touches of those that have them. The number of rows."""
    count = 0
    for row in found:
        if row["touches"] is None:
            del row["touches"]
        file.write(msgspec.json.encode(row).decode() + "\n")
        count += 1
    return count
