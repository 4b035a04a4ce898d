"""Form measurements and what was found in them. Never writes. Lengths in mm."""

from collections.abc import Sequence
from typing import NamedTuple

from sqlalchemy import Select, and_, func, select, true
from sqlalchemy.orm import Session

from app.errors import NotFound
from app.geometry.geometric_form.tables import FormEvaluation, FormMeasurement
from app.language.i18n import _
from app.loop.readings import queries as readings
from app.loop.tables.machines import Machine
from app.web.fields import LARGEST_ID

SHOWN = 200  # measurements of a trend


class FormRow(NamedTuple):
    """A measurement with the evaluation that counts, the key of its machine, and the shift that is plausible there, mm."""

    measurement: FormMeasurement
    evaluation: FormEvaluation
    machine: str
    plausible_shift: float


class Feature(NamedTuple):
    """A feature with its newest measurement, and how many there are."""

    row: FormRow
    measurements: int


def _rows() -> Select[FormMeasurement, FormEvaluation, str, float]:
    newest = (
        select(func.max(FormEvaluation.number))
        .where(FormEvaluation.machine_id == FormMeasurement.machine_id, FormEvaluation.form_id == FormMeasurement.id)
        .correlate(FormMeasurement)
        .scalar_subquery()
    )
    return (
        select(FormMeasurement, FormEvaluation, Machine.key, Machine.plausible_shift)
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
    row = (
        session.execute(_rows().where(FormMeasurement.id == number)).one_or_none()
        if 1 <= number <= LARGEST_ID
        else None
    )
    if row is None:
        raise NotFound(
            _("There is no form measurement {number}.").format(number=number),
            _("GET /api/v1/forms lists them."),
        )
    return FormRow(*row)


def by_key(session: Session, machine_id: int, key: str) -> FormRow | None:
    """The measurement that was sent with this key, if there is one."""
    row = session.execute(
        _rows().where(FormMeasurement.machine_id == machine_id, FormMeasurement.key == key)
    ).one_or_none()
    return None if row is None else FormRow(*row)


def forms(
    session: Session,
    *,
    machine_id: int | None = None,
    feature: str | None = None,
    kind: str | None = None,
    after: int = 0,
    before: int | None = None,
    newest_first: bool = False,
    limit: int = 100,
) -> list[FormRow]:
    """Measurements, oldest first."""
    query = _rows().where(FormMeasurement.id > after).limit(limit)
    if machine_id is not None:
        query = query.where(FormMeasurement.machine_id == machine_id)
    if feature is not None:
        query = query.where(FormMeasurement.feature == feature)
    if kind is not None:
        query = query.where(FormMeasurement.kind == kind)
    if before is not None:
        query = query.where(FormMeasurement.id < before)
    order = FormMeasurement.id.desc() if newest_first else FormMeasurement.id
    return [FormRow(*row) for row in session.execute(query.order_by(order))]


def trend(session: Session, machine: Machine, feature: str, kind: str | None = None) -> list[FormRow]:
    """The last measurements of a feature in the order in which they were measured."""
    rows = forms(session, machine_id=machine.id, feature=feature, kind=kind, newest_first=True, limit=SHOWN)
    return sorted(rows, key=lambda row: (row.measurement.measured_at, row.measurement.id))


def features(session: Session, only: int | None = None, limit: int = 200) -> list[Feature]:
    """Every feature and kind, of one machine or of all, with its newest measurement, the one measured last first."""
    latest = (
        select(func.max(FormMeasurement.id).label("id"), func.count().label("count"))
        .where(true() if only is None else FormMeasurement.machine_id == only)
        .group_by(FormMeasurement.machine_id, FormMeasurement.feature, FormMeasurement.kind)
        .order_by(func.max(FormMeasurement.id).desc())
        .limit(limit)
        .subquery()
    )
    rows = session.execute(
        _rows().join(latest, latest.c.id == FormMeasurement.id).add_columns(latest.c.count).order_by(latest.c.id.desc())
    )
    return [Feature(FormRow(*row), count) for *row, count in rows]


def evaluations(session: Session, row: FormRow) -> Sequence[FormEvaluation]:
    """Everything that was ever found in a measurement, newest first."""
    return session.scalars(
        select(FormEvaluation)
        .where(FormEvaluation.machine_id == row.measurement.machine_id, FormEvaluation.form_id == row.measurement.id)
        .order_by(FormEvaluation.number.desc())
    ).all()


def became(session: Session, rows: Sequence[FormRow]) -> dict[int, readings.PushedResult]:
    """Readings that results were pushed as, by the number of the measurement."""
    measurements = [row.measurement for row in rows if row.measurement.characteristic_id is not None]
    numbers = {source_key(measurement.id): measurement.id for measurement in measurements}
    results = readings.pushed_results(session, numbers, ["deviation"]) if numbers else {}
    return {numbers[source]: pushed[0] for source, pushed in results.items() if pushed}


def source_key(number: int) -> str:
    """The beginning of the key of the reading that a result becomes."""
    return f"form:{number}"
