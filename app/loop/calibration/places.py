"""Places that are calibrated: last calibration, parts and time since, and the next due date. Never writes."""

from collections import defaultdict
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from typing import NamedTuple

from sqlalchemy import func, select, text, tuple_
from sqlalchemy.orm import Session

from app.loop.calibration.queries import CalibrationRow, Place, status_of
from app.loop.tables.calibration import CalibrationAcceptance, CalibrationPlan, CalibrationRecord, PairedReading
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Stream
from app.loop.tables.tools import AverageMemory, Tool

SOON = 0.9  # of what is planned


class PlaceRow(NamedTuple):
    """A place with all that its line in the overview says.

    value: empirical value or offset in effect. parts: measured since `since`, by the characteristic that counted most.
    last: the last calibration, whatever came of it.
    """

    machine: Machine
    place: Place
    characteristics: list[str]
    value: float
    plan: CalibrationPlan | None
    parts: int
    last: CalibrationRow | None

    def used(self, now: datetime | None = None) -> float | None:
        """Share of the planned interval that has passed, 1 = due; None without a plan."""
        plan = self.plan
        if plan is None or (plan.due_parts is None and plan.due_days is None):
            return None
        passed = ((now or datetime.now(UTC)) - plan.since).total_seconds() / 86400
        return max(
            0.0 if plan.due_parts is None else self.parts / plan.due_parts,
            0.0 if plan.due_days is None else passed / plan.due_days,
        )

    @property
    def due_at(self) -> datetime | None:
        """The time at which it is due by days."""
        plan = self.plan
        if plan is None or plan.due_days is None:
            return None
        return plan.since + timedelta(days=plan.due_days)

    @property
    def parts_left(self) -> int | None:
        """Parts until it is due by parts."""
        if self.plan is None or self.plan.due_parts is None:
            return None
        return max(0, self.plan.due_parts - self.parts)

    @property
    def state(self) -> str:
        """`overdue`, `refused`, `proposed`, `due_soon`, `calibrated`, `never` (none yet), in this order of urgency."""
        used = self.used()
        if used is not None and used >= 1:
            return "overdue"
        if self.last is not None and self.last.status in {"refused", "proposed"}:
            return self.last.status
        if used is not None and used >= SOON:
            return "due_soon"
        return "never" if self.last is None else "calibrated"


_PARTS = text("""
SELECT p.machine_id, p.memory, p.location,
       greatest(max(s.sequence - coalesce((p.counts ->> s.characteristic_id::text)::bigint, 0)), 0) AS parts
FROM calibration_plan p
JOIN stream s ON s.machine_id = p.machine_id AND (p.memory = 'tool' OR s.average_memory = p.location)
WHERE p.machine_id = ANY(:machines)
GROUP BY 1, 2, 3
""")


def places(session: Session, of: Sequence[Machine] | None = None) -> list[PlaceRow]:
    """All places that are measured with, planned for or have been calibrated, by machine and number; of all machines or of these."""
    machines = {row.id: row for row in (session.scalars(select(Machine)) if of is None else of)}
    ids = list(machines)
    plans = {
        (plan.machine_id, Place(plan.memory, plan.location)): plan
        for plan in session.scalars(
            select(CalibrationPlan).where(CalibrationPlan.machine_id.in_(ids)).execution_options(populate_existing=True)
        )
    }
    used_by, values = _used_by(session, ids), _values(session, ids)
    last = _last(session, ids, values)
    paired = {
        (row.machine_id, Place("average", row.location))
        for row in session.execute(
            select(PairedReading.machine_id, PairedReading.location).where(PairedReading.machine_id.in_(ids)).distinct()
        )
    }
    parts = {
        (row.machine_id, Place(row.memory, row.location)): row.parts
        for row in session.execute(_PARTS, {"machines": ids})
    }
    return [
        PlaceRow(
            machines[machine_id],
            place,
            used_by.get((machine_id, place), []),
            values[machine_id, place],
            plans.get((machine_id, place)),
            parts.get((machine_id, place), 0),
            last.get((machine_id, place)),
        )
        for machine_id, place in sorted(
            {*plans, *used_by, *last, *paired}, key=lambda each: (machines[each[0]].key, each[1])
        )
    ]


def place_row(session: Session, machine: Machine, place: Place, value: float) -> PlaceRow:
    """One place; also one about which nothing is known yet."""
    known = next((row for row in places(session, [machine]) if row.place == place), None)
    return known or PlaceRow(machine, place, [], value, None, 0, None)


At = tuple[int, Place]  # a machine's id and one of its places


def _used_by(session: Session, machines: list[int]) -> dict[At, list[str]]:
    keys: dict[At, list[str]] = defaultdict(list)
    for machine_id, location, key in session.execute(
        select(Stream.machine_id, Stream.average_memory, Characteristic.key)
        .join(
            Characteristic,
            (Characteristic.machine_id == Stream.machine_id) & (Characteristic.id == Stream.characteristic_id),
        )
        .where(Stream.average_memory > 0, Stream.machine_id.in_(machines))
        .order_by(Characteristic.key)
    ):
        keys[machine_id, Place("average", location)].append(key)
    return keys


def _last(session: Session, machines: list[int], values: dict[At, float]) -> dict[At, CalibrationRow]:
    """The last calibration of every place, whatever came of it."""
    record, accepted = CalibrationRecord, CalibrationAcceptance
    place = (record.machine_id, record.memory, record.location)
    good = {
        (machine_id, Place(memory, location)): number
        for machine_id, memory, location, number in session.execute(
            select(*place, func.max(record.number))
            .where(record.refused.is_(False), record.machine_id.in_(machines))
            .group_by(*place)
        )
    }
    newest = select(*place, func.max(record.number)).where(record.machine_id.in_(machines)).group_by(*place)
    calibrations = session.execute(
        select(record, accepted)
        .outerjoin(accepted, (accepted.machine_id == record.machine_id) & (accepted.number == record.number))
        .where(tuple_(*place, record.number).in_(newest))
    )
    rows = {}
    for calibration, acceptance in calibrations:
        at = (calibration.machine_id, Place(calibration.memory, calibration.location))
        rows[at] = CalibrationRow(calibration, acceptance, status_of(calibration, acceptance, values[at], good.get(at)))
    return rows


def _values(session: Session, machines: list[int]) -> dict[At, float]:
    averages = select(AverageMemory.machine_id, AverageMemory.location, AverageMemory.empirical_value)
    tools = select(Tool.machine_id, Tool.number, Tool.offset)
    return {
        (machine_id, Place(memory, location)): value
        for memory, query in (
            ("average", averages.where(AverageMemory.machine_id.in_(machines))),
            ("tool", tools.where(Tool.machine_id.in_(machines))),
        )
        for machine_id, location, value in session.execute(query)
    }
