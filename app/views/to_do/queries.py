"""Everything that waits for a person: active alarms, corrections to decide about, parts set aside, open proposals, receivers and background
jobs that fail. Never writes.

A held correction is part of the alarm that holds it and counts only where none does. A calibration that is overdue and a
fixture that has shifted are alarms. The count is the same for everybody, whatever their role.
"""

from collections.abc import Iterator
from datetime import datetime
from typing import Literal, NamedTuple

from sqlalchemy import ColumnElement, Select, any_, func, select, union_all
from sqlalchemy.orm import Session, aliased

from app.access.callers import Caller, Role
from app.jobs.tables import JobFailure
from app.jobs.wording import job_word
from app.language.formatting import read_um
from app.language.i18n import _, ngettext
from app.loop.alarm_response import queries as alarms
from app.loop.alarm_response import wording
from app.loop.alarms.reading_kinds import HOLDING
from app.loop.characteristics.queries import parameters_of
from app.loop.notifications import failing_queries as failing
from app.loop.notifications.failing_wording import what_to_look_at
from app.loop.notifications.wording import means_word
from app.loop.quarantine import queries as quarantine
from app.loop.quarantine.tables import Quarantine
from app.loop.tables.alarms import Alarm
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Reading
from app.loop.tables.tools import Correction
from app.quality.what_if import queries as what_if
from app.quality.what_if.tables import ParameterProposal
from app.web.states import word_of

Kind = Literal["alarm", "correction", "quarantine", "proposal", "receiver", "job"]
MOST = 200  # of each kind, on one page


class Task(NamedTuple):
    """One thing that waits. state: for its badge; about: what it is about; role: those who have it, or a higher one, may do it; number: of a correction;
    detail: more, for those who may do it alone.
    """

    kind: Kind
    state: str
    word: str
    machine: Machine | None
    about: str
    sentence: str
    since: datetime
    action: str
    path: str
    role: Role
    number: int | None = None
    detail: str = ""


def _held_alone() -> ColumnElement[bool]:
    """A held correction that no active alarm holds."""
    holding = (
        select(Alarm.id)
        .join(Reading, (Reading.machine_id == Alarm.machine_id) & (Alarm.id == any_(Reading.alarms)))
        .where(
            Alarm.machine_id == Correction.machine_id,
            Alarm.kind.in_(HOLDING),
            Alarm.acknowledged_at.is_(None),
            Reading.characteristic_id == Correction.characteristic_id,
            Reading.sequence == Correction.sequence,
        )
    )
    return (Correction.status == "held") & ~holding.exists()


_TO_DECIDE = (Correction.status == "awaiting_approval") | _held_alone()
COUNT: Select[int] = select(
    alarms.ACTIVE_COUNT.scalar_subquery()
    + select(func.count()).select_from(Correction).where(_TO_DECIDE).scalar_subquery()
    + quarantine.OPEN_COUNT.scalar_subquery()
    + select(func.count()).where(ParameterProposal.status == "open").scalar_subquery()
    + failing.COUNT.scalar_subquery()
    + select(func.count()).select_from(JobFailure).scalar_subquery()
)


def count(session: Session) -> int:
    """Number of things that wait for a person, in the whole plant."""
    return session.scalar(COUNT) or 0


def count_by_machine(session: Session) -> dict[int, int]:
    """Number of things that wait at each machine, by its id; receivers and background jobs belong to none."""
    waiting = union_all(
        select(Alarm.machine_id).where(Alarm.acknowledged_at.is_(None)),
        select(Correction.machine_id).where(_TO_DECIDE),
        select(Quarantine.machine_id).where(quarantine.IS_OPEN),
        select(ParameterProposal.machine_id).where(ParameterProposal.status == "open"),
    ).subquery()
    query = select(waiting.c.machine_id, func.count()).group_by(waiting.c.machine_id)
    return dict(session.execute(query).all())


def tasks(session: Session, machine: Machine | None = None, caller: Caller | None = None) -> list[Task]:
    """All that waits, alarms first, the most urgent of them, then the oldest of each kind: at one machine, or what one person's role may do."""
    found = list(_alarms(session, machine))
    if machine is None:
        found += _receivers(session)
    found += [*_corrections(session, machine), *_quarantines(session, machine), *_proposals(session, machine)]
    if machine is None:
        found += _jobs(session)
    return [task for task in found if caller is None or caller.may(task.role)]


