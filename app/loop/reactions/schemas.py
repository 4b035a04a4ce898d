"""Reaction plans, the catalogue and the Pareto of causes as JSON."""

from datetime import datetime
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BaseModel, Field, StringConstraints, model_validator
from pydantic_core import PydanticCustomError

from app.core.reaction import Share
from app.core.spc.rules import RuleName
from app.language.i18n import _
from app.loop.tables.reactions import CatalogueEntry, ReactionPicture, ReactionPlan
from app.web.fields import LARGEST_ID, Body, Reason, Slug, Text200, answer_from, readable
from app.web.pictures import Digest, PictureFields

MOST_STEPS, MOST_RECEIVERS = 20, 50
SIGNAL = "signal"
"""The kind of the alarms that run rules raise."""
StepText = Annotated[
    str,
    StringConstraints(strip_whitespace=True, min_length=1, max_length=1000),
    AfterValidator(readable),
    Field(description="What to do, 1 to 1000 characters."),
]


class StepPicture(Body):
    """A picture of a step."""

    digest: Digest
    alt: Annotated[
        Text200,
        Field(description="What the picture shows, for those who cannot see it."),
    ]


class ReactionStep(Body):
    """One step of a plan."""

    text: StepText
    picture: Annotated[StepPicture | None, Field(description="Shown below the text; null: none.")] = None


class PlanFields(Body):
    """The alarms a plan is for, and what is to be done about them."""

    name: Text200
    characteristic: Annotated[Slug | None, Field(description="Key of the characteristic; null: any.")] = None
    kind: Annotated[Slug | None, Field(description="Kind of alarm, such as tool_worn; null: any.")] = None
    rule: Annotated[
        RuleName | None, Field(description="Run rule of control charts, of alarms of the kind signal; null: any.")
    ] = None
    steps: Annotated[
        list[ReactionStep], Field(min_length=1, max_length=MOST_STEPS, description="In the order of doing.")
    ]
    cause_needed: Annotated[
        bool, Field(description="It cannot be acknowledged without a cause, as long as the catalogue offers one.")
    ] = False
    action_needed: Annotated[
        bool, Field(description="It cannot be acknowledged without a corrective action, as long as there is one.")
    ] = False
    receivers: Annotated[
        list[Annotated[int, Field(strict=True, ge=1, le=LARGEST_ID)]],
        Field(max_length=MOST_RECEIVERS, description="Numbers of receivers of notifications that must be notified."),
    ] = Field(default_factory=list)

    @model_validator(mode="after")
    def _of_a_signal(self) -> Self:
        if self.rule is not None:
            if self.kind not in (None, SIGNAL):
                raise PydanticCustomError("rule", _("only raises alarms of the kind signal"), {"at": "rule"})
            self.kind = SIGNAL
        return self


class ReactionPlanIn(PlanFields):
    """A version of a reaction plan."""

    reason: Reason


class ReactionPlanOut(PlanFields):
    """A version of a reaction plan as it is stored."""

    id: int
    version: Annotated[int, Field(description="Counts per plan; none is ever changed.")]
    ended: Annotated[bool, Field(description="With this version the plan was withdrawn.")]
    reason: Annotated[str, Field(description="Why this version was made.")]
    made_at: Annotated[datetime, Field(description="When this version was made.")]
    made_by: Annotated[str, Field(description="Who made it.")]

    @classmethod
    def of(cls, row: ReactionPlan) -> Self:
        """A version of the table."""
        return answer_from(cls, row)


class ReactionPictureOut(PictureFields):
    """A picture that steps can name by its digest."""

    @classmethod
    def of(cls, row: ReactionPicture) -> Self:
        """A picture of the table."""
        return answer_from(cls, row)


Sort = Annotated[Literal["cause", "action"], Field(description="`cause`, or `action`: a corrective action.")]


class CatalogueEntryIn(Body):
    """A cause or a corrective action to choose from."""

    sort: Sort
    name: Text200


class CatalogueEntryChange(Body):
    """Offer it no more, or again."""

    retired: Annotated[bool, Field(description="true: it is not offered any more; alarms that name it keep it.")]


class CatalogueEntryOut(BaseModel):
    """A cause or a corrective action."""

    id: int
    sort: Sort
    name: str
    made_at: Annotated[datetime, Field(description="When it was added.")]
    made_by: Annotated[str, Field(description="Who added it.")]
    retired_at: Annotated[datetime | None, Field(description="Since then it is not offered; null: it is.")]

    @classmethod
    def of(cls, row: CatalogueEntry) -> Self:
        """An entry of the table."""
        return answer_from(cls, row)


class CauseShareOut(BaseModel):
    """The alarms of one cause."""

    cause: Annotated[int | None, Field(description="Number of the cause; null: none was given.")]
    name: Annotated[str | None, Field(description="Its name.")]
    alarms: Annotated[int, Field(description="Acknowledged alarms with this cause.")]
    share: Annotated[float, Field(description="Of all acknowledged alarms, 0 to 1.")]
    sum: Annotated[float, Field(description="The same with the causes before it.")]
    acknowledged: Annotated[float, Field(description="Median time from raised to acknowledged, s.")]
    recovered: Annotated[
        float | None, Field(description="Median time from raised to the next reading that raises no alarm, s.")
    ]
    recovering: Annotated[int, Field(description="Alarms of which that time is known.")]

    @classmethod
    def of(cls, share: Share, name: str | None) -> Self:
        """A result of the core, with the name of the cause."""
        return cls(name=name, **share._asdict())


class CausesOut(BaseModel):
    """Causes of acknowledged alarms, the most frequent first; those without a cause come last."""

    alarms: Annotated[int, Field(description="Acknowledged alarms that are counted.")]
    more: Annotated[bool, Field(description="true: there are older ones in the period, which are not counted.")]
    causes: Annotated[list[CauseShareOut], Field(description="One for each cause.")]
