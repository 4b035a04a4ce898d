"""Alignments with their touches. Lengths in mm, angles in degrees."""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, CheckConstraint, ForeignKey, Index, Sequence, func, text
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base

ALIGNMENT_NUMBERS = Sequence("alignment_id", metadata=Base.metadata)


class Alignment(Base):
    """Position of a part or pallet. Append-only: a trigger refuses to change it; computing it again makes another.

    Of the kind `pallet`: the alignment `pallet_id` of the pallet composed with `part_id`, that of the part on it.
    """

    __tablename__ = "alignment"
    __table_args__ = (
        CheckConstraint("kind IN ('two_points', 'two_holes', 'points', 'pallet')", name="kind"),
        Index("alignment_id_key", "id"),
        Index("alignment_key_key", "machine_id", "key", unique=True, postgresql_where=text("key IS NOT NULL")),
    )

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    id: Mapped[int] = mapped_column(
        BigInteger, primary_key=True, server_default=text("nextval('alignment_id')"), autoincrement=False
    )
    kind: Mapped[str]
    method: Mapped[str]
    name: Mapped[str | None]
    part: Mapped[str | None]
    aligned_at: Mapped[datetime]
    received_at: Mapped[datetime] = mapped_column(server_default=func.now())
    actor: Mapped[str]
    key: Mapped[str | None]
    given: Mapped[dict[str, Any]]
    result: Mapped[dict[str, Any]]
    pallet_id: Mapped[int | None] = mapped_column(BigInteger)
    part_id: Mapped[int | None] = mapped_column(BigInteger)
    recomputed_from: Mapped[int | None] = mapped_column(BigInteger)
