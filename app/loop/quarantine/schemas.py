"""Affected parts and quarantines as JSON. Lengths in mm."""

from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Literal, Self

from pydantic import BaseModel, Field

from app.loop.quarantine.history import Doubt, Known
from app.loop.quarantine.queries import Affected, Between, Found, Listed, PartRow, QuarantineRow
from app.web.fields import IN_UM, LARGEST_ID, Body, Length, Reason, answer_from

Status = Literal["open", "released", "scrapped"]
Guard = Annotated[
    float,
    IN_UM,
    Field(
        strict=True,
        ge=0,
        le=1,
        description="Expanded measuring uncertainty, mm: a part is certainly good only if it clears each limit by at least this much.",
    ),
]
ByHandOnly = Annotated[
    bool,
    Field(
        description="The probe was wrong before the alarm already: only a measurement by hand shows that a part is good, and the list "
        "no longer stops at a tool change."
    ),
]
_FOUND = (
    "`bad`: measured out of tolerance; `unknown`: its reading says nothing (excluded, probe fault, implausible); `not_measured`: no "
    "reading, known by its name; `good`: by its reading, which is not believed."
)


class EndOut(BaseModel):
    """A part that is certainly good: the list begins behind it, or ends before it."""

    sequence: Annotated[int, Field(description="The reading.")]
    part: Annotated[str | None, Field(description="Its name; null: it came without one.")]
    cut_at: Annotated[datetime, Field(description="When it was cut, or measured where that is not known.")]

    @classmethod
    def of(cls, known: Known | None) -> Self | None:
        """An end that is there."""
        return None if known is None else answer_from(cls, known)


class AffectedPartOut(BaseModel):
    """An affected part, or a row of several that were not measured."""

    sequence: Annotated[int | None, Field(description="Its reading; null: not measured.")]
    part: Annotated[str | None, Field(description="Its name; null: it came without one.")]
    part_to: Annotated[str | None, Field(description="The last name of a row of many parts.")]
    parts: Annotated[int, Field(description="Number of parts in this row.")]
    order: Annotated[str | None, Field(description="The order, from the context of its reading.")]
    found: Annotated[Found, Field(description=_FOUND)]
    cut_at: Annotated[datetime | None, Field(description="When it was cut, or measured where that is not known.")]
    tool_memory: Annotated[int | None, Field(description="R10 of the tool that cut it.")]
    offset: Annotated[float | None, Field(description="The offset that it was cut with, mm; null: nobody knows.")]
    cut_without: Annotated[list[int], Field(description="Corrections issued before, that came too late for it.")]
    deviation: Annotated[float | None, Field(description="From the target, mm.")]
    measured: Annotated[float | None, Field(description="The size that the probe has found, mm.")]
    again: Annotated[int | None, Field(description="A later reading with the same part name: measured again, perhaps.")]

    @classmethod
    def of(cls, row: Listed) -> Self:
        """A row of the list."""
        known = row.known
        return cls(
            sequence=row.sequence,
            part=row.part,
            part_to=row.part_to,
            parts=row.many,
            order=row.order,
            found=row.found,  # type: ignore[arg-type]
            cut_at=known.cut_at if known else None,
            tool_memory=known.tool if known else None,
            offset=row.offset,
            cut_without=list(known.without) if known else [],
            deviation=known.deviation if known else None,
            measured=known.measured if known else None,
            again=row.again,
        )


class StretchOut(BaseModel):
    """Affected parts between two that are certainly good."""

    characteristic: str
    since: Annotated[EndOut | None, Field(description="The last part certainly good; null: none with this edge.")]
    until: Annotated[EndOut | None, Field(description="The first one after it; null: none yet.")]
    open: Annotated[bool, Field(description="The edge goes on cutting, and no good part has ended the list yet.")]
    unnumbered: Annotated[bool, Field(description="Parts may have been cut between that no name tells of.")]
    cut_short: Annotated[bool, Field(description="More than 5000 readings: those before were not looked at.")]
    parts: Annotated[list[AffectedPartOut], Field(description="In the order of cutting.")]

    @classmethod
    def of(cls, between: Between) -> Self:
        """A stretch of the list."""
        return cls(
            characteristic=between.characteristic.key,
            since=EndOut.of(between.since),
            until=EndOut.of(between.until),
            open=between.open,
            unnumbered=between.unnumbered,
            cut_short=between.cut_short,
            parts=[AffectedPartOut.of(row) for row in between.rows],
        )


