"""The snapshot: the state of machines that readings are decided against. Frozen: a decision writes to `PendingWrites` alone.

It is loaded under the machines' locks, or remembered from the transaction before. A remembered snapshot is an optimistic
lock: with the commit, the database proves that no machine's version has moved (`statements.GUARD`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import NamedTuple

import msgspec

from app.core.control_plan import Plan, Tightened, measure_next
from app.core.parameters import Parameters
from app.core.variants import FormResult
from app.loop.readings.records import Entry
from app.loop.readings.schemas import ReadingIn

# A remembered tool's corrections grow in number; beyond this they are loaded again, and then are few again.
MOST_CORRECTIONS = 100
MOST_NAMED = 10_000
MOST_APPLIED = 16  # corrections of a tool that an alarm about them can name


class LoadedCorrection(NamedTuple):
    """A correction that is open, or was applied after a part that is to be decided on was cut. Amount in mm of offset.

    decided_at: a person approved or released it. fetched_at: as program text; the control applies it behind those fetched
    before. characteristic_id: 0 where it was not asked for.
    """

    number: int
    amount: float
    status: str
    applied_at: datetime | None = None
    decided_at: datetime | None = None
    fetched_at: datetime | None = None
    characteristic_id: int = 0


class NamedCorrection(NamedTuple):
    """The last correction that a machine had applied when it cut a part: its time, and the time of a person's decision.

    status, tool_memory, issued_at: None where nothing is known of them.
    """

    applied_at: datetime | None
    decided_at: datetime | None
    fetched_at: datetime | None = None
    status: str | None = None
    tool_memory: int | None = None
    issued_at: datetime | None = None


class LoadedTool(msgspec.Struct, frozen=True, kw_only=True, array_like=True):
    """One location of the tool memory (R10), with its corrections in the order of their numbers. mm.

    set_by_hand: a person has set the offset since the tool was changed. paused_by: the alarm that pauses it. Of the applied
    corrections there are those with a higher number than `since_number`, and those applied after `since`. applied: numbers
    and amounts of the newest, to name them by. untaken: the newest alarm that
    the machine does not take them, and the last of which it spoke.
    """

    machine_id: int
    number: int
    offset: float = 0.0
    total: float = 0.0
    reset_at: datetime | None = None
    set_by_hand: bool = False
    paused_by: int | None = None
    corrections: Sequence[LoadedCorrection] = ()
    since_number: int | None = None
    since: datetime | None = None
    applied: Sequence[tuple[int, float]] = ()
    untaken: tuple[int, int] | None = None


class LoadedAverage(NamedTuple):
    """One location of the average memory (R11): running average and empirical value, mm."""

    machine_id: int
    location: int
    average: float = 0.0
    empirical_value: float = 0.0


class Part(NamedTuple):
    """A reading that tells of the effect of corrections: its deviation, and the sum of those its part was cut with, mm.

    outstanding: by how much those that it was cut without will change the size, mm. corrected: a correction was issued for it, by the
    parameters of today.
    """

    sequence: int
    deviation: float
    compensated: float
    outstanding: float
    corrected: bool = False


class Arrival(NamedTuple):
    """Times of a reading: it came in, was measured and cut as it says; measured where it says nothing: when it came in."""

    sequence: int
    received_at: datetime
    measured_at: datetime
    machined_at: datetime | None = None


class LoadedStream(msgspec.Struct, frozen=True, kw_only=True, array_like=True):
    """The state of one characteristic after its last reading.

    average, tool: locations, None without one. level: the deviation expected without corrections, mm; kept where jumps
    are looked for. gain_from: readings up to this one say nothing of the gain of corrections; parts, arrivals: the newest, in order.
    forms: the characteristics whose readings are results of these, each with the result.
    """

    entry: Entry
    sequence: int = 0
    version: int
    average: int | None
    tool: int | None
    paused_by: int | None = None
    last_measured_at: datetime | None = None
    level: float | None = None
    level_sequence: int | None = None
    gain_from: int = 0
    parts: Sequence[Part] = ()
    arrivals: Sequence[Arrival] = ()
    forms: Sequence[tuple[Entry, FormResult]] = ()


class LoadedPlan(NamedTuple):
    """The control plan of a characteristic, where it counts parts.

    changed, alarmed: its last reading before the tool was changed, and the last one that was before an alarm or raised it; None:
    there was no such event.
    """

    plan: Plan
    changed: int | None
    alarmed: int | None

    def measure_next(self, sequence: int, *, late: bool, measured: bool) -> int | None:
        """As `app.core.control_plan.measure_next`, of the reading with this number."""
        events = {Tightened.TOOL_CHANGE: self.changed, Tightened.ALARM: self.alarmed}
        since = {why: None if at is None else sequence - at for why, at in events.items()}
        return measure_next(self.plan, since, late=late, measured=measured)


class KnownKey(NamedTuple):
    """A stored reading whose key has come again. first_move_triggered: as it was sent."""

    sequence: int
    measured: float
    parameters: Parameters
    first_move_triggered: bool


@dataclass(slots=True)
class Snapshot:
    """Rows as the database holds them. Only `load`, and the end of a transaction, put others in their place.

    Keys: characteristic; (machine, location); machine; (machine, correction); (characteristic, key of a reading). plans: of the
    streams that have one.
    """

    parameters: dict[int, Parameters] = field(default_factory=dict)
    streams: dict[int, LoadedStream] = field(default_factory=dict)
    plans: dict[int, LoadedPlan] = field(default_factory=dict)
    tools: dict[tuple[int, int], LoadedTool] = field(default_factory=dict)
    averages: dict[tuple[int, int], LoadedAverage] = field(default_factory=dict)
    last_correction: dict[int, int] = field(default_factory=dict)
    versions: dict[int, int] = field(default_factory=dict)
    named: dict[tuple[int, int], NamedCorrection] = field(default_factory=dict)
    stored_keys: dict[tuple[int, str], KnownKey] = field(default_factory=dict)

    def covers(self, entry: Entry, reading: ReadingIn) -> bool:
        """Tell if everything is here that this reading is decided against, if the versions are still true."""
        stream = self.streams.get(entry.characteristic_id)
        if stream is None:
            return False
        number = reading.correction_in_effect
        if stream.tool is None or (number is None and reading.machined_at is None):
            return True
        tool = self.tools[entry.machine_id, stream.tool]
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

    def forget(self) -> None:
        """Forget everything that was loaded; only keys of this transaction stay."""
        self.parameters, self.streams, self.plans, self.tools, self.averages = {}, {}, {}, {}, {}
        self.last_correction, self.versions, self.named = {}, {}, {}
