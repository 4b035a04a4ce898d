"""Acknowledging an alarm: a person says what it was, and what follows from that follows at once, in one transaction.

tool_replaced   open corrections of the tool are superseded, averages and tool life begin again (once per tool change,
                however many alarms the worn tool has raised)
keep_cutting    the held correction is released to the machine; a jump was true, and readings are expected there from now on;
                dropped instead where readings since then speak against it
false_reading   the readings behind it are excluded; what they led to is withdrawn unless it is applied already
sister_tool     the characteristics of the tool correct its sister from now on
offset_set      this offset is true: handled as a manual edit (*offset differs* only, which a person answers so)
measured_by_hand  a person has measured the part: a size, a verdict or both, kept beside the reading; nothing else
noted           nothing else; at *offset differs* the offset that the machine has reported is true

Whichever it is, a characteristic or a tool that was paused by the alarm goes on. The reaction plan that holds may ask for a cause
and a corrective action of the plant's catalogue; the alarm keeps the version of the plan that it was handled with.
"""

from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.core.plausibility import offset_warnings
from app.db.events import publish
from app.errors import Conflict, FieldError, Invalid
from app.language.i18n import _
from app.loop.alarm_response import by_hand, queries, wording
from app.loop.alarm_response.by_hand import ByHand
from app.loop.alarm_response.queries import AlarmRow
from app.loop.alarm_response.reaction_queries import Handled, Reactions
from app.loop.alarms.actions import news
from app.loop.alarms.kinds import Action
from app.loop.alarms.reading_kinds import HOLDING, IMPLAUSIBLE, TOOL_WORN
from app.loop.machines.queries import lock_machines
from app.loop.readings import actions as readings
from app.loop.readings import queries as reading_queries
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.readings import Stream
from app.loop.tables.tools import Correction
from app.loop.tools import actions as tool_actions
from app.loop.tools import queries as tool_queries
from app.loop.tools import sister_actions
from app.loop.tools.alarm_kinds import OFFSET_DIFFERS

Outcome = list[dict[str, Any]]
NO_OFFSET = 0.0
NOT_MEASURED = ByHand()
NOTHING_SAID = Handled()


def acknowledge(
    session: Session,
    number: int,
    action: Action,
    comment: str,
    caller: Caller,
    *,
    offset: float | None = None,
    changed_by: str | None = None,
    hand: ByHand = NOT_MEASURED,
    handled: Handled = NOTHING_SAID,
) -> AlarmRow:
    """Say what an active alarm was.

    ``offset`` (mm) is what the new tool starts with (`tool_replaced`), or the one that is true (`offset_set`, where
    ``changed_by`` says who has changed it at the control). ``hand``: what was found by hand, kept beside the reading.
    ``handled``: cause and corrective action of the catalogue.
    Raises `NotFound`; `Conflict` when someone else was first, saying who; `Invalid` when the action cannot be meant.
    """
    lock_machines(session, [queries.alarm(session, number).alarm.machine_id])
    row = queries.alarm(session, number)
    alarm = row.alarm
    if alarm.acknowledged_at is not None:
        raise Conflict(
            wording.was_first(alarm),
            _("There is nothing left to do. The alarm shows what followed."),
            acknowledged_by=alarm.acknowledged_by,
            acknowledged_at=alarm.acknowledged_at.isoformat(),
            action=alarm.action,
        )
    reactions = Reactions(session)
    _refuse(row, action, offset, changed_by, hand, reactions.wrong(row, handled))
    plan = reactions.plan_of(row)
    handled_with = (None, None) if plan is None else (plan.id, plan.version)  # what follows may expire the plan
    follows: dict[Action, Callable[[], Outcome]] = {
        "tool_replaced": lambda: _tool_replaced(session, row, comment, caller, offset),
        "keep_cutting": lambda: _keep_cutting(session, row, comment, caller),
        "false_reading": lambda: _false_reading(session, row, comment, caller),
        "sister_tool": lambda: _sister_tool(session, row, comment, caller),
        "offset_set": lambda: _offset_set(session, row, comment, caller, offset, changed_by),
        "measured_by_hand": list,  # what the hand has found is all that follows
        "noted": lambda: _noted(session, row, comment, caller),
    }
    measured = by_hand.keep(session, row, hand, comment, caller) if hand.is_said else []
    outcome = [*measured, *follows[action](), *_resume(session, row)]
    alarm.acknowledged_at, alarm.acknowledged_by = datetime.now(UTC), caller.name
    alarm.action, alarm.comment, alarm.outcome = action, comment, outcome
    alarm.cause, alarm.corrective_action = handled
    alarm.reaction_plan, alarm.reaction_version = handled_with
    said = {
        "cause": reactions.name_of(handled.cause),
        "corrective_action": reactions.name_of(handled.corrective_action),
    }
    record(
        session,
        caller.name,
        "alarm acknowledged",
        f"alarm/{alarm.id}",
        {"state": "active"},
        {"state": "acknowledged", "action": action, "outcome": outcome}
        | {name: text for name, text in said.items() if text is not None},
        comment,
    )
    key = row.characteristic.key if row.characteristic else None
    publish(session, news(row.machine.key, alarm) | {"characteristic": key})
    return queries.alarm(session, number)


