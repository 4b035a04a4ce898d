"""Everything that is read for the charts of one characteristic. Never writes.

Beside the readings there are corrections and events. Of each no more are read than can be distinguished on a chart, by an
index, however many there are.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from sqlalchemy.orm import Session

from app import charts
from app.core.context import Chosen, ContextField
from app.core.decision.limits import Zone, classify
from app.core.temperature import AtReference, at_reference
from app.language.formatting import grouped
from app.language.i18n import _
from app.loop.characteristics.queries import CurrentCharacteristic, parameters_of
from app.loop.expansion.queries import expansion_of, temperatures_between
from app.loop.readings import queries as readings
from app.loop.readings.wording import field_word
from app.loop.summaries import queries as statistics
from app.loop.summaries.queries import ChartData, ChartReading, Window
from app.loop.summaries.wording import context_words
from app.loop.tables.tools import AverageMemory
from app.loop.timeline import queries as timeline
from app.loop.timeline.figures import Event
from app.views.characteristic.chart_corrections import changes_of, corrections_of, steps_of, total_before
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
from app.views.characteristic.wording import reading_link

MOST_BY_HAND = 200


@dataclass(frozen=True)
class Chart:
    """Content of the zone chart. left_out: words about what is not drawn, and how many there are."""

    blocks: list[Block]
    points: list[Point]
    steps: list[Step]
    events: list[Event]
    hands: list[HandPoint]
    total_before: float
    sizes: SizeAxis
    left_out: list[str]


def chart_of(session: Session, current: CurrentCharacteristic, window: Window) -> Chart:
    """The zone chart of these readings: each in the zone where it lies, by the limits of now.

    In which zone it was decided may differ (corrections not yet in effect, other limits then); its own page says so.
    """
    parameters, key = current.parameters, current.characteristic.key
    course = statistics.chart_data_of(session, current.characteristic, window)
    has_memory = parameters.average_memory > 0
    targets = _targets(session, current, course.readings)
    changes = changes_of(session, current, course, window)
    before = total_before(session, current, window, changes) if window.count else 0.0
    steps, hands = steps_of(session, current, window, changes), _hands(session, current, window)
    if window.context:
        shown = {reading.sequence for reading in course.readings}
        hands = [hand for hand in hands if hand.sequence in shown]
    return Chart(
        blocks=_blocks(key, course, with_average=has_memory),
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
        steps=steps,
        events=timeline.events_by_reading(session, current, window.first, window.last) if window.count else [],
        hands=hands,
        total_before=before,
        sizes=_size_axis(session, current, course),
        left_out=_left_out(session, current, course, steps, hands),
    )


def at_20_of(session: Session, current: CurrentCharacteristic, points: Sequence[Point]) -> dict[int, float]:
    """Deviations at 20 °C (mm) of these readings, of those that have one, by their numbers."""
    expansion = expansion_of(session, current.machine.id, current.characteristic.id)
    if expansion.coefficient is None or not points:
        return {}
    known = temperatures_between(session, current.characteristic, points[0].sequence, points[-1].sequence)
    found = {
        point.sequence: (point, at_reference(point.size, *known[point.sequence], expansion))
        for point in points
        if point.sequence in known and point.size is not None and point.zone != Zone.PROBE_FAULT
    }
    return {
        sequence: round(point.deviation + at.correction, 9)
        for sequence, (point, at) in found.items()
        if isinstance(at, AtReference)
    }


def _left_out(
    session: Session,
    current: CurrentCharacteristic,
    course: ChartData,
    steps: Sequence[Step],
    hands: Sequence[HandPoint],
) -> list[str]:
    """Words about what is too much to be drawn: how much of it is."""
    words = []
    if any(step.total is not None for step in steps):  # they are a sample
        corrections = corrections_of(session, current, course)
        words.append(_("{n} of {all} corrections").format(n=grouped(len(steps)), all=grouped(corrections)))
    if len(hands) >= MOST_BY_HAND:
        words.append(_("the newest {n} measurements by hand").format(n=MOST_BY_HAND))
    return words


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


def _blocks(key: str, course: ChartData, *, with_average: bool = False) -> list[Block]:
    return [
        Block(
            block.first,
            block.last,
            block.minimum,
            block.maximum,
            mean.value,
            block.average if with_average else None,
            f"/characteristics/{key}?first={block.first}&through={block.last}",
            mean.left_out,
            block.middle_at,
        )
        for block, mean in zip(course.blocks, course.means, strict=True)
    ]


def distinguished(
    session: Session,
    current: CurrentCharacteristic,
    figure: charts.Chart,
    meta: str,
    sequences: Sequence[int],
    by: ContextField,
) -> charts.Chart:
    """The figure with its single readings in the look of their order, nest …; blocks of many have none."""
    ascending = np.array(sorted(sequences), np.int64)
    strata = statistics.strata_of(session, current.characteristic, by, ascending)
    labels = dict(zip(ascending.tolist(), strata.labels.tolist(), strict=True))
    names = [f"{field_word(by)} {name}" for name in strata.names]
    drawn = charts.distinguished(figure, meta, [labels[sequence] for sequence in sequences], names)
    return drawn if sequences else said(drawn, _("too many readings to tell them apart"))


def said(figure: charts.Chart, *words: str) -> charts.Chart:
    """The figure with these words after the title of its axis."""
    return replace(figure, x=replace(figure.x, title=" · ".join([figure.x.title, *words])))


def only(figure: charts.Chart, context: Chosen) -> charts.Chart:
    """The figure with the context that its readings have, if one was chosen."""
    return said(figure, _("only {context}").format(context=context_words(context))) if context else figure


class Run(NamedTuple):
    """Sizes over time: blocks of a long history, by time; what is newer one by one."""

    blocks: list[Block]
    points: list[RunPoint]
    sizes: SizeAxis


def run_of(session: Session, current: CurrentCharacteristic, window: Window) -> Run:
    """The sizes of these readings over time."""
    key = current.characteristic.key
    course = statistics.chart_data_of(session, current.characteristic, window)
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
    blocks = sorted(_blocks(key, course), key=lambda block: (block.at, block.first))
    return Run(
        blocks, sorted(points, key=lambda point: (point.at, point.sequence)), _size_axis(session, current, course)
    )


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
