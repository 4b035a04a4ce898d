"""Parts by the name that machines give them with their readings: any text of one line. Never writes."""

from typing import Annotated, Any, NamedTuple
from urllib.parse import urlencode

from pydantic import AfterValidator, StringConstraints
from pydantic_core import PydanticCustomError
from sqlalchemy import select, tuple_
from sqlalchemy.orm import Session

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


def measured(session: Session, part: str, after: str | None, limit: int) -> list[PartReading]:
    """Everything measured on the part, newest first, from the cursor on."""
    records = readings.found(session, readings.Filters(part=part), "newest", after, limit)
    if not records:
        return []
    of = (Characteristic.machine_id, Characteristic.id)
    places = {(record.machine_id, record.characteristic_id) for record in records}
    names = {
        (row.machine_id, row.id): (row.name, row.key, row.machine)
        for row in session.execute(
            select(*of, Characteristic.name, Machine.key, Machine.name.label("machine"))
            .join(Machine, Machine.id == Characteristic.machine_id)
            .where(tuple_(*of).in_(places))
        )
    }
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
