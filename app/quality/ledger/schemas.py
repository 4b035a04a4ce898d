"""The ledger as JSON."""

from datetime import date, datetime
from typing import Annotated, Self

from pydantic import BaseModel, Field

from app.core.ledger import Tally, Worth
from app.language.times import local
from app.quality.ledger.queries import Ledger


class TallyOut(BaseModel):
    """Parts that were measured, held against the same parts without any correction."""

    readings: Annotated[int, Field(description="Parts measured; excluded ones and probe faults apart.")]
    without: Annotated[int, Field(description="Parts that would have been out of tolerance without corrections.")]
    truly: Annotated[int, Field(description="Parts that were out of tolerance.")]
    saved: Annotated[int, Field(description="Would have been out, and were not.")]
    spoiled: Annotated[int, Field(description="Were out, and would not have been: what over-correction cost.")]
    late: Annotated[
        int,
        Field(
            description="Were out, and would not have been with the corrections that were issued before: late confirmation."
        ),
    ]
    net: Annotated[int, Field(description="`saved` less `spoiled`.")]
    low: Annotated[float | None, Field(description="Lower end of the 95 % interval of `net`; null: too few readings.")]
    high: Annotated[float | None, Field(description="Upper end of it.")]
    worth: Annotated[
        Worth,
        Field(description="`saved` or `cost` where that is credible to 99.99 %; else `neither`: nothing is claimed."),
    ]
    money: Annotated[
        float | None,
        Field(description="`net` in the plant's money; null where nothing is claimed, or no cost of a part is set."),
    ]

    @classmethod
    def of(cls, found: Tally, part_cost: float | None) -> Self:
        """A tally as it is answered."""
        return cls(
            **{name: getattr(found, name) for name in cls.model_fields if name != "money"},
            money=money_of(found, part_cost),
        )


def money_of(found: Tally, part_cost: float | None) -> float | None:
    """The net in the plant's money; None where nothing is claimed."""
    return None if part_cost is None or found.worth is Worth.NEITHER else round(found.net * part_cost, 2)


class LedgerWeekOut(TallyOut):
    """One week."""

    week: Annotated[date, Field(description="Its Monday, by the plant's clock.")]


class LedgerToolOut(TallyOut):
    """One tool."""

    tool_memory: Annotated[int, Field(description="R10.")]


class LedgerCharacteristicOut(TallyOut):
    """One characteristic."""

    characteristic: str
    tool_memory: Annotated[int, Field(description="R10.")]
    unknown: Annotated[int, Field(description="Readings left out, because nobody knows their corrections.")]


class LedgerOut(BaseModel):
    """The worth of the corrections of a machine."""

    machine: str
    start: Annotated[datetime | None, Field(description="Where the period begins.")]
    end: Annotated[datetime | None, Field(description="Where it ends; null: now.")]
    part_cost: Annotated[float | None, Field(description="Cost of a rejected part; null: not set (INBAND_PART_COST).")]
    currency: Annotated[str, Field(description="Of all money (INBAND_CURRENCY).")]
    total: Annotated[TallyOut, Field(description="A part that two characteristics reject counts at each.")]
    weeks: Annotated[list[LedgerWeekOut], Field(description="The newest first.")]
    tools: Annotated[list[LedgerToolOut], Field(description="By tool.")]
    characteristics: Annotated[list[LedgerCharacteristicOut], Field(description="By characteristic.")]

    @classmethod
    def of(cls, found: Ledger, part_cost: float | None, currency: str) -> Self:
        """A ledger as it is answered."""

        def row(each: Tally) -> dict[str, object]:
            return TallyOut.of(each, part_cost).model_dump()

        return cls(
            machine=found.machine.key,
            start=found.period.start,
            end=found.period.end,
            part_cost=part_cost,
            currency=currency,
            total=TallyOut.of(found.total, part_cost),
            weeks=[
                LedgerWeekOut.model_validate(row(each) | {"week": local(week).date()}) for week, each in found.by_week()
            ],
            tools=[LedgerToolOut.model_validate(row(each) | {"tool_memory": tool}) for tool, each in found.by_tool()],
            characteristics=[
                LedgerCharacteristicOut.model_validate(
                    row(each.tally) | {"characteristic": each.key, "tool_memory": each.tool, "unknown": each.unknown}
                )
                for each in found.characteristics
            ],
        )
