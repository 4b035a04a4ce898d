"""Data of the chart and the table of compared series. Never writes."""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

from sqlalchemy.orm import Session

from app.charts import Chart
from app.core.decision.limits import Zone
from app.loop.summaries import queries as statistics
from app.loop.summaries.queries import Numbers
from app.loop.timeline import queries as timeline
from app.loop.timeline.figures import Event, span_of
from app.quality.capability.queries import Judgement, judgement_of
from app.views.characteristic.wording import reading_link
from app.views.compare.figures import Course
from app.views.compare.series import Compared

MOST_JUDGED = 20_000  # readings of a series of which an index is worked out at once


class Row(NamedTuple):
    """The statistics of one series; of very many readings no index is worked out here."""

    compared: Compared
    numbers: Numbers
    judgement: Judgement | None


def course_of(session: Session, compared: Compared, *, in_time: bool) -> Course:
    """The readings of a series for its chart; of more than can be drawn, blocks with their extremes."""
    current, window = compared.current, compared.window
    key = current.characteristic.key
    course = statistics.chart_data_of(session, current.characteristic, window) if window.count else None
    blocks = list(zip(course.blocks, course.means, strict=True)) if course else []
    readings = [
        one
        for one in (course.readings if course else [])
        if course and one.sequence not in course.excluded and one.zone != Zone.PROBE_FAULT.value
    ]

    def places() -> Iterator[int]:
        for block, _mean in blocks:
            yield (block.first + block.last) // 2 - window.first + 1
        for one in readings:
            yield one.sequence - window.first + 1

    moments = [block.first_at + (block.last_at - block.first_at) / 2 for block, _mean in blocks] + [
        one.measured_at for one in readings
    ]
    deviations = [one.deviation for one in readings]
    means: list[float | None] = [mean.value for _block, mean in blocks]
    return Course(
        compared.name,
        current.parameters.half,
        moments if in_time else list(places()),
        [*means, *deviations],
        [block.minimum for block, _mean in blocks] + deviations,
        [block.maximum for block, _mean in blocks] + deviations,
        [f"/characteristics/{key}?first={block.first}&through={block.last}" for block, _mean in blocks]
        + [reading_link(key, one.sequence) for one in readings],
        current.parameters.natural_limit,
    )


def events_of(session: Session, compared: Compared, chart: Chart, *, in_time: bool) -> list[Event]:
    """Events of a series on the chart of all of them, each with the name of its series."""
    current, window = compared.current, compared.window
    span = span_of(chart)
    if span is None or not window.count:
        return []
    if in_time:
        events = timeline.events_over_time(session, current, window.first, window.last)
    else:
        events = [
            replace(event, at=event.at - window.first + 1)
            for event in timeline.events_by_reading(session, current, window.first, window.last)
            if isinstance(event.at, int)
        ]
    return [replace(event, text=f"{compared.name}: {event.text}") for event in events]


def row_of(session: Session, compared: Compared) -> Row:
    """The statistics of a series."""
    current, window = compared.current, compared.window
    numbers = statistics.numbers_of(session, current.characteristic, window)
    judged = judgement_of(session, current, window) if 0 < window.count <= MOST_JUDGED else None
    return Row(compared, numbers, judged)
