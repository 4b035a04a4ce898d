"""Work zeros as they were found, with their touches, and what is watched of each fixture. Lengths in mm, angles in degrees."""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, CheckConstraint, ForeignKey, Index, Sequence, func, text
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base

KINDS = ("bore", "boss", "pocket", "web", "corner")
WORK_ZERO_NUMBERS = Sequence("work_zero_id", metadata=Base.metadata)


class WorkZero(Base):
    """One work zero. Append-only: a trigger refuses to change it; computing it again makes another."""

    __tablename__ = "work_zero"
    __table_args__ = (
        CheckConstraint("kind IN ('bore', 'boss', 'pocket', 'web', 'corner')", name="kind"),
        Index("work_zero_id_key", "id"),
        Index("work_zero_fixture_idx", "machine_id", "fixture", "id"),
        Index("work_zero_touched_idx", "machine_id", "fixture", "work_offset", "touched_at", "id"),
        Index(
            "work_zero_recomputed_idx",
            "machine_id",
            "recomputed_from",
            postgresql_where=text("recomputed_from IS NOT NULL"),
        ),
        Index("work_zero_key_key", "machine_id", "key", unique=True, postgresql_where=text("key IS NOT NULL")),
    )

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    id: Mapped[int] = mapped_column(
        BigInteger, primary_key=True, server_default=text("nextval('work_zero_id')"), autoincrement=False
    )
    kind: Mapped[str]
    fixture: Mapped[str | None]
    work_offset: Mapped[str]  # G54, G54.1 P3, G505
    part: Mapped[str | None]
    touched_at: Mapped[datetime]
    received_at: Mapped[datetime] = mapped_column(server_default=func.now())
    actor: Mapped[str]
    key: Mapped[str | None]
    given: Mapped[dict[str, Any]]  # touches, tip, Z: all that it was computed from
    x: Mapped[float | None]
    y: Mapped[float | None]
    z: Mapped[float | None]
    rotation: Mapped[float | None]
    diameter: Mapped[float | None]
    length: Mapped[float | None]
    width: Mapped[float | None]
    result: Mapped[dict[str, Any]]  # uncertainties, residuals, what to look at
    recomputed_from: Mapped[int | None] = mapped_column(BigInteger)


class Fixture(Base):
    """Settings of a vice or fixture: its reference zero, and the limits of its shift.

    basis: the first zero, the median of those before, or the one that is `reference` (frozen). characteristics: what the
    results of each zero are pushed to as readings, by result.
    """

    __tablename__ = "fixture"
    __table_args__ = (
        CheckConstraint("basis IN ('first', 'median', 'frozen')", name="basis"),
        CheckConstraint("warning > 0", name="warning"),
        CheckConstraint("alarm > 0", name="alarm"),
    )

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    key: Mapped[str] = mapped_column(primary_key=True)
    basis: Mapped[str] = mapped_column(server_default="first")
    reference: Mapped[int | None] = mapped_column(BigInteger)
    warning: Mapped[float | None]
    alarm: Mapped[float | None]
    characteristics: Mapped[dict[str, Any]] = mapped_column(server_default="{}")
