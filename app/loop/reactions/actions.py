"""Writing reaction plans, each change a version with its reason, and the catalogue of causes and corrective actions."""

from datetime import UTC, datetime
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.db.events import publish
from app.errors import Conflict, FieldError, Invalid, NotFound
from app.files.pictures import Picture
from app.language.i18n import _
from app.loop.alarm_response.reaction_queries import plans_in_force, scope_of
from app.loop.alarms.kinds import kinds
from app.loop.characteristics.queries import characteristic_named
from app.loop.notifications import queries as notifications
from app.loop.reactions import queries
from app.loop.reactions.schemas import CatalogueEntryIn, PlanFields, ReactionPlanIn
from app.loop.tables.reactions import PLAN_NUMBERS, CatalogueEntry, ReactionPicture, ReactionPlan
from app.web.created import Created

MOST_PLANS, MOST_ENTRIES, MOST_PICTURES = 500, 500, 2000
_CHANGED = {"kind": "reactions"}


def add_plan(session: Session, given: ReactionPlanIn, caller: Caller) -> ReactionPlan:
    """Write a plan. Raises `Invalid`, `NotFound` for what is not there; `Conflict` where these alarms have a plan."""
    queries.hold_plans(session)
    _check(session, given, None)
    if len(plans_in_force(session)) >= MOST_PLANS:
        raise Conflict(_("There are {n} reaction plans already.").format(n=MOST_PLANS), _("Withdraw one first."))
    number = session.scalars(select(PLAN_NUMBERS.next_value())).one()
    return _written(session, ReactionPlan(id=number, version=1, ended=False, **_fields(given)), caller, None)


def change_plan(session: Session, number: int, given: ReactionPlanIn, caller: Caller) -> ReactionPlan:
    """Write the next version of a plan; one that was withdrawn is in force again. Raises as `add_plan`."""
    queries.hold_plans(session)
    last = queries.plan(session, number)
    _check(session, given, number)
    made = ReactionPlan(id=number, version=last.version + 1, ended=False, **_fields(given))
    if not last.ended and _facts(last) == _facts(made):
        return last
    return _written(session, made, caller, last)


def withdraw_plan(session: Session, number: int, reason: str, caller: Caller) -> ReactionPlan:
    """Take a plan out of force, which is a version too. Raises `NotFound`, `Conflict` where it is withdrawn already."""
    queries.hold_plans(session)
    last = queries.plan(session, number)
    if last.ended:
        raise Conflict(
            _("{who} has withdrawn this plan already.").format(who=last.made_by), _("There is nothing left to do.")
        )
    values = {name: getattr(last, name) for name in PlanFields.model_fields} | {"reason": reason}
    return _written(session, ReactionPlan(id=number, version=last.version + 1, ended=True, **values), caller, last)


def _fields(given: ReactionPlanIn) -> dict[str, Any]:
    # a step without a picture is stored without one, as those were before there were any: the same makes no version
    return given.model_dump(mode="json") | {"steps": [step.model_dump(exclude_none=True) for step in given.steps]}


def _facts(row: ReactionPlan) -> dict[str, Any]:
    """A version as the record of changes has it."""
    return {name: getattr(row, name) for name in PlanFields.model_fields} | {"ended": row.ended}


