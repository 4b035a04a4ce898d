"""Notes that people write at a machine or at one of its characteristics."""

from datetime import datetime

from sqlalchemy import BigInteger, ForeignKey, ForeignKeyConstraint, Index, Sequence, func, text
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base

NOTE_NUMBERS = Sequence("note_id", metadata=Base.metadata)


class Note(Base):
    """Words of a person at a moment. A trigger keeps them as they were written; withdrawn, they leave every chart and list.

    Of the whole machine where no characteristic is named. ``key`` is what it was sent with, so that it is not kept twice.
    """

    __tablename__ = "note"
    __table_args__ = (
        ForeignKeyConstraint(["machine_id", "characteristic_id"], ["characteristic.machine_id", "characteristic.id"]),
        Index("note_id_key", "id"),
        Index("note_at_idx", "machine_id", "at"),
        Index("note_key_key", "machine_id", "key", unique=True, postgresql_where=text("key IS NOT NULL")),
    )

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    id: Mapped[int] = mapped_column(
        BigInteger, primary_key=True, server_default=text("nextval('note_id')"), autoincrement=False
    )
    characteristic_id: Mapped[int | None]
    sequence: Mapped[int | None] = mapped_column(BigInteger)  # the reading that it is about
    at: Mapped[datetime]
    text: Mapped[str]
    key: Mapped[str | None]
    written_at: Mapped[datetime] = mapped_column(server_default=func.now())
    written_by: Mapped[str]
    person_id: Mapped[int | None]  # whose name that is, or the number of their key
    key_id: Mapped[int | None]
    withdrawn_at: Mapped[datetime | None]
    withdrawn_by: Mapped[str | None]
    withdrawn_why: Mapped[str | None]
