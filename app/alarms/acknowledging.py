"""Acknowledging an alarm: a person says what it was, and what follows from that follows at once, in one transaction.

tool_replaced   open corrections of the tool are superseded, averages and tool life begin again (once per tool change,
                however many alarms the worn tool has raised)
keep_cutting    the held correction is released to the machine
false_reading   the readings behind it are excluded; what they led to is withdrawn unless it is applied already
noted           nothing else

Whichever it is, a characteristic that was paused by the alarm goes on.
"""

from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any, Literal

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from app.alarms import queries, wording
from app.alarms.queries import AlarmRow
from app.audit.actions import record
from app.characteristics.tables import Characteristic
from app.db.events import publish
from app.errors import Conflict, FieldError, Invalid
from app.machines.queries import lock_machines
from app.offsets import actions as offsets
from app.offsets import queries as offset_queries
from app.offsets.tables import Correction
from app.people.callers import Caller
from app.readings import actions as readings
from app.readings import queries as reading_queries
from app.readings.tables import Stream
from app.web.i18n import _

Action = Literal["tool_replaced", "keep_cutting", "false_reading", "noted"]
ACTIONS: tuple[Action, ...] = ("tool_replaced", "keep_cutting", "false_reading", "noted")
Outcome = list[dict[str, Any]]
NO_OFFSET = 0.0


def acknowledge(
    session: Session, number: int, action: Action, comment: str, caller: Caller, *, offset: float | None = None
) -> AlarmRow:
    """Say what an active alarm was.

    ``offset`` (mm) is what the new tool starts with, for `tool_replaced` only.
    Raises `NotFound`; `Conflict` when somebody was first, saying who; `Invalid` when the action cannot be meant.
    """
    lock_machines(session, [queries.alarm(session, number).alarm.machine_id])
    row = queries.alarm(session, number)
    alarm = row.alarm
    if alarm.acknowledged_at is not None:
        raise Conflict(
            wording.was_first(alarm),
            _("There is nothing left to do. What followed stands with the alarm."),
            acknowledged_by=alarm.acknowledged_by,
            acknowledged_at=alarm.acknowledged_at.isoformat(),
            action=alarm.action,
        )
    if offset is not None and action != "tool_replaced":
        wrong = _("is only meant with the action tool_replaced: it is what the new tool starts with")
        raise Invalid(f"offset: {wrong}.", _("Leave it out."), errors=[FieldError("offset", wrong)])
    if action == "tool_replaced" and alarm.tool_memory is None:
        wrong = _("cannot be tool_replaced: this alarm is about no tool, its characteristic only measures (R10 = 0)")
        raise Invalid(
            f"action: {wrong}.", _("Choose false_reading or noted instead."), errors=[FieldError("action", wrong)]
        )

    follows: dict[Action, Callable[[], Outcome]] = {
        "tool_replaced": lambda: _tool_replaced(session, row, comment, caller, offset),
        "keep_cutting": lambda: _keep_cutting(session, row, comment, caller),
        "false_reading": lambda: _false_reading(session, row, comment, caller),
        "noted": lambda: [] if row.held is None else [{"code": "still_held", "number": row.held.number}],
    }
    outcome = [*follows[action](), *_resume(session, row)]
    alarm.acknowledged_at, alarm.acknowledged_by = datetime.now(UTC), caller.name
    alarm.action, alarm.comment, alarm.outcome = action, comment, outcome
    record(
        session,
        caller.name,
        "alarm acknowledged",
        f"alarm/{alarm.id}",
        {"state": "active"},
        {"state": "acknowledged", "action": action, "outcome": outcome},
        comment,
    )
    publish(
        session,
        {
            "kind": "alarm",
            "machine": row.machine.key,
            "characteristic": row.characteristic.key if row.characteristic else None,
            "tool": alarm.tool_memory,
            "id": alarm.id,
            "alarm": alarm.kind,
            "state": "acknowledged",
            "action": action,
        },
    )
    return queries.alarm(session, number)


def _tool_replaced(session: Session, row: AlarmRow, comment: str, caller: Caller, offset: float | None) -> Outcome:
    """A tool that was changed since the alarm was last raised is not changed again, unless its offset is said."""
    alarm, machine = row.alarm, row.machine
    assert alarm.tool_memory is not None
    tool = offset_queries.tool(session, machine, alarm.tool_memory)
    if offset is None and tool.changed_at is not None and tool.changed_at >= alarm.last_at:
        return [{"code": "tool_changed_already", "tool": tool.number, "at": tool.changed_at.isoformat()}]
    done = offsets.change_tool(
        session, machine, alarm.tool_memory, NO_OFFSET if offset is None else offset, comment, caller
    )
    outcome: Outcome = [
        {"code": "tool_restarted", "tool": tool.number, "offset": done.tool.offset, "parts": done.parts}
    ]
    if done.superseded:
        outcome.append({"code": "corrections_superseded", "numbers": done.superseded})
    if done.averages:
        outcome.append({"code": "averages_restarted", "locations": done.averages})
    return outcome


def _keep_cutting(session: Session, row: AlarmRow, comment: str, caller: Caller) -> Outcome:
    if row.held is not None:
        released = offsets.decide(session, row.machine, row.held.number, "release", comment, caller).correction
        return [{"code": "correction_released", "number": released.number, "amount": released.amount}]
    if row.alarm.kind != "tool_worn":
        return []
    return [{"code": "nothing_held"}]


def _false_reading(session: Session, row: AlarmRow, comment: str, caller: Caller) -> Outcome:
    characteristic, sequences = queries.readings_behind(session, row)
    entry = reading_queries.entry_of(session, characteristic) if characteristic else None
    if entry is None or not sequences:
        wrong = _("cannot be false_reading: this alarm does not come from a reading")
        raise Invalid(f"action: {wrong}.", _("Choose noted instead."), errors=[FieldError("action", wrong)])
    done = readings.exclude_all(session, entry, sequences, caller.name, comment)
    before = sorted(set(sequences) - set(done))
    outcome: Outcome = []
    if done:
        outcome.append({"code": "readings_excluded", "characteristic": entry.characteristic, "sequences": done})
    if before:
        outcome.append(
            {"code": "readings_excluded_before", "characteristic": entry.characteristic, "sequences": before}
        )
    led_to = queries.corrections_of(session, entry.machine_id, entry.characteristic_id, sequences)
    return outcome + [_withdraw(session, row, correction, comment, caller) for correction in led_to]


def _withdraw(session: Session, row: AlarmRow, correction: Correction, comment: str, caller: Caller) -> dict[str, Any]:
    if correction.status == "applied":
        return {"code": "correction_applied", "number": correction.number, "amount": correction.amount}
    offsets.decide(session, row.machine, correction.number, "rejected", comment, caller)
    return {"code": "correction_withdrawn", "number": correction.number, "amount": correction.amount}


def _resume(session: Session, row: AlarmRow) -> Outcome:
    paused = session.scalars(
        update(Stream)
        .where(Stream.machine_id == row.alarm.machine_id, Stream.paused_by == row.alarm.id)
        .values(paused_by=None)
        .returning(Stream.characteristic_id)
        .execution_options(synchronize_session=False)
    ).all()
    keys = session.scalars(
        select(Characteristic.key)
        .where(Characteristic.machine_id == row.alarm.machine_id, Characteristic.id.in_(paused))
        .order_by(Characteristic.key)
    )
    return [{"code": "resumed", "characteristic": key} for key in keys]
