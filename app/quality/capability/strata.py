"""A capability study apart by order, nest, operator …: the numbers of each stratum, and whether they differ. Never writes."""

from typing import Annotated, NamedTuple

from pydantic import BaseModel, Field
from sqlalchemy.orm import Session

from app.core.context import ContextField
from app.core.spc import strata as core
from app.core.spc.refusal import Refused
from app.core.spc.strata import Difference, NoAnswer, Stratum
from app.language.i18n import _, ngettext
from app.language.numbers import plain_um
from app.loop.summaries import queries as statistics
from app.loop.summaries import wording as statistics_wording
from app.loop.summaries.queries.context import OLDER, WITHOUT
from app.quality.capability.queries import Study
from app.quality.capability.schemas import IndexOut
from app.quality.capability.wording import p_value


class StrataStudy(NamedTuple):
    """The strata of a study, the newest first. without: readings that name none; older: readings of strata that are too many."""

    by: ContextField
    strata: list[Stratum]
    without: int
    older: int
    answer: Difference | NoAnswer


def strata_of(session: Session, study: Study, by: ContextField) -> StrataStudy:
    """Tell the readings of the study apart, each stratum by the limits of the study."""
    found = statistics.strata_of(session, study.current.characteristic, by, study.sequence)
    return StrataStudy(
        by,
        core.strata(study.values, found.labels, found.names, study.limits, study.confidence),
        int((found.labels == WITHOUT).sum()),
        int((found.labels == OLDER).sum()),
        core.differ(study.values, found.labels),
    )


def answer_words(found: StrataStudy) -> str:
    """The answer to whether they differ, in a sentence or two."""
    answer = found.answer
    match answer:
        case NoAnswer.ONE:
            return _("There are no two of them to compare.")
        case NoAnswer.APART:
            return _(
                "They were made one after the other: nobody can tell what differs between them from what drifted meanwhile. It takes "
                "readings of several of them side by side, in five places and more."
            )
        case NoAnswer.NO_VARIATION:
            return _("The readings do not vary enough to say whether they differ.")
    assert isinstance(answer, Difference)
    numbers = f"F({answer.test.freedom}, {answer.test.freedom_error}) = {answer.test.statistic:.2f}, {p_value(answer.test.p_value)}"
    if not answer.test.significant:
        return _("Nothing says that they differ ({numbers}).").format(numbers=numbers)
    if answer.apart is None:
        return _("They differ ({numbers}).").format(numbers=numbers)
    return _("They differ: side by side, the furthest two lie {apart} apart ({numbers}).").format(
        apart=plain_um(answer.apart, 2), numbers=numbers
    )


def left_out_words(found: StrataStudy) -> list[str]:
    """Sentences about the readings that are in no line of the table."""
    words = []
    if found.without:
        words.append(
            ngettext("{n} reading names none.", "{n} readings name none.", found.without).format(n=found.without)
        )
    if found.older:
        words.append(
            ngettext(
                "{n} reading belongs to older ones, which are not listed.",
                "{n} readings belong to older ones, which are not listed.",
                found.older,
            ).format(n=found.older)
        )
    return words


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
    """Readings told apart by a field of their context."""

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
    answer = found.answer if isinstance(found.answer, Difference) else None
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
                refused=statistics_wording.refusal(each.ppk) if isinstance(each.ppk, Refused) else None,
            )
            for each in found.strata
        ],
        without=found.without,
        older=found.older,
        difference=answer
        and DifferenceOut(
            significant=answer.test.significant,
            p_value=answer.test.p_value,
            statistic=answer.test.statistic,
            freedom=[answer.test.freedom, answer.test.freedom_error],
            apart=answer.apart,
            strata=answer.strata,
            blocks=answer.blocks,
        ),
        text=answer_words(found),
    )
