"""Characteristics of AQDEF files and those here, as a person matched them before; readings that came before. Never writes."""

from datetime import timedelta

from sqlalchemy import func, select
from sqlalchemy.orm import Session, aliased

from app.loop.readings.importing.history import Summary
from app.loop.readings.records import Entry
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.readings import ImportMapping, Reading

SAME = 5e-10  # mm


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


def count_alike(session: Session, entry: Entry, summary: Summary) -> int:
    """The number of readings just stored that have second, size and part of one that was here before."""
    if summary.first_at is None or summary.last_at is None or not summary.stored:
        return 0
    new, old = aliased(Reading), aliased(Reading)
    second = timedelta(seconds=1)
    return session.scalars(
        select(func.count(new.sequence.distinct()))
        .join(
            old,
            (old.machine_id == new.machine_id)
            & (old.characteristic_id == new.characteristic_id)
            & (func.date_trunc("second", old.measured_at) == func.date_trunc("second", new.measured_at))
            & (func.coalesce(old.part, "") == func.coalesce(new.part, ""))
            & (func.abs(old.measured - new.measured) < SAME),
        )
        .where(
            new.machine_id == entry.machine_id,
            new.characteristic_id == entry.characteristic_id,
            new.sequence >= summary.first_sequence,
            old.sequence < summary.first_sequence,
            old.measured_at.between(summary.first_at - second, summary.last_at + second),
        )
    ).one()
