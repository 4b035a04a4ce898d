"""Reading the pyramid: which full blocks, and which single readings beside them, make up a run of readings."""

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from math import fsum
from typing import NamedTuple

from sqlalchemy import select, text
from sqlalchemy.orm import Session

from app.core.decision.limits import FAULT, Zone
from app.core.period import ALWAYS, Period
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.readings import ReadingSummary

BASE_LEVEL, TOP_LEVEL, FAN = 5, 23, 2  # blocks of 32, 128, 512 … 8 388 608 readings, as the writer makes them

Run = tuple[int, int]
"""Sequences from the first to the last, both included."""


@dataclass(frozen=True, slots=True)
class Block:
    """The summary of one full block; deviations in mm."""

    level: int
    block: int
    count: int
    minimum: float
    maximum: float
    sum: float
    sum_squares: float
    average: float
    corrections: int
    zones: list[int]
    first_at: datetime
    last_at: datetime

    @property
    def first(self) -> int:
        return (self.block << self.level) + 1

    @property
    def last(self) -> int:
        return (self.block + 1) << self.level

    @property
    def mean(self) -> float:
        return self.sum / self.count

    @property
    def middle_at(self) -> datetime:
        """The middle of the time in which they were measured."""
        return self.first_at + (self.last_at - self.first_at) / 2


_COLUMNS = [getattr(ReadingSummary, name) for name in Block.__slots__]


def blocks_of(session: Session, characteristic: Characteristic, level: int, numbers: Sequence[int]) -> list[Block]:
    """These blocks of one level, as far as they are there, ascending."""
    if not numbers:
        return []
    query = select(*_COLUMNS).where(
        ReadingSummary.machine_id == characteristic.machine_id,
        ReadingSummary.characteristic_id == characteristic.id,
        ReadingSummary.level == level,
    )
    if numbers[-1] - numbers[0] == len(numbers) - 1:
        query = query.where(ReadingSummary.block.between(numbers[0], numbers[-1]))
    else:
        query = query.where(ReadingSummary.block.in_(numbers))
    return [Block(*row) for row in session.execute(query.order_by(ReadingSummary.block))]


class Mean(NamedTuple):
    """Of a block those readings that measured a part and that nobody excluded: their mean (mm), and how many are left out."""

    value: float | None
    left_out: int


# Down the pyramid to the smallest blocks that hold a probe fault. The readings are found block by block, never by a scan.
_LEFT_OUT = f"""
WITH RECURSIVE faulty AS (
    SELECT level, block FROM unnest(CAST(:levels AS int[]), CAST(:blocks AS bigint[])) AS asked(level, block)
    UNION ALL
    SELECT s.level, s.block FROM faulty f, LATERAL (
        SELECT CAST(level AS int), block FROM reading_summary
        WHERE machine_id = :machine AND characteristic_id = :characteristic AND level = f.level - {FAN}
            AND block >= f.block << {FAN} AND block < (f.block + 1) << {FAN} AND zones[{FAULT + 1}] > 0 OFFSET 0
    ) s WHERE f.level > {BASE_LEVEL}
)
SELECT r.sequence, r.deviation FROM faulty f, LATERAL (
    SELECT sequence, deviation FROM reading
    WHERE machine_id = :machine AND characteristic_id = :characteristic AND zone = '{Zone.PROBE_FAULT.value}'
        AND sequence > f.block << {BASE_LEVEL} AND sequence <= (f.block + 1) << {BASE_LEVEL} OFFSET 0
) r WHERE f.level = {BASE_LEVEL}
UNION
SELECT r.sequence, r.deviation FROM exclusion e JOIN reading r USING (machine_id, characteristic_id, sequence)
WHERE e.machine_id = :machine AND e.characteristic_id = :characteristic AND e.sequence BETWEEN :first AND :last
ORDER BY 1
"""  # noqa: S608 - made of constants


