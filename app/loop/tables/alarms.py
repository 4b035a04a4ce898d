"""Alarms, their acknowledgement, and photos of what was found.

While an alarm is active, the same trouble does not raise another: it adds to `count`. Numbers are
global, so that an alarm can be named without its machine.
"""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, ForeignKey, ForeignKeyConstraint, Index, LargeBinary, Sequence, func, text
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base

ALARM_NUMBERS = Sequence("alarm_id", metadata=Base.metadata)
PHOTO_NUMBERS = Sequence("alarm_photo_id", metadata=Base.metadata)


class Alarm(Base):
    """Something that needs a person; active until acknowledged."""

    __tablename__ = "alarm"
    __table_args__ = (
        Index("alarm_id_key", "id"),
        Index("alarm_raised_idx", "raised_at"),
        Index("alarm_characteristic_idx", "machine_id", "characteristic_id", "id"),
        Index(
            "alarm_active_characteristic_key",
            "machine_id",
            "characteristic_id",
            "kind",
            unique=True,
            postgresql_where=text("acknowledged_at IS NULL AND characteristic_id IS NOT NULL"),
        ),
        Index(
            "alarm_active_tool_key",
            "machine_id",
            "tool_memory",
            "kind",
            unique=True,
            postgresql_where=text("acknowledged_at IS NULL AND characteristic_id IS NULL"),
        ),
        Index("alarm_tool_idx", "machine_id", "tool_memory", "id", postgresql_where=text("characteristic_id IS NULL")),
        Index("alarm_active_idx", "machine_id", "id", postgresql_where=text("acknowledged_at IS NULL")),
        Index("alarm_acknowledged_idx", "acknowledged_at", "id", postgresql_where=text("acknowledged_at IS NOT NULL")),
    )

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    id: Mapped[int] = mapped_column(
        BigInteger, primary_key=True, server_default=text("nextval('alarm_id')"), autoincrement=False
    )
    kind: Mapped[str]
    characteristic_id: Mapped[int | None]
    tool_memory: Mapped[int | None]
    raised_at: Mapped[datetime] = mapped_column(server_default=func.now())
    last_at: Mapped[datetime] = mapped_column(server_default=func.now())
    count: Mapped[int] = mapped_column(server_default="1")
    sequence: Mapped[int | None] = mapped_column(BigInteger)  # the reading that raised it
    last_sequence: Mapped[int | None] = mapped_column(BigInteger)  # the latest that repeated it
    data: Mapped[dict[str, Any]] = mapped_column(server_default="{}")  # the values its sentence is worded from
    acknowledged_at: Mapped[datetime | None]
    acknowledged_by: Mapped[str | None]
    action: Mapped[str | None]
    comment: Mapped[str | None]
    outcome: Mapped[list[Any] | None]  # what followed, as codes with values
    cause: Mapped[int | None] = mapped_column(BigInteger)  # of the plant's catalogue, as the corrective action
    corrective_action: Mapped[int | None] = mapped_column(BigInteger)
    reaction_plan: Mapped[int | None] = mapped_column(BigInteger)  # by which it was handled, and its version
    reaction_version: Mapped[int | None]


class AlarmPhoto(Base):
    """A photo of what was found at an alarm. It stays as the alarm does; once removed, without what it shows."""

    __tablename__ = "alarm_photo"
    __table_args__ = (
        ForeignKeyConstraint(["machine_id", "alarm_id"], ["alarm.machine_id", "alarm.id"]),
        Index("alarm_photo_alarm_key", "machine_id", "alarm_id", "digest", unique=True),
    )

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    id: Mapped[int] = mapped_column(
        BigInteger, primary_key=True, server_default=text("nextval('alarm_photo_id')"), autoincrement=False
    )
    alarm_id: Mapped[int] = mapped_column(BigInteger)
    digest: Mapped[str]
    media_type: Mapped[str]
    width: Mapped[int]
    height: Mapped[int]
    size: Mapped[int]  # bytes
    content: Mapped[bytes | None] = mapped_column(LargeBinary, deferred=True)
    made_at: Mapped[datetime] = mapped_column(server_default=func.now())
    made_by: Mapped[str]
    removed_at: Mapped[datetime | None]
    removed_by: Mapped[str | None]
    removed_why: Mapped[str | None]
