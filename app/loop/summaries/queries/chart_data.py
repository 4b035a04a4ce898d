"""Data of a chart over readings, few enough to plot: single readings, or blocks of them with their extremes."""

from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from typing import NamedTuple

from sqlalchemy import select, text
from sqlalchemy.orm import Session

from app.core.decision.limits import Zone
from app.db.period import in_period_sql
from app.loop.summaries.queries.context import in_context_sql, written
from app.loop.summaries.queries.pyramid import BASE_LEVEL, FAN, TOP_LEVEL, Block, Mean, Run, blocks_of, means_of
from app.loop.summaries.queries.window import Window
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.readings import Exclusion, Reading

MOST_READINGS = 2_500  # drawn one by one
MOST_BLOCKS = 1_000  # about one for every pixel that the readings have


class ChartReading(NamedTuple):
    """One reading as a chart plots it; mm."""

    sequence: int
    measured: float
    deviation: float
    zone: str
    average_after: float
    measured_at: datetime
    received_at: datetime
    parameters_version: int


class ChartData(NamedTuple):
    """Blocks and then single readings, ascending; together they are every reading of the window, once. means: of each block."""

    blocks: list[Block]
    means: list[Mean]
    readings: list[ChartReading]
    excluded: frozenset[int]


_COLUMNS = [getattr(Reading, name) for name in ChartReading._fields]

# Blocks of the readings of one context, as the pyramid has them of all; the last two are the mean that statistics count.
_OF_CONTEXT = f"""
SELECT (r.sequence - 1) >> :level, count(*), min(r.deviation), max(r.deviation), sum(r.deviation), sum(r.deviation * r.deviation),
    (array_agg(r.average_after ORDER BY r.sequence DESC))[1], count(r.correction),
    ARRAY[{", ".join(f"count(*) FILTER (WHERE r.zone = '{zone.value}')" for zone in Zone)}],
    min(r.measured_at), max(r.measured_at),
    avg(r.deviation) FILTER (WHERE counts), count(*) FILTER (WHERE NOT counts)
FROM reading r CROSS JOIN LATERAL (
    SELECT r.zone <> '{Zone.PROBE_FAULT.value}' AND NOT r.sequence = ANY(CAST(:excluded AS bigint[])) AS counts
) AS judged
WHERE r.machine_id = :machine AND r.characteristic_id = :characteristic AND r.sequence BETWEEN :first AND :last
    AND {in_period_sql("r.measured_at")}
"""  # noqa: S608 - made of the names of our zones


def plan(window: Window) -> tuple[list[tuple[int, int, int]], list[Run]]:
    """The blocks to read as (level, first block, last block) …, and runs of single readings.

    As fine a level as `MOST_BLOCKS` allows; at both ends, where its blocks are not full, finer ones.

    >>> plan(Window(1, 100, 100))
    ([], [(1, 100)])
    >>> plan(Window(1, 10_010, 10_010))
    ([(5, 0, 311)], [(9985, 10010)])
    """
    if window.count <= MOST_READINGS:
        return [], [(window.first, window.last)]
    level = next(
        (level for level in range(BASE_LEVEL, TOP_LEVEL, FAN) if window.count >> level <= MOST_BLOCKS), TOP_LEVEL
    )
    blocks: list[tuple[int, int, int]] = []
    left, right = window.first - 1, window.last  # what is not covered yet: outside left … right it is
    low, high = -(-left >> level), right >> level  # the coarse blocks: low … high - 1
    while high <= low and level > BASE_LEVEL:
        level -= FAN
        low, high = -(-left >> level), right >> level
    blocks.append((level, low, high - 1))
    inner_left, inner_right = low << level, high << level
    for finer in range(level - FAN, BASE_LEVEL - 1, -FAN):
        low, high = -(-left >> finer), right >> finer
        if low << finer < inner_left:
            blocks.append((finer, low, (inner_left >> finer) - 1))
            inner_left = low << finer
        if high << finer > inner_right:
            blocks.append((finer, inner_right >> finer, high - 1))
            inner_right = high << finer
    runs = [run for run in ((left + 1, inner_left), (inner_right + 1, right)) if run[0] <= run[1]]
    return blocks, runs


