"""Signals that rules gave, and the progress of the job that looks for them."""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, CheckConstraint, ForeignKeyConstraint, Index, Sequence, func, text
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base

SIGNAL_NUMBERS = Sequence("signal_id", metadata=Base.metadata)


class Watching(Base):
    """Progress of the rules of a characteristic, and their memory (`app.core.spc.watch`).

    It is a note, no state that readings are decided by: written without the machine's lock. Whatever of it does not fit any
    more (another baseline, other rules, a reading excluded since) is computed again from the readings.
    """

    __tablename__ = "watching"
    __table_args__ = (
        ForeignKeyConstraint(["machine_id", "characteristic_id"], ["characteristic.machine_id", "characteristic.id"]),
        {"postgresql_with": {"fillfactor": 70}},
    )

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    characteristic_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    baseline_version: Mapped[int] = mapped_column(server_default="0")
    rules_version: Mapped[int] = mapped_column(server_default="0")
    begun: Mapped[int] = mapped_column(
        BigInteger, server_default="0"
    )  # the last reading before the baseline was in force
    looked: Mapped[int] = mapped_column(BigInteger, server_default="0")  # the newest reading that was looked at
    pointed: Mapped[int] = mapped_column(BigInteger, server_default="0")  # the last reading of the last point
    excluded: Mapped[int] = mapped_column(server_default="0")  # how many of those looked at were taken out
    memory: Mapped[dict[str, Any]] = mapped_column(server_default="{}")
    at: Mapped[datetime] = mapped_column(server_default=func.now())


class Signal(Base):
    """One signal of one rule: a run of points, kept for good; while the run goes on, its end moves.

    side: 1 above or rising, -1 below or falling, 0 where the rule knows no side. Withdrawn: it is none any more, because
    readings of it were taken out of the statistics.
    """

    __tablename__ = "signal"
    __table_args__ = (
        ForeignKeyConstraint(["machine_id", "characteristic_id"], ["characteristic.machine_id", "characteristic.id"]),
        CheckConstraint("side IN (-1, 0, 1) AND first_sequence <= last_sequence AND points > 0", name="run"),
        Index("signal_id_key", "id", unique=True),
        Index(
            "signal_run_key",
            "machine_id",
            "characteristic_id",
            "baseline_version",
            "chart",
            "rule",
            "side",
            "first_sequence",
            unique=True,
        ),
        Index(
            "signal_open_idx",
            "machine_id",
            "characteristic_id",
            "id",
            postgresql_where=text("explained_at IS NULL AND withdrawn_at IS NULL"),
        ),
    )

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    id: Mapped[int] = mapped_column(
        BigInteger, primary_key=True, server_default=text("nextval('signal_id')"), autoincrement=False
    )
    characteristic_id: Mapped[int]
    chart: Mapped[str]  # app.core.spc.shewhart.Chart
    rule: Mapped[str]  # app.core.spc.rules.RuleName
    side: Mapped[int]
    first_sequence: Mapped[int] = mapped_column(BigInteger)
    last_sequence: Mapped[int] = mapped_column(BigInteger)
    points: Mapped[int]
    baseline_version: Mapped[int]
    rules_version: Mapped[int]
    at: Mapped[datetime] = mapped_column(server_default=func.now())
    last_at: Mapped[datetime] = mapped_column(server_default=func.now())  # when its run was last seen to go on
    alarm: Mapped[int | None] = mapped_column(BigInteger)
    excluded: Mapped[int] = mapped_column(server_default="0")  # readings of the run that were taken out since
    withdrawn_at: Mapped[datetime | None]
    explained_at: Mapped[datetime | None]
    explained_by: Mapped[str | None]
    cause: Mapped[str | None]
    comment: Mapped[str | None]
