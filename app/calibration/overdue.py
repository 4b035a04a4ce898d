"""The chore: who has not been calibrated for longer than planned is told about, once."""

from typing import Any

from sqlalchemy import RowMapping, text
from sqlalchemy.orm import Session

from app.alarms import actions as alarms
from app.calibration.actions import OVERDUE
from app.calibration.tables import CalibrationPlan
from app.db.events import publish
from app.machines.queries import lock_machines
from app.machines.tables import Machine

_OVERDUE = text("""
SELECT * FROM (
    SELECT p.machine_id, p.memory, p.location, p.due_parts, p.due_days,
           extract(epoch FROM now() - p.since)::float8 / 86400 AS days,
           (SELECT max(s.sequence - coalesce((p.counts ->> s.characteristic_id::text)::bigint, 0)) FROM stream s
            WHERE s.machine_id = p.machine_id AND (p.memory = 'tool' OR s.average_memory = p.location)) AS parts
    FROM calibration_plan p
    WHERE NOT p.told AND (p.due_parts IS NOT NULL OR p.due_days IS NOT NULL)
) passed WHERE parts >= due_parts OR days >= due_days
ORDER BY machine_id, memory, location
""")


def raise_overdue(session: Session) -> int:
    """Raise *calibration overdue* for every place that is due and was not told about; how many there were."""
    due = session.execute(_OVERDUE).mappings().all()
    if not due:
        return 0
    locked = lock_machines(session, [row["machine_id"] for row in due])
    due = session.execute(_OVERDUE).mappings().all()  # of now that nobody can calibrate in between
    changes = [_raise(session, row) for row in due if row["machine_id"] in locked]
    publish(session, *changes)
    return len(changes)


def _raise(session: Session, row: RowMapping) -> dict[str, Any]:
    plan = session.get_one(CalibrationPlan, (row["machine_id"], row["memory"], row["location"]), populate_existing=True)
    plan.told = True
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
