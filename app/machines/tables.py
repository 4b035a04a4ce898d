"""Machines and the one row per machine that everything which changes its state locks first."""

from datetime import datetime

from sqlalchemy import CheckConstraint, ForeignKey, Identity, func
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base


class Machine(Base):
    """A machine tool; `key` is its name in addresses and readings."""

    __tablename__ = "machine"
    __table_args__ = (
        CheckConstraint("control IN ('sinumerik', 'fanuc', 'heidenhain', 'other')", name="control"),
        CheckConstraint("corrections_expire_after > 0", name="corrections_expire_after"),
    )

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True)
    key: Mapped[str] = mapped_column(unique=True)
    name: Mapped[str]
    control: Mapped[str]
    created_at: Mapped[datetime] = mapped_column(server_default=func.now())
    corrections_expire_after: Mapped[float | None]  # h that a correction waits to be fetched and confirmed


class MachineState(Base):
    """The lock of a machine, and the number of its last correction (gap-free per machine)."""

    __tablename__ = "machine_state"
    __table_args__ = ({"postgresql_with": {"fillfactor": 50}},)

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    last_correction: Mapped[int] = mapped_column(server_default="0")
