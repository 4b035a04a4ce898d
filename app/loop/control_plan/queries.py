"""Control plans, the state of each now, and the measurements that were missed. Never writes."""

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from typing import NamedTuple

from sqlalchemy import ColumnElement, and_, func, or_, select, true
from sqlalchemy.orm import Session

from app.core.control_plan import Due, Judged, Moment, Plan, Ran, Rhythm, judged, ran, rhythm
from app.core.decision.step import Code
from app.core.period import ALWAYS, Period
from app.db.period import in_period
from app.language.times import begin_of_shift
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.control_plan.alarm_kinds import MISSED
from app.loop.control_plan.tables import ControlPlan, MissedMeasurement
from app.loop.tables.alarms import Alarm
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Reading, Stream

MOST = 1_500
"""Readings of each characteristic that are looked at, the newest."""
LATELY = timedelta(days=30)
"""As far back as pages count."""
LONGEST = 1_000  # readings after an alarm that a plan can ask for


class Interval(NamedTuple):
    """The time between two readings in a row (`after`, `until`) in which the plan was not kept. every: the interval then."""

    after: int
    until: int | None
    every: int | None
    ran: Ran
    judged: Judged


class Look(NamedTuple):
    """A plan as it is kept now. late: closed intervals in which it was not kept, of the readings since the last look.

    sequence: the last reading. since: all that is known of the time after it. open: the missed measurement that is open.
    """

    row: ControlPlan
    sequence: int
    rhythm: Rhythm
    since: Ran
    judged: Judged
    late: list[Interval]
    open: MissedMeasurement | None


class MissedRow(NamedTuple):
    """A missed measurement and its place."""

    missed: MissedMeasurement
    characteristic: Characteristic
    machine: Machine


def plan_of(session: Session, current: CurrentCharacteristic) -> ControlPlan | None:
    """The plan of a characteristic, if it ever had one."""
    return session.get(ControlPlan, (current.machine.id, current.characteristic.id), populate_existing=True)


def planned(
    session: Session, *, machine_id: int | None = None, after: str = "", limit: int = 1000
) -> Sequence[tuple[ControlPlan, Characteristic, Machine]]:
    """Plans that ask for something, by the key of the characteristic."""
    query = (
        select(ControlPlan, Characteristic, Machine)
        .join(
            Characteristic,
            (Characteristic.machine_id == ControlPlan.machine_id)
            & (Characteristic.id == ControlPlan.characteristic_id),
        )
        .join(Machine, Machine.id == ControlPlan.machine_id)
        .where(Characteristic.key > after, asks())
        .where(true() if machine_id is None else ControlPlan.machine_id == machine_id)
        .order_by(Characteristic.key)
        .limit(limit)
    )
    return [(row[0], row[1], row[2]) for row in session.execute(query)]


def asks() -> ColumnElement[bool]:
    """As `app.core.control_plan.Plan.asks`."""
    columns = (ControlPlan.every, ControlPlan.minutes)
    counts = (ControlPlan.after_change, ControlPlan.after_alarm)
    return or_(ControlPlan.per_shift, *(one.is_not(None) for one in columns), *(one > 0 for one in counts))


def look(session: Session, row: ControlPlan, now: datetime | None = None) -> Look:
    """Look at a plan: what was missed since the last look, and what is due now."""
    now = now or datetime.now(UTC)
    plan, stream = row.plan, session.get_one(Stream, (row.machine_id, row.characteristic_id), populate_existing=True)
    own = _own(session, row)
    seen, begin = row.seen, Moment(row.since.timestamp(), 0)
    if own and (own[0][0] <= seen or len(own) == MOST):
        seen, begin = own[0]
    begin = begin._replace(at=max(begin.at, row.since.timestamp()), shift=_shift(max(begin.at, row.since.timestamp())))
    moments = [(seen, begin), *((sequence, moment) for sequence, moment in own if sequence > seen)]
    others = _others(session, row, begin.at)
    times = [each.at for each in others]
    measured = frozenset(moment.part for _sequence, moment in own if moment.part is not None)
    alarms = _alarms(session, row, stream) if plan.after_alarm else []

    def in_force(sequence: int) -> Rhythm:
        changed = sequence - stream.sequence_at_tool_change
        alarmed = max((at for at in alarms if at <= sequence), default=None)
        return rhythm(plan, changed if changed >= 0 else None, None if alarmed is None else sequence - alarmed)

    late = []
    for (after, last), (until, this) in pairwise(moments):
        between = others[bisect_right(times, last.at) : bisect_right(times, this.at)]
        passed = ran(plan, last, between, now=this, measured=measured, closed=True)
        verdict = judged(plan, in_force(after), passed, in_this_shift=True, closed=True)
        if verdict.due is Due.MISSED:
            late.append(Interval(after, until, in_force(after).every, passed, verdict))
    sequence, last = moments[-1]
    here = Moment(now.timestamp(), 0, None, _shift(now.timestamp()))
    since = ran(plan, last, others[bisect_left(times, last.at) :], now=here, measured=measured)
    force = in_force(sequence)
    verdict = judged(plan, force, since, in_this_shift=bool(sequence) and last.shift == here.shift)
    return Look(row, sequence, force, since, verdict, late, open_of(session, row))


