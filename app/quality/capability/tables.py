"""The index of each characteristic as a periodic job worked it out, so that the overview need not. Lengths in mm."""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, ForeignKeyConstraint, func
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base


class CapabilityVerdict(Base):
    """The index that may be quoted of the last readings (`app.core.spc.quoting.Quoting`), and of which readings it is.

    At most two of each characteristic: the last that could be quoted, and, where the newest readings carry none, the reason.
    It is a note, no state that readings are decided by: written without the machine's lock, and made again at any time.
    """

    __tablename__ = "capability_verdict"
    __table_args__ = (
        ForeignKeyConstraint(["machine_id", "characteristic_id"], ["characteristic.machine_id", "characteristic.id"]),
        {"postgresql_with": {"fillfactor": 70}},
    )

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    characteristic_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    quotable: Mapped[bool] = mapped_column(primary_key=True)
    at: Mapped[datetime] = mapped_column(server_default=func.now())
    # The state that it was worked out at: number of the newest reading, parameters, baseline in force, excluded readings.
    newest: Mapped[int] = mapped_column(BigInteger)
    parameters_version: Mapped[int]
    baseline: Mapped[int | None]
    excluded: Mapped[int]
    rule: Mapped[int]  # `app.core.spc.quoting.RULE` by which it was judged
    half: Mapped[float]  # of the tolerance
    readings: Mapped[int]
    first: Mapped[int | None] = mapped_column(BigInteger)  # sequences
    last: Mapped[int | None] = mapped_column(BigInteger)
    first_at: Mapped[datetime | None]
    last_at: Mapped[datetime | None]
    quote: Mapped[str]
    value: Mapped[float | None]
    low: Mapped[float | None]
    high: Mapped[float | None]
    preliminary: Mapped[bool]
    why: Mapped[str | None]
    weeks: Mapped[dict[str, Any] | None]  # `app.quality.capability.weekly`; of the newest readings' row only
