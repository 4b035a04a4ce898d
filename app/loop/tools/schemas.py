"""Tool memory, averages and corrections as JSON. Lengths in mm."""

from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from app.core.tool_life import LifePlan, use_of
from app.core.warning import CodedWarning
from app.loop.tables.tools import Correction
from app.loop.tools import wording
from app.loop.tools.gain_queries import ToolGain
from app.loop.tools.queries import AverageRow, CorrectionRow, ToolRow
from app.loop.warnings.wording import sentence
from app.web.fields import LARGEST_SERIAL, Body, LatelyOrNow, Length, MappingHash, Reason, answer_from
from app.web.warnings import Warnings, warnings_out

DESCRIBED = ("edge", "name", "kind", "planned_parts", "planned_total", "sister")
Status = Literal["held", "awaiting_approval", "pending", "applied", "rejected", "superseded"]


class AppliedIn(Body):
    """The machine (or a person at it) says that a correction is in the offset now."""

    offset_after: Annotated[
        Length | None, Field(description="The offset that the control holds now; it is compared with the expected one.")
    ] = None
    applied_at: Annotated[LatelyOrNow | None, Field(description="When; if left out, now.")] = None
    mapping: MappingHash | None = None


class OffsetReportIn(Body):
    """The offset that the control holds, as it was read there."""

    offset: Annotated[Length, Field(description="The offset that the control holds now, mm.")]
    none_applied: Annotated[
        bool,
        Field(
            strict=True,
            description="No pending correction is in it, as the caller knows: then none of them explains another offset.",
        ),
    ] = False


class OffsetReportOut(BaseModel):
    """Answer to a reported offset."""

    machine: str
    tool_memory: Annotated[int, Field(description="R10")]
    offset: Annotated[float, Field(description="The offset that the control is known to hold now, mm.")]
    differs: Annotated[bool, Field(description="It was another one than expected: the tool is paused.")]
    explained_by: Annotated[
        list[int], Field(description="Pending corrections that lead to this offset: confirm them. Nothing was changed.")
    ]
    superseded: Annotated[list[int], Field(description="Corrections that must not be applied any more.")]
    paused_by: Annotated[int | None, Field(description="Number of the alarm that pauses the tool.")]
    note: Annotated[str | None, Field(description="What else is to be said; null: nothing.")] = None


class CorrectionDecisionIn(Body):
    """Approval, release or rejection of a correction, with a reason."""

    reason: Reason


class DecisionsIn(Body):
    """Approval of several corrections together, with a reason."""

    numbers: Annotated[
        list[Annotated[int, Field(strict=True, ge=1, le=LARGEST_SERIAL)]],
        Field(min_length=1, max_length=1000, description="Which ones; all of them, or none if one cannot be approved."),
    ]
    reason: Reason


class RejectionIn(CorrectionDecisionIn):
    """Rejection of a correction, with a reason."""

    although_fetched: Annotated[
        bool,
        Field(
            strict=True,
            description="Needed for one that was fetched as program text: its text was taken back, and was not run.",
        ),
    ] = False


class ToolEdit(Body):
    """The offset as a person has set it by hand."""

    offset: Annotated[Length, Field(description="The offset that the control holds now, mm.")]
    reason: Reason


class ToolChange(Body):
    """A new tool in this location."""

    offset: Annotated[Length, Field(description="The offset that the new tool starts with.")] = 0.0
    reason: Reason


class EmpiricalValueIn(Body):
    """The empirical value: machine reading minus true value, taken off every measurement."""

    empirical_value: Annotated[Length, Field(description="Machine reading minus true value, mm.")]
    reason: Reason


class ReadingReason(BaseModel):
    """Code and sentence of the reading that asked for the correction."""

    code: str
    text: str
    notes: Annotated[list[str], Field(description="What else was considered, as codes.")] = []


