"""Signs by which a control plan is judged: readings of its characteristic and of the others of the part, times in which the control
reported that it ran, tool changes, alarms.

Never writes.
"""

from bisect import bisect_right
from collections.abc import Collection, Sequence
from datetime import UTC, datetime
from math import inf
from typing import Any, NamedTuple

from sqlalchemy import Select, and_, func, or_, select, true
from sqlalchemy.orm import Session

from app.core.control_plan import Moment, Run, Tightened
from app.core.decision.step import Code
from app.language.times import begin_of_shift
from app.loop.control_plan.alarm_kinds import MISSED
from app.loop.tables.alarms import Alarm
from app.loop.tables.characteristics import Characteristic, ParametersVersion
from app.loop.tables.connections import MachineRun
from app.loop.tables.control_plan import ControlPlan
from app.loop.tables.readings import Reading, Stream
from app.loop.tables.tools import Tool

MOST = 1_500
"""Readings of each characteristic that are looked at, the newest."""
FEW = 50
"""Readings of each other characteristic that are looked at first."""
FURTHEST = 5_000
"""Readings in which those of the characteristic itself are looked for: an import may have brought more."""


def shift_of(at: float) -> float:
    return begin_of_shift(datetime.fromtimestamp(at, UTC)).timestamp()


class Own(NamedTuple):
    """A reading of the characteristic itself. received: when it came, seconds."""

    sequence: int
    received: float
    moment: Moment


def own_readings(session: Session, row: ControlPlan, stream: Stream) -> list[Own]:
    """The newest readings of the characteristic, in the order in which they came. None was measured after it came."""
    newest = (
        select(Reading.sequence, Reading.received_at, Reading.measured_at, Reading.part)
        .where(
            Reading.machine_id == row.machine_id,
            Reading.characteristic_id == row.characteristic_id,
            Reading.sequence > stream.sequence - FURTHEST,
            Reading.code != Code.IMPORTED,
        )
        .order_by(Reading.sequence.desc())
        .limit(MOST)
    )
    return [
        Own(sequence, received.timestamp(), Moment(min(at, received).timestamp(), row.characteristic_id, part))
        for sequence, received, at, part in reversed(session.execute(newest).all())
    ]


def other_readings(session: Session, row: ControlPlan, own: Characteristic, since: float) -> list[Moment]:
    """Readings of the other characteristics of the same part, by time: the newest few of each, more where all of them are since.

    Where the part is not stated others may be of another: only names tell, if parts are numbered one by one on the machine.
    """
    if own.part is None and not row.numbered:
        return []
    found, more = _newest_of_others(session, row, own, since, FEW)
    if more:
        found = [each for each in found if each.source not in more]
        found += _newest_of_others(session, row, own, since, MOST, more)[0]
    return sorted(found, key=lambda each: each.at)


def _newest_of_others(
    session: Session, row: ControlPlan, own: Characteristic, since: float, most: int, only: Collection[int] = ()
) -> tuple[list[Moment], set[int]]:
    """The newest of each since a moment, without those of its form, which are made of its own; and those that have more."""
    moment = datetime.fromtimestamp(since, UTC)
    counts = and_(Reading.measured_at > moment, Reading.received_at > moment)
    first = Reading.sequence == Stream.sequence - most + 1
    made = Reading.code != Code.IMPORTED
    columns = (Reading.characteristic_id, Reading.part, func.least(Reading.measured_at, Reading.received_at))
    query = select(*columns, first, and_(counts, made)).where(
        Characteristic.part.is_not_distinct_from(own.part),
        Characteristic.id.in_(only) if only else true(),
        or_(and_(counts, made), and_(first, or_(counts, Reading.code == Code.IMPORTED))),
    )
    found, more = [], set[int]()
    for source, part, at, is_first, is_made in session.execute(_of_others(query, row, own, moment, most)):
        if is_first:
            more.add(source)
        if is_made and (own.part is not None or part is not None):
            found.append(Moment(at.timestamp(), source, part, shift_of(at.timestamp())))
    return found, more