def _shift(at: float) -> float:
    return begin_of_shift(datetime.fromtimestamp(at, UTC)).timestamp()


def _own(session: Session, row: ControlPlan) -> list[tuple[int, Moment]]:
    """Readings of the characteristic from the last one that was looked at, ascending."""
    newest = (
        select(Reading.sequence, Reading.measured_at, Reading.part)
        .where(
            Reading.machine_id == row.machine_id,
            Reading.characteristic_id == row.characteristic_id,
            Reading.sequence >= row.seen,
            (Reading.code != Code.IMPORTED) | (Reading.sequence == row.seen),
        )
        .order_by(Reading.sequence.desc())
        .limit(MOST)
    )
    return [
        (sequence, Moment(at.timestamp(), row.characteristic_id, part, _shift(at.timestamp())))
        for sequence, at, part in reversed(session.execute(newest).all())
    ]


def _others(session: Session, row: ControlPlan, since: float) -> list[Moment]:
    """Readings of the other characteristics of the same part, by time. Those of its form are made of its own."""
    own = session.get_one(Characteristic, (row.machine_id, row.characteristic_id))
    moment = datetime.fromtimestamp(since, UTC)
    query = (
        select(Reading.characteristic_id, Reading.part, Reading.measured_at)
        .join(
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
            Characteristic.part.is_not_distinct_from(own.part),
            Characteristic.form_of.is_distinct_from(own.id),
            Stream.last_measured_at > moment,
            Reading.sequence > Stream.sequence - MOST,
            Reading.measured_at > moment,
            Reading.code != Code.IMPORTED,
        )
        .order_by(Reading.measured_at)
    )
    return [Moment(at.timestamp(), source, part, _shift(at.timestamp())) for source, part, at in session.execute(query)]


def _alarms(session: Session, row: ControlPlan, stream: Stream) -> list[int]:
    """The last reading before the end of each alarm about the characteristic or its tool, as far as the plan looks back."""
    before = (
        select(func.max(Reading.sequence))
        .where(
            Reading.machine_id == row.machine_id,
            Reading.characteristic_id == row.characteristic_id,
            Reading.sequence > stream.sequence - LONGEST,
            Reading.received_at <= Alarm.last_at,
        )
        .correlate(Alarm)
        .scalar_subquery()
    )
    own = Alarm.characteristic_id == row.characteristic_id
    if stream.tool_memory:
        own = or_(own, and_(Alarm.characteristic_id.is_(None), Alarm.tool_memory == stream.tool_memory))
    found = session.scalars(
        select(func.coalesce(Alarm.last_sequence, Alarm.sequence, before, 0))
        .where(Alarm.machine_id == row.machine_id, own, Alarm.kind != MISSED.name)
        .order_by(Alarm.id.desc())
        .limit(100)
    )
    return list(found)


def open_of(session: Session, row: ControlPlan) -> MissedMeasurement | None:
    """The missed measurement of a plan that no reading has ended yet."""
    return session.scalars(
        select(MissedMeasurement)
        .where(
            MissedMeasurement.machine_id == row.machine_id,
            MissedMeasurement.characteristic_id == row.characteristic_id,
            MissedMeasurement.ended_at.is_(None),
        )
        .execution_options(populate_existing=True)
    ).one_or_none()


def missed(
    session: Session,
    *,
    machine_id: int | None = None,
    characteristic: Characteristic | None = None,
    period: Period = ALWAYS,
    before: int | None = None,
    limit: int = 1000,
) -> list[MissedRow]:
    """Missed measurements, the last found first."""
    query = (
        select(MissedMeasurement, Characteristic, Machine)
        .join(
            Characteristic,
            (Characteristic.machine_id == MissedMeasurement.machine_id)
            & (Characteristic.id == MissedMeasurement.characteristic_id),
        )
        .join(Machine, Machine.id == MissedMeasurement.machine_id)
        .where(_of(machine_id, characteristic), in_period(MissedMeasurement.found_at, period))
        .where(true() if before is None else MissedMeasurement.id < before)
        .order_by(MissedMeasurement.id.desc())
        .limit(limit)
    )
    return [MissedRow(*row) for row in session.execute(query)]


def count_missed(session: Session, characteristic: Characteristic, period: Period) -> tuple[int, int]:
    """Number of missed measurements that were found in a period, and of the parts that are known of them."""
    counted = session.execute(
        select(func.count(), func.sum(MissedMeasurement.parts)).where(
            _of(None, characteristic), in_period(MissedMeasurement.found_at, period)
        )
    ).one()
    return counted[0], counted[1] or 0


def missed_lately(session: Session, characteristic: Characteristic, now: datetime) -> tuple[int, int]:
    """The same of the last 30 days."""
    return count_missed(session, characteristic, Period(now - LATELY))


def _of(machine_id: int | None, characteristic: Characteristic | None) -> ColumnElement[bool]:
    if characteristic is not None:
        return and_(
            MissedMeasurement.machine_id == characteristic.machine_id,
            MissedMeasurement.characteristic_id == characteristic.id,
        )
    return true() if machine_id is None else MissedMeasurement.machine_id == machine_id


def stated(plan: ControlPlan | None) -> Plan:
    """The plan as the core has it; one that asks for nothing where there is none."""
    return plan.plan if plan is not None else Plan()
