"""The readings of a characteristic as `app.core.affected` asks for them: when cut, by which edge, with which offset. Never writes."""

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from datetime import datetime
from functools import partial
from math import inf, nextafter
from typing import Any, NamedTuple

from sqlalchemy import Row, select
from sqlalchemy.orm import Session

from app.core.affected import Cut, verdict_of
from app.core.decision.limits import Zone
from app.core.decision.step import Code, rounded
from app.core.parameters import Parameters
from app.loop.alarms.reading_kinds import PROBE_FAULT
from app.loop.characteristics.queries import parameters_of
from app.loop.readings.by_hand import queries as by_hand
from app.loop.tables.alarms import Alarm
from app.loop.tables.readings import Exclusion, HandMeasurement, Reading, ReadingContext, ReadingResults
from app.loop.tables.tools import Correction, Tool, ToolEvent
from app.loop.tools.alarm_kinds import CORRECTIONS_NOT_TAKEN

MOST = 5_000
"""Readings that are looked at before and after an alarm."""


class Doubt(NamedTuple):
    """The doubt about parts. guard: measuring uncertainty, mm; by_hand_only: readings of the probe vouch for nothing."""

    guard: float = 0.0
    by_hand_only: bool = False


class Known(NamedTuple):
    """All that is known of the part of a reading."""

    sequence: int
    cut_at: datetime
    tool: int
    offset: float | None
    without: tuple[int, ...]
    deviation: float
    measured: float
    part: str | None
    order: str | None
    found: str
    received_at: datetime


class History(NamedTuple):
    """Cuts, what is known of each by its number, and whether readings before them were not looked at."""

    cuts: list[Cut]
    known: dict[int, Known]
    cut_short: bool


class _Tool:
    """The edges and offsets of one tool, by the server's clock."""

    def __init__(self, session: Session, machine_id: int, number: int) -> None:
        rows = session.execute(
            select(ToolEvent.at, ToolEvent.kind, ToolEvent.offset_after, ToolEvent.offset_before, Correction.amount)
            .outerjoin(
                Correction,
                (Correction.machine_id == ToolEvent.machine_id) & (Correction.number == ToolEvent.correction),
            )
            .where(ToolEvent.machine_id == machine_id, ToolEvent.number == number)
            .order_by(ToolEvent.id)
        ).all()
        self.changes = [row.at for row in rows if row.kind == "change"]
        self.times = [row.at for row in rows]
        self.offsets: list[tuple[float, float]] = []  # after each event: the offset, and the sum of corrections in it
        total = 0.0
        for row in rows:
            total = 0.0 if row.kind == "change" else rounded(total + (row.amount or 0.0))
            self.offsets.append((row.offset_after, total))
        self.begin: float | None = rows[0].offset_before if rows else None
        if not rows:  # it has never changed
            self.begin = session.scalar(select(Tool.offset).where(Tool.machine_id == machine_id, Tool.number == number))

    def edge(self, at: datetime) -> int:
        return bisect_right(self.changes, at)

    def offset(self, received_at: datetime, compensated: float | None) -> float | None:
        """The offset of a part that was cut with so much of the corrections; None where it is not known."""
        if compensated is None:
            return None
        place = bisect_right(self.times, received_at) - 1
        if place < 0:
            return None if self.begin is None else rounded(self.begin + compensated)
        offset, total = self.offsets[place]
        return rounded(offset - total + compensated)


def window_of(session: Session, alarm: Alarm, characteristic_id: int) -> tuple[int, int]:
    """The readings (first, last) that are looked at."""
    first, last = alarm.sequence, alarm.last_sequence or alarm.sequence
    if first is None or alarm.characteristic_id is None:
        first = last = session.scalar(
            select(Reading.sequence)
            .where(
                Reading.machine_id == alarm.machine_id,
                Reading.characteristic_id == characteristic_id,
                Reading.received_at <= alarm.raised_at,
            )
            .order_by(Reading.sequence.desc())
            .limit(1)
        )
    return max(1, (first or 1) - MOST), (last or 1) + MOST


def history_of(session: Session, alarm: Alarm, characteristic_id: int, doubt: Doubt) -> History:
    """The readings of a characteristic about an alarm."""
    first, last = window_of(session, alarm, characteristic_id)
    rows = _rows(session, alarm.machine_id, characteristic_id, first, last)
    hand = by_hand.of_readings(
        session, alarm.machine_id, characteristic_id, _measured(session, alarm, characteristic_id, first, last)
    )
    faults = _faults(session, alarm.machine_id, {row.paused_by for row in rows} - {None})
    parameters: dict[int, Parameters] = {}
    tools: dict[int, _Tool] = {}
    cuts: list[Cut] = []
    known: dict[int, Known] = {}
    for row in rows:
        version = row.parameters_version
        if version not in parameters:
            parameters[version] = parameters_of(session, alarm.machine_id, characteristic_id, version)
        number = parameters[version].tool_memory
        if number not in tools:
            tools[number] = _Tool(session, alarm.machine_id, number)
        judge = partial(_verdict, row, parameters[version], hand.get(row.sequence, ()), faults)
        found, measured = judge(Doubt(doubt.guard)), row.machined_at or row.measured_at
        cuts.append(
            Cut(
                row.sequence,
                measured.timestamp(),
                None if doubt.by_hand_only else (number, _edge(row, tools[number])),
                judge(doubt),
                _behind(alarm, row, number),
                row.part,
                row.order,
            )
        )
        known[row.sequence] = Known(
            row.sequence, measured, number, tools[number].offset(row.received_at, row.compensated),
            tuple(row.outstanding or ()), row.deviation, row.measured, row.part, row.order,
            {True: "good", False: "bad", None: "unknown"}[found], row.received_at,
        )  # fmt: skip
    if not any(cut.behind for cut in cuts):
        cuts.append(_moment(session, alarm, rows, tools, doubt))
    return History(cuts, known, cut_short=first > 1)


