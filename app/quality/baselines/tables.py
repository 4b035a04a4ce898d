"""Baselines: what the readings of a characteristic are judged by from one moment on. Lengths in mm."""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, CheckConstraint, ForeignKeyConstraint, Index, func, text
from sqlalchemy.orm import Mapped, mapped_column

from app.core.spc.shewhart import ENOUGH_READINGS
from app.core.spc.spread import Estimator
from app.db.base import Base


class Baseline(Base):
    """Centre and sigma as they were frozen, from which readings, by whom and why. Its numbers are never altered.

    chart: individuals, xbar_r or xbar_s. quantity: `app.core.spc.quantity.Quantity`. The newest version is in force, unless
    it is retired: then none is. What older versions said stays to be seen.
    """

    __tablename__ = "baseline"
    __table_args__ = (
        ForeignKeyConstraint(["machine_id", "characteristic_id"], ["characteristic.machine_id", "characteristic.id"]),
        CheckConstraint("chart IN ('individuals', 'xbar_r', 'xbar_s')", name="chart"),
        CheckConstraint(
            "quantity IN ('deviation', 'without_corrections', 'differences', 'wear_residuals')", name="quantity"
        ),
        CheckConstraint("sigma > 0 AND first_sequence <= last_sequence", name="numbers"),
        Index(
            "baseline_key_key",
            "machine_id",
            "characteristic_id",
            "key",
            unique=True,
            postgresql_where=text("key IS NOT NULL"),
        ),
    )

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    characteristic_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    version: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)  # counts per characteristic
    key: Mapped[str | None]  # sent with it: the same key again freezes nothing new
    chart: Mapped[str]
    quantity: Mapped[str]
    grouping: Mapped[str | None]  # consecutive, pause, part, shift or nest; None for individuals
    group_size: Mapped[int | None]  # consecutive: readings in a subgroup
    group_pause: Mapped[float | None]  # pause: minutes without a reading that end a subgroup
    shifts: Mapped[str | None]  # shift: `06:00,14:00,22:00 Europe/Berlin`; None in old ones: the plant's of today
    ewma_lambda: Mapped[float]
    ewma_width: Mapped[float]  # L
    ewma_exact: Mapped[bool]
    cusum_k: Mapped[float]
    cusum_h: Mapped[float]
    cusum_headstart: Mapped[float]  # these three in sigma
    average_span: Mapped[int]  # readings in a moving average
    first_sequence: Mapped[int] = mapped_column(BigInteger)
    last_sequence: Mapped[int] = mapped_column(BigInteger)
    excluded: Mapped[list[Any]]  # [{"first", "last", "reason"}], sequences within the period
    centre: Mapped[float]
    sigma: Mapped[float]  # of a single value of the quantity
    estimator: Mapped[str]  # app.core.spc.spread.Estimator
    freedom: Mapped[float]  # degrees of freedom of sigma; infinite where it was given
    readings: Mapped[int]  # that sigma was made of
    groups: Mapped[int]  # ranges or subgroups that sigma was made of
    factor: Mapped[float]  # mm of offset per mm of size error: what corrections were taken out with
    slope: Mapped[float | None]  # wear per reading, mm; for wear_residuals
    slope_error: Mapped[float | None]
    settle: Mapped[int | None]  # first readings of an edge that set its level
    signals: Mapped[int]  # points of its own period beyond its limits
    normal_p: Mapped[float | None]  # Anderson-Darling, of its own period
    repeats: Mapped[int | None]  # the version whose numbers these are, where an old one was put in force again
    parameters_version: Mapped[int]
    at: Mapped[datetime] = mapped_column(server_default=func.now())
    actor: Mapped[str]
    reason: Mapped[str]
    retired_at: Mapped[datetime | None]
    retired_by: Mapped[str | None]
    retired_why: Mapped[str | None]

    @property
    def pooled(self) -> bool:
        """Tell if sigma was made of the pooled variance inside the subgroups."""
        return self.estimator == Estimator.POOLED

    @property
    def given(self) -> bool:
        """Tell if its limits were given by the customer, not estimated."""
        return self.estimator == Estimator.GIVEN

    @property
    def provisional(self) -> bool:
        """Tell if it was estimated from too few readings for firm limits."""
        return not self.given and self.readings < ENOUGH_READINGS
