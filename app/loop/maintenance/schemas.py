"""Maintenance as JSON."""

from datetime import datetime
from typing import Annotated, Self

from pydantic import BaseModel, Field

from app.loop.maintenance.queries import MaintenanceRow, State
from app.web.fields import LATER, Body, Moment, Reason, Slug, answer_from

StoppingAnyway = Annotated[bool, Field(description="Notifications of alarms that stop a machine are still sent.")]


class MaintenanceIn(Body):
    """Maintenance of a machine, or of all."""

    machine: Annotated[Slug | None, Field(description="Key of the machine; null: all machines.")] = None
    begins: Annotated[Moment | None, Field(description="Not in the past; null: now.")] = None
    ends: Annotated[Moment | None, LATER, Field(description="When it is over; null: 8 h after it begins.")] = None
    reason: Reason
    stopping_anyway: StoppingAnyway = True


class EndIn(Body):
    """The end of maintenance; a reason may be named."""

    reason: Reason | None = None


class ExtendIn(Body):
    """A later end of maintenance; a reason may be named."""

    ends: Annotated[Moment, LATER, Field(description="The new end, later than the present one.")]
    reason: Reason | None = None


class MaintenanceOut(BaseModel):
    """Maintenance of a machine, or of all."""

    id: int
    machine: Annotated[str | None, Field(description="Key of the machine; null: all machines.")]
    begins: Annotated[datetime, Field(description="From then on notifications are withheld.")]
    ends: Annotated[datetime, Field(description="When it is over, if it is not ended earlier.")]
    reason: str
    stopping_anyway: StoppingAnyway
    state: Annotated[State, Field(description="`cancelled`: ended before it began.")]
    entered_at: Annotated[datetime, Field(description="When it was entered.")]
    entered_by: Annotated[str, Field(description="Who entered it.")]
    ended_at: Annotated[datetime | None, Field(description="When it was ended by hand; null: it was not.")]
    ended_by: Annotated[str | None, Field(description="Who ended it by hand.")]

    @classmethod
    def of(cls, row: MaintenanceRow, now: datetime) -> Self:
        """Maintenance of the table, at a moment."""
        machine = row.machine.key if row.machine else None
        return answer_from(cls, row.maintenance, machine=machine, state=row.state(now))
