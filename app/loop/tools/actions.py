"""Actions of people and machines on corrections, tool offsets and averages.

Every verb locks the machine first: of two simultaneous decisions exactly one wins, and the other gets a `Conflict`.
Lengths are mm.
"""

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any, Literal, NamedTuple

from sqlalchemy import func, select, update
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.core.decision.limits import Zone, nanometres
from app.core.decision.step import rounded
from app.core.plausibility import empirical_value_warnings
from app.core.warning import CodedWarning
from app.db.events import publish
from app.errors import Conflict
from app.language.i18n import _
from app.loop.alarms.reading_kinds import TOOL_WORN
from app.loop.characteristics.correction_actions import supersede
from app.loop.characteristics.correction_queries import correction_changed, open_corrections
from app.loop.characteristics.queries import parts_cut
from app.loop.machines.queries import lock_machines
from app.loop.readings import queries as reading_queries
from app.loop.tables.alarms import Alarm
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Reading, Stream
from app.loop.tables.tools import OPEN, AverageMemory, Correction, Tool, ToolEvent
from app.loop.tools import queries, wording
from app.loop.tools.alarm_kinds import PAUSING
from app.loop.tools.events import average_changed, tool_changed


class Decision(NamedTuple):
    """A decision of a person about a correction: the statuses that permit it, the one it leads to, its name in the record."""

    verb: str
    of: tuple[str, ...]
    into: str
    recorded: str


REJECT = Decision("rejected", OPEN, "rejected", "correction rejected")
APPROVE = Decision("approve", ("awaiting_approval",), "pending", "correction approved")
RELEASE = Decision("release", ("held",), "pending", "correction released")


class Decided(NamedTuple):
    """A correction after something was done to it, and what else is to be said about it."""

    correction: Correction
    note: str | None = None


class Restarted(NamedTuple):
    """A tool whose offset was set again: open corrections were superseded, averages began again."""

    tool: Tool
    superseded: list[int]
    averages: list[int]
    parts: int


def decide(
    session: Session,
    machine: Machine,
    number: int,
    decision: Decision,
    reason: str,
    caller: Caller,
    *,
    although_fetched: bool = False,
) -> Decided:
    """Reject a correction that is not applied yet, approve one that awaits it, or release a held one.

    Raises `NotFound`; `Conflict` when the correction's status does not permit it, or when a program text with it is out in
    the world and its rejection was not demanded nevertheless.
    """
    correction = locked(session, machine, number)
    must_be(correction, machine, decision.verb, decision.of)
    if decision is REJECT and correction.fetched_at is not None and not although_fetched:
        raise Conflict(
            wording.is_out(correction),
            _("Take the text back and make sure that it was not run; then reject it with although_fetched = true."),
            correction_status=correction.status,
            fetched_at=correction.fetched_at.isoformat(),
        )
    if decision is RELEASE and _disproved(session, correction):
        raise Conflict(
            _(
                "Parts measured since lie within the wear limit again: {number} of {amount} mm would spoil the next one."
            ).format(number=correction.number, amount=f"{correction.amount:+.4f}"),
            _("Reject the correction, and look at the reading that led to it: one bad point looks like a worn tool."),
            correction_status=correction.status,
        )
    before = correction.status
    _carry_out(session, machine, [correction], decision, reason, caller)
    if before == "held":
        alarm = _wear_alarm(session, correction)
        return Decided(correction, None if alarm is None else wording.still_active(alarm))
    counting = queries.counting_on(session, machine, correction) if decision is REJECT else []
    notes = [wording.counted_on(counting), wording.is_out(correction) if correction.fetched_at else None]
    return Decided(correction, " ".join(filter(None, notes)) or None)


def approve_all(
    session: Session, machine: Machine, numbers: Sequence[int], reason: str, caller: Caller
) -> list[Correction]:
    """Approve these corrections together: all of them, or none when one cannot be approved any more.

    Raises `NotFound`; `Conflict` naming the first that someone else has decided about, and its state.
    """
    lock_machines(session, [machine.id])
    approved = [queries.correction(session, machine, number) for number in sorted(set(numbers))]
    for correction in approved:
        must_be(correction, machine, APPROVE.verb, APPROVE.of)
    _carry_out(session, machine, approved, APPROVE, reason, caller)
    return approved


