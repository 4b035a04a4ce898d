"""Faults become alarms: those that a machine reports, and readings that were refused because its program touches too often."""

from typing import Any, NamedTuple

from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.db.engine import Database
from app.db.events import publish
from app.language.i18n import _
from app.loop.alarms import actions as alarms
from app.loop.faults.alarm_kinds import MACHINE_FAULT, TOUCH_COUNT, Fault
from app.loop.machines import queries as machines


class Reported(NamedTuple):
    """The alarm of a fault: its number (None where an end was reported of a fault that nobody knew), and its count."""

    alarm: int | None
    active: bool
    reports: int
    is_new: bool


def report_fault(session: Session, machine: str, fault: Fault, text: str, active: bool, caller: Caller) -> Reported:
    """Raise *machine fault*, count one more on the active one, or end it.

    ``text``: the words of the control, shown with the alarm. Reporting an end twice is harmless. Raises `NotFound`;
    `NotAllowed` for the key of another machine.
    """
    owner = machines.machine_named(session, machine)
    caller.must_at(owner.id, "operator")
    machines.lock_machines(session, [owner.id])
    about = {"memory": "probe", "location": fault}
    if active:
        raised = alarms.raise_for_place(session, owner.id, MACHINE_FAULT, about | {"text": text})
        publish(session, alarms.news(owner.key, raised))
        return Reported(raised.id, True, raised.count, raised.count == 1)
    comment = text or _("The fault is over")
    active_alarm = alarms.active_of_place(session, owner.id, MACHINE_FAULT, about)
    ended = alarms.settle(session, active_alarm, caller.name, comment, {"code": "fault_over", "fault": fault})
    if ended is None:
        return Reported(None, False, 0, False)
    record(session, caller.name, "machine fault over", f"alarm/{ended.id}", None, {"fault": fault}, comment)
    publish(session, alarms.news(owner.key, ended))
    return Reported(ended.id, False, ended.count, False)


def report_touch_count(database: Database, place: tuple[int, str, int, str], touch: dict[str, Any]) -> None:
    """Raise *too many touches* about a reading that was refused for them, or count one more on the active one.

    place: of the characteristic, as `Entry` has it. touch: the one too many, as `TouchError` keeps it.
    """
    machine_id, machine, characteristic_id, characteristic = place
    with database.begin() as session:
        machines.lock_machines(session, [machine_id])
        raised = alarms.raise_for_characteristic(
            session, machine_id, characteristic_id, None, TOUCH_COUNT, {"touch": touch}
        )
        publish(session, alarms.news(machine, raised) | {"characteristic": characteristic})
