"""Parts by the name that machines give them with their readings: any text of one line. Never writes."""

from collections.abc import Iterable
from datetime import datetime
from typing import Annotated, Any, NamedTuple
from urllib.parse import urlencode

from pydantic import AfterValidator, StringConstraints
from pydantic_core import PydanticCustomError
from sqlalchemy import select, tuple_
from sqlalchemy.orm import Session

from app.core.decision.limits import ZONES
from app.core.parameters import Parameters
from app.loop.readings.records import Record
from app.loop.readings.schemas import clean_text
from app.loop.tables.characteristics import Characteristic, ParametersVersion
from app.loop.tables.machines import Machine
from app.loop.tables.tools import Correction
from app.views.search import readings


def _clean(part: str) -> str:
    if not clean_text(part):
        raise PydanticCustomError("control_character", "control character", {"code": "U+0000"})
    return part


Part = Annotated[str, StringConstraints(min_length=1, max_length=128), AfterValidator(_clean)]
"""Name of a part as machines send it, blanks and all."""


def part_path(part: str) -> str:
    """The page of a part. The name is in the query, where `/` and `..` are letters like others."""
    return f"/parts?{urlencode({'part': part})}"


class PartReading(NamedTuple):
    """One reading of a part. answer: as it was answered; limits: of then; correction: what became of the one it led to."""

    record: Record
    characteristic: str
    machine: str
    machine_name: str
    answer: dict[str, Any]
    limits: Parameters
    correction: Correction | None


class LastPart(NamedTuple):
    """A part measured lately. at: of its newest reading; zone: its worst; machines, names: where and what was measured, the newest first."""

    part: str
    at: datetime
    machines: list[str]
    names: list[str]
    zone: str


LOOKED_THROUGH, MOST_LAST = 200, 12
"""Newest readings, and the parts of them that are listed."""


def last_measured(session: Session) -> list[LastPart]:
    """The parts measured last, the newest first: of the newest readings, those that name one."""
    of_parts: dict[str, list[Record]] = {}
    for record in readings.found(session, readings.Filters(), "newest", None, LOOKED_THROUGH):
        if record.part is not None:
            of_parts.setdefault(record.part, []).append(record)
    shown = list(of_parts.items())[:MOST_LAST]
    names = _names(session, [record for _part, records in shown for record in records])
    found = []
    for part, records in shown:
        places = [names[record.machine_id, record.characteristic_id] for record in records]
        worst = max((record.zone for record in records), key=ZONES.index)
        machines, measured_on = (list(dict.fromkeys(place[at] for place in places)) for at in (2, 0))
        found.append(LastPart(part, records[0].measured_at, machines, measured_on, worst))
    return found


def _names(session: Session, records: Iterable[Record]) -> dict[tuple[int, int], tuple[str, str, str]]:
    """Name of the characteristic, key and name of the machine, by the numbers of machine and characteristic."""
    of = (Characteristic.machine_id, Characteristic.id)
    places = {(record.machine_id, record.characteristic_id) for record in records}
    query = (
        select(*of, Characteristic.name, Machine.key, Machine.name.label("machine"))
        .join(Machine, Machine.id == Characteristic.machine_id)
        .where(tuple_(*of).in_(places))
    )
    return {(row.machine_id, row.id): (row.name, row.key, row.machine) for row in session.execute(query)}


def measured(session: Session, part: str, after: str | None, limit: int) -> list[PartReading]:
    """Everything measured on the part, newest first, from the cursor on."""
    records = readings.found(session, readings.Filters(part=part), "newest", after, limit)
    if not records:
        return []
    names = _names(session, records)
    of_version = (ParametersVersion.machine_id, ParametersVersion.characteristic_id, ParametersVersion.version)
    versions = {(record.machine_id, record.characteristic_id, record.parameters_version) for record in records}
    limits = {
        (row.machine_id, row.characteristic_id, row.version): Parameters.from_dict(row.parameters)
        for row in session.scalars(select(ParametersVersion).where(tuple_(*of_version).in_(versions)))
    }
    asked = [(record.machine_id, record.correction) for record in records if record.correction is not None]
    corrections = {
        (row.machine_id, row.number): row
        for row in session.scalars(
            select(Correction).where(tuple_(Correction.machine_id, Correction.number).in_(asked))
        )
    }
    return [
        PartReading(
            record,
            *names[record.machine_id, record.characteristic_id],
            answer,
            limits[record.machine_id, record.characteristic_id, record.parameters_version],
            None if record.correction is None else corrections.get((record.machine_id, record.correction)),
        )
        for record, answer in zip(records, readings.answers(session, records), strict=True)
    ]
