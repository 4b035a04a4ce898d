"""Finding work zeros, computing them again, and watching fixtures. Lengths in mm.

Every verb locks the machine first: the zero may raise an alarm of it.
"""

from datetime import UTC, datetime
from typing import Any, NamedTuple

from sqlalchemy.orm import Session

from app.alarms import actions as alarms
from app.audit.actions import record as audit
from app.core.geometry.edges import Approach, Kind, Touch, Unfit
from app.core.geometry.points import Degenerate
from app.core.geometry.work_zero import Height, Shift, Zero, find_zero, four_records, judge_shift
from app.core.programs.frames import offset_of
from app.db.events import publish
from app.errors import Conflict, FieldError, Invalid
from app.machines.queries import lock_machines
from app.machines.tables import Machine
from app.people.callers import Caller
from app.readings import actions as readings
from app.readings import queries as reading_queries
from app.web.i18n import _
from app.zeros import queries, wording
from app.zeros.schemas import FixtureIn, RecomputeIn, ZeroIn
from app.zeros.tables import Fixture, WorkZero

SHIFTED = "fixture_shifted"
ASKED_ONCE = {"machine", "key", "touched_at", "fixture", "part", "work_offset", "kind", "characteristics"}
RESULTS = ("x", "y", "z", "diameter", "length", "width")


class Made(NamedTuple):
    """A work zero; again: it was sent before with the same key, and nothing happened now."""

    zero: WorkZero
    again: bool = False


def find(session: Session, machine: Machine, given: ZeroIn, caller: Caller) -> Made:
    """Find the work zero of these touches and keep it.

    Raises `Invalid` where they make none, `Conflict` for a key that was used otherwise.
    """
    lock_machines(session, [machine.id])
    offset = offset_of(machine.control, given.work_offset)
    if offset is None:
        wrong = _("{offset} is no work offset of this control").format(offset=repr(given.work_offset))
        raise Invalid(
            f"work_offset: {wrong}.",
            _("Sinumerik: G54 to G57, G505 to G599. Fanuc: G54 to G59, G54.1 P1 to P300. Others: preset 1 …"),
            errors=[FieldError("work_offset", wrong)],
        )
    kept = given.model_dump(exclude=ASKED_ONCE, exclude_none=True)
    if (before := _sent_before(session, machine, given, offset.word, kept)) is not None:
        return before
    now = datetime.now(UTC)
    made = WorkZero(
        machine_id=machine.id,
        kind=given.kind,
        fixture=given.fixture,
        work_offset=offset.word,
        part=given.part,
        touched_at=min(given.touched_at or now, now),  # by a clock that is ahead it would stay the newest for hours
        actor=caller.name,
        key=given.key,
        given=kept,
    )
    return Made(_keep(session, machine, made, given.characteristics, caller))


def _sent_before(session: Session, machine: Machine, given: ZeroIn, offset: str, kept: dict[str, Any]) -> Made | None:
    found = None if given.key is None else queries.by_key(session, machine, given.key)
    if found is None:
        return None
    if (found.given, found.kind, found.fixture, found.part, found.work_offset) == (
        kept,
        given.kind,
        given.fixture,
        given.part,
        offset,
    ):
        return Made(found, again=True)
    raise Conflict(
        _("Work zero {number} was sent with the key {key} already, and with other values.").format(
            number=found.id, key=repr(given.key)
        ),
        _("A key names one work zero for ever: use another one."),
        number=found.id,
    )


