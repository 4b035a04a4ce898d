"""Work zeros and fixtures as they are answered. Lengths in mm, angles in degrees."""

from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field
from sqlalchemy.orm import Session

from app.core.programs.frames import ZeroText, offset_of, write_restored, write_zero
from app.geometry.work_zero import queries, wording
from app.geometry.work_zero.evaluation import warnings_of
from app.geometry.work_zero.queries import Compared, FixtureRow
from app.geometry.work_zero.schemas import ApproachName, KindName
from app.geometry.work_zero.tables import Fixture, WorkZero
from app.loop.readings.queries import PushedResult
from app.loop.tables.machines import Machine
from app.loop.warnings.queries import acknowledgement, unacknowledged
from app.loop.warnings.wording import sentence
from app.web.fields import answer_from
from app.web.pushed import PushedOut
from app.web.warnings import Acknowledged, Warnings, acknowledged_out, warnings_out

State = Literal["unknown", "steady", "warning", "alarm"]
Basis = Literal["first", "median", "frozen"]
TEXT = "; INBAND WORK ZERO 12 FOR MILL-1: G54\n…\n$P_UIFR[1]=CTRANS(X,-306.01,Y,-154.25,Z,-299.85)\nM17\n"


class Notice(BaseModel):
    """Reason to check a zero before it is used."""

    code: str
    text: Annotated[str, Field(description="For people.")]


class ShiftOut(BaseModel):
    """A zero against what its fixture is compared with."""

    state: Annotated[State, Field(description="unknown: nothing to compare with, or no limit is set.")]
    shifts: Annotated[dict[str, float], Field(description="By axis.")]
    total: Annotated[float | None, Field(description="All axes together; this is what is held against the limits.")]
    reference: Annotated[int | None, Field(description="The work zero compared with; null for a median.")]
    text: Annotated[str, Field(description="For people.")]


class TouchOut(BaseModel):
    """A touch as it came in."""

    x: Annotated[float | None, Field(description="Position of the tip's centre, mm; null: it was not said.")] = None
    y: Annotated[float | None, Field(description="Position of the tip's centre, mm; null: it was not said.")] = None
    approach: Annotated[ApproachName | None, Field(description="Direction in which the tip was moved.")] = None


class ZeroOut(BaseModel):
    """A work zero with its size, its touches, and the text that sets it."""

    id: int
    machine: str
    kind: Annotated[KindName, Field(description="What was touched: a bore, boss, pocket, web or corner.")]
    work_offset: Annotated[str, Field(description="The control's work offset that it is for, such as G54.")]
    fixture: Annotated[str | None, Field(description="Key of the fixture; null: none was named.")]
    part: str | None
    x: Annotated[float | None, Field(description="X of the zero, mm; null: it is left as it is.")]
    y: Annotated[float | None, Field(description="Y of the zero, mm; null: it is left as it is.")]
    z: Annotated[float | None, Field(description="Z of the zero, mm; null: it is left as it is.")]
    rotation: Annotated[float | None, Field(description="Degrees, counter-clockwise seen from +Z.")]
    diameter: Annotated[float | None, Field(description="Of a bore or shaft, mm.")]
    length: Annotated[float | None, Field(description="Size along X.")]
    width: Annotated[float | None, Field(description="Size along Y.")]
    squareness: Annotated[float | None, Field(description="Degrees by which the angle of a corner differs from 90.")]
    uncertainty: Annotated[dict[str, float], Field(description="By result, 95 %; needs `repeatability`.")]
    touches: Annotated[list[TouchOut], Field(description="The touches, as they were sent.")]
    records: Annotated[
        list[float] | None,
        Field(description="X1, X2, Y1, Y2 as the printed macros recorded them, in place of touches, mm."),
    ] = None
    residuals: Annotated[list[float], Field(description="Per touch, positive into the material.")]
    tip: Annotated[float, Field(description="Diameter of the tip, mm; 0 where positions are of the surface.")]
    notices: Annotated[list[Notice], Field(description="Reasons to check it before it is used.")]
    warnings: Warnings
    acknowledged: Acknowledged
    program: Annotated[
        str,
        Field(
            description="For the machine's control; running it twice changes nothing. With warnings that nobody has "
            "acknowledged it begins with a block that stops the control."
        ),
    ]
    shift: Annotated[
        ShiftOut | None, Field(description="Against what its fixture is compared with; null: nothing to compare with.")
    ]
    readings: Annotated[list[PushedOut], Field(description="Its results as readings of characteristics.")]
    touched_at: Annotated[datetime, Field(description="When it was touched.")]
    received_at: datetime
    by: str
    key: str | None
    recomputed_from: Annotated[int | None, Field(description="The work zero whose touches were computed again.")]


