"""Readings into files, row by row out of a server-side cursor: however many there are, few are in memory."""

import csv
from collections.abc import Generator, Iterator
from datetime import datetime
from typing import Any, TextIO

import msgspec
from sqlalchemy import ColumnElement, select, text
from sqlalchemy.orm import Session, aliased

from app.core.context import Chosen, as_stored
from app.core.decision.limits import Zone
from app.core.decision.step import DECIMALS
from app.core.period import ALWAYS, Period
from app.core.temperature import AtReference
from app.core.variants import Results
from app.db.period import in_period
from app.files.formats.delimited import defused
from app.language.times import local
from app.loop.characteristics.queries import parameters_of
from app.loop.expansion.queries import at_20, expansion_of, temperatures_of
from app.loop.readings.by_hand import queries as by_hand
from app.loop.readings.by_hand.wording import verdict_of
from app.loop.readings.records import Entry
from app.loop.tables.readings import Exclusion, Reading, ReadingContext, ReadingResults, ReadingTouches

TEMPERATURES = ("part_temperature", "machine_temperature", "size_at_20")  # °C, mm
COLUMNS = (
    "sequence",
    "measured_at",
    "machined_at",
    "received_at",
    "part",
    "key",
    "measured",
    "deviation",
    "corrected_size",
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
    *Results._fields,
    "hand_measured",
    "hand_verdict",
    *TEMPERATURES,
)
OF_READING = COLUMNS[: COLUMNS.index("excluded")]
MADE_OF = {"decided_deviation": "decided", "corrected_size": "deviation"}
AT_ONCE = 2_000  # readings that are fetched at once


def _here(entry: Entry, chosen: Chosen) -> list[ColumnElement[bool]]:
    """Conditions on a reading that it is of this characteristic, and that its context has all of these values."""
    here = [Reading.machine_id == entry.machine_id, Reading.characteristic_id == entry.characteristic_id]
    if chosen:
        said = aliased(ReadingContext)
        those = select(said.sequence).where(
            said.machine_id == entry.machine_id,
            said.characteristic_id == entry.characteristic_id,
            said.context.contains(as_stored(chosen)),
        )
        here.append(Reading.sequence.in_(those))
    return here


def rows(
    session: Session, entry: Entry, *, period: Period = ALWAYS, last: int | None = None, chosen: Chosen = ()
) -> Generator[dict[str, Any], None, None]:
    """Readings in the order of their arrival: measured in the period, of the last `last` with this context."""
    hand = by_hand.latest_of_each()
    here = _here(entry, chosen)
    query = (
        # Columns, not entities: a session keeps hold of those, and cannot let go of them between two fetches.
        select(
            *(getattr(Reading, MADE_OF.get(name, name)) for name in OF_READING),
            Exclusion.reason,
            *(getattr(ReadingResults, name) for name in Results._fields),
            hand.measured,
            hand.good,
            ReadingTouches.touches,
            ReadingContext.context,
        )
        .outerjoin(
            ReadingContext,
            (ReadingContext.machine_id == Reading.machine_id)
            & (ReadingContext.characteristic_id == Reading.characteristic_id)
            & (ReadingContext.sequence == Reading.sequence),
        )
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
        .outerjoin(
            ReadingResults,
            (ReadingResults.machine_id == Reading.machine_id)
            & (ReadingResults.characteristic_id == Reading.characteristic_id)
            & (ReadingResults.sequence == Reading.sequence),
        )
        .outerjoin(
            hand,
            (hand.machine_id == Reading.machine_id)
            & (hand.characteristic_id == Reading.characteristic_id)
            & (hand.sequence == Reading.sequence),
        )
        .where(*here)
        .order_by(Reading.sequence)
    )
    if period.bounded:
        query = query.where(in_period(Reading.measured_at, period))
    if last is not None:
        newest = select(Reading.sequence).where(*here).order_by(Reading.sequence.desc()).offset(last).limit(1)
        before = session.scalar(newest)
        if before is not None:
            query = query.where(Reading.sequence > before)
    # Anyone who reads the file may be slow.
    session.execute(text("SET LOCAL idle_in_transaction_session_timeout = 0"))
    targets: dict[int, float] = {}
    expansion = expansion_of(session, entry.machine_id, entry.characteristic_id)
    with session.execute(query.execution_options(yield_per=AT_ONCE)) as fetched:  # closed too where the file is cut off
        for *values, good, touches, context in fetched:
            row = dict(zip(COLUMNS, (*values, verdict_of(good)), strict=False)) | {
                "touches": touches,
                "context": context,
            }
            version = row["parameters_version"]
            if version not in targets:
                targets[version] = parameters_of(session, entry.machine_id, entry.characteristic_id, version).target
            # Target + deviation, mm: the size as the drawing counts it.
            size = round(targets[version] + row["deviation"], DECIMALS)
            found = None if row["zone"] == Zone.PROBE_FAULT else at_20(size, context, expansion)
            at = found.size if isinstance(found, AtReference) else None
            beside = dict(zip(TEMPERATURES, (*temperatures_of(context), at), strict=True))
            yield row | beside | {"corrected_size": size}


class Ends:
    """The first and last of the readings that pass: their numbers, and from when to when they were measured."""

    def __init__(self) -> None:
        self.numbers: tuple[int, int] | None = None
        self.span: tuple[datetime, datetime] | None = None

    def of(self, readings: Iterator[dict[str, Any]]) -> Iterator[dict[str, Any]]:
        """The same readings; afterwards the ends are known."""
        for row in readings:
            number, at = row["sequence"], row["measured_at"]
            self.numbers = (self.numbers[0] if self.numbers else number, number)
            self.span = (min(self.span[0], at), max(self.span[1], at)) if self.span else (at, at)
            yield row


def write_csv(readings: Iterator[dict[str, Any]], file: TextIO) -> int:
    """As CSV with a header; texts that a spreadsheet would take for a formula are defused. The number of rows."""
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(COLUMNS)
    count = 0
    for row in readings:
        writer.writerow([_cell(row[name]) for name in COLUMNS])
        count += 1
    return count


def _cell(value: Any) -> Any:
    if isinstance(value, str):
        return defused(value)
    if isinstance(value, datetime):
        return local(value).isoformat()
    if isinstance(value, bool):
        return "true" if value else "false"
    return "" if value is None else value


def write_ndjson(readings: Iterator[dict[str, Any]], file: TextIO) -> int:
    """One JSON object per line, with touches, context and temperatures of those that have them. The number of rows."""
    count = 0
    for row in readings:
        for name in ("touches", "context", *TEMPERATURES):
            if row[name] is None:
                del row[name]
        file.write(msgspec.json.encode(row).decode() + "\n")
        count += 1
    return count
