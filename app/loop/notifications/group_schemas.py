"""Groups of receivers as JSON, and who of them is on duty."""

from collections.abc import Sequence
from datetime import date, datetime, time
from typing import Annotated, Self

from pydantic import BaseModel, Field, model_validator
from pydantic_core import PydanticCustomError

from app.core.notify import Group, Hours, Turn
from app.language.i18n import _
from app.language.times import local, plant_shifts, plant_zone
from app.loop.notifications.schemas import Clock, Day, Numbers
from app.loop.notifications.tables import ReceiverGroup
from app.web.fields import Body, Text200, answer_from

EVERY_DAY = [1, 2, 3, 4, 5, 6, 7]
LOOKED_AHEAD = 7  # days


class TurnIn(Body):
    """A part of a rota: who is on duty in a shift of the plant, or in hours; all day without either."""

    receivers: Annotated[Numbers, Field(min_length=1, description="Numbers of receivers on duty.")]
    days: Annotated[
        list[Day], Field(min_length=1, max_length=7, description="1 Monday to 7 Sunday, when it begins.")
    ] = Field(default_factory=lambda: EVERY_DAY)
    shift: Annotated[Clock | None, Field(description="The shift of the plant that begins then; it ends with it.")] = (
        None
    )
    begins: Annotated[Clock | None, Field(description="In place of a shift.")] = None
    ends: Annotated[Clock | None, Field(description="On the next day where it is not after `begins`.")] = None
    first: Annotated[date | None, Field(description="The first day on which it begins.")] = None
    last: Annotated[date | None, Field(description="The last day on which it begins.")] = None

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if (self.begins is None) != (self.ends is None):
            raise PydanticCustomError("hours", _("needs a beginning and an end"), {"at": "begins"})
        if self.shift is not None and self.begins is not None:
            raise PydanticCustomError("shift", _("either a shift or hours"), {"at": "shift"})
        if self.first is not None and self.last is not None and self.last < self.first:
            raise PydanticCustomError("last", _("must not be before the first day"), {"at": "last"})
        return self

    def value(self, shifts: Sequence[time]) -> Turn | None:
        """As the core reads it; None: the plant has no shift that begins then."""
        begins, ends = time.fromisoformat(self.begins or "00:00"), time.fromisoformat(self.ends or "00:00")
        if self.shift is not None:
            begins = time.fromisoformat(self.shift)
            if begins not in shifts:
                return None
            ends = shifts[(list(shifts).index(begins) + 1) % len(shifts)]
        return Turn(tuple(self.receivers), Hours(frozenset(self.days), begins, ends), self.first, self.last)


class GroupIn(Body):
    """Receivers that routes name together, and their rota."""

    name: Text200
    members: Annotated[Numbers, Field(min_length=1, description="Numbers of receivers.")]
    rota: Annotated[list[TurnIn], Field(max_length=100, description="Who is on duty and when; empty: nobody is.")] = (
        Field(default_factory=list)
    )

    @model_validator(mode="after")
    def _of_members(self) -> Self:
        for turn in self.rota:
            if not set(turn.receivers) <= set(self.members):
                raise PydanticCustomError("members", _("names a receiver that is not in the group"), {"at": "rota"})
        return self

    def value(self, shifts: Sequence[time]) -> Group:
        """As the core reads it."""
        return Group(tuple(self.members), tuple(filter(None, (turn.value(shifts) for turn in self.rota))))


def group_of(row: ReceiverGroup) -> Group:
    """A stored group as the core reads it, with the shifts of the plant as they are now."""
    return GroupIn(name=row.name, members=row.members, rota=row.rota).value(plant_shifts())


class GroupOut(GroupIn):
    """A group as it is stored."""

    id: int
    created_at: datetime
    created_by: Annotated[str, Field(description="Who made it.")]

    @classmethod
    def of(cls, row: ReceiverGroup) -> Self:
        """A group of the table."""
        return answer_from(cls, row)


class UnattendedOut(BaseModel):
    """A time in which nobody of a group is on duty."""

    begins: Annotated[datetime, Field(description="By the plant's clock.")]
    ends: Annotated[datetime, Field(description="By the plant's clock.")]


class DutyOut(BaseModel):
    """The receivers of a group that are on duty now, and when nobody is."""

    group: Annotated[int, Field(description="Number of the group.")]
    receivers: Annotated[list[int], Field(description="Their numbers; empty: nobody is on duty.")]
    unattended: Annotated[
        list[UnattendedOut],
        Field(description="When nobody is on duty, today and in the six days after it; empty without a rota."),
    ]

    @classmethod
    def of(cls, row: ReceiverGroup, now: datetime) -> Self:
        """Of a group of the table, at this moment."""
        group, zone = group_of(row), plant_zone()
        times = group.unattended(local(now).date(), LOOKED_AHEAD)
        unattended = [UnattendedOut(begins=a.replace(tzinfo=zone), ends=b.replace(tzinfo=zone)) for a, b in times]
        return cls(group=row.id, receivers=list(group.on_duty(local(now))), unattended=unattended)
