"""Form measurements and what was found in them. Never writes. Lengths in mm."""

from collections.abc import Sequence
from typing import NamedTuple

from sqlalchemy import Select, and_, func, select
from sqlalchemy.orm import Session

from app.errors import NotFound
from app.forms.tables import FormEvaluation, FormMeasurement
from app.machines.tables import Machine
from app.readings import queries as readings
from app.web.fields import LARGEST_ID
from app.web.i18n import _

SHOWN = 200  # measurements of a trend


class FormRow(NamedTuple):
    """A measurement with the evaluation that counts."""

    measurement: FormMeasurement
    evaluation: FormEvaluation
    machine: str


class Became(NamedTuple):
    """What a result became as a reading: of which characteristic, by which number; refused says why it became none."""

    characteristic: str
    sequence: int | None
    refused: str | None


class Feature(NamedTuple):
    """A feature with its newest measurement, and how many there are."""

    row: FormRow
    measurements: int


def _rows() -> Select[FormMeasurement, FormEvaluation, str]:
    newest = (
        select(func.max(FormEvaluation.number))
        .where(FormEvaluation.machine_id == FormMeasurement.machine_id, FormEvaluation.form_id == FormMeasurement.id)
        .correlate(FormMeasurement)
        .scalar_subquery()
    )
    return (
        select(FormMeasurement, FormEvaluation, Machine.key)
        .join(
            FormEvaluation,
            and_(
                FormEvaluation.machine_id == FormMeasurement.machine_id,
                FormEvaluation.form_id == FormMeasurement.id,
                FormEvaluation.number == newest,
            ),
        )
        .join(Machine, Machine.id == FormMeasurement.machine_id)
    )


def form(session: Session, number: int) -> FormRow:
    """One measurement. Raises `NotFound`."""
    found = (
        session.execute(_rows().where(FormMeasurement.id == number)).one_or_none()
        if 1 <= number <= LARGEST_ID
        else None
    )
    if found is None:
        raise NotFound(
            _("There is no form measurement {number}.").format(number=number),
            _("GET /api/v1/forms lists them."),
        )
    return FormRow(*found)


def by_key(session: Session, machine_id: int, key: str) -> FormRow | None:
    """The measurement that was sent with this key, if there is one."""
    found = session.execute(
        _rows().where(FormMeasurement.machine_id == machine_id, FormMeasurement.key == key)
    ).one_or_none()
    return None if found is None else FormRow(*found)


def forms(
    session: Session,
    *,
    machine: Machine | None = None,
    feature: str | None = None,
    kind: str | None = None,
    after: int = 0,
    before: int | None = None,
    newest_first: bool = False,
    limit: int = 100,
) -> list[FormRow]:
    """Measurements, oldest first."""
    wanted = _rows().where(FormMeasurement.id > after).limit(limit)
    if machine is not None:
        wanted = wanted.where(FormMeasurement.machine_id == machine.id)
    if feature is not None:
        wanted = wanted.where(FormMeasurement.feature == feature)
    if kind is not None:
        wanted = wanted.where(FormMeasurement.kind == kind)
    if before is not None:
        wanted = wanted.where(FormMeasurement.id < before)
    order = FormMeasurement.id.desc() if newest_first else FormMeasurement.id
    return [FormRow(*found) for found in session.execute(wanted.order_by(order))]


def trend(session: Session, machine: Machine, feature: str, kind: str | None = None) -> list[FormRow]:
    """The last measurements of a feature in the order in which they were measured."""
    rows = forms(session, machine=machine, feature=feature, kind=kind, newest_first=True, limit=SHOWN)
    return sorted(rows, key=lambda row: (row.measurement.measured_at, row.measurement.id))


def features(session: Session, limit: int = 200) -> list[Feature]:
    """Every feature and kind with its newest measurement, the one measured last first."""
    latest = (
        select(func.max(FormMeasurement.id).label("id"), func.count().label("count"))
        .group_by(FormMeasurement.machine_id, FormMeasurement.feature, FormMeasurement.kind)
        .order_by(func.max(FormMeasurement.id).desc())
        .limit(limit)
        .subquery()
    )
    rows = session.execute(
        _rows().join(latest, latest.c.id == FormMeasurement.id).add_columns(latest.c.count).order_by(latest.c.id.desc())
    )
    return [
        Feature(FormRow(measurement, evaluation, machine), count) for measurement, evaluation, machine, count in rows
    ]


def evaluations(session: Session, row: FormRow) -> Sequence[FormEvaluation]:
    """Everything that was ever found in a measurement, newest first."""
    return session.scalars(
        select(FormEvaluation)
        .where(FormEvaluation.machine_id == row.measurement.machine_id, FormEvaluation.form_id == row.measurement.id)
        .order_by(FormEvaluation.number.desc())
    ).all()


def became(session: Session, rows: Sequence[FormRow]) -> dict[int, Became]:
    """Which readings results became, by the number of the measurement."""
    keys = {reading_key(row.measurement.id): row for row in rows if row.measurement.characteristic_id is not None}
    found = readings.readings_of_results(session, keys) if keys else {}
    return {
        row.measurement.id: Became(found[key][0], found[key][1].sequence, found[key][1].refused)
        for key, row in keys.items()
        if key in found
    }


def source_key(number: int) -> str:
    """The beginning of the key of the reading that a result becomes."""
    return f"form:{number}"


def reading_key(number: int) -> str:
    """The key of the reading that a result becomes."""
    return f"{source_key(number)}:deviation"
