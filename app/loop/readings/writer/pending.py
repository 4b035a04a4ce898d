"""Writes of the readings of one transaction: decided readings, and the rows that move with them.

`PendingWrites` begins on a `Snapshot`, which it never changes. A reading takes what it moves out of the snapshot into an
object of its own here, the next readings find it moved, and only the end of a committed transaction makes it the next
snapshot (`settle`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, NamedTuple

from msgspec import structs

from app.core.clock import FEWEST
from app.core.decision.decide import Decision
from app.core.decision.limits import Zone
from app.core.opposite_effect import LONGEST
from app.core.parameters import Parameters
from app.core.variants import Results
from app.loop.readings.records import Entry, Record
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.snapshot import (
    MOST_APPLIED,
    MOST_NAMED,
    Arrival,
    LoadedAverage,
    LoadedCorrection,
    LoadedPlan,
    LoadedStream,
    LoadedTool,
    NamedCorrection,
    Part,
    Snapshot,
)
from app.loop.tables.tools import FELL, OPEN


@dataclass(slots=True, kw_only=True)
class PendingAlarm:
    """An alarm that these readings raise. `save` learns if it is active already, or draws a number for it."""

    machine_id: int
    characteristic_id: int | None
    tool_memory: int | None
    kind: str
    id: int | None = None
    sequence: int | None = None
    last_sequence: int | None = None
    count: int = 0  # readings that raised it now
    last_at: datetime | None = None  # when they were received
    new: bool = True
    data: dict[str, Any] = field(default_factory=dict)


def alarm_number(alarm: int | PendingAlarm | None) -> int | None:
    """Return the number of an alarm, one that these readings raise included, which has it when they are saved."""
    return alarm.id if isinstance(alarm, PendingAlarm) else alarm


@dataclass(slots=True, kw_only=True)
class PendingCorrection:
    """A correction that these readings issue (`new`), or change. mm."""

    machine_id: int
    number: int
    tool_memory: int
    amount: float
    status: str
    characteristic_id: int = 0
    sequence: int = 0
    size_error: float = 0.0
    applied_at: datetime | None = None
    decided_at: datetime | None = None
    fetched_at: datetime | None = None
    issued_at: datetime | None = None
    applied_by: str | None = None
    offset_after: float | None = None
    superseded_by: int | None = None
    reason: str | None = None
    new: bool = False

    def loaded(self) -> LoadedCorrection:
        """Return it as the database holds it after the commit."""
        return LoadedCorrection(**{name: getattr(self, name) for name in LoadedCorrection._fields})


@dataclass(slots=True)
class EffectTally:
    """Corrections of a tool, summed up for parts that name the same correction as the last in effect, or none.

    Made by `corrections_in_effect`. seen: the number of the tool's corrections that are counted. previous_tool: the parts
    were cut before the tool was changed. confirms: a pending correction is among those they were cut with. has_applied: an
    applied one is among those seen. issued: amounts of the open ones. numbers, amounts: of those they were cut without;
    applied_since: amounts of those that are applied by now. Amounts in mm of offset.
    """

    in_effect: int | None
    last: NamedCorrection | None
    seen: int = 0
    previous_tool: bool = False
    confirms: bool = False
    has_applied: bool = False
    issued: list[float] = field(default_factory=list)
    numbers: list[int] = field(default_factory=list)
    amounts: list[float] = field(default_factory=list)
    applied_since: list[float] = field(default_factory=list)


@dataclass(slots=True, kw_only=True)
class PendingTool:
    """A location of the tool memory as these readings move it. mm.

    tallies: worked out of `corrections`. none_held: that many of the first of them are known not to be held.
    """

    machine_id: int
    number: int
    offset: float = 0.0
    total: float = 0.0
    reset_at: datetime | None = None
    set_by_hand: bool = False
    paused_by: int | PendingAlarm | None = None
    untaken: tuple[int, int] | None = None
    corrections: list[LoadedCorrection | PendingCorrection] = field(default_factory=list)
    applied: list[tuple[int, float]] = field(default_factory=list)
    changed: bool = False
    tallies: dict[int | None, EffectTally] = field(default_factory=dict)
    none_held: int = 0

    def forget(self) -> None:
        """Drop what was worked out of the corrections: there are others, or one has another status."""
        self.tallies, self.none_held = {}, 0

    @property
    def not_taken(self) -> int | None:
        """The alarm that the machine does not take its corrections, answered or not, while one of which it spoke still waits."""
        if self.untaken is None:
            return None
        alarm, last = self.untaken
        waits = any(each.status == "pending" and each.number <= last for each in self.corrections)
        return alarm if waits else None

    def changing(self, at: int) -> PendingCorrection:
        """Return the correction at an index, as one that will be written."""
        correction = self.corrections[at]
        if isinstance(correction, LoadedCorrection):
            correction = self.corrections[at] = PendingCorrection(
                machine_id=self.machine_id, tool_memory=self.number, **correction._asdict()
            )
        return correction

    def pause(self, alarm: PendingAlarm) -> None:
        """Correct nothing through this tool until the alarm is answered; open corrections are superseded."""
        self.paused_by, self.changed = alarm, True
        for place, correction in enumerate(self.corrections):
            if correction.status in OPEN:
                self.changing(place).status = "superseded"
        self.forget()

    def give_reasons(self) -> None:
        """Say why corrections fell: the alarm that paused the tool has its number by now."""
        if isinstance(self.paused_by, PendingAlarm):
            for correction in self.written():
                if correction.status == "superseded" and correction.superseded_by is None:
                    correction.reason = f"{FELL[self.paused_by.kind]} {self.paused_by.id}"

    def written(self) -> list[PendingCorrection]:
        """Return the corrections that were issued or changed."""
        return [c for c in self.corrections if isinstance(c, PendingCorrection)]


@dataclass(slots=True, kw_only=True)
class PendingAverage:
    """A location of the average memory as these readings move it. mm."""

    machine_id: int
    location: int
    average: float
    empirical_value: float
    changed: bool = False


@dataclass(slots=True, kw_only=True)
class PendingStream:
    """The running state of one characteristic as these readings move it. start: as it was before them."""

    start: LoadedStream
    entry: Entry
    parameters: Parameters
    sequence: int
    average: PendingAverage | None
    tool: PendingTool | None
    paused_by: int | PendingAlarm | None
    last_measured_at: datetime | None
    level: float | None
    level_sequence: int | None
    parts: list[Part]
    arrivals: list[Arrival]
    level_moved: bool = False
    alarms: dict[str, PendingAlarm] = field(default_factory=dict)
    last: "Verdict | None" = None

    def loaded(self) -> LoadedStream:
        """Return it as the database holds it after the commit."""
        return structs.replace(
            self.start,
            sequence=self.sequence,
            paused_by=alarm_number(self.paused_by),
            last_measured_at=self.last_measured_at,
            level=self.level,
            level_sequence=self.level_sequence,
            parts=self.parts[-LONGEST:],
            arrivals=self.arrivals[-FEWEST:],
        )


@dataclass(slots=True, kw_only=True)
class OffsetChange:
    """A change of a tool offset to be written into its history. mm."""

    machine_id: int
    number: int
    at: datetime
    offset_before: float
    offset_after: float
    correction: int
    actor: str


@dataclass(slots=True)
class PendingWrites:
    """Everything that the readings of one transaction come to.

    streams, tools, averages: taken out of the snapshot so far; `touched` are the streams with new readings. last_correction,
    named, plans: where they differ from the snapshot. column_rows: rows of the table `reading` for binary COPY that were laid out
    of columns, beside the verdicts.
    """

    snapshot: Snapshot
    streams: dict[int, PendingStream] = field(default_factory=dict)
    plans: dict[int, LoadedPlan] = field(default_factory=dict)
    tools: dict[tuple[int, int], PendingTool] = field(default_factory=dict)
    averages: dict[tuple[int, int], PendingAverage] = field(default_factory=dict)
    last_correction: dict[int, int] = field(default_factory=dict)
    named: dict[tuple[int, int], NamedCorrection] = field(default_factory=dict)
    touched: dict[int, PendingStream] = field(default_factory=dict)
    verdicts: "list[Verdict]" = field(default_factory=list)
    by_key: "dict[tuple[int, str], Verdict]" = field(default_factory=dict)
    issued: list[PendingCorrection] = field(default_factory=list)
    raised: list[PendingAlarm] = field(default_factory=list)
    tool_alarms: dict[tuple[int, int, str], PendingAlarm] = field(default_factory=dict)
    offset_changes: list[OffsetChange] = field(default_factory=list)
    touched_machines: set[int] = field(default_factory=set)
    column_rows: Callable[[], memoryview] | None = None

    def stream(self, characteristic_id: int) -> PendingStream:
        """Return the state of a characteristic as the readings before have left it."""
        stream = self.streams.get(characteristic_id)
        if stream is None:
            start = self.snapshot.streams[characteristic_id]
            machine_id = start.entry.machine_id
            stream = self.streams[characteristic_id] = PendingStream(
                start=start,
                entry=start.entry,
                parameters=self.snapshot.parameters[characteristic_id],
                sequence=start.sequence,
                average=None if start.average is None else self._average((machine_id, start.average)),
                tool=None if start.tool is None else self._tool((machine_id, start.tool)),
                paused_by=start.paused_by,
                last_measured_at=start.last_measured_at,
                level=start.level,
                level_sequence=start.level_sequence,
                parts=list(start.parts),
                arrivals=list(start.arrivals),
            )
        return stream

    def _average(self, at: tuple[int, int]) -> PendingAverage:
        average = self.averages.get(at)
        if average is None:
            average = self.averages[at] = PendingAverage(**self.snapshot.averages[at]._asdict())
        return average

    def _tool(self, at: tuple[int, int]) -> PendingTool:
        tool = self.tools.get(at)
        if tool is None:
            start = self.snapshot.tools[at]
            tool = self.tools[at] = PendingTool(
                machine_id=start.machine_id,
                number=start.number,
                offset=start.offset,
                total=start.total,
                reset_at=start.reset_at,
                set_by_hand=start.set_by_hand,
                paused_by=start.paused_by,
                untaken=start.untaken,
                corrections=list(start.corrections),
                applied=list(start.applied),
            )
        return tool

    def measure_next(self, verdict: "Verdict") -> int | None:
        """Return the parts until the next measurement, by the plan in force after this reading; its alarms count from here on."""
        own, plans = verdict.stream.start, self.snapshot.plans
        if verdict.alarms:
            about = [own.entry.characteristic_id]
            if any(
                alarm.characteristic_id is None for alarm in verdict.alarms
            ):  # about the tool, so about all that it cuts
                streams, machine_id = self.snapshot.streams, own.entry.machine_id
                about = [c for c in plans if (streams[c].entry.machine_id, streams[c].tool) == (machine_id, own.tool)]
            for c in plans.keys() & about:
                self.plans[c] = self.plans.get(c, plans[c])._replace(alarmed=self.stream(c).sequence)
        plan = self.plans.get(own.entry.characteristic_id) or plans.get(own.entry.characteristic_id)
        if plan is None:
            return None
        measured = verdict.decision.zone is not Zone.PROBE_FAULT
        return plan.measure_next(verdict.sequence, late=verdict.late, measured=measured)

    def last_number(self, machine_id: int) -> int:
        """Return the number of the machine's last correction; 0 before the first."""
        number = self.last_correction.get(machine_id)
        return self.snapshot.last_correction[machine_id] if number is None else number

    def named_correction(self, machine_id: int, number: int) -> NamedCorrection | None:
        """Return what is known of a correction that readings name as the last in effect."""
        at = (machine_id, number)
        return self.named.get(at) or self.snapshot.named.get(at)

    def settle(self) -> None:
        """Make the snapshot what the commit has made of it. These writes are done."""
        snapshot = self.snapshot
        snapshot.stored_keys = {}
        if self.column_rows is not None:
            snapshot.forget()  # the columns hold more than the objects here
            return
        for characteristic_id, stream in self.touched.items():
            snapshot.streams[characteristic_id] = stream.loaded()
            average, tool = stream.average, stream.tool
            if average is not None and average.changed:
                at = (average.machine_id, average.location)
                snapshot.averages[at] = LoadedAverage(*at, average.average, average.empirical_value)
            if tool is not None and (tool.changed or tool.written()):
                snapshot.tools[tool.machine_id, tool.number] = self._settled(tool)
        for machine_id in {stream.entry.machine_id for stream in self.touched.values()}:
            snapshot.versions[machine_id] += 1
        snapshot.plans |= self.plans
        snapshot.last_correction |= self.last_correction
        snapshot.named |= self.named
        if len(snapshot.named) > MOST_NAMED:
            snapshot.named = {}
        snapshot.named |= {
            (c.machine_id, c.number): NamedCorrection(None, None, None, c.status, c.tool_memory, c.issued_at)
            for c in self.issued
        }

    def _settled(self, tool: PendingTool) -> LoadedTool:
        return structs.replace(
            self.snapshot.tools[tool.machine_id, tool.number],
            offset=tool.offset,
            total=tool.total,
            paused_by=alarm_number(tool.paused_by),
            applied=tool.applied[-MOST_APPLIED:],
            corrections=[
                c.loaded() if isinstance(c, PendingCorrection) else c
                for c in tool.corrections
                if c.status not in {"rejected", "superseded"}
            ],
        )


