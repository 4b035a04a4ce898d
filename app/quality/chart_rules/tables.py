"""Rules that watch the charts of a characteristic."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKeyConstraint, func
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base


class RuleSet(Base):
    """Rules that watch a characteristic; the newest version counts. Without any, `places.DEFAULT`.

    rules: {chart: {rule: {"do": "watch" | "alarm", "since", "back"}}}, see `places.Place` and `places.Setting`.
    """

    __tablename__ = "rule_set"
    __table_args__ = (
        ForeignKeyConstraint(["machine_id", "characteristic_id"], ["characteristic.machine_id", "characteristic.id"]),
    )

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    characteristic_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    version: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)  # counts per characteristic
    rules: Mapped[dict[str, Any]]
    at: Mapped[datetime] = mapped_column(server_default=func.now())
    actor: Mapped[str]
    reason: Mapped[str]
