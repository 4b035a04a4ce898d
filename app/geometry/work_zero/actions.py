"""Finding work zeros, computing them again, acknowledging warnings, and watching fixtures. Lengths in mm.

Every verb locks the machine first: the zero may raise an alarm of it.
"""

from datetime import UTC, datetime
from typing import Any

from sqlalchemy.orm import Session

from app.access.audit.actions import record as audit
from app.access.callers import Caller
from app.core.geometry.work_zero import Shift, judge_shift
from app.core.programs.frames import offset_of
from app.core.warning import as_stored
from app.db.events import publish
from app.errors import Conflict, FieldError, Invalid
from app.geometry.work_zero import queries
from app.geometry.work_zero.alarm_kinds import SHIFTED
from app.geometry.work_zero.evaluation import evaluated, warnings_in, warnings_of
from app.geometry.work_zero.schemas import FixtureIn, ZeroIn, ZeroRecomputeIn
from app.geometry.work_zero.tables import Fixture, WorkZero
from app.language.i18n import _
from app.loop.alarms import actions as alarms
from app.loop.machines.queries import lock_machines
from app.loop.readings import queries as reading_queries
from app.loop.readings import results_actions as readings
from app.loop.tables.machines import Machine
from app.loop.warnings import actions as warned
from app.web.created import Created, sent_before
from app.web.warnings import WarningsAcknowledgeIn

ASKED_ONCE = {"machine", "key", "touched_at", "fixture", "part", "work_offset", "kind", "characteristics"}
RESULTS = ("x", "y", "z", "diameter", "length", "width")


def find(session: Session, machine: Machine, body: ZeroIn, caller: Caller) -> Created[WorkZero]:
    """Find the work zero of these touches and keep it.

    Raises `Invalid` where they make none, `Conflict` for a key that was used otherwise.
    """
    lock_machines(session, [machine.id])
    offset = offset_of(machine.control, body.work_offset)
    if offset is None:
        raise Invalid.at(
            "work_offset",
            _("{offset} is no work offset of this control").format(offset=repr(body.work_offset)),
            do=_("Sinumerik: G54 to G57, G505 to G599. Fanuc: G54 to G59, G54.1 P1 to P300. Others: preset 1 …"),
        )
    inputs = body.model_dump(exclude=ASKED_ONCE, exclude_none=True)
    if body.key is not None and (before := queries.by_key(session, machine, body.key)) is not None:
        sent = (inputs, body.kind, body.fixture, body.part, offset.word)
        same = (before.given, before.kind, before.fixture, before.part, before.work_offset) == sent
        return sent_before(before, body.key, _("work zero"), same=same, number=before.id)
    now = datetime.now(UTC)
    zero = WorkZero(
        machine_id=machine.id,
        kind=body.kind,
        fixture=body.fixture,
        work_offset=offset.word,
        part=body.part,
        touched_at=min(body.touched_at or now, now),  # by a clock that is ahead it would stay the newest for hours
        actor=caller.name,
        key=body.key,
        given=inputs,
    )
    return Created(_keep(session, machine, zero, body.characteristics, caller))


def acknowledge(session: Session, zero: WorkZero, body: WarningsAcknowledgeIn, caller: Caller) -> None:
    """Take a work zero as it is, although there are warnings. Raises `Conflict`."""
    machine = session.get_one(Machine, zero.machine_id)
    warned.acknowledge(session, machine, queries.subject_of(zero), warnings_of(zero, machine), body.reason, caller)


def recompute(session: Session, zero: WorkZero, body: ZeroRecomputeIn, caller: Caller) -> WorkZero:
    """The same touches once more; a new zero that is in place of this one in the history of its fixture."""
    machine = session.get_one(Machine, zero.machine_id)
    lock_machines(session, [machine.id])
    later = queries.recomputed_as(session, zero)
    if later is not None:
        raise Conflict(
            _("Work zero {number} was computed again already: work zero {later}.").format(number=zero.id, later=later),
            _("Compute that one again."),
            number=later,
        )
    inputs = body.applied_to(zero.given)
    if body.tip is not None:
        inputs["tip"] = body.tip
    recomputed = WorkZero(
        machine_id=machine.id,
        kind=zero.kind,
        fixture=zero.fixture,
        work_offset=zero.work_offset,
        part=zero.part,
        touched_at=zero.touched_at,
        actor=caller.name,
        given=inputs,
        recomputed_from=zero.id,
    )
    stored = _keep(session, machine, recomputed, None, caller)
    before, after = ({name: getattr(zero_row, name) for name in RESULTS} for zero_row in (zero, stored))
    audit(session, caller.name, "work zero computed again", f"work-zero/{zero.id}", before, after, body.reason)
    return stored


