"""Taking runs, confirming them, entering them on the control, putting a kinematics back. Lengths in mm, angles in degrees.

Every verb locks the machine first: of two who enter at once one wins, and the other is informed.
"""

from datetime import UTC, datetime
from typing import Any

from sqlalchemy.orm import Session

from app.access.audit.actions import record as audit
from app.access.callers import Caller
from app.core.decision.limits import nanometres
from app.core.decision.step import rounded
from app.core.warning import as_stored
from app.db.events import publish
from app.errors import Conflict, Invalid
from app.files.formats.cell_values import Unreadable, moment, zone_named
from app.files.formats.rotary_protocol import Protocol
from app.geometry.rotary_axes import queries, refusals, wording
from app.geometry.rotary_axes.alarm_kinds import DRIFT
from app.geometry.rotary_axes.evaluation import evaluate
from app.geometry.rotary_axes.outcome import Evaluated, Limits
from app.geometry.rotary_axes.queries import RunRow
from app.geometry.rotary_axes.result_values import AXIS_OF, as_reading, errors_of, to_enter, values_of
from app.geometry.rotary_axes.schemas import KinematicsPlanIn, RunIn
from app.geometry.rotary_axes.tables import KinematicsBackup, KinematicsDecision, KinematicsPlan, KinematicsRun
from app.language.i18n import _
from app.language.times import plant_zone
from app.loop.alarms import actions as alarms
from app.loop.machines.queries import lock_machines
from app.loop.readings import queries as reading_queries
from app.loop.readings import results_actions as readings
from app.loop.tables.machines import Machine
from app.web.created import Created, sent_before
from app.web.fields import AHEAD, EARLIEST

SETTINGS = ("ball_radius", "max_modification", "max_modification_angle", "max_dev_cal_ball")


def take(
    session: Session, machine: Machine, body: RunIn, caller: Caller, protocol: Protocol | None = None
) -> Created[RunRow]:
    """Evaluate a run and keep it; a refused one is kept as well and counts for nothing.

    protocol: that of the run, where it is read already. Raises `Invalid` for what determines nothing; `Conflict` for a key that was used otherwise.
    """
    lock_machines(session, [machine.id])
    sent = body.model_dump(mode="json", exclude={"machine", "key", "confirm"}, exclude_none=True)
    if body.key is not None and (before := queries.run_by_key(session, machine, body.key)) is not None:
        # Another time is no other run, as for readings: a client may say the same one by the clock of another zone.
        same = before.run.given | {"measured_at": None} == sent | {"measured_at": None}
        return sent_before(before, body.key, _("run"), same=same, run=before.run.id)
    plan = queries.plan(session, machine.id)
    limits = limits_of(plan)
    evaluated = evaluate(body, limits, protocol)
    warnings = [] if evaluated.outcome == "refused" else queries.warnings_of(evaluated.results, machine, sent)
    head = body.head or ""
    stated_time = body.measured_at or _said_time(evaluated, body.timezone)
    in_effect, version = queries.state_at(session, machine.id, head, stated_time)
    run = KinematicsRun(
        machine_id=machine.id,
        id=queries.next_run(session),
        form=evaluated.form,
        head=head,
        measured_at=stated_time or datetime.now(UTC),
        actor=caller.name,
        key=body.key,
        given=sent,
        limits={name: getattr(limits, name) for name in SETTINGS},
        outcome=evaluated.outcome,
        reason=evaluated.reason,
        results=evaluated.results | {"head": evaluated.head, "warnings": as_stored(warnings)},
        in_effect=in_effect,
        version=version,
    )
    session.add(run)
    session.flush()
    if (run.outcome == "too_large" or warnings) and body.confirm is not None and caller.may("operator"):
        _decide(session, run, "confirmed", body.confirm, caller)
    changes = [news(machine, run)]
    if run.outcome != "refused":
        changes += _watch(session, machine, plan, run)
        _to_readings(session, plan, run)
    if caller.kind == "person":
        after = {"outcome": run.outcome, "form": run.form} | errors_of(run.results)
        audit(session, caller.name, "kinematics measured", f"kinematics-run/{run.id}", None, after)
    publish(session, *changes)
    return Created(queries.run(session, run.id))


def limits_of(plan: KinematicsPlan) -> Limits:
    return Limits(*(getattr(plan, name) for name in SETTINGS))


def _said_time(evaluated: Evaluated, timezone: str | None) -> datetime | None:
    """Time of the protocol. Clocks of controls know no zone: it is stated, or taken for the plant's."""
    text = evaluated.head.get("created")
    if text is None:
        return None
    try:
        time = moment(text, zone_named(timezone) if timezone else plant_zone()).astimezone(UTC)
    except Unreadable as error:
        evaluated.results["notes"].append(_("the time “{text}” {why}").format(text=text[:60], why=error))
        return None
    if not EARLIEST <= time <= datetime.now(UTC) + AHEAD:
        evaluated.results["notes"].append(
            _("the time {text} is impossible; the time of receipt is used").format(text=text[:60])
        )
        return None
    return time


