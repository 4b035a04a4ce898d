"""What waits for a person: corrections that await approval or are held, oldest first, by machine and tool. Never writes."""

from collections.abc import Sequence
from typing import NamedTuple

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.alarms.queries import HOLDING
from app.alarms.tables import Alarm
from app.characteristics import queries as characteristics
from app.characteristics.tables import Characteristic
from app.core.compensation import DECIMALS
from app.core.parameters import Parameters
from app.machines import queries as machines
from app.machines.tables import Machine
from app.offsets import queries
from app.offsets.queries import CorrectionRow
from app.offsets.tables import Correction, Tool
from app.readings.tables import Reading

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
    """What waits for one tool. approvable: their numbers; total: their sum, mm; after: the offset with all of them applied."""

    machine: Machine
    tool: Tool
    waiting: list[Waiting]
    approvable: list[int]
    total: float
    after: float


def count(session: Session) -> int:
    """How many corrections wait for a person."""
    waiting = select(func.count()).select_from(Correction).where(Correction.status.in_(DECIDED_BY_PEOPLE))
    return session.scalar(waiting) or 0


def count_by_machine(session: Session) -> dict[int, int]:
    """How many wait, by the machine's id."""
    return {
        machine: sum(counts.get(status, 0) for status in DECIDED_BY_PEOPLE)
        for machine, counts in queries.open_counts(session).items()
    }


def groups(session: Session, machine: Machine | None = None) -> list[Group]:
    """What waits, the group with the oldest first; ``machine``: only there."""
    shown = [machine] if machine is not None else machines.machines(session)
    waiting = count_by_machine(session)
    found = [group for each in shown if waiting.get(each.id) for group in _of_machine(session, each)]
    return sorted(found, key=lambda group: group.waiting[0].row.correction.created_at)


def group_of(session: Session, machine: Machine, tool: int) -> Group | None:
    """What waits for this tool, if anything does."""
    return next((group for group in _of_machine(session, machine) if group.tool.number == tool), None)


def _of_machine(session: Session, machine: Machine) -> list[Group]:
    rows = queries.corrections(session, machine, statuses=DECIDED_BY_PEOPLE, limit=MOST)
    by_tool: dict[int, list[Waiting]] = {}
    for each in _with_readings(session, machine, rows):
        by_tool.setdefault(each.row.correction.tool_memory, []).append(each)
    pending = dict.fromkeys(by_tool, 0.0)
    for correction in queries.open_corrections(session, machine):
        if correction.status == "pending" and correction.tool_memory in pending:
            pending[correction.tool_memory] += correction.amount
    made = []
    for number, waiting in by_tool.items():
        tool = queries.tool(session, machine, number)
        approvable = [each.row.correction for each in waiting if each.row.correction.status == "awaiting_approval"]
        total = round(sum(correction.amount for correction in approvable), DECIMALS) + 0.0
        after = round(tool.offset + pending[number] + total, DECIMALS) + 0.0
        made.append(Group(machine, tool, waiting, [c.number for c in approvable], total, after))
    return made


def _with_readings(session: Session, machine: Machine, rows: Sequence[CorrectionRow]) -> list[Waiting]:
    if not rows:
        return []
    found = session.execute(
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
    readings = {number: (name, reading) for number, name, reading in found}
    holding = {
        alarm.id: alarm
        for alarm in session.scalars(
            select(Alarm).where(
                Alarm.machine_id == machine.id, Alarm.kind.in_(HOLDING), Alarm.acknowledged_at.is_(None)
            )
        )
    }
    made = []
    for row in rows:
        name, reading = readings[row.correction.number]
        parameters = characteristics.parameters_of(
            session, machine.id, reading.characteristic_id, reading.parameters_version
        )
        alarm = next((holding[number] for number in reading.alarms or () if number in holding), None)
        held = row.correction.status == "held"
        made.append(
            Waiting(row, name, parameters, reading.deviation, reading.decided, reading.zone, alarm if held else None)
        )
    return made
