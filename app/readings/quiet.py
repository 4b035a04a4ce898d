"""The quiet readings of a batch – no correction, no alarm, nothing to confirm – decided, kept and stored as columns.

`judge` decides one reading with all that may follow from it. Nearly all readings of a batch ask for nothing; for those
this does the same with `core.recursion`, without an object for each. Both move one ground along, in turns: before
`judge` takes a reading, `hand_over` tells the ground what has happened to its stream; `take_back` learns what `judge` made of it.
"""

from collections.abc import Sequence
from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from app.core.compensation import Action, Decision, outstanding_effect
from app.core.recursion import CODES, ZONES, Lane, Lanes, Quiet, quiet_run
from app.readings.cutting import Circumstance, confirms, cut_with
from app.readings.ground import AverageState, Ground, StreamState, Verdict
from app.readings.records import Entry, Record
from app.readings.rows import EPOCH, MICROSECOND, always, array_of_int4, fixed, moment, moments, one_of, table, texts
from app.readings.schemas import ReadingIn

FEWEST = 64  # readings that are worth making columns of
NEVER = -(2**62)


def compile_now() -> None:
    """Have everything compiled that a batch runs through, before the first one comes."""
    lane = np.zeros(0, np.int64)
    quiet_run(0, np.zeros(0), lane, Lanes.of([]), lane, np.zeros(0), Quiet.room(0))
    table([fixed(lane, ">i8")], 0)


class _Kind:
    """The readings of one stream that name the same correction as in effect: they are decided by the same numbers."""

    def __init__(self, ground: Ground, stream: StreamState, in_effect: int | None) -> None:
        self.ground, self.stream, self.in_effect = ground, stream, in_effect
        self.example = ReadingIn(stream.entry.characteristic, correction_in_effect=in_effect)

    def lane(self, stream: int, memory: int) -> tuple[Lane, Circumstance]:
        """How things stand now."""
        state, parameters, in_effect = self.stream, self.stream.parameters, self.in_effect
        found = cut_with(self.ground, state.tool, self.example)
        return Lane(
            parameters,
            state.average.empirical_value if state.average else 0.0,
            outstanding_effect(found.amounts, parameters.factor) if found.outstanding else 0.0,
            stream,
            memory,
            quiet=not found.previous_tool
            and state.paused_by is None
            and (state.tool is None or state.tool.paused_by is None)
            and parameters.accept_m == 1
            and parameters.plausible_jump is None
            and (in_effect is None or in_effect <= self.ground.last_correction[state.entry.machine_id])
            and not confirms(self.ground, state.tool, in_effect),
        ), found._replace(amounts=())


