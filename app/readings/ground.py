"""What readings are judged against, and what the readings of one transaction come to.

The ground is loaded under the machines' locks and moved along by what is decided on it. It may be kept in memory for the
next transaction, which then must see that the machines' versions have not moved (`statements.GUARD`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, NamedTuple

from app.core.compensation import Decision
from app.core.parameters import Parameters
from app.core.variants import Results
from app.readings.records import Entry, Record
from app.readings.schemas import ReadingIn

# What memory holds of a tool's past grows with it; beyond this it is loaded anew, and then is short again.
MOST_CORRECTIONS = 100
MOST_NAMED = 10_000


@dataclass(slots=True)
class OpenAlarm:
    """An alarm that these readings raise. The writer finds out whether it is active already, or draws a number for it."""

    machine_id: int
    characteristic_id: int | None
    tool_memory: int | None
    kind: str
    id: int | None = None
    sequence: int | None = None
    last_sequence: int | None = None
    count: int = 0  # readings that raised it now
    new: bool = True
    data: dict[str, Any] = field(default_factory=dict)


@dataclass(slots=True)
class IssuedCorrection:
    """A correction that is open, or was applied after a part under judgement was cut."""

    machine_id: int
    number: int
    tool_memory: int
    amount: float
    status: str
    characteristic_id: int = 0
    sequence: int = 0
    size_error: float = 0.0
    applied_at: datetime | None = None
    decided_at: datetime | None = None  # a person approved or released it
    fetched_at: datetime | None = None  # as program text: the control applies it behind those fetched before
    applied_by: str | None = None
    offset_after: float | None = None
    superseded_by: int | None = None
    new: bool = False
    changed: bool = False


@dataclass(slots=True)
class Named:
    """The last correction that a machine had applied when it cut a part: when that was, and when a person let it go."""

    applied_at: datetime | None
    decided_at: datetime | None
    fetched_at: datetime | None = None


@dataclass(slots=True)
class Cut:
    """What parts were cut without that name one correction as the last in effect, or none (`app.readings.cutting`).

    seen: how many of the tool's corrections it knows. previous_tool: they were cut before the tool was changed. confirms:
    a pending correction is among those they were cut with. has_applied: an applied one is among those seen. issued: amounts
    of the open ones. numbers, amounts: of those they were cut without; applied_since: amounts of those that are applied by now.
    """

    in_effect: int | None
    last: Named | None
    seen: int = 0
    previous_tool: bool = False
    confirms: bool = False
    has_applied: bool = False
    issued: list[float] = field(default_factory=list)
    numbers: list[int] = field(default_factory=list)
    amounts: list[float] = field(default_factory=list)
    applied_since: list[float] = field(default_factory=list)


@dataclass(slots=True)
class ToolState:
    """One location of the tool memory, with its corrections in the order of their numbers."""

    machine_id: int
    number: int
    offset: float
    total: float
    reset_at: datetime | None
    paused_by: int | None = None  # the alarm that asks which offset is true
    corrections: list[IssuedCorrection] = field(default_factory=list)
    changed: bool = False
    # Of the applied corrections there are those with a higher number than `since_number`, and those applied after `since`.
    since_number: int | None = None
    since: datetime | None = None
    # What is worked out of `corrections`, and how many of the first ones are known not to be held.
    cuts: dict[int | None, Cut] = field(default_factory=dict)
    none_held: int = 0

    def forget(self) -> None:
        """The corrections are others, or have another status than when something was worked out of them."""
        self.cuts, self.none_held = {}, 0

    def settle(self) -> None:
        """What was decided is committed."""
        if self.changed or self.corrections:
            self.changed = False
            self.corrections = [c for c in self.corrections if c.status not in {"rejected", "superseded"}]
            self.forget()
            for correction in self.corrections:
                correction.new = correction.changed = False


@dataclass(slots=True)
class AverageState:
    """One location of the average memory."""

    machine_id: int
    location: int
    average: float
    empirical_value: float
    changed: bool = False


@dataclass(slots=True)
class StreamState:
    """The running state of one characteristic."""

    entry: Entry
    sequence: int
    version: int
    parameters: Parameters
    average: AverageState | None
    tool: ToolState | None
    paused_by: int | OpenAlarm | None
    last_measured_at: datetime | None
    level: float | None = None  # the deviation expected without corrections, mm; kept where jumps are looked for
    level_sequence: int | None = None
    level_moved: bool = False
    alarms: dict[str, OpenAlarm] = field(default_factory=dict)
    before: int = 0  # sequence when it was loaded
    last: "Verdict | None" = None


class Known(NamedTuple):
    """A reading in the record whose key has come again."""

    sequence: int
    measured: float
    parameters: Parameters


@dataclass(slots=True)
class Step:
    """A change of a tool offset to be written into its history."""

    machine_id: int
    number: int
    at: datetime
    offset_before: float
    offset_after: float
    correction: int
    actor: str


@dataclass(slots=True)
class Ground:
    """Everything the readings of one transaction are judged against, and what it comes to."""

    streams: dict[int, StreamState] = field(default_factory=dict)
    tools: dict[tuple[int, int], ToolState] = field(default_factory=dict)
    averages: dict[tuple[int, int], AverageState] = field(default_factory=dict)
    tool_alarms: dict[tuple[int, int, str], OpenAlarm] = field(default_factory=dict)
    last_correction: dict[int, int] = field(default_factory=dict)
    versions: dict[int, int] = field(default_factory=dict)
    named: dict[tuple[int, int], Named] = field(default_factory=dict)
    stored_keys: dict[tuple[int, str], Known] = field(default_factory=dict)
    verdicts: "list[Verdict]" = field(default_factory=list)
    by_key: "dict[tuple[int, str], Verdict]" = field(default_factory=dict)
    issued: list[IssuedCorrection] = field(default_factory=list)
    raised: list[OpenAlarm] = field(default_factory=list)
    steps: list[Step] = field(default_factory=list)
    touched_machines: set[int] = field(default_factory=set)

    def knows(self, entry: Entry, reading: ReadingIn) -> bool:
        """Whether everything is here that this reading is judged against, if the versions are still true."""
        stream = self.streams.get(entry.characteristic_id)
        if stream is None:
            return False
        tool, number = stream.tool, reading.correction_in_effect
        if tool is None or (number is None and reading.machined_at is None):
            return True
        if len(tool.corrections) > MOST_CORRECTIONS:
            return False
        if number is None:
            return tool.since is not None and reading.machined_at is not None and reading.machined_at >= tool.since
        if tool.since_number is None or number < tool.since_number:
            return False
        named = self.named.get((entry.machine_id, number))
        if named is None:
            return number == 0
        return named.applied_at is None or (tool.since is not None and named.applied_at >= tool.since)

    def clear(self) -> None:
        """Forget everything that was loaded."""
        self.streams, self.tools, self.averages = {}, {}, {}
        self.last_correction, self.versions, self.named = {}, {}, {}

    def settle(self) -> None:
        """What was decided is committed: make ready for the next transaction."""
        for verdict in self.verdicts:
            stream = verdict.stream
            if stream.last is None:
                continue
            stream.before, stream.last = stream.sequence, None
            stream.level_moved = False
            stream.alarms.clear()
            if isinstance(stream.paused_by, OpenAlarm):
                stream.paused_by = stream.paused_by.id
            if stream.average is not None:
                stream.average.changed = False
            if stream.tool is not None:
                stream.tool.settle()
        for machine_id in {verdict.stream.entry.machine_id for verdict in self.verdicts}:
            self.versions[machine_id] += 1
        if len(self.named) > MOST_NAMED:
            self.named = {}
        self.named.update({(c.machine_id, c.number): Named(None, None) for c in self.issued})
        self.verdicts, self.by_key, self.stored_keys = [], {}, {}
        self.tool_alarms, self.issued, self.raised, self.steps = {}, [], [], []
        self.touched_machines = set()


@dataclass(slots=True)
class Verdict:
    """A decided reading, before its alarms have numbers."""

    stream: StreamState
    reading: ReadingIn
    sequence: int
    version: int
    parameters: Parameters
    measured: float
    measured_at: datetime
    received_at: datetime
    late: bool
    decision: Decision
    outstanding: Sequence[int]
    correction: IssuedCorrection | None
    paused_by: int | OpenAlarm | None
    alarms: list[OpenAlarm]
    compensated: float | None
    results: Results | None = None
    _record: Record | None = None

    def record(self) -> Record:
        """The row to store, and to answer from; every alarm has its number by now."""
        if self._record is None:
            self._record = self._made()
        return self._record

    def _made(self) -> Record:
        d, r, entry = self.decision, self.reading, self.stream.entry
        paused_by = self.paused_by.id if isinstance(self.paused_by, OpenAlarm) else self.paused_by
        return Record(
            entry.machine_id,
            entry.characteristic_id,
            self.sequence,
            self.measured,
            d.deviation,
            d.decided,
            d.average_before,
            d.average_after,
            self.measured_at,
            self.received_at,
            r.machined_at,
            self.version,
            r.correction_in_effect,
            self.correction.number if self.correction else None,
            paused_by,
            self.late,
            d.zone.value,
            d.action.value,
            d.code.value,
            r.key,
            r.part,
            self.outstanding or None,
            [alarm.id or 0 for alarm in self.alarms] or None,
            self.compensated,
        )


class Stored(NamedTuple):
    """The reading is in the record already: the same key with the same value was sent before."""

    entry: Entry
    sequence: int
