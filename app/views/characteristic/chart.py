"""Everything that is read for the charts of one characteristic. Never writes.

Beside the readings there are corrections and events. Of each no more are read than can be distinguished on a chart, by an
index, however many there are.
"""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime

from sqlalchemy import select, text
from sqlalchemy.orm import Session

from app.core.decision.limits import classify
from app.loop.characteristics.queries import CurrentCharacteristic, parameters_of
from app.loop.readings import queries as readings
from app.loop.summaries import queries as statistics
from app.loop.summaries.queries import ChartData, ChartReading, Window
from app.loop.tables.tools import OPEN, AverageMemory, Correction, ToolEvent
from app.loop.timeline import queries as timeline
from app.loop.timeline.figures import Event
from app.views.characteristic.figures import (
    Block,
    HandPoint,
    Point,
    ResultPoint,
    ResultRange,
    RunPoint,
    SizeAxis,
    Step,
)
from app.views.characteristic.figures.lanes import COUNTED

MOST_STEPS = 500
MOST_SAMPLED = 200  # of more corrections than that, so many are shown, evenly spread
MOST_BEFORE = 5_000  # corrections of a tool's life that are added up to where the chart begins
MOST_CHANGES = 100
MOST_MOMENTS = 200
MOST_RUN = 2_000
MOST_BY_HAND = 200


@dataclass(frozen=True)
class Chart:
    """Content of the zone chart."""

    blocks: list[Block]
    points: list[Point]
    steps: list[Step]
    events: list[Event]
    hands: list[HandPoint]
    total_before: float
    sizes: SizeAxis


@dataclass(frozen=True)
class _Change:
    """The tool was changed, or its offset edited by hand."""

    at: datetime
    kind: str
    offset_after: float
    sequence: int


def reading_link(key: str, sequence: int) -> str:
    return f"/characteristics/{key}/readings/{sequence}"


def chart_of(session: Session, current: CurrentCharacteristic, window: Window) -> Chart:
    """The zone chart of these readings: each in the zone where it lies, by the limits of now.

    In which zone it was decided may differ (corrections not yet in effect, other limits then); its own page says so.
    """
    parameters, key = current.parameters, current.characteristic.key
    course = statistics.chart_data_of(session, current.characteristic, window)
    has_memory = parameters.average_memory > 0
    targets = _targets(session, current, course.readings)
    changes = _changes(session, current, course, window)
    before = _total_before(session, current, window, changes) if window.count else 0.0
    return Chart(
        blocks=[
            Block(
                block.first,
                block.last,
                block.minimum,
                block.maximum,
                mean.value,
                block.average if has_memory else None,
                f"/characteristics/{key}?first={block.first}&through={block.last}",
                mean.left_out,
            )
            for block, mean in zip(course.blocks, course.means, strict=True)
        ],
        points=[
            Point(
                reading.sequence,
                reading.deviation,
                classify(reading.deviation, parameters.limits),
                reading.average_after if has_memory else None,
                reading.measured_at,
                reading.sequence in course.excluded,
                reading_link(key, reading.sequence),
                size=_size(reading, targets),
                measured=reading.measured,
            )
            for reading in course.readings
        ],
        steps=_steps(session, current, window, changes),
        events=timeline.events_by_reading(session, current, window.first, window.last) if window.count else [],
        hands=_hands(session, current, window),
        total_before=before,
        sizes=_size_axis(session, current, course),
    )


def _hands(session: Session, current: CurrentCharacteristic, window: Window) -> list[HandPoint]:
    """Deviations measured by hand, against the target: a hand gauge needs no empirical value."""
    measurements = readings.hand_measurements(
        session, current.machine.id, current.characteristic.id, window.first, window.last, MOST_BY_HAND
    )
    target, key = current.parameters.target, current.characteristic.key
    return [
        HandPoint(
            measurement.sequence,
            measurement.measured - target,
            measurement.good,
            measurement.actor,
            reading_link(key, measurement.sequence),
        )
        for measurement in measurements
        if measurement.measured is not None
    ]


