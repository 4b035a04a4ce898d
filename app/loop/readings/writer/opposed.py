"""The guards before each correction: corrections that did the opposite of what they asked, or too much, or act before they are counted.

Judged by `app.core.gain`, `app.core.overshoot` and `app.core.early` on the newest parts of the stream (`PendingStream.parts`), when the
next correction would go out; each pauses the tool. A reading that asks for nothing is not judged, it is only remembered: the quiet readings of a
batch included (`columnar`).
"""

from collections.abc import Sequence
from datetime import datetime
from typing import Any

import numpy as np

from app.core.decision.decide import Decision
from app.core.decision.limits import Zone, nanometres
from app.core.early import acts_early
from app.core.gain import LONGEST, Opposed, Step, against, expected_scatter, opposed
from app.core.overshoot import Overshoot, overshoot
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.doubts import follow_statuses
from app.loop.readings.writer.pending import PendingAlarm, PendingStream, PendingTool, PendingWrites
from app.loop.readings.writer.snapshot import Part
from app.loop.tables.tools import EARLY, OPPOSITE, STRONG


def part_of(sequence: int, decision: Decision, compensated: float) -> Part:
    """Return what a reading tells of the effect of corrections. compensated: the sum of those its part was cut with, mm."""
    return Part(sequence, decision.deviation, compensated, decision.decided - decision.deviation)


def remember(stream: PendingStream, sequence: int, decision: Decision, compensated: float | None) -> None:
    """Keep a reading that tells of the effect of corrections. compensated: the sum of those its part was cut with, mm."""
    if stream.tool is not None and compensated is not None and decision.zone is not Zone.PROBE_FAULT:
        stream.parts.append(part_of(sequence, decision, compensated))


def pauses(
    pending: PendingWrites, stream: PendingStream, newest: Part | None, reading: ReadingIn, now: datetime
) -> PendingAlarm | None:
    """Pause the tool if its corrections do the opposite of what they ask, or too much, or act before they are counted; the alarm.

    newest: what is left of the reading that asks for the next correction; None if none does.
    """
    tool, parameters = stream.tool, stream.parameters
    if tool is None or newest is None:
        return None
    parts = [*stream.parts[1 - LONGEST :], newest]
    begin = sum(part.sequence <= stream.start.gain_from for part in parts)
    if len(parts) - begin < 3:
        return None
    deviation, compensated = (
        np.array([part.deviation for part in parts]),
        np.array([part.compensated for part in parts]),
    )
    expected = expected_scatter(parameters.zero_range, parameters.averaging_limit)
    gauged = (deviation, compensated, parameters.factor, begin, expected, parameters.averaging_limit)
    if (found := opposed(*gauged)) is not None:
        return paused(pending, stream, tool, newest.deviation, OPPOSITE, _gain(tool, found))
    if (strong := overshoot(*gauged, parameters.half)) is not None:
        seen = {"parts": strong.parts, "out": strong.out}
        return paused(pending, stream, tool, newest.deviation, STRONG, _gain(tool, strong) | seen)
    if parameters.rules.of_tool or not any(part.outstanding for part in parts):
        return None
    outstanding = np.array([part.outstanding for part in parts])
    after, share, error = acts_early(deviation, compensated, outstanding, parameters.factor, begin, expected)
    if after < 0:
        return None
    said: dict[str, Any] = {"after": after, "share": round(share, 3), "error": round(error, 3), "by": "confirmation"}
    if reading.correction_in_effect is not None:
        said["by"] = "correction_in_effect"
    elif reading.machined_at is not None:
        said |= {"by": "machined_at", "lag": round((now - reading.machined_at).total_seconds(), 1)}
    return paused(pending, stream, tool, newest.deviation, EARLY, said)


def paused(
    pending: PendingWrites, stream: PendingStream, tool: PendingTool, deviation: float, kind: str, data: dict[str, Any]
) -> PendingAlarm:
    """Pause the tool with the reading that is decided now, of this deviation, mm; the alarm."""
    alarm = PendingAlarm(
        machine_id=tool.machine_id,
        characteristic_id=None,
        tool_memory=tool.number,
        kind=kind,
        sequence=stream.sequence + 1,
        last_sequence=stream.sequence + 1,
        count=1,
        data={
            "characteristic": stream.entry.characteristic,
            "deviation": deviation,
            "factor": stream.parameters.factor,
            **data,
        },
    )
    pending.raised.append(alarm)
    pending.touched_machines.add(tool.machine_id)
    tool.pause(alarm)
    follow_statuses(pending, tool)
    return alarm


def name_correction(alarms: Sequence[PendingAlarm], stream: PendingStream, newest: Part | None) -> None:
    """Say in alarms about a deviation that the newest correction moved the size the wrong way, if it did: the sign may be the cause."""
    if not alarms or newest is None or stream.tool is None:
        return
    parts = [part for part in stream.parts[1 - LONGEST :] if part.sequence > stream.start.gain_from] + [newest]
    parameters = stream.parameters
    found = against(
        np.array([part.deviation for part in parts]),
        np.array([part.compensated for part in parts]),
        parameters.factor,
        expected_scatter(parameters.zero_range, parameters.averaging_limit),
    )
    if found is not None:
        for alarm in alarms:
            alarm.data["against"] = _said(stream.tool, found)


def _gain(tool: PendingTool, found: Opposed | Overshoot) -> dict[str, Any]:
    steps = [_said(tool, step) for step in (found.first, found.second)]
    return {"gain": round(found.gain, 3), "error": round(found.error, 3), "corrections": steps}


def _said(tool: PendingTool, step: Step) -> dict[str, Any]:
    return {
        "numbers": numbers_between(tool, step.before, step.after),
        "amount": round(step.after - step.before, 9),
        "asked": round(step.asked, 9),
        "done": round(step.done, 9),
    }


def numbers_between(tool: PendingTool, before: float, after: float) -> list[int]:
    """Return the numbers of the corrections that led from one sum of the tool's corrections to another; none if not known."""
    running, numbers, found = tool.total, list[int](), False
    for number, amount in reversed(tool.applied):
        found = found or nanometres(running) == nanometres(after)
        running -= amount
        if found:
            numbers.append(number)
            if nanometres(running) == nanometres(before):
                return numbers[::-1]
    return []