def _check(session: Session, given: ReactionPlanIn, number: int | None) -> None:
    if given.kind is not None and given.kind not in {kind.name for kind in kinds()}:
        raise Invalid.at("kind", _("there is no kind of alarm {name}").format(name=repr(given.kind)))
    if given.characteristic is not None:
        characteristic_named(session, given.characteristic)
    there = {row.id for row in notifications.receivers(session)}
    for receiver in given.receivers:
        if receiver not in there:
            raise NotFound(_("There is no receiver {number}.").format(number=receiver), _("Choose one of the list."))
    named = {at: step.picture.digest for at, step in enumerate(given.steps) if step.picture is not None}
    missing = set(named.values()) - queries.pictures_there(session, named.values())
    if missing:
        wrong = _("there is no such picture; send it to /reactions/pictures first")
        places = [f"steps[{at}].picture.digest" for at, digest in named.items() if digest in missing]
        raise Invalid(f"{places[0]}: {wrong}.", errors=[FieldError(place, wrong) for place in places])
    scope = (given.characteristic, given.kind, given.rule)
    for other in plans_in_force(session):
        if other.id != number and scope_of(other) == scope:
            raise Conflict(
                _("The plan “{name}” is for the same alarms.").format(name=other.name),
                _("Change that plan, or say for which alarms this one is."),
            )


def _written(session: Session, row: ReactionPlan, caller: Caller, last: ReactionPlan | None) -> ReactionPlan:
    row.made_by = caller.name
    session.add(row)
    session.flush()
    session.refresh(row)
    done = "written" if last is None else "withdrawn" if row.ended else "changed"
    before = None if last is None else _facts(last)
    record(session, caller.name, f"reaction plan {done}", f"reaction-plan/{row.id}", before, _facts(row), row.reason)
    publish(session, _CHANGED)
    return row


# --- pictures


def add_picture(session: Session, picture: Picture, caller: Caller) -> Created[ReactionPicture]:
    """Keep a picture for steps to name; one that is there already is not kept twice. Raises `Conflict` at `MOST_PICTURES`."""
    queries.hold_plans(session)
    same = session.get(ReactionPicture, picture.digest)
    if same is not None:
        return Created(same, again=True)
    if (session.scalar(select(func.count()).select_from(ReactionPicture)) or 0) >= MOST_PICTURES:
        raise Conflict(_("There are {n} pictures already.").format(n=MOST_PICTURES), _("Use one of those."))
    values = picture.columns | {"made_by": caller.name}
    made = session.scalars(insert(ReactionPicture).values(values).returning(ReactionPicture)).one()
    about = {"digest": made.digest, "bytes": made.size, "media_type": made.media_type}
    record(session, caller.name, "picture added", f"reaction-picture/{made.digest[:12]}", None, about)
    return Created(made)


# --- the catalogue


def add_entry(session: Session, given: CatalogueEntryIn, caller: Caller) -> CatalogueEntry:
    """Add a cause or a corrective action. Raises `Conflict` where it has one of that name, or `MOST_ENTRIES`."""
    queries.hold_plans(session)
    every = queries.catalogue(session)
    if len(every) >= MOST_ENTRIES:
        raise Conflict(_("The catalogue has {n} entries already.").format(n=MOST_ENTRIES), _("Use one of those."))
    lower = session.scalars(select(func.lower(given.name))).one()
    same = select(CatalogueEntry).where(CatalogueEntry.sort == given.sort, func.lower(CatalogueEntry.name) == lower)
    if session.scalars(same).first() is not None:
        raise Conflict(
            _("The catalogue has “{name}” already.").format(name=given.name),
            _("Choose another name; one that is retired can be offered again."),
        )
    row = CatalogueEntry(sort=given.sort, name=given.name, made_by=caller.name)
    session.add(row)
    session.flush()
    session.refresh(row)
    record(session, caller.name, "catalogue entry added", f"catalogue/{row.id}", None, given.model_dump())
    publish(session, _CHANGED)
    return row


def retire_entry(session: Session, number: int, retired: bool, caller: Caller) -> CatalogueEntry:
    """Offer an entry no more, or again. Raises `NotFound`."""
    row = queries.entry(session, number, hold=True)
    if retired != (row.retired_at is not None):
        row.retired_at = datetime.now(UTC) if retired else None
        done = "retired" if retired else "offered again"
        record(session, caller.name, f"catalogue entry {done}", f"catalogue/{number}", None, {"name": row.name})
        publish(session, _CHANGED)
    return row
