"""Form measurements with their touches, and what was found in them. Lengths in mm."""

from datetime import datetime
from typing import Any

from sqlalchemy import (
    BigInteger,
    CheckConstraint,
    ForeignKey,
    ForeignKeyConstraint,
    Index,
    Sequence,
    func,
    text,
)
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base

FORM_NUMBERS = Sequence("form_id", metadata=Base.metadata)


class FormMeasurement(Base):
    """One feature as it was touched. Append-only: a trigger refuses to change it."""

    __tablename__ = "form_measurement"
    __table_args__ = (
        CheckConstraint("tolerance >= 0", name="tolerance"),
        CheckConstraint("repeatability >= 0", name="repeatability"),
        Index("form_measurement_id_key", "id"),
        Index("form_measurement_feature_idx", "machine_id", "feature", "kind", "id"),
        Index("form_measurement_key_key", "machine_id", "key", unique=True, postgresql_where=text("key IS NOT NULL")),
    )

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    id: Mapped[int] = mapped_column(
        BigInteger, primary_key=True, server_default=text("nextval('form_id')"), autoincrement=False
    )
    feature: Mapped[str]  # by which measurements of the same thing are found together
    kind: Mapped[str]
    part: Mapped[str | None]
    measured_at: Mapped[datetime]
    received_at: Mapped[datetime] = mapped_column(server_default=func.now())
    actor: Mapped[str]
    key: Mapped[str | None]
    given: Mapped[dict[str, Any]]  # touches, datum, tip: all that it is computed from
    method: Mapped[str | None]  # by which the verdict goes; None: as the standard has it
    tolerance: Mapped[float | None]
    repeatability: Mapped[float | None]
    characteristic_id: Mapped[int | None]  # whose reading the result becomes


class FormEvaluation(Base):
    """Evaluation of a measurement. The newest counts; append-only as well."""

    __tablename__ = "form_evaluation"
    __table_args__ = (
        ForeignKeyConstraint(["machine_id", "form_id"], ["form_measurement.machine_id", "form_measurement.id"]),
    )

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    form_id: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)  # 1, 2, 3 per measurement
    at: Mapped[datetime] = mapped_column(server_default=func.now())
    actor: Mapped[str]
    engine: Mapped[int]  # of the code that found it
    method: Mapped[str]
    value: Mapped[float]
    uncertainty: Mapped[float | None]  # expanded, k = 2
    verdict: Mapped[str | None]
    suspects: Mapped[int]  # how many touches do not belong
    result: Mapped[dict[str, Any]]  # every value, the suspects, centres, residuals
