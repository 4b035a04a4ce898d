"""Readings run through the rules without a database: what would be decided, and nothing is stored.

The readings are taken as they are: each correction counts as made before the next reading, nobody has to acknowledge
anything, and numbers of corrections in the file mean nothing here. What the sizes would have become with other
corrections is another question; a replay does not ask it.
"""

from collections.abc import Iterable, Iterator
from datetime import UTC, datetime
from typing import Any

from app.core.decision.step import Code
from app.core.parameters import Parameters
from app.errors import InbandError
from app.loop.readings.answers import answer
from app.loop.readings.importing.cells import Flaw, Passed
from app.loop.readings.importing.lines import Line
from app.loop.readings.records import Entry
from app.loop.readings.writer.decide import decide_reading
from app.loop.readings.writer.pending import PendingStream, PendingWrites, Stored
from app.loop.readings.writer.snapshot import LoadedAverage, LoadedStream, LoadedTool, Snapshot


def replay(
    parameters: Parameters, lines: Iterable[Line | Flaw | Passed], characteristic: str
) -> Iterator[dict[str, Any] | Flaw]:
    """The answer to each line, as the API would give it; a line that cannot be read is passed on."""
    entry = Entry(0, "replay", 0, characteristic)
    memory, location = parameters.average_memory or None, parameters.tool_memory or None
    snapshot = Snapshot({0: parameters}, last_correction={0: 0})
    snapshot.streams[0] = LoadedStream(entry=entry, version=1, average=memory, tool=location)
    if memory is not None:
        snapshot.averages[0, memory] = LoadedAverage(0, memory)
    if location is not None:
        snapshot.tools[0, location] = LoadedTool(machine_id=0, number=location)
    pending = PendingWrites(snapshot)
    stream = pending.stream(0)
    tool = stream.tool
    now = datetime.now(UTC)
    for line in lines:
        if isinstance(line, Passed):
            continue
        if isinstance(line, Flaw):
            yield line
            continue
        reading = line.reading
        reading.correction_in_effect = reading.machined_at = None
        try:
            verdict = decide_reading(pending, entry, reading, now)
        except InbandError as refusal:
            yield Flaw(line.number, refusal.errors[0].field if refusal.errors else "", "", refusal.detail)
            continue
        assert not isinstance(verdict, Stored)
        issued = verdict.correction
        yield answer(
            characteristic,
            verdict.record(),
            parameters,
            correction=(issued.tool_memory, issued.amount) if issued else None,
            alarms=[(number, alarm.kind) for number, alarm in enumerate(verdict.alarms, start=1)],
            results=verdict.results,
            touches=reading.touches,
        )
        if tool is not None and issued is not None and issued.status != "held":
            tool.total += issued.amount
        if verdict.decision.code is Code.IMPLAUSIBLE:
            stream.level = None  # a person has looked, and the next reading begins again
        _as_if_done(pending, stream)


def _as_if_done(pending: PendingWrites, stream: PendingStream) -> None:
    """Everything this reading asked for has been done when the next one comes, and is forgotten."""
    stream.paused_by = None
    stream.alarms.clear()
    stream.parts.clear()  # the sizes are as they were with other corrections: they say nothing of the effect of these
    stream.arrivals.clear()
    pending.tool_alarms.clear()
    pending.raised.clear()
    pending.issued.clear()
    pending.verdicts.clear()
    pending.by_key.clear()
    if stream.tool is not None:
        stream.tool.corrections.clear()
        stream.tool.forget()