class FixtureOut(BaseModel):
    """A fixture, what it is compared with, and how its last zero stands."""

    machine: str
    fixture: Annotated[str, Field(description="Key of the fixture.")]
    basis: Annotated[Basis, Field(description="What zeros are compared with: the first, the median, or a frozen one.")]
    reference: Annotated[int | None, Field(description="The work zero that they are compared with; null for a median.")]
    warning: Annotated[float | None, Field(description="A shift from which on there is a warning, mm; null: never.")]
    alarm: Annotated[float | None, Field(description="A shift from which on there is an alarm, mm; null: never.")]
    characteristics: Annotated[
        dict[str, str], Field(description="Shifts that become readings, by axis, with the key of the characteristic.")
    ]
    zeros: Annotated[int, Field(description="How many were found in it.")]
    last: Annotated[int, Field(description="The last work zero.")]
    shift: ShiftOut


def program_of(
    zero: WorkZero,
    machine: Machine,
    control: str | None = None,
    *,
    stop: Sequence[str] = (),
    restore: bool = False,
) -> str | None:
    """The text that sets it on its machine, or on another control; None for a control without such a work offset.

    stop: codes of warnings that are not acknowledged; the text does not run then. restore: the text that sets the offset
    back to what it was before.
    """
    offset = offset_of(control or machine.control, zero.work_offset)
    if offset is None and control is None:  # the machine had another control then
        offset = offset_of("other", zero.work_offset)
    if offset is None:
        return None
    title = f"INBAND WORK ZERO {zero.id} FOR {machine.key.upper()}"
    # Turned about a place along the other axis that nobody touched, the part would lie elsewhere than it was found.
    rotation = None if zero.x is None or zero.y is None else zero.rotation
    text = ZeroText(title, offset, zero.x, zero.y, zero.z, rotation, tuple(stop), zero.id)
    return (write_restored if restore else write_zero)(control or machine.control, text)


def stop_of(session: Session, zero: WorkZero, machine: Machine) -> list[str]:
    """The codes of the warnings that stop its program text; none once a person has acknowledged them."""
    return unacknowledged(session, machine.id, queries.subject_of(zero), warnings_of(zero, machine))


def shift_out(compared: Compared, basis: str) -> ShiftOut:
    """Comparison of a zero with its fixture's reference."""
    against = wording.basis_word(basis, compared.reference)
    return ShiftOut(
        state=compared.state.value,
        shifts=compared.shifts,
        total=compared.total,
        reference=compared.reference,
        text=wording.shift(compared.shifts, against),
    )


def zeros_out(session: Session, zeros: Sequence[WorkZero]) -> list[ZeroOut]:
    """Work zeros as they are answered."""
    pushed = queries.pushed(session, zeros)
    places = {(zero.machine_id, zero.fixture) for zero in zeros if zero.fixture is not None}
    watched = {place: queries.settings_of(session, *place) for place in places}
    return [
        _zero_out(session, zero, pushed[zero.id], watched.get((zero.machine_id, zero.fixture or ""))) for zero in zeros
    ]


def zero_out(session: Session, zero: WorkZero) -> ZeroOut:
    """A work zero as it is answered."""
    return zeros_out(session, [zero])[0]


def _zero_out(session: Session, zero: WorkZero, pushed: Sequence[PushedResult], settings: Fixture | None) -> ZeroOut:
    machine = session.get_one(Machine, zero.machine_id)
    compared = queries.compared(session, zero, settings)
    basis = "first" if settings is None else settings.basis
    inputs: dict[str, Any] = zero.given
    warnings = warnings_of(zero, machine)
    acknowledged = acknowledgement(session, machine.id, queries.subject_of(zero)) if warnings else None
    return answer_from(
        ZeroOut,
        zero,
        machine=machine.key,
        squareness=zero.result["squareness"],
        uncertainty=zero.result["uncertainty"],
        touches=[TouchOut(**touch) for touch in inputs.get("touches") or ()],
        records=inputs.get("records"),
        residuals=zero.result["residuals"],
        tip=inputs["tip"],
        notices=[Notice(code=code, text=wording.notice(code)) for code in zero.result["notices"]],
        warnings=warnings_out(warnings, sentence),
        acknowledged=acknowledged_out(acknowledged),
        program=program_of(zero, machine, stop=[] if acknowledged else [warning.code for warning in warnings]) or "",
        shift=None if compared is None else shift_out(compared, basis),
        readings=[PushedOut(**result._asdict()) for result in pushed],
        by=zero.actor,
    )


def fixture_out(row: FixtureRow) -> FixtureOut:
    """A fixture as it is answered."""
    settings = row.settings
    return answer_from(
        FixtureOut,
        settings,
        machine=row.machine.key,
        fixture=row.key,
        zeros=row.zeros,
        last=row.last.zero.id,
        shift=shift_out(row.last, settings.basis),
    )