def recompute(session: Session, zero: WorkZero, given: RecomputeIn, caller: Caller) -> WorkZero:
    """The same touches once more; a new zero that stands in place of this one in the history of its fixture."""
    machine = session.get_one(Machine, zero.machine_id)
    lock_machines(session, [machine.id])
    later = queries.recomputed_as(session, zero)
    if later is not None:
        raise Conflict(
            _("Work zero {number} was computed again already: work zero {later}.").format(number=zero.id, later=later),
            _("Compute that one again."),
            number=later,
        )
    kept = dict(zero.given)
    if given.tip is not None:
        kept["tip"] = given.tip
    if given.repeatability is not None:
        kept["repeatability"] = given.repeatability
    if given.leave_out:
        touches = kept.get("touches") or []
        beyond = [at for at in given.leave_out if at > len(touches)]
        if beyond:
            wrong = _("there is no touch {at}").format(at=wording.numbers(beyond))
            raise Invalid(f"leave_out: {wrong}.", errors=[FieldError("leave_out", wrong)])
        kept["touches"] = [touch for at, touch in enumerate(touches, 1) if at not in given.leave_out]
    made = WorkZero(
        machine_id=machine.id,
        kind=zero.kind,
        fixture=zero.fixture,
        work_offset=zero.work_offset,
        part=zero.part,
        touched_at=zero.touched_at,
        actor=caller.name,
        given=kept,
        recomputed_from=zero.id,
    )
    stored = _keep(session, machine, made, None, caller)
    before, after = ({name: getattr(each, name) for name in RESULTS} for each in (zero, stored))
    audit(session, caller.name, "work zero computed again", f"work-zero/{zero.id}", before, after, given.reason)
    return stored


def _keep(
    session: Session, machine: Machine, made: WorkZero, characteristics: dict[Any, str] | None, caller: Caller
) -> WorkZero:
    found = _found(made.kind, made.given)
    for name in (*RESULTS, "rotation"):
        setattr(made, name, getattr(found, name))
    made.result = {
        "residuals": list(found.residuals),
        "uncertainty": found.uncertainty,
        "squareness": found.squareness,
        "notices": [notice.value for notice in found.notices],
    }
    settings = _fixture(session, machine, made.fixture)
    named = characteristics if characteristics is not None else settings.characteristics if settings else {}
    entries = reading_queries.entries_for_results(session, machine.id, {str(k): v for k, v in named.items()})
    session.add(made)
    session.flush()
    if made.recomputed_from is None:
        values = {name: value for name in RESULTS if (value := getattr(made, name)) is not None}
        source = readings.Source(f"work-zero:{made.id}", made.touched_at, made.part)
        readings.ask_for(session, entries, values, source)
        if caller.kind == "person":
            audit(session, caller.name, "work zero found", f"work-zero/{made.id}", None, values)
    changes: list[dict[str, Any]] = [
        {"kind": "work_zero", "machine": machine.key, "fixture": made.fixture, "id": made.id}
    ]
    changes += _watch(session, machine, made)
    publish(session, *changes)
    return made


def _touches(kind: str, given: dict[str, Any]) -> list[Touch]:
    if given.get("records"):
        return four_records(Kind(kind), *given["records"])
    return [
        Touch(each.get("x"), each.get("y"), Approach(each["approach"]) if each.get("approach") else None)
        for each in given.get("touches") or ()
    ]


def touches_of(kind: str, given: dict[str, Any]) -> list[dict[str, Any]]:
    """The touches that it was computed from, also where they came as records of a printed macro."""
    return [
        {"x": touch.x, "y": touch.y, "approach": touch.approach.value if touch.approach else None}
        for touch in _touches(kind, given)
    ]


def _found(kind: str, given: dict[str, Any]) -> Zero:
    """What the touches come to. Raises `Invalid` that names those that are wrong."""
    if given.get("touches") and given.get("records"):
        wrong = _("say touches or records, not both")
        raise Invalid(f"records: {wrong}.", _("Leave one of them out."), errors=[FieldError("records", wrong)])
    touches = _touches(kind, given)
    height = None
    if given.get("z_touched") is not None:
        height = Height(given["z_touched"], given.get("feeler", 0.0), given.get("tool_length", 0.0))
    try:
        return find_zero(Kind(kind), touches, given["tip"], height=height, repeatability=given.get("repeatability"))
    except Unfit as problem:
        wrong, remedy = wording.unfit(problem)
        at = problem.at
    except Degenerate as problem:
        wrong, remedy = wording.degenerate(problem)
        at = problem.at
    fields = [f"touches[{number - 1}]" for number in at] if at and not given.get("records") else ["touches"]
    if given.get("records"):
        fields = ["records"]
    raise Invalid(f"{fields[0]}: {wrong}.", remedy, errors=[FieldError(name, wrong) for name in fields])


