"""All characteristics with the inputs of their ranking, in a few statements for any number. Never writes."""

from collections import Counter
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from statistics import fmean
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.core.state import CharacteristicState
from app.jobs import queries as jobs
from app.loop.tables.alarms import Alarm
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Reading, Stream
from app.quality.capability import verdict_queries as verdicts
from app.quality.capability.verdict_queries import Verdict
from app.quality.chart_signals import queries as signals
from app.views.characteristic import state_queries as plant
from app.views.characteristic.state_queries import CharacteristicRow
from app.views.overview.ranking import AttentionInputs

SHIFT = timedelta(hours=8)
ALARMS_OVER = timedelta(days=7)  # the alarms per shift are counted over these days


class By(StrEnum):
    """Order of the characteristics."""

    ATTENTION = "attention"
    PPK = "ppk"
    WEAR = "wear"
    SIGNALS = "signals"
    ALARMS = "alarms"
    NAME = "name"
    LAST = "last"
    TREND = "trend"

    @property
    def largest_first(self) -> bool:
        """True if what is worst by it is what is largest, which comes first."""
        return self in {By.SIGNALS, By.ALARMS}


@dataclass(frozen=True)
class Ranked:
    """A characteristic with the inputs of its rank. signals: numbers of its open signals, the newest first."""

    machine: Machine
    row: CharacteristicRow
    inputs: AttentionInputs
    signals: list[int]
    verdict: Verdict  # the index, and of which readings it is


def ranking(
    session: Session,
    *,
    machine: str | None = None,
    by: By = By.ATTENTION,
    reverse: bool = False,
    now: datetime | None = None,
) -> list[Ranked]:
    """Every characteristic of the plant, or of one machine, the worst first, or last. Raises `NotFound`."""
    now = now or datetime.now(UTC)
    groups = plant.plant(session, machine=machine)
    only = groups[0].machine.id if machine is not None else None
    indices = verdicts.verdicts_by_characteristic(session, only)
    raised, first = _raised(session, only, now), _first_measured(session, only)
    open_signals = signals.open_signals_by_characteristic(session, only)
    failing = jobs.failures_by_characteristic(session, only)
    entries: list[Ranked] = []
    for group in groups:
        for row in group.rows:
            number = row.characteristic.id
            index = indices[number]
            outlook = row.outlook
            since = max(first.get(number, now), now - ALARMS_OVER)
            inputs = AttentionInputs(
                state=row.state,
                alarms=len(row.alarms),
                signals=len(open_signals.get(number, ())),
                ppk=index.of.value,
                parts_left=outlook.parts if outlook is not None and outlook.towards is not None else None,
                hunting=row.overcorrects,
                per_shift=raised[number] / max(1.0, (now - since) / SHIFT),
                old=row.state is not CharacteristicState.NO_DATA and row.is_old(now),
                failing=number in failing,
            )
            entries.append(Ranked(group.machine, row, inputs, list(open_signals.get(number, ())), index))
    return in_order(entries, by, reverse=reverse)


def in_order(entries: list[Ranked], by: By, *, reverse: bool = False) -> list[Ranked]:
    """Sorted, the worst first, or last; those alike by their need for attention. What has no value stands at the end either way."""
    urgent = sorted(entries, key=lambda entry: entry.inputs.rank)
    if by is By.ATTENTION:
        return urgent[::-1] if reverse else urgent
    known = [entry for entry in urgent if _value(entry, by) is not None]
    known.sort(key=lambda entry: _value(entry, by), reverse=reverse != by.largest_first)
    return known + [entry for entry in urgent if _value(entry, by) is None]


def _value(ranked: Ranked, by: By) -> Any:
    inputs, row = ranked.inputs, ranked.row
    return {
        By.PPK: inputs.ppk,
        By.WEAR: inputs.parts_left,
        By.SIGNALS: inputs.signals,
        By.ALARMS: inputs.per_shift,
        By.NAME: row.characteristic.name.casefold(),
        By.LAST: row.stream.last_measured_at,
        By.TREND: _change(ranked.verdict),
    }[by]


def _change(verdict: Verdict) -> float | None:
    """Change of the index from the earlier half of its weeks to the later one; None before there are two."""
    values = [week.value for week in verdict.weeks if week.value is not None]
    half = len(values) // 2
    return fmean(values[half:]) - fmean(values[:half]) if half else None


def _raised(session: Session, machine_id: int | None, now: datetime) -> Counter[int]:
    """Number of recent alarms by characteristic, by the time of measurement, for readings may come late."""
    query = (
        select(Alarm.characteristic_id, func.count().label("raised"))
        .outerjoin(
            Reading,
            (Reading.machine_id == Alarm.machine_id)
            & (Reading.characteristic_id == Alarm.characteristic_id)
            & (Reading.sequence == Alarm.sequence),
        )
        .where(Alarm.characteristic_id.is_not(None), Alarm.raised_at > now - ALARMS_OVER)
        .where(func.coalesce(Reading.measured_at, Alarm.raised_at) > now - ALARMS_OVER)
        .group_by(Alarm.characteristic_id)
    )
    if machine_id is not None:
        query = query.where(Alarm.machine_id == machine_id)
    return Counter({row.characteristic_id: row.raised for row in session.execute(query) if row.characteristic_id})


def _first_measured(session: Session, machine_id: int | None) -> dict[int, datetime]:
    """Time of measurement of the first reading of each characteristic."""
    query = select(Reading.characteristic_id, Reading.measured_at).join(
        Stream,
        (Stream.machine_id == Reading.machine_id)
        & (Stream.characteristic_id == Reading.characteristic_id)
        & (Reading.sequence == 1),
    )
    if machine_id is not None:
        query = query.where(Stream.machine_id == machine_id)
    return {row.characteristic_id: row.measured_at for row in session.execute(query)}
