"""The ranking as JSON."""

from datetime import date, datetime
from typing import Literal

from pydantic import BaseModel, Field

from app.core.spc.quoting import Quote
from app.quality.capability import wording as capability
from app.views.overview import wording
from app.views.overview.queries import Ranked
from app.web.fields import answer_from


class AttentionReasonOut(BaseModel):
    """Reason why attention is needed."""

    code: str
    text: str


class WeekOut(BaseModel):
    """The index of the readings measured in one week."""

    begins: date = Field(description="Its Monday, by the plant's clock.")
    readings: int = Field(description="Number of readings that count.")
    value: float | None = Field(description="The index that may be quoted of them; null where none may.")
    low: float | None = Field(description="Its 95 % interval; null where it has none.")
    high: float | None = Field(description="Its 95 % interval; null where it has none.")


class RankedOut(BaseModel):
    """A characteristic with what it is ranked by."""

    characteristic: str
    name: str
    machine: str
    state: str = Field(description="How it stands, in a word.")
    reasons: list[AttentionReasonOut] = Field(description="The most urgent first; empty where nobody is needed.")
    ppk: float | None = Field(
        description="The index that may be quoted of the last 1000 readings, as on the page of capability; `quote` says which one: Cpk, Ppk, Ppk by a fitted distribution, or Ppk by percentiles. null where none may."
    )
    quote: Literal["cpk", "ppk", "fitted", "percentile", "none"] = Field(
        description="Which index it is, and by which method."
    )
    low: float | None = Field(description="Its 95 % interval; null where it has none.")
    high: float | None = Field(description="Its 95 % interval; null where it has none.")
    preliminary: bool = Field(description="Of too few readings to be used without its interval.")
    method: str = Field(
        description="Distribution and scatter that the index was computed by; empty where there is none."
    )
    why_none: str | None = Field(description="Why none may be quoted; null where one may.")
    readings: int = Field(description="Number of readings that the index was computed from.")
    first_reading: int | None = Field(description="The first of them.")
    last_reading: int | None = Field(description="The last of them.")
    first_at: datetime | None = Field(description="When the first of them was measured.")
    last_at: datetime | None = Field(description="When the last of them was: the verdict is of then.")
    judged_at: datetime = Field(description="When it was worked out.")
    now: str | None = Field(
        description="Why the newest readings carry no index, where the last one that could be quoted is kept; else null."
    )
    weeks: list[WeekOut] = Field(
        description="The index of each of the last 13 weeks that has readings, the oldest first, as the periodic job worked it out."
    )
    parts_left: float | None = Field(description="Parts until wear comes to the first limit, as predicted.")
    signals: list[int] = Field(description="Numbers of the open signals.")
    alarms: int = Field(description="Active alarms.")
    alarms_per_shift: float = Field(description="Alarms that parts gave per 8 hours, over the last 7 days.")


class Overview(BaseModel):
    """A page of the ranking."""

    items: list[RankedOut]
    next: int | None = Field(description="`after` of the next page; null at the end.")

    @classmethod
    def of(cls, ranked: list[Ranked], after: int, limit: int) -> "Overview":
        """The page behind the first `after` ones."""
        return cls(
            items=[
                answer_from(
                    RankedOut,
                    entry.verdict.of,
                    characteristic=entry.row.characteristic.key,
                    name=entry.row.characteristic.name,
                    machine=entry.machine.key,
                    state=entry.inputs.state.value,
                    reasons=[
                        AttentionReasonOut(code=sentence.reason.code, text=sentence.text)
                        for sentence in wording.reasons(entry)
                    ],
                    ppk=entry.inputs.ppk,
                    quote=Quote(entry.verdict.of.quote).value,
                    method=capability.method(entry.verdict.of.quote),
                    why_none=None if entry.inputs.ppk is not None else capability.why_not(entry.verdict.of.why),
                    first_reading=entry.verdict.of.first,
                    last_reading=entry.verdict.of.last,
                    judged_at=entry.verdict.of.at,
                    now=capability.why_not(entry.verdict.now) if entry.verdict.now else None,
                    weeks=[WeekOut(**week._asdict()) for week in entry.verdict.weeks],
                    parts_left=entry.inputs.parts_left,
                    signals=entry.signals,
                    alarms=entry.inputs.alarms,
                    alarms_per_shift=round(entry.inputs.per_shift, 3),
                )
                for entry in ranked[after : after + limit]
            ],
            next=after + limit if after + limit < len(ranked) else None,
        )