def chart_data_of(session: Session, characteristic: Characteristic, window: Window) -> ChartData:
    """Every reading of the window, in no more rows than can be drawn. A block of which a part is meant is drawn whole."""
    if window.context and window.count > MOST_READINGS:
        return _of_context(session, characteristic, window)
    pieces, runs = plan(window)
    blocks: list[Block] = []
    for level, low, high in pieces:
        blocks += blocks_of(session, characteristic, level, range(low, high + 1))
    blocks = [
        block
        for block in sorted(blocks, key=lambda block: block.first)
        if window.period.touches(block.first_at, block.last_at)
    ]
    readings: list[ChartReading] = []
    excluded: set[int] = set()
    for first, last in runs:
        if first > last:
            continue
        readings += readings_of(session, characteristic, replace(window, first=first, last=last))
        excluded.update(excluded_of(session, characteristic, first, last))
    return ChartData(blocks, means_of(session, characteristic, blocks), readings, frozenset(excluded))


def _of_context(session: Session, characteristic: Characteristic, window: Window) -> ChartData:
    """Those of a context among very many: one by one where they are few, else blocks of them."""
    excluded = excluded_of(session, characteristic, window.first, window.last)
    singly = readings_of(session, characteristic, window, MOST_READINGS + 1)
    if len(singly) <= MOST_READINGS:
        return ChartData([], [], singly, frozenset(excluded))
    level = next(level for level in range(TOP_LEVEL + 1) if window.count >> level <= MOST_BLOCKS)
    rows = session.execute(
        text(_OF_CONTEXT + in_context_sql(window.context, "r") + " GROUP BY 1 ORDER BY 1"),
        {
            "level": level,
            "machine": characteristic.machine_id,
            "characteristic": characteristic.id,
            "first": window.first,
            "last": window.last,
            "excluded": list(excluded),
            "context": written(window.context),
            **window.period._asdict(),
        },
    ).all()
    blocks = [Block(level, *row[:-2]) for row in rows]
    return ChartData(blocks, [Mean(*row[-2:]) for row in rows], [], frozenset())


def readings_of(
    session: Session, characteristic: Characteristic, window: Window, most: int | None = None
) -> list[ChartReading]:
    """These readings, ascending; the first `most`."""
    rows = session.execute(
        select(*_COLUMNS)
        .where(
            Reading.machine_id == characteristic.machine_id,
            Reading.characteristic_id == characteristic.id,
            Reading.sequence.between(window.first, window.last),
            window.meant,
        )
        .order_by(Reading.sequence)
        .limit(most)
    )
    return [ChartReading(*row) for row in rows]


def single_readings(session: Session, characteristic: Characteristic, sequences: Sequence[int]) -> list[ChartReading]:
    """The readings with these numbers, ascending."""
    rows = session.execute(
        select(*_COLUMNS)
        .where(
            Reading.machine_id == characteristic.machine_id,
            Reading.characteristic_id == characteristic.id,
            Reading.sequence.in_(sequences),
        )
        .order_by(Reading.sequence)
    )
    return [ChartReading(*row) for row in rows]


def excluded_of(session: Session, characteristic: Characteristic, first: int, last: int) -> Sequence[int]:
    """Sequence numbers of those readings that were excluded from the statistics, ascending."""
    return session.scalars(
        select(Exclusion.sequence)
        .where(
            Exclusion.machine_id == characteristic.machine_id,
            Exclusion.characteristic_id == characteristic.id,
            Exclusion.sequence.between(first, last),
        )
        .order_by(Exclusion.sequence)
    ).all()


def moments_of(
    session: Session, characteristic: Characteristic, sequences: Sequence[int]
) -> list[tuple[int, datetime]]:
    """Times at which these readings arrived, with their sequence numbers, ascending."""
    if not sequences:
        return []
    rows = session.execute(
        select(Reading.sequence, Reading.received_at)
        .where(
            Reading.machine_id == characteristic.machine_id,
            Reading.characteristic_id == characteristic.id,
            Reading.sequence.in_(sequences),
        )
        .order_by(Reading.sequence)
    )
    return [(sequence, at) for sequence, at in rows]
