"""One machine as its station shows it. Never writes."""

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import NamedTuple

from sqlalchemy.orm import Session

from app.core.state import CharacteristicState
from app.errors import NotFound
from app.language.i18n import _
from app.loop.alarm_response import queries as alarms
from app.loop.alarm_response.queries import AlarmRow
from app.loop.maintenance.queries import MaintenanceRow, running
from app.loop.tables.machines import Machine
from app.views.approvals import queries as approvals
from app.views.approvals.queries import Group, Waiting
from app.views.characteristic import state_queries
from app.views.characteristic.state_queries import CharacteristicRow

MOST_ALARMS = 20
FEW = 2  # corrections that wait, of which more are a number
URGENCY = {state: place for place, state in enumerate(CharacteristicState)}


class Station(NamedTuple):
    """Content of the station of a machine: `first` in giant digits, the `others` small; active alarms, the most urgent first.

    tools: the tools that its characteristics are cut with. waiting: corrections to decide about that no active alarm holds, and those to enter
    at the control, the oldest few; more: those behind them; together: of the tools of which several await approval, what approving all of
    them comes to. maintenance: what runs, in which no notifications are sent.
    """

    machine: Machine
    first: CharacteristicRow | None
    others: Sequence[CharacteristicRow]
    alarms: Sequence[AlarmRow]
    active: int
    tools: Sequence[int]
    waiting: Sequence[Waiting]
    more: int
    together: Sequence[Group]
    maintenance: Sequence[MaintenanceRow]


def station(session: Session, machine: str) -> Station:
    """The machine as it is. Raises `NotFound`."""
    (group,) = state_queries.plant(session, machine=machine, trends=False)
    rows = sorted(group.rows, key=_place)
    first = rows[0] if rows else None
    active = alarms.alarms(session, state="active", machine_id=group.machine.id, limit=MOST_ALARMS, by_urgency=True)
    tools = approvals.groups(session, group.machine)
    deciding = [each for tool in tools for each in tool.waiting if each.alarm is None]
    entering, number_entering = approvals.to_enter(session, group.machine, FEW)
    waiting = sorted([*deciding, *entering], key=lambda each: each.row.correction.number)[:FEW]
    return Station(
        group.machine,
        first,
        rows[1:],
        active,
        alarms.active_count(session, group.machine.id),
        sorted({row.parameters.tool_memory for row in rows if row.parameters.tool_memory}),
        waiting,
        len(deciding) + number_entering - len(waiting),
        [tool for tool in tools if len(tool.approvable) > 1],
        running(session, datetime.now(UTC), group.machine.id),
    )


def _place(row: CharacteristicRow) -> tuple[bool, int, float]:
    """Order: those that need someone first, the most urgent of them before; then what was measured last."""
    last = row.stream.last_received_at
    measured = 0.0 if last is None else last.timestamp()
    return (not row.needs_someone, URGENCY[row.state] if row.needs_someone else 0, -measured)


def alarm_of_machine(session: Session, machine: str, number: int) -> AlarmRow:
    """An alarm of this machine. Raises `NotFound`."""
    row = alarms.alarm(session, number)
    if row.machine.key != machine:
        raise NotFound(
            _("Alarm {number} is not of machine {machine}.").format(number=number, machine=machine),
            _("Go back to the station of the machine."),
        )
    return row
