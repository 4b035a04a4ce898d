"""Alarms of kind `signal`: one per characteristic while nobody has acknowledged it, which names all signals since."""

from collections.abc import Sequence
from typing import Any

from sqlalchemy.orm import Session

from app.core.spc.rules import RuleName
from app.core.spc.shewhart import Chart
from app.loop.alarm_response import queries as alarm_queries
from app.loop.alarms import actions as alarms
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.machines.queries import lock_machines
from app.loop.tables.alarms import Alarm
from app.quality.chart_signals.alarm_kinds import SIGNAL
from app.quality.chart_signals.tables import Signal
from app.quality.chart_signals.wording import data_of

MOST = 12  # signals that one alarm names; the newest of each rule and side


def raise_alarm(session: Session, current: CurrentCharacteristic, signals: list[Signal]) -> dict[str, Any]:
    """Raise the alarm of a characteristic, or add to the one that is active; the event that tells of it.

    A run is one count; of the same rule it goes on with the entry that is there.
    """
    lock_machines(session, [current.machine.id])
    key = current.characteristic.key
    before = alarm_queries.alarms(session, state="active", kind=SIGNAL.name, limit=1, characteristic=key)
    entries: list[dict[str, Any]] = list(before[0].alarm.data["signals"]) if before else []
    for signal in signals:
        new = data_of(signal)
        same = [entry for entry in entries if _same(entry, new)]
        entries = [entry for entry in entries if entry not in same]
        entries.append(new | {"runs": 1 + sum(entry.get("runs", 1) for entry in same)})
    entries = entries[-MOST:]
    alarm = alarms.raise_for_characteristic(
        session,
        current.machine.id,
        current.characteristic.id,
        current.parameters.tool_memory,
        SIGNAL,
        {"characteristic": key, "signals": entries, "readings": _single(entries)},
    )
    alarm.count += len(signals) - 1
    alarm.sequence = min(alarm.sequence or signals[0].first_sequence, *(signal.first_sequence for signal in signals))
    alarm.last_sequence = max(signal.last_sequence for signal in signals)
    for signal in signals:
        signal.alarm = alarm.id
    session.flush()
    return alarms.news(current.machine.key, alarm) | {"characteristic": key}


def _same(one: dict[str, Any], other: dict[str, Any]) -> bool:
    return all(one[name] == other[name] for name in ("chart", "rule", "side"))


def _single(entries: Sequence[dict[str, Any]]) -> list[int]:
    """The reading that may be a false one: where all that is reported is one point beyond the limits."""
    if len(entries) != 1 or entries[0]["points"] != 1 or entries[0].get("runs", 1) != 1:
        return []
    of_reading = (entries[0]["chart"], entries[0]["rule"]) == (Chart.INDIVIDUALS, RuleName.NELSON_1)
    return [entries[0]["last"]] if of_reading else []


def extend_alarms(session: Session, grown: Sequence[Signal]) -> None:
    """Say of active alarms how far the runs have come that go on; the alarm is not raised again."""
    for signal in grown:
        if signal.alarm is None:
            continue
        alarm = session.get(Alarm, (signal.machine_id, signal.alarm), populate_existing=True)
        if alarm is None or alarm.acknowledged_at is not None:
            continue
        entries = [
            entry | data_of(signal) if entry["signal"] == signal.id else entry
            for entry in alarm.data.get("signals", [])
        ]
        alarm.data = alarm.data | {"signals": entries, "readings": _single(entries)}
        alarm.last_sequence = max(alarm.last_sequence or 0, signal.last_sequence)
        session.flush()
