"""Confirmations of machines: a correction is in effect, and the control now holds this offset.

Repeating one is harmless, also after a lost answer: the second gets the answer of the first. When the offset in the
control differs from the expected one, it is not known with which offset a part was cut, so the tool is paused until a
person has confirmed the true offset. Lengths are mm.
"""

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import NamedTuple

from sqlalchemy import or_, select
from sqlalchemy.orm import Session

from app.access.callers import Caller
from app.core.decision.limits import nanometres
from app.core.decision.step import DECIMALS, rounded
from app.db.events import publish
from app.errors import Conflict
from app.language.i18n import _
from app.loop.alarms import actions as alarms
from app.loop.characteristics.correction_actions import supersede
from app.loop.characteristics.correction_queries import correction_changed, open_corrections
from app.loop.machines.queries import lock_machines
from app.loop.tables.alarms import Alarm
from app.loop.tables.machines import Machine
from app.loop.tables.tools import Correction, Tool, ToolEvent
from app.loop.tools import queries, stated_times, wording
from app.loop.tools.actions import Decided, locked, record_status
from app.loop.tools.alarm_kinds import OFFSET_DIFFERS
from app.loop.tools.events import alarm_raised, tool_changed
from app.loop.tools.queries import OFFSET_TOLERANCE

BY_READING = "reading "  # how `applied_by` begins when a reading confirmed it (`correction_in_effect`)


def mark_applied(
    session: Session,
    machine: Machine,
    number: int,
    caller: Caller,
    *,
    offset_after: float | None = None,
    applied_at: datetime | None = None,
    mapping: str | None = None,
) -> Decided:
    """A pending correction is in the offset now. Saying so twice is harmless.

    A machine that applies everything it has fetched and then confirms one after the other, in whatever order, reports the
    last offset each time: if that is what earlier and later pending corrections of the tool lead to, they are in effect,
    too. Any other offset than the expected one raises *offset differs*, becomes the known offset and pauses the tool; so
    does one that a machine reports with a correction that may not be in the offset. mapping: hash of the mapping by which
    a bridge converted it for the control.
    An `applied_at` before the correction was issued raises *correction in doubt*.
    Raises `NotFound`; `Conflict` for a correction that is not pending, or when another offset is reported the second time.
    """
    correction = locked(session, machine, number)
    if correction.status not in {"pending", "applied"}:
        raise _may_not_be_in(session, machine, correction, caller, offset_after)
    correction.mapping = correction.mapping or mapping
    if correction.status == "applied":
        if offset_after is None or not _differs(offset_after, correction.offset_after):
            return Decided(correction)
        if not (correction.applied_by or "").startswith(BY_READING):
            raise _other_offset(correction, machine, offset_after)
        # A reading said that it is in effect; only now the machine says what its offset is.
        tool = queries.tool(session, machine, correction.tool_memory)
        late = offset_after - (correction.offset_after or 0.0)
        now = datetime.now(UTC)
        return _reported(
            session, machine, correction, [correction], tool, caller, tool.offset + late, tool.offset, tool.offset, now
        )
    tool = queries.tool(session, machine, correction.tool_memory)
    together = _with_others(session, machine, tool, correction, offset_after)
    now = datetime.now(UTC)
    at = min(now, applied_at or now)
    if applied_at is not None:
        stated_times.ask_of_time(session, machine, correction, applied_at)
    for pending in together:
        before, tool.offset = tool.offset, rounded(tool.offset + pending.amount)
        tool.total = rounded(tool.total + pending.amount)
        pending.status, pending.applied_at, pending.applied_by, pending.offset_after = (
            "applied",
            at,
            caller.name,
            tool.offset,
        )
        pending.mapping = mapping
        if pending is not together[-1]:
            _step(session, machine, tool, pending.number, before, tool.offset, at, caller)
        if caller.kind != "machine":  # what a machine does all day is in the history of its tools
            record_status(session, machine, pending, caller, "correction applied", "pending", None)
    reported = tool.offset if offset_after is None else offset_after
    done = _reported(session, machine, correction, together, tool, caller, reported, tool.offset, before, at)
    if caller.kind == "machine" or done.note is not None:
        return done
    return done._replace(note=wording.named_by_readings(correction, queries.named_when_asked(session, correction)))


