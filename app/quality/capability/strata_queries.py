"""A capability study split by order, nest, operator …: the numbers of each stratum, and the test if they differ. Never writes."""

from typing import NamedTuple

from sqlalchemy.orm import Session

from app.core.context import ContextField
from app.core.spc import strata as core
from app.core.spc.strata import Difference, NoAnswer, Stratum
from app.loop.summaries import queries as statistics
from app.quality.capability.queries import Study


class StrataStudy(NamedTuple):
    """The strata of a study, the newest first. without: readings that name none; older: readings of strata that are too many."""

    by: ContextField
    strata: list[Stratum]
    without: int
    older: int
    answer: Difference | NoAnswer


def strata_of(session: Session, study: Study, by: ContextField) -> StrataStudy:
    """Split the readings of the study, each stratum by the limits of the study."""
    found = statistics.strata_of(session, study.current.characteristic, by, study.sequence)
    return StrataStudy(
        by,
        core.strata(study.values, found.labels, found.names, study.limits, study.confidence),
        int((found.labels == statistics.WITHOUT).sum()),
        int((found.labels == statistics.OLDER).sum()),
        core.differ(study.values, found.labels),
    )
