"""One shift of the plant or of a machine, in a few statements however many readings there are. Never writes.

The readings of the shift are found by the block ranges of their times (`reading_received_idx`), its alarms by
`alarm_raised_idx`, its corrections by the readings that led to them.
"""

from dataclasses import dataclass, fields
from datetime import datetime, timedelta
from typing import Any, NamedTuple, Self

from sqlalchemy import select, text
from sqlalchemy.orm import Session

from app.core.decision.limits import Zone, nanometres, within_sql
from app.core.natural_limit import half_width
from app.core.period import Period
from app.core.spc.capability import CAPABLE
from app.errors import Invalid
from app.language.i18n import _
from app.language.times import begin_of_shift, end_of_shift
from app.loop.alarm_response import queries as responses
from app.loop.alarm_response.queries import ITS_CHARACTERISTIC, AlarmRow
from app.loop.alarms import ended_queries as endings
from app.loop.machines.queries import machine_named, machines
from app.loop.tables.alarms import Alarm
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.machines import Machine
from app.quality.wear.queries import NEAR
from app.views.overview.queries import Ranked, ranking

MOST_ALARMS = 1000
MOST_NEXT = 50
MOST_MACHINES = 100_000
EARLIEST_YEAR = 1900

# A part counts once, by the last reading of each of its characteristics: one that was cut again and measured good is good.
# A reading is judged by its raw deviation and the tolerance of the version that was in force, as everywhere.
READINGS = f"""
WITH judged AS MATERIALIZED (
    SELECT r.machine_id, r.characteristic_id, r.sequence, r.part, r.measured_at, r.correction,
        e.sequence IS NOT NULL AS excluded, r.zone = '{Zone.PROBE_FAULT.value}' AS fault,
        NOT {within_sql("r.deviation", "v.tolerance")} AS outside
    FROM reading r
    JOIN unnest(CAST(:characteristics AS int[]), CAST(:versions AS int[]), CAST(:tolerances AS bigint[]))
        AS v(characteristic, version, tolerance) ON v.characteristic = r.characteristic_id AND v.version = r.parameters_version
    LEFT JOIN exclusion e ON e.machine_id = r.machine_id AND e.characteristic_id = r.characteristic_id AND e.sequence = r.sequence
    WHERE r.measured_at >= :start AND r.measured_at < :end AND (CAST(:machine AS int) IS NULL OR r.machine_id = :machine)
), last AS (
    SELECT DISTINCT ON (machine_id, characteristic_id, part) machine_id, part, outside FROM judged
    WHERE part IS NOT NULL AND NOT excluded AND NOT fault
    ORDER BY machine_id, characteristic_id, part, measured_at DESC, sequence DESC
), named AS (
    SELECT machine_id, count(DISTINCT part) AS parts, count(DISTINCT part) FILTER (WHERE outside) AS outside
    FROM last GROUP BY machine_id
), counted AS (
    SELECT j.machine_id, count(*) AS readings, count(*) FILTER (WHERE excluded) AS excluded,
        count(*) FILTER (WHERE fault AND NOT excluded) AS faults,
        count(*) FILTER (WHERE part IS NULL AND NOT excluded AND NOT fault) AS unnamed,
        count(*) FILTER (WHERE part IS NULL AND NOT excluded AND NOT fault AND j.outside) AS unnamed_outside,
        count(c.number) AS corrections, count(*) FILTER (WHERE c.status = 'applied') AS applied,
        count(*) FILTER (WHERE c.status IN ('held', 'awaiting_approval')) AS held,
        count(*) FILTER (WHERE c.status IN ('pending', 'superseded')) AS not_taken,
        count(*) FILTER (WHERE c.status = 'rejected') AS rejected, max(abs(c.amount)) AS largest
    FROM judged j LEFT JOIN correction c ON c.machine_id = j.machine_id AND c.number = j.correction
    GROUP BY j.machine_id
)
SELECT c.machine_id, readings, excluded, faults, unnamed, coalesce(n.parts, 0) + unnamed AS parts,
    coalesce(n.outside, 0) + unnamed_outside AS outside, corrections, applied, held, not_taken, rejected, largest
FROM counted c LEFT JOIN named n ON n.machine_id = c.machine_id
"""  # noqa: S608 - made of the names of our zones