def _may_not_be_in(
    session: Session, machine: Machine, correction: Correction, caller: Caller, offset_after: float | None
) -> Conflict:
    """The refusal of a confirmation of what awaits a person or has fallen.

    What the control holds is true all the same, and nobody at a machine reads the answer: as any other reported offset it is
    stored, although the confirmation is refused.
    """
    detail, instead = wording.refused(correction, machine.key, "applied")
    if offset_after is not None and caller.kind == "machine":
        note = report_offset(session, machine, correction.tool_memory, offset_after, caller).note
        session.commit()
        instead = note or instead
    return Conflict(detail, instead, correction_status=correction.status)


def _with_others(
    session: Session, machine: Machine, tool: Tool, correction: Correction, offset_after: float | None
) -> list[Correction]:
    """This correction and the pending ones that the reported offset holds as well, in their order."""
    alone = round(tool.offset + correction.amount, DECIMALS)
    if offset_after is None or not _differs(offset_after, alone):
        return [correction]
    later = _leading_to(session, machine, tool, offset_after, alone, correction.number)
    led = [] if later else _leading_to(session, machine, tool, offset_after, tool.offset)
    return led if correction in led else [correction, *later]


def _leading_to(
    session: Session, machine: Machine, tool: Tool, offset: float, running: float, after: int = 0
) -> list[Correction]:
    """The pending corrections beyond number `after` that lead from `running` to this offset; none if they do not."""
    led: list[Correction] = []
    for waiting in open_corrections(session, machine, tool.number):
        if waiting.status == "pending" and waiting.number > after:
            led.append(waiting)
            running = round(running + waiting.amount, DECIMALS)
            if not _differs(offset, running):
                return led
    return []


def _reported(
    session: Session,
    machine: Machine,
    correction: Correction,
    confirmed: Sequence[Correction],
    tool: Tool,
    caller: Caller,
    reported: float,
    expected: float,
    before: float,
    at: datetime,
) -> Decided:
    """These corrections are in the offset, and this is the offset now; another one than expected pauses the tool.

    correction: the one that was confirmed; before: the offset before the last of them was applied.
    """
    last = confirmed[-1]
    tool.offset = rounded(reported)
    for applied in confirmed:  # what was reported, so that saying it again is recognised
        applied.offset_after, applied.applied_by = tool.offset, caller.name
    _step(session, machine, tool, last.number, before, tool.offset, at, caller)
    changes = [
        *(correction_changed(session, machine, applied) for applied in confirmed),
        tool_changed(machine, tool.number),
    ]
    if not _differs(tool.offset, expected):
        publish(session, *changes)
        return Decided(correction)
    assumed = _is_assumed(session, machine, tool, [applied.number for applied in confirmed])
    alarm, fallen = _pause(session, machine, tool, expected, correction.number, assumed=assumed)
    changes += [correction_changed(session, machine, superseded) for superseded in fallen]
    publish(session, *changes, alarm_raised(machine, alarm))
    return Decided(
        correction,
        wording.offset_differs(alarm.id, expected, tool.offset, [superseded.number for superseded in fallen]),
    )


def _pause(
    session: Session, machine: Machine, tool: Tool, expected: float, correction: int | None, *, assumed: bool
) -> tuple[Alarm, Sequence[Correction]]:
    """Nothing is corrected through this tool until a person has said which offset is true: the alarm, and what fell.

    assumed: the offset before was never entered, so nobody need have changed it.
    """
    alarm = alarms.raise_for_tool(
        session,
        machine.id,
        tool.number,
        OFFSET_DIFFERS,
        {
            "correction": correction,
            "expected": expected,
            "reported": tool.offset,
            "limit": OFFSET_TOLERANCE / 1e6,
            "assumed": assumed,
        },
    )
    tool.paused_by = alarm.id
    return alarm, supersede(
        session,
        open_corrections(session, machine, tool.number),
        datetime.now(UTC),
        None,
        f"{wording.PAUSED} {alarm.id}",
    )


