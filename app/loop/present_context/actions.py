"""Setting what a machine works at, and putting it on its readings that bring no context but temperatures.

A reading's context is written once and never changed. A reading without any that was measured while it held gets it from a periodic
job; one that brings temperatures alone gets it with them, when it is stored.
"""

from datetime import UTC, datetime, timedelta

from sqlalchemy import select, text
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.core.decision.step import Code
from app.db.events import publish
from app.jobs.actions import PeriodicJob, Unit
from app.loop.machines.queries import lock_machines, machine_named
from app.loop.present_context.queries import present_of
from app.loop.present_context.schemas import PresentContextIn
from app.loop.present_context.tables import PresentContext
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Stream

UNDER_WAY = timedelta(minutes=2)
"""Readings that came so lately may not be stored yet: they are looked at again."""

_FILL = text("""
WITH made AS MATERIALIZED (
SELECT r.machine_id, r.characteristic_id, r.sequence, p.context FROM present_context p
JOIN reading r ON r.machine_id = p.machine_id AND r.received_at >= p.filled
WHERE p.machine_id = :machine AND p.context <> '{}' AND r.measured_at >= p.since AND r.code <> :imported AND NOT EXISTS (
    SELECT FROM reading_context c WHERE c.machine_id = r.machine_id AND c.characteristic_id = r.characteristic_id
        AND c.sequence = r.sequence)
)
INSERT INTO reading_context (machine_id, characteristic_id, sequence, context) SELECT * FROM made
ON CONFLICT DO NOTHING
""")

_FILLED = text("UPDATE present_context SET filled = greatest(filled, :until) WHERE machine_id = :machine")


def set_present(session: Session, key: str, given: PresentContextIn, caller: Caller) -> PresentContext:
    """Say what the machine works at from now on; nothing said: at nothing that is known. Raises `NotFound`."""
    machine = machine_named(session, key)
    lock_machines(session, [machine.id])  # no reading of it is under way
    fill(session, machine.id)
    row = present_of(session, machine.id)
    before, after = row.context if row else {}, given.model_dump(mode="json", exclude_none=True)
    if row is not None and before == after:
        return row
    if row is None:
        row = PresentContext(machine_id=machine.id)
        session.add(row)
    row.context, row.changed_by = after, caller.name
    row.since = row.filled = datetime.now(UTC)
    session.flush()
    record(session, caller.name, "present context set", f"machine/{key}", before, after, None)
    publish(session, {"kind": "machine", "machine": key})
    return row


def fill(session: Session, machine_id: int) -> None:
    """Put the present context on the readings that were measured since it was set and have none. Done again it changes nothing.

    What a bridge kept through an outage was measured before, at a work that is not known any more: it gets none. The context is
    read by the statement that finds the readings, so that a new one is never put on the readings of the old one, or the other way.
    """
    until = datetime.now(UTC) - UNDER_WAY
    session.execute(_FILL, {"machine": machine_id, "imported": Code.IMPORTED.value})
    session.execute(_FILLED, {"machine": machine_id, "until": until})


def due(session: Session) -> list[Unit]:
    """Machines with a present context that had readings since the last look."""
    rows = session.execute(
        select(Machine.id, Machine.key)
        .join(PresentContext, PresentContext.machine_id == Machine.id)
        .join(Stream, Stream.machine_id == Machine.id)
        .where(PresentContext.context != {}, Stream.last_received_at >= PresentContext.filled)
        .distinct()
    )
    return [Unit(f"machine/{key}", (machine_id,), machine_id, None) for machine_id, key in rows]


def look_at(session: Session, unit: Unit) -> None:
    """Put it on the readings of one machine."""
    fill(session, int(unit.key[0]))


JOB = PeriodicJob("present_contexts", due, look_at)
