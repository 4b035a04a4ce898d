"""Characteristics of AQDEF files and those here, as somebody matched them before. Never writes."""

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.loop.tables.characteristics import Characteristic
from app.loop.tables.readings import ImportMapping


def remembered(session: Session) -> dict[tuple[str, str, str], str]:
    """The key of the characteristic by part, number and name in files; the newest choice counts."""
    rows = session.execute(
        select(ImportMapping.part, ImportMapping.number, ImportMapping.name, Characteristic.key)
        .join(
            Characteristic,
            (Characteristic.machine_id == ImportMapping.machine_id)
            & (Characteristic.id == ImportMapping.characteristic_id),
        )
        .order_by(ImportMapping.at)
    )
    return {(part, number, name): key for part, number, name, key in rows}
