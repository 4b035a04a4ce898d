"""Setting up routes and receivers. Addresses and secrets never stand in the record of changes."""

import secrets
from collections.abc import Container, Iterable
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.db.events import publish
from app.db.tables import Event
from app.errors import Conflict, FieldError, Invalid, NotFound
from app.language.i18n import _
from app.loop.alarm_response.reaction_queries import plans_in_force
from app.loop.alarms.kinds import kinds
from app.loop.notifications import queries
from app.loop.notifications.addresses import Refused, check
from app.loop.notifications.schemas import OwnAddressIn, ReceiverChange, ReceiverIn, RouteIn
from app.loop.notifications.tables import Delivery, NotificationRoute, Receiver
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.machines import Machine
from app.settings import Settings

MOST_ROUTES, MOST_RECEIVERS = 200, 500


def note_change(
    session: Session,
    caller: Caller,
    action: str,
    subject: str,
    before: dict[str, Any] | None,
    after: dict[str, Any] | None,
) -> None:
    """Put a change into the record, and let open pages know."""
    record(session, caller.name, action, subject, before, after)
    publish(session, {"kind": "notifications"})


def add_route(session: Session, given: RouteIn, caller: Caller) -> NotificationRoute:
    """Add a route. Raises `Invalid` and `NotFound` for what is not there, `Conflict` where there are `MOST_ROUTES`."""
    _check_route(session, given)
    if len(queries.routes(session)) >= MOST_ROUTES:
        raise Conflict(_("There are {n} routes already.").format(n=MOST_ROUTES), _("Delete one first."))
    row = NotificationRoute(name=given.name, enabled=given.enabled, rule=_rule(given), created_by=caller.name)
    session.add(row)
    session.flush()
    note_change(session, caller, "route added", f"notification-route/{row.id}", None, given.model_dump(mode="json"))
    return row


def change_route(session: Session, number: int, given: RouteIn, caller: Caller) -> NotificationRoute:
    """Replace a route. Raises `NotFound`, and `Invalid` as `add_route`."""
    row = queries.route(session, number, hold=True)
    _check_route(session, given)
    before = _route_facts(row)
    row.name, row.enabled, row.rule = given.name, given.enabled, _rule(given)
    after = given.model_dump(mode="json")
    if before != after:
        note_change(session, caller, "route changed", f"notification-route/{number}", before, after)
    return row


def delete_route(session: Session, number: int, caller: Caller) -> None:
    """Delete a route. Raises `NotFound`."""
    row = queries.route(session, number, hold=True)
    before = _route_facts(row)
    session.delete(row)
    note_change(session, caller, "route deleted", f"notification-route/{number}", before, None)


def _route_facts(row: NotificationRoute) -> dict[str, Any]:
    """A route in the record of changes; what its stored rule is too old to name stands there as it is in effect."""
    return RouteIn(name=row.name, enabled=row.enabled, **row.rule).model_dump(mode="json")


def _rule(given: RouteIn) -> dict[str, Any]:
    return given.model_dump(mode="json", exclude={"name", "enabled"})


def _check_route(session: Session, given: RouteIn) -> None:
    """Refuse names that nothing has: such a route would wait for ever. Raises `Invalid`, and `NotFound` for a receiver or a group."""
    errors = _unknown("kinds", given.kinds, {kind.name for kind in kinds()}, _("there is no kind of alarm {name}"))
    for field, named, key, words in (
        ("machines", given.machines, Machine.key, _("there is no machine {name}")),
        ("characteristics", given.characteristics, Characteristic.key, _("there is no characteristic {name}")),
    ):
        known = set(session.scalars(select(key).where(key.in_(named)))) if named else set[str]()
        errors += _unknown(field, named, known, words)
    if errors:
        raise Invalid(f"{errors[0].field}: {errors[0].message}.", errors=errors)
    queries.check_receivers(session, queries.receivers_of(_rule(given)))
    for number in sorted(queries.groups_of(_rule(given))):
        queries.group(session, number, hold=True)


def _unknown(field: str, named: Iterable[str], known: Container[Any], words: str) -> list[FieldError]:
    return [FieldError(field, words.format(name=repr(each))) for each in named if each not in known]


# --- receivers


def add_receiver(session: Session, given: ReceiverIn, caller: Caller, settings: Settings) -> Receiver:
    """Add a receiver; a webhook gets a secret. Raises `Invalid` for an address that is not permitted, `Conflict`."""
    _permitted(given.means, given.address, settings)
    if len(queries.receivers(session)) >= MOST_RECEIVERS:
        raise Conflict(_("There are {n} receivers already.").format(n=MOST_RECEIVERS), _("Delete one first."))
    return added(session, caller, Receiver(**given.model_dump()))


def added(session: Session, caller: Caller, row: Receiver) -> Receiver:
    """Store a receiver, and its entry in the record of changes."""
    row.created_by = caller.name
    if row.means == "webhook":
        row.secret = secrets.token_urlsafe(32)
        row.cursor = _last_event(session)
    session.add(row)
    session.flush()
    session.refresh(row)
    note_change(session, caller, "receiver added", f"receiver/{row.id}", None, _facts(row))
    return row