def _watch(session: Session, machine: Machine, plan: KinematicsPlan, run: KinematicsRun) -> list[dict[str, Any]]:
    """Hold the values against their limits: raise the alarm, or end it. What came in late says nothing of today."""
    values, changes = values_of(run.results), []
    if not queries.is_latest(session, run):
        return []
    for name, limit in plan.limits.items():
        if name not in values:
            continue
        if nanometres(abs(values[name])) > nanometres(limit):
            data = _place(name, run.head) | {"value": values[name], "limit": limit, "run": run.id}
            changes.append(alarms.news(machine.key, alarms.raise_for_place(session, machine.id, DRIFT, data)))
        else:
            changes += _settle(session, machine, name, run)
    return changes


def _place(name: str, head: str) -> dict[str, Any]:
    """Subject of an alarm: a value, of one head."""
    return {"memory": "kinematics", "location": f"{name} {head}".rstrip(), "name": name, "head": head}


def _settle(session: Session, machine: Machine, name: str, run: KinematicsRun, actor: str = "") -> list[dict[str, Any]]:
    active = alarms.active_of_place(session, machine.id, DRIFT, _place(name, run.head))
    comment, outcome = _("Run {number}").format(number=run.id), {"code": "kinematics_run", "number": run.id}
    ended = alarms.settle(session, active, actor or run.actor, comment, outcome)
    return [] if ended is None else [alarms.news(machine.key, ended)]


def _to_readings(session: Session, plan: KinematicsPlan, run: KinematicsRun) -> None:
    """Values that are characteristics become readings, by the door that all readings take."""
    if not plan.characteristics:
        return
    entries = reading_queries.entries_for_results(session, run.machine_id, plan.characteristics)
    values = {name: as_reading(name, value) for name, value in values_of(run.results).items()}
    source = readings.Source(f"kinematics:{run.id}", run.measured_at)
    readings.ask_for(session, entries, values, source)


def confirm(session: Session, number: int, reason: str, caller: Caller) -> RunRow:
    """A change larger than permitted is meant, or warnings are seen and it is right. Raises `NotFound`; `Conflict` when nothing is to be confirmed."""
    lock_machines(session, [queries.run(session, number).machine.id])
    row = queries.run(session, number)
    if row.status != "to_confirm":
        raise Conflict(*wording.cannot_confirm(row))
    _decide(session, row.run, "confirmed", reason, caller)
    after = row.run.reason | {"warnings": [warning.code for warning in row.warnings]}
    audit(session, caller.name, "kinematics confirmed", f"kinematics-run/{number}", None, after, reason)
    publish(session, news(row.machine, row.run))
    return queries.run(session, number)


def enter(
    session: Session, number: int, reason: str, caller: Caller, *, offsets: bool = False, at: datetime | None = None
) -> RunRow:
    """The position errors of the run have been entered on the control: the kinematics before and after are kept.

    offsets: Q147 to Q149 as well; of a run of the ball alone they are always meant. at: when it was done, if not now.
    Raises `NotFound`; `Invalid` for a time that cannot be; `Conflict` when the run is refused, waits to be confirmed, was
    entered, or was overtaken.
    """
    lock_machines(session, [queries.run(session, number).machine.id])
    row = queries.run(session, number)
    if row.status == "to_confirm" or not row.may_be_entered:
        raise Conflict(*wording.cannot_enter(row), run_status=row.status)
    run, machine = row.run, row.machine
    if at is not None:
        _could_be(session, run, at)
    before, version = queries.state_at(session, machine.id, run.head, None)
    entered = to_enter(run.results, offsets=offsets)
    after = before | {name: rounded(before.get(name, 0.0) + value) for name, value in entered.items()}
    if version == 0:  # the kinematics that the machine came with has no back-up yet
        words = _("As it was before run {number}").format(number=number)
        _keep(session, machine, KinematicsBackup(head=run.head, reason=words, errors=before), caller, at)
    backup = KinematicsBackup(head=run.head, reason=reason, errors=after, run=number)
    _keep(session, machine, backup, caller, at)
    _decide(session, run, "entered", reason, caller)
    changes = [news(machine, run)]
    axes = {AXIS_OF.get(name) for name in entered}
    for name in queries.plan(session, machine.id).limits:
        if name in entered or (name in AXIS_OF and name.startswith("E") and AXIS_OF[name] in axes):
            changes += _settle(session, machine, name, run, caller.name)
    audit(
        session, caller.name, "kinematics changed", f"kinematics/{machine.key}/{backup.version}", before, after, reason
    )
    publish(session, *changes)
    return queries.run(session, number)


