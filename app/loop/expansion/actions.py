"""Setting the thermal expansion of a characteristic."""

from datetime import UTC, datetime

from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.core.temperature import Expansion
from app.db.events import publish
from app.loop.characteristics.queries import characteristic_named
from app.loop.expansion import queries
from app.loop.expansion.schemas import ExpansionIn
from app.loop.expansion.tables import ThermalExpansion
from app.loop.machines.queries import lock_machines

__all__ = ["ExpansionIn", "set_expansion"]


def set_expansion(session: Session, key: str, given: ExpansionIn, caller: Caller) -> ThermalExpansion | None:
    """Set how a characteristic expands; sizes at 20 °C of all its readings follow, no decision does. Raises `NotFound`."""
    current = characteristic_named(session, key)
    machine_id, characteristic_id = current.machine.id, current.characteristic.id
    lock_machines(session, [machine_id])
    row = queries.row_of(session, machine_id, characteristic_id)
    before, after = queries.NOTHING if row is None else row.expansion, given.expansion
    if before == after:
        return row
    if row is None:
        row = ThermalExpansion(machine_id=machine_id, characteristic_id=characteristic_id)
        session.add(row)
    changes = [name for name in Expansion.__dataclass_fields__ if getattr(after, name) != getattr(before, name)]
    for name in changes:
        setattr(row, name, getattr(after, name))
    row.changed_by, row.reason, row.changed_at = caller.name, given.reason, datetime.now(UTC)
    session.flush()
    record(
        session,
        caller.name,
        "thermal expansion set",
        f"characteristic/{key}",
        {name: getattr(before, name) for name in changes},
        {name: getattr(after, name) for name in changes},
        given.reason,
    )
    publish(session, {"kind": "characteristic", "machine": current.machine.key, "characteristic": key})
    return row
