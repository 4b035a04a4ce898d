"""The plant as it is, in a few statements however many characteristics there are. Never writes."""

from collections import defaultdict
from dataclasses import dataclass
from datetime import datetime
from typing import Any, NamedTuple

from sqlalchemy import select, text
from sqlalchemy.orm import Session

from app.core.parameters import Parameters
from app.core.state import CALM, NEED_SOMEONE, CharacteristicState, Known, state_of
from app.loop.machines.queries import machine_named
from app.loop.readings import queries as readings
from app.loop.readings.records import Entry, Record
from app.loop.summaries import queries as statistics
from app.loop.summaries.queries import Rejects
from app.loop.tables.alarms import Alarm
from app.loop.tables.characteristics import Characteristic, ParametersVersion
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Exclusion, Reading, Stream
from app.loop.tables.tools import OPEN, AverageMemory, Correction, Tool
from app.quality.wear.queries import OVERCORRECTS
from app.quality.wear.tables import Outlook

TREND = 50  # readings of the small picture
NO_REJECTS = Rejects(0, 0)

_TREND = """
SELECT s.characteristic_id, array_agg(r.deviation ORDER BY r.sequence), min(r.received_at)
FROM stream s
CROSS JOIN LATERAL (
    SELECT sequence, deviation, received_at FROM reading
    WHERE machine_id = s.machine_id AND characteristic_id = s.characteristic_id
        AND sequence > s.sequence - :trend AND sequence <= s.sequence
) r
WHERE CAST(:machine AS int) IS NULL OR s.machine_id = :machine
GROUP BY s.characteristic_id
"""


@dataclass(frozen=True)
class CharacteristicRow:
    """One characteristic at a glance; lengths in mm. `average` is M, None without a memory location."""

    characteristic: Characteristic
    parameters: Parameters
    stream: Stream
    average: float | None
    offset: float | None
    alarms: list[tuple[int, str]]
    corrections: list[tuple[int, str, float]]
    known: Known
    state: CharacteristicState
    rejects: Rejects | None = None  # since the tool was changed; None without acceptance n of m
    outlook: Outlook | None = None  # of the periodic job
    tool_paused_by: int | None = None  # the alarm that asks which offset of the tool is true

    @property
    def trend(self) -> list[float]:
        return list(self.known.trend)

    @property
    def old_from(self) -> datetime | None:
        return self.known.old_from

    @property
    def overcorrects(self) -> bool:
        """Tell if its loop over-corrects, whether or not a person has noted that."""
        return self.outlook is not None and self.outlook.hunting in OVERCORRECTS

    @property
    def is_calm(self) -> bool:
        """Tell if the state is only worth something while it is new."""
        return self.state in CALM

    @property
    def needs_someone(self) -> bool:
        return self.state in NEED_SOMEONE or bool(self.alarms)

    def is_old(self, now: datetime) -> bool:
        return self.old_from is not None and self.old_from <= now


class Group(NamedTuple):
    """A machine with its characteristics; `alarms` are those of its tools."""

    machine: Machine
    rows: list[CharacteristicRow]
    alarms: list[tuple[int, str]]


def plant(session: Session, *, machine: str | None = None, trends: bool = True) -> list[Group]:
    """Every machine, or the one with this key, with what is known of its characteristics. Raises `NotFound`."""
    if machine is None:
        machines = session.scalars(select(Machine).order_by(Machine.key)).all()
    else:
        machines = [machine_named(session, machine)]
    only = None if machine is None else machines[0].id
    alarms, tool_alarms = _alarms(session, only)
    corrections = _corrections(session, only)
    courses = _trends(session, only) if trends else {}
    rejects = statistics.rejects_by_characteristic(session, only)
    rows: dict[int, list[CharacteristicRow]] = defaultdict(list)
    for characteristic, stored, stream, average, offset, tool_paused_by, outlook, excluded in session.execute(
        _standing(only)
    ):
        number = characteristic.id
        parameters = Parameters.from_dict(stored)
        trend, since = courses.get(number, ([], None))
        known = Known(
            parameters=parameters,
            readings=stream.sequence,
            zone=stream.last_zone,
            deviation=stream.last_deviation,
            paused=stream.paused_by is not None,
            alarms={kind for _id, kind in alarms[number]},
            corrections={status for _number, status, _amount in corrections[number]},
            trend=trend,
            since=since,
            last_at=stream.last_received_at,
            tool_paused=tool_paused_by is not None,
            excluded=excluded is not None,
        )
        rows[characteristic.machine_id].append(
            CharacteristicRow(
                characteristic=characteristic,
                parameters=parameters,
                stream=stream,
                average=average,
                offset=offset,
                alarms=alarms[number],
                corrections=corrections[number],
                known=known,
                state=state_of(known),
                rejects=rejects.get(number, NO_REJECTS) if parameters.accept_m > 1 else None,
                outlook=outlook,
                tool_paused_by=tool_paused_by,
            )
        )
    return [Group(one, rows[one.id], tool_alarms[one.id]) for one in machines]