# --- fixtures


def _fixture(session: Session, machine: Machine, key: str | None) -> Fixture | None:
    """The fixture, which the first zero that names it makes known."""
    if key is None:
        return None
    found = session.get(Fixture, (machine.id, key), populate_existing=True)
    if found is None:
        found = Fixture(machine_id=machine.id, key=key, basis="first", characteristics={})
        session.add(found)
        session.flush()
    return found


def _watch(session: Session, machine: Machine, zero: WorkZero) -> list[dict[str, Any]]:
    """Raise *fixture shifted*, or end it when the fixture is back; what live pages are told of it.

    The zero that was touched last tells. One that came in late or was computed again says nothing of today, but may take
    away what today's was too far from; one part in its place says nothing of another beside it, nor one axis of another.
    """
    if zero.fixture is None:
        return []
    settings = queries.settings_of(session, machine.id, zero.fixture)
    newest = queries.newest_by_offset(session, machine.id, zero.fixture)
    standing = {each.work_offset: queries.against(session, each, settings) for each in newest}
    last = standing[zero.work_offset]
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
    if active is None or any(each.state is Shift.ALARM for each in standing.values()):
        return []
    if last.reference != last.zero.id:  # an axis that was not touched again is where it was
        there = active.data["shifts"] | last.shifts
        if judge_shift(list(there.values()), None, settings.alarm) is Shift.ALARM:
            return []
    comment = _("Work zero {n} is within the limit").format(n=last.zero.id)
    outcome = {"code": "fixture_back", "number": last.zero.id}
    ended = alarms.settle_for_place(session, machine.id, SHIFTED, about, zero.actor, comment, outcome)
    return [] if ended is None else [alarms.news(machine.key, ended)]


def set_fixture(session: Session, row: queries.FixtureRow, given: FixtureIn, caller: Caller) -> Fixture:
    """What zeros of the fixture are compared with from now on. Raises `Invalid`."""
    lock_machines(session, [row.machine.id])
    errors = []
    if given.warning is not None and given.alarm is not None and given.warning > given.alarm:
        errors.append(FieldError("warning", _("must not be larger than the limit of the alarm")))
    if given.basis == "frozen":
        if given.reference is None:
            errors.append(FieldError("reference", _("say which work zero is frozen")))
        else:
            frozen = [
                each
                for each in queries.work_zeros(session, row.machine.id, row.key, after=given.reference - 1, limit=1)
                if each.id == given.reference
            ]
            if not frozen:
                wrong = _("this fixture has no work zero {n}").format(n=given.reference)
                errors.append(FieldError("reference", wrong))
    reading_queries.entries_for_results(session, row.machine.id, {str(k): v for k, v in given.characteristics.items()})
    if errors:
        raise Invalid(f"{errors[0].field}: {errors[0].message}.", _("Correct the named fields."), errors=errors)
    settings = _fixture(session, row.machine, row.key)
    assert settings is not None
    wanted = given.model_dump(exclude={"reason"})
    wanted["reference"] = given.reference if given.basis == "frozen" else None
    before = {name: getattr(settings, name) for name in wanted}
    for name, value in wanted.items():
        setattr(settings, name, value)
    session.flush()
    subject = f"fixture/{row.machine.key}/{row.key}"
    audit(session, caller.name, "fixture watched", subject, before, wanted, given.reason)
    told = [{"kind": "work_zero", "machine": row.machine.key, "fixture": row.key}]
    for last in queries.newest_by_offset(session, row.machine.id, row.key):
        told += _watch(session, row.machine, last)
    publish(session, *told)
    return settings
