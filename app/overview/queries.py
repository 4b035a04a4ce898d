"""All characteristics with what their ranking is made of, in a few statements however many there are. Never writes."""

from collections import Counter
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from math import inf

from sqlalchemy import func, select, text
from sqlalchemy.orm import Session

from app.alarms.tables import Alarm
from app.machines.tables import Machine
from app.overview.ranking import Told, ppk
from app.plant import queries as plant
from app.plant.queries import Row
from app.plant.state import State

LAST = 200  # readings that Ppk is told of
SHIFT = timedelta(hours=8)
LOOKED_BACK = timedelta(days=7)  # over which the alarms of a shift are counted

# Of the last readings, without excluded ones and probe faults, which are no sizes of parts. Readings judged by
# another target or tolerance say nothing about now.
_LAST = """
SELECT s.characteristic_id, count(*), avg(r.deviation), regr_sxx(r.deviation, r.deviation) FROM stream s
CROSS JOIN LATERAL (
    SELECT sequence, deviation, parameters_version, zone FROM reading
    WHERE machine_id = s.machine_id AND characteristic_id = s.characteristic_id
        AND sequence > s.sequence - :last AND sequence <= s.sequence
) r
JOIN parameters_version v ON v.machine_id = s.machine_id AND v.characteristic_id = s.characteristic_id
    AND v.version = r.parameters_version
JOIN parameters_version now ON now.machine_id = s.machine_id AND now.characteristic_id = s.characteristic_id
    AND now.version = s.parameters_version
WHERE (CAST(:machine AS int) IS NULL OR s.machine_id = :machine) AND r.zone <> 'probe_fault'
    AND v.parameters -> 'target' = now.parameters -> 'target'
    AND v.parameters -> 'tolerance_width' = now.parameters -> 'tolerance_width'
    AND NOT EXISTS (SELECT FROM exclusion e WHERE e.machine_id = s.machine_id
        AND e.characteristic_id = s.characteristic_id AND e.sequence = r.sequence)
GROUP BY s.characteristic_id
"""


class By(StrEnum):
    """What the characteristics are ranked by."""

    ATTENTION = "attention"
    PPK = "ppk"
    WEAR = "wear"
    SIGNALS = "signals"
    ALARMS = "alarms"


@dataclass(frozen=True)
class Ranked:
    """A characteristic with what it is ranked by. signals: numbers of its open signals, the newest first."""

    machine: Machine
    row: Row
    told: Told
    signals: list[int]
    readings: int  # that Ppk is told of


def ranking(
    session: Session, *, machine: str | None = None, by: By = By.ATTENTION, now: datetime | None = None
) -> list[Ranked]:
    """Every characteristic of the plant, or of one machine, what needs somebody first at the head. Raises `NotFound`."""
    now = now or datetime.now(UTC)
    groups = plant.plant(session, machine=machine)
    only = groups[0].machine.id if machine is not None else None
    numbers = _numbers(session, only)
    raised = _raised(session, only, now)
    open_signals: dict[int, list[int]] = {}
    found: list[Ranked] = []
    for group in groups:
        for row in group.rows:
            number = row.characteristic.id
            count, mean, squares = numbers.get(number, (0, 0.0, 0.0))
            outlook = row.outlook
            since = max(row.characteristic.created_at, now - LOOKED_BACK)
            told = Told(
                state=row.state,
                alarms=len(row.alarms),
                signals=len(open_signals.get(number, ())),
                ppk=ppk(mean, squares, count, row.parameters.tolerance_width / 2),
                parts_left=outlook.parts if outlook is not None and outlook.towards is not None else None,
                hunting=row.overcorrects,
                per_shift=raised[number] / max(1.0, (now - since) / SHIFT),
                old=row.state is not State.NO_DATA and row.is_old(now),
            )
            found.append(Ranked(group.machine, row, told, list(open_signals.get(number, ())), count))
    return sorted(found, key=lambda each: _order(each, by))


def _order(ranked: Ranked, by: By) -> tuple[float, ...]:
    told = ranked.told
    first = {
        By.ATTENTION: 0.0,
        By.PPK: inf if told.ppk is None else told.ppk,
        By.WEAR: inf if told.parts_left is None else told.parts_left,
        By.SIGNALS: -float(told.signals),
        By.ALARMS: -told.per_shift,
    }[by]
    return (first, *told.rank)


def _numbers(session: Session, machine_id: int | None) -> dict[int, tuple[int, float, float]]:
    """How many of the last readings count, their mean deviation and the squares about it, by characteristic; mm."""
    rows = session.execute(text(_LAST), {"last": LAST, "machine": machine_id})
    return {number: (count, mean, squares) for number, count, mean, squares in rows}


def _raised(session: Session, machine_id: int | None, now: datetime) -> Counter[int]:
    """How many alarms were raised lately, by characteristic."""
    query = (
        select(Alarm.characteristic_id, func.count().label("raised"))
        .where(Alarm.characteristic_id.is_not(None), Alarm.raised_at > now - LOOKED_BACK)
        .group_by(Alarm.characteristic_id)
    )
    if machine_id is not None:
        query = query.where(Alarm.machine_id == machine_id)
    return Counter({row.characteristic_id: row.raised for row in session.execute(query) if row.characteristic_id})