class Report(NamedTuple):
    """A reported offset: the tool, the pending corrections that explain it, and those that fell because nothing does."""

    tool: Tool
    differs: bool
    explained_by: Sequence[int] = ()
    superseded: Sequence[int] = ()
    note: str | None = None


def report_offset(
    session: Session, machine: Machine, number: int, offset: float, caller: Caller, *, none_applied: bool = False
) -> Report:
    """The control holds this offset; no correction is confirmed by that.

    Nothing happens if it is the known one, or the one that pending corrections of the tool lead to: the control has applied
    them, and their confirmations are on the way. none_applied: the reporter knows better: no pending correction is in it, so
    an edit that happens to hit such an offset is seen. Any other becomes the known offset, raises *offset differs* and pauses the
    tool. Raises `NotFound`.
    """
    lock_machines(session, [machine.id])
    tool = queries.tool(session, machine, number)
    if not _differs(offset, tool.offset):
        return Report(tool, differs=False)
    explained = [] if none_applied else _leading_to(session, machine, tool, offset, tool.offset)
    if explained:
        return Report(tool, differs=False, explained_by=[correction.number for correction in explained])
    asked = session.get(Alarm, (machine.id, tool.paused_by)) if tool.paused_by else None
    expected = (
        tool.offset if asked is None else asked.data.get("expected", tool.offset)
    )  # a second report: still of the first question
    assumed = _is_assumed(session, machine, tool) if asked is None else bool(asked.data.get("assumed"))
    before, tool.offset = tool.offset, rounded(offset)
    _step(session, machine, tool, None, before, tool.offset, datetime.now(UTC), caller)
    alarm, fallen = _pause(session, machine, tool, expected, None, assumed=assumed)
    publish(
        session,
        tool_changed(machine, tool.number),
        *(correction_changed(session, machine, superseded) for superseded in fallen),
        alarm_raised(machine, alarm),
    )
    numbers = [superseded.number for superseded in fallen]
    note = wording.offset_differs(alarm.id, expected, tool.offset, numbers)
    return Report(tool, differs=True, superseded=numbers, note=note)


def _is_assumed(session: Session, machine: Machine, tool: Tool, confirmed: Sequence[int] = ()) -> bool:
    """Tell if the offset was 0 by assumption before these corrections: the history of the tool holds no other step."""
    other = select(ToolEvent.id).where(
        ToolEvent.machine_id == machine.id,
        ToolEvent.number == tool.number,
        or_(ToolEvent.correction.is_(None), ToolEvent.correction.not_in(confirmed)),
    )
    return session.scalar(other.limit(1)) is None


def _step(
    session: Session,
    machine: Machine,
    tool: Tool,
    number: int | None,
    before: float,
    after: float,
    at: datetime,
    caller: Caller,
) -> None:
    """Keep a step of the offset: by a correction, or as the machine has reported it without one."""
    session.add(
        ToolEvent(
            machine_id=machine.id,
            number=tool.number,
            at=at,
            kind="edit" if number is None else "correction",
            offset_before=before,
            offset_after=after,
            correction=number,
            actor=caller.name,
        )
    )


def _differs(offset: float, known: float | None) -> bool:
    return known is not None and abs(nanometres(offset - known)) > OFFSET_TOLERANCE


def _other_offset(correction: Correction, machine: Machine, offset_after: float) -> Conflict:
    return Conflict(
        _(
            "Correction {number} of {machine} was confirmed with the offset {known} mm already, not {reported} mm. Nothing was changed."
        ).format(number=correction.number, machine=machine.key, known=correction.offset_after, reported=offset_after),
        _("Enter the present offset by a manual edit of tool {tool}.").format(tool=correction.tool_memory),
        correction_status=correction.status,
    )