def run_of(session: Session, current: CurrentCharacteristic, window: Window) -> tuple[list[RunPoint], SizeAxis]:
    """The sizes of these readings, and their axis; of very many the last ones."""
    key = current.characteristic.key
    first = max(window.first, window.last - MOST_RUN + 1)
    course = statistics.chart_data_of(session, current.characteristic, replace(window, first=first))
    parameters, targets = current.parameters, _targets(session, current, course.readings)
    points = [
        RunPoint(
            reading.sequence,
            reading.measured_at,
            reading.deviation,
            classify(reading.deviation, parameters.limits),
            reading.sequence in course.excluded,
            reading_link(key, reading.sequence),
            size=_size(reading, targets),
            measured=reading.measured,
        )
        for reading in course.readings
    ]
    return points, _size_axis(session, current, course)


def _targets(session: Session, current: CurrentCharacteristic, drawn: Sequence[ChartReading]) -> dict[int, float]:
    """The targets (mm) that these readings were judged by, by the version of the parameters."""
    machine_id, characteristic_id = current.machine.id, current.characteristic.id
    return {
        version: parameters_of(session, machine_id, characteristic_id, version).target
        for version in {reading.parameters_version for reading in drawn}
    }


def _size(reading: ChartReading, targets: dict[int, float]) -> float:
    """The corrected size of a reading, mm: its deviation about its own target."""
    return round(targets[reading.parameters_version] + reading.deviation, 9)


def _size_axis(session: Session, current: CurrentCharacteristic, course: ChartData) -> SizeAxis:
    """The axis of these readings; of those in blocks the ends of each block tell the empirical value and the target."""
    drawn_readings = list(course.readings)
    if course.blocks:
        ends = [course.blocks[0].first, *(block.last for block in course.blocks)]
        drawn_readings = sorted([*statistics.single_readings(session, current.characteristic, ends), *drawn_readings])
    targets, now = _targets(session, current, drawn_readings), current.parameters.target
    values = dict.fromkeys(round(reading.measured - _size(reading, targets), 9) for reading in drawn_readings)
    return SizeAxis(
        now, tuple(values) or (empirical_value_of(session, current),), any(at != now for at in targets.values())
    )


def empirical_value_of(session: Session, current: CurrentCharacteristic) -> float:
    """EV of the memory location that this characteristic names, mm; 0 without one."""
    location = current.parameters.average_memory
    memory = session.get(AverageMemory, (current.machine.id, location)) if location else None
    return memory.empirical_value if memory else 0.0


def _changes(session: Session, current: CurrentCharacteristic, course: ChartData, window: Window) -> list[_Change]:
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
        changes.append(_Change(at, kind, offset_after, sequence))
    return changes


def _steps(session: Session, current: CurrentCharacteristic, window: Window, changes: Sequence[_Change]) -> list[Step]:
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
    key: str, rows: Sequence[tuple[int, int, float, str, float | None, datetime | None]], changes: Sequence[_Change]
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


def _total_before(
    session: Session, current: CurrentCharacteristic, window: Window, changes: Sequence[_Change]
) -> float:
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


def results_of(
    session: Session, current: CurrentCharacteristic, window: Window, name: str
) -> tuple[list[ResultPoint], list[ResultRange]]:
    """Results of the variant for its chart: single readings, or blocks of very many."""
    course = statistics.results_of(session, current.characteristic, window, name)
    key = current.characteristic.key
    return (
        [
            ResultPoint(
                result.sequence, result.value, result.sequence in course.excluded, reading_link(key, result.sequence)
            )
            for result in course.results
        ],
        [
            ResultRange(*block, f"/characteristics/{key}?first={block.first}&through={block.last}&result={name}")
            for block in course.blocks
        ],
    )