def _refuse(
    row: AlarmRow,
    action: Action,
    offset: float | None,
    changed_by: str | None,
    hand: ByHand,
    wrong: list[FieldError],
) -> None:
    """Raises `Invalid` for an action that cannot be meant by this alarm, and for what is wrong already."""
    if offset is not None and action not in {"tool_replaced", "offset_set"}:
        wrong.append(
            FieldError(
                "offset",
                _(
                    "is only meant with the actions tool_replaced (what the new tool starts with) and offset_set (the one that "
                    "is true); leave it out"
                ),
            )
        )
    if action == "offset_set":
        if row.alarm.kind != OFFSET_DIFFERS.name:
            wrong.append(FieldError("action", _("offset_set answers alarms of the kind offset_differs only")))
        elif offset is None:
            wrong.append(FieldError("offset", _("is missing: enter the true offset, in mm")))
    elif changed_by is not None:
        wrong.append(FieldError("changed_by", _("is only meant with the action offset_set; leave it out")))
    if action == "measured_by_hand" and row.alarm.kind == "offset_differs":
        wrong.append(FieldError("action", _("says nothing about which offset is true; choose offset_set or noted")))
    elif action == "measured_by_hand" and hand.measured is None and hand.verdict is None:
        message = _("is missing: say the size in mm, or in hand_verdict whether the part is good or scrap")
        wrong.append(FieldError("hand_measured", message))
    if action in {"tool_replaced", "sister_tool"} and row.alarm.tool_memory is None:
        wrong.append(
            FieldError(
                "action",
                _("cannot be {action}: this alarm is about no tool, its characteristic only measures (R10 = 0)").format(
                    action=action
                ),
            )
        )
    if wrong:
        raise Invalid.of(
            wrong,
            _(
                "Choose another action, or correct the named fields. The alarm is still active. "
                "Causes and corrective actions: GET /api/v1/reactions/catalogue."
            ),
        )


def _tool_replaced(session: Session, row: AlarmRow, comment: str, caller: Caller, offset: float | None) -> Outcome:
    """A tool that was changed since the alarm was last raised is not changed again, unless its offset is said."""
    alarm, machine = row.alarm, row.machine
    assert alarm.tool_memory is not None
    tool = tool_queries.tool(session, machine, alarm.tool_memory)
    if offset is None and tool.changed_at is not None and tool.changed_at >= alarm.last_at:
        return [{"code": "tool_changed_already", "tool": tool.number, "at": tool.changed_at.isoformat()}]
    before = tool.offset
    done = tool_actions.change_tool(
        session, machine, alarm.tool_memory, NO_OFFSET if offset is None else offset, comment, caller
    )
    outcome: Outcome = [
        {"code": "tool_restarted", "tool": tool.number, "offset": done.tool.offset, "parts": done.parts}
    ]
    if offset is None:
        outcome.append({"code": "offset_assumed", "tool": tool.number, "offset": done.tool.offset})
    else:
        outcome += _far(before, offset)
    return outcome + _followed(done.superseded, done.averages)


def _keep_cutting(session: Session, row: AlarmRow, comment: str, caller: Caller) -> Outcome:
    if row.alarm.kind not in HOLDING:
        return []
    outcome: Outcome = []
    denied = row.held is not None and row.alarm.kind == TOOL_WORN.name and _within_wear_since(session, row)
    true = not denied and _level_follows(session, row)
    if row.held is not None and (denied or (not true and row.alarm.kind == IMPLAUSIBLE.name)):
        outcome.append(_withdraw(session, row, row.held, comment, caller))
        if denied:
            outcome.append({"code": "readings_disagree"})
    elif row.held is not None:
        released = tool_actions.decide(
            session, row.machine, row.held.number, tool_actions.RELEASE, comment, caller
        ).correction
        outcome.append({"code": "correction_released", "number": released.number, "amount": released.amount})
    elif row.alarm.kind == TOOL_WORN.name:
        outcome.append({"code": "nothing_held"})
    if row.alarm.kind == IMPLAUSIBLE.name:
        outcome.append({"code": "level_followed" if true else "level_disagrees"})
    return outcome


def _within_wear_since(session: Session, row: AlarmRow) -> bool:
    """Tell if later parts came out within R37 without the held correction: it would then spoil the next part."""
    alarm = row.alarm
    last = alarm.last_sequence or alarm.sequence
    if alarm.characteristic_id is None or last is None:
        return False
    return reading_queries.within_wear_since(session, alarm.machine_id, alarm.characteristic_id, last)


