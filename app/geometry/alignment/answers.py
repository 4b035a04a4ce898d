"""Alignments as they are answered. Lengths in mm, angles in degrees."""

from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field
from sqlalchemy.orm import Session

from app.core.decision.step import rounded
from app.core.geometry.frames import frame, from_angles
from app.core.geometry.in_plane import Table, Turned, by_table
from app.core.programs.frames import FrameText, offset_of, write_frame, write_restored
from app.geometry.alignment import queries, wording
from app.geometry.alignment.evaluation import warnings_of
from app.geometry.alignment.schemas import MethodName
from app.geometry.alignment.tables import Alignment
from app.loop.tables.machines import Machine
from app.loop.warnings.queries import acknowledgement, unacknowledged
from app.loop.warnings.wording import sentence
from app.web.fields import answer_from
from app.web.pushed import PushedOut
from app.web.warnings import Acknowledged, Warnings, acknowledged_out, warnings_out

Kind = Literal["points", "two_points", "two_holes", "pallet"]
TEXT = "; INBAND ALIGNMENT 7 FOR MILL-1\n; …\n$P_UIFR[1]=CTRANS(X,-306.06,Y,-154.16,Z,-299.84):CROT(X,0.01,Y,-0.01,Z,-0.118)\nM17\n"


class Shift(BaseModel):
    """Shift of the part's origin, mm."""

    a: Annotated[float, Field(description="Along X, mm.")]
    b: Annotated[float, Field(description="Along Y, mm.")]
    c: Annotated[float, Field(description="Along Z, mm.")]


class Angles(BaseModel):
    """As a frame takes them: about Z, then the new Y, then the new X; degrees."""

    x: Annotated[float, Field(description="About the new X.")]
    y: Annotated[float, Field(description="About the new Y.")]
    z: Annotated[float, Field(description="About Z, which comes first.")]


class Turns(BaseModel):
    """The one turn about an axis in space, by its components about X, Y, Z; degrees."""

    model_config = ConfigDict(serialize_by_alias=True, populate_by_name=True)

    lambda_: Annotated[float, Field(description="About X, degrees.", alias="lambda")]
    beta: Annotated[float, Field(description="About Y, degrees.")]
    gamma: Annotated[float, Field(description="About Z, degrees.")]


class Condition(BaseModel):
    """Quality of the layout: how well the probed points hold the part."""

    value: Annotated[float, Field(description="Largest by smallest singular value of the layout; 1 is best.")]
    text: Annotated[str, Field(description="For people.")]


class Advice(BaseModel):
    """One touch more that would help most."""

    place: Annotated[list[float], Field(description="Where to touch, X Y Z, mm.")]
    normal: Annotated[list[float], Field(description="Normal of the surface there.")]
    gain: Annotated[float | None, Field(description="How many times as certain the least certain motion becomes.")]
    text: Annotated[str, Field(description="For people.")]


class RotaryTableOut(BaseModel):
    """Command for a rotary table."""

    axis: Annotated[str, Field(description="The table's axis.")]
    turn: Annotated[float, Field(description="Of the part about Z, counter-clockwise positive.")]
    position: Annotated[float, Field(description="To command.")]
    shift: Annotated[Shift, Field(description="What is left for the frame after the table has turned.")]
    angles: Angles


class AlignmentOut(BaseModel):
    """Position and rotation of a part, their uncertainty, the probed points, and the program that sets the frame."""

    id: int
    machine: str
    kind: Annotated[
        Kind, Field(description="What was touched: points of any surfaces, two points, two holes, or a pallet.")
    ]
    method: Annotated[MethodName, Field(description="By which the motion was computed.")]
    name: str | None
    part: str | None
    shift: Shift
    angles: Angles
    turns: Turns
    matrix: Annotated[list[list[float]], Field(description="4 × 4: a nominal point r lies at matrix · (r, 1).")]
    uncertainty: Annotated[dict[str, float], Field(description="By unknown, 95 %; needs `repeatability`.")]
    touches: Annotated[list[dict[str, Any]], Field(description="What was touched, as it was sent.")]
    deviations: Annotated[list[float], Field(description="Actual less nominal along the normal.")]
    residuals: Annotated[list[float], Field(description="What is left of each touch.")]
    leverage: Annotated[list[float], Field(description="1: nothing checks this touch.")]
    condition: Annotated[
        Condition | None, Field(description="Quality of the layout of the touches; null: it has none.")
    ]
    misfits: Annotated[
        list[list[int]],
        Field(description="Touches that do not fit, from 1; several together where any of them may be the one."),
    ]
    weakest: Annotated[str | None, Field(description="The least certain motion, in words; null: there is none.")]
    advice: Annotated[Advice | None, Field(description="One touch more that would help most; null: none is needed.")]
    difference: Annotated[
        float | None,
        Field(description="How far small angles would have put a touch from where the exact solution does."),
    ]
    off: Annotated[float | None, Field(description="Of two holes: distance found less nominal distance.")]
    table: Annotated[RotaryTableOut | None, Field(description="Command for the rotary table; null: there is none.")]
    warnings: Warnings
    acknowledged: Acknowledged
    program: Annotated[
        str,
        Field(
            description="For the machine's control; running it twice changes nothing. With warnings that nobody has "
            "acknowledged it begins with a block that stops the control."
        ),
    ]
    readings: Annotated[list[PushedOut], Field(description="Its results as readings of characteristics.")]
    pallet: Annotated[int | None, Field(description="The alignment of the pallet that this is composed with.")]
    part_on_pallet: Annotated[
        int | None, Field(description="The alignment of the part on its pallet that this is composed with.")
    ]
    given: Annotated[dict[str, Any], Field(description="All it was computed from.")]
    aligned_at: Annotated[datetime, Field(description="When the part was touched.")]
    received_at: datetime
    by: str
    key: str | None
    recomputed_from: Annotated[int | None, Field(description="The alignment whose touches were computed again.")]


