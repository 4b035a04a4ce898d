"""Runs, what became of them, and the kinematics in effect. Never writes."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from sqlalchemy import func, select, tuple_
from sqlalchemy.orm import Session

from app.errors import FieldError, Invalid, NotFound
from app.kinematics.tables import KinematicsBackup, KinematicsDecision, KinematicsPlan, KinematicsRun
from app.machines.tables import Machine
from app.web.fields import LARGEST_ID, LARGEST_SERIAL
from app.web.i18n import _

MOST_FOR_DRIFT = 500


class RunRow(NamedTuple):
    """A run with its machine and what was decided of it.

    status: `refused`; `to_confirm` (its change is larger than permitted); `confirmed`; `measured`; `entered`.
    overtaken: the kinematics has been changed since it was measured, so it says nothing about what is to be entered.
    """

    run: KinematicsRun
    machine: Machine
    decisions: Mapping[str, KinematicsDecision]
    overtaken: bool

    @property
    def status(self) -> str:
        if self.run.outcome == "refused":
            return "refused"
        if "entered" in self.decisions:
            return "entered"
        if "confirmed" in self.decisions:
            return "confirmed"
        return "to_confirm" if self.run.outcome == "too_large" else "measured"

    @property
    def may_be_entered(self) -> bool:
        """Whether its errors could be entered on the control now, confirmed or not."""
        return self.status not in {"refused", "entered"} and not self.overtaken and bool(self.run.results["axes"])


def run(session: Session, number: int) -> RunRow:
    """One run. Raises `NotFound`."""
    found = (
        session.execute(
            select(KinematicsRun, Machine)
            .join(Machine, Machine.id == KinematicsRun.machine_id)
            .where(KinematicsRun.id == number)
        ).one_or_none()
        if 0 < number <= LARGEST_ID
        else None
    )
    if found is None:
        raise NotFound(
            _("There is no run {number} of the preset compensation.").format(number=number),
            _("Check the number; GET /api/v1/kinematics/runs lists them."),
        )
    return _rows(session, [(found[0], found[1])])[0]


def run_by_key(session: Session, machine: Machine, key: str) -> RunRow | None:
    """The run that was sent with this key, if there is one."""
    found = session.scalars(
        select(KinematicsRun).where(KinematicsRun.machine_id == machine.id, KinematicsRun.key == key)
    ).one_or_none()
    return None if found is None else _rows(session, [(found, machine)])[0]


def runs(
    session: Session,
    machine_id: int | None = None,
    *,
    head: str | None = None,
    after: int = 0,
    before: int | None = None,
    newest_first: bool = False,
    limit: int = 100,
) -> list[RunRow]:
    """Runs, oldest first."""
    wanted = (
        select(KinematicsRun, Machine)
        .join(Machine, Machine.id == KinematicsRun.machine_id)
        .where(KinematicsRun.id > after)
        .order_by(KinematicsRun.id.desc() if newest_first else KinematicsRun.id)
        .limit(limit)
    )
    if machine_id is not None:
        wanted = wanted.where(KinematicsRun.machine_id == machine_id)
    if head is not None:
        wanted = wanted.where(KinematicsRun.head == head)
    if before is not None:
        wanted = wanted.where(KinematicsRun.id < before)
    return _rows(session, [(row[0], row[1]) for row in session.execute(wanted)])


def _rows(session: Session, found: Sequence[tuple[KinematicsRun, Machine]]) -> list[RunRow]:
    keys = [(run.machine_id, run.id) for run, _machine in found]
    decided: dict[int, dict[str, KinematicsDecision]] = {}
    if keys:
        places = tuple_(KinematicsDecision.machine_id, KinematicsDecision.run)
        for each in session.scalars(select(KinematicsDecision).where(places.in_(keys))):
            decided.setdefault(each.run, {})[each.what] = each
    heads = {(run.machine_id, run.head) for run, _machine in found}
    versions = {(machine_id, head): version_of(session, machine_id, head) for machine_id, head in heads}
    return [
        RunRow(run, machine, decided.get(run.id, {}), versions[run.machine_id, run.head] != run.version)
        for run, machine in found
    ]


def of_machine(session: Session, machine_id: int) -> list[KinematicsRun]:
    """The runs of a machine that count, in the order in which they were measured; of many the latest."""
    newest = (
        select(KinematicsRun)
        .where(KinematicsRun.machine_id == machine_id, KinematicsRun.outcome != "refused")
        .order_by(KinematicsRun.measured_at.desc(), KinematicsRun.id.desc())
        .limit(MOST_FOR_DRIFT)
    )
    return list(reversed(session.scalars(newest).all()))


def next_run(session: Session) -> int:
    """A number for a run."""
    return int(session.scalar(select(func.nextval("kinematics_run_id"))) or 0)


# --- the kinematics


def version_of(session: Session, machine_id: int, head: str) -> int:
    """The version of the kinematics in effect with this head; 0: nothing was entered yet."""
    return (
        session.scalar(
            select(func.max(KinematicsBackup.version)).where(
                KinematicsBackup.machine_id == machine_id, KinematicsBackup.head == head
            )
        )
        or 0
    )


def in_effect(session: Session, machine_id: int, head: str) -> dict[str, float]:
    """What has been entered so far with this head, by name of the error."""
    found = session.scalars(
        select(KinematicsBackup)
        .where(KinematicsBackup.machine_id == machine_id, KinematicsBackup.head == head)
        .order_by(KinematicsBackup.version.desc())
        .limit(1)
    ).one_or_none()
    return {} if found is None else dict(found.errors)


def next_version(session: Session, machine_id: int) -> int:
    last = session.scalar(select(func.max(KinematicsBackup.version)).where(KinematicsBackup.machine_id == machine_id))
    return (last or 0) + 1


def backups(session: Session, machine_id: int, *, after: int = 0, limit: int = 1000) -> list[KinematicsBackup]:
    """Every kinematics that was in effect, oldest first."""
    return list(
        session.scalars(
            select(KinematicsBackup)
            .where(KinematicsBackup.machine_id == machine_id, KinematicsBackup.version > after)
            .order_by(KinematicsBackup.version)
            .limit(limit)
        )
    )


def backup(session: Session, machine: Machine, version: int) -> KinematicsBackup:
    """One of them. Raises `NotFound`."""
    found = session.get(KinematicsBackup, (machine.id, version)) if 0 < version <= LARGEST_SERIAL else None
    if found is None:
        raise NotFound(
            _("There is no back-up {version} of the kinematics of {machine}.").format(
                version=version, machine=machine.key
            ),
            _("GET …/backups lists them."),
        )
    return found


# --- what it is held against


def plan(session: Session, machine_id: int) -> KinematicsPlan:
    """What the runs of this machine are held against; nothing, if nobody has set it."""
    found = session.get(KinematicsPlan, machine_id, populate_existing=True)
    return found or KinematicsPlan(machine_id=machine_id, limits={}, characteristics={})


def two_runs(session: Session, first: int, second: int) -> tuple[RunRow, RunRow]:
    """Two runs to be compared, the older first. Raises `NotFound`; `Invalid` for runs of two machines."""
    one, two = run(session, first), run(session, second)
    if one.machine.id != two.machine.id:
        wrong = _("run {a} is of {first}, run {b} of {second}").format(
            a=first, first=one.machine.key, b=second, second=two.machine.key
        )
        raise Invalid(f"with: {wrong}.", _("Compare runs of one machine."), errors=[FieldError("with", wrong)])
    return (one, two) if (one.run.measured_at, one.run.id) <= (two.run.measured_at, two.run.id) else (two, one)


def heads_of(session: Session, machine_id: int) -> dict[str, RunRow]:
    """The last run that counts with each head."""
    latest: dict[str, Any] = {}
    for each in of_machine(session, machine_id):
        latest[each.head] = each
    machine = session.get_one(Machine, machine_id)
    rows = _rows(session, [(each, machine) for each in latest.values()])
    return {row.run.head: row for row in rows}