class CorrectionOut(BaseModel):
    """A change of a tool offset, on its way from the reading that asked for it to the machine that makes it."""

    machine: str
    number: Annotated[int, Field(description="Counts per machine, without gaps.")]
    tool_memory: Annotated[int, Field(description="R10")]
    amount: Annotated[float, Field(description="What the offset changes by, mm.")]
    status: Annotated[
        Status,
        Field(
            description="held, awaiting_approval: a person decides first; pending: apply it; applied; rejected, superseded: it must not be applied."
        ),
    ]
    characteristic: str
    sequence: Annotated[int, Field(description="The reading that asked for it.")]
    size_error: Annotated[float, Field(description="The error of size that it removes, mm.")]
    created_at: datetime
    offset_expected: Annotated[
        float | None,
        Field(
            description="The offset once the pending ones up to this one, and this one, are applied; open ones only."
        ),
    ]
    applied_at: Annotated[datetime | None, Field(description="When it took effect; null: not yet.")]
    applied_by: Annotated[str | None, Field(description="Who confirmed it.")]
    offset_after: Annotated[
        float | None, Field(description="The offset that the control held afterwards, mm; null: not said.")
    ]
    mapping: Annotated[str | None, Field(description="Hash of the mapping by which a bridge converted it.")]
    decided_at: Annotated[datetime | None, Field(description="When it was released, approved, rejected or superseded.")]
    decided_by: Annotated[str | None, Field(description="Who decided that.")]
    status_reason: Annotated[str | None, Field(description="What was said when that was decided.")]
    superseded_by: Annotated[
        int | None, Field(description="Number of the correction that takes its place; null: none.")
    ]
    fetched_at: Annotated[datetime | None, Field(description="When it was first fetched as program text.")]
    fetched_by: Annotated[str | None, Field(description="Who fetched it.")]
    reason: Annotated[ReadingReason | None, Field(description="The reading that asked for it: code and sentence.")]
    note: Annotated[str | None, Field(description="What else is to be said about what was just done.")] = None


class CorrectionBrief(BaseModel):
    """A correction, in short."""

    number: Annotated[int, Field(description="Counts per machine, without gaps.")]
    amount: Annotated[float, Field(description="What the offset changes by, mm.")]
    status: Annotated[Status, Field(description="As of a correction: pending, applied …")]
    created_at: datetime
    applied_at: Annotated[datetime | None, Field(description="When it took effect; null: not yet.")]


class GainOut(BaseModel):
    """Change of the size over what the corrections of the tool asked for, as one characteristic shows it; 1 is right."""

    characteristic: str
    gain: Annotated[
        float | None, Field(description="-1: wrong sign; 2 or 0.5: radius and diameter; null: not known yet.")
    ]
    uncertainty: Annotated[float | None, Field(description="Half the 95 % confidence interval.")]
    corrections: Annotated[int | None, Field(description="Changes of the offset that show it.")]
    verdict: Annotated[
        Literal["opposite", "none", "weak", "strong"] | None,
        Field(
            description="Where it is credibly nearer to a half or to 2 than to 1; `none`: corrections change nothing."
        ),
    ]


class ToolOut(BaseModel):
    """One location of the tool memory."""

    machine: str
    tool_memory: Annotated[int, Field(description="R10")]
    offset: Annotated[float, Field(description="The offset that the control is known to hold, mm.")]
    total: Annotated[float, Field(description="Sum of the corrections applied since the tool was changed, mm.")]
    parts: Annotated[int, Field(description="Parts cut since the tool was changed.")]
    changed_at: Annotated[datetime | None, Field(description="When the tool was changed last; null: never on record.")]
    reset_at: Annotated[
        datetime | None, Field(description="Changed, or edited by hand: parts cut before say nothing about it.")
    ]
    last_correction: Annotated[CorrectionBrief | None, Field(description="The one issued last, and its status.")]
    open_corrections: Annotated[
        list[CorrectionBrief], Field(description="Corrections that are neither applied nor ended.")
    ]
    characteristics: Annotated[list[str], Field(description="Which characteristics correct it.")]
    edge: Annotated[str | None, Field(description="The cutting edge: D number or name.")]
    name: Annotated[str | None, Field(description="What the tool is called.")]
    kind: Annotated[str | None, Field(description="Type of tool or insert.")]
    planned_parts: Annotated[int | None, Field(description="Planned tool life in parts.")]
    planned_total: Annotated[float | None, Field(description="Planned wear life: the sum of corrections, mm.")]
    sister: Annotated[int | None, Field(description="R10 of the sister tool.")]
    life_used: Annotated[float | None, Field(description="Share of the planned life that is used; 1 is all of it.")]
    parts_left: Annotated[int | None, Field(description="Parts until the planned life is reached, at the wear so far.")]
    paused_by: Annotated[
        int | None,
        Field(description="Number of the alarm that pauses the tool; nothing is corrected until it is answered."),
    ]
    gains: Annotated[
        list[GainOut] | None, Field(description="By each characteristic on it; of one tool asked for alone, else null.")
    ] = None