def _level_follows(session: Session, row: AlarmRow) -> bool:
    """Expect readings where the jump has led, unless readings since then lie where they were expected before."""
    alarm = row.alarm
    stream = session.get(Stream, (alarm.machine_id, alarm.characteristic_id), populate_existing=True)
    last = alarm.last_sequence or alarm.sequence
    if stream is None or last is None or stream.level is None:
        return True
    if stream.level_sequence is not None and stream.level_sequence > last:
        return False
    stream.level = reading_queries.uncorrected_of(session, alarm.machine_id, stream.characteristic_id, last)
    stream.level_sequence = last
    if row.alarm.kind == IMPLAUSIBLE.name and row.held is not None and stream.average_memory:
        # Corrected in full, as in the zones within R37: the average begins again.
        tool_actions.restart_averages(session, row.machine, [stream.average_memory], datetime.now(UTC))
    session.flush()
    return True


def _sister_tool(session: Session, row: AlarmRow, comment: str, caller: Caller) -> Outcome:
    """A tool that was switched for another alarm of the same trouble is not switched again."""
    number = row.alarm.tool_memory
    assert number is not None
    tool = tool_queries.tool(session, row.machine, number)
    if tool.sister is not None and not sister_actions.on_tool(session, row.machine, number):
        return [{"code": "switched_already", "tool": number, "sister": tool.sister}]
    done = sister_actions.switch_to_sister(session, row.machine, number, comment, caller)
    outcome: Outcome = [
        {"code": "switched", "tool": number, "sister": done.sister, "characteristics": done.characteristics}
    ]
    return outcome + _followed(done.superseded, done.averages)


def _offset_set(
    session: Session, row: AlarmRow, comment: str, caller: Caller, offset: float | None, changed_by: str | None
) -> Outcome:
    """The true offset, as a manual edit; one that was entered by hand since the alarm was last raised needs no other."""
    number = row.alarm.tool_memory
    assert number is not None
    tool = tool_queries.tool(session, row.machine, number)
    if offset is None and tool.reset_at is not None and tool.reset_at >= row.alarm.last_at:
        return [{"code": "offset_told_already", "tool": number, "offset": tool.offset}]
    before, true = tool.offset, tool.offset if offset is None else offset
    reason = comment if changed_by is None else _("{who}: {why}").format(who=changed_by, why=comment)
    done = tool_actions.edit_tool(session, row.machine, number, true, reason, caller)
    outcome: Outcome = [{"code": "offset_set", "tool": number, "offset": done.tool.offset}]
    if changed_by is not None:
        outcome[0]["changed_by"] = changed_by
    outcome += _far(before, true)
    return outcome + _followed(done.superseded, done.averages)


def _followed(superseded: list[int], averages: list[int]) -> Outcome:
    """Corrections that were superseded and averages that began again with another offset of a tool, if any."""
    followed: Outcome = [{"code": "corrections_superseded", "numbers": superseded}] if superseded else []
    return followed + ([{"code": "averages_restarted", "locations": averages}] if averages else [])


def _far(before: float, offset: float) -> Outcome:
    """Ask about the unit of an offset that lies far from the one before."""
    return [{"code": "offset_far", "before": before, "offset": offset} for _warning in offset_warnings(before, offset)]


def _noted(session: Session, row: AlarmRow, comment: str, caller: Caller) -> Outcome:
    if row.alarm.kind == OFFSET_DIFFERS.name:
        return _offset_set(session, row, comment, caller, None, None)
    return [] if row.held is None else [{"code": "still_held", "number": row.held.number}]


def _false_reading(session: Session, row: AlarmRow, comment: str, caller: Caller) -> Outcome:
    characteristic, sequences = queries.readings_behind(session, row)
    entry = reading_queries.entry_of(session, characteristic) if characteristic else None
    if entry is None or not sequences:
        raise Invalid.at(
            "action",
            _("cannot be false_reading: this alarm does not come from a reading"),
            do=_("Choose noted instead."),
        )
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
    tool_actions.decide(session, row.machine, correction.number, tool_actions.REJECT, comment, caller)
    return {"code": "correction_withdrawn", "number": correction.number, "amount": correction.amount}


def _resume(session: Session, row: AlarmRow) -> Outcome:
    """Resume everything that this alarm has paused."""
    at = {"machine_id": row.alarm.machine_id, "paused_by": row.alarm.id}
    paused = session.scalars(
        update(Stream)
        .filter_by(**at)
        .values(paused_by=None, gain_from=Stream.sequence)
        .returning(Stream.characteristic_id)
        .execution_options(synchronize_session=False)
    ).all()
    tools = tool_actions.resume_tools(session, row.machine, row.alarm.id)
    keys = session.scalars(
        select(Characteristic.key)
        .where(Characteristic.machine_id == row.alarm.machine_id, Characteristic.id.in_(paused))
        .order_by(Characteristic.key)
    )
    resumed: Outcome = [{"code": "resumed", "characteristic": key} for key in keys]
    return resumed + [{"code": "tool_resumed", "tool": number} for number in tools]
