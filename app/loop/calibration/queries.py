"""Calibrations, pairs, and what is due. Never writes. Lengths in mm."""

from collections.abc import Sequence
from datetime import datetime
from typing import NamedTuple

from sqlalchemy import Select, and_, func, select
from sqlalchemy.orm import Session

from app.access.audit.tables import AuditEntry
from app.core.calibration import Outcome
from app.core.decision.limits import nanometres
from app.core.decision.step import rounded
from app.core.pairs import Comparison, compare
from app.core.plausibility import pair_warnings
from app.core.warning import CodedWarning
from app.errors import NotFound
from app.language.i18n import _
from app.loop.characteristics.queries import characteristics
from app.loop.tables.calibration import CalibrationAcceptance, CalibrationPlan, CalibrationRecord, PairedReading
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.machines import Machine
from app.loop.tools import queries as tool_queries
from app.web.fields import LARGEST_SERIAL

CONFIDENCE = 0.95
MOST_PAIRS = 200


class Place(NamedTuple):
    """The location that is calibrated: in the average memory (R11) or, for the offset of a probe, in the tool memory (R10)."""

    memory: str
    location: int


class CalibrationRow(NamedTuple):
    """A calibration with what became of it.

    status: `refused`; `unchanged` (nothing was to be changed); `proposed` (a person may accept it); `accepted`;
    `overtaken` (by a newer calibration, or because the value was changed otherwise).
    """

    record: CalibrationRecord
    acceptance: CalibrationAcceptance | None
    status: str


class Origin(NamedTuple):
    """Origin of an empirical value: person, time, reason, and the calibration, if it came from one.

    since: from when on it was in effect on the machine; one that is applied automatically is in effect from its calibration on.
    """

    value: float
    at: datetime
    actor: str
    reason: str | None
    calibration: int | None
    since: datetime


class Pair(NamedTuple):
    """A paired reading. counts: it belongs to the series of now and is not excluded. warnings: what may be wrong with it."""

    row: PairedReading
    characteristic: str | None
    difference: float
    counts: bool
    warnings: list[CodedWarning]


class Suggestion(NamedTuple):
    """Comparison of the pairs of a location. since: when the value in effect was set; the present series began then."""

    comparison: Comparison
    empirical_value: float
    since: datetime | None
    pairs: list[Pair]

    @property
    def outlier(self) -> int | None:
        """The id of the pair that stands out."""
        at = self.comparison.outlier
        return None if at is None else [pair.row.id for pair in self.pairs if pair.counts][at]


def value_of(session: Session, machine: Machine, place: Place) -> float:
    """The empirical value or the offset in effect. Raises `NotFound` for a location that the machine has not."""
    if place.memory == "average":
        return tool_queries.average(session, machine, place.location).empirical_value
    return tool_queries.tool(session, machine, place.location).offset


def plan(session: Session, machine: Machine, place: Place) -> CalibrationPlan | None:
    """The interval of calibration of a place; None where nothing is planned. Raises `NotFound` for a location that is not there."""
    value_of(session, machine, place)
    return session.get(CalibrationPlan, (machine.id, *place), populate_existing=True)


def _rows(machine: Machine) -> Select[CalibrationRecord, CalibrationAcceptance]:
    return (
        select(CalibrationRecord, CalibrationAcceptance)
        .outerjoin(
            CalibrationAcceptance,
            and_(
                CalibrationAcceptance.machine_id == CalibrationRecord.machine_id,
                CalibrationAcceptance.number == CalibrationRecord.number,
            ),
        )
        .where(CalibrationRecord.machine_id == machine.id)
    )


def calibration(session: Session, machine: Machine, number: int) -> CalibrationRow:
    """One calibration. Raises `NotFound`."""
    row = (
        session.execute(_rows(machine).where(CalibrationRecord.number == number)).one_or_none()
        if 1 <= number <= LARGEST_SERIAL
        else None
    )
    if row is None:
        raise NotFound(
            _("Machine {machine} has no calibration {number}.").format(machine=machine.key, number=number),
            _(
                "Calibrations are numbered 1, 2, 3 … per machine; GET /api/v1/machines/{machine}/calibrations lists them."
            ).format(machine=machine.key),
        )
    return _with_status(session, machine, [(row[0], row[1])])[0]


def by_key(session: Session, machine: Machine, key: str) -> CalibrationRow | None:
    """The calibration that was sent with this key, if there is one."""
    row = session.execute(_rows(machine).where(CalibrationRecord.key == key)).one_or_none()
    return None if row is None else _with_status(session, machine, [(row[0], row[1])])[0]