@dataclass(slots=True, kw_only=True)
class Verdict:
    """A decided reading, before its alarms have numbers."""

    stream: PendingStream
    reading: ReadingIn
    sequence: int
    parameters: Parameters
    measured: float
    measured_at: datetime
    received_at: datetime
    late: bool
    decision: Decision
    outstanding: Sequence[int]
    correction: PendingCorrection | None
    paused_by: int | PendingAlarm | None
    alarms: list[PendingAlarm]
    compensated: float | None
    results: Results | None = None
    measure_next: int | None = None
    _record: Record | None = None

    @property
    def first_move_triggered(self) -> bool:
        """Tell if the probe triggered on its way to the surface."""
        return self.reading.first_move_triggered

    def record(self) -> Record:
        """Return the row to store, and to answer from; every alarm has its number by now."""
        if self._record is None:
            self._record = self._row()
        return self._record

    def _row(self) -> Record:
        d, r, entry = self.decision, self.reading, self.stream.entry
        return Record(
            machine_id=entry.machine_id,
            characteristic_id=entry.characteristic_id,
            sequence=self.sequence,
            measured=self.measured,
            deviation=d.deviation,
            decided=d.decided,
            average_before=d.average_before,
            average_after=d.average_after,
            measured_at=self.measured_at,
            received_at=self.received_at,
            machined_at=r.machined_at,
            parameters_version=self.stream.start.version,
            correction_in_effect=r.correction_in_effect,
            correction=self.correction.number if self.correction else None,
            paused_by=alarm_number(self.paused_by),
            late=self.late,
            zone=d.zone.value,
            action=d.action.value,
            code=d.code.value,
            key=r.key,
            part=r.part,
            outstanding=self.outstanding or None,
            alarms=[alarm.id or 0 for alarm in self.alarms] or None,
            compensated=self.compensated,
        )


class Stored(NamedTuple):
    """The reading is in the record already: the same key with the same value was sent before."""

    entry: Entry
    sequence: int
