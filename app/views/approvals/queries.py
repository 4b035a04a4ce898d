"""Corrections that await approval or are held, oldest first, by machine and tool. Never writes."""

from collections.abc import Sequence
from typing import NamedTuple

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.core.decision.step import rounded
from app.core.parameters import Parameters
from app.loop.alarms.reading_kinds import HOLDING
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.correction_queries import open_corrections
from app.loop.machines import keys
from app.loop.machines import queries as machines
from app.loop.tables.alarms import Alarm
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.connections import Connection
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Reading
from app.loop.tables.tools import Correction, Tool
from app.loop.tools import queries
from app.loop.tools.queries import CorrectionRow

DECIDED_BY_PEOPLE = ("held", "awaiting_approval")
MOST = 200  # of one machine, on one page


class Waiting(NamedTuple):
    """One that waits, with the reading that asked for it. alarm: the active one that holds it."""

    row: CorrectionRow
    name: str
    parameters: Parameters
    deviation: float
    decided: float
    zone: str
    alarm: Alarm | None


class Group(NamedTuple):
    """Corrections of one tool that wait. approvable: their numbers; total: their sum, mm; after: the offset with all of them applied."""

    machine: Machine
    tool: Tool
    waiting: list[Waiting]
    approvable: list[int]
    total: float
    after: float

    @property
    def half(self) -> float:
        """Half of the finest of their tolerances, mm: it says the decimals of the sum."""
        return min(each.parameters.half for each in self.waiting)


def count_by_machine(session: Session) -> dict[int, int]:
    """Number of waiting corrections by the machine's id."""
    return {
        machine: sum(counts.get(status, 0) for status in DECIDED_BY_PEOPLE)
        for machine, counts in queries.open_counts(session).items()
    }


def groups(session: Session, machine: Machine | None = None) -> list[Group]:
    """Groups of waiting corrections, the one with the oldest first; ``machine``: only there."""
    chosen = [machine] if machine is not None else machines.machines(session)
    waiting = count_by_machine(session)
    all_groups = [group for one in chosen if waiting.get(one.id) for group in _of_machine(session, one)]
    return sorted(all_groups, key=lambda group: group.waiting[0].row.correction.created_at)


def group_of(session: Session, machine: Machine, tool: int) -> Group | None:
    """Group of the waiting corrections of this tool; None if there are none."""
    return next((group for group in _of_machine(session, machine) if group.tool.number == tool), None)


def to_enter(session: Session, machine: Machine, limit: int) -> tuple[list[Waiting], int]:
    """Pending corrections that a person enters at the control, the oldest first, and how many there are.

    There are none where the machine has a key or a bridge.
    """
    if session.get(Connection, machine.id) is not None or keys.keys_by_machine(session).get(machine.id):
        return [], 0
    rows = queries.corrections(session, machine, statuses=("pending",), limit=limit)
    count = queries.open_counts(session)[machine.id].get("pending", 0) if len(rows) == limit else len(rows)
    return _with_readings(session, machine, rows), count


def _of_machine(session: Session, machine: Machine) -> list[Group]:
    rows = queries.corrections(session, machine, statuses=DECIDED_BY_PEOPLE, limit=MOST)
    by_tool: dict[int, list[Waiting]] = {}
    for entry in _with_readings(session, machine, rows):
        by_tool.setdefault(entry.row.correction.tool_memory, []).append(entry)
    pending = dict.fromkeys(by_tool, 0.0)
    for correction in open_corrections(session, machine):
        if correction.status == "pending" and correction.tool_memory in pending:
            pending[correction.tool_memory] += correction.amount
    result = []
    for number, waiting in by_tool.items():
        tool = queries.tool(session, machine, number)
        approvable = [entry.row.correction for entry in waiting if entry.row.correction.status == "awaiting_approval"]
        total = rounded(sum(correction.amount for correction in approvable))
        after = rounded(tool.offset + pending[number] + total)
        result.append(Group(machine, tool, waiting, [c.number for c in approvable], total, after))
    return result


def _with_readings(session: Session, machine: Machine, rows: Sequence[CorrectionRow]) -> list[Waiting]:
    if not rows:
        return []
    rows_of_readings = session.execute(
        select(Correction.number, Characteristic.name, Reading)
        .join(
            Reading,
            (Reading.machine_id == Correction.machine_id)
            & (Reading.characteristic_id == Correction.characteristic_id)
            & (Reading.sequence == Correction.sequence),
        )
        .join(
            Characteristic,
            (Characteristic.machine_id == Correction.machine_id) & (Characteristic.id == Correction.characteristic_id),
        )
        .where(Correction.machine_id == machine.id, Correction.number.in_([row.correction.number for row in rows]))
    )
    readings = {number: (name, reading) for number, name, reading in rows_of_readings}
    holding = {
        alarm.id: alarm
        for alarm in session.scalars(
            select(Alarm).where(
                Alarm.machine_id == machine.id, Alarm.kind.in_(HOLDING), Alarm.acknowledged_at.is_(None)
            )
        )
    }
    result = []
    for row in rows:
        name, reading = readings[row.correction.number]
        parameters = characteristics.parameters_of(
            session, machine.id, reading.characteristic_id, reading.parameters_version
        )
        alarm = next((holding[number] for number in reading.alarms or () if number in holding), None)
        held = row.correction.status == "held"
        result.append(
            Waiting(row, name, parameters, reading.deviation, reading.decided, reading.zone, alarm if held else None)
        )
    return result
