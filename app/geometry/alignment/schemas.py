"""Alignments as JSON that comes in. Lengths in mm, angles in degrees."""

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from app.language.i18n import _
from app.web.again import MOST_TOUCHES, Repeatability, TouchesAgainIn
from app.web.fields import LARGEST_ID, Body, LatelyOrNow, Length, RecordKey, Slug, Text200

Angle = Annotated[float, Field(strict=True, ge=-360, le=360, allow_inf_nan=False)]
Share = Annotated[float, Field(strict=True, ge=-1e3, le=1e3, allow_inf_nan=False)]
Vector = Annotated[list[Length], Field(min_length=3, max_length=3)]
Normal = Annotated[list[Share], Field(min_length=3, max_length=3)]
Place = Annotated[list[Length], Field(min_length=2, max_length=2)]
MethodName = Literal["exact", "small", "printed"]
Motion = Literal["a", "b", "c", "lambda", "beta", "gamma"]
DIRECTIONS = {
    "+X": [1.0, 0.0, 0.0],
    "-X": [-1.0, 0.0, 0.0],
    "+Y": [0.0, 1.0, 0.0],
    "-Y": [0.0, -1.0, 0.0],
    "+Z": [0.0, 0.0, 1.0],
    "-Z": [0.0, 0.0, -1.0],
}


class AlignmentPointIn(Body):
    """Nominal place of a face, its normal, and the probed point or its deviation along the normal."""

    nominal: Annotated[Vector, Field(description="Nominal point in the part's coordinates.")]
    normal: Annotated[
        Normal, Field(description="Of the face there, pointing out of the part; or +X, -X, +Y, -Y, +Z, -Z.")
    ]
    deviation: Annotated[
        Length | None, Field(description="Actual less nominal along the normal; or say `measured`.")
    ] = None
    measured: Annotated[
        Vector | None, Field(description="The point that was touched; where the tip's centre stood if `tip` is said.")
    ] = None

    @model_validator(mode="before")
    @classmethod
    def _named_direction(cls, value: Any) -> Any:
        if isinstance(value, dict) and isinstance(value.get("normal"), str):
            direction = DIRECTIONS.get(value["normal"].strip().upper().replace("\N{MINUS SIGN}", "-"))
            if direction is None:
                raise PydanticCustomError(
                    "normal",
                    _("{text} is no direction: +X, -X, +Y, -Y, +Z, -Z").format(text=repr(value["normal"][:20])),
                    {"at": "normal"},
                )
            return value | {"normal": direction}
        return value

    @model_validator(mode="after")
    def _one_finding(self) -> "AlignmentPointIn":
        if (self.deviation is None) == (self.measured is None):
            raise PydanticCustomError("finding", _("say deviation or measured, one of them"))
        return self


class SidePointIn(Body):
    """A touch on a side, in the plane."""

    nominal: Annotated[Place, Field(description="X, Y where it was to be.")]
    measured: Annotated[Place, Field(description="X, Y where it was found.")]


class HoleIn(Body):
    """A hole or spigot: its centre, or the touches that it follows from."""

    nominal: Annotated[Place, Field(description="X, Y of its centre.")]
    centre: Annotated[Place | None, Field(description="As the control has found it; or say `touches`.")] = None
    touches: Annotated[
        list[Place] | None, Field(max_length=MOST_TOUCHES, description="Three or more, where the tip's centre stood.")
    ] = None
    tip: Annotated[float, Field(strict=True, ge=0, le=1000, allow_inf_nan=False, description="Its diameter.")] = 0.0
    inside: Annotated[bool, Field(strict=True, description="A hole; false for a spigot.")] = True

    @model_validator(mode="after")
    def _one_finding(self) -> "HoleIn":
        if (self.centre is None) == (self.touches is None):
            raise PydanticCustomError("finding", _("say centre or touches, one of them"))
        return self


