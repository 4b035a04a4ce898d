"""Queries of alarms. Never writes."""

from collections.abc import Sequence
from typing import Literal, NamedTuple

from sqlalchemy import Select, any_, case, exists, func, literal, select
from sqlalchemy.orm import Session, aliased

from app.db.text import holds_words
from app.errors import NotFound
from app.language.i18n import _
from app.loop.alarms.kinds import kinds
from app.loop.alarms.reading_kinds import HOLDING
from app.loop.tables.alarms import Alarm
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Reading
from app.loop.tables.tools import OPEN, Correction, Tool
from app.web.fields import LARGEST_ID
from app.web.states import URGENCY

AlarmState = Literal["active", "acknowledged", "all"]
ITS_CHARACTERISTIC = (Characteristic.machine_id == Alarm.machine_id) & (Characteristic.id == Alarm.characteristic_id)
"""Joins an alarm to its characteristic; it may have none."""


class AlarmRow(NamedTuple):
    """An alarm with the names of what it is about, the correction that is held because of it, and the sister of its tool."""

    alarm: Alarm
    machine: Machine
    characteristic: Characteristic | None
    held: Correction | None
    sister: int | None


def _rows() -> Select[Alarm, Machine, Characteristic, Correction, int | None]:
    held = aliased(Correction)
    return (
        select(Alarm, Machine, Characteristic, held, Tool.sister)
        .join(Machine, Machine.id == Alarm.machine_id)
        .outerjoin(Characteristic, ITS_CHARACTERISTIC)
        .outerjoin(  # a tool has one held correction at most: a newer one supersedes it; its reading names its alarms
            held,
            (held.machine_id == Alarm.machine_id)
            & (held.tool_memory == Alarm.tool_memory)
            & (held.characteristic_id == Alarm.characteristic_id)
            & (held.status == "held")
            & Alarm.kind.in_(HOLDING)
            & Alarm.acknowledged_at.is_(None)
            & exists().where(
                Reading.machine_id == held.machine_id,
                Reading.characteristic_id == held.characteristic_id,
                Reading.sequence == held.sequence,
                Alarm.id == any_(Reading.alarms),
            ),
        )
        .outerjoin(Tool, (Tool.machine_id == Alarm.machine_id) & (Tool.number == Alarm.tool_memory))
        .execution_options(populate_existing=True)
    )


def alarm(session: Session, number: int) -> AlarmRow:
    """One alarm by its number. Raises `NotFound`."""
    row = session.execute(_rows().where(Alarm.id == number)).one_or_none() if 0 < number <= LARGEST_ID else None
    if row is None:
        raise NotFound(
            _("There is no alarm {number}.").format(number=number),
            _("Check the number; GET /api/v1/alarms lists them."),
        )
    return AlarmRow(*row)


def alarms(
    session: Session,
    *,
    state: AlarmState = "all",
    machine_id: int | None = None,
    characteristic: str | None = None,
    kind: str | None = None,
    after: int = 0,
    limit: int = 100,
    by_urgency: bool = False,
) -> list[AlarmRow]:
    """Alarms, oldest first; by_urgency: the most urgent first, of those the oldest."""
    query = _filtered(state, machine_id).where(Alarm.id > after).limit(limit)
    if by_urgency:
        places = {kind.name: URGENCY.index(kind.tone) for kind in kinds()}
        query = query.order_by(case(places, value=Alarm.kind, else_=URGENCY.index("attention")))
    query = query.order_by(Alarm.id)
    if characteristic is not None:
        query = query.where(Characteristic.key == characteristic)
    if kind is not None:
        query = query.where(Alarm.kind == kind)
    return [AlarmRow(*row) for row in session.execute(query)]


