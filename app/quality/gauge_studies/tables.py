"""Gauge studies and their revisions. Both append-only: what was measured stays, and a correction is a new revision."""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, CheckConstraint, ForeignKey, ForeignKeyConstraint, Identity, Index, func, text
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base

KINDS = ("type_one", "bias", "linearity", "grr")


class GaugeStudy(Base):
    """One study of one gauge on one machine; what was measured lies in its revisions."""

    __tablename__ = "gauge_study"
    __table_args__ = (
        ForeignKeyConstraint(["machine_id", "characteristic_id"], ["characteristic.machine_id", "characteristic.id"]),
        CheckConstraint("kind IN ('type_one', 'bias', 'linearity', 'grr')", name="kind"),
        Index("gauge_study_id_key", "id", unique=True),
        Index("gauge_study_key_key", "machine_id", "key", unique=True, postgresql_where=text("key IS NOT NULL")),
    )

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True)
    kind: Mapped[str]
    characteristic_id: Mapped[int | None]
    key: Mapped[str | None]
    created_at: Mapped[datetime] = mapped_column(server_default=func.now())
    created_by: Mapped[str]


class GaugeStudyRevision(Base):
    """A study as it was from one moment on. settings: gauge, reference, tolerance …; rows: the values, cell by cell, mm."""

    __tablename__ = "gauge_study_revision"
    __table_args__ = (ForeignKeyConstraint(["machine_id", "study_id"], ["gauge_study.machine_id", "gauge_study.id"]),)

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    study_id: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    revision: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    at: Mapped[datetime] = mapped_column(server_default=func.now())
    actor: Mapped[str]
    reason: Mapped[str | None]  # None of the first
    settings: Mapped[dict[str, Any]]
    rows: Mapped[list[Any]]
