"""Control plans, one a characteristic at most, and the measurements that were missed."""

from datetime import datetime

from sqlalchemy import ARRAY, BigInteger, CheckConstraint, ForeignKeyConstraint, Identity, Index, Text, func, text
from sqlalchemy.orm import Mapped, mapped_column

from app.core.context import ContextField
from app.core.control_plan import Plan
from app.db.base import Base

_OF_CHARACTERISTIC = ["machine_id", "characteristic_id"], ["characteristic.machine_id", "characteristic.id"]


class ControlPlan(Base):
    """The control plan of a characteristic, as `app.core.control_plan.Plan` has it.

    since: it counts from then on. seen: the last reading that was looked at for missed measurements, context_seen: for what its
    context lacks.
    """

    __tablename__ = "control_plan"
    __table_args__ = (
        ForeignKeyConstraint(*_OF_CHARACTERISTIC),
        CheckConstraint("every >= 1", name="every"),
        CheckConstraint("minutes > 0", name="minutes"),
    )

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    characteristic_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    every: Mapped[int | None]
    minutes: Mapped[float | None]
    per_shift: Mapped[bool] = mapped_column(server_default="false")
    after_change: Mapped[int] = mapped_column(server_default="0")
    after_alarm: Mapped[int] = mapped_column(server_default="0")
    on_the_way: Mapped[int] = mapped_column(server_default="0")
    numbered: Mapped[bool] = mapped_column(server_default="false")
    required_context: Mapped[list[str]] = mapped_column(ARRAY(Text), server_default="{}")
    changed_by: Mapped[str]
    reason: Mapped[str]
    since: Mapped[datetime] = mapped_column(server_default=func.now())
    seen: Mapped[int] = mapped_column(BigInteger, server_default="0")
    context_seen: Mapped[int] = mapped_column(BigInteger, server_default="0")

    @property
    def plan(self) -> Plan:
        """As the core has it."""
        required = tuple(map(ContextField, self.required_context))
        return Plan(
            **{name: getattr(self, name) for name in Plan.__dataclass_fields__} | {"required_context": required}
        )


class MissedMeasurement(Base):
    """A time in which the plan was not kept, after a reading (0: before the first); open until the next reading.

    by: the rule of the plan. parts: parts that were cut and not measured, None where it is not known; minutes: that the machine ran.
    """

    __tablename__ = "missed_measurement"
    __table_args__ = (
        ForeignKeyConstraint(*_OF_CHARACTERISTIC),
        CheckConstraint("by IN ('parts', 'minutes', 'shift')", name="by"),
        Index("missed_measurement_characteristic_idx", "machine_id", "characteristic_id", "id"),
        Index(
            "missed_measurement_open_key",
            "machine_id",
            "characteristic_id",
            unique=True,
            postgresql_where=text("ended_at IS NULL"),
        ),
    )

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True)
    characteristic_id: Mapped[int]
    by: Mapped[str]
    after: Mapped[int] = mapped_column(BigInteger)
    every: Mapped[int | None]
    found_at: Mapped[datetime] = mapped_column(server_default=func.now())
    parts: Mapped[int | None]
    minutes: Mapped[float]
    shifts: Mapped[int] = mapped_column(server_default="0")
    until: Mapped[int | None] = mapped_column(
        BigInteger
    )  # the reading that ended it; None: open, or the plan was changed
    ended_at: Mapped[datetime | None]