def _carry_out(
    session: Session,
    machine: Machine,
    corrections: Sequence[Correction],
    decision: Decision,
    reason: str,
    caller: Caller,
) -> None:
    now = datetime.now(UTC)
    for correction in corrections:
        before, correction.status, correction.reason = correction.status, decision.into, reason
        correction.decided_at, correction.decided_by = now, caller.name
        record_status(session, machine, correction, caller, decision.recorded, before, reason)
    publish(session, *(correction_changed(session, machine, correction) for correction in corrections))


def edit_tool(session: Session, machine: Machine, number: int, offset: float, reason: str, caller: Caller) -> Restarted:
    """A person has set the offset by hand and says what it is now.

    Open corrections were computed for the offset before, so they are superseded; the averages of the characteristics on
    this tool begin again at 0; parts cut before say nothing. Raises `NotFound`.
    """
    return _set_offset(session, machine, number, offset, reason, caller, "edit")


def change_tool(
    session: Session, machine: Machine, number: int, offset: float, reason: str, caller: Caller
) -> Restarted:
    """The tool was changed: all that `edit_tool` does, and its life and the sum of its corrections begin again.

    Alarms about the old tool stay until they are acknowledged: they ask a question that needs its answer.
    Raises `NotFound`.
    """
    return _set_offset(session, machine, number, offset, reason, caller, "change")


def _set_offset(
    session: Session,
    machine: Machine,
    number: int,
    offset: float,
    reason: str,
    caller: Caller,
    kind: Literal["edit", "change"],
) -> Restarted:
    lock_machines(session, [machine.id])
    tool = queries.tool(session, machine, number)
    now = datetime.now(UTC)
    before = {"offset": tool.offset, "total": tool.total}
    parts = parts_cut(session, machine.id, number)
    tool.offset, tool.reset_at = rounded(offset), now
    on_it = (Stream.machine_id == machine.id) & (Stream.tool_memory == number)
    begun: dict[str, Any] = {"level": None, "level_sequence": None, "gain_from": Stream.sequence}
    if kind == "change":
        tool.total, tool.changed_at, tool.parts_kept, tool.life_alarm_raised = 0.0, now, 0, False
        begun["sequence_at_tool_change"] = Stream.sequence
    session.execute(update(Stream).where(on_it).values(begun).execution_options(synchronize_session=False))
    session.add(
        ToolEvent(
            machine_id=machine.id,
            number=number,
            at=now,
            kind=kind,
            offset_before=before["offset"],
            offset_after=tool.offset,
            parts=parts if kind == "change" else None,
            total=before["total"] if kind == "change" else None,
            edge=tool.edge if kind == "change" else None,
            name=tool.name if kind == "change" else None,
            actor=caller.name,
            reason=reason,
        )
    )
    fallen = supersede(session, open_corrections(session, machine, number), now, caller.name, reason)
    averages = restart_averages(
        session, machine, session.scalars(select(Stream.average_memory).where(on_it).distinct()).all(), now
    )
    after: dict[str, Any] = {"offset": tool.offset, "total": tool.total}
    if fallen:
        after["superseded"] = [correction.number for correction in fallen]
    action = "tool changed" if kind == "change" else "offset edited"
    record(session, caller.name, action, f"tool/{machine.key}/{number}", before, after, reason)
    publish(
        session,
        tool_changed(machine, number),
        *(correction_changed(session, machine, correction) for correction in fallen),
        *(average_changed(machine, location) for location in averages),
    )
    return Restarted(tool, [correction.number for correction in fallen], averages, parts)


