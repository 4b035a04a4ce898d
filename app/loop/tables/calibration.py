"""Calibrations, which of them were accepted, paired readings, and when the next calibration is due. Lengths in mm.

What a calibration is about is a *place*: a location of the average memory (R11), whose empirical value it finds, or a
location of the tool memory (R10) that holds the offset of a probe, which the ring finds.
"""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, CheckConstraint, ForeignKey, ForeignKeyConstraint, Identity, Index, func, text
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base

_MEMORY = "memory IN ('average', 'tool')"


class CalibrationRecord(Base):
    """One calibration as it came out, refused ones too. Append-only: a trigger refuses to change it."""

    __tablename__ = "calibration"
    __table_args__ = (
        CheckConstraint("kind IN ('gauge', 'ring', 'pairs')", name="kind"),
        CheckConstraint(_MEMORY, name="memory"),
        Index("calibration_place_idx", "machine_id", "memory", "location", "number"),
        Index("calibration_key_key", "machine_id", "key", unique=True, postgresql_where=text("key IS NOT NULL")),
    )

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)  # counts per machine
    kind: Mapped[str]
    memory: Mapped[str]
    location: Mapped[int]
    calibrated_at: Mapped[datetime]
    received_at: Mapped[datetime] = mapped_column(server_default=func.now())
    actor: Mapped[str]
    key: Mapped[str | None]
    outcome: Mapped[str]
    refused: Mapped[bool]
    settings: Mapped[dict[str, Any]]  # what was set for it: limits, repeats, axis, the ring's limits
    touches: Mapped[list[Any]]
    size: Mapped[float | None]  # R42
    measured: Mapped[float | None]  # R43
    difference: Mapped[float | None]  # R44; of a ring, what the probe is beside the spindle; of pairs, their mean
    average: Mapped[float | None]  # R49
    value_before: Mapped[float]  # empirical value or offset that was in effect
    proposed: Mapped[float | None]  # what it is to become; None: nothing is to be changed


class CalibrationAcceptance(Base):
    """Acceptance of a calibration: its proposal came into effect. Append-only as well."""

    __tablename__ = "calibration_acceptance"
    __table_args__ = (ForeignKeyConstraint(["machine_id", "number"], ["calibration.machine_id", "calibration.number"]),)

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    at: Mapped[datetime] = mapped_column(server_default=func.now())
    actor: Mapped[str]
    reason: Mapped[str]
    automatic: Mapped[bool]


class CalibrationPlan(Base):
    """Planned interval of calibration of a place, and what has passed since the last one.

    since: the last calibration that was not refused, or when the plan was made. counts: how far the characteristics of
    the machine had counted then, by their id. `due_parts` and `due_days` are None where nothing is planned. alarm_raised: the
    alarm *calibration overdue* was raised since then.
    """

    __tablename__ = "calibration_plan"
    __table_args__ = (
        CheckConstraint(_MEMORY, name="memory"),
        CheckConstraint("acceptance IN ('accept', 'automatic')", name="acceptance"),
    )

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    memory: Mapped[str] = mapped_column(primary_key=True)
    location: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    due_parts: Mapped[int | None]
    due_days: Mapped[float | None]
    acceptance: Mapped[str] = mapped_column(server_default="accept")
    since: Mapped[datetime] = mapped_column(server_default=func.now())
    counts: Mapped[dict[str, Any]] = mapped_column(server_default="{}")
    alarm_raised: Mapped[bool] = mapped_column("told", server_default="false")


class PairedReading(Base):
    """The same part on the machine and on an external gauge."""

    __tablename__ = "paired_reading"
    __table_args__ = (
        Index("paired_reading_place_idx", "machine_id", "location", "id"),
        Index("paired_reading_key_key", "machine_id", "key", unique=True, postgresql_where=text("key IS NOT NULL")),
    )

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True)
    location: Mapped[int]  # R11
    at: Mapped[datetime] = mapped_column(server_default=func.now())
    actor: Mapped[str]
    key: Mapped[str | None]
    machine_value: Mapped[float]
    true_value: Mapped[float]
    instrument: Mapped[str]
    characteristic_id: Mapped[int | None]  # the reading that the machine's value is, if it is one of ours
    sequence: Mapped[int | None] = mapped_column(BigInteger)
    excluded_at: Mapped[datetime | None]
    excluded_by: Mapped[str | None]
    excluded_why: Mapped[str | None]
