"""Open corrections, and those that fell with a change of parameters. Never writes."""

from collections.abc import Sequence
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Stream
from app.loop.tables.tools import OPEN, Correction


def open_corrections(
    session: Session,
    machine: Machine,
    tool_memory: int | None = None,
    characteristic: Characteristic | None = None,
    average_memory: int | None = None,
) -> Sequence[Correction]:
    """Held, awaiting approval and pending ones, oldest first.

    Of a tool, by the readings of a characteristic, or by those of the characteristics that use a location R11.
    """
    query = select(Correction).where(Correction.machine_id == machine.id, Correction.status.in_(OPEN))
    if tool_memory is not None:
        query = query.where(Correction.tool_memory == tool_memory)
    if characteristic is not None:
        query = query.where(Correction.characteristic_id == characteristic.id)
    if average_memory is not None:
        on_it = select(Stream.characteristic_id).where(
            Stream.machine_id == machine.id, Stream.average_memory == average_memory
        )
        query = query.where(Correction.characteristic_id.in_(on_it))
    return session.scalars(query.order_by(Correction.number).execution_options(populate_existing=True)).all()


def superseded_with(session: Session, current: CurrentCharacteristic) -> list[int]:
    """Numbers of the corrections that fell when the parameters in force were made: in the same transaction."""
    query = select(Correction.number).where(
        Correction.machine_id == current.machine.id,
        Correction.characteristic_id == current.characteristic.id,
        Correction.status == "superseded",
        Correction.decided_at == current.version.created_at,
    )
    return list(session.scalars(query.order_by(Correction.number)))


def correction_changed(session: Session, machine: Machine, correction: Correction) -> dict[str, Any]:
    """The event of a correction for live pages and event listeners."""
    return {
        "kind": "correction",
        "machine": machine.key,
        "characteristic": session.scalar(
            select(Characteristic.key).where(
                Characteristic.machine_id == machine.id, Characteristic.id == correction.characteristic_id
            )
        ),
        "tool": correction.tool_memory,
        "number": correction.number,
        "status": correction.status,
    }
