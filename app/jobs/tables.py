"""Last run of each periodic job, and the units of work that fail."""

from datetime import datetime

from sqlalchemy import ForeignKeyConstraint, Index, func
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base


class JobRun(Base):
    """The last run of a periodic job. seconds: how long it took. units: of work done in it."""

    __tablename__ = "job_run"
    __table_args__ = ({"postgresql_with": {"fillfactor": 50}},)

    job: Mapped[str] = mapped_column(primary_key=True)
    finished_at: Mapped[datetime]
    seconds: Mapped[float]
    units: Mapped[int]


class JobFailure(Base):
    """A unit of work that fails: since when, how often in a row, why, and when it is tried again.

    subject: what it concerns, such as `characteristic/shaft-d40`; empty where a job could not even list what is due.
    """

    __tablename__ = "job_failure"
    __table_args__ = (
        ForeignKeyConstraint(["machine_id", "characteristic_id"], ["characteristic.machine_id", "characteristic.id"]),
        Index("job_failure_characteristic_idx", "machine_id", "characteristic_id"),
    )

    job: Mapped[str] = mapped_column(primary_key=True)
    subject: Mapped[str] = mapped_column(primary_key=True)
    machine_id: Mapped[int | None]
    characteristic_id: Mapped[int | None]
    failures: Mapped[int] = mapped_column(server_default="1")
    error: Mapped[str]
    first_at: Mapped[datetime] = mapped_column(server_default=func.now())
    last_at: Mapped[datetime] = mapped_column(server_default=func.now())
    retry_at: Mapped[datetime]
