"""Routes, receivers and deliveries as JSON."""

import re
from collections.abc import Iterable
from datetime import datetime, time, timedelta
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BaseModel, Field, model_validator
from pydantic_core import PydanticCustomError

from app.core.notify import Hours, Route, Step
from app.language.i18n import _
from app.loop.notifications.failing_wording import what_to_look_at
from app.loop.notifications.tables import Delivery, NotificationRoute, Receiver
from app.web.fields import LARGEST_ID, Body, Moment, Slug, Text200, answer_from

Means = Literal["mail", "webhook", "apprise"]
"""Ways to receivers that an administrator adds."""
AnyMeans = Literal["mail", "webhook", "apprise", "browser"]
Tone = Literal["stop", "wear", "attention", "waiting", "steady"]
Changes = Literal["alarm", "reading", "correction", "tool"]


def _clock(text: str) -> str:
    if not re.fullmatch("([01][0-9]|2[0-3]):[0-5][0-9]", text):
        raise PydanticCustomError("clock", _("must be a time of the day, such as 06:00"))
    return text


Clock = Annotated[str, AfterValidator(_clock), Field(description="By the plant's clock, such as 06:00.")]
Minutes = Annotated[int, Field(strict=True, ge=0, le=7 * 24 * 60)]
Day = Annotated[int, Field(strict=True, ge=1, le=7)]


class HoursIn(Body):
    """A part of the week."""

    days: Annotated[list[Day], Field(min_length=1, max_length=7, description="1 Monday to 7 Sunday, when it begins.")]
    begins: Clock
    ends: Annotated[Clock, Field(description="On the next day where it is not after `begins`.")]

    def value(self) -> Hours:
        """As the core reads it."""
        return Hours(frozenset(self.days), time.fromisoformat(self.begins), time.fromisoformat(self.ends))


Week = Annotated[list[HoursIn], Field(max_length=20)]


Numbers = Annotated[list[Annotated[int, Field(strict=True, ge=1, le=LARGEST_ID)]], Field(max_length=50)]


class StepIn(Body):
    """Receivers and groups, and after how many minutes they are notified of an alarm that is still active."""

    after: Annotated[Minutes, Field(description="Minutes after the alarm.")] = 0
    receivers: Annotated[Numbers, Field(description="Numbers of receivers.")] = Field(default_factory=list)
    groups: Annotated[Numbers, Field(description="Numbers of groups: all of each.")] = Field(default_factory=list)
    on_duty: Annotated[
        Numbers,
        Field(description="Numbers of groups: who is on duty in each; where nobody is, the next step begins at once."),
    ] = Field(default_factory=list)

    @model_validator(mode="after")
    def _names_a_receiver(self) -> Self:
        if not (self.receivers or self.groups or self.on_duty):
            raise PydanticCustomError("nobody", _("must name at least one receiver or group"), {"at": "receivers"})
        return self

    def value(self) -> Step:
        """As the core reads it."""
        return Step(timedelta(minutes=self.after), tuple(self.receivers), tuple(self.groups), tuple(self.on_duty))


class Rule(Body):
    """The alarms of a route, when they go, and to whom. A list that is empty limits nothing."""

    kinds: Annotated[list[Slug], Field(max_length=100, description="Kinds of alarms, such as tool_worn.")] = Field(
        default_factory=list
    )
    tones: Annotated[list[Tone], Field(max_length=5, description="How urgent the alarms are.")] = Field(
        default_factory=list
    )
    machines: Annotated[list[Slug], Field(max_length=500, description="Keys of machines.")] = Field(
        default_factory=list
    )
    characteristics: Annotated[list[Slug], Field(max_length=500, description="Keys of characteristics.")] = Field(
        default_factory=list
    )
    hours: Annotated[Week, Field(description="When the route is open; always where empty.")] = Field(
        default_factory=list
    )
    on_days_off: Annotated[bool, Field(description="Open on days off too.")] = True
    urgent: Annotated[bool, Field(description="Through the quiet hours of receivers.")] = False
    repeat: Annotated[Minutes, Field(description="Minutes between reminders until it is acknowledged; 0: none.")] = 0
    digest: Annotated[Minutes, Field(description="Minutes that a first message waits for other alarms.")] = 0
    hold_off: Annotated[
        Minutes, Field(description="Minutes in which the same alarm, raised again, is not announced again.")
    ] = 5
    steps: Annotated[list[StepIn], Field(min_length=1, max_length=10, description="Who is notified, in order.")]

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        after = [step.after for step in self.steps]
        if after != sorted(after):
            raise PydanticCustomError("order", _("must come in the order of their minutes"), {"at": "steps"})
        return self

    def value(self) -> Route:
        """As the core reads it."""
        return Route(
            tuple(step.value() for step in self.steps),
            kinds=frozenset(self.kinds),
            tones=frozenset(self.tones),
            machines=frozenset(self.machines),
            characteristics=frozenset(self.characteristics),
            hours=week(self.hours),
            on_days_off=self.on_days_off,
            urgent=self.urgent,
            repeat=timedelta(minutes=self.repeat),
            digest=timedelta(minutes=self.digest),
            hold_off=timedelta(minutes=self.hold_off),
        )