def _alarms(session: Session, machine: Machine | None) -> Iterator[Task]:
    rows = alarms.alarms(
        session, state="active", machine_id=machine.id if machine else None, limit=MOST, by_urgency=True
    )
    for row in rows:
        alarm = row.alarm
        about = row.characteristic.name if row.characteristic else ""
        if not about and alarm.tool_memory:
            about = _("Tool {number}").format(number=alarm.tool_memory)
        yield Task(
            kind="alarm",
            state=alarm.kind,
            word=wording.kind_word(alarm.kind),
            machine=row.machine,
            about=about,
            sentence=wording.sentence(alarm),
            since=alarm.raised_at,
            action=_("Acknowledge"),
            path=f"/alarms/{alarm.id}",
            role="operator",
        )


def _corrections(session: Session, machine: Machine | None) -> Iterator[Task]:
    asking = aliased(Reading)  # a held one looks for readings of its own
    query = (
        select(Correction, Machine, Characteristic.name, asking.parameters_version)
        .join(Machine, Machine.id == Correction.machine_id)
        .join(
            Characteristic,
            (Characteristic.machine_id == Correction.machine_id) & (Characteristic.id == Correction.characteristic_id),
        )
        .join(
            asking,
            (asking.machine_id == Correction.machine_id)
            & (asking.characteristic_id == Correction.characteristic_id)
            & (asking.sequence == Correction.sequence),
        )
        .where(_TO_DECIDE)
        .order_by(Correction.created_at)
        .limit(MOST)
    )
    if machine is not None:
        query = query.where(Correction.machine_id == machine.id)
    for correction, at, name, version in session.execute(query):
        half = parameters_of(session, at.id, correction.characteristic_id, version).half
        yield Task(
            kind="correction",
            state=correction.status,
            word=word_of(correction.status),
            machine=at,
            about=name,
            sentence=_("Tool {number}: correction of {amount}").format(
                number=correction.tool_memory, amount=read_um(correction.amount, half)
            ),
            since=correction.created_at,
            action=_("Decide"),
            path=f"/corrections?machine={at.key}#correction-{correction.number}",
            role="operator",
            number=correction.number,
        )


def _quarantines(session: Session, machine: Machine | None) -> Iterator[Task]:
    rows = quarantine.quarantines(session, machine_id=machine.id if machine else None, state="open", limit=MOST)
    for row in reversed(rows):
        yield Task(
            kind="quarantine",
            state="quarantined",
            word=_("Quarantine"),
            machine=row.machine,
            about=_("Alarm {number}").format(number=row.quarantine.alarm_id),
            sentence=ngettext("{n} part is set aside: {why}", "{n} parts are set aside: {why}", row.open).format(
                n=row.open, why=row.quarantine.reason
            ),
            since=row.quarantine.made_at,
            action=_("Decide"),
            path=f"/quarantines/{row.quarantine.id}",
            role="operator",
        )


def _proposals(session: Session, machine: Machine | None) -> Iterator[Task]:
    for status in ("open", "outdated"):  # an outdated one is open still: a person rejects it
        rows = what_if.proposals(session, machine_id=machine.id if machine else None, status=status, limit=MOST)
        for row in reversed(rows):
            yield Task(
                kind="proposal",
                state="awaiting_approval",
                word=_("Proposal") if status == "open" else _("Outdated proposal"),
                machine=row.machine,
                about=row.characteristic.name,
                sentence=_("{who} proposes other parameters: {why}").format(
                    who=row.proposal.proposed_by, why=row.proposal.reason
                ),
                since=row.proposal.proposed_at,
                action=_("Decide"),
                path=f"/proposals/{row.proposal.id}",
                role="engineer",
            )


def _receivers(session: Session) -> Iterator[Task]:
    for rows in failing.causes(failing.failing(session)):
        first, more = rows[0], len(rows) - 1
        named = ngettext("{name} and {n} more", "{name} and {n} more", more).format(name=first.name, n=more)
        detail = f"{means_word(first.means)}: {first.failure} {what_to_look_at(first)}"
        yield Task(
            kind="receiver",
            state="probe_fault",
            word=_("Not reached"),
            machine=None,
            about=named if more else first.name,
            sentence=_("Notifications do not arrive: alarms may reach nobody."),
            since=first.failing_since or first.created_at,
            action=_("Look"),
            path="/setup/notifications#receivers",
            role="admin",
            detail=detail.strip(),
        )


def _jobs(session: Session) -> Iterator[Task]:
    for failure in session.scalars(select(JobFailure).order_by(JobFailure.first_at).limit(MOST)):
        yield Task(
            kind="job",
            state="probe_fault",
            word=_("Background job fails"),
            machine=None,
            about=job_word(failure.job),
            sentence=f"{failure.subject}: {failure.error}" if failure.subject else failure.error,
            since=failure.first_at,
            action=_("Look"),
            path="/setup/jobs",
            role="engineer",
        )
