"""JSON route: the numbers of a run of readings."""

from typing import Annotated

from fastapi import Query
from pydantic import BaseModel, Field

from app.access.deps import AnyCaller
from app.loop.characteristics import queries as characteristics
from app.loop.summaries import queries
from app.web.api import CharacteristicKey, api_router, problems
from app.web.choice import InPeriod
from app.web.deps import FROM_REPLICA, SessionDep
from app.web.fields import LARGEST_ID, answer_from

router = api_router("statistics", FROM_REPLICA)


class StatisticsOut(BaseModel):
    """Deviations in mm. What cannot be said of so few readings is null; excluded readings are left out.

    A probe fault (R36 reached) measured no part: it is in `count` and `zones`, and left out of mean, standard deviation,
    minimum, maximum and share, as capability and control charts leave it out.
    """

    characteristic: str
    first_sequence: int | None = Field(description="First reading that was looked at.")
    last_sequence: int | None
    count: int = Field(description="Readings that nobody excluded, probe faults among them.")
    excluded: int = Field(description="Readings that were taken out of the statistics.")
    probe_faults: int = Field(description="Of `count`: left out of every number but `count` and `zones`.")
    mean: float | None = Field(description="Mean deviation.")
    standard_deviation: float | None = Field(description="Of the sample (n - 1); null for fewer than two readings.")
    minimum: float | None = Field(description="Smallest deviation.")
    maximum: float | None = Field(description="Largest deviation.")
    in_tolerance: int = Field(description="Parts whose raw deviation was within the tolerance in force.")
    share_in_tolerance: float | None = Field(description="Of the parts measured: `count` less `probe_faults`.")
    corrections: int = Field(description="Readings that led to a correction.")
    rejected: int | None = Field(description="With acceptance n of m: parts that were not accepted; else null.")
    sections_outside: int | None = Field(
        description="With acceptance n of m: sections out of tolerance, the lathe line's #513; else null."
    )
    rejected_since_tool_change: int | None = Field(description="The same of all parts since the tool was changed.")
    sections_outside_since_tool_change: int | None = Field(
        description="The same of all parts since the tool was changed."
    )
    zones: dict[str, int] = Field(description="How many were decided in each zone.")


@router.get("/characteristics/{characteristic}/statistics", responses=problems(404))
def get_statistics(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    period: InPeriod,
    last: Annotated[int | None, Query(ge=1, le=LARGEST_ID, description="Only of the last N readings.")] = None,
) -> StatisticsOut:
    """Number, mean, standard deviation, extremes, zones: exact, of all readings or of those measured in a period.

    With `last` as well, of the last N readings those that were measured in it count.
    """
    current = characteristics.characteristic_for(session, caller, characteristic, "viewer")
    window = queries.window_of(session, current.characteristic, last=last, period=period)
    numbers = queries.numbers_of(session, current.characteristic, window)
    rejects = of_tool = None
    if current.parameters.accept_m > 1:
        rejects = queries.rejects_of(session, current.characteristic, window)
        since_change = queries.since_tool_change(session, current.characteristic)
        of_tool = queries.rejects_of(session, current.characteristic, since_change)
    return answer_from(
        StatisticsOut,
        numbers,
        characteristic=current.characteristic.key,
        first_sequence=window.first if window.count else None,
        last_sequence=window.last if window.count else None,
        rejected=rejects.parts if rejects else None,
        sections_outside=rejects.sections if rejects else None,
        rejected_since_tool_change=of_tool.parts if of_tool else None,
        sections_outside_since_tool_change=of_tool.sections if of_tool else None,
    )
