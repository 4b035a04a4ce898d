"""The guard against a clock that is behind, where times alone say what a part was cut without (`app.core.clock`).

`app.core.early` finds it in the sizes, if they show it: a loop that averages follows wear by half, and they do not. The times show it
before a part is out. The time of *measurement* lies as long before its receipt in every reading for hardly another reason: the tool is
paused with the next correction. A part may be *on its way* to the gauge as long: where `machined_at` alone is sent, sizes have to show it.
"""

from collections.abc import Sequence
from datetime import datetime
from typing import Any

from app.core.clock import FEWEST, constant_lag
from app.core.decision.decide import Decision, ReadingAlarm
from app.core.decision.limits import nanometres
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.opposed import paused
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


def lag_with(stream: PendingStream, arrival: Arrival, *, timed: bool) -> float | None:
    """Keep when the reading that is decided now came in; by how much the newest say they were measured before that, s, if it matters.

    timed: it does, by `time_decides`.
    """
    if stream.tool is not None:
        stream.arrivals.append(arrival)
    if not timed:
        return None
    newest = [each for each in stream.arrivals[-FEWEST:] if each.sequence > stream.start.gain_from]
    received, stated = ([getattr(each, name).timestamp() for each in newest] for name in ("received_at", "measured_at"))
    return constant_lag(received, stated)


def behind(
    pending: PendingWrites, stream: PendingStream, decision: Decision, lag: float | None, *, previous_tool: bool
) -> PendingAlarm | None:
    """Pause the tool if the clock is behind (`lag_with`), by which alone it is known what the part was cut without; the alarm."""
    tool = stream.tool
    if tool is None or lag is None or not (previous_tool or decision.amount is not None):
        return None
    said: dict[str, Any] = {"by": "clock", "before": previous_tool, "readings": FEWEST, "lag": round(lag, 1)}
    return paused(pending, stream, tool, decision.deviation, EARLY, said)


def name_clock(alarms: Sequence[PendingAlarm], reading: ReadingIn, now: datetime) -> None:
    """Say in alarms about a deviation that time alone says what the part was cut without (`time_decides`)."""
    for alarm in alarms:
        if alarm.kind != ReadingAlarm.PROBE_FAULT.value and reading.machined_at is not None:
            alarm.data["lag"] = round((now - reading.machined_at).total_seconds(), 1)