def _rows(session: Session, machine_id: int, characteristic_id: int, first: int, last: int) -> Sequence[Any]:
    def beside(table: Any) -> Any:
        return (
            (table.machine_id == Reading.machine_id)
            & (table.characteristic_id == Reading.characteristic_id)
            & (table.sequence == Reading.sequence)
        )

    columns = ("sequence", "deviation", "measured", "measured_at", "machined_at", "received_at", "parameters_version",
               "paused_by", "zone", "code", "part", "outstanding", "alarms", "compensated")  # fmt: skip
    query = (
        select(
            *(getattr(Reading, name) for name in columns),
            Exclusion.sequence.is_not(None).label("excluded"),
            ReadingResults.rejected,
            ReadingContext.context["order"].astext.label("order"),
        )
        .outerjoin(Exclusion, beside(Exclusion))
        .outerjoin(ReadingResults, beside(ReadingResults))
        .outerjoin(ReadingContext, beside(ReadingContext))
        .where(
            Reading.machine_id == machine_id,
            Reading.characteristic_id == characteristic_id,
            Reading.sequence.between(first, last),
        )
        .order_by(Reading.sequence)
    )
    return session.execute(query).all()


def _measured(session: Session, alarm: Alarm, characteristic_id: int, first: int, last: int) -> Sequence[int]:
    """Readings whose parts were measured by hand too."""
    return session.scalars(
        select(HandMeasurement.sequence)
        .where(
            HandMeasurement.machine_id == alarm.machine_id,
            HandMeasurement.characteristic_id == characteristic_id,
            HandMeasurement.sequence.between(first, last),
        )
        .distinct()
    ).all()


def _faults(session: Session, machine_id: int, alarms: set[int]) -> frozenset[int]:
    """Those of these alarms that are faults of the probe."""
    if not alarms:
        return frozenset()
    query = select(Alarm.id).where(Alarm.machine_id == machine_id, Alarm.id.in_(alarms), Alarm.kind == PROBE_FAULT.name)
    return frozenset(session.scalars(query))


def _verdict(
    row: Row[Any], parameters: Parameters, hand: Sequence[HandMeasurement], faults: frozenset[int], doubt: Doubt
) -> bool | None:
    of_hand = None
    if hand:  # the latest counts
        size = hand[-1].measured
        of_hand = hand[-1].good is not False
        if size is not None:
            inside = verdict_of(rounded(size - parameters.target), parameters.tolerance, doubt.guard)
            of_hand = of_hand and bool(inside)
    doubted = (
        doubt.by_hand_only
        or row.excluded
        or row.zone == Zone.PROBE_FAULT
        or row.code == Code.IMPLAUSIBLE
        or row.paused_by in faults
    )
    return verdict_of(
        row.deviation,
        parameters.tolerance,
        doubt.guard,
        doubted=doubted,
        rejected=bool(row.rejected),
        by_hand=of_hand,
    )


def _edge(row: Row[Any], tool: _Tool) -> int:
    """The edge as the loop has counted the part: by when it was cut where that was said, else by when its reading came."""
    if row.machined_at is not None:
        return tool.edge(row.machined_at)
    if row.code == Code.IMPORTED:
        return tool.edge(row.measured_at)
    edge = tool.edge(row.received_at)
    return max(0, edge - 1) if row.code == Code.BEFORE_TOOL_CHANGE else edge


def _behind(alarm: Alarm, row: Row[Any], tool: int) -> bool:
    if alarm.id in (row.alarms or ()):
        return True
    first: Any = alarm.data.get("first") if alarm.kind == CORRECTIONS_NOT_TAKEN.name else None
    return isinstance(first, int) and tool == alarm.tool_memory and any(one >= first for one in row.outstanding or ())


def _moment(session: Session, alarm: Alarm, rows: Sequence[Row[Any]], tools: Mapping[int, _Tool], doubt: Doubt) -> Cut:
    """An alarm that no reading of the characteristic has raised: behind all readings that had come before it."""
    before = [row for row in rows if row.received_at <= alarm.raised_at]
    at = max(((row.machined_at or row.measured_at).timestamp() for row in before), default=-inf)
    number = alarm.tool_memory or 0
    tool = tools.get(number) or _Tool(session, alarm.machine_id, number)
    life = None if doubt.by_hand_only else (number, tool.edge(alarm.raised_at))
    return Cut(0, nextafter(at, inf), life, None, behind=True)