def row_of(session: Session, machine: str, characteristic: str) -> CharacteristicRow:
    """One characteristic at a glance. Raises `NotFound` for an unknown machine."""
    (group,) = plant(session, machine=machine)
    return next(row for row in group.rows if row.characteristic.key == characteristic)


def _standing(machine_id: int | None) -> Any:
    query = (
        select(
            Characteristic,
            ParametersVersion.parameters,
            Stream,
            AverageMemory.average,
            Tool.offset,
            Tool.paused_by,
            Outlook,
            Exclusion.sequence,
        )
        .join(
            Stream,
            (Stream.machine_id == Characteristic.machine_id) & (Stream.characteristic_id == Characteristic.id),
        )
        .join(
            ParametersVersion,
            (ParametersVersion.machine_id == Stream.machine_id)
            & (ParametersVersion.characteristic_id == Stream.characteristic_id)
            & (ParametersVersion.version == Stream.parameters_version),
        )
        .outerjoin(
            AverageMemory,
            (AverageMemory.machine_id == Stream.machine_id) & (AverageMemory.location == Stream.average_memory),
        )
        .outerjoin(Tool, (Tool.machine_id == Stream.machine_id) & (Tool.number == Stream.tool_memory))
        .outerjoin(
            Outlook,
            (Outlook.machine_id == Stream.machine_id) & (Outlook.characteristic_id == Stream.characteristic_id),
        )
        .outerjoin(
            Exclusion,
            (Exclusion.machine_id == Stream.machine_id)
            & (Exclusion.characteristic_id == Stream.characteristic_id)
            & (Exclusion.sequence == Stream.sequence),
        )
        .order_by(Characteristic.key)
    )
    return query if machine_id is None else query.where(Characteristic.machine_id == machine_id)


def _alarms(
    session: Session, machine_id: int | None
) -> tuple[dict[int, list[tuple[int, str]]], dict[int, list[tuple[int, str]]]]:
    """The active alarms (number, kind) by characteristic, and those of tools by machine."""
    query = select(Alarm.machine_id, Alarm.characteristic_id, Alarm.id, Alarm.kind).where(
        Alarm.acknowledged_at.is_(None)
    )
    if machine_id is not None:
        query = query.where(Alarm.machine_id == machine_id)
    of_characteristics: dict[int, list[tuple[int, str]]] = defaultdict(list)
    of_tools: dict[int, list[tuple[int, str]]] = defaultdict(list)
    for machine, characteristic, number, kind in session.execute(query.order_by(Alarm.id)):
        if characteristic is None:
            of_tools[machine].append((number, kind))
        else:
            of_characteristics[characteristic].append((number, kind))
    return of_characteristics, of_tools


def _corrections(session: Session, machine_id: int | None) -> dict[int, list[tuple[int, str, float]]]:
    """The open corrections (number, status, amount) by characteristic."""
    query = select(Correction.characteristic_id, Correction.number, Correction.status, Correction.amount).where(
        Correction.status.in_(OPEN)
    )
    if machine_id is not None:
        query = query.where(Correction.machine_id == machine_id)
    by_characteristic: dict[int, list[tuple[int, str, float]]] = defaultdict(list)
    for characteristic, number, status, amount in session.execute(query.order_by(Correction.number)):
        by_characteristic[characteristic].append((number, status, amount))
    return by_characteristic


def _trends(session: Session, machine_id: int | None) -> dict[int, tuple[list[float], datetime]]:
    """The last deviations by characteristic, oldest first, and when the first of them arrived."""
    rows = session.execute(text(_TREND), {"trend": TREND, "machine": machine_id})
    return {characteristic: (deviations, since) for characteristic, deviations, since in rows}


def last_of(session: Session, entry: Entry, stream: Stream) -> list[Record]:
    """Return the last reading that was decided, if there is one.

    The highest number may be that of an older reading, which a person has imported since.
    """
    found = readings.latest(session, entry, None, 1)
    if found and (found[0].received_at, found[0].measured) != (stream.last_received_at, stream.last_measured):
        decided = Reading.received_at == stream.last_received_at, Reading.measured == stream.last_measured
        found = readings.latest(session, entry, None, 1, *decided) or found
    return found
