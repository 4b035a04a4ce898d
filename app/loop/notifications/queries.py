"""Queries of routes, receivers and deliveries. Never writes."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from datetime import timedelta
from typing import Any, NamedTuple, NoReturn, TypeVar

from sqlalchemy import ColumnElement, func, or_, select
from sqlalchemy.orm import Session

from app.access.queries import hold_person
from app.errors import NotFound
from app.language.i18n import _
from app.loop.notifications.tables import Delivery, NotificationRoute, Receiver, ReceiverGroup

Row = TypeVar("Row", NotificationRoute, Receiver, ReceiverGroup)


def routes(session: Session, after: int = 0, limit: int | None = None) -> Sequence[NotificationRoute]:
    """Routes, in the order in which they were added."""
    return _rows(session, NotificationRoute, after, limit)


def receivers(session: Session, after: int = 0, limit: int | None = None) -> Sequence[Receiver]:
    """Receivers, in the order in which they were added."""
    return _rows(session, Receiver, after, limit, Receiver.deleted_at.is_(None))


def groups(session: Session, after: int = 0, limit: int | None = None) -> Sequence[ReceiverGroup]:
    """Groups of receivers, in the order in which they were added."""
    return _rows(session, ReceiverGroup, after, limit)


def _rows(
    session: Session, table: type[Row], after: int, limit: int | None, *only: ColumnElement[bool]
) -> Sequence[Row]:
    return session.scalars(select(table).where(*only, table.id > after).order_by(table.id).limit(limit)).all()


def route(session: Session, number: int, *, hold: bool = False) -> NotificationRoute:
    """One route. hold: until the transaction ends. Raises `NotFound`."""
    found = _row(session, NotificationRoute, number, hold)
    return found or _missing(_("There is no route {number}."), number)


def receiver(session: Session, number: int, *, hold: bool = False) -> Receiver:
    """One receiver that is not deleted. hold: until the transaction ends. Raises `NotFound`."""
    found = _row(session, Receiver, number, hold)
    return found if found and found.deleted_at is None else _missing(_("There is no receiver {number}."), number)


def group(session: Session, number: int, *, hold: bool = False) -> ReceiverGroup:
    """One group. hold: until the transaction ends. Raises `NotFound`."""
    return _row(session, ReceiverGroup, number, hold) or _missing(_("There is no group {number}."), number)


def _row(session: Session, table: type[Row], number: int, hold: bool) -> Row | None:
    return session.get(table, number, with_for_update=hold or None, populate_existing=True)


def _missing(words: str, number: int) -> NoReturn:
    raise NotFound(words.format(number=number), _("Choose one of the list."))


def own(session: Session, person_id: int | None, means: str = "mail") -> Receiver | None:
    """The mail address that a person has given, or their browsers; None without, and for a key, which is no person."""
    if person_id is None:
        return None
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
    if missing := set(numbers) - there:
        _missing(_("There is no receiver {number}."), min(missing))


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
    """Messages of the last minute for a person's browsers, the oldest first, those that one of them has shown too."""
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
