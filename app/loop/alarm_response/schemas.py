"""Alarms as JSON. Lengths in mm."""

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.core.parameters import LARGEST_LENGTH
from app.loop.alarm_response import outcomes, wording
from app.loop.alarm_response.queries import AlarmRow
from app.loop.alarm_response.reaction_queries import Reactions
from app.loop.alarms.kinds import Action
from app.web.fields import LARGEST_ID, Body, Reason, Text200, answer_from
from app.web.pictures import PictureFields

EntryNumber = Annotated[int, Field(strict=True, ge=1, le=LARGEST_ID)]


class AlarmPhotoOut(PictureFields):
    """A photo at an alarm. What it shows: `GET /alarms/{alarm}/photos/{photo}`."""

    id: int
    removed_at: Annotated[datetime | None, Field(description="Since then nobody can see it; null: it is there.")]
    removed_by: Annotated[str | None, Field(description="Who removed it.")]
    removed_why: Annotated[str | None, Field(description="Why it was removed.")]


class AlarmAcknowledgeIn(Body):
    """Acknowledgement of an alarm: the action taken and a comment."""

    action: Annotated[
        Action, Field(description="The answer: what was done. Which ones an alarm takes is in its page and its error.")
    ]
    comment: Reason
    offset: Annotated[
        float | None,
        Field(
            strict=True,
            ge=-LARGEST_LENGTH,
            le=LARGEST_LENGTH,
            description="With `tool_replaced`: the offset that the new tool starts with; 0 if left out. With `offset_set`: "
            "the one that is true, mm.",
        ),
    ] = None
    changed_by: Annotated[
        Text200 | None, Field(description="With `offset_set`: who has changed the offset at the control.")
    ] = None
    hand_measured: Annotated[
        float | None,
        Field(
            strict=True,
            ge=-LARGEST_LENGTH,
            le=LARGEST_LENGTH,
            description="What was measured by hand, mm; kept beside the machine's value, the reading is not excluded.",
        ),
    ] = None
    hand_verdict: Annotated[
        Literal["good", "bad"] | None, Field(description="Whether the part is good, by the person's own judgement.")
    ] = None
    hand_sequence: Annotated[
        int | None,
        Field(
            strict=True,
            ge=1,
            le=LARGEST_ID,
            description="Of which reading; of the last one behind the alarm if left out.",
        ),
    ] = None
    cause: Annotated[
        EntryNumber | None, Field(description="Number of a cause of the catalogue; needed where the plan asks for it.")
    ] = None
    corrective_action: Annotated[
        EntryNumber | None,
        Field(description="Number of a corrective action of the catalogue; needed where the plan asks for it."),
    ] = None


class CatalogueChoice(BaseModel):
    """An entry of the catalogue."""

    id: int
    name: str


class PlanOfAlarm(BaseModel):
    """The reaction plan of an alarm; `GET /reactions/plans/{plan}?version=` has its steps."""

    plan: Annotated[int, Field(description="Number of the plan.")]
    version: Annotated[
        int, Field(description="While the alarm is active the one in force, then the one it was handled with.")
    ]
    name: str
    cause_needed: Annotated[bool, Field(description="It cannot be acknowledged without a cause.")]
    action_needed: Annotated[bool, Field(description="It cannot be acknowledged without a corrective action.")]


class HeldCorrection(BaseModel):
    """The correction that waits for this alarm to be acknowledged."""

    number: Annotated[int, Field(description="Counts per machine; release or reject it by this number.")]
    amount: Annotated[float, Field(description="What the offset would change by, mm.")]


class Followed(BaseModel):
    """One thing that followed, as a code with its values and as a sentence."""

    model_config = ConfigDict(extra="allow")

    code: str
    text: str


class AlarmOut(BaseModel):
    """Something that needs a person, what that person did about it, and what followed."""

    id: int
    kind: Annotated[str, Field(description="oversize, undersize, tool_worn, probe_fault, acceptance, offset_limit …")]
    state: Annotated[
        Literal["active", "acknowledged"], Field(description="active: it waits for a person; acknowledged.")
    ]
    machine: str
    characteristic: Annotated[
        str | None, Field(description="Key of the characteristic; null: it is about a tool or the machine.")
    ]
    tool_memory: Annotated[int | None, Field(description="R10; none if the characteristic only measures.")]
    text: Annotated[str, Field(description="What is wrong.")]
    what_to_do: str
    raised_at: Annotated[datetime, Field(description="When it was raised.")]
    last_at: Annotated[datetime, Field(description="When it happened last.")]
    count: Annotated[int, Field(description="How often it has happened while the alarm is active.")]
    sequence: Annotated[int | None, Field(description="The reading that raised it.")]
    last_sequence: Annotated[int | None, Field(description="The latest reading that repeated it.")]
    held_correction: Annotated[
        HeldCorrection | None, Field(description="The correction that waits for the answer; null: none.")
    ]
    data: Annotated[dict[str, Any], Field(description="The values behind the text, by kind; lengths in mm.")]
    acknowledged_at: Annotated[
        datetime | None, Field(description="When it was answered, or ended by itself; null: it is active.")
    ]
    acknowledged_by: Annotated[
        str | None, Field(description="Who answered it: a person, a key, or `inband` where it ended by itself.")
    ]
    action: Annotated[Action | None, Field(description="The answer: what was done.")]
    comment: Annotated[str | None, Field(description="What the person said.")]
    outcome: Annotated[list[Followed] | None, Field(description="What followed; none while it is active.")]
    reaction_plan: Annotated[PlanOfAlarm | None, Field(description="What to do about it; null: there is no plan.")]
    cause: Annotated[CatalogueChoice | None, Field(description="The cause that was chosen.")]
    corrective_action: Annotated[CatalogueChoice | None, Field(description="The corrective action that was chosen.")]


def alarm_out(row: AlarmRow, reactions: Reactions) -> AlarmOut:
    """An alarm as it is answered."""
    alarm, held = row.alarm, row.held
    done = alarm.acknowledged_at is not None
    plan = reactions.plan_of(row)

    def chosen(number: int | None) -> CatalogueChoice | None:
        name = reactions.name_of(number)
        return None if number is None or name is None else CatalogueChoice(id=number, name=name)

    return answer_from(
        AlarmOut,
        alarm,
        state="acknowledged" if done else "active",
        machine=row.machine.key,
        characteristic=row.characteristic.key if row.characteristic else None,
        text=wording.sentence(alarm),
        what_to_do=wording.what_to_do(alarm.kind),
        held_correction=None if held is None else HeldCorrection(number=held.number, amount=held.amount),
        outcome=[Followed(**item) for item in outcomes.outcomes(alarm.outcome)] if done else None,
        reaction_plan=None if plan is None else answer_from(PlanOfAlarm, plan, plan=plan.id),
        cause=chosen(alarm.cause),
        corrective_action=chosen(alarm.corrective_action),
    )
