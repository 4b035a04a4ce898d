"""Runs as they are answered. Lengths in mm, angles in degrees."""

from collections.abc import Mapping
from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from app.core.rotary.axis import ERRORS, AxisName
from app.core.rotary.results import MEASURED, OFFSETS, OPTIMISED, STRINGS, write_string
from app.geometry.rotary_axes import wording
from app.geometry.rotary_axes.queries import RunRow
from app.geometry.rotary_axes.tables import KinematicsRun
from app.web.fields import answer_from
from app.web.warnings import Warnings, warnings_out

Status = Literal["refused", "to_confirm", "confirmed", "measured", "entered"]


class EstimateOut(BaseModel):
    """A value with its standard deviation; none where the run does not state it."""

    value: Annotated[float, Field(description="The value, mm or degrees as its field says.")]
    deviation: Annotated[
        float | None, Field(description="Its standard deviation; null where the run does not state it.")
    ]


class PositionOut(BaseModel):
    """One position: deviations X Y Z before (red in the diagram) and after (green)."""

    angle: Annotated[float, Field(description="Of the axis, degrees.")]
    approach: Annotated[int, Field(description="1 from the negative side, −1 from the positive, 0 not said.")]
    measured: Annotated[list[float | None], Field(description="Deviation X Y Z before, mm; null: not stated.")]
    optimised: Annotated[
        list[float | None], Field(description="Deviation X Y Z that the errors leave, mm; null: not stated.")
    ]


class AxisOut(BaseModel):
    """One rotary axis, with everything that the control's protocol has."""

    axis: Annotated[AxisName, Field(description="Letter of the axis.")]
    carries: Annotated[str | None, Field(description="table or head; none where the control has reckoned it.")] = None
    errors: Annotated[
        dict[str, EstimateOut],
        Field(
            description="EX0C EY0C EA0C EB0C of C; cyclic for A and B. From where the control believes the axis to where it "
            "is: what has to be added to its kinematics."
        ),
    ]
    backlash: Annotated[
        EstimateOut | None, Field(description="Of the axis, degrees; null where it was not approached from both sides.")
    ]
    scatter_before: Annotated[float | None, Field(description="Q141 to Q143: rms of the deviations.")]
    scatter_after: Annotated[float | None, Field(description="Q144 to Q146: rms of what the errors leave.")]
    greatest_before: Annotated[float | None, Field(description="Largest deviation before, mm.")]
    greatest_after: Annotated[float | None, Field(description="Largest deviation that the errors leave, mm.")]
    mean_error: Annotated[float | None, Field(description="Mean positioning error: mean length of what is left.")]
    angle_error: Annotated[float | None, Field(description="The largest that is left, as an angle about the axis.")]
    radius: Annotated[float | None, Field(description="Of the measuring circle.")]
    start_angle: Annotated[float | None, Field(description="Angle of the first position, degrees.")]
    end_angle: Annotated[float | None, Field(description="Angle of the last position, degrees.")]
    points: Annotated[int | None, Field(description="Number of positions.")]
    incidence: Annotated[float | None, Field(description="Where it stood while the other axes were measured, degrees.")]
    angles: Annotated[list[float], Field(description="Angles of the positions, degrees, in the order of the control.")]
    ball: Annotated[list[float] | None, Field(description="Nominal centre of the ball at the angle 0, X Y Z, mm.")]
    shift: Annotated[list[EstimateOut] | None, Field(description="How far the ball lies from its nominal centre.")]
    correction: Annotated[
        list[float] | None, Field(description="Where the axis has to go, X Y Z; none where the run does not say it.")
    ]
    position_before: Annotated[list[float] | None, Field(description="Where the control had the axis, X Y Z, mm.")]
    position_after: Annotated[list[float] | None, Field(description="Where it lies by this run, X Y Z, mm.")]
    positions: Annotated[list[PositionOut], Field(description="Every position, with the deviations before and after.")]
    arc: Annotated[float | None, Field(description="The smallest arc that holds the positions, degrees.")]
    condition: Annotated[
        float | None,
        Field(description="Condition of the least squares, largest by smallest singular value; 1 is best."),
    ]
    freedom: Annotated[int | None, Field(description="Degrees of freedom that are left to judge by.")]
    noise: Annotated[float | None, Field(description="Standard deviation of one coordinate of a centre.")]


class RunReasonOut(BaseModel):
    """Reason for the outcome."""

    code: Annotated[str, Field(description="measured, max_modification, max_dev_cal_ball.")]
    text: str


class DecidedOut(BaseModel):
    """Decision: by whom, when and for which reason."""

    at: datetime
    by: str
    reason: str


