"""The guards before each correction: corrections that do the opposite of what they ask, too much, or nothing for parts out of tolerance,
or act before they are counted.

Judged by `app.core.opposite_effect`, `app.core.overshoot`, `app.core.early` and `app.core.still_out` on the newest parts of the stream (`PendingStream.parts`), when the
next correction would go out; each pauses the tool. A reading that asks for nothing is not judged, it is only remembered: the quiet readings of a
batch included (`columnar`).
"""

from collections.abc import Sequence
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.core.decision.decide import Decision
from app.core.decision.limits import Zone, nanometres
from app.core.decision.step import Action
from app.core.early import acts_early
from app.core.opposite_effect import LONGEST, Opposed, Step, against, expected_scatter, newest_gain, opposed
from app.core.overshoot import Overshoot, overshoot
from app.core.still_out import IN_VAIN, Judged, still_out
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.doubts import follow_statuses
from app.loop.readings.writer.pending import PendingAlarm, PendingStream, PendingTool, PendingWrites
from app.loop.readings.writer.snapshot import Part
from app.loop.tables.tools import EARLY, OPPOSITE, STILL_OUT, STRONG

Fault = tuple[str, dict[str, Any]]
"""Kind of the alarm that pauses a tool, and its data."""


def part_of(sequence: int, decision: Decision, compensated: float) -> Part:
    """Return what a reading tells of the effect of corrections. compensated: the sum of those its part was cut with, mm."""
    outstanding = decision.decided - decision.deviation
    return Part(sequence, decision.deviation, compensated, outstanding, decision.action is Action.CORRECT)


def remember(stream: PendingStream, sequence: int, decision: Decision, compensated: float | None) -> None:
    """Keep a reading that tells of the effect of corrections. compensated: the sum of those its part was cut with, mm."""
    if stream.tool is not None and compensated is not None and decision.zone is not Zone.PROBE_FAULT:
        stream.parts.append(part_of(sequence, decision, compensated))


def guard_correction(
    pending: PendingWrites, stream: PendingStream, newest: Part | None, reading: ReadingIn, now: datetime
) -> PendingAlarm | None:
    """Pause the tool if its corrections do the opposite of what they ask, too much or nothing, or act before they are counted; the alarm.

    newest: what is left of the reading that asks for the next correction; None if none does.
    """
    tool = stream.tool
    if tool is None or newest is None:
        return None
    parts = [*stream.parts[1 - LONGEST :], newest]
    begin = sum(part.sequence <= stream.start.gain_from for part in parts)
    if len(parts) - begin < 3:
        return None
    fault = (
        _fault(stream, tool, parts, begin)
        or _early(stream, parts, begin, reading, now)
        or _still_out(stream, parts, begin)
    )
    return None if fault is None else paused(pending, stream, tool, newest.deviation, *fault)


def _fault(stream: PendingStream, tool: PendingTool, parts: Sequence[Part], begin: int) -> Fault | None:
    """Tell if the gain of the corrections is opposite or too strong."""
    parameters = stream.parameters
    gauged = (*_sizes(parts), parameters.factor, begin, _scatter(stream), parameters.averaging_limit)
    if (found := opposed(*gauged)) is not None:
        return OPPOSITE, _gain(tool, found)
    if (strong := overshoot(*gauged, parameters.half)) is not None:
        return STRONG, _gain(tool, strong) | {"parts": strong.parts, "out": strong.out}
    return None


def _early(stream: PendingStream, parts: Sequence[Part], begin: int, reading: ReadingIn, now: datetime) -> Fault | None:
    """Tell if corrections act before they are counted."""
    parameters = stream.parameters
    if parameters.rules.of_tool or not any(part.outstanding for part in parts):
        return None
    outstanding = np.array([part.outstanding for part in parts])
    after, share, error = acts_early(*_sizes(parts), outstanding, parameters.factor, begin, _scatter(stream))
    if after < 0:
        return None
    said: dict[str, Any] = {"after": after, "share": round(share, 3), "error": round(error, 3), "by": "confirmation"}
    if reading.correction_in_effect is not None:
        said["by"] = "correction_in_effect"
    elif reading.machined_at is not None:
        said |= {"by": "machined_at", "lag": round((now - reading.machined_at).total_seconds(), 1)}
    return EARLY, said


def _still_out(stream: PendingStream, parts: Sequence[Part], begin: int) -> Fault | None:
    """Tell if parts stay out of tolerance although each was corrected for. The size of a tool itself shows no correction."""
    parameters = stream.parameters
    if parameters.rules.of_tool:
        return None
    judged = [Judged(part.deviation, part.deviation + part.outstanding, part.corrected) for part in parts[begin:]]
    found = still_out(judged, parameters.limits, parameters.rules.max_step / abs(parameters.factor))
    if found is None:
        return None
    said: dict[str, Any] = found._asdict() | {"deviations": [part.deviation for part in parts[-IN_VAIN:]]}
    if (shown := newest_gain(*_sizes(parts), parameters.factor, begin, _scatter(stream))) is not None:
        said |= {"gain": round(shown[0], 3), "error": round(shown[1], 3)}
    return STILL_OUT, said


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
    found = against(*_sizes(parts), stream.parameters.factor, _scatter(stream))
    if found is not None:
        for alarm in alarms:
            alarm.data["against"] = _said(stream.tool, found)


def _sizes(parts: Sequence[Part]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return deviations, and sums of the corrections that parts were cut with."""
    return np.array([part.deviation for part in parts]), np.array([part.compensated for part in parts])


def _scatter(stream: PendingStream) -> float:
    return expected_scatter(stream.parameters.zero_range, stream.parameters.averaging_limit)


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
