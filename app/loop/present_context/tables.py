"""The present context of machines, one a machine at most."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKeyConstraint
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base


class PresentContext(Base):
    """The work of a machine since then, as a reading's context has it. filled: readings that came before it have it by now."""

    __tablename__ = "present_context"
    __table_args__ = (ForeignKeyConstraint(["machine_id"], ["machine.id"]),)

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    context: Mapped[dict[str, Any]]
    since: Mapped[datetime]
    filled: Mapped[datetime]
    changed_by: Mapped[str]
