"""The append-only record of changes; a trigger refuses UPDATE, DELETE and TRUNCATE."""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, Identity, Index, func, text
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base


class AuditEntry(Base):
    """One change: who, what (`action` on `subject`), before, after, the reason given, and the station where it was done.

    ``actor`` is the name as it was; ``person_id`` and ``key_id`` say whose it is. Neither of them: the system, the command
    line, or an entry older than the numbers. (They are no foreign keys: a record outlives whatever it tells of.)
    """

    __tablename__ = "audit_entry"
    __table_args__ = (
        Index("audit_entry_subject_idx", "subject", "id"),
        Index("audit_entry_device_idx", "device_id", "id", postgresql_where=text("device_id IS NOT NULL")),
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True)
    at: Mapped[datetime] = mapped_column(server_default=func.now())
    actor: Mapped[str]
    person_id: Mapped[int | None]
    key_id: Mapped[int | None]
    action: Mapped[str]
    subject: Mapped[str]
    before: Mapped[dict[str, Any] | None]
    after: Mapped[dict[str, Any] | None]
    why: Mapped[str | None]
    device_id: Mapped[int | None]
