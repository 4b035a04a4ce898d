"""Expansion of characteristics, one row a characteristic at most."""

from datetime import datetime

from sqlalchemy import CheckConstraint, ForeignKeyConstraint, func
from sqlalchemy.orm import Mapped, mapped_column

from app.core.temperature import Expansion
from app.db.base import Base


class ThermalExpansion(Base):
    """The expansion of a characteristic, as `app.core.temperature.Expansion` has it. No decision rests on it."""

    __tablename__ = "thermal_expansion"
    __table_args__ = (
        ForeignKeyConstraint(["machine_id", "characteristic_id"], ["characteristic.machine_id", "characteristic.id"]),
        CheckConstraint("coefficient_uncertainty >= 0", name="coefficient_uncertainty"),
        CheckConstraint("temperature_uncertainty >= 0", name="temperature_uncertainty"),
        CheckConstraint("length >= 0", name="length"),
    )

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    characteristic_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    coefficient: Mapped[float | None]
    coefficient_uncertainty: Mapped[float | None]
    scale_coefficient: Mapped[float | None]
    temperature_uncertainty: Mapped[float | None]
    length: Mapped[float | None]
    changed_by: Mapped[str]
    changed_at: Mapped[datetime] = mapped_column(server_default=func.now())
    reason: Mapped[str]

    @property
    def expansion(self) -> Expansion:
        """As the core has it."""
        return Expansion(**{name: getattr(self, name) for name in Expansion.__dataclass_fields__})
