"""Reaction plans, and the causes and corrective actions of the plant that are chosen when an alarm is acknowledged.

A plan is never overwritten: each change is a version, and an alarm names the one that it was handled with.
"""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, CheckConstraint, Index, LargeBinary, Sequence, func, text
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base

PLAN_NUMBERS = Sequence("reaction_plan_id", metadata=Base.metadata)
ENTRY_NUMBERS = Sequence("catalogue_entry_id", metadata=Base.metadata)


class ReactionPlan(Base):
    """One version of a plan; the last one counts. characteristic, kind, rule: the alarms that it is for, None any."""

    __tablename__ = "reaction_plan"

    id: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    version: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    name: Mapped[str]
    characteristic: Mapped[str | None]  # its key, which is for ever
    kind: Mapped[str | None]
    rule: Mapped[str | None]
    steps: Mapped[list[Any]]  # as `app.loop.reactions.schemas.ReactionStep`
    cause_needed: Mapped[bool]
    action_needed: Mapped[bool]
    receivers: Mapped[list[Any]]  # numbers of receivers of notifications
    ended: Mapped[bool]  # with this version the plan was withdrawn
    reason: Mapped[str]
    made_at: Mapped[datetime] = mapped_column(server_default=func.now())
    made_by: Mapped[str]


class ReactionPicture(Base):
    """A picture that steps of plans name by its `digest`, so that it is stored once, however many versions show it."""

    __tablename__ = "reaction_picture"

    digest: Mapped[str] = mapped_column(primary_key=True)
    media_type: Mapped[str]
    width: Mapped[int]
    height: Mapped[int]
    size: Mapped[int]  # bytes
    content: Mapped[bytes] = mapped_column(LargeBinary, deferred=True)
    made_at: Mapped[datetime] = mapped_column(server_default=func.now())
    made_by: Mapped[str]


class CatalogueEntry(Base):
    """A cause or a corrective action. Its name stays, because alarms name it; a retired one is not offered any more."""

    __tablename__ = "catalogue_entry"
    __table_args__ = (
        CheckConstraint("sort IN ('cause', 'action')", name="sort"),
        Index("catalogue_entry_name_key", "sort", text("lower(name)"), unique=True),
    )

    id: Mapped[int] = mapped_column(BigInteger, primary_key=True, server_default=text("nextval('catalogue_entry_id')"))
    sort: Mapped[str]
    name: Mapped[str]
    made_at: Mapped[datetime] = mapped_column(server_default=func.now())
    made_by: Mapped[str]
    retired_at: Mapped[datetime | None]