class QuietReadings:
    """The readings of a batch, of which those that are quiet are kept here, by their positions in the batch."""

    def __init__(self, ground: Ground, wanted: Sequence[tuple[Entry, ReadingIn]], now: datetime) -> None:
        self.wanted, self.now = wanted, now
        self._kinds: list[_Kind] = []
        self._streams: dict[int, tuple[int, StreamState]] = {}  # by characteristic; with their indices
        self._memories: dict[int, tuple[int, AverageState]] = {}  # by identity
        self._kind_of = np.array(self._sort(ground), np.int64)
        streams = np.array([self._streams[kind.stream.entry.characteristic_id][0] for kind in self._kinds])
        self._stream_of = streams[self._kind_of]
        never = [reading.measured is None or reading.machined_at is not None for _, reading in wanted]
        self._lane_of = np.where(never, -1, self._kind_of)
        self._measured = np.array([reading.measured or 0.0 for _, reading in wanted])
        self._times = moments([reading.measured_at or now for _, reading in wanted])
        self._latest = self._latest_before()
        self._circumstances: list[Circumstance] = []
        self._circumstance_of = np.zeros(len(wanted), np.int64)
        # A lane is made when a reading needs it: a batch may have as many kinds as readings, and each correction changes all.
        self._lanes = Lanes.unknown(len(self._kinds))
        self._stale = np.ones(len(self._kinds), np.bool_)
        self._now = np.zeros(len(self._kinds), np.int64)  # the circumstance of each kind
        self._of_stream = streams
        self._named = np.array([kind.in_effect or 0 for kind in self._kinds])
        self._of_tool = np.array([0 if kind.stream.tool is None else id(kind.stream.tool) for kind in self._kinds])
        self._sequences = np.array([stream.sequence for _, stream in self._streams.values()], np.int64)
        self._averages = np.array([memory.average for _, memory in self._memories.values()] or [0.0])
        self._made = Quiet.room(len(wanted))
        self._quiet = np.zeros(len(wanted), np.bool_)

    def _sort(self, ground: Ground) -> list[int]:
        """The kind of each reading."""
        names = [(entry.characteristic_id, reading.correction_in_effect) for entry, reading in self.wanted]
        numbers = {name: number for number, name in enumerate(dict.fromkeys(names))}
        for characteristic, in_effect in numbers:
            stream = ground.streams[characteristic]
            self._kinds.append(_Kind(ground, stream, in_effect))
            self._streams.setdefault(characteristic, (len(self._streams), stream))
            if stream.average is not None:
                self._memories.setdefault(id(stream.average), (len(self._memories), stream.average))
        return [numbers[name] for name in names]

    def _refresh(self, number: int) -> None:
        """Make the lane of one kind as things stand now."""
        kind = self._kinds[number]
        average = kind.stream.average
        lane, circumstance = kind.lane(
            self._streams[kind.stream.entry.characteristic_id][0],
            self._memories[id(average)][0] if average is not None else -1,
        )
        self._lanes.replace(number, lane)
        self._stale[number] = False
        self._now[number] = len(self._circumstances)
        self._circumstances.append(circumstance)

    def _latest_before(self) -> NDArray[np.int64]:
        """For each reading the latest time of measurement in its stream before it."""
        latest = np.empty(len(self.wanted), np.int64)
        for index, stream in self._streams.values():
            of_stream = self._stream_of == index
            first = NEVER if stream.last_measured_at is None else moment(stream.last_measured_at)
            times = np.concatenate(([first], self._times[of_stream]))
            latest[of_stream] = np.maximum.accumulate(times)[:-1]
        return latest

    def run(self, at: int) -> int:
        """Decide readings from a position on, as long as they are quiet; the position of the first that is not."""
        while True:
            end = quiet_run(at, self._measured, self._lane_of, self._lanes, self._sequences, self._averages, self._made)
            self._quiet[at:end] = True
            self._circumstance_of[at:end] = self._now[self._kind_of[at:end]]
            if end == len(self._lane_of) or self._lane_of[end] < 0 or not self._stale[self._lane_of[end]]:
                return end
            self._refresh(int(self._lane_of[end]))
            at = end

    def hand_over(self, at: int) -> None:
        """Bring the ground to where it is before the reading at a position, for `judge` to go on."""
        index, stream = self._streams[self.wanted[at][0].characteristic_id]
        stream.sequence = int(self._sequences[index])
        latest = int(self._latest[at])
        stream.last_measured_at = None if latest == NEVER else EPOCH + latest * MICROSECOND
        self._return(stream.average)

    def _return(self, memory: AverageState | None) -> None:
        if memory is not None:
            average = float(self._averages[self._memories[id(memory)][0]])
            memory.changed |= memory.average != average
            memory.average = average

    def take_back(self, at: int) -> None:
        """Go on from where `judge` has left the ground with the reading at a position."""
        index, judged = self._streams[self.wanted[at][0].characteristic_id]
        self._sequences[index] = judged.sequence
        if judged.average is not None:
            self._averages[self._memories[id(judged.average)][0]] = judged.average.average
        stale = self._of_stream == index
        if judged.tool is not None:
            stale |= self._of_tool == id(judged.tool)
        if (in_effect := self.wanted[at][1].correction_in_effect) is not None:
            stale |= self._named == in_effect  # it may have told when that was applied
        self._stale |= stale
        self._lanes.silence(stale)

    def close(self) -> None:
        """Bring the ground to where it is after the last reading."""
        for _, memory in self._memories.values():
            self._return(memory)
        for index, stream in self._streams.values():
            stream.sequence = int(self._sequences[index])
            last = int(np.flatnonzero(self._stream_of == index)[-1])
            if self._quiet[last]:
                stream.last = self.verdict(last)
                stream.last_measured_at = EPOCH + int(max(self._latest[last], self._times[last])) * MICROSECOND

    def streams(self) -> list[StreamState]:
        """The streams of the batch."""
        return [stream for _, stream in self._streams.values()]

    def __len__(self) -> int:
        return int(self._quiet.sum())

    def zones(self) -> dict[str, int]:
        """How many quiet readings lie in each zone."""
        counts = np.bincount(self._made.zone[self._quiet], minlength=len(ZONES)).tolist()
        return {zone.value: count for zone, count in zip(ZONES, counts, strict=True) if count}

    def verdict(self, at: int) -> Verdict:
        """The quiet reading at a position, as `judge` would have left it."""
        made, (entry, reading) = self._made, self.wanted[at]
        _, stream = self._streams[entry.characteristic_id]
        circumstance = self._circumstances[self._circumstance_of[at]]
        decision = Decision(
            deviation=float(made.deviation[at]),
            decided=float(made.decided[at]),
            zone=ZONES[made.zone[at]],
            action=Action.NONE,
            code=CODES[made.code[at]],
            average_before=float(made.before[at]),
            average_after=float(made.after[at]),
            size_error=None,
            amount=None,
            clamped=False,
            good=True,
            signals=(),
        )
        return Verdict(
            stream,
            reading,
            int(made.sequence[at]),
            stream.version,
            stream.parameters,
            reading.measured or 0.0,
            EPOCH + int(self._times[at]) * MICROSECOND,
            self.now,
            bool(self._times[at] < self._latest[at]),
            decision,
            circumstance.outstanding,
            correction=None,
            paused_by=None,
            alarms=[],
            compensated=circumstance.compensated,
        )

    def rows(self) -> memoryview:
        """The quiet readings as rows of the table `reading`, for a binary COPY."""
        at = np.flatnonzero(self._quiet)
        made, stream = self._made, self._stream_of[at]
        met, circumstance = np.unique(self._circumstance_of[at], return_inverse=True)
        circumstances = [self._circumstances[number] for number in met.tolist()]
        streams = self.streams()
        readings = [self.wanted[position][1] for position in at.tolist()]
        in_effect = self._named[self._kind_of[at]]
        named = np.array([kind.in_effect is None for kind in self._kinds])[self._kind_of[at]]
        null = always(None)
        compensated = np.array([np.nan if c.compensated is None else c.compensated for c in circumstances])[
            circumstance
        ]
        columns = {
            "machine_id": fixed(np.array([s.entry.machine_id for s in streams])[stream], ">i4"),
            "characteristic_id": fixed(np.array([s.entry.characteristic_id for s in streams])[stream], ">i4"),
            "sequence": fixed(made.sequence[at], ">i8"),
            "measured": fixed(self._measured[at], ">f8"),
            "deviation": fixed(made.deviation[at], ">f8"),
            "decided": fixed(made.decided[at], ">f8"),
            "average_before": fixed(made.before[at], ">f8"),
            "average_after": fixed(made.after[at], ">f8"),
            "measured_at": fixed(self._times[at], ">i8"),
            "received_at": fixed(np.full(len(at), moment(self.now)), ">i8"),
            "machined_at": null,
            "parameters_version": fixed(np.array([s.version for s in streams])[stream], ">i4"),
            "correction_in_effect": fixed(in_effect, ">i4", named),
            "correction": null,
            "paused_by": null,
            "late": fixed(self._times[at] < self._latest[at], "?"),
            "zone": one_of([zone.value.encode() for zone in ZONES], made.zone[at]),
            "action": always(Action.NONE.value.encode()),
            "code": one_of([code.value.encode() for code in CODES], made.code[at]),
            "key": texts([reading.key for reading in readings]),
            "part": texts([reading.part for reading in readings]),
            "outstanding": one_of(
                [array_of_int4(c.outstanding) if c.outstanding else None for c in circumstances], circumstance
            ),
            "alarms": null,
            "compensated": fixed(compensated, ">f8", np.isnan(compensated)),
        }
        return table([columns[name] for name in Record._fields], len(at))