_VERSIONS = """
SELECT v.characteristic_id, v.version, CAST(v.parameters ->> 'tolerance_width' AS float8), v.parameters ->> 'natural_limit'
FROM parameters_version v
JOIN stream s ON s.machine_id = v.machine_id AND s.characteristic_id = v.characteristic_id
WHERE s.sequence > 0 AND (CAST(:machine AS int) IS NULL OR v.machine_id = :machine)
"""

_ALARMS = """
WITH raised AS (
    SELECT machine_id, acknowledged_at - raised_at AS after, acknowledged_at IS NULL AS active,
        coalesce(outcome -> 0 ->> 'code' = ANY(CAST(:endings AS text[])), false) AS by_itself
    FROM alarm
    WHERE raised_at >= :start AND raised_at < :end AND (CAST(:machine AS int) IS NULL OR machine_id = :machine)
)
SELECT machine_id, count(*) AS alarms,
    count(*) FILTER (WHERE NOT active AND NOT by_itself) AS acknowledged,
    count(*) FILTER (WHERE by_itself) AS by_itself,
    count(*) FILTER (WHERE active) AS active,
    percentile_cont(0.5) WITHIN GROUP (ORDER BY after) FILTER (WHERE NOT by_itself) AS median,
    max(after) FILTER (WHERE NOT by_itself) AS longest
FROM raised
GROUP BY GROUPING SETS ((machine_id), ())
"""

_CHANGES = """
SELECT machine_id, count(*) AS changes FROM tool_event
WHERE kind <> 'correction' AND kind = 'change' AND at >= :start AND at < :end
    AND (CAST(:machine AS int) IS NULL OR machine_id = :machine)
GROUP BY machine_id
"""


@dataclass(frozen=True, slots=True)
class Made:
    """Measured parts and corrections of a shift; largest: size of the largest correction, mm, None without any.

    parts: by their names, once each, and each reading that names none; probe faults and excluded readings measure no part.
    outside: those of them out of tolerance. held: corrections that wait for a person. not_taken: issued and not taken by the machine.
    """

    readings: int = 0
    excluded: int = 0
    faults: int = 0
    unnamed: int = 0
    parts: int = 0
    outside: int = 0
    corrections: int = 0
    applied: int = 0
    held: int = 0
    not_taken: int = 0
    rejected: int = 0
    largest: float | None = None

    @property
    def inside(self) -> int:
        """Parts in tolerance."""
        return self.parts - self.outside

    def __add__(self, other: Self) -> Self:
        sums = {
            field.name: getattr(self, field.name) + getattr(other, field.name)
            for field in fields(self)
            if field.name != "largest"
        }
        largest = max((each.largest for each in (self, other) if each.largest is not None), default=None)
        return type(self)(**sums, largest=largest)


@dataclass(frozen=True, slots=True)
class Answered:
    """The alarms raised in a shift, and how fast people acknowledged them; the times are None where nobody did.

    by_itself: ended without a person, because what they were about was over.
    """

    alarms: int = 0
    acknowledged: int = 0
    by_itself: int = 0
    active: int = 0
    median: timedelta | None = None
    longest: timedelta | None = None


class OfMachine(NamedTuple):
    """One machine in a shift."""

    machine: Machine
    made: Made
    answered: Answered
    tool_changes: int


class Raised(NamedTuple):
    """An alarm that was raised in a shift."""

    alarm: Alarm
    machine: Machine
    characteristic: Characteristic | None

    @property
    def ended_after(self) -> timedelta | None:
        """Time until it was acknowledged, or ended by itself; None while it is active."""
        at = self.alarm.acknowledged_at
        return None if at is None else max(at - self.alarm.raised_at, timedelta(0))

    @property
    def by_itself(self) -> bool:
        """Tell if it ended without a person."""
        return endings.by_itself(self.alarm)


class Next(NamedTuple):
    """To be looked at after the shift: active alarms, edges near their end, characteristics below the target index."""

    active: int
    alarms: list[AlarmRow]
    wearing: list[Ranked]
    below: list[Ranked]

    @property
    def nothing(self) -> bool:
        return not (self.active or self.wearing or self.below)


class Shift(NamedTuple):
    """A shift of the plant, or of one machine. alarms: the newest first, at most `MOST_ALARMS`."""

    period: Period
    now: datetime
    machine: Machine | None
    machines: list[OfMachine]
    made: Made
    answered: Answered
    tool_changes: int
    alarms: list[Raised]
    next: Next

    @property
    def running(self) -> bool:
        """Tell if it has not ended yet."""
        assert self.period.end is not None
        return self.now < self.period.end

    @property
    def empty(self) -> bool:
        return not (self.made.readings or self.answered.alarms or self.tool_changes)


