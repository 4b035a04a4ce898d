"""The strata of a capability study as JSON. Lengths in mm."""

from typing import Annotated

from pydantic import BaseModel, Field

from app.core.context import ContextField
from app.core.spc.refusal import Refused
from app.core.spc.strata import Difference
from app.loop.summaries import wording as statistics
from app.quality.capability.queries import Study
from app.quality.capability.schemas import IndexOut
from app.quality.capability.strata_queries import StrataStudy
from app.quality.capability.strata_wording import answer_words


class StratumOut(BaseModel):
    """One stratum; lengths in mm."""

    name: str
    readings: int
    mean: float = Field(description="Mean deviation.")
    standard_deviation: float | None = Field(description="Of its readings; null of a single one.")
    ppk: IndexOut | None = Field(description="To the nearer limit, with its interval; null of fewer than 20 readings.")
    refused: str | None = Field(description="Why it has no index.")


class DifferenceOut(BaseModel):
    """A test of strata, neighbours against neighbours: analysis of variance in blocks of ten readings, adjusted for blocks."""

    significant: bool = Field(description="Chance does not explain it, at 1 %.")
    p_value: float
    statistic: float = Field(description="F.")
    freedom: Annotated[list[int], Field(description="Degrees of freedom of F.", min_length=2, max_length=2)]
    apart: float | None = Field(
        description="How far the furthest two lie apart, drift taken out; null where not all were neighbours."
    )
    strata: int = Field(description="Strata that could be compared.")
    blocks: int = Field(description="Blocks of ten readings with several of them.")


class StrataOut(BaseModel):
    """Readings apart by a field of their context."""

    characteristic: str
    by: ContextField
    readings: int = Field(description="Of the study, in a stratum or not.")
    strata: list[StratumOut] = Field(description="The newest first, at most 12.")
    without: int = Field(description="Readings that name none.")
    older: int = Field(description="Readings of older strata, which are not listed.")
    difference: DifferenceOut | None = Field(description="Null where nobody can say; `text` says why.")
    text: str = Field(description="The answer to whether they differ, in words.")


def strata_out(study: Study, found: StrataStudy) -> StrataOut:
    """The strata as JSON."""
    return StrataOut(
        characteristic=study.current.characteristic.key,
        by=found.by,
        readings=len(study.values),
        strata=[
            StratumOut(
                name=each.name,
                readings=each.readings,
                mean=each.mean,
                standard_deviation=each.sigma,
                ppk=None if isinstance(each.ppk, Refused) else IndexOut.of(each.ppk),
                refused=statistics.refusal(each.ppk) if isinstance(each.ppk, Refused) else None,
            )
            for each in found.strata
        ],
        without=found.without,
        older=found.older,
        difference=_difference(found.answer) if isinstance(found.answer, Difference) else None,
        text=answer_words(found),
    )


def _difference(found: Difference) -> DifferenceOut:
    return DifferenceOut(
        significant=found.test.significant,
        p_value=found.test.p_value,
        statistic=found.test.statistic,
        freedom=[found.test.freedom, found.test.freedom_error],
        apart=found.apart,
        strata=found.strata,
        blocks=found.blocks,
    )
