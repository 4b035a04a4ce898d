"""The memories of each machine and the life of every correction. Lengths in mm."""

from datetime import datetime

from sqlalchemy import BigInteger, CheckConstraint, ForeignKey, Identity, Index, func, text
from sqlalchemy.orm import Mapped, mapped_column

from app.core.parameters import MOST_LOCATIONS
from app.db.base import Base

OUTSTANDING = ("awaiting_approval", "pending")  # issued, not yet in effect
OPEN = ("held", *OUTSTANDING)
OPPOSITE = "opposite_effect"  # the alarm of corrections that did the opposite of what they asked
STRONG = "strong_effect"  # that of corrections that act too strongly and drive parts out of tolerance
STILL_OUT = "still_out"  # that of parts that stay out of tolerance in spite of corrections
EARLY = "early_effect"  # that of corrections that act before they are counted
UNTAKEN = "corrections_not_taken"  # that of corrections that the machine does not take
DOUBT = "correction_in_doubt"  # that of a reading whose correction_in_effect does not fit
ASKED_AGAIN = 90  # days after the answer to such a doubt: a clock that was set may be set back in autumn
OPPOSED = "opposite effect, alarm:"  # why corrections fell, as it is stored; the number of the alarm goes with it
OVERSHOT = "strong effect, alarm:"
COUNTED_LATE = "early effect, alarm:"
NO_HELP = "still out, alarm:"
FELL = {OPPOSITE: OPPOSED, STRONG: OVERSHOT, EARLY: COUNTED_LATE, STILL_OUT: NO_HELP}


class Tool(Base):
    """One location of the tool memory (R10): the offset that the control is known to hold."""

    __tablename__ = "tool"
    __table_args__ = (
        CheckConstraint("number BETWEEN 1 AND 32", name="number"),
        CheckConstraint("sister BETWEEN 1 AND 32 AND sister <> number", name="sister"),
    )

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    offset: Mapped[float] = mapped_column(server_default="0")
    total: Mapped[float] = mapped_column(server_default="0")  # applied corrections since the tool was changed
    changed_at: Mapped[datetime | None]  # tool changed
    reset_at: Mapped[datetime | None]  # tool changed or offset edited by hand: parts cut before say nothing
    paused_by: Mapped[int | None] = mapped_column(
        BigInteger
    )  # the alarm that must be answered before anything is corrected
    parts_kept: Mapped[int] = mapped_column(server_default="0")  # cut by characteristics that have left this tool
    edge: Mapped[str | None]  # D number, or what the cutting edge is called
    name: Mapped[str | None]
    kind: Mapped[str | None]
    planned_parts: Mapped[int | None]
    planned_total: Mapped[float | None]  # wear life: the sum of corrections at which the edge is spent
    sister: Mapped[int | None]  # R10 of the tool that goes on when this one is worn
    life_alarm_raised: Mapped[bool] = mapped_column("life_told", server_default="false")


class ToolEvent(Base):
    """A step of an offset: tool change, manual edit, correction applied. The history chart is drawn from it."""

    __tablename__ = "tool_event"
    __table_args__ = (
        CheckConstraint("kind IN ('change', 'edit', 'correction')", name="kind"),
        Index("tool_event_tool_idx", "machine_id", "number", "id"),
        Index("tool_event_change_idx", "machine_id", "number", "id", postgresql_where=text("kind <> 'correction'")),
    )

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True)
    number: Mapped[int]
    at: Mapped[datetime] = mapped_column(server_default=func.now())
    kind: Mapped[str]
    offset_before: Mapped[float]
    offset_after: Mapped[float]
    correction: Mapped[int | None]
    parts: Mapped[int | None]  # parts cut with the tool that went out, for a change
    total: Mapped[float | None]  # the sum of its corrections
    edge: Mapped[str | None]  # what it was called
    name: Mapped[str | None]
    actor: Mapped[str]
    reason: Mapped[str | None]


class AverageMemory(Base):
    """One location of the average memory (R11): running average M and empirical value."""

    __tablename__ = "average_memory"
    __table_args__ = (
        CheckConstraint(f"location BETWEEN 1 AND {MOST_LOCATIONS}", name="location"),
        {"postgresql_with": {"fillfactor": 50}},
    )

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    location: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    average: Mapped[float] = mapped_column(server_default="0")
    empirical_value: Mapped[float] = mapped_column(server_default="0")
    updated_at: Mapped[datetime | None]


class Correction(Base):
    """A change of a tool offset, from the reading that asked for it to the machine that made it."""

    __tablename__ = "correction"
    __table_args__ = (
        CheckConstraint(
            "status IN ('held', 'awaiting_approval', 'pending', 'applied', 'rejected', 'superseded')", name="status"
        ),
        Index("correction_tool_idx", "machine_id", "tool_memory", "number"),
        Index(
            "correction_open_idx",
            "machine_id",
            "tool_memory",
            postgresql_where=text("status IN ('held', 'awaiting_approval', 'pending')"),
        ),
        Index(
            "correction_applied_idx",
            "machine_id",
            "tool_memory",
            "applied_at",
            postgresql_where=text("status = 'applied'"),
        ),
        Index("correction_reading_idx", "machine_id", "characteristic_id", "sequence"),
    )

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    characteristic_id: Mapped[int]
    sequence: Mapped[int] = mapped_column(BigInteger)
    tool_memory: Mapped[int]
    size_error: Mapped[float]
    amount: Mapped[float]
    status: Mapped[str]
    created_at: Mapped[datetime] = mapped_column(server_default=func.now())
    decided_at: Mapped[datetime | None]  # released, approved, rejected or superseded
    decided_by: Mapped[str | None]
    reason: Mapped[str | None]
    superseded_by: Mapped[int | None]
    applied_at: Mapped[datetime | None]
    applied_by: Mapped[str | None]
    offset_after: Mapped[float | None]
    fetched_at: Mapped[datetime | None]  # as program text, which may be run at any time from then on
    fetched_by: Mapped[str | None]
    fetched_as: Mapped[str | None]  # the form of the text and its check sum
    mapping: Mapped[str | None]  # hash of the mapping by which a bridge converted it for the control
