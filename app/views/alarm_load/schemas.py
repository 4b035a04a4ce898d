"""The load by alarms as JSON."""

from datetime import datetime
from typing import Annotated, Self

from pydantic import BaseModel, Field

from app.access.callers import Caller
from app.core.alarm_load import LoadVerdict
from app.views.alarm_load import wording
from app.views.alarm_load.queries import AlarmLoad, Loud, Position
from app.web.fields import answer_from


class AlarmFloodOut(BaseModel):
    """A flood of alarms."""

    begin: Annotated[datetime, Field(description="Where the first ten minutes with more than 10 alarms begin.")]
    end: Annotated[datetime, Field(description="Where the first ten minutes with fewer than 5 begin.")]
    alarms: Annotated[int, Field(description="Alarms in it.")]


class AlarmPositionOut(BaseModel):
    """The load of one position: a machine, or the plant."""

    machine: Annotated[str | None, Field(description="Key of the machine; null: the whole plant.")]
    alarms: Annotated[int, Field(description="Alarms raised in the period.")]
    per_ten_minutes: Annotated[float, Field(description="Alarms in ten minutes, on average.")]
    verdict: Annotated[
        LoadVerdict,
        Field(description="acceptable: up to about 1 in ten minutes; manageable: up to about 2; too_many: more."),
    ]
    most: Annotated[int, Field(description="Alarms in the worst ten minutes.")]
    over: Annotated[int, Field(description="Ten minutes with more than 10 alarms.")]
    in_flood: Annotated[float, Field(description="Share of the time in floods; less than about 0.01 is acceptable.")]
    floods: Annotated[list[AlarmFloodOut], Field(description="Each flood, at most the last 100.")]
    stale: Annotated[
        int, Field(description="Alarms that are active for more than 24 h now; fewer than 5 are acceptable.")
    ]

    @classmethod
    def of(cls, found: Position) -> Self:
        """As it is answered."""
        return answer_from(
            cls,
            found.load,
            machine=found.machine.key if found.machine else None,
            per_ten_minutes=found.load.mean,
            floods=[AlarmFloodOut(**flood._asdict()) for flood in found.load.floods[-100:]],
            stale=found.stale,
        )


class LoudAlarmOut(BaseModel):
    """One of the ten that make the most noise."""

    kind: Annotated[str, Field(description="Kind of the alarm, such as tool_worn.")]
    machine: str
    characteristic: Annotated[str | None, Field(description="Key of the characteristic; null: of a tool or machine.")]
    tool_memory: Annotated[int | None, Field(description="R10; null: of no tool.")]
    alarms: Annotated[int, Field(description="Alarms raised in the period.")]
    share: Annotated[float, Field(description="Their share of all.")]
    chatters: Annotated[bool, Field(description="It has happened three times or more in a minute.")]
    made_by: Annotated[
        str,
        Field(
            description="Rule or parameter by which it is raised, in words; a setting by its name for administrators."
        ),
    ]
    quieter: Annotated[str, Field(description="What a quieter setting would have done, in words.")]
    quieter_left: Annotated[
        int | None,
        Field(description="Alarms that it would have left (of over- and undersize: parts); null: not computed."),
    ]

    @classmethod
    def of(cls, found: Loud, caller: Caller) -> Self:
        """As it is answered."""
        return cls(
            kind=found.cause.kind,
            machine=found.machine.key,
            characteristic=found.characteristic.key if found.characteristic else None,
            tool_memory=found.cause.tool,
            alarms=found.noise.alarms,
            share=found.noise.share,
            chatters=found.noise.chatters,
            made_by=wording.made_by(found.cause.kind, caller),
            quieter=wording.quieter_words(found),
            quieter_left=found.quieter.left if found.quieter else None,
        )


class AlarmLoadOut(BaseModel):
    """The load by alarms in a period, by the numbers of ANSI/ISA-18.2-2016."""

    start: Annotated[datetime, Field(description="Where the period begins.")]
    end: Annotated[datetime, Field(description="Where it ends.")]
    enough: Annotated[bool, Field(description="It has 30 days or more, as the standard asks for.")]
    cut: Annotated[bool, Field(description="Only the newest 100,000 alarms were counted; `start` has moved to them.")]
    positions: Annotated[list[AlarmPositionOut], Field(description="The plant first, then each machine.")]
    top: Annotated[list[LoudAlarmOut], Field(description="The ten noisiest, the noisiest first.")]
    stale: Annotated[list[int], Field(description="Numbers of the stale alarms, the oldest first.")]

    @classmethod
    def of(cls, found: AlarmLoad, caller: Caller) -> Self:
        """As it is answered."""
        assert found.period.start is not None
        assert found.period.end is not None
        return cls(
            start=found.period.start,
            end=found.period.end,
            enough=found.enough,
            cut=found.cut,
            positions=[AlarmPositionOut.of(each) for each in found.positions],
            top=[LoudAlarmOut.of(each, caller) for each in found.top],
            stale=[each.alarm.id for each in found.stale],
        )
