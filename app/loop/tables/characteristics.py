"""Characteristics and every version of their parameters."""

from datetime import datetime
from typing import Any

from sqlalchemy import CheckConstraint, ForeignKey, ForeignKeyConstraint, Identity, Index, func, text
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base


class Characteristic(Base):
    """A dimension of a part that one machine cuts and measures.

    form_of, form: the characteristic whose readings bring its own, and which of their results that is (`app.core.variants.FormResult`).
    """

    __tablename__ = "characteristic"
    __table_args__ = (
        CheckConstraint("unit = 'mm'", name="unit"),
        CheckConstraint(
            "form IN ('run_out', 'out_of_roundness', 'taper', 'straightness') AND form_of <> id", name="form"
        ),
        CheckConstraint("(form IS NULL) = (form_of IS NULL)", name="form_whole"),
        ForeignKeyConstraint(["machine_id", "form_of"], ["characteristic.machine_id", "characteristic.id"]),
        Index(
            "characteristic_form_idx",
            "machine_id",
            "form_of",
            "form",
            unique=True,
            postgresql_where=text("form_of IS NOT NULL"),
        ),
    )

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True)
    key: Mapped[str] = mapped_column(unique=True)
    name: Mapped[str]
    part: Mapped[str | None]
    unit: Mapped[str] = mapped_column(server_default="mm")
    form_of: Mapped[int | None]
    form: Mapped[str | None]
    created_at: Mapped[datetime] = mapped_column(server_default=func.now())


class ParametersVersion(Base):
    """A parameter set as it was from one moment on; never altered, because readings were judged by it."""

    __tablename__ = "parameters_version"
    __table_args__ = (
        ForeignKeyConstraint(["machine_id", "characteristic_id"], ["characteristic.machine_id", "characteristic.id"]),
    )

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    characteristic_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    version: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    parameters: Mapped[dict[str, Any]]
    created_at: Mapped[datetime] = mapped_column(server_default=func.now())
    created_by: Mapped[str]
    reason: Mapped[str | None]
