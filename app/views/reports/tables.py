"""Reports that were asked for many at once: the request, what is made of it so far, and the file."""

from datetime import datetime
from typing import Any

from sqlalchemy import CheckConstraint, ForeignKey, Identity, Index, func, text
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base

OPEN = ("queued", "running")


class ReportJob(Base):
    """Reports of many characteristics. `taken_by` changes with every process that takes it up; only that one writes to it."""

    __tablename__ = "report_job"
    __table_args__ = (
        CheckConstraint("state IN ('queued', 'running', 'done', 'failed', 'cancelled')", name="state"),
        Index("report_job_open_idx", "id", postgresql_where=text("state IN ('queued', 'running')")),
        Index("report_job_finished_idx", "finished_at", postgresql_where=text("finished_at IS NOT NULL")),
    )

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True)
    asked_by: Mapped[str]
    person_id: Mapped[int | None]  # whose name that is; neither: asked for before these numbers were kept
    key_id: Mapped[int | None]
    asked_at: Mapped[datetime] = mapped_column(server_default=func.now())
    request: Mapped[dict[str, Any]]
    state: Mapped[str] = mapped_column(server_default="queued")
    done: Mapped[int] = mapped_column(server_default="0")
    total: Mapped[int]
    problems: Mapped[int] = mapped_column(server_default="0")  # characteristics without a report
    current: Mapped[str | None]  # the characteristic that is worked on
    taken_by: Mapped[str | None]
    started_at: Mapped[datetime | None]
    finished_at: Mapped[datetime | None]
    finished_by: Mapped[str | None]  # who cancelled it
    trouble: Mapped[str | None]  # why it failed
    file_name: Mapped[str | None]
    size: Mapped[int | None]


class ReportPart(Base):
    """Finished report of one characteristic, so that another process goes on where one was killed; `trouble`: why there is none."""

    __tablename__ = "report_part"

    job_id: Mapped[int] = mapped_column(ForeignKey("report_job.id", ondelete="CASCADE"), primary_key=True)
    place: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    characteristic: Mapped[str]
    content: Mapped[bytes | None]
    trouble: Mapped[str | None]


class ReportFile(Base):
    """The whole file of a job that is done."""

    __tablename__ = "report_file"

    job_id: Mapped[int] = mapped_column(ForeignKey("report_job.id", ondelete="CASCADE"), primary_key=True)
    content: Mapped[bytes]
