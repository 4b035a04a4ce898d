"""Times of corrections that cannot be true: a control states that it applied one before that was issued.

Its clock is behind, or it names another correction (`app.core.clock.behind_by`). What was stated is stored as it is: parts whose times are
by the same clock are compared with it, and a time that was put right alone would count them as cut without the correction.
"""

from datetime import UTC, datetime, timedelta

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.core.clock import behind_by, explained
from app.db.events import publish
from app.loop.alarms import actions as alarms
from app.loop.tables.alarms import Alarm
from app.loop.tables.machines import Machine
from app.loop.tables.tools import ASKED_AGAIN, Correction
from app.loop.tools.effect_alarm_kinds import CORRECTION_IN_DOUBT
from app.loop.tools.events import alarm_raised

WHY = "applied_before"


def ask_of_time(session: Session, machine: Machine, correction: Correction, applied_at: datetime) -> None:
    """Ask about this time of a correction, if it cannot be true: of the machine, as of its clock; the machine is locked.

    An answer holds for 90 days, while the clock is no further behind.
    """
    lag = behind_by(applied_at.timestamp(), correction.created_at.timestamp())
    if lag is None or any(explained(lag, each) for each in _answered(session, machine)):
        return
    data = {
        "why": WHY,
        "number": correction.number,
        "of_tool": correction.tool_memory,
        "lag": round(lag, 1),
        "applied_at": applied_at.isoformat(),
        "issued_at": correction.created_at.isoformat(),
    }
    publish(session, alarm_raised(machine, alarms.raise_for_machine(session, machine.id, CORRECTION_IN_DOUBT, data)))


def _answered(session: Session, machine: Machine) -> list[float]:
    """By how much the clock was behind in alarms that have been answered, s."""
    rows = session.scalars(
        select(Alarm.data["lag"].as_float()).where(
            Alarm.machine_id == machine.id,
            Alarm.kind == CORRECTION_IN_DOUBT.name,
            Alarm.data["why"].astext == WHY,
            Alarm.acknowledged_at > datetime.now(UTC) - timedelta(days=ASKED_AGAIN),
        )
    )
    return list(rows)