class ToolSet(ToolOut):
    """A location whose offset was set just now."""

    superseded: Annotated[list[int], Field(description="Corrections that must not be applied any more.")]
    note: Annotated[str | None, Field(description="What else is to be said; null: nothing.")] = None
    warnings: Warnings


class AverageOut(BaseModel):
    """One location of the average memory."""

    machine: str
    average_memory: Annotated[int, Field(description="R11")]
    average: Annotated[float, Field(description="M, the running average of the deviation, mm.")]
    empirical_value: Annotated[float, Field(description="Taken off every measurement, mm.")]
    updated_at: datetime | None
    characteristics: Annotated[list[str], Field(description="Which characteristics share it.")]


class AverageSet(AverageOut):
    """A location whose empirical value was set just now."""

    warnings: Warnings


def correction_out(row: CorrectionRow, note: str | None = None) -> CorrectionOut:
    """A correction as it is answered."""
    c = row.correction
    return answer_from(
        CorrectionOut,
        c,
        machine=row.machine,
        characteristic=row.characteristic,
        offset_expected=row.expected,
        status_reason=wording.why(c),
        reason=None if row.reason is None else ReadingReason(**row.reason),
        note=note,
    )


def _brief(c: Correction) -> CorrectionBrief:
    return CorrectionBrief.model_validate(c, from_attributes=True)


def tool_out(row: ToolRow, machine: str, gains: Sequence[ToolGain] | None = None) -> ToolOut:
    """A location of the tool memory as it is answered."""
    shown = None if gains is None else [_gain(each) for each in gains]
    return ToolOut.model_validate(_tool(row, machine) | {"gains": shown})


def _gain(of: ToolGain) -> dict[str, Any]:
    gain = of.gain
    return {
        "characteristic": of.characteristic,
        "gain": None if gain is None else round(gain.value, 3),
        "uncertainty": None if gain is None else round(gain.half_width, 3),
        "corrections": None if gain is None else gain.corrections,
        "verdict": None if gain is None or gain.verdict is None else gain.verdict.value,
    }


def tool_set(row: ToolRow, machine: str, superseded: list[int], warnings: Sequence[CodedWarning] = ()) -> ToolSet:
    """The same after its offset was set."""
    return ToolSet.model_validate(
        _tool(row, machine)
        | {
            "superseded": superseded,
            "note": wording.edit_note(superseded),
            "warnings": warnings_out(warnings, sentence),
        }
    )


def _tool(row: ToolRow, machine: str) -> dict[str, Any]:
    use = use_of(LifePlan(row.tool.planned_parts, row.tool.planned_total), row.parts, row.tool.total)
    return {
        "machine": machine,
        "tool_memory": row.tool.number,
        "offset": row.tool.offset,
        "total": row.tool.total,
        "parts": row.parts,
        "changed_at": row.tool.changed_at,
        "reset_at": row.tool.reset_at,
        "last_correction": None if row.last is None else _brief(row.last),
        "open_corrections": [_brief(c) for c in row.open],
        "characteristics": row.characteristics,
        **{name: getattr(row.tool, name) for name in DESCRIBED},
        "life_used": None if use.share is None else round(use.share, 4),
        "parts_left": use.left,
        "paused_by": row.tool.paused_by,
    }


def average_out(row: AverageRow, machine: str) -> AverageOut:
    """A location of the average memory as it is answered."""
    memory = row.memory
    return AverageOut(
        machine=machine,
        average_memory=memory.location,
        average=memory.average,
        empirical_value=memory.empirical_value,
        updated_at=memory.updated_at,
        characteristics=row.characteristics,
    )


def average_set(row: AverageRow, machine: str, warnings: Sequence[CodedWarning]) -> AverageSet:
    """The same after its empirical value was set."""
    return AverageSet(**average_out(row, machine).model_dump(), warnings=warnings_out(warnings, sentence))