class TableIn(Body):
    """A rotary table that takes the turn about Z."""

    axis: Annotated[Literal["A", "B", "C"], Field(description="As it is called on the control.")] = "C"
    centre: Annotated[Place, Field(description="X, Y of its axis in the part's coordinates.")]
    position: Annotated[
        float,
        Field(strict=True, ge=-1e6, le=1e6, allow_inf_nan=False, description="Where it stood while touching, degrees."),
    ] = 0.0
    clockwise: Annotated[
        bool,
        Field(strict=True, description="A positive command turns the part clockwise seen from +Z, as ISO 841 has it."),
    ] = True


class AlignmentIn(Body):
    """Touches of a part whose place is to be found."""

    machine: Annotated[Slug, Field(description="The key of the machine.")]
    kind: Annotated[
        Literal["points", "two_points", "two_holes"],
        Field(description="points: six (3-2-1) or more; two_points: two on a side; two_holes."),
    ] = "points"
    name: Annotated[Text200 | None, Field(description="What was aligned: part, pallet, set-up.")] = None
    part: Annotated[Text200 | None, Field(max_length=128, description="Serial number.")] = None
    touches: Annotated[
        list[AlignmentPointIn] | None, Field(max_length=MOST_TOUCHES, description="Of the kind `points`.")
    ] = None
    tip: Annotated[
        float,
        Field(
            strict=True,
            ge=0,
            le=1000,
            allow_inf_nan=False,
            description="Of the kind `points`: its diameter, where `measured` is where its centre stood; 0 for the surface itself.",
        ),
    ] = 0.0
    side: Annotated[
        list[SidePointIn] | None, Field(min_length=2, max_length=2, description="Of the kind `two_points`.")
    ] = None
    holes: Annotated[list[HoleIn] | None, Field(min_length=2, max_length=2, description="Of the kind `two_holes`.")] = (
        None
    )
    method: Annotated[
        MethodName,
        Field(description="exact: finite rotations; small: rows [n, r×n]; printed: the short form for 3-2-1."),
    ] = "exact"
    solve_for: Annotated[
        list[Motion] | None,
        Field(min_length=1, max_length=6, description="The motions that are unknown; if left out, all six."),
    ] = None
    repeatability: Repeatability | None = None
    work_offset: Annotated[
        str | None,
        Field(
            max_length=20, description="With `base`: the text sets this work offset again; else the program's frame."
        ),
    ] = None
    base: Annotated[Vector | None, Field(description="X, Y, Z of that work offset while touching.")] = None
    table: Annotated[TableIn | None, Field(description="The turn about Z is taken by this table.")] = None
    characteristics: Annotated[
        dict[Literal["a", "b", "c"], Slug] | None,
        Field(description="Characteristics of this machine whose readings a, b, c become."),
    ] = None
    aligned_at: Annotated[LatelyOrNow | None, Field(description="When; if left out, now.")] = None
    key: RecordKey | None = None


class PoseIn(Body):
    """Position of the pallet's own coordinates in those of the machine."""

    shift: Annotated[Vector, Field(description="Of its origin.")]
    rotation: Annotated[Angle, Field(description="About Z, degrees.")] = 0.0


class PalletIn(Body):
    """The error of a pallet and the error of a part on it, the one after the other."""

    pallet: Annotated[int, Field(strict=True, ge=1, le=LARGEST_ID, description="The alignment of the pallet.")]
    part: Annotated[int, Field(strict=True, ge=1, le=LARGEST_ID, description="The alignment of the part on it.")]
    pose: Annotated[PoseIn | None, Field(description="If the part was measured in the pallet's own coordinates.")] = (
        None
    )
    name: Annotated[Text200 | None, Field(description="What lies there.")] = None
    key: RecordKey | None = None


class AlignmentRecomputeIn(TouchesAgainIn):
    """The same touches once more: by another method, or without some of them. The first result stays on record."""

    method: Annotated[MethodName | None, Field(description="If left out, as before.")] = None