def week(hours: Iterable[HoursIn]) -> tuple[Hours, ...]:
    """Parts of the week as the core reads them."""
    return tuple(each.value() for each in hours)


class RouteIn(Rule):
    """A route."""

    name: Text200
    enabled: Annotated[bool, Field(description="false: it notifies nobody.")] = True


class RouteOut(RouteIn):
    """A route as it is stored."""

    id: int
    created_at: datetime
    created_by: Annotated[str, Field(description="Who made it.")]

    @classmethod
    def of(cls, row: NotificationRoute) -> Self:
        """A route of the table."""
        return answer_from(cls, row, **row.rule)


class ReceiverIn(Body):
    """A receiver of notifications."""

    name: Text200
    means: Annotated[Means, Field(description="The way to it: mail, webhook or apprise.")]
    address: Annotated[
        str,
        Field(min_length=3, max_length=1000, description="A mail address, an address of the web, or one of apprise."),
    ]
    quiet: Annotated[Week, Field(description="Quiet hours: then only urgent routes reach it.")] = Field(
        default_factory=list
    )
    away_until: Annotated[Moment | None, Field(description="Nothing is sent before.")] = None
    events: Annotated[
        list[Changes],
        Field(max_length=4, description="A webhook gets these changes too, all of them, in their order."),
    ] = Field(default_factory=list)

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.events and self.means != "webhook":
            raise PydanticCustomError("events", _("go to webhooks only"), {"at": "events"})
        return self


class ReceiverChange(Body):
    """Changes of a receiver; what is left out stays."""

    name: Text200 | None = None
    address: Annotated[str | None, Field(min_length=3, max_length=1000, description="Of the same means.")] = None
    quiet: Annotated[Week | None, Field(description="Quiet hours: then only urgent routes reach it.")] = None
    away_until: Annotated[Moment | None, Field(description="Nothing is sent before; null: it is there.")] = None
    events: Annotated[list[Changes] | None, Field(max_length=4, description="Of a webhook.")] = None


AtEndOfShift = Annotated[
    bool, Field(description="A report by mail at the end of each shift in which something happened.")
]


class OwnAddressIn(Body):
    """One's own mail address for notifications."""

    address: Annotated[str, Field(min_length=3, max_length=320, description="A mail address.")]
    quiet: Annotated[Week, Field(description="Quiet hours: then only urgent routes reach it.")] = Field(
        default_factory=list
    )
    away_until: Annotated[Moment | None, Field(description="Nothing is sent before.")] = None
    shift_report: AtEndOfShift = False


class OwnBrowserIn(Body):
    """One's own browsers as a receiver."""

    quiet: Annotated[Week, Field(description="Quiet hours: then only urgent routes reach them.")] = Field(
        default_factory=list
    )
    away_until: Annotated[Moment | None, Field(description="Nothing is shown before.")] = None


class PageIn(Body):
    """The messages that an open page has shown."""

    shown: Annotated[Numbers, Field(description="Messages that it has shown: they count as delivered.")] = Field(
        default_factory=list
    )


