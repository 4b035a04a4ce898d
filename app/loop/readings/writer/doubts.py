"""Doubts about what a reading says of the corrections in effect: the number that it names cannot be right, or only perhaps.

The reading is decided by its number all the same, which is the best that is known; the alarm asks what does not fit. Each doubt is
raised once in 90 days: after its answer the machine may go on naming that number until it has applied the next one. What was answered
of a clock holds for a lag like that one; a clock that goes wrong later is asked about again.
"""

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

from app.core.clock import behind_by, explained
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.pending import PendingAlarm, PendingStream, PendingTool, PendingWrites
from app.loop.tables.tools import DOUBT

LET_GO = ("pending", "applied")


def fell(pending: PendingWrites, tool: PendingTool | None, number: int | None) -> bool:
    """Tell if no machine should have applied the correction that a reading names: it waits for a person, or has fallen."""
    named = None if tool is None or number is None else pending.named_correction(tool.machine_id, number)
    return named is not None and named.status is not None and named.status not in LET_GO


def cut_before_issue(pending: PendingWrites, tool: PendingTool | None, reading: ReadingIn) -> float | None:
    """By how much at least the part was cut, as it says, before the correction was issued that it names, s; None where it may be so."""
    number, cut = reading.correction_in_effect, reading.machined_at
    named = None if tool is None or number is None else pending.named_correction(tool.machine_id, number)
    if named is None or named.issued_at is None or cut is None:
        return None
    return behind_by(cut.timestamp(), named.issued_at.timestamp())


def doubt(pending: PendingWrites, stream: PendingStream, reading: ReadingIn, sequence: int) -> PendingAlarm | None:
    """Return the alarm that asks about the number of a reading, or None."""
    tool, number = stream.tool, reading.correction_in_effect
    named = None if tool is None or number is None else pending.named_correction(tool.machine_id, number)
    if tool is None or named is None or named.status is None:
        return None
    data: dict[str, Any] = {"characteristic": stream.entry.characteristic, "number": number}
    if fell(pending, tool, number):
        data |= {"why": "fell", "status": named.status}
    elif cut_before_issue(pending, tool, reading) is not None and reading.machined_at and named.issued_at:
        data |= {
            "why": "not_issued",
            "machined_at": reading.machined_at.isoformat(),
            "issued_at": named.issued_at.isoformat(),
        }
    else:
        return None
    data["of_tool"] = named.tool_memory
    return ask(pending, tool.machine_id, tool.number, sequence, data)


def ask(
    pending: PendingWrites, machine_id: int, tool_memory: int | None, sequence: int, data: dict[str, Any]
) -> PendingAlarm:
    """Raise the alarm that asks about a reading, or add to the one that these readings have raised. tool_memory: None for all of the machine."""
    at = (machine_id, tool_memory or 0, DOUBT)
    alarm = pending.tool_alarms.get(at)
    if alarm is None:
        alarm = pending.tool_alarms[at] = PendingAlarm(
            machine_id=machine_id, characteristic_id=None, tool_memory=tool_memory, kind=DOUBT, sequence=sequence
        )
        pending.raised.append(alarm)
    alarm.data, alarm.last_sequence = data, sequence
    alarm.count += 1
    return alarm


def follow_statuses(pending: PendingWrites, tool: PendingTool) -> None:
    """Let what is known of named corrections follow those that these readings have changed."""
    for correction in tool.written():
        at = (tool.machine_id, correction.number)
        if (named := pending.named_correction(*at)) is not None:
            pending.named[at] = named._replace(status=correction.status)


class Answered(NamedTuple):
    """A doubt that has been answered. lag: by how much the clock was behind, s; None where it was not about a clock."""

    machine_id: int
    tool_memory: int
    why: str
    number: int
    lag: float | None = None

    def settles(self, alarm: PendingAlarm) -> bool:
        """Tell if this alarm need not be raised after it."""
        data = alarm.data
        same = (alarm.machine_id, alarm.tool_memory or 0, data["why"], data.get("number", 0)) == self[:4]
        return same and (self.lag is None or "lag" not in data or explained(data["lag"], self.lag))


def leave_out_answered(pending: PendingWrites, answered: Iterable[Answered]) -> None:
    """Drop doubts that have been answered."""
    known = list(answered)
    gone = {id(alarm) for alarm in doubts(pending) if any(each.settles(alarm) for each in known)}
    if gone:
        pending.raised = [alarm for alarm in pending.raised if id(alarm) not in gone]
        for verdict in pending.verdicts:
            verdict.alarms = [alarm for alarm in verdict.alarms if id(alarm) not in gone]


def doubts(pending: PendingWrites) -> Iterator[PendingAlarm]:
    """The doubts among the alarms that these readings raise."""
    return (alarm for alarm in pending.raised if alarm.kind == DOUBT)
