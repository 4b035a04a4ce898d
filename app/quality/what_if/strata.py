"""The past as it was and as a replay would have made it, split by order, nest, operator …. Never writes.

The loop corrects one tool for all of them, so it is replayed with all readings; only its results are split.
"""

from typing import NamedTuple

from sqlalchemy.orm import Session

from app.core.context import ContextField
from app.core.decision.limits import Limits, in_nanometres, reaches, within
from app.loop.summaries import queries as statistics
from app.quality.what_if.queries import Simulation
from app.quality.what_if.tool_history import Flags, Values


class Result(NamedTuple):
    """Mean and standard deviation (mm, None of too few) of a stratum, and its parts outside today's tolerance."""

    mean: float | None
    spread: float | None
    outside: int


class ReplayedStratum(NamedTuple):
    """A stratum: its readings as they were, by today's settings, and by the others."""

    name: str
    readings: int
    truly: Result
    today: Result
    other: Result


def strata_of(session: Session, answer: Simulation, by: ContextField) -> list[ReplayedStratum]:
    """The strata of the replayed readings, the newest first; readings that name none are in none."""
    past = answer.past
    found = statistics.strata_of(session, past.current.characteristic, by, past.history["sequence"])
    courses = (
        past.history["deviation"],
        answer.today_result.deviation[past.mine],
        answer.other_result.deviation[past.mine],
    )
    limits = past.current.parameters.limits
    made = []
    for number, name in enumerate(found.names):
        of = (found.labels == number) & ~past.history.excluded
        if of.any():
            results = (_result(values[of], past.inner(values[of]), limits) for values in courses)
            made.append(ReplayedStratum(name, int(of.sum()), *results))
    return made


def _result(values: Values, inner: Flags, limits: Limits) -> Result:
    """As the figures of a replay count: mean and spread of the readings within R37, parts outside without probe faults."""
    size = in_nanometres(values)
    kept = values[inner]
    outside = int((~within(size, limits.tolerance) & ~reaches(size, limits.confidence)).sum())
    mean = float(kept.mean()) if len(kept) else None
    return Result(mean, float(kept.std(ddof=1)) if len(kept) > 1 else None, outside)
