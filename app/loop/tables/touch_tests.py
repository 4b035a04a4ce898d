"""Touch tests of tool locations that people guide at the page."""

from datetime import datetime

from sqlalchemy import BigInteger, ForeignKey, Index, Sequence, func, text
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base

TOUCH_TEST_NUMBERS = Sequence("touch_test_id", metadata=Base.metadata)


class TouchTest(Base):
    """A touch test: one is open per machine at most. Triggers keep what was asked, and one that is over as it is.

    The bridge says what it has read, in mm of Inband and as the control's screen shows it; people answer.
    """

    __tablename__ = "touch_test"
    __table_args__ = (
        Index("touch_test_id_key", "id"),
        Index("touch_test_open_key", "machine_id", unique=True, postgresql_where=text("ended_at IS NULL")),
    )

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    id: Mapped[int] = mapped_column(
        BigInteger, primary_key=True, server_default=text("nextval('touch_test_id')"), autoincrement=False
    )
    tool_memory: Mapped[int]
    amount: Mapped[float]  # mm
    asked_at: Mapped[datetime] = mapped_column(server_default=func.now())
    asked_by: Mapped[str]
    state: Mapped[str]
    state_at: Mapped[datetime] = mapped_column(server_default=func.now())
    answered_by: Mapped[str | None]  # last
    refused: Mapped[str | None]  # the question that was answered with no
    mapping: Mapped[str | None]
    place: Mapped[str | None]  # the register at the control, in words
    unit: Mapped[str | None]
    before: Mapped[float | None]  # mm
    shown_before: Mapped[float | None]  # as the control's screen shows it
    shown_after: Mapped[float | None]
    detail: Mapped[str | None]
    ended_at: Mapped[datetime | None]