def _keep(
    session: Session, machine: Machine, zero: WorkZero, characteristics: dict[Any, str] | None, caller: Caller
) -> WorkZero:
    solution = evaluated(zero.kind, zero.given)
    for name in (*RESULTS, "rotation"):
        setattr(zero, name, getattr(solution, name))
    zero.result = {
        "residuals": list(solution.residuals),
        "uncertainty": solution.uncertainty,
        "squareness": solution.squareness,
        "notices": [notice.value for notice in solution.notices],
    }
    settings = _fixture(session, machine, zero.fixture)
    before = queries.place_before(session, zero)
    zero.result |= {"warnings": as_stored(warnings_in(solution, zero, machine, before))}
    named = characteristics if characteristics is not None else settings.characteristics if settings else {}
    entries = reading_queries.entries_for_results(session, machine.id, {str(k): v for k, v in named.items()})
    session.add(zero)
    session.flush()
    if zero.recomputed_from is None:
        values = {name: value for name in RESULTS if (value := getattr(zero, name)) is not None}
        source = readings.Source(f"work-zero:{zero.id}", zero.touched_at, zero.part)
        readings.ask_for(session, entries, values, source)
        if caller.kind == "person":
            audit(session, caller.name, "work zero found", f"work-zero/{zero.id}", None, values)
    changes: list[dict[str, Any]] = [
        {"kind": "work_zero", "machine": machine.key, "fixture": zero.fixture, "id": zero.id}
    ]
    changes += _watch(session, machine, zero)
    publish(session, *changes)
    return zero


# --- fixtures


def _fixture(session: Session, machine: Machine, key: str | None) -> Fixture | None:
    """The fixture, which the first zero that names it makes known."""
    if key is None:
        return None
    fixture = session.get(Fixture, (machine.id, key), populate_existing=True)
    if fixture is None:
        fixture = Fixture(machine_id=machine.id, key=key, basis="first", characteristics={})
        session.add(fixture)
        session.flush()
    return fixture


def _watch(session: Session, machine: Machine, zero: WorkZero) -> list[dict[str, Any]]:
    """Raise *fixture shifted*, or end it when the fixture is back; what live pages hear of it.

    The zero that was touched last tells. One that came in late or was computed again says nothing of today, but may take
    away what today's was too far from; one part in its place says nothing of another beside it, nor one axis of another.
    """
    if zero.fixture is None:
        return []
    settings = queries.settings_of(session, machine.id, zero.fixture)
    newest = queries.newest_by_offset(session, machine.id, zero.fixture)
    comparisons = {newest_zero.work_offset: queries.against(session, newest_zero, settings) for newest_zero in newest}
    last = comparisons[zero.work_offset]
    about = {"memory": "fixture", "location": zero.fixture}
    if last.state is Shift.ALARM and last.zero.id == zero.id:
        data = about | {
            "shifts": last.shifts,
            "limit": settings.alarm,
            "zero": zero.id,
            "reference": last.reference,
        }
        return [alarms.news(machine.key, alarms.raise_for_place(session, machine.id, SHIFTED, data))]
    active = alarms.active_of_place(session, machine.id, SHIFTED, about)
    if active is None or any(newest_zero.state is Shift.ALARM for newest_zero in comparisons.values()):
        return []
    if last.reference != last.zero.id:  # an axis that was not touched again is where it was
        there = active.data["shifts"] | last.shifts
        if judge_shift(list(there.values()), None, settings.alarm) is Shift.ALARM:
            return []
    comment = _("Work zero {n} is within the limit").format(n=last.zero.id)
    outcome = {"code": "fixture_back", "number": last.zero.id}
    ended = alarms.settle(session, active, zero.actor, comment, outcome)
    return [] if ended is None else [alarms.news(machine.key, ended)]


def set_fixture(session: Session, row: queries.FixtureRow, body: FixtureIn, caller: Caller) -> Fixture:
    """Set the reference and the limits of a fixture's shift. Raises `Invalid`."""
    lock_machines(session, [row.machine.id])
    errors = []
    if body.warning is not None and body.alarm is not None and body.warning > body.alarm:
        errors.append(FieldError("warning", _("must not be larger than the limit of the alarm")))
    if body.basis == "frozen":
        if body.reference is None:
            errors.append(FieldError("reference", _("state the frozen work zero")))
        else:
            frozen = [
                zero
                for zero in queries.work_zeros(session, row.machine.id, row.key, after=body.reference - 1, limit=1)
                if zero.id == body.reference
            ]
            if not frozen:
                message = _("this fixture has no work zero {n}").format(n=body.reference)
                errors.append(FieldError("reference", message))
    reading_queries.entries_for_results(session, row.machine.id, {str(k): v for k, v in body.characteristics.items()})
    if errors:
        raise Invalid(f"{errors[0].field}: {errors[0].message}.", _("Correct the named fields."), errors=errors)
    settings = _fixture(session, row.machine, row.key)
    assert settings is not None
    wanted_settings = body.model_dump(exclude={"reason"})
    wanted_settings["reference"] = body.reference if body.basis == "frozen" else None
    before = {name: getattr(settings, name) for name in wanted_settings}
    for name, value in wanted_settings.items():
        setattr(settings, name, value)
    session.flush()
    subject = f"fixture/{row.machine.key}/{row.key}"
    audit(session, caller.name, "fixture watched", subject, before, wanted_settings, body.reason)
    events = [{"kind": "work_zero", "machine": row.machine.key, "fixture": row.key}]
    for last in queries.newest_by_offset(session, row.machine.id, row.key):
        events += _watch(session, row.machine, last)
    publish(session, *events)
    return settings
