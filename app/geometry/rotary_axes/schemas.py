"""Runs of the preset compensation as JSON. Lengths in mm, angles in degrees."""

from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator
from pydantic_core import PydanticCustomError

from app.core.parameters import LARGEST_LENGTH
from app.core.rotary.axis import AxisName, Carried
from app.files.formats.cell_values import Unreadable, zone_named
from app.geometry.rotary_axes.result_values import UNITS
from app.language.i18n import _
from app.web.fields import LARGEST_SERIAL, Body, LatelyOrNow, Length, Reason, RecordKey, Slug, Text200

Angle = Annotated[float, Field(strict=True, ge=-360, le=360, allow_inf_nan=False)]
Limit = Annotated[float, Field(strict=True, gt=0, le=LARGEST_LENGTH, allow_inf_nan=False)]
Ball = Annotated[float, Field(strict=True, ge=0.0001, le=99.9999, allow_inf_nan=False)]
Point = Annotated[list[Length], Field(min_length=3, max_length=3, description="X, Y, Z, mm.")]
MOST_POSITIONS, MOST_TOUCHES, MOST_PROTOCOL = 100, 50, 900_000


def _one_of(model: Any, names: tuple[str, ...]) -> None:
    present = [name for name in names if getattr(model, name) is not None]
    if len(present) != 1:
        raise PydanticCustomError("one_of", _("say exactly one of {names}").format(names=", ".join(names)))


class PositionIn(Body):
    """The ball at one angle of the axis: its centre, or the touches that it is found from."""

    angle: Annotated[Angle, Field(description="Of the axis, degrees.")]
    approach: Annotated[
        Literal["positive", "negative"] | None,
        Field(description="From where the axis came (Q432); with both, the backlash is found."),
    ] = None
    centre: Annotated[Point | None, Field(description="Centre of the ball, X Y Z, mm.")] = None
    touches: Annotated[
        list[Point] | None, Field(max_length=MOST_TOUCHES, description="Where the ball was touched, at least four.")
    ] = None

    @model_validator(mode="after")
    def _centre_or_touches(self) -> Self:
        _one_of(self, ("centre", "touches"))
        return self


class AxisIn(Body):
    """One rotary axis as it was measured."""

    axis: Annotated[AxisName, Field(description="Letter of the axis.")]
    positions: Annotated[
        list[PositionIn],
        Field(description="The ball at each angle of the axis.", min_length=1, max_length=MOST_POSITIONS),
    ]
    ball: Annotated[
        Point | None,
        Field(
            description="Nominal centre of the ball at the angle 0, seen from where the axis should be. If nobody says "
            "it, the mean of the centres turned back."
        ),
    ] = None
    ball_known: Annotated[
        bool,
        Field(
            strict=True, description="The ball lies exactly there; else how far it lies beside is estimated as well."
        ),
    ] = False
    carries: Annotated[
        Carried,
        Field(
            description="table: the axis turns the table with the ball on it. head: it turns the head with the probe, the ball "
            "stays, and the centres are those that the control shows."
        ),
    ] = Carried.TABLE
    reversed: Annotated[
        bool,
        Field(strict=True, description="Its angles count against the right hand about +X, +Y, +Z, as many tables do."),
    ] = False
    incidence: Annotated[Angle | None, Field(description="Q413, Q417, Q421.")] = None
    position: Annotated[Point | None, Field(description="Where the kinematics has the axis now, X Y Z, mm.")] = None
    seen_from: Annotated[
        Literal["axis", "machine"],
        Field(
            description="axis: centres, touches and ball count from where the axis should be. machine: they are in the "
            "same coordinates as `position`, which is needed then."
        ),
    ] = "axis"

    @model_validator(mode="after")
    def _place_is_said(self) -> Self:
        if self.seen_from == "machine" and self.position is None:
            raise PydanticCustomError(
                "position", _("say position: where the kinematics has the axis now"), {"at": "position"}
            )
        return self


class ShiftIn(Body):
    """The ball alone, for a drift of the machine without rotary axes: where the preset has it, and where it is found."""

    nominal: Point
    centre: Annotated[Point | None, Field(description="Centre of the ball, X Y Z, mm.")] = None
    touches: Annotated[
        list[Point] | None,
        Field(description="Where the ball was touched, at least four points.", max_length=MOST_TOUCHES),
    ] = None

    @model_validator(mode="after")
    def _centre_or_touches(self) -> Self:
        _one_of(self, ("centre", "touches"))
        return self


