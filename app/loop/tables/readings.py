"""Readings, what is kept beside them, and the state of each stream of readings.

A reading row is written once and never updated: exclusion has a table of its own. The key is
(machine, characteristic, sequence); the machine comes first so that the same schema shards by machine.
`reading` has no foreign keys: its stream row is read under the machine's lock in the same transaction
and is never deleted, so a check per row would only cost time.
"""

from datetime import datetime
from typing import Any

from sqlalchemy import (
    ARRAY,
    BigInteger,
    CheckConstraint,
    ForeignKeyConstraint,
    Identity,
    Index,
    Integer,
    SmallInteger,
    func,
    literal_column,
    text,
)
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base

PART_BEGINS = (3, 8)
"""Letters at the beginning of a part's name that are found by an index."""
PART_ENDS = (4, 7)
"""The same at its end, where people read serial numbers."""
_BLOCK_RANGES = {"pages_per_range": 64, "autosummarize": "on"}


class Stream(Base):
    """The running state of one characteristic, changed only under its machine's lock."""

    __tablename__ = "stream"
    __table_args__ = (
        ForeignKeyConstraint(["machine_id", "characteristic_id"], ["characteristic.machine_id", "characteristic.id"]),
        # Room for updates in place: this row changes with every reading.
        {"postgresql_with": {"fillfactor": 50}},
    )

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    characteristic_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    sequence: Mapped[int] = mapped_column(BigInteger, server_default="0")
    parameters_version: Mapped[int]
    tool_memory: Mapped[int]
    average_memory: Mapped[int]
    paused_by: Mapped[int | None] = mapped_column(BigInteger)
    sequence_at_tool_change: Mapped[int] = mapped_column(BigInteger, server_default="0")
    last_measured_at: Mapped[datetime | None]
    last_received_at: Mapped[datetime | None]
    last_measured: Mapped[float | None]
    last_deviation: Mapped[float | None]
    last_average: Mapped[float | None]
    last_zone: Mapped[str | None]
    level: Mapped[float | None]  # the deviation expected without any correction of the tool (plausible_jump)
    level_sequence: Mapped[int | None] = mapped_column(BigInteger)  # the reading that moved it last
    gain_from: Mapped[int] = mapped_column(BigInteger, server_default="0")  # up to this one, none tells of the gain


class Reading(Base):
    """One probe reading with the decision on it. Lengths in mm."""

    __tablename__ = "reading"
    __table_args__ = (
        Index(
            "reading_key_key",
            "machine_id",
            "characteristic_id",
            "key",
            unique=True,
            postgresql_where=text("key IS NOT NULL"),
        ),
        # Block ranges, for readings lie in the order of their arrival: next to nothing per reading, where a tree would cost
        # a batch a quarter of its speed. Parts by name and, for the search, by how it begins.
        Index(
            "reading_received_idx",
            "received_at",
            "measured_at",
            "zone",
            "action",
            postgresql_using="brin",
            postgresql_ops={
                "received_at": "timestamptz_minmax_multi_ops",
                "measured_at": "timestamptz_minmax_multi_ops",
                "zone": "text_bloom_ops (n_distinct_per_range = 16)",
                "action": "text_bloom_ops (n_distinct_per_range = 16)",
            },
            postgresql_with=_BLOCK_RANGES,
        ),
        Index(
            "reading_part_idx",
            "part",
            *(literal_column(f'"left"(part, {letters})').label(f"first_{letters}") for letters in PART_BEGINS),
            postgresql_using="brin",
            postgresql_ops={
                "part": "text_bloom_ops (n_distinct_per_range = 2500)",
                "first_3": "text_bloom_ops (n_distinct_per_range = 64)",
                "first_8": "text_bloom_ops (n_distinct_per_range = 600)",
            },
            postgresql_with=_BLOCK_RANGES,
        ),
        Index(
            "reading_part_end_idx",
            *(literal_column(f'"right"(part, {letters})').label(f"last_{letters}") for letters in PART_ENDS),
            postgresql_using="brin",
            postgresql_ops={f"last_{letters}": "text_bloom_ops (n_distinct_per_range = 2500)" for letters in PART_ENDS},
            postgresql_with=_BLOCK_RANGES,
        ),
    )

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    characteristic_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    sequence: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    measured: Mapped[float]
    deviation: Mapped[float]
    decided: Mapped[float]
    average_before: Mapped[float]
    average_after: Mapped[float]
    measured_at: Mapped[datetime]
    received_at: Mapped[datetime]
    machined_at: Mapped[datetime | None]
    parameters_version: Mapped[int]
    correction_in_effect: Mapped[int | None]
    correction: Mapped[int | None]
    paused_by: Mapped[int | None] = mapped_column(BigInteger)
    late: Mapped[bool]
    zone: Mapped[str]
    action: Mapped[str]
    code: Mapped[str]
    key: Mapped[str | None]
    part: Mapped[str | None]
    outstanding: Mapped[list[int] | None] = mapped_column(ARRAY(Integer))
    alarms: Mapped[list[int] | None] = mapped_column(ARRAY(BigInteger))
    # Corrections since the tool change that were in effect when the part was cut, summed; None where it is not known.
    compensated: Mapped[float | None]


