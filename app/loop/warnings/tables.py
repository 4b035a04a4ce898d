"""Acknowledgements of warnings."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, func
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base


class WarningAcknowledgement(Base):
    """A person has looked at the warnings of a result and takes it as it is. Append-only.

    subject: the result, named as the record of changes names it (`alignment/7`). codes: the warnings that were seen.
    """

    __tablename__ = "warning_acknowledgement"

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    subject: Mapped[str] = mapped_column(primary_key=True)
    at: Mapped[datetime] = mapped_column(server_default=func.now())
    actor: Mapped[str]
    reason: Mapped[str]
    codes: Mapped[list[Any]]
