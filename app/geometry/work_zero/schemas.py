"""Work zeros as JSON that comes in. Lengths in mm."""

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from app.core.parameters import LARGEST_LENGTH
from app.language.i18n import _
from app.web.again import Repeatability, TouchesAgainIn
from app.web.fields import IN_UM, LARGEST_ID, Body, LatelyOrNow, Length, Reason, RecordKey, Slug, Text200

MOST_TOUCHES = 100
Positive = Annotated[float, Field(strict=True, gt=0, le=LARGEST_LENGTH, allow_inf_nan=False)]
Tip = Annotated[float, Field(strict=True, ge=0, le=1000, allow_inf_nan=False)]
KindName = Literal["bore", "boss", "pocket", "web", "corner"]
ApproachName = Literal["+X", "-X", "+Y", "-Y"]
ResultName = Literal["x", "y", "z", "diameter", "length", "width"]
Characteristics = Annotated[
    dict[ResultName, Slug],
    Field(description="Characteristics of this machine whose readings these results become, as if they were measured."),
]

# What the printed macros call them: R1 to R4 of Sinumerik, #501, #502, #504, #505 of Fanuc.
RECORDS = {"R1": 0, "R2": 1, "R3": 2, "R4": 3, "#501": 0, "#502": 1, "#504": 2, "#505": 3}
OTHER_NAMES = {"#508": "z_touched", "#2": "feeler"}


class EdgePointIn(Body):
    """Position of the tip's centre. The coordinate across the approach may be missing where nothing is turned."""

    x: Annotated[Length | None, Field(description="X of the machine.")] = None
    y: Annotated[Length | None, Field(description="Y of the machine.")] = None
    approach: Annotated[
        ApproachName | None,
        Field(description="Direction in which the tip was moved; a bore or boss does not need it."),
    ] = None


class ZeroIn(Body):
    """The touches of a bore, boss, pocket, web or corner, in the machine's coordinates.

    `records` may be in place of `touches`, or what the printed macros keep: `R1` to `R4`, or `#501`, `#502`, `#504`, `#505`.
    """

    machine: Annotated[Slug, Field(description="The key of the machine.")]
    kind: Annotated[KindName, Field(description="bore, pocket: the tip is inside; boss, web: outside; corner.")]
    work_offset: Annotated[
        str,
        Field(
            max_length=20,
            description="G54 to G59, G54.1 P1 to P300 (Fanuc), G505 to G599 (Sinumerik, after G57), preset 1 … (others).",
        ),
    ] = "G54"
    fixture: Annotated[
        Slug | None, Field(description="Vice or fixture: zeros of the same one are compared, so that a shift is seen.")
    ] = None
    part: Annotated[Text200 | None, Field(max_length=128, description="Serial number of the part.")] = None
    tip: Annotated[Tip, Field(description="Diameter of the tip; 0 where positions are of the surface.")]
    touches: Annotated[list[EdgePointIn] | None, Field(max_length=MOST_TOUCHES, description="2 to 4, or more.")] = None
    records: Annotated[
        list[Length] | None,
        Field(
            min_length=4,
            max_length=4,
            description="X1, X2, Y1, Y2 as the printed macros record them. Of a round part: from X2 the tip went on in Y alone.",
        ),
    ] = None
    z_touched: Annotated[Length | None, Field(description="Where Z stood when it touched, if Z is set too.")] = None
    feeler: Annotated[
        float, Field(strict=True, ge=0, le=100, allow_inf_nan=False, description="Thickness of the feeler gauge.")
    ] = 0.0
    tool_length: Annotated[Length, Field(description="Of the tool that touched in Z.")] = 0.0
    repeatability: Repeatability | None = None
    characteristics: Characteristics | None = None
    touched_at: Annotated[LatelyOrNow | None, Field(description="When; if left out or still to come, now.")] = None
    key: RecordKey | None = None

    @model_validator(mode="before")
    @classmethod
    def _as_the_macros_have_it(cls, value: Any) -> Any:
        if not isinstance(value, dict):
            return value
        fields = dict(value)
        named = {name: fields.pop(name) for name in RECORDS if name in fields}
        if named:
            if len(named) != 4 or len({RECORDS[name] for name in named}) != 4 or "records" in fields:
                raise PydanticCustomError(
                    "records", _("R1 to R4 (or #501, #502, #504, #505) are needed, each once"), {"at": "records"}
                )
            fields["records"] = [value for _name, value in sorted(named.items(), key=lambda item: RECORDS[item[0]])]
        for number, name in OTHER_NAMES.items():
            if number in fields:
                if name in fields:
                    raise PydanticCustomError(
                        "twice",
                        _("{number} and {name} mean the same: give one").format(number=number, name=name),
                        {"at": name},
                    )
                fields[name] = fields.pop(number)
        return fields


class ZeroRecomputeIn(TouchesAgainIn):
    """The same touches once more: with another tip, or without some of them. The first result stays on record."""

    tip: Annotated[Tip | None, Field(description="Diameter of the tip; if left out, as before.")] = None


class FixtureIn(Body):
    """Reference of a fixture's zeros, and the limits of its shift."""

    basis: Annotated[
        Literal["first", "median", "frozen"],
        Field(description="The first zero, the median of those before, or the one that `reference` names."),
    ] = "first"
    reference: Annotated[
        int | None, Field(strict=True, ge=1, le=LARGEST_ID, description="The work zero that is frozen.")
    ] = None
    warning: Annotated[Positive | None, IN_UM, Field(description="From a larger shift on, the page warns.")] = None
    alarm: Annotated[
        Positive | None, IN_UM, Field(description="A larger shift raises the alarm *fixture shifted*.")
    ] = None
    characteristics: Characteristics = Field(default={})
    reason: Reason
