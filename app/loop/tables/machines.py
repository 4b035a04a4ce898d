"""Machines and the one row per machine that everything which changes its state locks first."""

from datetime import datetime

from sqlalchemy import BigInteger, CheckConstraint, ForeignKey, Identity, func
from sqlalchemy.orm import Mapped, mapped_column

from app.core.parameters import AVERAGE_LOCATIONS, MOST_LOCATIONS, TOOL_LOCATIONS
from app.core.uncertainty import SignalPath, position_uncertainty, zero_range_floor
from app.db.base import Base


class Machine(Base):
    """A machine tool; `key` is its name in addresses and readings."""

    __tablename__ = "machine"
    __table_args__ = (
        CheckConstraint("control IN ('sinumerik', 'fanuc', 'heidenhain', 'other')", name="control"),
        CheckConstraint("corrections_expire_after > 0", name="corrections_expire_after"),
        CheckConstraint("type IN ('lathe', 'mill', 'mill_turn', 'grinder', 'other')", name="type"),
        CheckConstraint(f"tool_locations BETWEEN 1 AND {MOST_LOCATIONS}", name="tool_locations"),
        CheckConstraint(f"average_locations BETWEEN 1 AND {MOST_LOCATIONS}", name="average_locations"),
        CheckConstraint("signal_path IN ('direct', 'plc')", name="signal_path"),
    )

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True)
    key: Mapped[str] = mapped_column(unique=True)
    name: Mapped[str]
    control: Mapped[str]
    type: Mapped[str] = mapped_column(server_default="other")
    tool_locations: Mapped[int] = mapped_column(server_default=str(TOOL_LOCATIONS))  # R10 goes so far
    average_locations: Mapped[int] = mapped_column(server_default=str(AVERAGE_LOCATIONS))  # R11
    created_at: Mapped[datetime] = mapped_column(server_default=func.now())
    corrections_expire_after: Mapped[float | None]  # h that a correction waits to be fetched and confirmed
    # Of the probe's signal: direct to the control, or through the PLC.
    signal_path: Mapped[str] = mapped_column(server_default="direct")
    signal_delay: Mapped[float] = mapped_column(server_default="0.25")  # ms, of the way through the PLC
    signal_jitter: Mapped[float | None]  # ms by which the delay varies, if a person has measured it
    probing_feed: Mapped[float] = mapped_column(server_default="150")  # mm/min
    # Set-up errors beyond are warned of: of parts in degrees and mm, and of rotary axes.
    plausible_turn: Mapped[float] = mapped_column(server_default="5")
    plausible_shift: Mapped[float] = mapped_column(server_default="10")
    plausible_axis_turn: Mapped[float] = mapped_column(server_default="1")
    plausible_axis_shift: Mapped[float] = mapped_column(server_default="1")
    simulated: Mapped[bool] = mapped_column(server_default="false")  # for trying; such a one can be removed again

    @property
    def position_uncertainty(self) -> float:
        """Travel of the axis until the signal has come through the PLC, mm; 0 on the direct path."""
        plc = self.signal_path == SignalPath.PLC
        return position_uncertainty(self.probing_feed, self.signal_delay) if plc else 0.0

    @property
    def zero_range_floor(self) -> float:
        """The part of it that varies from touch to touch, mm: a smaller R33 would correct what nobody has measured."""
        return zero_range_floor(SignalPath(self.signal_path), self.probing_feed, self.signal_delay, self.signal_jitter)


class MachineState(Base):
    """The lock of a machine, and the number of its last correction (gap-free per machine).

    version: moves whenever anything of the machine changes, so that the writer of readings knows whether what it has in
    memory still is what the database holds. planned: a characteristic of it has a control plan by parts, which readings are
    answered by.
    """

    __tablename__ = "machine_state"
    __table_args__ = ({"postgresql_with": {"fillfactor": 50}},)

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    last_correction: Mapped[int] = mapped_column(server_default="0")
    version: Mapped[int] = mapped_column(BigInteger, server_default="0")
    planned: Mapped[bool] = mapped_column(server_default="false")
