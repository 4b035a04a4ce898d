"""Photos of what was found at an alarm: kept beside it, before or after it is acknowledged, and removed if they must be."""

from datetime import UTC, datetime

from sqlalchemy import func, select
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.db.events import publish
from app.errors import Conflict
from app.files.pictures import Picture
from app.language.i18n import _
from app.loop.alarm_response import photo_queries, queries
from app.loop.alarm_response.queries import AlarmRow
from app.loop.tables.alarms import Alarm, AlarmPhoto

MOST_PHOTOS = 12
"""Of one alarm, removed ones too."""


def add_photo(session: Session, number: int, picture: Picture, caller: Caller) -> AlarmPhoto:
    """Keep a photo at an alarm; the same one sent twice is one. Raises `NotFound`; `Conflict` where it has `MOST_PHOTOS`."""
    row = _held(session, number)
    here = (AlarmPhoto.machine_id == row.alarm.machine_id, AlarmPhoto.alarm_id == number)
    same = session.scalars(select(AlarmPhoto).where(*here, AlarmPhoto.digest == picture.digest)).one_or_none()
    if same is not None:
        return same
    if (session.scalar(select(func.count()).where(*here)) or 0) >= MOST_PHOTOS:
        raise Conflict(
            _("Alarm {number} has {most} photos already.").format(number=number, most=MOST_PHOTOS),
            _("The alarm and its photos are kept; nothing more is needed."),
        )
    of = {"machine_id": row.alarm.machine_id, "alarm_id": number, "made_by": caller.name}
    made = session.scalars(insert(AlarmPhoto).values(picture.columns | of).returning(AlarmPhoto)).one()
    about = {"photo": made.id, "digest": made.digest, "bytes": made.size}
    record(session, caller.name, "photo added", f"alarm/{number}", None, about)
    _publish(session, row)
    return made


def remove_photo(session: Session, number: int, photo: int, reason: str, caller: Caller) -> AlarmPhoto:
    """Take away what a photo shows; who sent and who removed it stays. Raises `NotFound`, `Conflict` where it is removed."""
    _held(session, number)
    row, found = photo_queries.photo(session, number, photo)
    if found.removed_at is not None:
        raise Conflict(
            _("{who} has removed this photo already.").format(who=found.removed_by), _("There is nothing left to do.")
        )
    found.content = None
    found.removed_at, found.removed_by, found.removed_why = datetime.now(UTC), caller.name, reason
    session.flush()
    record(session, caller.name, "photo removed", f"alarm/{number}", {"photo": found.id}, None, reason)
    _publish(session, row)
    return found


def _held(session: Session, number: int) -> AlarmRow:
    """The alarm, whose photos nobody else changes until the transaction ends. The machine is not held: no reading waits."""
    row = queries.alarm(session, number)
    session.execute(
        select(Alarm.id).where(Alarm.machine_id == row.alarm.machine_id, Alarm.id == number).with_for_update()
    )
    return row


def _publish(session: Session, row: AlarmRow) -> None:
    publish(session, {"kind": "photos", "machine": row.machine.key, "id": row.alarm.id})
