"""Receivers of notifications, groups of them, routes to them, days off, what was announced to whom, and each delivery.

An active alarm and `Announced` say together what is still to be sent, so nothing is announced before it is committed, and a
server that ends in between sends it later. Changes for webhooks stand in the journal of events, in the order of the commits.
"""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, CheckConstraint, ForeignKey, Index, Sequence, func, text
from sqlalchemy.orm import Mapped, mapped_column

from app.core.notify import ENOUGH_FAILURES
from app.db.base import Base

RECEIVER_NUMBERS = Sequence("receiver_id", metadata=Base.metadata)
ROUTE_NUMBERS = Sequence("notification_route_id", metadata=Base.metadata)
GROUP_NUMBERS = Sequence("receiver_group_id", metadata=Base.metadata)
DELIVERY_NUMBERS = Sequence("delivery_id", metadata=Base.metadata)


class Receiver(Base):
    """A person's mail address or browsers, a webhook, or an address of apprise. Deleted ones stay, because deliveries name them."""

    __tablename__ = "receiver"
    __table_args__ = (
        CheckConstraint("means IN ('mail', 'webhook', 'apprise', 'browser')", name="means"),
        Index(
            "receiver_person_key",
            "person_id",
            "means",
            unique=True,
            postgresql_where=text("person_id IS NOT NULL AND deleted_at IS NULL"),
        ),
        {"postgresql_with": {"fillfactor": 50}},
    )

    id: Mapped[int] = mapped_column(BigInteger, primary_key=True, server_default=text("nextval('receiver_id')"))
    name: Mapped[str]
    means: Mapped[str]
    address: Mapped[str]
    secret: Mapped[str | None]  # a webhook's messages are signed with it
    person_id: Mapped[int | None] = mapped_column(ForeignKey("person.id"))  # whose own address or browsers it is
    quiet: Mapped[list[Any]] = mapped_column(server_default="[]")
    away_until: Mapped[datetime | None]
    events: Mapped[list[Any]] = mapped_column(server_default="[]")  # kinds of changes that a webhook gets
    cursor: Mapped[int] = mapped_column(BigInteger, server_default="0")  # the last event of the journal that it has
    failures: Mapped[int] = mapped_column(server_default="0")  # in a row
    failing_since: Mapped[datetime | None]  # the first of them
    failure: Mapped[str | None]  # the reason of the last of them
    reported: Mapped[dict[str, Any]] = mapped_column(
        server_default="{}"
    )  # when it learnt that others fail, by their numbers
    retry_at: Mapped[datetime | None]
    busy_until: Mapped[datetime | None]  # a delivery is under way; later than that it counts as lost
    last_at: Mapped[datetime | None]  # of the last message about alarms
    shift_report: Mapped[bool] = mapped_column(server_default="false")  # a mail at the end of each shift
    shift_reported: Mapped[datetime | None]  # the end of the last shift that is dealt with
    created_at: Mapped[datetime] = mapped_column(server_default=func.now())
    created_by: Mapped[str]
    deleted_at: Mapped[datetime | None]

    @property
    def fails(self) -> bool:
        """True if a person should look why. A browser that is closed shows nothing: that is no fault."""
        return self.failures >= ENOUGH_FAILURES and self.means != "browser"

    def works(self) -> None:
        """It does not fail, or no longer, as far as is known."""
        self.failures, self.retry_at, self.failing_since, self.failure = 0, None, None, None


class NotificationRoute(Base):
    """A route: `rule` is `schemas.Rule`."""

    __tablename__ = "notification_route"

    id: Mapped[int] = mapped_column(
        BigInteger, primary_key=True, server_default=text("nextval('notification_route_id')")
    )
    name: Mapped[str]
    enabled: Mapped[bool] = mapped_column(server_default="true")
    rule: Mapped[dict[str, Any]]
    created_at: Mapped[datetime] = mapped_column(server_default=func.now())
    created_by: Mapped[str]


class ReceiverGroup(Base):
    """Receivers that routes name together: `members` are their numbers, `rota` a list of `group_schemas.TurnIn`."""

    __tablename__ = "receiver_group"

    id: Mapped[int] = mapped_column(BigInteger, primary_key=True, server_default=text("nextval('receiver_group_id')"))
    name: Mapped[str]
    members: Mapped[list[Any]]
    rota: Mapped[list[Any]]
    created_at: Mapped[datetime] = mapped_column(server_default=func.now())
    created_by: Mapped[str]


class PlantCalendar(Base):
    """The days off of the plant, in one row: public holidays of a country or a part of it, and days of its own."""

    __tablename__ = "plant_calendar"
    __table_args__ = (CheckConstraint("id = 1", name="one"),)

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    country: Mapped[str | None]
    subdivision: Mapped[str | None]
    days: Mapped[list[Any]]
    changed_at: Mapped[datetime] = mapped_column(server_default=func.now())
    changed_by: Mapped[str]


class Announced(Base):
    """The last time that a receiver was notified of an alarm."""

    __tablename__ = "announced"
    __table_args__ = (Index("announced_at_idx", "at"),)

    alarm_id: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    receiver_id: Mapped[int] = mapped_column(ForeignKey("receiver.id"), primary_key=True, autoincrement=False)
    at: Mapped[datetime]


class Delivery(Base):
    """One attempt to deliver a message, and what was answered. alarms, changes: their numbers in it; receivers: those that fail.

    words: of a message that a browser shows, which fetches it; None for other means.
    """

    __tablename__ = "delivery"
    __table_args__ = (
        CheckConstraint("about IN ('alarms', 'changes', 'test', 'shift', 'receivers')", name="about"),
        CheckConstraint("state IN ('waiting', 'sending', 'delivered', 'failed', 'lost')", name="state"),
        Index("delivery_open_idx", "receiver_id", postgresql_where=text("state IN ('waiting', 'sending')")),
        Index("delivery_asked_idx", "asked_at"),
    )

    id: Mapped[int] = mapped_column(BigInteger, primary_key=True, server_default=text("nextval('delivery_id')"))
    receiver_id: Mapped[int] = mapped_column(ForeignKey("receiver.id"))
    about: Mapped[str]
    subject: Mapped[str]
    words: Mapped[str | None]
    alarms: Mapped[list[Any]] = mapped_column(server_default="[]")
    changes: Mapped[int] = mapped_column(server_default="0")
    receivers: Mapped[list[Any]] = mapped_column(server_default="[]")
    state: Mapped[str]
    asked_at: Mapped[datetime] = mapped_column(server_default=func.now())
    asked_by: Mapped[str | None]  # of a test
    ended_at: Mapped[datetime | None]
    answer: Mapped[str | None]
