"""Runs, what became of them, and the kinematics in effect. Never writes."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from math import isclose
from typing import Any, NamedTuple

from sqlalchemy import func, select, tuple_
from sqlalchemy.orm import Session

from app.core.rotary.plausible import AxisBounds, axis_warnings
from app.core.rotary.results import STRINGS
from app.core.warning import CodedWarning, of_stored
from app.errors import Invalid, NotFound
from app.geometry.rotary_axes.result_values import AXIS_OF, to_enter, values_of
from app.geometry.rotary_axes.tables import KinematicsBackup, KinematicsDecision, KinematicsPlan, KinematicsRun
from app.language.i18n import _
from app.loop.tables.machines import Machine
from app.web.fields import LARGEST_ID, LARGEST_SERIAL

MOST_FOR_DRIFT = 500
SAME = 1e-9  # mm and degrees


class RunRow(NamedTuple):
    """A run with its machine and what was decided of it.

    status: `refused`; `to_confirm` (its change is larger than permitted, or there are warnings); `confirmed`; `measured`;
    `entered`.
    overtaken: the kinematics is not the one it was measured on, so it says nothing about what is to be entered.
    undone: it was entered, and the kinematics in effect is without it again.
    """

    run: KinematicsRun
    machine: Machine
    decisions: Mapping[str, KinematicsDecision]
    overtaken: bool
    undone: bool = False

    @property
    def status(self) -> str:
        if self.run.outcome == "refused":
            return "refused"
        if "entered" in self.decisions:
            return "entered"
        if "confirmed" in self.decisions:
            return "confirmed"
        return "to_confirm" if self.run.outcome == "too_large" or self.warnings else "measured"

    @property
    def warnings(self) -> list[CodedWarning]:
        """The warnings of the run: as it was kept with it, or, of one from before that, by the limits of now."""
        if self.run.outcome == "refused":
            return []
        if "warnings" in self.run.results:
            return of_stored(self.run.results["warnings"])
        return warnings_of(self.run.results, self.machine, self.run.given)

    @property
    def shown(self) -> str:
        """Status as people see it: that of the run, or `undone` when an entry was taken back."""
        return "undone" if self.undone else self.status

    @property
    def may_be_entered(self) -> bool:
        """True if its errors can be entered on the control now, confirmed or not."""
        return self.status not in {"refused", "entered"} and not self.overtaken and bool(to_enter(self.run.results))


def warnings_of(results: Mapping[str, Any], machine: Machine, inputs: Mapping[str, Any]) -> list[CodedWarning]:
    """Return what is hardly plausible in the results of a run, by the limits of this machine.

    given: the run as it was sent; each warning names the field of it that the value came from.
    """
    bounds = AxisBounds(machine.plausible_axis_turn, machine.plausible_axis_shift)
    return [
        replace(warning, field=_field_of(str(warning.values["name"]), inputs))
        for warning in axis_warnings(values_of(results), bounds)
    ]


def _field_of(name: str, inputs: Mapping[str, Any]) -> str | None:
    """Return the field that a value such as EX0C or Q149 came from; None where the form has none of its own for it."""
    letter = AXIS_OF.get(name)
    if inputs.get("results"):
        string = next((string_name for string_name, axis in STRINGS.items() if axis == letter), None)
        return f"results.{string if name.startswith('E') else name}"
    for at, axis in enumerate(inputs.get("axes") or ()):
        if axis["axis"] == letter:
            return f"axes[{at}]"
    return next((form for form in ("axes", "shift", "pasted", "protocol") if inputs.get(form)), None)


def run(session: Session, number: int) -> RunRow:
    """One run. Raises `NotFound`."""
    row = (
        session.execute(
            select(KinematicsRun, Machine)
            .join(Machine, Machine.id == KinematicsRun.machine_id)
            .where(KinematicsRun.id == number)
        ).one_or_none()
        if 0 < number <= LARGEST_ID
        else None
    )
    if row is None:
        raise NotFound(
            _("There is no run {number} of the preset compensation.").format(number=number),
            _("Check the number; GET /api/v1/kinematics/runs lists them."),
        )
    return _rows(session, [(row[0], row[1])])[0]


def run_by_key(session: Session, machine: Machine, key: str) -> RunRow | None:
    """The run that was sent with this key, if there is one."""
    row = session.scalars(
        select(KinematicsRun).where(KinematicsRun.machine_id == machine.id, KinematicsRun.key == key)
    ).one_or_none()
    return None if row is None else _rows(session, [(row, machine)])[0]


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
    query = (
        select(KinematicsRun, Machine)
        .join(Machine, Machine.id == KinematicsRun.machine_id)
        .where(KinematicsRun.id > after)
        .order_by(KinematicsRun.id.desc() if newest_first else KinematicsRun.id)
        .limit(limit)
    )
    if machine_id is not None:
        query = query.where(KinematicsRun.machine_id == machine_id)
    if head is not None:
        query = query.where(KinematicsRun.head == head)
    if before is not None:
        query = query.where(KinematicsRun.id < before)
    return _rows(session, [(row[0], row[1]) for row in session.execute(query)])


def _rows(session: Session, runs_with_machines: Sequence[tuple[KinematicsRun, Machine]]) -> list[RunRow]:
    keys = [(run.machine_id, run.id) for run, _machine in runs_with_machines]
    decided: dict[int, dict[str, KinematicsDecision]] = {}
    if keys:
        places = tuple_(KinematicsDecision.machine_id, KinematicsDecision.run)
        for decision in session.scalars(select(KinematicsDecision).where(places.in_(keys))):
            decided.setdefault(decision.run, {})[decision.what] = decision
    heads = {(run.machine_id, run.head) for run, _machine in runs_with_machines}
    courses = {place: course(session, *place) for place in heads}
    return [
        _row(run, machine, decided.get(run.id, {}), courses[run.machine_id, run.head])
        for run, machine in runs_with_machines
    ]


def _row(
    run: KinematicsRun, machine: Machine, decisions: Mapping[str, KinematicsDecision], versions: list[KinematicsBackup]
) -> RunRow:
    now = versions[-1].errors if versions else {}
    path = {version.run for version in in_force(versions)}
    return RunRow(run, machine, decisions, not alike(now, run.in_effect), "entered" in decisions and run.id not in path)


def of_machine(session: Session, machine_id: int) -> list[KinematicsRun]:
    """The runs of a machine that count, in the order in which they were measured; of many the latest."""
    newest = (
        select(KinematicsRun)
        .where(KinematicsRun.machine_id == machine_id, KinematicsRun.outcome != "refused")
        .order_by(KinematicsRun.measured_at.desc(), KinematicsRun.id.desc())
        .limit(MOST_FOR_DRIFT)
    )
    return list(reversed(session.scalars(newest).all()))


def to_confirm(session: Session, machine: Machine, runs: Sequence[KinematicsRun]) -> set[int]:
    """Return the numbers of those runs that wait to be confirmed."""
    return {row.run.id for row in _rows(session, [(run, machine) for run in runs]) if row.status == "to_confirm"}


def is_latest(session: Session, run: KinematicsRun) -> bool:
    """Tell if no run that counts was measured later with this head."""
    later = select(KinematicsRun.id).where(
        KinematicsRun.machine_id == run.machine_id,
        KinematicsRun.head == run.head,
        KinematicsRun.outcome != "refused",
        tuple_(KinematicsRun.measured_at, KinematicsRun.id) > (run.measured_at, run.id),
    )
    return session.scalars(later.limit(1)).one_or_none() is None


def first_after(session: Session, machine_id: int, head: str, at: datetime) -> KinematicsRun | None:
    """The first run that counts which was measured with this head after a moment."""
    later = select(KinematicsRun).where(
        KinematicsRun.machine_id == machine_id,
        KinematicsRun.head == head,
        KinematicsRun.outcome != "refused",
        KinematicsRun.measured_at > at,
    )
    return session.scalars(later.order_by(KinematicsRun.measured_at, KinematicsRun.id).limit(1)).one_or_none()


def last_measured(session: Session, machine_id: int, head: str) -> datetime | None:
    """Time at which the last run that counts was measured with this head."""
    query = select(func.max(KinematicsRun.measured_at)).where(
        KinematicsRun.machine_id == machine_id, KinematicsRun.head == head, KinematicsRun.outcome != "refused"
    )
    return session.scalar(query)


def next_run(session: Session) -> int:
    """A number for a run."""
    return int(session.scalar(select(func.nextval("kinematics_run_id"))) or 0)


# --- the kinematics


def alike(one: Mapping[str, float], other: Mapping[str, float]) -> bool:
    """Tell if two kinematics hold the same values; a value that is not named is 0."""
    return all(isclose(one.get(name, 0.0), other.get(name, 0.0), abs_tol=SAME) for name in {*one, *other})


def course(session: Session, machine_id: int, head: str) -> list[KinematicsBackup]:
    """Every kinematics that was in effect with one head, oldest first."""
    query = select(KinematicsBackup).where(KinematicsBackup.machine_id == machine_id, KinematicsBackup.head == head)
    return list(session.scalars(query.order_by(KinematicsBackup.version)))


def in_force(versions: Sequence[KinematicsBackup]) -> list[KinematicsBackup]:
    """The versions that the last of them is made of: what was put back leads on from there, what was undone is not in it."""
    paths: dict[int, list[KinematicsBackup]] = {}
    path: list[KinematicsBackup] = []
    for version in versions:
        path = paths.get(version.restores or 0, [*path, version])
        paths[version.version] = path
    return path


def state_at(session: Session, machine_id: int, head: str, at: datetime | None) -> tuple[dict[str, float], int]:
    """Values entered with this head at a moment (None: now), by name of the error, and the version; 0: nothing."""
    versions = [version for version in course(session, machine_id, head) if at is None or version.since <= at]
    return (dict(versions[-1].errors), versions[-1].version) if versions else ({}, 0)


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
    """Values entered so far with this head, by name of the error."""
    newest = session.scalars(
        select(KinematicsBackup)
        .where(KinematicsBackup.machine_id == machine_id, KinematicsBackup.head == head)
        .order_by(KinematicsBackup.version.desc())
        .limit(1)
    ).one_or_none()
    return {} if newest is None else dict(newest.errors)


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
    row = session.get(KinematicsBackup, (machine.id, version)) if 0 < version <= LARGEST_SERIAL else None
    if row is None:
        raise NotFound(
            _("There is no back-up {version} of the kinematics of {machine}.").format(
                version=version, machine=machine.key
            ),
            _("GET …/backups lists them."),
        )
    return row


# --- what it is held against


def plan(session: Session, machine_id: int) -> KinematicsPlan:
    """Limits of a machine's runs; empty if nobody has set them."""
    row = session.get(KinematicsPlan, machine_id, populate_existing=True)
    return row or KinematicsPlan(machine_id=machine_id, limits={}, characteristics={})


def two_runs(session: Session, first: int, second: int) -> tuple[RunRow, RunRow]:
    """Two runs to be compared, the older first. Raises `NotFound`; `Invalid` for runs of two machines."""
    one, two = run(session, first), run(session, second)
    if one.machine.id != two.machine.id:
        raise Invalid.at(
            "with",
            _("run {a} is of {first}, run {b} of {second}").format(
                a=first, first=one.machine.key, b=second, second=two.machine.key
            ),
            do=_("Compare runs of one machine."),
        )
    return (one, two) if (one.run.measured_at, one.run.id) <= (two.run.measured_at, two.run.id) else (two, one)


def heads_of(session: Session, machine_id: int) -> dict[str, RunRow]:
    """The last run that counts with each head."""
    latest: dict[str, Any] = {}
    for run_of_machine in of_machine(session, machine_id):
        latest[run_of_machine.head] = run_of_machine
    machine = session.get_one(Machine, machine_id)
    rows = _rows(session, [(run_of_machine, machine) for run_of_machine in latest.values()])
    return {row.run.head: row for row in rows}
