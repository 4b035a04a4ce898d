"""Measuring plans of rotary axes as JSON: a call of cycle 451 or 452 before it is run. Lengths in mm, angles in degrees."""

from collections.abc import Iterable
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, Field, model_validator
from pydantic_core import PydanticCustomError

from app.core.programs.heidenhain import write_plan
from app.core.rotary.axis import AxisName
from app.core.rotary.measuring_plan import (
    MOST_POSITIONS,
    AxisPlan,
    FeedWord,
    MeasuringPlan,
    arc,
    positions,
    q_values,
    warnings,
)
from app.geometry.rotary_axes.plan_wording import sentence
from app.language.i18n import _
from app.web.fields import Body
from app.web.warnings import Warnings, warnings_out

Angle = Annotated[float, Field(strict=True, ge=-359.9999, le=359.9999, allow_inf_nan=False)]
Length = Annotated[float, Field(strict=True, ge=0, le=99_999.9999, allow_inf_nan=False)]


class AxisPlanIn(Body):
    """Measuring plan of one axis."""

    axis: Annotated[AxisName, Field(description="Letter of the axis.")]
    start: Annotated[Angle, Field(description="Q411, Q415, Q419: angle of the first position.")] = 0.0
    end: Annotated[Angle, Field(description="Q412, Q416, Q420: angle of the last position.")] = 0.0
    incidence: Annotated[
        Angle, Field(description="Q413, Q417, Q421: where it stands while the other axes are measured.")
    ] = 0.0
    points: Annotated[
        int, Field(strict=True, ge=0, le=MOST_POSITIONS, description="Q414, Q418, Q422: positions; 0, not measured.")
    ]
    teeth: Annotated[
        float | None, Field(strict=True, gt=0, le=90, description="Grid of its Hirth teeth, degrees; null: none.")
    ] = None
    travel: Annotated[
        list[Annotated[float, Field(strict=True, ge=-100_000, le=100_000)]] | None,
        Field(min_length=2, max_length=2, description="Its limit switches, lower and upper, degrees."),
    ] = None
    encoder: Annotated[bool, Field(strict=True, description="It has a position encoder of its own.")] = True

    @model_validator(mode="after")
    def _travel_in_order(self) -> Self:
        if self.travel is not None and self.travel[0] >= self.travel[1]:
            raise PydanticCustomError("travel", _("the lower limit switch must lie below the upper one"))
        return self


class MeasuringPlanIn(Body):
    """A call of cycle 451 or 452."""

    cycle: Annotated[Literal[451, 452], Field(description="451 measures the kinematics, 452 compensates the preset.")]
    ball_radius: Annotated[
        float, Field(strict=True, ge=0.0001, le=99.9999, description="Q407: exact radius of the calibration sphere.")
    ]
    clearance: Annotated[Length | Literal["PREDEF"], Field(description="Q320: added to SET_UP of the probe.")] = 0.0
    retract_height: Annotated[Length, Field(description="Q408: 0, no move there; not permitted with Hirth teeth.")] = (
        0.0
    )
    feed: Annotated[Length | FeedWord, Field(description="Q253: mm/min, or FMAX, FAUTO, PREDEF.")] = 750.0
    reference_angle: Annotated[float, Field(strict=True, ge=0, le=360, description="Q380.")] = 0.0
    touches: Annotated[int, Field(strict=True, ge=3, le=8, description="Q423: touches of the sphere in the plane.")] = 4
    backlash_angle: Annotated[float, Field(strict=True, ge=-3, le=3, description="Q432: 0, not measured.")] = 0.0
    mode: Annotated[int, Field(strict=True, ge=0, le=3, description="Q406, cycle 451 only.")] = 0
    preset: Annotated[int, Field(strict=True, ge=0, le=3, description="Q431, cycle 451 only.")] = 0
    memory: Annotated[int, Field(strict=True, ge=0, le=99_999, description="Q409: where cycle 450 saves before.")] = 0
    axes: Annotated[list[AxisPlanIn], Field(description="The axes to measure, each once.", max_length=3)]

    @model_validator(mode="after")
    def _each_axis_once(self) -> Self:
        letters = [axis.axis for axis in self.axes]
        if len(set(letters)) != len(letters):
            raise PydanticCustomError("twice", _("each axis may be in a plan once"))
        return self

    def plan(self) -> MeasuringPlan:
        """The same for the core."""
        axes = tuple(
            AxisPlan(
                axis.axis,
                axis.start,
                axis.end,
                axis.incidence,
                axis.points,
                axis.teeth,
                None if axis.travel is None else (axis.travel[0], axis.travel[1]),
                axis.encoder,
            )
            for axis in self.axes
        )
        settings = self.model_dump(exclude={"axes", "memory"})
        return MeasuringPlan(axes=axes, **settings)


class AxisPositionsOut(BaseModel):
    """Measuring positions of an axis."""

    axis: Annotated[AxisName, Field(description="Letter of the axis.")]
    positions: Annotated[list[float], Field(description="Angles, in the order of the control.")]
    arc: Annotated[float, Field(description="The smallest arc that holds them.")]


class MeasuringPlanOut(BaseModel):
    """A plan as the control runs it. Nothing was stored."""

    order: Annotated[list[AxisName], Field(description="The control measures A, then B, then C.")]
    axes: Annotated[list[AxisPositionsOut], Field(description="The positions of each axis.")]
    values: Annotated[dict[str, float | str], Field(description="The Q parameters of the call.")]
    warnings: Warnings
    text: Annotated[str, Field(description="The program: cycle 450, the call, and the result strings taken apart.")]


def plan_out(plan: MeasuringPlan, memory: int) -> MeasuringPlanOut:
    return MeasuringPlanOut(
        order=[axis.axis for axis in plan.order],
        axes=[AxisPositionsOut(axis=axis.axis, positions=list(positions(axis)), arc=arc(axis)) for axis in plan.order],
        values=q_values(plan),
        warnings=warnings_out(warnings(plan), sentence),
        text=write_plan(plan, memory),
    )


def from_q(values: dict[str, Any], axes: Iterable[dict[str, Any]]) -> dict[str, Any]:
    """The fields of the API from Q parameters by their numbers, and what is said of each axis beside."""
    names = {
        "Q407": "ball_radius",
        "Q320": "clearance",
        "Q408": "retract_height",
        "Q253": "feed",
        "Q380": "reference_angle",
        "Q423": "touches",
        "Q432": "backlash_angle",
        "Q406": "mode",
        "Q431": "preset",
        "Q409": "memory",
        "cycle": "cycle",
    }
    return {name: values[q] for q, name in names.items() if values.get(q) is not None} | {"axes": list(axes)}