def turned_table(alignment: Alignment) -> Turned | None:
    """Command for the rotary table, if there is one."""
    table = alignment.given.get("table")
    if table is None:
        return None
    rotary_table = Table((table["centre"][0], table["centre"][1]), table["position"], table["clockwise"])
    return by_table(np.array(alignment.result["matrix"]), rotary_table)


def program_of(
    alignment: Alignment,
    machine: Machine,
    control: str | None = None,
    *,
    stop: Sequence[str] = (),
    restore: bool = False,
) -> str | None:
    """The text that puts the frame where the part lies; None for another control that has not its work offset.

    stop: codes of warnings that are not acknowledged; the text does not run then. restore: the text that sets the work
    offset back to what it was before; None where none is kept.
    """
    inputs = alignment.given
    turned = turned_table(alignment)
    offset = offset_of(control or machine.control, inputs["work_offset"]) if "work_offset" in inputs else None
    if control is not None and offset is None and "work_offset" in inputs:
        return None
    base = None if offset is None else (offset, dict(zip("XYZ", inputs["base"], strict=True)))
    # The angles as they are stored, so that a turn of nothing is written as none.
    motion = frame(from_angles(*alignment.result["angles"]), alignment.result["shift"])
    text = FrameText(
        f"INBAND ALIGNMENT {alignment.id} FOR {machine.key.upper()}",
        motion if turned is None else turned.motion,
        base,
        None if turned is None else (inputs["table"]["axis"], turned.position),
        tuple(stop),
        alignment.id,
    )
    return (write_restored if restore else write_frame)(control or machine.control, text)


def stop_of(session: Session, alignment: Alignment, machine: Machine) -> list[str]:
    """The codes of the warnings that stop its program text; none once a person has acknowledged them."""
    return unacknowledged(session, machine.id, queries.subject_of(alignment), warnings_of(alignment, machine))


def _shift(values: Any) -> Shift:
    a, b, c = (rounded(float(value)) for value in values)
    return Shift(a=a, b=b, c=c)


def alignment_out(session: Session, alignment: Alignment) -> AlignmentOut:
    """An alignment as it is answered."""
    machine = session.get_one(Machine, alignment.machine_id)
    result, inputs = alignment.result, alignment.given
    warnings = warnings_of(alignment, machine)
    acknowledged = acknowledgement(session, machine.id, queries.subject_of(alignment)) if warnings else None
    x, y, z = result["angles"]
    turns = dict(zip(("lambda", "beta", "gamma"), result["turns"], strict=True))
    advised = result.get("advice")
    table = None
    if (turned := turned_table(alignment)) is not None:
        left = FrameText("", turned.motion).angles
        table = RotaryTableOut(
            axis=inputs["table"]["axis"],
            turn=round(turned.turn, 10),
            position=round(turned.position, 10),
            shift=_shift(turned.motion[:3, 3]),
            angles=Angles(x=left["X"], y=left["Y"], z=left["Z"]),
        )
    return answer_from(
        AlignmentOut,
        alignment,
        machine=machine.key,
        shift=_shift(result["shift"]),
        angles=Angles(x=x, y=y, z=z),
        turns=Turns.model_validate(turns),
        matrix=result["matrix"],
        uncertainty=result["uncertainty"],
        touches=inputs.get("touches") or inputs.get("side") or inputs.get("holes") or [],
        deviations=result.get("deviations", []),
        residuals=result.get("residuals", []),
        leverage=result.get("leverage", []),
        condition=Condition(value=result["condition"], text=wording.condition(result["condition"]))
        if "condition" in result
        else None,
        misfits=result.get("misfits", []),
        weakest=wording.weakest(result["weakest"]) if result.get("weakest") else None,
        advice=None if advised is None else Advice(**advised, text=wording.advice(advised)),
        difference=result.get("difference"),
        off=result.get("off"),
        table=table,
        warnings=warnings_out(warnings, sentence),
        acknowledged=acknowledged_out(acknowledged),
        program=program_of(alignment, machine, stop=[] if acknowledged else [warning.code for warning in warnings])
        or "",
        readings=[PushedOut(**result._asdict()) for result in queries.pushed(session, alignment)],
        pallet=alignment.pallet_id,
        part_on_pallet=alignment.part_id,
        given=inputs,
        by=alignment.actor,
    )
