"""Control plans, the state of each now, and the measurements that were missed. Never writes."""

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from typing import Any, NamedTuple

from sqlalchemy import ColumnElement, and_, exists, func, or_, select, text, true
from sqlalchemy.orm import Session

from app.core.context import ContextField
from app.core.control_plan import (
    Due,
    Event,
    Judged,
    Moment,
    Plan,
    Ran,
    Rhythm,
    in_time,
    judged,
    ran,
    rhythm,
)
from app.core.decision.step import Code
from app.core.period import ALWAYS, Period
from app.db.period import in_period
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.control_plan import signs
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.control_plan import ControlPlan, MissedMeasurement
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Stream

MOST_LOOKED_AT = 10_000  # readings at once, for what their context lacks
LATELY = timedelta(days=30)
"""As far back as pages count."""


class Interval(NamedTuple):
    """The time between two readings in a row (`after`, `until`) in which the plan was not kept."""

    after: int
    until: int | None
    ran: Ran
    judged: Judged


class Look(NamedTuple):
    """A plan as it is kept now. late: closed intervals in which it was not kept, of the readings since the last look.

    sequence: the last reading in time. seen: the last one that came. since: all that is known of the time after it. open: the
    missed measurement that is open. of_part: it is stated of which part the characteristic is.
    """

    row: ControlPlan
    sequence: int
    seen: int
    rhythm: Rhythm
    since: Ran
    judged: Judged
    late: list[Interval]
    open: MissedMeasurement | None
    of_part: bool


class Lacking(NamedTuple):
    """Required context that the newest readings lack. fields: how many lack each that any lacks. readings: that lack any; last: of them."""

    fields: dict[str, int]
    readings: int
    last: int
    newest: int

    def as_data(self, before: Mapping[str, Any]) -> dict[str, Any]:
        """For its alarm. before: its data, with what earlier looks found since it was raised."""
        fields = [*before.get("fields", ()), *self.fields]
        return {
            "fields": [field.value for field in ContextField if field.value in fields],
            "readings": int(before.get("readings", 0)) + self.readings,
            "last": self.last,
        }


class MissedRow(NamedTuple):
    """A missed measurement and its place."""

    missed: MissedMeasurement
    characteristic: Characteristic
    machine: Machine


def plan_of(session: Session, current: CurrentCharacteristic) -> ControlPlan | None:
    """The plan of a characteristic, if it ever had one."""
    return session.get(ControlPlan, (current.machine.id, current.characteristic.id), populate_existing=True)