class RunOut(BaseModel):
    """A run of the preset compensation. Lengths in mm, angles in degrees."""

    run: Annotated[int, Field(description="Number of the run.")]
    machine: str
    form: Annotated[str, Field(description="touches, centres, results or protocol.")]
    head: Annotated[str | None, Field(description="The interchangeable head that was in; null: it is not said.")]
    program: Annotated[str | None, Field(description="NC program; sent, or read from the protocol.")] = None
    tool: Annotated[str | None, Field(description="Name of the touch probe.")] = None
    kinematics: Annotated[str | None, Field(description="Name of the active kinematics.")] = None
    mode: Annotated[str | None, Field(description="How the cycle was run.")] = None
    status: Annotated[
        Status,
        Field(
            description="refused: the ball was wrong; to_confirm: its change is larger than permitted, or there are "
            "warnings; confirmed; measured; entered on the control."
        ),
    ]
    reason: RunReasonOut
    measured_at: datetime
    received_at: datetime
    by: str
    key: str | None
    axes: Annotated[list[AxisOut], Field(description="Every axis that was measured.")]
    offsets: Annotated[dict[str, float | None] | None, Field(description="Q147 to Q149: shift of the ball in X, Y, Z.")]
    parameters: Annotated[
        dict[str, float | str],
        Field(
            description="The same as the control's result parameters. While the run is `to_confirm` only the scatter, Q141 to "
            "Q146: nothing that could be entered."
        ),
    ]
    balls: Annotated[list[dict[str, float | None]], Field(description="Every ball that was found from touches.")]
    not_understood: Annotated[list[str], Field(description="What of the protocol or the text was not understood.")]
    warnings: Warnings
    limits: Annotated[
        dict[str, float | None],
        Field(description="The machine's limits that it was judged by, mm and degrees; null: not limited."),
    ]
    overtaken: Annotated[bool, Field(description="The kinematics is not the one it was measured on.")]
    undone: Annotated[bool, Field(description="It was entered, and the kinematics in effect is without it again.")]
    confirmed: Annotated[
        DecidedOut | None,
        Field(description="Who confirmed a change larger than permitted; null: nobody, or there was no need."),
    ]
    entered: Annotated[DecidedOut | None, Field(description="Who entered its values on the control; null: nobody.")]
    given: Annotated[dict[str, Any], Field(description="As it was sent.")]


def run_out(row: RunRow) -> RunOut:
    """A run as it is answered."""
    run, results = row.run, row.run.results
    return answer_from(
        RunOut,
        run,
        run=run.id,
        machine=row.machine.key,
        head=run.head or None,
        **{name: said_of(run).get(name) for name in ("program", "tool", "kinematics", "mode")},
        status=row.status,
        reason=RunReasonOut(code=run.reason["code"], text=wording.sentence(run)),
        by=run.actor,
        axes=[axis_out(axis) for axis in results["axes"]],
        offsets=results["offsets"],
        parameters=parameters_of(row),
        balls=results["balls"],
        not_understood=results["notes"],
        warnings=warnings_out(row.warnings, wording.warning),
        overtaken=row.overtaken,
        undone=row.undone,
        confirmed=_decided(row, "confirmed"),
        entered=_decided(row, "entered"),
    )


def said_of(run: KinematicsRun) -> dict[str, str]:
    """Head of the run: the texts that were sent, or read in the control's protocol."""
    return dict(run.results.get("head") or {}) | {name: v for name, v in run.given.items() if isinstance(v, str)}


def axis_out(axis: Mapping[str, Any]) -> AxisOut:
    """An axis as it is answered, with its errors in the order of the result string."""
    errors = {name: axis["errors"][name] for name in ERRORS[axis["axis"]] if name in axis["errors"]}
    return AxisOut.model_validate({**axis, "errors": errors})


def _decided(row: RunRow, what: str) -> DecidedOut | None:
    decision = row.decisions.get(what)
    return None if decision is None else DecidedOut(at=decision.at, by=decision.actor, reason=decision.reason)


def parameters_of(row: RunRow) -> dict[str, float | str]:
    """The result parameters as the control leaves them: what is not known is not there.

    While the run waits to be confirmed only the scatter is there, and nothing that could be entered on the control.
    """
    results = row.run.results
    by_axis = {axis["axis"]: axis for axis in results["axes"]}
    parameters: dict[str, float | str] = {}
    for names, field in ((MEASURED, "scatter_before"), (OPTIMISED, "scatter_after")):
        for name, letter in names.items():
            value = by_axis.get(letter, {}).get(field)
            if value is not None:
                parameters[name] = value
    if row.status == "to_confirm":
        return parameters
    offsets = results["offsets"] or {}
    parameters |= {name: offsets[letter] for name, letter in OFFSETS.items() if offsets.get(letter) is not None}
    for name, axis in STRINGS.items():
        errors = by_axis.get(axis, {}).get("errors", {})
        if len(errors) == len(ERRORS[axis]):
            parameters[name] = write_string([errors[name_of_error]["value"] for name_of_error in ERRORS[axis]])
    return parameters


class RecomputedOut(BaseModel):
    """A run evaluated again from what was sent. What is on record stays as it is."""

    run: Annotated[int, Field(description="Number of the run.")]
    same: Annotated[bool, Field(description="It comes to what is on record.")]
    outcome: Annotated[str, Field(description="Status that it comes to now.")]
    axes: Annotated[list[AxisOut], Field(description="The axes as they come out now.")]
    offsets: Annotated[dict[str, float | None] | None, Field(description="Q147 to Q149 as they come out now, mm.")]
