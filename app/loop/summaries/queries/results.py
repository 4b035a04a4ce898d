"""Results of the measuring variants over the readings, and the number of rejected parts."""

from collections.abc import Sequence
from datetime import datetime
from typing import NamedTuple

from sqlalchemy import ColumnElement, Float, Integer, func, select, text
from sqlalchemy.orm import Session

from app.db.period import in_period_sql
from app.loop.summaries.queries.chart_data import MOST_BLOCKS, MOST_READINGS, excluded_of, single_readings
from app.loop.summaries.queries.context import in_context_sql, written
from app.loop.summaries.queries.window import Window
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.readings import Reading, ReadingResults, Stream

MOST_RESULTS = 500_000  # that are looked through for a chart; of more, the last ones


class Result(NamedTuple):
    """One result of one reading, mm."""

    sequence: int
    value: float


class ResultBlock(NamedTuple):
    """Many of them in one, with their extremes, mm."""

    first: int
    last: int
    minimum: float
    maximum: float
    mean: float


class ResultCourse(NamedTuple):
    """Blocks where there are more than can be drawn one by one, else single results; ascending."""

    blocks: list[ResultBlock]
    results: list[Result]
    excluded: frozenset[int]


class Rejects(NamedTuple):
    """Parts that were not accepted by n of m, and sections out of tolerance (the lathe line's #513)."""

    parts: int
    sections: int


def results_of(session: Session, characteristic: Characteristic, window: Window, name: str) -> ResultCourse:
    """Values of one result over the readings (a field of `app.core.variants.Results`); no extreme is thinned away."""
    value = getattr(ReadingResults, name)
    first = max(window.first, window.last - MOST_RESULTS + 1)
    here: tuple[ColumnElement[bool], ...] = (
        ReadingResults.machine_id == characteristic.machine_id,
        ReadingResults.characteristic_id == characteristic.id,
        ReadingResults.sequence.between(first, window.last),
        value.is_not(None),
    )
    if window.narrowed:
        measured = select(Reading.sequence).where(
            Reading.machine_id == characteristic.machine_id,
            Reading.characteristic_id == characteristic.id,
            Reading.sequence.between(first, window.last),
            window.meant,
        )
        here = (*here, ReadingResults.sequence.in_(measured))
    if window.last - first < MOST_READINGS:
        rows = session.execute(select(ReadingResults.sequence, value).where(*here).order_by(ReadingResults.sequence))
        excluded = excluded_of(session, characteristic, first, window.last) if window.count else ()
        return ResultCourse([], [Result(*row) for row in rows], frozenset(excluded))
    width = -(-(window.last - first + 1) // MOST_BLOCKS)
    block = func.div(ReadingResults.sequence - first, width).cast(Integer)
    query = (
        select(
            func.min(ReadingResults.sequence),
            func.max(ReadingResults.sequence),
            func.min(value),
            func.max(value),
            func.avg(value).cast(Float),
        )
        .where(*here)
        .group_by(block)
        .order_by(block)
    )
    return ResultCourse([ResultBlock(*row) for row in session.execute(query)], [], frozenset())


_REJECTS = f"""
SELECT count(*) FILTER (WHERE o.rejected), coalesce(sum(o.sections_outside), 0) FROM reading_results o
WHERE o.machine_id = :machine AND o.characteristic_id = :characteristic AND o.sections_outside > 0
    AND o.sequence BETWEEN :first AND :last AND NOT o.sequence = ANY(CAST(:excluded AS bigint[]))
    AND (CAST(:start AS timestamptz) IS NULL AND CAST(:end AS timestamptz) IS NULL OR EXISTS (
        SELECT FROM reading r WHERE r.machine_id = o.machine_id AND r.characteristic_id = o.characteristic_id
            AND r.sequence = o.sequence AND {in_period_sql("r.measured_at")}))
"""  # noqa: S608 - made of our own names


def rejects_of(session: Session, characteristic: Characteristic, window: Window) -> Rejects:
    """Rejected parts and sections outside among these readings, without excluded ones."""
    excluded: Sequence[int] = excluded_of(session, characteristic, window.first, window.last) if window.count else ()
    rows = session.execute(
        text(_REJECTS + in_context_sql(window.context, "o")),
        {
            "machine": characteristic.machine_id,
            "characteristic": characteristic.id,
            "first": window.first,
            "last": window.last,
            "excluded": list(excluded),
            **window.period._asdict(),
            **({"context": written(window.context)} if window.context else {}),
        },
    ).one()
    return Rejects(int(rows[0]), int(rows[1]))


def since_tool_change(session: Session, characteristic: Characteristic) -> Window:
    """The readings of parts that the tool of now has cut."""
    at = session.execute(
        select(Stream.sequence_at_tool_change, Stream.sequence).where(
            Stream.machine_id == characteristic.machine_id, Stream.characteristic_id == characteristic.id
        )
    ).one()
    return Window(at[0] + 1, at[1], at[1])


def tool_since(session: Session, characteristic: Characteristic) -> datetime | None:
    """The moment of the first reading of a part that the tool of now has cut; None before there is one."""
    first = since_tool_change(session, characteristic).first
    return next((reading.measured_at for reading in single_readings(session, characteristic, [first])), None)


_SINCE_CHANGE = """
SELECT s.characteristic_id, count(*) FILTER (WHERE o.rejected), sum(o.sections_outside) FROM stream s
JOIN reading_results o ON o.machine_id = s.machine_id AND o.characteristic_id = s.characteristic_id
    AND o.sequence > s.sequence_at_tool_change AND o.sections_outside > 0
WHERE (CAST(:machine AS int) IS NULL OR s.machine_id = :machine) AND NOT EXISTS (
    SELECT FROM exclusion e WHERE e.machine_id = o.machine_id AND e.characteristic_id = o.characteristic_id
        AND e.sequence = o.sequence)
GROUP BY s.characteristic_id
"""


def rejects_by_characteristic(session: Session, machine_id: int | None) -> dict[int, Rejects]:
    """Rejected parts and sections outside since each tool change, by characteristic; of one machine or of all."""
    rows = session.execute(text(_SINCE_CHANGE), {"machine": machine_id})
    return {characteristic: Rejects(int(parts), int(sections)) for characteristic, parts, sections in rows}
