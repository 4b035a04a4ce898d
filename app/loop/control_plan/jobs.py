"""Periodic job: looks at the control plans whose part was measured lately, or whose machine ran, one characteristic at a time."""

from sqlalchemy import text
from sqlalchemy.orm import Session

from app.jobs.actions import PeriodicJob, Unit
from app.loop.control_plan.actions import check_context, check_plan
from app.loop.tables.control_plan import ControlPlan

# Nothing can have been missed where neither this characteristic nor another one of its part had a reading since, nor the control
# reported that it runs. After half a day without any, the last look knew all. In no order: not all may be
# looked at in a minute, and none is to be always the last.
_DUE = text("""
SELECT p.machine_id, p.characteristic_id, c.key
FROM control_plan p
JOIN characteristic c ON c.machine_id = p.machine_id AND c.id = p.characteristic_id
JOIN stream s ON s.machine_id = p.machine_id AND s.characteristic_id = p.characteristic_id
WHERE cardinality(p.required_context) > 0 AND s.sequence > p.context_seen
OR (p.every IS NOT NULL OR p.minutes IS NOT NULL OR p.per_shift OR p.after_change > 0 OR p.after_alarm > 0)
AND (s.sequence > p.seen OR EXISTS (
    SELECT FROM stream o JOIN characteristic b ON b.machine_id = o.machine_id AND b.id = o.characteristic_id
    WHERE o.machine_id = p.machine_id AND b.id <> c.id AND (b.part = c.part OR p.numbered AND b.part IS NULL AND c.part IS NULL)
    AND o.last_received_at > greatest(coalesce(s.last_received_at, p.since), p.since, now() - interval '12 hours')
) OR p.minutes IS NOT NULL AND EXISTS (
    SELECT FROM machine_run r WHERE r.machine_id = p.machine_id
    AND r.until > greatest(coalesce(s.last_received_at, p.since), p.since, now() - interval '12 hours')
))
ORDER BY random()
""")


def due(session: Session) -> list[Unit]:
    """Plans that may not have been kept."""
    return [
        Unit(f"characteristic/{key}", (machine_id, characteristic_id), machine_id, characteristic_id)
        for machine_id, characteristic_id, key in session.execute(_DUE)
    ]


def look_at(session: Session, unit: Unit) -> None:
    """Put on record what was missed at one characteristic, and look at what its readings say of themselves; raise alarms, or end them."""
    at = int(unit.key[0]), int(unit.key[1])
    plan = session.get_one(ControlPlan, at).plan
    if plan.asks:
        check_plan(session, *at)
    if plan.required_context:
        check_context(session, *at)


JOB = PeriodicJob("control_plans", due, look_at)
