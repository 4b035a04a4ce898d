"""Times in which a machine, or the plant, is under maintenance."""

from datetime import datetime

from sqlalchemy import BigInteger, CheckConstraint, ForeignKey, Index, Sequence, func, text
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base

MAINTENANCE_NUMBERS = Sequence("maintenance_id", metadata=Base.metadata)


class Maintenance(Base):
    """Maintenance of a machine; without one, of all machines. It is over at `ends`, or earlier if it is ended by hand.

    A trigger keeps it as it was entered, but for its end, which may be moved; and once it is ended, all of it.
    """

    __tablename__ = "maintenance"
    __table_args__ = (
        CheckConstraint("ends > begins", name="ends"),
        Index("maintenance_ends_idx", text("COALESCE(ended_at, ends)")),
    )

    id: Mapped[int] = mapped_column(BigInteger, primary_key=True, server_default=text("nextval('maintenance_id')"))
    machine_id: Mapped[int | None] = mapped_column(ForeignKey("machine.id"))
    begins: Mapped[datetime]
    ends: Mapped[datetime]
    reason: Mapped[str]
    stopping_anyway: Mapped[bool]  # notifications of alarms that stop a machine are sent all the same
    entered_at: Mapped[datetime] = mapped_column(server_default=func.now())
    entered_by: Mapped[str]
    ended_at: Mapped[datetime | None]
    ended_by: Mapped[str | None]

    @property
    def over_at(self) -> datetime:
        """The moment from which on it is over."""
        return self.ends if self.ended_at is None else self.ended_at