def means_of(session: Session, characteristic: Characteristic, blocks: Sequence[Block]) -> list[Mean]:
    """The mean of each of these blocks, ascending: their sums are the record, and hold what no statistic counts."""
    if not blocks:
        return []
    faulty = [block for block in blocks if block.zones[FAULT]]
    rows = session.execute(
        text(_LEFT_OUT),
        {
            "machine": characteristic.machine_id,
            "characteristic": characteristic.id,
            "levels": [block.level for block in faulty],
            "blocks": [block.block for block in faulty],
            "first": blocks[0].first,
            "last": blocks[-1].last,
        },
    ).all()
    sequences = [row.sequence for row in rows]
    means = []
    for block in blocks:
        low, high = bisect_left(sequences, block.first), bisect_right(sequences, block.last)
        measured = block.count - (high - low)
        rest = fsum([block.sum, *(-row.deviation for row in rows[low:high])])
        means.append(Mean(rest / measured if measured else None, high - low))
    return means


@dataclass(frozen=True)
class Cover:
    """Blocks that lie wholly in what was asked for, and the runs whose readings must be looked at one by one."""

    blocks: list[Block]
    runs: list[Run]


def cover_of(
    session: Session,
    characteristic: Characteristic,
    first: int,
    last: int,
    period: Period = ALWAYS,
    *,
    without: Sequence[int] = (),
    settles: Callable[[Block], bool] = lambda _block: True,
) -> Cover:
    """Walk down the pyramid over the sequences first … last, measured in the period.

    A block counts as a whole if it lies inside, holds none of the sequences `without` (ascending), and `settles` what is
    asked; otherwise its four parts are looked at, at last the readings themselves.
    """
    blocks: list[Block] = []
    numbers: list[int] = list(range((first - 1) >> TOP_LEVEL, ((last - 1) >> TOP_LEVEL) + 1)) if last >= first else []
    for level in range(TOP_LEVEL, BASE_LEVEL - 1, -FAN):
        descend: set[int] = set()
        whole: list[int] = []
        for number in numbers:
            inside = first <= (number << level) + 1 and (number + 1) << level <= last
            clean = not _any_between(without, (number << level) + 1, (number + 1) << level)
            if period.bounded or (inside and clean):
                whole.append(number)
            else:
                descend.add(number)
        there = {block.block: block for block in blocks_of(session, characteristic, level, whole)}
        for number in whole:
            block = there.get(number)
            if block is None:
                descend.add(number)
            elif not period.touches(block.first_at, block.last_at):
                continue
            elif (
                first <= block.first
                and block.last <= last
                and period.covers(block.first_at, block.last_at)
                and not _any_between(without, block.first, block.last)
                and settles(block)
            ):
                blocks.append(block)
            else:
                descend.add(number)
        if level > BASE_LEVEL:
            numbers = [
                part
                for number in sorted(descend)
                for part in range(number << FAN, (number + 1) << FAN)
                if (part << (level - FAN)) < last and (part + 1) << (level - FAN) >= first
            ]
        else:
            numbers = sorted(descend)
    runs = ((max(first, (n << BASE_LEVEL) + 1), min(last, (n + 1) << BASE_LEVEL)) for n in numbers)
    return Cover(blocks, joined(runs))


def joined(runs: Iterable[Run]) -> list[Run]:
    """Ascending runs, those that touch made one.

    >>> joined([(1, 32), (33, 64), (97, 100)])
    [(1, 64), (97, 100)]
    """
    runs_joined: list[Run] = []
    for first, last in runs:
        if runs_joined and runs_joined[-1][1] + 1 >= first:
            runs_joined[-1] = (runs_joined[-1][0], max(runs_joined[-1][1], last))
        else:
            runs_joined.append((first, last))
    return runs_joined


def _any_between(ascending: Sequence[int], low: int, high: int) -> bool:
    at = bisect_left(ascending, low)
    return at < len(ascending) and ascending[at] <= high