def _filtered(
    state: AlarmState, machine_id: int | None
) -> Select[Alarm, Machine, Characteristic, Correction, int | None]:
    query = _rows()
    if machine_id is not None:
        query = query.where(Alarm.machine_id == machine_id)
    if state == "active":
        query = query.where(Alarm.acknowledged_at.is_(None))
    elif state == "acknowledged":
        query = query.where(Alarm.acknowledged_at.is_not(None))
    return query


def history(
    session: Session, *, machine_id: int | None = None, holding: str = "", before: int | None = None, limit: int = 50
) -> list[AlarmRow]:
    """All alarms, newest first. holding: those in whose kind, names, comment or acknowledging person these words are found."""
    query = _filtered("all", machine_id)
    names = (Machine.name, Machine.key, Characteristic.name, Characteristic.key, Alarm.comment, Alarm.acknowledged_by)
    words = {kind.name: kind.word() for kind in kinds()}
    query = query.where(*holds_words(holding, *names, coded=(Alarm.kind, words)))
    if before is not None:
        query = query.where(Alarm.id < before)
    return [AlarmRow(*row) for row in session.execute(query.order_by(Alarm.id.desc()).limit(limit))]


def acknowledged_last(session: Session, *, machine_id: int | None = None, limit: int = 8) -> list[AlarmRow]:
    """The alarms acknowledged last, the latest first."""
    query = _filtered("acknowledged", machine_id).order_by(Alarm.acknowledged_at.desc(), Alarm.id.desc())
    return [AlarmRow(*row) for row in session.execute(query.limit(limit))]


ACTIVE_COUNT = select(func.count()).select_from(Alarm).where(Alarm.acknowledged_at.is_(None))


def active_count(session: Session, machine_id: int | None = None) -> int:
    """Return the number of active alarms."""
    return (
        session.scalar(ACTIVE_COUNT if machine_id is None else ACTIVE_COUNT.where(Alarm.machine_id == machine_id)) or 0
    )


def active_by_machine(session: Session) -> dict[str, int]:
    """Number of active alarms by machine key."""
    counted = func.count().label("active")
    return {
        row.key: row.active
        for row in session.execute(
            select(Machine.key, counted)
            .join(Alarm, Alarm.machine_id == Machine.id)
            .where(Alarm.acknowledged_at.is_(None))
            .group_by(Machine.key)
        )
    }


def readings_behind(session: Session, row: AlarmRow) -> tuple[str | None, list[int]]:
    """The characteristic whose readings raised the alarm, and their sequence numbers.

    An alarm about a tool (*offset limit*) names the characteristic that raised it first in its data; one about a signal the
    reading that may be false.
    """
    alarm = row.alarm
    if alarm.kind == "signal":
        return row.characteristic.key if row.characteristic else None, list(alarm.data.get("readings", []))
    key = row.characteristic.key if row.characteristic else alarm.data.get("characteristic")
    if key is None or alarm.sequence is None:
        return None, []
    behind = (
        select(Reading.sequence)
        .join(
            Characteristic,
            (Characteristic.machine_id == Reading.machine_id) & (Characteristic.id == Reading.characteristic_id),
        )
        .where(
            Characteristic.key == key,
            Reading.machine_id == alarm.machine_id,
            Reading.sequence >= alarm.sequence,
            literal(alarm.id) == any_(Reading.alarms),
        )
    )
    if row.characteristic is not None:  # the last one of a tool's alarm may be of another characteristic
        behind = behind.where(Reading.sequence <= (alarm.last_sequence or alarm.sequence))
    return key, list(session.scalars(behind.order_by(Reading.sequence)))


def corrections_of(
    session: Session, machine_id: int, characteristic_id: int, sequences: Sequence[int]
) -> list[Correction]:
    """The corrections that these readings led to, as far as they are open or applied."""
    return list(
        session.scalars(
            select(Correction)
            .where(
                Correction.machine_id == machine_id,
                Correction.characteristic_id == characteristic_id,
                Correction.sequence.in_(sequences),
                Correction.status.in_((*OPEN, "applied")),
            )
            .order_by(Correction.number)
        )
    )
