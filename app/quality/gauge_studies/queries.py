"""Gauge studies with what they say now, and what they suggest for R33. Never writes. Lengths in mm."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any

from sqlalchemy import ColumnElement, Select, and_, func, or_, select
from sqlalchemy.orm import Session

from app.core.decision.limits import Zone
from app.core.spc.gauge.single import FEWEST_REPEATS
from app.core.spc.gauge.zero_range import Suggestion, suggest
from app.core.spc.refusal import Reason, Refused
from app.core.warning import CodedWarning
from app.db.text import holds_words
from app.errors import Invalid, NotFound
from app.language.i18n import _
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.machines.queries import lock_machines
from app.loop.summaries import queries as statistics
from app.loop.tables.characteristics import Characteristic, ParametersVersion
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Exclusion, Reading, ReadingTouches, Stream
from app.quality.capability.queries import scatter_of_parts
from app.quality.gauge_studies.evaluation import Evaluation, evaluate, inches_in
from app.quality.gauge_studies.tables import GaugeStudy, GaugeStudyRevision
from app.web.fields import LARGEST_ID

LOOKED_BACK = 400  # readings that show the scatter from part to part
LOOKED_AT = 10  # newest studies among which one is looked for that speaks of R33
MOST_TAKEN = 1_000  # readings that a study may be made of


@dataclass(frozen=True)
class StudyRow:
    """A study as it is: newest revision, or the one that was asked for."""

    study: GaugeStudy
    revision: GaugeStudyRevision
    machine: Machine
    characteristic: str | None
    newest: int
    target: float | None  # of the characteristic, mm

    @property
    def settings(self) -> dict[str, Any]:
        """Settings of the study."""
        return self.revision.settings

    @cached_property
    def evaluation(self) -> Evaluation:
        """Results: computed from the values at each look."""
        return evaluate(self.study.kind, self.settings, self.revision.rows)

    @property
    def warnings(self) -> list[CodedWarning]:
        """Sizes that look like inches."""
        return inches_in(self.settings, self.revision.rows, self.target)

    @property
    def tolerance(self) -> float | None:
        """Width of the tolerance that it is measured by."""
        width: float | None = self.settings.get("tolerance")
        return width


_NEWEST = (
    select(func.max(GaugeStudyRevision.revision))
    .where(GaugeStudyRevision.machine_id == GaugeStudy.machine_id, GaugeStudyRevision.study_id == GaugeStudy.id)
    .correlate(GaugeStudy)
    .scalar_subquery()
)


def _rows() -> Select[Any]:
    return (
        select(
            GaugeStudy,
            GaugeStudyRevision,
            Machine,
            Characteristic.key,
            _NEWEST,
            ParametersVersion.parameters["target"].as_float(),
        )
        .join(
            GaugeStudyRevision,
            and_(GaugeStudyRevision.machine_id == GaugeStudy.machine_id, GaugeStudyRevision.study_id == GaugeStudy.id),
        )
        .join(Machine, Machine.id == GaugeStudy.machine_id)
        .outerjoin(
            Characteristic,
            and_(Characteristic.machine_id == GaugeStudy.machine_id, Characteristic.id == GaugeStudy.characteristic_id),
        )
        .outerjoin(
            Stream, and_(Stream.machine_id == Characteristic.machine_id, Stream.characteristic_id == Characteristic.id)
        )
        .outerjoin(
            ParametersVersion,
            and_(
                ParametersVersion.machine_id == Stream.machine_id,
                ParametersVersion.characteristic_id == Stream.characteristic_id,
                ParametersVersion.version == Stream.parameters_version,
            ),
        )
    )


def hold_study(session: Session, given: Mapping[str, Any]) -> None:
    """Hold the machine of the study that a route names until the transaction ends (`app.web.etags`)."""
    lock_machines(session, [study(session, given["study"]).machine.id])


def study(session: Session, number: int, revision: int | None = None) -> StudyRow:
    """One study, as its newest or another revision has it. Raises `NotFound`."""
    query = _rows().where(
        GaugeStudy.id == number, GaugeStudyRevision.revision == (_NEWEST if revision is None else revision)
    )
    sensible = 1 <= number <= LARGEST_ID and (revision is None or 1 <= revision < 2**31)
    row = session.execute(query).one_or_none() if sensible else None
    if row is None:
        raise NotFound(
            _("There is no gauge study {number}.").format(number=number)
            if revision is None
            else _("Gauge study {number} has no revision {revision}.").format(number=number, revision=revision),
            _("GET /api/v1/gauge-studies lists them."),
        )
    return StudyRow(*row)


def studies(
    session: Session,
    *,
    machine_id: int | None = None,
    characteristic_id: int | None = None,
    holding: str = "",
    kinds: Mapping[str, str] = MappingProxyType({}),
    before: int | None = None,
    limit: int = 100,
) -> list[StudyRow]:
    """Studies, newest first; of one machine or of one characteristic.

    holding: those in whose kind, gauge, names or author these words are found. kinds: what each kind is called.
    """
    query = _rows().where(GaugeStudyRevision.revision == _NEWEST).order_by(GaugeStudy.id.desc()).limit(limit)
    if machine_id is not None:
        query = query.where(GaugeStudy.machine_id == machine_id)
    if characteristic_id is not None:
        query = query.where(GaugeStudy.characteristic_id == characteristic_id)
    gauge = GaugeStudyRevision.settings["gauge"].as_string()
    names = (gauge, Machine.name, Characteristic.name, Characteristic.key, GaugeStudy.created_by)
    query = query.where(*holds_words(holding, *names, coded=(GaugeStudy.kind, kinds)))
    if before is not None:
        query = query.where(GaugeStudy.id < before)
    return [StudyRow(*row) for row in session.execute(query)]


def by_key(session: Session, machine: Machine, key: str) -> StudyRow | None:
    """The study that was sent with this key, as it was sent."""
    query = _rows().where(GaugeStudy.machine_id == machine.id, GaugeStudy.key == key, GaugeStudyRevision.revision == 1)
    row = session.execute(query).one_or_none()
    return None if row is None else StudyRow(*row)


def revisions(session: Session, found: StudyRow) -> Sequence[GaugeStudyRevision]:
    """Every revision of a study, newest first."""
    return session.scalars(
        select(GaugeStudyRevision)
        .where(GaugeStudyRevision.machine_id == found.study.machine_id, GaugeStudyRevision.study_id == found.study.id)
        .order_by(GaugeStudyRevision.revision.desc())
    ).all()


@dataclass(frozen=True, slots=True)
class Advice:
    """Advice of a study about R33 of a characteristic. repeats: R27 that counted; looked_back: readings of the process."""

    current: CurrentCharacteristic
    suggestion: Suggestion
    repeatability: float
    repeats: int
    looked_back: int


def advice(session: Session, row: StudyRow) -> Advice | Refused | None:
    """R33 from the repeatability that the study found; None where it serves no characteristic or found none.

    `Refused` where the study is too small to say it: a sigma with 9 degrees of freedom is wrong by a quarter already.
    """
    sigma, freedom = row.evaluation.repeatability, row.evaluation.freedom
    if row.characteristic is None or sigma is None:
        return None
    if freedom + 1 < FEWEST_REPEATS:
        return Refused(Reason.TOO_FEW_READINGS, have=freedom + 1, needed=FEWEST_REPEATS)
    current = characteristics.characteristic_named(session, row.characteristic)
    parameters = current.parameters
    repeats = parameters.repeats if row.settings["each"] == "touch" else 1
    process, looked_back = scatter_of_parts(session, current, LOOKED_BACK)
    try:
        suggestion = suggest(
            sigma,
            repeats=repeats,
            floor=current.machine.zero_range_floor,
            process=process,
            averaging_limit=parameters.averaging_limit,
        )
    except Refused as refused:
        return refused
    return Advice(current, suggestion, sigma, repeats, looked_back)


def latest_advice(session: Session, current: CurrentCharacteristic) -> tuple[StudyRow, Advice] | None:
    """The newest study for a characteristic that says something about its R33, with what it says; None of none."""
    rows = studies(session, machine_id=current.machine.id, characteristic_id=current.characteristic.id, limit=LOOKED_AT)
    for row in rows:
        result = advice(session, row)
        if isinstance(result, Advice):
            return row, result
    return None


def empirical_values(
    session: Session, current: CurrentCharacteristic, first: int, through: int
) -> list[dict[str, float]]:
    """The empirical values in force over these readings, mm, each with the reading from which on it was."""
    changes: list[dict[str, float]] = []
    for sequence, value in _empirical_values(session, current, first, through).items():
        if not changes or changes[-1]["value"] != value:
            changes.append({"from": sequence, "value": value})
    return changes


def _empirical_values(session: Session, current: CurrentCharacteristic, first: int, through: int) -> dict[int, float]:
    """By sequence: the empirical value that the deviation was computed with, measured size - target - deviation."""
    rows = session.execute(
        select(Reading.sequence, Reading.measured, Reading.deviation, Reading.parameters_version)
        .where(*_between(current, first, through), ~_useless())
        .order_by(Reading.sequence)
        .limit(MOST_TAKEN)
    ).all()
    targets = {
        version: characteristics.parameters_of(session, current.machine.id, current.characteristic.id, version).target
        for version in {row.parameters_version for row in rows}
    }
    return {
        row.sequence: round(row.measured - targets[row.parameters_version] - row.deviation, 6) + 0.0 for row in rows
    }


def _used(size: float, empirical_value: float) -> float:
    return round(size - empirical_value, 9)


def _between(current: CurrentCharacteristic, first: int, through: int) -> tuple[ColumnElement[bool], ...]:
    return (
        Reading.machine_id == current.machine.id,
        Reading.characteristic_id == current.characteristic.id,
        Reading.sequence.between(first, through),
    )


def _useless() -> ColumnElement[bool]:
    """Readings that a person excluded, and probe faults: they tell of no gauge, as they tell of no process."""
    excluded = (
        select(Exclusion.sequence)
        .where(
            Exclusion.machine_id == Reading.machine_id,
            Exclusion.characteristic_id == Reading.characteristic_id,
            Exclusion.sequence == Reading.sequence,
        )
        .exists()
    )
    return or_(excluded, Reading.zone == Zone.PROBE_FAULT)


def left_out(session: Session, current: CurrentCharacteristic, first: int, through: int) -> list[int]:
    """Numbers of the readings that a study takes no value from: excluded ones, and probe faults."""
    query = select(Reading.sequence).where(*_between(current, first, through), _useless()).order_by(Reading.sequence)
    return list(session.scalars(query.limit(MOST_TAKEN)))


def taken(
    session: Session, current: CurrentCharacteristic, first: int, through: int, take: str
) -> list[tuple[int, list[float]]]:
    """Sizes of these readings as they were decided by, or of the repeats at their first point, by sequence; see `left_out`.

    The empirical value in force at each reading is taken off: the measuring system is studied as it is used.

    Raises `Invalid` where there are none, or more than 1000.
    """
    newest = statistics.window_of(session, current.characteristic).newest
    if first > through or first > newest:
        wrong = _("there is no reading yet")
        if newest and first > newest:
            wrong = _("there are readings 1 to {newest}").format(newest=newest)
        elif newest:
            wrong = _("is beyond the last of them; exchange the two")
        raise Invalid.at("first", wrong, do=_("Name other readings."))
    if min(through, newest) - first >= MOST_TAKEN:
        raise Invalid.at(
            "through",
            _("is too far from the first: a study takes {most} readings at most").format(most=MOST_TAKEN),
            do=_("Name fewer readings."),
        )
    here = (*_between(current, first, through), ~_useless())
    sizes: list[tuple[int, list[float]]]
    empirical = _empirical_values(session, current, first, through)
    if take == "readings":
        rows = session.execute(select(Reading.sequence, Reading.measured).where(*here).order_by(Reading.sequence))
        sizes = [(sequence, [_used(measured, empirical[sequence])]) for sequence, measured in rows]
    else:
        touched = session.execute(
            select(Reading.sequence, ReadingTouches.touches)
            .join(
                ReadingTouches,
                and_(
                    ReadingTouches.machine_id == Reading.machine_id,
                    ReadingTouches.characteristic_id == Reading.characteristic_id,
                    ReadingTouches.sequence == Reading.sequence,
                ),
            )
            .where(*here)
            .order_by(Reading.sequence)
        )
        sizes = [
            (sequence, [_used(touch, empirical[sequence]) for touch in touches[0] if touch is not None])
            for sequence, touches in touched
        ]
    if not sizes:
        raise Invalid.at(
            "first",
            _("none of these readings came as touches")
            if take == "touches"
            else _("all of these readings are excluded, or probe faults"),
            do=_("Name other readings."),
        )
    return sizes