def period_at(at: datetime, now: datetime) -> Period:
    """The shift in which a moment lies. Raises `Invalid` for one in the future, or before 1900."""
    if at > now or at.year < EARLIEST_YEAR:
        raise Invalid.at("at", _("must lie in a shift that has begun, and not before 1900"))
    return Period(begin_of_shift(at), end_of_shift(at))


def shift(session: Session, at: datetime, now: datetime, machine: str | None = None) -> Shift:
    """The shift in which a moment lies, of all machines or of the one with this key. Raises `NotFound`, `Invalid`."""
    chosen = machine_named(session, machine) if machine is not None else None
    period = period_at(at, now)
    where = {"start": period.start, "end": period.end, "machine": chosen.id if chosen else None}
    made, answered = made_in(session, period, chosen.id if chosen else None), _answered(session, where)
    changes: dict[int, int] = {row.machine_id: row.changes for row in session.execute(text(_CHANGES), where)}
    of_machines = [
        OfMachine(each, made.get(each.id, Made()), answered.get(each.id, Answered()), changes.get(each.id, 0))
        for each in ([chosen] if chosen else machines(session, limit=MOST_MACHINES))
    ]
    return Shift(
        period,
        now,
        chosen,
        of_machines,
        sum(made.values(), Made()),
        answered[None],
        sum(changes.values()),
        _alarms(session, period, chosen),
        _next(session, chosen, now),
    )


def where_of(session: Session, period: Period, machine_id: int | None) -> dict[str, Any]:
    """The parameters of `READINGS`: the period, the machine, and the tolerance of every version of the parameters."""
    where: dict[str, Any] = {"start": period.start, "end": period.end, "machine": machine_id}
    versions = session.execute(text(_VERSIONS), where).all()
    return where | {
        "characteristics": [row[0] for row in versions],
        "versions": [row[1] for row in versions],
        "tolerances": [nanometres(half_width(width, natural)) for _number, _version, width, natural in versions],
    }


def made_in(session: Session, period: Period, machine_id: int | None = None) -> dict[int, Made]:
    """Measured parts and corrections of a bounded period by the id of the machine, of all machines or of one."""
    rows = session.execute(text(READINGS), where_of(session, period, machine_id)).mappings()
    return {row["machine_id"]: Made(**{field.name: row[field.name] for field in fields(Made)}) for row in rows}


def _answered(session: Session, where: dict[str, Any]) -> dict[int | None, Answered]:
    rows = session.execute(text(_ALARMS), where | {"endings": endings.codes()}).mappings()
    return {row["machine_id"]: Answered(**{field.name: row[field.name] for field in fields(Answered)}) for row in rows}


def _alarms(session: Session, period: Period, machine: Machine | None) -> list[Raised]:
    query = (
        select(Alarm, Machine, Characteristic)
        .join(Machine, Machine.id == Alarm.machine_id)
        .outerjoin(Characteristic, ITS_CHARACTERISTIC)
        .where(Alarm.raised_at >= period.start, Alarm.raised_at < period.end)
        .order_by(Alarm.raised_at.desc(), Alarm.id.desc())
        .limit(MOST_ALARMS)
    )
    if machine is not None:
        query = query.where(Alarm.machine_id == machine.id)
    return [Raised(*row) for row in session.execute(query)]


def _next(session: Session, machine: Machine | None, now: datetime) -> Next:
    only = machine.id if machine else None
    ranked = ranking(session, machine=machine.key if machine else None, now=now)
    wearing = [each for each in ranked if each.inputs.parts_left is not None and each.inputs.parts_left <= NEAR]
    below = [each for each in ranked if each.inputs.ppk is not None and each.inputs.ppk < CAPABLE]
    return Next(
        responses.active_count(session, only),
        responses.alarms(session, state="active", machine_id=only, limit=MOST_NEXT, by_urgency=True),
        sorted(wearing, key=lambda each: each.inputs.parts_left or 0.0)[:MOST_NEXT],
        sorted(below, key=lambda each: each.inputs.ppk or 0.0)[:MOST_NEXT],
    )
