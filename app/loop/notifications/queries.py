"""Queries of routes, receivers and deliveries. Never writes."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from datetime import timedelta
from typing import Any, NamedTuple

from sqlalchemy import func, or_, select
from sqlalchemy.orm import Session

from app.access.queries import hold_person
from app.errors import NotFound
from app.language.i18n import _
from app.loop.notifications.tables import Delivery, NotificationRoute, Receiver, ReceiverGroup


def routes(session: Session, after: int = 0, limit: int = 1000) -> Sequence[NotificationRoute]:
    """Routes, in the order in which they were added."""
    query = select(NotificationRoute).where(NotificationRoute.id > after).order_by(NotificationRoute.id).limit(limit)
    return session.scalars(query).all()


def route(session: Session, number: int, *, hold: bool = False) -> NotificationRoute:
    """One route. hold: until the transaction ends. Raises `NotFound`."""
    found = session.get(NotificationRoute, number, with_for_update=hold or None, populate_existing=True)
    if found is None:
        raise NotFound(_("There is no route {number}.").format(number=number), _("Choose one of the list."))
    return found


def hold_route(session: Session, given: Mapping[str, Any]) -> None:
    """Hold the route that is named until the transaction ends."""
    route(session, given["route"], hold=True)


def receivers(session: Session, after: int = 0, limit: int = 1000) -> Sequence[Receiver]:
    """Receivers, in the order in which they were added."""
    query = (
        select(Receiver).where(Receiver.deleted_at.is_(None), Receiver.id > after).order_by(Receiver.id).limit(limit)
    )
    return session.scalars(query).all()


def hold_receiver(session: Session, given: Mapping[str, Any]) -> None:
    """Hold the receiver that a route names until the transaction ends."""
    receiver(session, given["receiver"], hold=True)


def receiver(session: Session, number: int, *, hold: bool = False) -> Receiver:
    """One receiver that is not deleted. hold: until the transaction ends. Raises `NotFound`."""
    found = session.get(Receiver, number, with_for_update=hold or None, populate_existing=True)
    if found is None or found.deleted_at is not None:
        raise NotFound(_("There is no receiver {number}.").format(number=number), _("Choose one of the list."))
    return found


def own(session: Session, person_id: int | None, means: str = "mail") -> Receiver | None:
    """The mail address that a person has given, or their browsers; None without."""
    query = select(Receiver).where(
        Receiver.person_id == person_id, Receiver.means == means, Receiver.deleted_at.is_(None)
    )
    return session.scalars(query).one_or_none()


def hold_own(session: Session, given: Mapping[str, Any]) -> None:
    """Hold the caller until the transaction ends, and so the address and the browsers that this person has given or not."""
    hold_person(session, {"person": given["caller"].person_id})


def routes_to(session: Session, number: int) -> list[NotificationRoute]:
    """The routes that name a receiver."""
    return [row for row in routes(session) if number in receivers_of(row.rule)]


def receivers_of(rule: Mapping[str, Any]) -> set[int]:
    """The numbers of all receivers that a stored rule names."""
    return {number for step in rule["steps"] for number in step["receivers"]}


def check_receivers(session: Session, numbers: Iterable[int]) -> None:
    """Refuse numbers that no receiver has. Raises `NotFound`."""
    there = {row.id for row in receivers(session)}
    for number in sorted(set(numbers) - there):
        raise NotFound(_("There is no receiver {number}.").format(number=number), _("Choose one of the list."))


def groups(session: Session, after: int = 0, limit: int = 1000) -> Sequence[ReceiverGroup]:
    """Groups of receivers, in the order in which they were added."""
    query = select(ReceiverGroup).where(ReceiverGroup.id > after).order_by(ReceiverGroup.id).limit(limit)
    return session.scalars(query).all()


def group(session: Session, number: int, *, hold: bool = False) -> ReceiverGroup:
    """One group. hold: until the transaction ends. Raises `NotFound`."""
    found = session.get(ReceiverGroup, number, with_for_update=hold or None, populate_existing=True)
    if found is None:
        raise NotFound(_("There is no group {number}.").format(number=number), _("Choose one of the list."))
    return found


def hold_group(session: Session, given: Mapping[str, Any]) -> None:
    """Hold the group that is named until the transaction ends."""
    group(session, given["group"], hold=True)


def groups_of(rule: Mapping[str, Any]) -> set[int]:
    """The numbers of all groups that a stored rule names."""
    return {number for step in rule["steps"] for number in (*step.get("groups", ()), *step.get("on_duty", ()))}


def routes_to_group(session: Session, number: int) -> list[NotificationRoute]:
    """The routes that name a group."""
    return [row for row in routes(session) if number in groups_of(row.rule)]


def groups_with(session: Session, number: int) -> list[ReceiverGroup]:
    """The groups that a receiver is in."""
    return [row for row in groups(session) if number in row.members]


def names(session: Session, numbers: Collection[int]) -> dict[int, str]:
    """The names of receivers, deleted ones too."""
    return {
        row.id: row.name for row in session.execute(select(Receiver.id, Receiver.name).where(Receiver.id.in_(numbers)))
    }


def messages(session: Session, receiver_id: int) -> Sequence[Delivery]:
    """Messages of the last minute for somebody's browsers, the oldest first, those that one of them has shown too."""
    query = select(Delivery).where(
        Delivery.receiver_id == receiver_id,
        Delivery.state.in_(("sending", "delivered")),
        Delivery.words.is_not(None),
        func.coalesce(Delivery.ended_at, func.now()) > func.now() - timedelta(minutes=1),
    )
    return session.scalars(query.order_by(Delivery.id)).all()


class DeliveryRow(NamedTuple):
    """A delivery, and the name of its receiver."""

    delivery: Delivery
    receiver: str


def deliveries(
    session: Session,
    *,
    receiver_id: int | None = None,
    before: int | None = None,
    limit: int = 100,
    taken_changes: bool = True,
) -> list[DeliveryRow]:
    """Deliveries, the newest first. taken_changes: those of changes that a webhook has taken too, one every few seconds."""
    query = (
        select(Delivery, Receiver.name)
        .join(Receiver, Receiver.id == Delivery.receiver_id)
        .order_by(Delivery.id.desc())
        .limit(limit)
        .execution_options(populate_existing=True)
    )
    if receiver_id is not None:
        query = query.where(Delivery.receiver_id == receiver_id)
    if not taken_changes:
        query = query.where(or_(Delivery.about != "changes", Delivery.state.not_in(("sending", "delivered"))))
    if before is not None:
        query = query.where(Delivery.id < before)
    return [DeliveryRow(*row) for row in session.execute(query)]


def delivery(session: Session, number: int) -> Delivery:
    """One delivery. Raises `NotFound`."""
    found = session.get(Delivery, number)
    if found is None:
        raise NotFound(_("There is no delivery {number}.").format(number=number), _("It may be older than a month."))
    return found