def _could_be(session: Session, run: KinematicsRun, at: datetime) -> None:
    """Raises `Invalid` for an entry before its run, before the one before it, ahead, or unknown to a run after it."""
    versions = queries.course(session, run.machine_id, run.head)
    later = queries.first_after(session, run.machine_id, run.head, at)
    wrong = None
    if at < run.measured_at:
        wrong = _("run {number} was measured later").format(number=run.id)
    elif at > datetime.now(UTC):
        wrong = _("this time is in the future")
    elif versions and at < versions[-1].since:
        wrong = _("the kinematics was changed later, by version {version}").format(version=versions[-1].version)
    elif later is not None:
        wrong = _("run {number} was measured after that, and was received without the entry").format(number=later.id)
    if wrong is not None:
        raise Invalid.at("at", wrong, do=_("Leave it out if it was just now."))


def undo(session: Session, number: int, reason: str, caller: Caller) -> RunRow:
    """Take back what was entered because of a run: the kinematics before it is put back, as a new version.

    Raises `NotFound`; `Conflict` when it was not entered, was undone, or something entered later is on it.
    """
    lock_machines(session, [queries.run(session, number).machine.id])
    row = queries.run(session, number)
    path = queries.in_force(queries.course(session, row.machine.id, row.run.head))
    at = next((place for place, step in enumerate(path) if step.run == number), None)
    if at is None:
        raise Conflict(*refusals.cannot_undo(row), run_status=row.status)
    if at != len(path) - 1:
        later = [step.run for step in path[at + 1 :] if step.run is not None]
        raise Conflict(*refusals.stands_below(row, later, path[at - 1].version), later=later)
    restore(session, row.machine, path[at - 1].version, reason, caller)
    publish(session, news(row.machine, row.run))
    return queries.run(session, number)


def restore(
    session: Session, machine: Machine, version: int, reason: str, caller: Caller, *, instead_of: int | None = None
) -> KinematicsBackup:
    """Put a kinematics back that was in effect before; that is a new version.

    instead_of: the version that was seen in effect. Raises `NotFound`; `Conflict` if it is in effect, or another than
    was seen.
    """
    lock_machines(session, [machine.id])
    old = queries.backup(session, machine, version)
    now = queries.course(session, machine.id, old.head)[-1]
    if queries.alike(now.errors, old.errors):
        raise Conflict(*refusals.is_in_effect(old, now), version=now.version)
    if instead_of is not None and instead_of != now.version:
        raise Conflict(*refusals.changed_meanwhile(instead_of, now), version=now.version)
    backup = KinematicsBackup(head=old.head, reason=reason, errors=dict(old.errors), restores=version)
    _keep(session, machine, backup, caller)
    subject = f"kinematics/{machine.key}/{backup.version}"
    audit(session, caller.name, "kinematics put back", subject, dict(now.errors), backup.errors, reason)
    publish(session, {"kind": "kinematics", "machine": machine.key})
    return backup


def _keep(
    session: Session, machine: Machine, backup: KinematicsBackup, caller: Caller, at: datetime | None = None
) -> None:
    backup.machine_id, backup.actor = machine.id, caller.name
    backup.version = queries.next_version(session, machine.id)
    backup.at = datetime.now(UTC)
    backup.since = at or queries.last_measured(session, machine.id, backup.head) or backup.at
    session.add(backup)
    session.flush()


def _decide(session: Session, run: KinematicsRun, what: str, reason: str, caller: Caller) -> None:
    session.add(KinematicsDecision(machine_id=run.machine_id, run=run.id, what=what, actor=caller.name, reason=reason))
    session.flush()


def recompute(session: Session, number: int) -> tuple[RunRow, Evaluated]:
    """A run evaluated again from what was sent, with the limits of then; what is on record stays as it is."""
    row = queries.run(session, number)
    body = RunIn.model_validate({"machine": row.machine.key, **row.run.given})
    return row, evaluate(body, Limits(**row.run.limits))


def set_plan(session: Session, machine: Machine, body: KinematicsPlanIn, caller: Caller) -> KinematicsPlan:
    """Set the limits of a machine's runs. Raises `Invalid` for a characteristic that this machine has not."""
    lock_machines(session, [machine.id])
    reading_queries.entries_for_results(session, machine.id, body.characteristics)
    settings = body.model_dump(exclude={"reason"})
    plan = session.get(KinematicsPlan, machine.id, populate_existing=True)
    before = None if plan is None else {name: getattr(plan, name) for name in settings}
    if plan is None:
        plan = KinematicsPlan(machine_id=machine.id)
        session.add(plan)
    for name, value in settings.items():
        setattr(plan, name, value)
    session.flush()
    audit(session, caller.name, "kinematics planned", f"kinematics-plan/{machine.key}", before, settings, body.reason)
    publish(session, {"kind": "kinematics", "machine": machine.key})
    return plan


def news(machine: Machine, run: KinematicsRun) -> dict[str, Any]:
    """Event for live pages."""
    return {"kind": "kinematics", "machine": machine.key, "run": run.id}