def calibrations(
    session: Session,
    machine: Machine,
    place: Place | None = None,
    *,
    after: int = 0,
    before: int | None = None,
    newest_first: bool = False,
    limit: int = 100,
) -> list[CalibrationRow]:
    """Calibrations of a machine, or of one place, oldest first."""
    query = _rows(machine).where(CalibrationRecord.number > after).limit(limit)
    if place is not None:
        query = query.where(CalibrationRecord.memory == place.memory, CalibrationRecord.location == place.location)
    if before is not None:
        query = query.where(CalibrationRecord.number < before)
    order = CalibrationRecord.number.desc() if newest_first else CalibrationRecord.number
    rows = session.execute(query.order_by(order)).all()
    return _with_status(session, machine, [(row[0], row[1]) for row in rows])


def _with_status(
    session: Session, machine: Machine, found: Sequence[tuple[CalibrationRecord, CalibrationAcceptance | None]]
) -> list[CalibrationRow]:
    values: dict[Place, float] = {}
    newest: dict[Place, int | None] = {}
    rows = []
    for record, acceptance in found:
        place = Place(record.memory, record.location)
        if place not in values:
            values[place] = value_of(session, machine, place)
            newest[place] = last_good(session, machine, place)
        rows.append(CalibrationRow(record, acceptance, status_of(record, acceptance, values[place], newest[place])))
    return rows


def status_of(
    record: CalibrationRecord, acceptance: CalibrationAcceptance | None, value: float, newest: int | None
) -> str:
    """Status of a calibration. value: in effect now; newest: the last of its place that was not refused."""
    if record.refused:
        return "refused"
    if acceptance is not None:
        return "accepted"
    if record.proposed is None:
        return "unchanged"
    return "proposed" if newest == record.number and nanometres(value - record.value_before) == 0 else "overtaken"


def last_good(session: Session, machine: Machine, place: Place) -> int | None:
    """The number of the last calibration of this place that was not refused."""
    return session.scalar(
        select(func.max(CalibrationRecord.number)).where(
            CalibrationRecord.machine_id == machine.id,
            CalibrationRecord.memory == place.memory,
            CalibrationRecord.location == place.location,
            CalibrationRecord.refused.is_(False),
        )
    )


def known_sizes(session: Session, machine: Machine, place: Place) -> list[float]:
    """Return the sizes that are expected at this place, mm: of its characteristics, and of the last gauge that was good."""
    sizes = targets(session, machine, place.location) if place.memory == "average" else []
    last = last_good(session, machine, place)
    before = None if last is None else calibration(session, machine, last).record.size
    return sizes if before is None else [*sizes, before]


def targets(session: Session, machine: Machine, location: int) -> list[float]:
    """Return the target sizes of the characteristics that use this location R11, mm."""
    every = characteristics(session, machine_id=machine.id)
    return [
        characteristic.parameters.target
        for characteristic in every
        if characteristic.parameters.average_memory == location
    ]


def running_average(session: Session, machine: Machine, place: Place, value: float) -> float:
    """A of the last gauge calibration, as long as the empirical value by which it was judged is in effect; else 0.

    One beyond R34 that is not accepted is passed over: it may have been another gauge.
    """
    last = session.scalars(
        select(CalibrationRecord)
        .where(
            CalibrationRecord.machine_id == machine.id,
            CalibrationRecord.memory == place.memory,
            CalibrationRecord.location == place.location,
            CalibrationRecord.refused.is_(False),
            CalibrationRecord.kind == "gauge",
            CalibrationRecord.outcome != Outcome.FULL_DIFFERENCE,
        )
        .order_by(CalibrationRecord.number.desc())
        .limit(1)
    ).one_or_none()
    if last is None or last.average is None or nanometres(last.value_before - value) != 0:
        return 0.0
    return last.average


def next_number(session: Session, machine: Machine) -> int:
    """The number of the next calibration; the machine is locked."""
    last = session.scalar(select(func.max(CalibrationRecord.number)).where(CalibrationRecord.machine_id == machine.id))
    return (last or 0) + 1


# --- where the empirical value came from


def value_changes(session: Session, machine: Machine, location: int, limit: int | None = None) -> list[Origin]:
    """Earlier and present empirical values of a location, newest first, from the record of changes."""
    entries = session.scalars(_changes(machine, location).limit(limit)).all()
    return _origins(session, machine, location, entries)


