"""Control plans and missed measurements as JSON."""

from datetime import datetime
from typing import Annotated, Literal, Self

from pydantic import BaseModel, Field

from app.core.context import ContextField
from app.core.control_plan import Plan
from app.loop.control_plan.queries import Look, MissedRow, stated
from app.loop.control_plan.wording import due_word, plan_words, state_sentences
from app.loop.tables.control_plan import ControlPlan
from app.web.fields import Body, Reason

Every = Annotated[int, Field(strict=True, ge=1, le=1000)]
Few = Annotated[int, Field(strict=True, ge=0, le=1000)]
_EVERY = "1 in N parts is measured, 1: every part; null: parts do not count."
_MINUTES = "At least one measurement in N minutes while the machine runs; null: minutes do not count."
_PER_SHIFT = "At least one measurement in each shift in which the part is made."
_AFTER_CHANGE = "Every part is measured for N readings after a tool change."
_AFTER_ALARM = "Every part is measured for N readings after an alarm about the characteristic or its tool."
_ON_THE_WAY = "Parts that lie between the machine and the gauge: they are not missed yet."
_REQUIRED = (
    "What the context of every reading must say. One that does not is stored and decided like any other, and raises the alarm "
    "`context_missing` within a minute; the measuring sheet takes none without."
)
_NUMBERED = "Parts are numbered one by one on this machine, so a number that is missing between two is a part."


class ControlPlanIn(Body):
    """A control plan. Without any rule the characteristic is not planned, and what its context must say stands by itself."""

    every: Annotated[Every | None, Field(description=_EVERY)] = None
    minutes: Annotated[float | None, Field(strict=True, gt=0, le=100_000, description=_MINUTES)] = None
    per_shift: Annotated[bool, Field(strict=True, description=_PER_SHIFT)] = False
    after_change: Annotated[Few, Field(description=_AFTER_CHANGE)] = 0
    after_alarm: Annotated[Few, Field(description=_AFTER_ALARM)] = 0
    on_the_way: Annotated[Few, Field(description=_ON_THE_WAY)] = 0
    numbered: Annotated[bool, Field(strict=True, description=_NUMBERED)] = False
    required_context: Annotated[
        list[ContextField], Field(default_factory=list, max_length=len(ContextField), description=_REQUIRED)
    ]
    reason: Reason

    @property
    def plan(self) -> Plan:
        """As the core has it."""
        required = tuple(field for field in ContextField if field in self.required_context)
        return Plan(**self.model_dump(exclude={"reason"}) | {"required_context": required})


class ControlPlanOut(BaseModel):
    """The control plan of a characteristic."""

    characteristic: str
    every: Annotated[int | None, Field(description=_EVERY)]
    minutes: Annotated[float | None, Field(description=_MINUTES)]
    per_shift: Annotated[bool, Field(description=_PER_SHIFT)]
    after_change: Annotated[int, Field(description=_AFTER_CHANGE)]
    after_alarm: Annotated[int, Field(description=_AFTER_ALARM)]
    on_the_way: Annotated[int, Field(description=_ON_THE_WAY)]
    numbered: Annotated[bool, Field(description=_NUMBERED)]
    required_context: Annotated[list[ContextField], Field(description=_REQUIRED)]
    since: Annotated[datetime | None, Field(description="It counts from then on; null: there never was a plan.")]
    changed_by: Annotated[str | None, Field(description="Who set it.")]
    reason: Annotated[str | None, Field(description="Why it is so.")]
    text: Annotated[str, Field(description="The plan in words.")]

    @classmethod
    def of(cls, characteristic: str, row: ControlPlan | None) -> Self:
        """The plan in force; one without any rule where there is none."""
        plan = stated(row)
        return cls(
            characteristic=characteristic,
            **{name: getattr(plan, name) for name in Plan.__dataclass_fields__},
            since=row.since if row else None,
            changed_by=row.changed_by if row else None,
            reason=row.reason if row else None,
            text=plan_words(plan),
        )


class DueOut(BaseModel):
    """The state of a control plan now."""

    characteristic: str
    machine: str
    plan: Annotated[str, Field(description="The plan in words.")]
    due: Annotated[
        Literal["later", "due", "missed"],
        Field(description="`later`: kept; `due`: the next part is to be measured; `missed`: overdue."),
    ]
    by: Annotated[Literal["parts", "minutes", "shift"] | None, Field(description="The rule that says so.")]
    every: Annotated[int | None, Field(description="The interval in force, after a tool change or an alarm 1.")]
    tightened: Annotated[
        Literal["tool_change", "alarm"] | None, Field(description="Why every part is measured for now.")
    ]
    next_in: Annotated[
        int | None,
        Field(description="Parts until the one to measure, 1: the next one; null: not known, or not by parts."),
    ]
    parts: Annotated[
        int | None, Field(description="Parts cut since the last reading and not measured; null: nothing tells of them.")
    ]
    minutes: Annotated[float, Field(description="Minutes that the machine is known to have run since.")]
    last_sequence: Annotated[int, Field(description="The last reading by the time it was measured; 0: none yet.")]
    text: Annotated[str, Field(description="The state in words.")]

    @classmethod
    def of(cls, characteristic: str, machine: str, look: Look) -> Self:
        """A plan as it is kept now."""
        plan = look.row.plan
        sentences = [
            f"{due_word(look.judged.due)}.",
            *state_sentences(plan, look.rhythm, look.since, look.judged, of_part=look.of_part),
        ]
        return cls(
            characteristic=characteristic,
            machine=machine,
            plan=plan_words(plan),
            due=look.judged.due.value,  # type: ignore[arg-type]
            by=look.judged.by.value if look.judged.by else None,
            every=look.rhythm.every,
            tightened=look.rhythm.tightened.value if look.rhythm.tightened else None,
            next_in=look.judged.next_in,
            parts=look.since.parts,
            minutes=look.since.minutes,
            last_sequence=look.sequence,
            text=" ".join(sentences),
        )


class MissedOut(BaseModel):
    """A measurement that the plan asked for and that was not made."""

    id: int
    characteristic: str
    machine: str
    by: Annotated[Literal["parts", "minutes", "shift"], Field(description="The rule that was not kept.")]
    every: Annotated[int | None, Field(description="The interval that was not kept; null: it was another rule.")]
    after: Annotated[int, Field(description="The last reading before; 0: none yet.")]
    until: Annotated[int | None, Field(description="The reading that ended it; null: none, or the plan was changed.")]
    parts: Annotated[int | None, Field(description="Parts cut and not measured; null: nothing tells of them.")]
    minutes: Annotated[float, Field(description="Minutes that the machine is known to have run.")]
    found_at: Annotated[datetime, Field(description="When it was found, within a minute.")]
    ended_at: Annotated[datetime | None, Field(description="When it ended; null: it goes on.")]

    @classmethod
    def of(cls, row: MissedRow) -> Self:
        """A row of the list."""
        missed = row.missed
        return cls(
            **{name: getattr(missed, name) for name in cls.model_fields if name not in ("characteristic", "machine")},
            characteristic=row.characteristic.key,
            machine=row.machine.key,
        )
