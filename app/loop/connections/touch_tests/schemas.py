"""Touch tests as JSON."""

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, StringConstraints, model_validator
from pydantic_core import PydanticCustomError

from app.core.parameters import MOST_LOCATIONS
from app.language.i18n import _
from app.loop.connections.touch_tests.queries import TouchTestRow
from app.web.fields import Body, Length, MappingHash, Text200, answer_from, one_line

TouchTestState = Literal[
    "asked", "read", "go", "written", "compared", "answered", "stopping", "proved", "not_proved", "failed", "cancelled"
]
Question = Literal["before", "after", "size"]
STATE_MEANS = (
    "`asked`: the bridge hears of it with its next heartbeat; `read`: it has read the offset, question `before` is open; `go`: it "
    "may write; `written`: it has written and read back, question `after` is open; `compared`: question `size` is open; "
    "`answered`: the bridge takes the offset back; `stopping`: the same after a stop. Over are `proved`, `not_proved` (a question "
    "was answered with no, or the register did not take the value), `failed` (see `detail`) and `cancelled`."
)
QUESTION_MEANS = (
    "`before`: the control's screen shows `shown_before` in `place`, and the program is stopped; `after`: it shows `shown_after` "
    "there, and nothing else has changed; `size`: a part cut now would be larger by `amount` (smaller, if that is negative)."
)
LARGEST, SMALLEST = 0.05, 0.001  # mm


def _sensible(amount: float) -> float:
    if not SMALLEST <= abs(amount) <= LARGEST:
        raise PydanticCustomError("amount", _("has to be 0.001 to 0.05 mm, of either sign"))
    return amount


def _in_one_line(text: Any) -> Any:
    return " ".join(text.split()) if isinstance(text, str) else text


Sentence = Annotated[str, BeforeValidator(_in_one_line), StringConstraints(max_length=1000), AfterValidator(one_line)]
"""What a bridge says; line breaks become blanks."""


class TouchTestIn(Body):
    """A touch test that the bridge of a machine is asked for."""

    tool_memory: Annotated[int, Field(strict=True, ge=1, le=MOST_LOCATIONS, description="R10")]
    amount: Annotated[
        Length, AfterValidator(_sensible), Field(description="Change of the offset, mm; 0.001 to 0.05 of either sign.")
    ] = 0.01


class TouchTestAnswer(Body):
    """The answer of a person who looks at the control."""

    question: Annotated[Question, Field(description=QUESTION_MEANS)]
    yes: Annotated[bool, Field(strict=True, description="false ends the test: the mapping is not proved.")]


class TouchTestReport(Body):
    """Report of the bridge about a touch test. Fields that this server does not know are passed over."""

    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)

    state: Annotated[
        Literal["read", "written", "proved", "not_proved", "failed", "cancelled"],
        Field(
            description="How far the bridge has come; the last four only when the offset is taken back, or cannot be."
        ),
    ]
    detail: Annotated[Sentence | None, Field(description="What came of it, in words.")] = None
    mapping: MappingHash | None = None
    place: Annotated[Text200 | None, Field(description="The register at the control, in words.")] = None
    unit: Annotated[Literal["mm", "inch"] | None, Field(description="Of the control's screen.")] = None
    before: Annotated[Length | None, Field(description="Inband's offset as it was read, mm.")] = None
    shown_before: Annotated[Length | None, Field(description="The same as the control's screen shows it.")] = None
    shown_after: Annotated[Length | None, Field(description="What the screen shows after the change.")] = None

    @model_validator(mode="after")
    def _whole(self) -> "TouchTestReport":
        if self.state == "read":
            for name in ("place", "unit", "before", "shown_before", "shown_after"):
                if getattr(self, name) is None:
                    raise PydanticCustomError("missing", _("is missing"), {"at": name})
        return self


class TouchTestOut(BaseModel):
    """A touch test of one tool location."""

    id: int
    machine: str
    tool_memory: Annotated[int, Field(description="R10")]
    amount: Annotated[float, Field(description="Change of the offset, mm.")]
    state: Annotated[TouchTestState, Field(description=STATE_MEANS)]
    state_at: Annotated[datetime, Field(description="Since when it is in this state.")]
    state_age: Annotated[float, Field(description="The same, s.")]
    question: Annotated[Question | None, Field(description="The question that waits for a person. " + QUESTION_MEANS)]
    refused: Annotated[Question | None, Field(description="The question that was answered with no.")]
    asked_at: Annotated[datetime, Field(description="When it was asked for.")]
    asked_by: Annotated[str, Field(description="Who asked for it.")]
    answered_by: Annotated[str | None, Field(description="Who answered or stopped it last.")]
    ended_at: Annotated[datetime | None, Field(description="null: it is open.")]
    detail: Annotated[str | None, Field(description="What came of it, in the bridge's words.")]
    mapping: Annotated[str | None, Field(description="Hash of the mapping that it proves.")]
    place: Annotated[str | None, Field(description="The register at the control.")]
    unit: Annotated[Literal["mm", "inch"] | None, Field(description="Of the control's screen.")]
    before: Annotated[float | None, Field(description="Inband's offset as it was read, mm.")]
    shown_before: Annotated[float | None, Field(description="The same as the control's screen shows it.")]
    shown_after: Annotated[float | None, Field(description="What the screen shows after the change.")]

    @classmethod
    def of(cls, row: TouchTestRow) -> "TouchTestOut":
        """A touch test as it is stored."""
        return answer_from(
            cls,
            row.test,
            machine=row.machine.key,
            state_age=round(row.state_age, 1),
            question=QUESTIONS.get(row.test.state),
        )


QUESTIONS: dict[str, Question] = {"read": "before", "written": "after", "compared": "size"}
"""The question that is open in a state."""
