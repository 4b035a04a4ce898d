"""Queries of the photos of alarms. Never writes."""

from collections.abc import Iterable, Sequence

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.errors import NotFound
from app.language.i18n import _
from app.loop.alarm_response.queries import AlarmRow, alarm
from app.loop.tables.alarms import Alarm, AlarmPhoto


def photos(session: Session, row: Alarm, *, after: int = 0, limit: int = 1000) -> Sequence[AlarmPhoto]:
    """The photos of an alarm, removed ones too, in the order in which they came; what they show is not read yet."""
    query = select(AlarmPhoto).where(
        AlarmPhoto.machine_id == row.machine_id, AlarmPhoto.alarm_id == row.id, AlarmPhoto.id > after
    )
    return session.scalars(query.order_by(AlarmPhoto.id).limit(limit)).all()


def photo(session: Session, number: int, photo_number: int) -> tuple[AlarmRow, AlarmPhoto]:
    """A photo with its alarm. Raises `NotFound`."""
    row = alarm(session, number)
    found = session.get(AlarmPhoto, (row.alarm.machine_id, photo_number), populate_existing=True)
    if found is None or found.alarm_id != number:
        raise NotFound(
            _("Alarm {number} has no photo {photo}.").format(number=number, photo=photo_number),
            _("GET /api/v1/alarms/{number}/photos lists them.").format(number=number),
        )
    return row, found


def photo_counts(session: Session, alarms: Iterable[Alarm]) -> dict[int, int]:
    """Number of photos, without removed ones, by the number of the alarm; alarms without any are left out."""
    machines: dict[int, list[int]] = {}
    for each in alarms:
        machines.setdefault(each.machine_id, []).append(each.id)
    if not machines:
        return {}
    query = select(AlarmPhoto.alarm_id, func.count().label("photos")).where(
        AlarmPhoto.machine_id.in_(machines),
        AlarmPhoto.alarm_id.in_([number for numbers in machines.values() for number in numbers]),
        AlarmPhoto.removed_at.is_(None),
    )
    return {row.alarm_id: row.photos for row in session.execute(query.group_by(AlarmPhoto.alarm_id))}
