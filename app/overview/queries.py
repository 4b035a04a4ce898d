"""All characteristics with what their ranking is made of, in a few statements however many there are. Never writes."""

from collections import Counter
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from math import inf

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.alarms.tables import Alarm
from app.capability import queries as capability
from app.control import signals_queries as signals
from app.core.state import State
from app.machines.tables import Machine
from app.overview.ranking import Told
from app.plant import queries as plant
from app.plant.queries import Row
from app.readings.tables import Reading, Stream

SHIFT = timedelta(hours=8)
LOOKED_BACK = timedelta(days=7)  # over which the alarms of a shift are counted


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
    capable = capability.capability_by_characteristic(session, only)
    raised, first = _raised(session, only, now), _first_measured(session, only)
    open_signals = signals.open_signals_by_characteristic(session, only)
    found: list[Ranked] = []
    for group in groups:
        for row in group.rows:
            number = row.characteristic.id
            index = capable[number]
            outlook = row.outlook
            since = max(first.get(number, now), now - LOOKED_BACK)
            told = Told(
                state=row.state,
                alarms=len(row.alarms),
                signals=len(open_signals.get(number, ())),
                ppk=index.ppk.value if index.ppk else None,
                parts_left=outlook.parts if outlook is not None and outlook.towards is not None else None,
                hunting=row.overcorrects,
                per_shift=raised[number] / max(1.0, (now - since) / SHIFT),
                old=row.state is not State.NO_DATA and row.is_old(now),
            )
            found.append(Ranked(group.machine, row, told, list(open_signals.get(number, ())), index.readings))
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


def _raised(session: Session, machine_id: int | None, now: datetime) -> Counter[int]:
    """How many alarms parts gave lately, by characteristic: by when they were measured, for readings may come late."""
    query = (
        select(Alarm.characteristic_id, func.count().label("raised"))
        .outerjoin(
            Reading,
            (Reading.machine_id == Alarm.machine_id)
            & (Reading.characteristic_id == Alarm.characteristic_id)
            & (Reading.sequence == Alarm.sequence),
        )
        .where(Alarm.characteristic_id.is_not(None), Alarm.raised_at > now - LOOKED_BACK)
        .where(func.coalesce(Reading.measured_at, Alarm.raised_at) > now - LOOKED_BACK)
        .group_by(Alarm.characteristic_id)
    )
    if machine_id is not None:
        query = query.where(Alarm.machine_id == machine_id)
    return Counter({row.characteristic_id: row.raised for row in session.execute(query) if row.characteristic_id})


def _first_measured(session: Session, machine_id: int | None) -> dict[int, datetime]:
    """When the first reading of each characteristic was measured."""
    query = select(Reading.characteristic_id, Reading.measured_at).join(
        Stream,
        (Stream.machine_id == Reading.machine_id)
        & (Stream.characteristic_id == Reading.characteristic_id)
        & (Reading.sequence == 1),
    )
    if machine_id is not None:
        query = query.where(Stream.machine_id == machine_id)
    return {row.characteristic_id: row.measured_at for row in session.execute(query)}
