"""The last word of each bridge, one row per machine that ever had a heartbeat, and when its control ran."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base


class MachineRun(Base):
    """A time in which a control reported by its bridge that it ran; kept for some days. Times are of the server's clock."""

    __tablename__ = "machine_run"

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    begin: Mapped[datetime] = mapped_column(primary_key=True)
    until: Mapped[datetime]


class Connection(Base):
    """The last heartbeat of a machine's bridge. Times are of the server's clock, unless said otherwise."""

    __tablename__ = "connection"
    __table_args__ = ({"postgresql_with": {"fillfactor": 50}},)

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    received_at: Mapped[datetime]
    state: Mapped[str]
    since: Mapped[datetime]  # of this state
    detail: Mapped[str | None]
    error: Mapped[str | None]  # the last detail of a state that was neither online nor starting
    error_at: Mapped[datetime | None]
    version: Mapped[str]
    kind: Mapped[str | None]
    started_at: Mapped[datetime | None]  # by the bridge's clock
    waiting: Mapped[int]
    oldest_waiting_at: Mapped[datetime | None]
    backing_up_since: Mapped[datetime | None]
    quarantined: Mapped[int]
    quarantine: Mapped[list[Any]]
    clock_offset: Mapped[float | None]  # s, control's clock less the bridge's
    mapping: Mapped[str | None]
    hold_all: Mapped[bool]
    identity: Mapped[str | None]
    locations: Mapped[list[Any]]
    held_back: Mapped[list[Any]] = mapped_column(server_default="[]")  # why corrections of a tool memory wait
    carries_decisions: Mapped[bool | None]  # of stop and hold, to the control; None: an older bridge does not say
