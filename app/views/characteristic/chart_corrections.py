"""Corrections of a characteristic below its zone chart, and the tool changes that begin their sum again. Never writes."""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import func, select, text
from sqlalchemy.orm import Session

from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries import queries as statistics
from app.loop.summaries.queries import ChartData, Window
from app.loop.tables.tools import OPEN, Correction, ToolEvent
from app.views.characteristic.figures import Step
from app.views.characteristic.figures.lanes import COUNTED
from app.views.characteristic.wording import reading_link

MOST_STEPS = 500
MOST_SAMPLED = 200  # of more corrections than that, this many are shown, evenly spread
MOST_BEFORE = 5_000  # corrections of a tool's life that are added up to where the chart begins
MOST_CHANGES = 100
MOST_MOMENTS = 200


@dataclass(frozen=True)
class Change:
    """The tool was changed, or its offset edited by hand."""

    at: datetime
    kind: str
    offset_after: float
    sequence: int


def changes_of(session: Session, current: CurrentCharacteristic, course: ChartData, window: Window) -> list[Change]:
    """Changes and edits of the tool, oldest first, each at the first reading that came after it.

    One that came before the window is kept as well, at the reading before it: from there the corrections are summed.
    """
    number = current.parameters.tool_memory
    if not number or not window.count:
        return []
    rows = session.execute(
        select(ToolEvent.at, ToolEvent.kind, ToolEvent.offset_after)
        .where(ToolEvent.machine_id == current.machine.id, ToolEvent.number == number, ToolEvent.kind != "correction")
        .order_by(ToolEvent.id.desc())
        .limit(MOST_CHANGES)
    ).all()
    if not rows:
        return []
    moments = [(reading.sequence, reading.received_at) for reading in course.readings]
    if course.blocks:
        step = -(-len(course.blocks) // MOST_MOMENTS)
        sampled = [course.blocks[0].first, *(block.last for block in course.blocks[::step])]
        moments = sorted(statistics.moments_of(session, current.characteristic, sampled) + moments)
    arrivals = [at for _sequence, at in moments]
    changes = []
    for at, kind, offset_after in reversed(rows):
        place = bisect_right(arrivals, at)
        if place < len(moments):
            sequence = moments[place][0] if place else window.first - 1
        elif window.reaches_now:
            sequence = window.last + 1
        else:
            continue
        changes.append(Change(at, kind, offset_after, sequence))
    return changes


def steps_of(session: Session, current: CurrentCharacteristic, window: Window, changes: Sequence[Change]) -> list[Step]:
    """The corrections of these readings; of too many, some spread evenly, the newest, and those that are open."""
    if not window.count:
        return []
    query = (
        select(
            Correction.sequence, Correction.number, Correction.amount, Correction.status,
            Correction.offset_after, Correction.applied_at,
        )
        .where(
            Correction.machine_id == current.machine.id,
            Correction.characteristic_id == current.characteristic.id,
            Correction.sequence.between(window.first, window.last),
        )
        .order_by(Correction.sequence.desc())
    )  # fmt: skip
    key = current.characteristic.key
    rows = session.execute(query.limit(MOST_STEPS + 1)).all()
    if len(rows) <= MOST_STEPS:
        return [
            Step(sequence, number, amount, status, reading_link(key, sequence))
            for sequence, number, amount, status, _offset, _at in reversed(rows)
        ]
    newest = rows[:20]
    tool_memory = current.parameters.tool_memory
    still_open = session.execute(
        query.where(Correction.status.in_(OPEN), Correction.tool_memory == tool_memory).limit(MOST_STEPS)
    ).all()
    sampled = session.execute(
        text(_SAMPLE),
        {
            "machine": current.machine.id,
            "characteristic": current.characteristic.id,
            "tool": tool_memory,
            "first": window.first,
            "last": window.last,
            "stride": max(1, window.count // MOST_SAMPLED),
        },
    ).all()
    steps = sorted({row[:2]: tuple(row) for row in (*sampled, *still_open, *newest)}.values())
    return _with_totals(key, steps, [change for change in changes if change.kind == "change"])


def corrections_of(session: Session, current: CurrentCharacteristic, course: ChartData) -> int:
    """The number of corrections that these readings caused; those of blocks are counted already."""
    counted = sum(block.corrections for block in course.blocks)
    if not course.readings:
        return counted
    query = select(func.count()).where(
        Correction.machine_id == current.machine.id,
        Correction.characteristic_id == current.characteristic.id,
        Correction.sequence.in_([reading.sequence for reading in course.readings]),
    )
    return counted + (session.scalar(query) or 0)


_SAMPLE = """
SELECT c.sequence, c.number, c.amount, c.status, c.offset_after, c.applied_at
FROM generate_series(CAST(:first AS bigint), CAST(:last AS bigint), CAST(:stride AS bigint)) AS place(sequence)
CROSS JOIN LATERAL (
    SELECT * FROM correction
    WHERE machine_id = :machine AND characteristic_id = :characteristic AND sequence >= place.sequence
        AND sequence < place.sequence + :stride AND sequence <= :last AND status = 'applied' AND tool_memory = :tool
    ORDER BY machine_id, characteristic_id, sequence LIMIT 1
) c
"""


def _with_totals(
    key: str, rows: Sequence[tuple[int, int, float, str, float | None, datetime | None]], changes: Sequence[Change]
) -> list[Step]:
    """Add to each correction the sum since the tool change: from the offset after it, for rows between may be left out."""
    at_changes = [change.at for change in changes]
    begin = next((offset - amount for _s, _n, amount, _status, offset, _at in rows if offset is not None), 0.0)
    steps, total = [], 0.0
    for sequence, number, amount, status, offset_after, applied_at in rows:
        if offset_after is not None and applied_at is not None:
            place = bisect_right(at_changes, applied_at)
            total = offset_after - (changes[place - 1].offset_after if place else begin)
        elif status in COUNTED:
            total += amount
        steps.append(Step(sequence, number, amount, status, reading_link(key, sequence), total))
    return steps


def total_before(session: Session, current: CurrentCharacteristic, window: Window, changes: Sequence[Change]) -> float:
    """The sum of this characteristic's corrections from the last tool change to where the chart begins, mm."""
    begun = max(
        (change.at for change in changes if change.kind == "change" and change.sequence < window.first), default=None
    )
    query = (
        select(Correction.amount, Correction.created_at)
        .where(
            Correction.machine_id == current.machine.id,
            Correction.characteristic_id == current.characteristic.id,
            Correction.sequence < window.first,
            Correction.status.in_(sorted(COUNTED)),
        )
        .order_by(Correction.sequence.desc())
    )
    total = 0.0
    for page in range(MOST_BEFORE // MOST_STEPS):
        rows = session.execute(query.limit(MOST_STEPS).offset(page * MOST_STEPS)).all()
        of_this_life = [amount for amount, created_at in rows if begun is None or created_at > begun]
        total += sum(of_this_life)
        if len(of_this_life) < MOST_STEPS:
            break
    return total
