"""Raising alarms that do not come from a reading. Readings raise theirs in `app.loop.readings`; people acknowledge in `acknowledging`."""

from datetime import UTC, datetime
from typing import Any

from sqlalchemy import ColumnElement, select
from sqlalchemy.orm import Session

from app.loop.alarms.kinds import AlarmKind
from app.loop.tables.alarms import Alarm


def active_of_tool(session: Session, machine_id: int, tool_memory: int, kind: AlarmKind) -> Alarm | None:
    """The alarm of this kind about a tool that is active."""
    of_tool = (Alarm.tool_memory == tool_memory, Alarm.characteristic_id.is_(None))
    return _active(session, machine_id, kind, *of_tool)


def active(session: Session, machine_id: int, characteristic_id: int, kind: AlarmKind) -> Alarm | None:
    """The alarm of this kind about a characteristic that is active."""
    return _active(session, machine_id, kind, Alarm.characteristic_id == characteristic_id)


def active_of_place(session: Session, machine_id: int, kind: AlarmKind, data: dict[str, Any]) -> Alarm | None:
    """The alarm of this kind about a location of a memory (`memory` and `location` in its data) that is active."""
    place = [Alarm.data[name].astext == str(data[name]) for name in ("memory", "location")]
    return _active(session, machine_id, kind, *place)


def _active(session: Session, machine_id: int, kind: AlarmKind, *about: ColumnElement[bool]) -> Alarm | None:
    query = select(Alarm).where(
        Alarm.machine_id == machine_id, Alarm.kind == kind.name, Alarm.acknowledged_at.is_(None), *about
    )
    return session.scalars(query.execution_options(populate_existing=True)).one_or_none()


def raise_for_tool(session: Session, machine_id: int, tool_memory: int, kind: AlarmKind, data: dict[str, Any]) -> Alarm:
    """Raise an alarm about a tool, or count one more if it is active already; the machine is locked.

    The values of the last time are what its sentence says.
    """
    active = active_of_tool(session, machine_id, tool_memory, kind)
    return _raised(session, active or Alarm(machine_id=machine_id, tool_memory=tool_memory, kind=kind.name), data)


def raise_for_characteristic(
    session: Session,
    machine_id: int,
    characteristic_id: int,
    tool_memory: int | None,
    kind: AlarmKind,
    data: dict[str, Any],
) -> Alarm:
    """Raise an alarm about a characteristic that no reading raises, or count one more if it is active already."""
    return _raised(
        session,
        active(session, machine_id, characteristic_id, kind)
        or Alarm(
            machine_id=machine_id, characteristic_id=characteristic_id, tool_memory=tool_memory or None, kind=kind.name
        ),
        data,
    )


def raise_for_place(session: Session, machine_id: int, kind: AlarmKind, data: dict[str, Any]) -> Alarm:
    """Raise an alarm about a location of a memory (`memory` and `location` in its data); the machine is locked.

    While it is active, one more counts on it.
    """
    active = active_of_place(session, machine_id, kind, data)
    return _raised(session, active or Alarm(machine_id=machine_id, kind=kind.name), data)


def raise_for_machine(session: Session, machine_id: int, kind: AlarmKind, data: dict[str, Any]) -> Alarm:
    """Raise an alarm about a machine, as of its clock, or count one more if it is active already; the machine is locked."""
    of_machine = (Alarm.tool_memory.is_(None), Alarm.characteristic_id.is_(None))
    active = _active(session, machine_id, kind, *of_machine)
    return _raised(session, active or Alarm(machine_id=machine_id, kind=kind.name), data)


def _raised(session: Session, alarm: Alarm, data: dict[str, Any]) -> Alarm:
    """A new alarm is kept; on one that is active already, one more is counted."""
    if alarm in session:
        alarm.count += 1
    alarm.last_at = datetime.now(UTC)
    alarm.data = data
    session.add(alarm)
    session.flush()
    return alarm


def settle(session: Session, active: Alarm | None, by: str, comment: str, outcome: dict[str, Any]) -> Alarm | None:
    """End an active alarm, because what it asked for has been done; None if there is none."""
    if active is None:
        return None
    active.acknowledged_at, active.acknowledged_by = datetime.now(UTC), by
    active.action, active.comment, active.outcome = "noted", comment, [outcome]
    session.flush()
    return active


def news(machine: str, alarm: Alarm) -> dict[str, Any]:
    """The event of an alarm that does not come from a reading, for live pages and event listeners."""
    event = {"kind": "alarm", "machine": machine, "characteristic": None, "tool": alarm.tool_memory, "id": alarm.id}
    if alarm.acknowledged_at is None:
        return event | {"alarm": alarm.kind, "state": "active"}
    return event | {"alarm": alarm.kind, "state": "acknowledged", "action": alarm.action}
