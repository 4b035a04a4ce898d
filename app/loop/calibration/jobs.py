"""Periodic job: raise an alarm, once, for each place whose calibration is overdue."""

from typing import Any

from sqlalchemy import RowMapping, text
from sqlalchemy.orm import Session

from app.db.events import publish
from app.jobs.actions import PeriodicJob, Unit
from app.loop.alarms import actions as alarms
from app.loop.calibration.alarm_kinds import OVERDUE
from app.loop.machines.queries import lock_machines
from app.loop.tables.calibration import CalibrationPlan
from app.loop.tables.machines import Machine

# Of one place, or of all.
_OVERDUE = text("""
SELECT * FROM (
    SELECT p.machine_id, m.key, p.memory, p.location, p.due_parts, p.due_days,
           extract(epoch FROM now() - p.since)::float8 / 86400 AS days,
           (SELECT max(s.sequence - coalesce((p.counts ->> s.characteristic_id::text)::bigint, 0)) FROM stream s
            WHERE s.machine_id = p.machine_id AND (p.memory = 'tool' OR s.average_memory = p.location)) AS parts
    FROM calibration_plan p JOIN machine m ON m.id = p.machine_id
    WHERE NOT p.told AND (p.due_parts IS NOT NULL OR p.due_days IS NOT NULL)
        AND (CAST(:machine AS int) IS NULL OR (p.machine_id, p.memory, p.location) = (:machine, :memory, :location))
) passed WHERE parts >= due_parts OR days >= due_days
ORDER BY machine_id, memory, location
""")
_ALL = {"machine": None, "memory": None, "location": None}


def overdue(session: Session) -> list[Unit]:
    """Every overdue place that no alarm was raised for."""
    return [
        Unit(
            f"calibration-plan/{row['key']}/{row['memory']}/{row['location']}",
            (row["machine_id"], row["memory"], row["location"]),
            row["machine_id"],
        )
        for row in session.execute(_OVERDUE, _ALL).mappings()
    ]


def raise_overdue(session: Session, unit: Unit) -> None:
    """Raise *calibration overdue* for one place."""
    machine, memory, location = unit.key
    lock_machines(session, [int(machine)])
    place = {"machine": machine, "memory": memory, "location": location}
    for row in session.execute(_OVERDUE, place).mappings().all():  # of now that nobody can calibrate in between
        publish(session, _raise(session, row))


JOB = PeriodicJob("calibrations_due", overdue, raise_overdue)


def _raise(session: Session, row: RowMapping) -> dict[str, Any]:
    plan = session.get_one(CalibrationPlan, (row["machine_id"], row["memory"], row["location"]), populate_existing=True)
    plan.alarm_raised = True
    by_parts = row["due_parts"] is not None and (row["parts"] or 0) >= row["due_parts"]
    data = {
        "memory": row["memory"],
        "location": row["location"],
        "parts": row["parts"] if by_parts else None,
        "days": row["days"],
        "due_parts": row["due_parts"],
        "due_days": row["due_days"],
    }
    alarm = alarms.raise_for_place(session, row["machine_id"], OVERDUE, data)
    return alarms.news(session.get_one(Machine, row["machine_id"]).key, alarm)
