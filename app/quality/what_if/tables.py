"""Changes of parameters that a person proposes, with the evidence, and what became of them."""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, CheckConstraint, ForeignKeyConstraint, Identity, Index, func, text
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base


class ParameterProposal(Base):
    """A change that waits for an engineer. It is no state that readings are decided by.

    changes: parameters by name; evidence: the figures side by side as they were shown. `open` while the parameters are still
    those of `from_version`: an open one of an older version is outdated, which nobody has to write down.
    """

    __tablename__ = "parameter_proposal"
    __table_args__ = (
        ForeignKeyConstraint(["machine_id", "characteristic_id"], ["characteristic.machine_id", "characteristic.id"]),
        CheckConstraint("status IN ('open', 'approved', 'rejected', 'withdrawn')", name="status"),
        Index("parameter_proposal_characteristic_idx", "machine_id", "characteristic_id", "id"),
        Index("parameter_proposal_open_idx", "id", postgresql_where=text("status = 'open'")),
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True)
    machine_id: Mapped[int]
    characteristic_id: Mapped[int]
    from_version: Mapped[int]
    changes: Mapped[dict[str, Any]]
    evidence: Mapped[dict[str, Any]]
    reason: Mapped[str]
    proposed_at: Mapped[datetime] = mapped_column(server_default=func.now())
    proposed_by: Mapped[str]
    status: Mapped[str] = mapped_column(server_default="open")
    decided_at: Mapped[datetime | None]
    decided_by: Mapped[str | None]
    decided_why: Mapped[str | None]
    made_version: Mapped[int | None]  # the version that approving it made
