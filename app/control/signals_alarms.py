"""Alarms of kind `signal`: one per characteristic while nobody has acknowledged it, which names all signals since."""

from collections.abc import Sequence
from typing import Any

from sqlalchemy.orm import Session

from app.alarms import actions as alarms
from app.alarms import queries as alarm_queries
from app.alarms.tables import Alarm
from app.characteristics.queries import Standing
from app.control.signal_tables import Signal
from app.control.signals_wording import told
from app.core.spc.rules import RuleName
from app.core.spc.shewhart import Chart
from app.machines.queries import lock_machines

KIND = "signal"
MOST = 12  # signals that one alarm names; the newest of each rule and side


def raise_alarms(session: Session, found: Sequence[tuple[Standing, list[Signal]]]) -> list[dict[str, Any]]:
    """Raise the alarm of each characteristic, or add to the one that stands; what is told of them."""
    if not found:
        return []
    lock_machines(session, {standing.machine.id for standing, _signals in found})
    return [_raise(session, standing, signals) for standing, signals in found]


def _raise(session: Session, standing: Standing, signals: list[Signal]) -> dict[str, Any]:
    """A run is one count; of the same rule it goes on with the entry that is there."""
    key = standing.characteristic.key
    before = alarm_queries.alarms(session, state="active", kind=KIND, limit=1, characteristic=key)
    entries: list[dict[str, Any]] = list(before[0].alarm.data["signals"]) if before else []
    for signal in signals:
        new = told(signal)
        same = [each for each in entries if _same(each, new)]
        entries = [each for each in entries if each not in same]
        entries.append(new | {"runs": 1 + sum(each.get("runs", 1) for each in same)})
    entries = entries[-MOST:]
    alarm = alarms.raise_for_characteristic(
        session,
        standing.machine.id,
        standing.characteristic.id,
        standing.parameters.tool_memory,
        KIND,
        {"characteristic": key, "signals": entries, "readings": _single(entries)},
    )
    alarm.count += len(signals) - 1
    alarm.sequence = min(alarm.sequence or signals[0].first_sequence, *(each.first_sequence for each in signals))
    alarm.last_sequence = max(each.last_sequence for each in signals)
    for signal in signals:
        signal.alarm = alarm.id
    session.flush()
    return alarms.news(standing.machine.key, alarm) | {"characteristic": key}


def _same(one: dict[str, Any], other: dict[str, Any]) -> bool:
    return all(one[name] == other[name] for name in ("chart", "rule", "side"))


def _single(entries: Sequence[dict[str, Any]]) -> list[int]:
    """The reading that may be a false one: where all that is told of is one point beyond the limits."""
    if len(entries) != 1 or entries[0]["points"] != 1 or entries[0].get("runs", 1) != 1:
        return []
    told_of_reading = (entries[0]["chart"], entries[0]["rule"]) == (Chart.INDIVIDUALS, RuleName.NELSON_1)
    return [entries[0]["last"]] if told_of_reading else []


def extend_alarms(session: Session, grown: Sequence[Signal]) -> None:
    """Say of active alarms how far the runs have come that go on; the alarm is not raised again."""
    for signal in grown:
        if signal.alarm is None:
            continue
        alarm = session.get(Alarm, (signal.machine_id, signal.alarm), populate_existing=True)
        if alarm is None or alarm.acknowledged_at is not None:
            continue
        entries = [
            each | told(signal) if each["signal"] == signal.id else each for each in alarm.data.get("signals", [])
        ]
        alarm.data = alarm.data | {"signals": entries, "readings": _single(entries)}
        alarm.last_sequence = max(alarm.last_sequence or 0, signal.last_sequence)
        session.flush()
