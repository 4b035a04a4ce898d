"""The expansion of characteristics, and sizes at 20 °C. Never writes."""

from collections.abc import Mapping
from typing import Any

from sqlalchemy import Float, or_, select
from sqlalchemy.orm import Session

from app.core.temperature import AtReference, Expansion, Missing, at_reference
from app.loop.expansion.tables import ThermalExpansion
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.readings import ReadingContext

NOTHING = Expansion()


def row_of(session: Session, machine_id: int, characteristic_id: int) -> ThermalExpansion | None:
    """The row of a characteristic, if anything was stated."""
    return session.get(ThermalExpansion, (machine_id, characteristic_id), populate_existing=True)


def expansion_of(session: Session, machine_id: int, characteristic_id: int) -> Expansion:
    """The expansion of a characteristic; without any coefficient where nothing was stated."""
    row = row_of(session, machine_id, characteristic_id)
    return NOTHING if row is None else row.expansion


def temperatures_of(context: Mapping[str, Any] | None) -> tuple[float | None, float | None]:
    """Temperatures of part and machine in the circumstances of a reading, °C; None where they are not stated."""
    context = context or {}
    return context.get("part_temperature"), context.get("machine_temperature")


def temperatures_between(
    session: Session, characteristic: Characteristic, first: int, last: int
) -> dict[int, tuple[float | None, float | None]]:
    """Temperatures of part and machine (°C) of the readings first … last that have one, by sequence."""
    part, machine = (ReadingContext.context[f"{body}_temperature"].astext.cast(Float) for body in ("part", "machine"))
    rows = session.execute(
        select(ReadingContext.sequence, part, machine).where(
            ReadingContext.machine_id == characteristic.machine_id,
            ReadingContext.characteristic_id == characteristic.id,
            ReadingContext.sequence.between(first, last),
            or_(part.is_not(None), machine.is_not(None)),
        )
    )
    return {sequence: (of_part, of_machine) for sequence, of_part, of_machine in rows}


def at_20(size: float, context: Mapping[str, Any] | None, expansion: Expansion) -> AtReference | Missing | None:
    """The size of a reading at 20 °C, or why there is none; None of a reading without any temperature. size: mm."""
    part, machine = temperatures_of(context)
    return None if part is None and machine is None else at_reference(size, part, machine, expansion)