def planned(
    session: Session, *, machine_id: int | None = None, after: str = "", limit: int | None = None
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
    return or_(counts_parts(), ControlPlan.minutes.is_not(None), ControlPlan.per_shift)


def counts_parts() -> ColumnElement[bool]:
    """As `app.core.control_plan.Plan.counts_parts`."""
    return or_(ControlPlan.every.is_not(None), ControlPlan.after_change > 0, ControlPlan.after_alarm > 0)


def any_counts_parts(session: Session, machine_id: int) -> bool:
    """Tell if the plan of a characteristic of this machine says which part is to be measured."""
    return bool(session.scalar(select(exists().where(ControlPlan.machine_id == machine_id, counts_parts()))))


def look(session: Session, row: ControlPlan, now: datetime | None = None) -> Look:
    """Look at a plan: what was missed since the last look, and what is due now."""
    now = now or datetime.now(UTC)
    plan, stream = row.plan, session.get_one(Stream, (row.machine_id, row.characteristic_id), populate_existing=True)
    own = signs.own_readings(session, row, stream)
    begin = _begin(row, stream, own, now)
    moments = in_time(((each.sequence, each.moment) for each in own if each.sequence > row.seen), begin)
    moments = [(sequence, moment._replace(shift=signs.shift_of(moment.at))) for sequence, moment in moments]
    characteristic = session.get_one(Characteristic, (row.machine_id, row.characteristic_id))
    others = signs.other_readings(session, row, characteristic, moments[0][1].at)
    runs = signs.runs(session, row, characteristic, moments[0][1].at)
    times = [each.at for each in others]
    measured = frozenset(each.moment.part for each in own if each.moment.part is not None)
    happened = signs.events(session, row, stream, own)

    def in_force(sequence: int) -> Rhythm:
        come = bisect_right(own, sequence, key=lambda each: each.sequence)
        return rhythm(plan, (Event(why, at, max(0, come - before)) for why, at, before in happened))

    late = []
    for (after, last), (until, this) in pairwise(moments):
        between = others[bisect_right(times, last.at) : bisect_right(times, this.at)]
        force = in_force(after)
        passed = ran(plan, last, between, now=this, measured=measured, runs=runs, closed=True, event=force.at)
        verdict = judged(plan, force, passed, in_this_shift=True, closed=True)
        if verdict.due is Due.MISSED:
            late.append(Interval(after, until, passed, verdict))
    sequence, last = moments[-1]
    here = Moment(now.timestamp(), 0, None, signs.shift_of(now.timestamp()))
    force = in_force(max(sequence, row.seen, *(each.sequence for each in own[-1:])))
    rest = others[bisect_right(times, last.at) :]
    since = ran(plan, last, rest, now=here, measured=measured, runs=runs, event=force.at)
    verdict = judged(plan, force, since, in_this_shift=bool(sequence) and last.shift >= here.shift)
    seen = max(row.seen, stream.sequence, *(each.sequence for each in own[-1:]))
    return Look(
        row, sequence, seen, force, since, verdict, late, open_of(session, row), characteristic.part is not None
    )


def _begin(row: ControlPlan, stream: Stream, own: Sequence[signs.Own], now: datetime) -> tuple[int, Moment]:
    """The last reading in time of those that were looked at before, not before the plan: what was cut under another is no matter."""
    before = [each for each in own if each.sequence <= row.seen]
    since = Moment(row.since.timestamp(), row.characteristic_id)
    if not before and own and (len(own) == signs.MOST or stream.sequence > signs.FURTHEST):
        before = [own[0]]
    if before:
        newest = max(before, key=lambda each: each.moment.at)
        return newest.sequence, newest.moment if newest.moment.at >= since.at else since
    if not own and stream.last_measured_at is not None:
        since = since._replace(at=max(since.at, min(stream.last_measured_at, now).timestamp()))
    return row.seen, since


_LACKING = text("""
SELECT field, count(*), max(r.sequence), count(DISTINCT r.sequence)
FROM unnest(CAST(:fields AS text[])) AS field, reading r
LEFT JOIN reading_context c USING (machine_id, characteristic_id, sequence)
WHERE r.machine_id = :machine AND r.characteristic_id = :characteristic AND r.sequence BETWEEN :first AND :last
    AND r.code <> :imported AND r.received_at >= :since AND c.context ->> field IS NULL
GROUP BY GROUPING SETS ((field), ())
""")


def lacking(session: Session, row: ControlPlan, after: int = 0) -> Lacking:
    """The required context that readings after this one lack, of many the last ones; what was imported lacks nothing."""
    newest = session.get_one(Stream, (row.machine_id, row.characteristic_id), populate_existing=True).sequence
    fields = row.plan.required_context
    where = {
        "fields": [field.value for field in fields],
        "machine": row.machine_id,
        "characteristic": row.characteristic_id,
        "first": max(after, newest - MOST_LOOKED_AT) + 1,
        "last": newest,
        "imported": Code.IMPORTED.value,
        "since": row.since,
    }
    found = {field: (count, last or 0, readings) for field, count, last, readings in session.execute(_LACKING, where)}
    _times, last, readings = found[None]
    return Lacking(
        {field.value: found[field.value][0] for field in fields if field.value in found}, readings, last, newest
    )


def required_on(session: Session, machine_id: int) -> dict[str, tuple[ContextField, ...]]:
    """The required context of each characteristic of a machine that has one, by its key."""
    rows = session.execute(
        select(Characteristic.key, ControlPlan)
        .join(
            ControlPlan,
            (Characteristic.machine_id == ControlPlan.machine_id)
            & (Characteristic.id == ControlPlan.characteristic_id),
        )
        .where(ControlPlan.machine_id == machine_id, func.cardinality(ControlPlan.required_context) > 0)
    )
    return {key: row.plan.required_context for key, row in rows}


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
    limit: int | None = None,
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