class AffectedOut(BaseModel):
    """The parts that an alarm concerns, as far as it is known now."""

    alarm: Annotated[int, Field(description="Number of the alarm.")]
    kind: Annotated[str, Field(description="Kind of the alarm.")]
    machine: str
    count: Annotated[int, Field(description="Number of parts.")]
    quarantine: Annotated[
        int | None, Field(description="The quarantine of this alarm; null: nobody has set them aside.")
    ]
    stretches: Annotated[list[StretchOut], Field(description="Runs of affected parts, edge by edge.")]

    @classmethod
    def of(cls, found: Affected, quarantine: int | None) -> Self:
        """The list as it is answered."""
        alarm = found.alarm.alarm
        return cls(
            alarm=alarm.id,
            kind=alarm.kind,
            machine=found.alarm.machine.key,
            count=found.parts,
            quarantine=quarantine,
            stretches=[StretchOut.of(each) for each in found.between],
        )


class DoubtIn(Body):
    """The doubt about parts."""

    guard: Guard = 0.0
    by_hand_only: ByHandOnly = False

    @property
    def doubt(self) -> Doubt:
        """As the queries take it."""
        return Doubt(self.guard, self.by_hand_only)


class SetAsideIn(DoubtIn):
    """The affected parts of an alarm are set aside."""

    alarm: Annotated[int, Field(strict=True, ge=1, le=LARGEST_ID, description="Number of the alarm.")]
    reason: Reason


class MeasuredAgainIn(Body):
    """A part set aside was measured again."""

    measured: Annotated[Length, Field(description="The size that was found, mm: it releases the part, or scraps it.")]
    reason: Reason


class QuarantinedPartOut(BaseModel):
    """A part that is set aside, released or scrapped."""

    number: Annotated[int, Field(description="Counts in its quarantine: 1, 2, 3 …")]
    characteristic: str
    sequence: Annotated[int | None, Field(description="Its reading; null: not measured.")]
    part: Annotated[str | None, Field(description="Its name; null: it came without one.")]
    part_to: Annotated[str | None, Field(description="The last name of a row of many parts.")]
    order: Annotated[str | None, Field(description="The order, from the context of its reading.")]
    cut_at: Annotated[datetime | None, Field(description="When it was cut, or measured where that is not known.")]
    tool_memory: Annotated[int | None, Field(description="R10 of the tool that cut it.")]
    offset: Annotated[float | None, Field(description="The offset that it was cut with, mm; null: nobody knows.")]
    cut_without: Annotated[list[int], Field(description="Corrections issued before, that came too late for it.")]
    deviation: Annotated[float | None, Field(description="From the target, mm.")]
    measured: Annotated[float | None, Field(description="The size that the probe has found, mm.")]
    found: Annotated[Found, Field(description=_FOUND)]
    status: Annotated[Status, Field(description="`open`: set aside; `released` or `scrapped`: decided.")]
    decided_at: Annotated[datetime | None, Field(description="When that was decided.")]
    decided_by: Annotated[str | None, Field(description="Who decided it.")]
    reason: Annotated[str | None, Field(description="Why.")]
    remeasured: Annotated[
        float | None, Field(description="The size by which it was decided, mm; null: by a person's word.")
    ]

    @classmethod
    def of(cls, row: PartRow) -> Self:
        """A row of the table."""
        return answer_from(cls, row.part, characteristic=row.characteristic.key)


class QuarantineOut(BaseModel):
    """The parts of an alarm that are set aside."""

    id: int
    machine: str
    alarm: Annotated[int, Field(description="Number of the alarm.")]
    kind: Annotated[str, Field(description="Kind of the alarm.")]
    state: Annotated[Literal["open", "closed"], Field(description="open: at least one part waits for a decision.")]
    open: Annotated[int, Field(description="Rows that wait for a decision.")]
    released: Annotated[int, Field(description="Rows that were released.")]
    scrapped: Annotated[int, Field(description="Rows that were scrapped.")]
    made_at: Annotated[datetime, Field(description="When the parts were set aside.")]
    made_by: Annotated[str, Field(description="Who set them aside.")]
    reason: Annotated[str, Field(description="Why.")]
    guard: Annotated[float, Field(description="Measuring uncertainty by which the tolerance was narrowed, mm.")]
    by_hand_only: Annotated[bool, Field(description="No reading of the probe was believed.")]

    @classmethod
    def of(cls, row: QuarantineRow) -> Self:
        """A row of the table."""
        made = row.quarantine
        return answer_from(
            cls,
            made,
            machine=row.machine.key,
            alarm=made.alarm_id,
            kind=row.kind,
            state=row.state,
            open=row.open,
            released=row.released,
            scrapped=row.scrapped,
        )


class QuarantineWithParts(QuarantineOut):
    """A quarantine with all its parts."""

    parts: Annotated[list[QuarantinedPartOut], Field(description="In the order of their numbers.")]

    @classmethod
    def with_parts(cls, row: QuarantineRow, parts: Sequence[PartRow]) -> Self:
        """A quarantine as it is answered."""
        return cls(**QuarantineOut.of(row).model_dump(), parts=[QuarantinedPartOut.of(part) for part in parts])
