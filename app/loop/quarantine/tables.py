"""Quarantines, one an alarm at most, and their parts. Lengths in mm."""

from datetime import datetime

from sqlalchemy import (
    ARRAY,
    BigInteger,
    CheckConstraint,
    ForeignKey,
    ForeignKeyConstraint,
    Index,
    Integer,
    Sequence,
    func,
    text,
)
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base

QUARANTINE_NUMBERS = Sequence("quarantine_id", metadata=Base.metadata)


class Quarantine(Base):
    """The parts of an alarm that a person has set aside. guard: measuring uncertainty by which the tolerance was narrowed."""

    __tablename__ = "quarantine"
    __table_args__ = (
        Index("quarantine_id_key", "id"),
        Index("quarantine_alarm_key", "machine_id", "alarm_id", unique=True),
    )

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    id: Mapped[int] = mapped_column(
        BigInteger, primary_key=True, server_default=text("nextval('quarantine_id')"), autoincrement=False
    )
    alarm_id: Mapped[int] = mapped_column(BigInteger)
    made_at: Mapped[datetime] = mapped_column(server_default=func.now())
    made_by: Mapped[str]
    reason: Mapped[str]
    guard: Mapped[float] = mapped_column(server_default="0")
    by_hand_only: Mapped[bool] = mapped_column(server_default="false")  # the probe is believed by nobody


class QuarantinedPart(Base):
    """One part; without `sequence` it was not measured, and is known by its name. `more`: parts of a row beyond the first."""

    __tablename__ = "quarantined_part"
    __table_args__ = (
        ForeignKeyConstraint(["machine_id", "quarantine_id"], ["quarantine.machine_id", "quarantine.id"]),
        ForeignKeyConstraint(["machine_id", "characteristic_id"], ["characteristic.machine_id", "characteristic.id"]),
        CheckConstraint("status IN ('open', 'released', 'scrapped')", name="status"),
        Index("quarantined_part_open_idx", "machine_id", "quarantine_id", postgresql_where=text("status = 'open'")),
        Index("quarantined_part_characteristic_idx", "machine_id", "characteristic_id"),
    )

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    quarantine_id: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    characteristic_id: Mapped[int]
    sequence: Mapped[int | None] = mapped_column(BigInteger)
    part: Mapped[str | None]
    part_to: Mapped[str | None]  # the last of a row of many
    order: Mapped[str | None]
    cut_at: Mapped[datetime | None]
    tool_memory: Mapped[int | None]
    offset: Mapped[float | None]  # that it was cut with
    cut_without: Mapped[list[int]] = mapped_column(ARRAY(Integer), server_default="{}")  # corrections issued before
    deviation: Mapped[float | None]
    measured: Mapped[float | None]
    found: Mapped[str]
    status: Mapped[str] = mapped_column(server_default="open")
    decided_at: Mapped[datetime | None]
    decided_by: Mapped[str | None]
    reason: Mapped[str | None]
    remeasured: Mapped[float | None]  # the size by which it was decided
