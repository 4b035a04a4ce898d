"""The last outlook of each characteristic, made by a periodic job, so that the plant page need not work it out. Lengths in mm."""

from datetime import datetime

from sqlalchemy import BigInteger, ForeignKeyConstraint, func
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base


class Outlook(Base):
    """The limit that a characteristic comes to first, in how many parts, and whether its loop hunts.

    It is a note, no state that readings are decided by: written without the machine's lock, and made again at any time.
    """

    __tablename__ = "outlook"
    __table_args__ = (
        ForeignKeyConstraint(["machine_id", "characteristic_id"], ["characteristic.machine_id", "characteristic.id"]),
        {"postgresql_with": {"fillfactor": 70}},
    )

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    characteristic_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    sequence: Mapped[int] = mapped_column(BigInteger)  # the newest reading it was made of
    parameters_version: Mapped[int]
    at: Mapped[datetime] = mapped_column(server_default=func.now())
    towards: Mapped[str | None]  # wear, tolerance or offset; None where no wear is to be seen
    parts: Mapped[float | None]
    parts_low: Mapped[float | None]
    parts_high: Mapped[float | None]  # None: it cannot be determined how long at most
    hunting: Mapped[str]  # unknown, quiet, hunting or swinging
    # How the forecasts of edges before came out (`app.core.forecast.Record`); None until there was a tool change.
    record_of: Mapped[int | None] = mapped_column(
        BigInteger
    )  # the tool change that it was worked out at, by its sequence
    lives: Mapped[int | None]
    tested: Mapped[int | None]
    held: Mapped[int | None]
    widening: Mapped[float | None]