def set_empirical_value(
    session: Session, machine: Machine, location: int, empirical_value: float, reason: str, caller: Caller
) -> list[CodedWarning]:
    """Set what is taken off every measurement by the characteristics that use this location (R11); M begins again at 0.

    Another one than before supersedes the open corrections of these characteristics: what the probe read too much is in them.
    What may be wrong with it is returned. Raises `NotFound`.
    """
    lock_machines(session, [machine.id])
    now = datetime.now(UTC)
    memory = queries.average(session, machine, location)
    before = {"empirical_value": memory.empirical_value, "average": memory.average}
    memory.empirical_value = rounded(empirical_value)
    fallen: Sequence[Correction] = []
    if nanometres(memory.empirical_value - before["empirical_value"]):
        opened = open_corrections(session, machine, average_memory=location)
        fallen = supersede(session, opened, now, caller.name, reason)
    restart_averages(session, machine, [location], now)
    session.execute(
        update(Stream)
        .where(Stream.machine_id == machine.id, Stream.average_memory == location)
        .values(level=None, level_sequence=None, gain_from=Stream.sequence)
        .execution_options(synchronize_session=False)
    )
    session.refresh(memory)
    after: dict[str, Any] = {"empirical_value": memory.empirical_value, "average": memory.average}
    after |= {"superseded": [correction.number for correction in fallen]} if fallen else {}
    subject = f"average/{machine.key}/{location}"
    record(session, caller.name, "empirical value changed", subject, before, after, reason)
    publish(
        session,
        average_changed(machine, location),
        *(correction_changed(session, machine, correction) for correction in fallen),
    )
    half = queries.tightest_half(session, machine, location)
    return empirical_value_warnings(memory.empirical_value, before["empirical_value"], half)


def resume_tools(session: Session, machine: Machine, alarm: int) -> list[int]:
    """Correcting goes on through the tools that this alarm has paused; their locations. The machine is locked.

    A tool that another active alarm pauses as well stays paused by that one.
    """
    other = (
        select(func.max(Alarm.id))
        .where(
            Alarm.machine_id == machine.id,
            Alarm.tool_memory == Tool.number,
            Alarm.kind.in_(PAUSING),
            Alarm.acknowledged_at.is_(None),
            Alarm.id != alarm,
        )
        .correlate(Tool)
        .scalar_subquery()
    )
    resumed = sorted(
        number
        for number, waits in session.execute(
            update(Tool)
            .where(Tool.machine_id == machine.id, Tool.paused_by == alarm)
            .values(paused_by=other)
            .returning(Tool.number, Tool.paused_by)
            .execution_options(synchronize_session=False)
        )
        if waits is None
    )
    if resumed:
        session.execute(
            update(Stream)
            .where(Stream.machine_id == machine.id, Stream.tool_memory.in_(resumed))
            .values(gain_from=Stream.sequence)
            .execution_options(synchronize_session=False)
        )
        publish(session, *(tool_changed(machine, number) for number in resumed))
    return resumed


def locked(session: Session, machine: Machine, number: int) -> Correction:
    lock_machines(session, [machine.id])
    return queries.correction(session, machine, number)


def must_be(correction: Correction, machine: Machine, verb: str, statuses: tuple[str, ...]) -> None:
    if correction.status not in statuses:
        detail, instead = wording.refused(correction, machine.key, verb)
        raise Conflict(detail, instead, correction_status=correction.status)


def restart_averages(session: Session, machine: Machine, locations: Sequence[int], now: datetime) -> list[int]:
    begun = session.scalars(
        update(AverageMemory)
        .where(AverageMemory.machine_id == machine.id, AverageMemory.location.in_(locations))
        .values(average=0.0, updated_at=now)
        .returning(AverageMemory.location)
        .execution_options(synchronize_session=False)
    )
    return sorted(begun)


def _disproved(session: Session, correction: Correction) -> bool:
    """Tell if the parts measured since contradict a held correction of the wear zone."""
    at = (correction.machine_id, correction.characteristic_id, correction.sequence)
    zone = session.scalar(
        select(Reading.zone).where(
            Reading.machine_id == at[0], Reading.characteristic_id == at[1], Reading.sequence == at[2]
        )
    )
    return zone == Zone.WEAR and reading_queries.within_wear_since(session, *at)


def _wear_alarm(session: Session, correction: Correction) -> int | None:
    return session.scalar(
        select(Alarm.id).where(
            Alarm.machine_id == correction.machine_id,
            Alarm.characteristic_id == correction.characteristic_id,
            Alarm.kind == TOOL_WORN.name,
            Alarm.acknowledged_at.is_(None),
        )
    )


def record_status(
    session: Session,
    machine: Machine,
    correction: Correction,
    caller: Caller,
    said: str,
    before: str,
    reason: str | None,
) -> None:
    subject = f"correction/{machine.key}/{correction.number}"
    after: dict[str, Any] = {"status": correction.status}
    if correction.offset_after is not None:
        after["offset_after"] = correction.offset_after
    record(session, caller.name, said, subject, {"status": before}, after, reason)
