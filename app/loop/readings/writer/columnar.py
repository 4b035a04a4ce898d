"""The columnar path: the readings of a batch that ask for nothing – no correction, no alarm, nothing to confirm.

`decide_reading` decides one reading with all that may follow from it. Nearly all readings of a batch ask for nothing; for
those this does the same with `core.decision.loops`, and lays out their rows as columns, without an object for each. Both
move one `PendingWrites` along, in turns: before `decide_reading` takes a reading, `write_back` brings the state of its
stream there; `read_back` takes over what it has left.
"""

from collections.abc import Sequence
from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from app.core import clock
from app.core.decision.decide import Decision, outstanding_effect
from app.core.decision.limits import ZONES
from app.core.decision.loops import SERIES, Quiet, Series, quiet_run, rows_of
from app.core.decision.step import CODES, Action
from app.core.early import acts_early
from app.core.opposite_effect import LONGEST, judge
from app.core.overshoot import judge_strong
from app.errors import InbandError
from app.loop.readings.records import Entry, Record
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.binary_copy import (
    EPOCH,
    MICROSECOND,
    always,
    array_of_int4,
    fixed,
    moment,
    moments,
    one_of,
    table,
    texts,
)
from app.loop.readings.writer.corrections_in_effect import CorrectionsInEffect, confirms, corrections_in_effect
from app.loop.readings.writer.decide import decide_reading
from app.loop.readings.writer.doubts import fell
from app.loop.readings.writer.pending import PendingAverage, PendingStream, PendingWrites, Stored, Verdict
from app.loop.readings.writer.snapshot import Arrival, Part

FEWEST = 64  # readings that are worth making columns of
NEVER = -(2**62)


def compile_now() -> None:
    """Have everything compiled that a batch runs through, before the first one comes."""
    none = np.zeros(0, np.int64)
    quiet_run(0, np.zeros(0), none, rows_of([]), none, np.zeros(0), Quiet.room(0))
    table([fixed(none, ">i8")], 0)
    judge(np.zeros(3), np.zeros(3), 1.0, 0, 1.0, 1.0)
    judge_strong(np.zeros(3), np.zeros(3), 1.0, 0, 1.0, 1.0, 1.0)
    acts_early(np.zeros(3), np.zeros(3), np.zeros(3), 1.0, 0, 1.0)


class _Group:
    """Readings of one stream that name the same correction as in effect: they are decided by the same numbers."""

    def __init__(self, pending: PendingWrites, stream: PendingStream, in_effect: int | None) -> None:
        self.pending, self.stream, self.in_effect = pending, stream, in_effect
        self.example = ReadingIn(stream.entry.characteristic, correction_in_effect=in_effect)

    def series(self, stream: int, memory: int) -> tuple[Series, CorrectionsInEffect]:
        """Return the series as the readings before have left it, and the corrections in effect."""
        state, parameters, in_effect = self.stream, self.stream.parameters, self.in_effect
        effect = corrections_in_effect(self.pending, state.tool, self.example, parameters)
        return Series(
            parameters,
            state.average.empirical_value if state.average else 0.0,
            outstanding_effect(effect.amounts, parameters.factor) if effect.amounts else 0.0,
            stream,
            memory,
            quiet=not effect.previous_tool
            and not parameters.rules.of_tool  # when it was measured counts
            and state.paused_by is None
            and (state.tool is None or state.tool.paused_by is None)
            and parameters.accept_m == 1
            and parameters.plausible_jump is None
            and (in_effect is None or in_effect <= self.pending.last_number(state.entry.machine_id))
            and not confirms(self.pending, state.tool, in_effect)
            and not fell(self.pending, state.tool, in_effect),
        ), effect._replace(amounts=())