class RunIn(Body):
    """A run of cycle 452 in one of four forms: `axes` (touches or centres), `results`, `pasted`, `protocol`."""

    machine: Slug
    measured_at: Annotated[LatelyOrNow | None, Field(description="If left out: as the protocol says, else now.")] = None
    key: RecordKey | None = None
    head: Annotated[
        Text200 | None, Field(max_length=64, description="The interchangeable head that was in, if there are several.")
    ] = None
    program: Annotated[Text200 | None, Field(description="NC program that the cycle ran in.")] = None
    tool: Annotated[Text200 | None, Field(description="Name of the touch probe.")] = None
    kinematics: Annotated[Text200 | None, Field(description="Name of the active kinematics.")] = None
    mode: Annotated[Text200 | None, Field(description="How the cycle was run.")] = None
    ball_radius: Annotated[Ball | None, Field(description="Q407; if left out, as planned for the machine.")] = None
    tip_radius: Annotated[
        float,
        Field(strict=True, ge=0, le=100, description="Radius of the stylus tip, if touches are centres of the tip."),
    ] = 0.0
    backlash_angle: Annotated[
        float | None, Field(strict=True, ge=-3, le=3, description="Q432: 0, backlash was not measured.")
    ] = None
    reference_angle: Annotated[float | None, Field(strict=True, ge=0, le=360, description="Q380.")] = None
    touches_per_ball: Annotated[int | None, Field(strict=True, ge=3, le=8, description="Q423.")] = None
    clearance: Annotated[float | None, Field(strict=True, ge=0, le=99_999.9999, description="Q320.")] = None
    retract_height: Annotated[float | None, Field(strict=True, ge=0, le=99_999.9999, description="Q408.")] = None
    feed: Annotated[float | None, Field(strict=True, ge=0, le=99_999.9999, description="Q253, mm/min.")] = None
    axes: Annotated[list[AxisIn] | None, Field(min_length=1, max_length=3, description="Touches or centres.")] = None
    shift: Annotated[ShiftIn | None, Field(description="The ball alone: drift without rotary axes.")] = None
    results: Annotated[
        dict[str, Annotated[float, Field(strict=True)] | Annotated[str, Field(strict=True)]] | None,
        Field(
            max_length=12,
            description='Q141 to Q149 as numbers, QS144 to QS146 as text: {"Q143": 0.0134, "QS146": "…"}.',
        ),
    ] = None
    pasted: Annotated[
        str | None, Field(min_length=1, max_length=10_000, description="Result parameters as text, a line each.")
    ] = None
    protocol: Annotated[
        str | None, Field(min_length=1, max_length=MOST_PROTOCOL, description="TCHPRAUTO.html of the control.")
    ] = None
    timezone: Annotated[
        Text200 | None,
        Field(max_length=64, description="Of the control's clock, which writes the protocol; else the plant's."),
    ] = None
    confirm: Annotated[
        Reason | None, Field(description="Confirms a change larger than permitted at once, and says why.")
    ] = None

    @field_validator("timezone")
    @classmethod
    def _there_is_such_a_zone(cls, name: str | None) -> str | None:
        try:
            zone_named(name or "UTC")
        except Unreadable as error:
            raise PydanticCustomError("zone", "{why}", {"why": str(error)}) from None
        return name

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        _one_of(self, ("axes", "shift", "results", "pasted", "protocol"))
        letters = [axis.axis for axis in self.axes or ()]
        if len(set(letters)) != len(letters):
            raise PydanticCustomError("twice", _("each axis may be in a run once"), {"at": "axes"})
        return self


class EnterIn(Body):
    """The values of a run have been entered on the control."""

    reason: Reason
    offsets: Annotated[
        bool,
        Field(
            strict=True, description="Q147 to Q149 as well, which the control leaves to be entered in its parameters."
        ),
    ] = False
    at: Annotated[
        LatelyOrNow | None, Field(description="When it was done, if runs measured before it are still to come in.")
    ] = None


class RestoreIn(Body):
    """A kinematics is put back."""

    reason: Reason
    instead_of: Annotated[
        int | None,
        Field(
            strict=True, ge=1, le=LARGEST_SERIAL, description="The version seen in effect: 409 if it is not any more."
        ),
    ] = None


class KinematicsPlanIn(Body):
    """Limits of a machine's runs; what is left out is not limited."""

    ball_radius: Annotated[Ball | None, Field(description="Q407 of the ball that is used here.")] = None
    max_modification: Annotated[
        Limit | None, Field(description="maxModification: a larger change, mm, has to be confirmed.")
    ] = None
    max_modification_angle: Annotated[Limit | None, Field(description="The same for how an axis leans, degrees.")] = (
        None
    )
    max_dev_cal_ball: Annotated[
        Limit | None, Field(description="maxDevCalBall: a ball radius further off, mm, ends the run.")
    ] = None
    reference_head: Annotated[
        Text200 | None, Field(description="The head that the others are compared with.", max_length=64)
    ] = None
    limits: Annotated[
        dict[str, Limit],
        Field(
            default_factory=dict,
            max_length=60,
            description="Of the drift, by the name of a value (EX0C, Q146, backlash.C): mm, degrees.",
        ),
    ]
    characteristics: Annotated[
        dict[str, Slug],
        Field(
            default_factory=dict,
            max_length=60,
            description="Values that become readings, with the key of the characteristic. Angles become mm over 1 m.",
        ),
    ]
    reason: Reason

    @model_validator(mode="after")
    def _known_names(self) -> Self:
        for field, names in (("limits", self.limits), ("characteristics", self.characteristics)):
            for name in names:
                if name not in UNITS:
                    raise PydanticCustomError(
                        "unknown_value",
                        _(
                            "{field}: there is no value {name}; there are EX0C, EY0C, EA0C, Q141 to Q149, backlash.C …"
                        ).format(field=field, name=repr(name[:40])),
                        {"at": field},
                    )
        return self