class MessageOut(BaseModel):
    """A message that a page shows as a notification of its browser."""

    id: Annotated[int, Field(description="Number of the delivery.")]
    about: Annotated[Literal["alarms", "test", "receivers"], Field(description="Its content.")]
    subject: Annotated[str, Field(description="Its heading.")]
    words: Annotated[str, Field(description="What is wrong, and what to do.")]
    alarms: Annotated[list[int], Field(description="Numbers of the alarms in it.")]
    path: Annotated[
        str, Field(description="Page that it leads to, from the root of the plant.", examples=["/alarms/412"])
    ]

    @classmethod
    def of(cls, row: Delivery) -> Self:
        """A message of the table."""
        path = "/todo" if row.about == "receivers" else "/account/notifications"
        if row.about == "alarms":
            path = f"/alarms/{row.alarms[0]}" if len(row.alarms) == 1 else "/alarms"
        return answer_from(cls, row, path=path)


class MessagesOut(BaseModel):
    """Messages for an open page, the oldest first."""

    items: list[MessageOut]


class ReceiverOut(BaseModel):
    """A receiver of notifications."""

    id: int
    name: str
    means: Annotated[AnyMeans, Field(description="The way to it.")]
    address: Annotated[
        str, Field(description="Of apprise only the service: the rest is a secret. Of browsers empty: they fetch.")
    ]
    person: Annotated[int | None, Field(description="Number of the person whose own address or browsers it is.")]
    quiet: Annotated[list[HoursIn], Field(description="Quiet hours.")]
    away_until: Annotated[datetime | None, Field(description="Nothing is sent before.")]
    events: Annotated[list[Changes], Field(description="Changes that it gets as they happen.")]
    failures: Annotated[int, Field(description="Failures in a row; 0: the last message arrived.")]
    failing: Annotated[
        bool,
        Field(
            description="It fails: from four failures in a row on, and others are notified of it. Never of browsers."
        ),
    ]
    failing_since: Annotated[datetime | None, Field(description="The first of those failures.")]
    failure: Annotated[str | None, Field(description="What was answered the last time, or why it was not reached.")]
    what_to_do: Annotated[str | None, Field(description="The settings to look at; null where `failure` names them.")]
    retry_at: Annotated[datetime | None, Field(description="It is not tried again before.")]
    last_at: Annotated[datetime | None, Field(description="When a message about alarms was delivered last.")]
    shift_report: AtEndOfShift
    created_at: datetime
    created_by: Annotated[str, Field(description="Who added it.")]

    @classmethod
    def of(cls, row: Receiver) -> Self:
        """A receiver of the table, without its secret."""
        more = {"address": shown_address(row), "person": row.person_id, "failing": row.fails}
        return answer_from(cls, row, **more, what_to_do=(what_to_look_at(row) or None) if row.failures else None)


class NewReceiverOut(ReceiverOut):
    """A receiver just added."""

    secret: Annotated[
        str | None, Field(description="Of a webhook: its messages are signed with it. Shown this once; null otherwise.")
    ]


def shown_address(row: Receiver) -> str:
    """Its address as people may see it."""
    if row.means == "browser":
        return ""
    return f"{row.address.partition('://')[0]}://…" if row.means == "apprise" else row.address


class DeliveryOut(BaseModel):
    """An attempt to deliver a message."""

    id: int
    receiver: Annotated[int, Field(description="Number of the receiver.")]
    about: Annotated[Literal["alarms", "changes", "test", "shift", "receivers"], Field(description="Its content.")]
    subject: Annotated[str, Field(description="Its heading.")]
    alarms: Annotated[list[int], Field(description="Numbers of the alarms in it.")]
    changes: Annotated[int, Field(description="How many changes are in it.")]
    receivers: Annotated[list[int], Field(description="Numbers of the receivers that fail, which it reports.")]
    state: Annotated[
        Literal["waiting", "sending", "delivered", "failed", "lost"],
        Field(description="`lost`: the server ended meanwhile; it is sent again."),
    ]
    asked_at: Annotated[datetime, Field(description="When it was due.")]
    ended_at: Annotated[
        datetime | None, Field(description="When it was delivered, or given up; null: it is on its way.")
    ]
    answer: Annotated[str | None, Field(description="What the receiver's server answered, or why it was not reached.")]

    @classmethod
    def of(cls, row: Delivery) -> Self:
        """A delivery of the table."""
        return answer_from(cls, row, receiver=row.receiver_id)