class ColumnarReadings:
    """The readings of a batch, of which those that are quiet are kept here, by their positions in the batch."""

    def __init__(self, pending: PendingWrites, readings: Sequence[tuple[Entry, ReadingIn]], now: datetime) -> None:
        self.readings, self.now = readings, now
        self._groups: list[_Group] = []
        self._streams: dict[int, tuple[int, PendingStream]] = {}  # by characteristic; with their indices
        self._memories: dict[int, tuple[int, PendingAverage]] = {}  # by identity
        self._group_of = np.array(self._sort(pending), np.int64)
        streams = np.array([self._streams[group.stream.entry.characteristic_id][0] for group in self._groups])
        self._stream_of = streams[self._group_of]
        never = [
            reading.measured is None
            or reading.machined_at is not None
            or reading.context is not None
            or reading.first_move_triggered
            for _, reading in readings
        ]
        self._series_of = np.where(never, -1, self._group_of)
        self._measured = np.array([reading.measured or 0.0 for _, reading in readings])
        self._times = moments([reading.measured_at or now for _, reading in readings])
        self._latest = self._latest_before()
        self._effects: list[CorrectionsInEffect] = []
        self._effect_of = np.zeros(len(readings), np.int64)
        # A series is made when a reading needs it: a batch may have as many groups as readings, and each correction changes all.
        self._series = np.zeros(len(self._groups), SERIES)  # none is quiet
        self._stale = np.ones(len(self._groups), np.bool_)
        self._now = np.zeros(len(self._groups), np.int64)  # the effect of each group
        self._of_stream = streams
        self._named = np.array([group.in_effect or 0 for group in self._groups])
        self._of_tool = np.array([0 if group.stream.tool is None else id(group.stream.tool) for group in self._groups])
        self._remembered = [0] * len(self._streams)  # the position up to which a stream keeps its parts
        self._sequences = np.array([stream.sequence for _, stream in self._streams.values()], np.int64)
        self._averages = np.array([memory.average for _, memory in self._memories.values()] or [0.0])
        self._decided = Quiet.room(len(readings))
        self._quiet = np.zeros(len(readings), np.bool_)

    def _sort(self, pending: PendingWrites) -> list[int]:
        """Return the group of each reading."""
        names = [(entry.characteristic_id, reading.correction_in_effect) for entry, reading in self.readings]
        numbers = {name: number for number, name in enumerate(dict.fromkeys(names))}
        for characteristic, in_effect in numbers:
            stream = pending.stream(characteristic)
            self._groups.append(_Group(pending, stream, in_effect))
            self._streams.setdefault(characteristic, (len(self._streams), stream))
            if stream.average is not None:
                self._memories.setdefault(id(stream.average), (len(self._memories), stream.average))
        return [numbers[name] for name in names]

    def _refresh(self, number: int) -> None:
        """Make the series of one group again."""
        group = self._groups[number]
        average = group.stream.average
        series, effect = group.series(
            self._streams[group.stream.entry.characteristic_id][0],
            self._memories[id(average)][0] if average is not None else -1,
        )
        self._series[number] = series.row()
        self._stale[number] = False
        self._now[number] = len(self._effects)
        self._effects.append(effect)

    def _latest_before(self) -> NDArray[np.int64]:
        """Return for each reading the latest time of measurement in its stream before it, none after it was received."""
        latest = np.empty(len(self.readings), np.int64)
        times = np.minimum(self._times, moment(self.now))
        for index, stream in self._streams.values():
            of_stream = self._stream_of == index
            first = NEVER if stream.last_measured_at is None else moment(stream.last_measured_at)
            latest[of_stream] = np.maximum.accumulate(np.concatenate(([first], times[of_stream])))[:-1]
        return latest

    def run(self, at: int) -> int:
        """Decide readings from a position on, as long as they are quiet; the position of the first that is not."""
        while True:
            end = quiet_run(
                at, self._measured, self._series_of, self._series, self._sequences, self._averages, self._decided
            )
            self._quiet[at:end] = True
            self._effect_of[at:end] = self._now[self._group_of[at:end]]
            if end == len(self._series_of) or self._series_of[end] < 0 or not self._stale[self._series_of[end]]:
                return end
            self._refresh(int(self._series_of[end]))
            at = end

    def write_back(self, at: int) -> None:
        """Bring the state of the stream to where it is before the reading at a position, for `decide_reading` to go on."""
        index, stream = self._streams[self.readings[at][0].characteristic_id]
        stream.sequence = int(self._sequences[index])
        latest = int(self._latest[at])
        stream.last_measured_at = None if latest == NEVER else EPOCH + latest * MICROSECOND
        self._write_average(stream.average)
        if stream.tool is not None:
            stream.parts += self._parts(index, self._remembered[index], at)
            stream.arrivals += self._arrivals(index, self._remembered[index], at)
        self._remembered[index] = at + 1

    def _parts(self, index: int, first: int, end: int) -> list[Part]:
        """Return the quiet readings of a stream between two positions, at most as many as are looked at."""
        quiet = self._quiet[first:end] & (self._stream_of[first:end] == index)
        quiet &= self._times[first:end] >= self._latest[first:end]
        parts = []
        for at in (np.flatnonzero(quiet)[-LONGEST:] + first).tolist():
            compensated = self._effects[self._effect_of[at]].compensated
            if compensated is not None:
                decided, deviation = float(self._decided.decided[at]), float(self._decided.deviation[at])
                parts.append(Part(int(self._decided.sequence[at]), deviation, compensated, decided - deviation))
        return parts

    def _arrivals(self, index: int, first: int, end: int) -> list[Arrival]:
        """Return the times of the newest quiet readings of a stream between two positions."""
        quiet = np.flatnonzero(self._quiet[first:end] & (self._stream_of[first:end] == index))[-clock.FEWEST :] + first
        return [
            Arrival(int(self._decided.sequence[at]), self.now, EPOCH + int(self._times[at]) * MICROSECOND)
            for at in quiet.tolist()
        ]

    def _write_average(self, memory: PendingAverage | None) -> None:
        if memory is not None:
            average = float(self._averages[self._memories[id(memory)][0]])
            memory.changed |= memory.average != average
            memory.average = average

    def read_back(self, at: int) -> None:
        """Go on from where `decide_reading` has left the state with the reading at a position."""
        index, stream = self._streams[self.readings[at][0].characteristic_id]
        self._sequences[index] = stream.sequence
        if stream.average is not None:
            self._averages[self._memories[id(stream.average)][0]] = stream.average.average
        stale = self._of_stream == index
        if stream.tool is not None:
            stale |= self._of_tool == id(stream.tool)
        if (in_effect := self.readings[at][1].correction_in_effect) is not None:
            stale |= self._named == in_effect  # it may show when that was applied
        self._stale |= stale
        self._series["quiet"][stale] = False

    def close(self) -> None:
        """Bring the pending writes to where they are after the last reading."""
        for _, memory in self._memories.values():
            self._write_average(memory)
        for index, stream in self._streams.values():
            stream.sequence = int(self._sequences[index])
            last = int(np.flatnonzero(self._stream_of == index)[-1])
            if self._quiet[last]:
                stream.last = self.verdict(last)
                latest = max(int(self._latest[last]), min(int(self._times[last]), moment(self.now)))
                stream.last_measured_at = EPOCH + latest * MICROSECOND

    def streams(self) -> list[PendingStream]:
        """Return the streams of the batch."""
        return [stream for _, stream in self._streams.values()]

    def __len__(self) -> int:
        return int(self._quiet.sum())

    def zones(self) -> dict[str, int]:
        """Count the quiet readings in each zone."""
        counts = np.bincount(self._decided.zone[self._quiet], minlength=len(ZONES)).tolist()
        return {zone.value: count for zone, count in zip(ZONES, counts, strict=True) if count}

    def verdict(self, at: int) -> Verdict:
        """Return the quiet reading at a position, as `decide_reading` would have left it."""
        decided, (entry, reading) = self._decided, self.readings[at]
        _, stream = self._streams[entry.characteristic_id]
        effect = self._effects[self._effect_of[at]]
        decision = Decision(
            deviation=float(decided.deviation[at]),
            decided=float(decided.decided[at]),
            zone=ZONES[decided.zone[at]],
            action=Action.NONE,
            code=CODES[decided.code[at]],
            average_before=float(decided.before[at]),
            average_after=float(decided.after[at]),
            size_error=None,
            amount=None,
            clamped=False,
            good=True,
            alarms=(),
        )
        return Verdict(
            stream=stream,
            reading=reading,
            sequence=int(decided.sequence[at]),
            parameters=stream.parameters,
            measured=reading.measured or 0.0,
            measured_at=EPOCH + int(self._times[at]) * MICROSECOND,
            received_at=self.now,
            late=bool(self._times[at] < self._latest[at]),
            decision=decision,
            outstanding=effect.outstanding,
            correction=None,
            paused_by=None,
            alarms=[],
            compensated=effect.compensated,
        )

    def rows(self) -> memoryview:
        """Return the quiet readings as rows of the table `reading`, for a binary COPY."""
        at = np.flatnonzero(self._quiet)
        decided, stream = self._decided, self._stream_of[at]
        numbers, effect = np.unique(self._effect_of[at], return_inverse=True)
        effects = [self._effects[number] for number in numbers.tolist()]
        streams = self.streams()
        sent = [self.readings[position][1] for position in at.tolist()]
        in_effect = self._named[self._group_of[at]]
        named = np.array([group.in_effect is None for group in self._groups])[self._group_of[at]]
        null = always(None)
        compensated = np.array([np.nan if c.compensated is None else c.compensated for c in effects])[effect]
        columns = {
            "machine_id": fixed(np.array([s.entry.machine_id for s in streams])[stream], ">i4"),
            "characteristic_id": fixed(np.array([s.entry.characteristic_id for s in streams])[stream], ">i4"),
            "sequence": fixed(decided.sequence[at], ">i8"),
            "measured": fixed(self._measured[at], ">f8"),
            "deviation": fixed(decided.deviation[at], ">f8"),
            "decided": fixed(decided.decided[at], ">f8"),
            "average_before": fixed(decided.before[at], ">f8"),
            "average_after": fixed(decided.after[at], ">f8"),
            "measured_at": fixed(self._times[at], ">i8"),
            "received_at": fixed(np.full(len(at), moment(self.now)), ">i8"),
            "machined_at": null,
            "parameters_version": fixed(np.array([s.start.version for s in streams])[stream], ">i4"),
            "correction_in_effect": fixed(in_effect, ">i4", named),
            "correction": null,
            "paused_by": null,
            "late": fixed(self._times[at] < self._latest[at], "?"),
            "zone": one_of([zone.value.encode() for zone in ZONES], decided.zone[at]),
            "action": always(Action.NONE.value.encode()),
            "code": one_of([code.value.encode() for code in CODES], decided.code[at]),
            "key": texts([reading.key for reading in sent]),
            "part": texts([reading.part for reading in sent]),
            "outstanding": one_of([array_of_int4(c.outstanding) if c.outstanding else None for c in effects], effect),
            "alarms": null,
            "compensated": fixed(compensated, ">f8", np.isnan(compensated)),
        }
        return table([columns[name] for name in Record.__struct_fields__], len(at))


Outcome = Verdict | ColumnarReadings | Stored | InbandError
"""The outcome of a reading; `ColumnarReadings` hold it by its place in the batch."""


def decide_in_columns(
    pending: PendingWrites, readings: Sequence[tuple[Entry, ReadingIn]], now: datetime
) -> list[Outcome]:
    """Decide readings in their order as `decide_one_by_one` does: as columns while they are quiet, the others one by one.

    Every key must be new, and none be there twice.
    """
    columns = ColumnarReadings(pending, readings, now)
    outcomes: list[Outcome] = []
    while True:
        outcomes += [columns] * (columns.run(len(outcomes)) - len(outcomes))
        at = len(outcomes)
        if at == len(readings):
            break
        columns.write_back(at)
        try:
            outcomes.append(decide_reading(pending, *readings[at], now))
        except InbandError as refusal:
            outcomes.append(refusal)
        columns.read_back(at)
    columns.close()
    pending.touched = {stream.entry.characteristic_id: stream for stream in columns.streams()}
    pending.column_rows = columns.rows
    return outcomes