class ReadingTouches(Base):
    """The single touches of a reading that came as touches: one list of repeats per point, mm."""

    __tablename__ = "reading_touches"

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    characteristic_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    sequence: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    touches: Mapped[list[Any]]


class ReadingContext(Base):
    """The circumstances of a reading, as `app.loop.readings.schemas.Context` has them; only for readings that have any."""

    __tablename__ = "reading_context"

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    characteristic_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    sequence: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    context: Mapped[dict[str, Any]]


class ReadingResults(Base):
    """Results of the measuring variant beside the value of a reading; only for readings that have any of it.

    mm, as `app.core.variants.Results` says. sections_outside and rejected: by the acceptance n of m.
    """

    __tablename__ = "reading_results"
    __table_args__ = (
        Index(
            "reading_results_outside_idx",
            "machine_id",
            "characteristic_id",
            "sequence",
            postgresql_include=["sections_outside", "rejected"],
            postgresql_where=text("sections_outside > 0"),
        ),
    )

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    characteristic_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    sequence: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    run_out: Mapped[float | None]
    out_of_roundness: Mapped[float | None]
    taper: Mapped[float | None]
    slope: Mapped[float | None]
    repeat_range: Mapped[float | None]
    repeat_deviation: Mapped[float | None]
    sections_outside: Mapped[int | None] = mapped_column(SmallInteger)
    rejected: Mapped[bool | None]
    straightness: Mapped[float | None]


class ReadingNext(Base):
    """Parts until the next measurement, as a reading was answered (`measure_next`); only where a control plan counts parts."""

    __tablename__ = "reading_next"

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    characteristic_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    sequence: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    measure_next: Mapped[int]


class HandMeasurement(Base):
    """Manual measurement of the part of a reading: a size, mm, or only whether it is good; `alarm` if entered there.

    Any number of them per reading; none replaces the machine's value.
    """

    __tablename__ = "hand_measurement"
    __table_args__ = (
        ForeignKeyConstraint(["machine_id", "characteristic_id"], ["characteristic.machine_id", "characteristic.id"]),
        CheckConstraint("measured IS NOT NULL OR good IS NOT NULL", name="something"),
    )

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    characteristic_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    sequence: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True)
    at: Mapped[datetime] = mapped_column(server_default=func.now())
    actor: Mapped[str]
    measured: Mapped[float | None]
    good: Mapped[bool | None]
    comment: Mapped[str | None]
    alarm: Mapped[int | None] = mapped_column(BigInteger)


class Exclusion(Base):
    """A reading taken out of the statistics, never out of the record."""

    __tablename__ = "exclusion"

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    characteristic_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    sequence: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    at: Mapped[datetime] = mapped_column(server_default=func.now())
    actor: Mapped[str]
    reason: Mapped[str]


class ImportMapping(Base):
    """A characteristic of measuring machines' files (AQDEF: part, number, name) that a person took for this one."""

    __tablename__ = "import_mapping"
    __table_args__ = (
        ForeignKeyConstraint(["machine_id", "characteristic_id"], ["characteristic.machine_id", "characteristic.id"]),
    )

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    characteristic_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    part: Mapped[str] = mapped_column(primary_key=True)
    number: Mapped[str] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(primary_key=True)
    actor: Mapped[str]
    at: Mapped[datetime]


class ReadingSummary(Base):
    """Summary of a full block of 2^level readings, so that a chart of millions reads a few thousand rows.

    Block b of level L holds the sequences b*2^L + 1 … (b+1)*2^L. Deviations in mm; `zones` counts readings
    per zone in the order of `app.core.decision.limits.Zone`. Excluded readings count: this is the record.
    """

    __tablename__ = "reading_summary"

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    characteristic_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    level: Mapped[int] = mapped_column(SmallInteger, primary_key=True, autoincrement=False)
    block: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    count: Mapped[int]
    minimum: Mapped[float]
    maximum: Mapped[float]
    sum: Mapped[float]
    sum_squares: Mapped[float]
    first: Mapped[float]
    last: Mapped[float]
    average: Mapped[float]
    corrections: Mapped[int]
    zones: Mapped[list[int]] = mapped_column(ARRAY(Integer))
    first_at: Mapped[datetime]
    last_at: Mapped[datetime]


class ResultReading(Base):
    """A result of another measuring system (a work zero, an alignment) that is to become a reading, and what became of it.

    The key is that of the reading, so that pushing it twice stores it once. Neither sequence nor refused: it waits.
    """

    __tablename__ = "result_reading"
    __table_args__ = (
        ForeignKeyConstraint(["machine_id", "characteristic_id"], ["characteristic.machine_id", "characteristic.id"]),
        Index(
            "result_reading_waiting_idx",
            "machine_id",
            postgresql_where=text("sequence IS NULL AND refused IS NULL"),
        ),
        Index("result_reading_key_idx", "key"),
    )

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    characteristic_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    key: Mapped[str] = mapped_column(primary_key=True)
    measured: Mapped[float]
    measured_at: Mapped[datetime]
    part: Mapped[str | None]
    asked_at: Mapped[datetime] = mapped_column(server_default=func.now())
    sequence: Mapped[int | None] = mapped_column(BigInteger)
    refused: Mapped[str | None]