def _last_event(session: Session) -> int:
    return session.scalar(select(func.max(Event.id))) or 0


def change_receiver(
    session: Session,
    number: int,
    change: ReceiverChange,
    caller: Caller,
    settings: Settings,
    before: dict[str, Any] | None = None,
) -> Receiver:
    """Change what is named. before: as it was, where something of it has changed already.

    Raises `NotFound`; `Invalid` for an address that is not permitted.
    """
    session.flush()
    row = queries.receiver(session, number, hold=True)
    before, named = before or _facts(row), change.model_fields_set
    if change.address is not None and row.means == "browser":
        raise Invalid.at("address", _("is not for browsers: an open page fetches"))
    if change.address is not None and change.address != row.address:
        _permitted(row.means, change.address, settings)
        row.address = change.address
        row.works()
    if change.events and row.means != "webhook":
        raise Invalid.at("events", _("go to webhooks only"))
    if change.events is not None:
        if not row.events:
            row.cursor = _last_event(session)
        row.events = list(change.events)
    if change.name is not None:
        row.name = change.name
    if change.quiet is not None:
        row.quiet = [each.model_dump() for each in change.quiet]
    if "away_until" in named:
        row.away_until = change.away_until
    session.flush()
    after = _facts(row)
    if before != after or change.address is not None:
        note_change(session, caller, "receiver changed", f"receiver/{number}", before, after)
    return row


def delete_receiver(session: Session, number: int, caller: Caller) -> None:
    """Delete a receiver. Raises `NotFound`; `Conflict` while a route, a group or a reaction plan names it."""
    row = queries.receiver(session, number, hold=True)
    used = queries.routes_to(session, number)
    if used:
        raise Conflict(
            _("The route “{name}” names this receiver.").format(name=used[0].name),
            _("Take it out of the route first, or delete the route."),
        )
    group = next(iter(queries.groups_with(session, number)), None)
    if group is not None:
        raise Conflict(
            _("This receiver is in the group “{name}”.").format(name=group.name), _("Take it out of the group first.")
        )
    named = next((plan for plan in plans_in_force(session) if number in plan.receivers), None)
    if named is not None:
        raise Conflict(
            _("The reaction plan “{name}” names this receiver.").format(name=named.name),
            _("Have it taken out of the plan first."),
        )
    row.deleted_at = datetime.now(UTC)
    row.secret = None
    note_change(session, caller, "receiver deleted", f"receiver/{number}", _facts(row), None)


def _permitted(means: str, address: str, settings: Settings) -> None:
    try:
        check(means, address, settings)
    except Refused as error:
        raise Invalid.at("address", str(error)) from None


def _facts(row: Receiver) -> dict[str, Any]:
    """A receiver in the record of changes; addresses of the web hold secrets of their services."""
    return {
        "name": row.name,
        "means": row.means,
        "quiet": row.quiet,
        "away_until": row.away_until.isoformat() if row.away_until else None,
        "events": row.events,
    } | ({"shift_report": row.shift_report} if row.person_id is not None else {})


# --- one's own address


def set_own(session: Session, given: OwnAddressIn, caller: Caller, settings: Settings) -> Receiver:
    """Say where the caller gets mail. Raises `NotFound` for a key, which is no person; `Invalid`."""
    if caller.person_id is None:
        raise NotFound(_("A key is no person and has no mail address."), _("Sign in as a person."))
    queries.hold_own(session, {"caller": caller})  # of two at once, one comes second
    row = queries.own(session, caller.person_id)
    reported = datetime.now(UTC) if given.shift_report else None
    if row is not None:
        if given.shift_report and not row.shift_report:
            row.shift_reported = reported
        before, row.shift_report = _facts(row), given.shift_report
        change = ReceiverChange(address=given.address, quiet=given.quiet, away_until=given.away_until)
        return change_receiver(session, row.id, change, caller, settings, before)
    _permitted("mail", given.address, settings)
    mine: dict[str, Any] = {"name": caller.name, "means": "mail", "person_id": caller.person_id}
    return added(session, caller, Receiver(**mine, shift_reported=reported, **given.model_dump()))


def delete_own(session: Session, caller: Caller) -> None:
    """Forget where the caller gets mail. Raises `NotFound`, and `Conflict` as `delete_receiver`."""
    row = queries.own(session, caller.person_id)
    if row is None:
        raise NotFound(_("You have given no mail address."), _("There is nothing to delete."))
    delete_receiver(session, row.id, caller)


# --- tests


def ask_for_test(session: Session, number: int, caller: Caller) -> Delivery:
    """Send a test within seconds; one that waits already is answered again. Raises `NotFound`."""
    queries.receiver(session, number, hold=True)
    waiting = select(Delivery).where(Delivery.receiver_id == number, Delivery.state == "waiting")
    row = session.scalars(waiting).first()
    if row is None:
        row = Delivery(
            receiver_id=number, about="test", subject=_("Inband: test"), state="waiting", asked_by=caller.name
        )
        session.add(row)
        session.flush()
        session.refresh(row)
        record(session, caller.name, "test sent", f"receiver/{number}")
        publish(session, {"kind": "delivery", "id": row.id})
    return row
