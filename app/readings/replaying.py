"""Readings run through the rules without a database: what would be decided, and nothing is stored.

The readings are taken as they are: each correction counts as made before the next reading, nobody has to acknowledge
anything, and numbers of corrections in the file mean nothing here. What the sizes would have become with other
corrections is another question; a replay does not ask it.
"""

from collections.abc import Iterable, Iterator
from datetime import UTC, datetime
from typing import Any

from app.core.compensation import Code
from app.core.parameters import Parameters
from app.errors import InbandError
from app.readings.answers import answer
from app.readings.ground import AverageState, Ground, Stored, StreamState, ToolState
from app.readings.importing.lines import Flaw, Line
from app.readings.judge import judge
from app.readings.records import Entry


def replay(
    parameters: Parameters, lines: Iterable[Line | Flaw], characteristic: str
) -> Iterator[dict[str, Any] | Flaw]:
    """The answer to each line, as the API would give it; a line that cannot be read is passed on."""
    entry = Entry(0, "replay", 0, characteristic)
    ground = Ground(last_correction={0: 0})
    memory = AverageState(0, parameters.average_memory, 0.0, 0.0) if parameters.average_memory else None
    tool = ToolState(0, parameters.tool_memory, 0.0, 0.0, None) if parameters.tool_memory else None
    stream = ground.streams[0] = StreamState(entry, 0, 1, parameters, memory, tool, None, None)
    now = datetime.now(UTC)
    for line in lines:
        if isinstance(line, Flaw):
            yield line
            continue
        reading = line.reading
        reading.correction_in_effect = reading.machined_at = None
        try:
            verdict = judge(ground, entry, reading, now)
        except InbandError as refusal:
            yield Flaw(line.number, refusal.errors[0].field if refusal.errors else "", "", refusal.detail)
            continue
        assert not isinstance(verdict, Stored)
        made = verdict.correction
        yield answer(
            characteristic,
            verdict.record(),
            parameters,
            correction=(made.tool_memory, made.amount) if made else None,
            alarms=[(number, alarm.kind) for number, alarm in enumerate(verdict.alarms, start=1)],
            results=verdict.results,
        )
        if tool is not None and made is not None and made.status != "held":
            tool.total += made.amount
        if verdict.decision.code is Code.IMPLAUSIBLE:
            stream.level = None  # somebody has looked, and the next reading begins anew
        _as_if_done(ground, stream)


def _as_if_done(ground: Ground, stream: StreamState) -> None:
    """Everything this reading asked for has been done when the next one comes, and is forgotten."""
    stream.paused_by = None
    stream.alarms.clear()
    ground.tool_alarms.clear()
    ground.raised.clear()
    ground.issued.clear()
    ground.verdicts.clear()
    ground.by_key.clear()
    if stream.tool is not None:
        stream.tool.corrections.clear()
        stream.tool.forget()
