"""Measurements by hand. Never writes."""

from collections import defaultdict
from collections.abc import Collection

from sqlalchemy import Select, select
from sqlalchemy.dialects.postgresql import distinct_on
from sqlalchemy.orm import Session, aliased

from app.loop.tables.readings import HandMeasurement


def _here(machine_id: int, characteristic_id: int) -> Select[HandMeasurement]:
    return select(HandMeasurement).where(
        HandMeasurement.machine_id == machine_id, HandMeasurement.characteristic_id == characteristic_id
    )


def of_readings(
    session: Session, machine_id: int, characteristic_id: int, sequences: Collection[int]
) -> dict[int, list[HandMeasurement]]:
    """Those of these readings, by reading, the latest last."""
    if not sequences:
        return {}
    measurements: dict[int, list[HandMeasurement]] = defaultdict(list)
    wanted = _here(machine_id, characteristic_id).where(HandMeasurement.sequence.in_(sequences))
    for measurement in session.scalars(wanted.order_by(HandMeasurement.sequence, HandMeasurement.id)):
        measurements[measurement.sequence].append(measurement)
    return dict(measurements)


def between(
    session: Session, machine_id: int, characteristic_id: int, first: int, last: int, limit: int
) -> list[HandMeasurement]:
    """Those of the readings first … last, oldest reading first; of more than `limit` the newest."""
    wanted = _here(machine_id, characteristic_id).where(HandMeasurement.sequence.between(first, last))
    newest = wanted.order_by(HandMeasurement.sequence.desc(), HandMeasurement.id.desc()).limit(limit)
    return list(reversed(session.scalars(newest).all()))


def page(session: Session, machine_id: int, characteristic_id: int, after: int, limit: int) -> list[HandMeasurement]:
    """In the order in which they were entered, after this number."""
    wanted = _here(machine_id, characteristic_id).where(HandMeasurement.id > after)
    return list(session.scalars(wanted.order_by(HandMeasurement.id).limit(limit)))


def latest_of_each() -> type[HandMeasurement]:
    """The last measurement of every reading, to be joined to the readings."""
    newest = (
        select(HandMeasurement)
        .ext(distinct_on(HandMeasurement.machine_id, HandMeasurement.characteristic_id, HandMeasurement.sequence))
        .order_by(
            HandMeasurement.machine_id,
            HandMeasurement.characteristic_id,
            HandMeasurement.sequence,
            HandMeasurement.id.desc(),
        )
    )
    return aliased(HandMeasurement, newest.subquery())
