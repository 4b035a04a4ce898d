"""The guard against a clock that is behind, where times alone say what a part was cut without (`app.core.clock`).

`app.core.early` finds it in the sizes, if they show it: a loop that averages follows wear by half, and they do not. The times show it
before a part is out. The time of *measurement* lies as long before its receipt in every reading for hardly another reason: the tool is
paused with the next correction. A part may be *on its way* to the gauge as long: where `machined_at` alone is sent, sizes have to show it,
and a person is asked once which of the two it is.
Where the number of a correction is sent too, time decides nothing but if the part was cut before the tool was changed; there one reading
shows it that names a correction which was issued after its part was cut.
"""

from collections.abc import Sequence
from datetime import datetime
from typing import Any, NamedTuple

from app.core.clock import FEWEST, LEAST, constant_lag
from app.core.decision.decide import Decision, ReadingAlarm
from app.core.decision.limits import nanometres
from app.core.decision.step import Code
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.correction_guards import paused
from app.loop.readings.writer.doubts import ask, cut_before_issue
from app.loop.readings.writer.pending import PendingAlarm, PendingStream, PendingWrites
from app.loop.readings.writer.snapshot import Arrival
from app.loop.tables.tools import EARLY


def time_decides(stream: PendingStream, reading: ReadingIn, compensated: float | None, *, previous_tool: bool) -> bool:
    """Tell if time alone says that the part was cut without applied corrections, or, as the tool was measured, before that was changed."""
    tool, of_tool = stream.tool, stream.parameters.rules.of_tool
    at = reading.machined_at or (reading.measured_at if of_tool else None)
    if tool is None or at is None:
        return False
    if previous_tool:
        return tool.reset_at is not None and at < tool.reset_at
    if of_tool or compensated is None or reading.correction_in_effect is not None:
        return False
    return nanometres(tool.total) != nanometres(compensated)


class Lag(NamedTuple):
    """By how much a clock is behind, s. number: of the correction that shows it; None: the newest readings do."""

    seconds: float
    number: int | None = None


def lag_with(
    pending: PendingWrites, stream: PendingStream, reading: ReadingIn, arrival: Arrival, *, timed: bool
) -> Lag | None:
    """Keep when the reading that is decided now came in; by how much its clock is behind, if it is, and if that matters.

    timed: it does, by `time_decides`.
    """
    if stream.tool is not None:
        stream.arrivals.append(arrival)
    if not timed:
        return None
    newest = _newest(stream)
    lag = constant_lag(
        [each.received_at.timestamp() for each in newest], [each.measured_at.timestamp() for each in newest]
    )
    if lag is not None:
        return Lag(lag)
    certain = cut_before_issue(pending, stream.tool, reading)
    return None if certain is None else Lag(certain, reading.correction_in_effect)


def _newest(stream: PendingStream) -> list[Arrival]:
    return [each for each in stream.arrivals[-FEWEST:] if each.sequence > stream.start.gain_from]


def behind(
    pending: PendingWrites, stream: PendingStream, decision: Decision, lag: Lag | None, *, previous_tool: bool
) -> PendingAlarm | None:
    """Pause the tool if the clock is behind (`lag_with`), by which alone it is known what the part was cut without; the alarm."""
    tool = stream.tool
    if tool is None or lag is None or lag.seconds < LEAST or not (previous_tool or decision.amount is not None):
        return None
    said: dict[str, Any] = {"by": "clock", "before": previous_tool, "lag": round(lag.seconds, 1)}
    said |= {"readings": FEWEST} if lag.number is None else {"number": lag.number}
    return paused(pending, stream, tool, decision.deviation, EARLY, said)


def ask_of_clock(
    pending: PendingWrites, stream: PendingStream, reading: ReadingIn, decision: Decision, *, timed: bool
) -> PendingAlarm | None:
    """Ask if the clock is behind or the parts are on their way, where the next correction goes by `machined_at` alone; the alarm.

    Or where by that none goes out, as the part counts as cut before the tool was changed. timed: time decides, by `time_decides`.
    """
    before = decision.code is Code.BEFORE_TOOL_CHANGE
    if not timed or reading.measured_at is not None or not (before or decision.amount is not None):
        return None
    newest = _newest(stream)
    cut = [each.machined_at.timestamp() for each in newest if each.machined_at is not None]
    lag = constant_lag([each.received_at.timestamp() for each in newest], cut) if len(cut) == len(newest) else None
    if lag is None:
        return None
    data: dict[str, Any] = {"why": "clock", "before": before, "lag": round(lag, 1), "readings": FEWEST}
    data |= {"characteristic": stream.entry.characteristic, "of_tool": stream.parameters.tool_memory}
    return ask(pending, stream.entry.machine_id, None, stream.sequence + 1, data)


def name_clock(alarms: Sequence[PendingAlarm], reading: ReadingIn, now: datetime) -> None:
    """Say in alarms about a deviation that time alone says what the part was cut without (`time_decides`)."""
    for alarm in alarms:
        if alarm.kind != ReadingAlarm.PROBE_FAULT.value and reading.machined_at is not None:
            alarm.data["lag"] = round((now - reading.machined_at).total_seconds(), 1)