def origin(session: Session, machine: Machine, location: int, at: datetime | None = None) -> Origin | None:
    """Origin of the value in effect at this moment (None: now); None if nobody ever set one."""
    query = _changes(machine, location).limit(1)
    entry = session.scalars(query if at is None else query.where(AuditEntry.at <= at)).one_or_none()
    return None if entry is None else _origins(session, machine, location, [entry])[0]


def _changes(machine: Machine, location: int) -> Select[AuditEntry]:
    return (
        select(AuditEntry)
        .where(
            AuditEntry.subject == f"average/{machine.key}/{location}", AuditEntry.action == "empirical value changed"
        )
        .order_by(AuditEntry.id.desc())
    )


def _origins(session: Session, machine: Machine, location: int, entries: Sequence[AuditEntry]) -> list[Origin]:
    """An acceptance and the change that it made were written in one transaction, so they bear the same time."""
    accepted = {
        row.at: row
        for row in session.execute(
            select(
                CalibrationAcceptance.at,
                CalibrationAcceptance.number,
                CalibrationAcceptance.automatic,
                CalibrationRecord.calibrated_at,
            )
            .join(
                CalibrationRecord,
                and_(
                    CalibrationRecord.machine_id == CalibrationAcceptance.machine_id,
                    CalibrationRecord.number == CalibrationAcceptance.number,
                ),
            )
            .where(
                CalibrationAcceptance.machine_id == machine.id,
                CalibrationRecord.memory == "average",
                CalibrationRecord.location == location,
                CalibrationAcceptance.at.in_([entry.at for entry in entries]),
            )
        )
    }
    origins = []
    for entry in entries:
        value, by = (entry.after or {}).get("empirical_value", 0.0), accepted.get(entry.at)
        since = by.calibrated_at if by is not None and by.automatic else entry.at
        number = None if by is None else by.number
        origins.append(Origin(value, entry.at, entry.actor, entry.why, number, since))
    return origins


# --- pairs


def pairs(
    session: Session,
    machine: Machine,
    location: int,
    *,
    after: int = 0,
    limit: int | None = None,
    only: int | None = None,
    newest: bool = False,
) -> list[Pair]:
    """Paired readings of a location, oldest first; with ``newest`` the last N."""
    since = origin(session, machine, location)
    sizes = targets(session, machine, location)
    query = (
        select(PairedReading, Characteristic.key)
        .outerjoin(
            Characteristic,
            and_(
                Characteristic.machine_id == PairedReading.machine_id,
                Characteristic.id == PairedReading.characteristic_id,
            ),
        )
        .where(PairedReading.machine_id == machine.id, PairedReading.location == location, PairedReading.id > after)
        .order_by(PairedReading.id.desc() if newest else PairedReading.id)
        .limit(limit)
    )
    if only is not None:
        query = query.where(PairedReading.id == only)
    rows = [
        Pair(
            row,
            key,
            rounded(row.machine_value - row.true_value),
            row.excluded_at is None and (since is None or row.at > since.at),
            pair_warnings(row.machine_value, row.true_value, sizes),
        )
        for row, key in session.execute(query)
    ]
    return rows[::-1] if newest else rows


def suggestion(session: Session, machine: Machine, location: int, confidence: float = CONFIDENCE) -> Suggestion:
    """The comparison of the last pairs of this location, and those pairs, oldest first.

    A series begins when the empirical value is set: pairs from before tell of a probe that may be another by now.
    """
    value = tool_queries.average(session, machine, location).empirical_value
    since = origin(session, machine, location)
    rows = pairs(session, machine, location, limit=MOST_PAIRS, newest=True)
    differences = [pair.difference for pair in rows if pair.counts]
    compared = compare(differences, empirical_value=value, confidence=confidence)
    return Suggestion(compared, value, None if since is None else since.at, rows)


def pair(session: Session, machine: Machine, location: int, number: int) -> PairedReading:
    """One paired reading. Raises `NotFound`."""
    row = session.get(PairedReading, (machine.id, number), populate_existing=True) if 0 < number < 2**63 else None
    if row is None or row.location != location:
        raise NotFound(
            _("R11 = {location} of {machine} has no paired reading {number}.").format(
                location=location, machine=machine.key, number=number
            ),
            _("GET …/averages/{location}/pairs lists them.").format(location=location),
        )
    return row


def pair_by_key(session: Session, machine: Machine, key: str) -> PairedReading | None:
    return session.scalars(
        select(PairedReading).where(PairedReading.machine_id == machine.id, PairedReading.key == key)
    ).one_or_none()