def _of_others(query: Select[Any], row: ControlPlan, own: Characteristic, since: datetime, most: int) -> Select[Any]:
    """A query of readings narrowed to the newest of each other characteristic of the machine that was measured since."""
    return (
        query.join(
            Stream,
            (Stream.machine_id == Reading.machine_id) & (Stream.characteristic_id == Reading.characteristic_id),
        )
        .join(
            Characteristic,
            (Characteristic.machine_id == Stream.machine_id) & (Characteristic.id == Stream.characteristic_id),
        )
        .where(
            Reading.machine_id == row.machine_id,
            Stream.machine_id == row.machine_id,
            Characteristic.machine_id == row.machine_id,
            Characteristic.id != own.id,
            Characteristic.form_of.is_distinct_from(own.id),
            Stream.last_measured_at > since,
            Reading.sequence > Stream.sequence - most,
        )
    )


def runs(session: Session, row: ControlPlan, own: Characteristic, since: float) -> list[Run]:
    """Times in which the control reported that it ran, until another part was measured: from then on it may have run for that one.

    None where `MOST` readings of that part do not reach back to its first.
    """
    if row.minutes is None:
        return []
    moment = datetime.fromtimestamp(since, UTC)
    another_part = select(
        func.min(func.least(Reading.measured_at, Reading.received_at)),
        func.bool_or(Reading.sequence == Stream.sequence - MOST + 1),
    ).where(
        or_(Characteristic.part.is_distinct_from(own.part), Characteristic.part.is_(None)),
        Reading.measured_at > moment,
        Reading.received_at > moment,
    )
    first, more = session.execute(_of_others(another_part, row, own, moment, MOST)).one()
    if more:
        return []
    times = select(MachineRun.begin, MachineRun.until).where(
        MachineRun.machine_id == row.machine_id, MachineRun.until > moment
    )
    end = inf if first is None else first.timestamp()
    return [Run(begin.timestamp(), min(until.timestamp(), end)) for begin, until in session.execute(times)]


def events(
    session: Session, row: ControlPlan, stream: Stream, own: Sequence[Own]
) -> list[tuple[Tightened, float, int]]:
    """The last tool change and the alarms about the characteristic or its tool, by time. Last: how many of `own` came before."""

    def come(at: datetime) -> int:
        return bisect_right(own, at.timestamp(), key=lambda each: each.received)

    found = []
    changed = _changed_at(session, row, stream) if row.after_change else None
    if changed is not None:
        found.append((Tightened.TOOL_CHANGE, changed.timestamp(), come(changed)))
    if row.after_alarm:
        about = Alarm.characteristic_id == row.characteristic_id
        if stream.tool_memory:
            about = or_(about, and_(Alarm.characteristic_id.is_(None), Alarm.tool_memory == stream.tool_memory))
        alarms = session.execute(
            select(Alarm.characteristic_id, func.coalesce(Alarm.last_sequence, Alarm.sequence), Alarm.last_at)
            .where(Alarm.machine_id == row.machine_id, about, Alarm.kind != MISSED.name)
            .order_by(Alarm.id.desc())
            .limit(100)
        )
        for of, sequence, at in alarms:
            by_reading = of is not None and sequence is not None  # else the number is one of another characteristic
            before = bisect_right(own, sequence, key=lambda each: each.sequence) if by_reading else come(at)
            found.append((Tightened.ALARM, at.timestamp(), before))
    if stream.sequence > FURTHEST and len(own) < MOST:  # more was read since than is known here
        found = [event for event in found if event[2]]
    return found


def _changed_at(session: Session, row: ControlPlan, stream: Stream) -> datetime | None:
    """The moment at which the tool was changed, or the characteristic given to this tool; None: never."""
    tool = session.scalar(
        select(Tool.changed_at).where(Tool.machine_id == row.machine_id, Tool.number == stream.tool_memory)
    )
    versions = (
        ParametersVersion.machine_id == row.machine_id,
        ParametersVersion.characteristic_id == row.characteristic_id,
    )
    another = (
        select(func.max(ParametersVersion.version))
        .where(*versions, ParametersVersion.parameters["tool_memory"].as_integer() != stream.tool_memory)
        .scalar_subquery()
    )
    given = session.scalar(
        select(func.min(ParametersVersion.created_at)).where(*versions, ParametersVersion.version > another)
    )
    return max((at for at in (tool, given) if at is not None), default=None)
