"""Gauge studies with what they say now, and what they suggest for R33. Never writes. Lengths in mm."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from sqlalchemy import ColumnElement, Select, and_, func, or_, select
from sqlalchemy.orm import Session

from app.capability.queries import scatter_of_parts
from app.characteristics import queries as characteristics
from app.characteristics.queries import Standing
from app.characteristics.tables import Characteristic
from app.core.spc.gauge.single import FEWEST_REPEATS
from app.core.spc.gauge.zero_range import Suggestion, suggest
from app.core.spc.refusal import Reason, Refused
from app.core.zones import Zone
from app.errors import FieldError, Invalid, NotFound
from app.gauges.evaluating import Evaluated, evaluate
from app.gauges.tables import GaugeStudy, GaugeStudyRevision
from app.machines.tables import Machine
from app.readings.tables import Exclusion, Reading, ReadingTouches
from app.statistics import queries as statistics
from app.web.fields import LARGEST_ID
from app.web.i18n import _

LOOKED_BACK = 400  # readings from which the scatter from part to part is told
LOOKED_AT = 10  # newest studies among which one is looked for that speaks of R33
MOST_TAKEN = 1_000  # readings that a study may be made of


@dataclass(frozen=True)
class StudyRow:
    """A study as it stands: newest revision, or the one that was asked for."""

    study: GaugeStudy
    revision: GaugeStudyRevision
    machine: Machine
    characteristic: str | None
    newest: int

    @property
    def settings(self) -> dict[str, Any]:
        """What it is about."""
        return self.revision.settings

    @cached_property
    def found(self) -> Evaluated:
        """What it says: computed from the values whenever it is looked at."""
        return evaluate(self.study.kind, self.settings, self.revision.rows)

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
        select(GaugeStudy, GaugeStudyRevision, Machine, Characteristic.key, _NEWEST)
        .join(
            GaugeStudyRevision,
            and_(GaugeStudyRevision.machine_id == GaugeStudy.machine_id, GaugeStudyRevision.study_id == GaugeStudy.id),
        )
        .join(Machine, Machine.id == GaugeStudy.machine_id)
        .outerjoin(
            Characteristic,
            and_(Characteristic.machine_id == GaugeStudy.machine_id, Characteristic.id == GaugeStudy.characteristic_id),
        )
    )


def study(session: Session, number: int, revision: int | None = None) -> StudyRow:
    """One study, as its newest or another revision has it. Raises `NotFound`."""
    wanted = _rows().where(
        GaugeStudy.id == number, GaugeStudyRevision.revision == (_NEWEST if revision is None else revision)
    )
    sensible = 1 <= number <= LARGEST_ID and (revision is None or 1 <= revision < 2**31)
    row = session.execute(wanted).one_or_none() if sensible else None
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
    before: int | None = None,
    limit: int = 100,
) -> list[StudyRow]:
    """Studies, newest first; of one machine or of one characteristic."""
    wanted = _rows().where(GaugeStudyRevision.revision == _NEWEST).order_by(GaugeStudy.id.desc()).limit(limit)
    if machine_id is not None:
        wanted = wanted.where(GaugeStudy.machine_id == machine_id)
    if characteristic_id is not None:
        wanted = wanted.where(GaugeStudy.characteristic_id == characteristic_id)
    if before is not None:
        wanted = wanted.where(GaugeStudy.id < before)
    return [StudyRow(*row) for row in session.execute(wanted)]


def by_key(session: Session, machine: Machine, key: str) -> StudyRow | None:
    """The study that was sent with this key, as it was sent."""
    wanted = _rows().where(GaugeStudy.machine_id == machine.id, GaugeStudy.key == key, GaugeStudyRevision.revision == 1)
    row = session.execute(wanted).one_or_none()
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
    """What a study says about R33 of a characteristic. repeats: R27 that counted; looked_back: readings of the process."""

    standing: Standing
    suggestion: Suggestion
    repeatability: float
    repeats: int
    looked_back: int


def advice(session: Session, found: StudyRow) -> Advice | Refused | None:
    """R33 from the repeatability that the study found; None where it serves no characteristic or found none.

    `Refused` where the study is too small to say it: a sigma with 9 degrees of freedom is wrong by a quarter already.
    """
    sigma, freedom = found.found.repeatability, found.found.freedom
    if found.characteristic is None or sigma is None:
        return None
    if freedom + 1 < FEWEST_REPEATS:
        return Refused(Reason.TOO_FEW_READINGS, have=freedom + 1, needed=FEWEST_REPEATS)
    standing = characteristics.characteristic_named(session, found.characteristic)
    parameters = standing.parameters
    repeats = parameters.repeats if found.settings["each"] == "touch" else 1
    process, looked_back = scatter_of_parts(session, standing, LOOKED_BACK)
    try:
        made = suggest(
            sigma,
            repeats=repeats,
            floor=standing.machine.zero_range_floor,
            process=process,
            averaging_limit=parameters.averaging_limit,
        )
    except Refused as refused:
        return refused
    return Advice(standing, made, sigma, repeats, looked_back)


def latest_advice(session: Session, standing: Standing) -> tuple[StudyRow, Advice] | None:
    """The newest study for a characteristic that says something about its R33, with what it says; None of none."""
    wanted = studies(
        session, machine_id=standing.machine.id, characteristic_id=standing.characteristic.id, limit=LOOKED_AT
    )
    for row in wanted:
        found = advice(session, row)
        if isinstance(found, Advice):
            return row, found
    return None


def _between(standing: Standing, first: int, through: int) -> tuple[ColumnElement[bool], ...]:
    return (
        Reading.machine_id == standing.machine.id,
        Reading.characteristic_id == standing.characteristic.id,
        Reading.sequence.between(first, through),
    )


def _useless() -> ColumnElement[bool]:
    """Readings that somebody excluded, and probe faults: they tell of no gauge, as they tell of no process."""
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


def left_out(session: Session, standing: Standing, first: int, through: int) -> list[int]:
    """Which of these readings a study takes no value from: excluded ones, and probe faults."""
    wanted = select(Reading.sequence).where(*_between(standing, first, through), _useless()).order_by(Reading.sequence)
    return list(session.scalars(wanted.limit(MOST_TAKEN)))


def taken(session: Session, standing: Standing, first: int, through: int, take: str) -> list[tuple[int, list[float]]]:
    """What each of these readings measured, or the repeats at its first point, by sequence; see `left_out`.

    Raises `Invalid` where there are none, or more than 1000.
    """
    newest = statistics.window_of(session, standing.characteristic).newest
    if first > through or first > newest:
        wrong = _("there is no reading yet")
        if newest and first > newest:
            wrong = _("there are readings 1 to {newest}").format(newest=newest)
        elif newest:
            wrong = _("is beyond the last of them; exchange the two")
        raise Invalid(f"first: {wrong}.", _("Name other readings."), errors=[FieldError("first", wrong)])
    if min(through, newest) - first >= MOST_TAKEN:
        wrong = _("is too far from the first: a study takes {most} readings at most").format(most=MOST_TAKEN)
        raise Invalid(f"through: {wrong}.", _("Name fewer readings."), errors=[FieldError("through", wrong)])
    here = (*_between(standing, first, through), ~_useless())
    made: list[tuple[int, list[float]]]
    if take == "readings":
        rows = session.execute(select(Reading.sequence, Reading.measured).where(*here).order_by(Reading.sequence))
        made = [(sequence, [measured]) for sequence, measured in rows]
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
        made = [(sequence, [each for each in touches[0] if each is not None]) for sequence, touches in touched]
    if not made:
        wrong = (
            _("none of these readings came as touches")
            if take == "touches"
            else _("all of these readings are excluded, or probe faults")
        )
        raise Invalid(f"first: {wrong}.", _("Name other readings."), errors=[FieldError("first", wrong)])
    return made
