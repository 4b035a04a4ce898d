"""A shift as JSON."""

from datetime import datetime, timedelta
from typing import Annotated, Self

from pydantic import BaseModel, Field

from app.views.shift.queries import Answered, Made, OfMachine, Raised, Shift
from app.web.fields import answer_from


class ShiftMadeOut(BaseModel):
    """Measured parts and corrections."""

    readings: Annotated[int, Field(description="Readings measured in the shift, all of them.")]
    excluded: Annotated[int, Field(description="Of them taken out of the statistics.")]
    faults: Annotated[int, Field(description="Of them probe faults, which measure no part.")]
    unnamed: Annotated[int, Field(description="Readings that name no part; each counts as a part of its own.")]
    parts: Annotated[int, Field(description="Parts measured, each name once.")]
    inside: Annotated[int, Field(description="Parts in tolerance, by the last reading of each characteristic.")]
    outside: Annotated[int, Field(description="Parts out of tolerance.")]
    corrections: Annotated[int, Field(description="Corrections that these readings led to.")]
    applied: Annotated[int, Field(description="Of them confirmed by the machine.")]
    held: Annotated[int, Field(description="Of them held or waiting for approval.")]
    not_taken: Annotated[int, Field(description="Of them pending, or superseded before the machine took them.")]
    rejected: Annotated[int, Field(description="Of them rejected.")]
    largest: Annotated[float | None, Field(description="Size of the largest, mm; null: there was none.")]


class ShiftAlarmsOut(BaseModel):
    """The alarms raised in it, and how fast people acknowledged them."""

    alarms: Annotated[int, Field(description="Alarms raised in the shift.")]
    acknowledged: Annotated[int, Field(description="Of them acknowledged by a person, until now.")]
    by_itself: Annotated[int, Field(description="Of them ended by themselves.")]
    active: Annotated[int, Field(description="Of them still active.")]
    median_seconds: Annotated[
        float | None, Field(description="Median time until a person acknowledged, s; null: nobody did.")
    ]
    longest_seconds: Annotated[float | None, Field(description="Longest of these times, s.")]

    @classmethod
    def of(cls, found: Answered) -> Self:
        """As it is answered."""
        return answer_from(cls, found, median_seconds=_seconds(found.median), longest_seconds=_seconds(found.longest))


class ShiftMachineOut(BaseModel):
    """One machine in the shift."""

    machine: str
    made: Annotated[ShiftMadeOut, Field(description="What it measured and corrected.")]
    alarms: Annotated[ShiftAlarmsOut, Field(description="Its alarms.")]
    tool_changes: Annotated[int, Field(description="Tools changed.")]

    @classmethod
    def of(cls, found: OfMachine) -> Self:
        """As it is answered."""
        alarms = ShiftAlarmsOut.of(found.answered)
        return cls(machine=found.machine.key, made=made_out(found.made), alarms=alarms, tool_changes=found.tool_changes)


class ShiftAlarmOut(BaseModel):
    """An alarm that was raised in the shift."""

    id: Annotated[int, Field(description="Number of the alarm.")]
    kind: Annotated[str, Field(description="Its kind, such as tool_worn.")]
    machine: str
    characteristic: Annotated[str | None, Field(description="Key of the characteristic; null: of a tool or machine.")]
    raised_at: Annotated[datetime, Field(description="When it was raised.")]
    ended_after_seconds: Annotated[
        float | None, Field(description="Time until it was acknowledged or ended by itself, s; null: it is active.")
    ]
    by_itself: Annotated[bool, Field(description="Ended without a person.")]

    @classmethod
    def of(cls, found: Raised) -> Self:
        """As it is answered."""
        return answer_from(
            cls,
            found.alarm,
            machine=found.machine.key,
            characteristic=found.characteristic.key if found.characteristic else None,
            ended_after_seconds=_seconds(found.ended_after),
            by_itself=found.by_itself,
        )


class ShiftWearingOut(BaseModel):
    """An edge near its end."""

    characteristic: str
    machine: str
    parts_left: Annotated[float, Field(description="Parts until wear comes to the first limit, as predicted.")]


class ShiftBelowOut(BaseModel):
    """A characteristic whose index is below the target."""

    characteristic: str
    machine: str
    ppk: Annotated[float, Field(description="The index that may be quoted, as on the ranking.")]


class ShiftNextOut(BaseModel):
    """To be looked at next, as of now."""

    active_alarms: Annotated[int, Field(description="Number of alarms that are active now, of any shift.")]
    alarms: Annotated[list[int], Field(description="Numbers of the most urgent of them, at most 50.")]
    wearing: Annotated[list[ShiftWearingOut], Field(description="Limits within 100 parts, the nearest first.")]
    below: Annotated[list[ShiftBelowOut], Field(description="Indices below 1.33, the worst first.")]


class ShiftReportOut(BaseModel):
    """A shift of the plant, or of one machine."""

    machine: Annotated[str | None, Field(description="Key of the machine; null: of all.")]
    start: Annotated[datetime, Field(description="When the shift began.")]
    end: Annotated[datetime, Field(description="When it ended, or will end.")]
    running: Annotated[bool, Field(description="It has not ended yet.")]
    made: Annotated[ShiftMadeOut, Field(description="What all of them measured and corrected.")]
    alarms: Annotated[ShiftAlarmsOut, Field(description="All alarms.")]
    tool_changes: Annotated[int, Field(description="Tools changed.")]
    machines: Annotated[list[ShiftMachineOut], Field(description="By machine.")]
    raised: Annotated[list[ShiftAlarmOut], Field(description="The alarms one by one, the newest first, at most 1000.")]
    next: Annotated[ShiftNextOut, Field(description="What needs attention next, as of now.")]

    @classmethod
    def of(cls, found: Shift) -> Self:
        """As it is answered."""
        assert found.period.start is not None
        assert found.period.end is not None
        coming = found.next
        return cls(
            machine=found.machine.key if found.machine else None,
            start=found.period.start,
            end=found.period.end,
            running=found.running,
            made=made_out(found.made),
            alarms=ShiftAlarmsOut.of(found.answered),
            tool_changes=found.tool_changes,
            machines=[ShiftMachineOut.of(each) for each in found.machines],
            raised=[ShiftAlarmOut.of(each) for each in found.alarms],
            next=ShiftNextOut(
                active_alarms=coming.active,
                alarms=[row.alarm.id for row in coming.alarms],
                wearing=[
                    ShiftWearingOut(
                        characteristic=each.row.characteristic.key,
                        machine=each.machine.key,
                        parts_left=each.inputs.parts_left or 0.0,
                    )
                    for each in coming.wearing
                ],
                below=[
                    ShiftBelowOut(
                        characteristic=each.row.characteristic.key,
                        machine=each.machine.key,
                        ppk=each.inputs.ppk or 0.0,
                    )
                    for each in coming.below
                ],
            ),
        )


def made_out(found: Made) -> ShiftMadeOut:
    """Parts and corrections, as they are answered."""
    return answer_from(ShiftMadeOut, found)


def _seconds(time: timedelta | None) -> float | None:
    return None if time is None else time.total_seconds()
