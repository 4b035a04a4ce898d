"""A decided reading as the contract words it: the same for the first answer, a repeated one, and a look into the record."""

from collections.abc import Iterable
from datetime import datetime
from typing import Annotated, Any, Self

from pydantic import BaseModel, Field

from app.core.decision.decide import needs_approval
from app.core.decision.step import DECIMALS, Action
from app.core.parameters import Parameters
from app.core.probing import Touches
from app.core.temperature import AtReference, Missing
from app.core.variants import Results
from app.loop.expansion.wording import at_20_words
from app.loop.readings.by_hand.schemas import HandMeasurementOut
from app.loop.readings.records import Record
from app.loop.readings.wording import reason


def answer(
    characteristic: str,
    record: Record,
    parameters: Parameters,
    *,
    correction: tuple[int, float] | None,
    alarms: Iterable[tuple[int, str]],
    results: Results | None = None,
    measure_next: int | None = None,
    touches: Touches | None = None,
) -> dict[str, Any]:
    """The answer to the machine. `correction` is (R10, amount in mm) of the one this reading led to.

    The status is the one the correction had when it was issued, so that a repeated answer is the first one.
    """
    issued = None
    if correction is not None:
        if record.action == Action.HOLD:
            status = "held"
        else:
            status = "awaiting_approval" if needs_approval(parameters) else "pending"
        issued = {
            "number": record.correction,
            "tool_memory": correction[0],
            "amount": correction[1],
            "status": status,
        }
    return {
        "characteristic": characteristic,
        "sequence": record.sequence,
        "key": record.key,
        "part": record.part,
        "measured": record.measured,
        "measured_at": record.measured_at,
        "received_at": record.received_at,
        "late": record.late,
        "deviation": record.deviation,
        "size": round(parameters.target + record.deviation, DECIMALS),
        "decided_deviation": record.decided,
        "outstanding": list(record.outstanding or ()),
        "zone": record.zone,
        "results": None if results is None else results._asdict(),
        "average_before": record.average_before,
        "average_after": record.average_after,
        "action": record.action,
        "correction": issued,
        "alarms": [{"id": number, "kind": kind} for number, kind in alarms],
        "reason": reason(record, parameters, correction[1] if correction else None, touches),
        "parameters_version": record.parameters_version,
        "measure_next": measure_next,
    }


class IssuedCorrection(BaseModel):
    """The correction that a reading led to, as it was issued."""

    number: Annotated[int, Field(description="Counts per machine, without gaps; confirm it by this number.")]
    tool_memory: Annotated[int, Field(description="R10: the tool memory location whose offset is to be changed.")]
    amount: Annotated[float, Field(description="Add this to the offset, mm.")]
    status: Annotated[
        str,
        Field(
            description="As it was issued. pending: apply it; held or awaiting_approval: a person decides first, so do not. What has "
            "become of it since: GET /corrections/{machine}/{number}."
        ),
    ]


class RaisedAlarm(BaseModel):
    """An alarm that a reading raised, or repeated while it was active."""

    id: Annotated[int, Field(description="Number of the alarm.")]
    kind: Annotated[str, Field(description="oversize, undersize, tool_worn, probe_fault, acceptance, offset_limit …")]


class WhySo(BaseModel):
    """The reason of a decision."""

    code: Annotated[str, Field(description="For programs.")]
    text: Annotated[str, Field(description="For people.")]
    notes: Annotated[
        list[str],
        Field(
            description="What else was considered: outstanding, part_out_of_tolerance, stops, clamped, empirical_value, late, inches."
        ),
    ]


class VariantResults(BaseModel):
    """Results of the measuring variant beside the value; null where it has no such thing. Lengths in mm."""

    run_out: Annotated[float | None, Field(description="Part indexed (R25 = 1): half-difference of the sides.")]
    out_of_roundness: Annotated[float | None, Field(description="Points round (R25 = 2): their range.")]
    taper: Annotated[
        float | None, Field(description="Points along (R25 = 3): rise of the least-squares line over the length.")
    ]
    slope: Annotated[float | None, Field(description="The same per mm; null where the spacing R26 is not said.")]
    straightness: Annotated[
        float | None, Field(description="Points along, three and more: their range about that line.")
    ]
    repeat_range: Annotated[float | None, Field(description="Largest range of the repeats (R27) at one point.")]
    repeat_deviation: Annotated[float | None, Field(description="Pooled standard deviation of the repeats.")]
    sections_outside: Annotated[int | None, Field(description="With acceptance n of m: sections out of tolerance.")]
    rejected: Annotated[bool | None, Field(description="With acceptance n of m: too many sections are outside.")]


class ReadingAnswer(BaseModel):
    """The answer to one reading. Lengths in mm; `deviation` is raw, `decided_deviation` counts outstanding corrections."""

    characteristic: str
    sequence: Annotated[int, Field(description="Counts 1, 2, 3 … per characteristic, without gaps.")]
    key: Annotated[
        str | None, Field(description="The key that it was sent with; sent again with it, it is stored once.")
    ]
    part: Annotated[str | None, Field(description="Name or serial number of the part.")]
    measured: Annotated[
        float, Field(description="As the machine sent it, mm; of probed points, the value that they give.")
    ]
    measured_at: datetime
    received_at: datetime
    late: Annotated[bool, Field(description="Measured before a reading that had come in already.")]
    deviation: Annotated[float, Field(description="Measured - target - empirical value, as the part came out.")]
    size: Annotated[
        float, Field(description="Target + deviation, mm: the size that the drawing's limits are compared with.")
    ]
    decided_deviation: Annotated[
        float, Field(description="What it would have been with the outstanding corrections; decided by this.")
    ]
    outstanding: Annotated[
        list[int],
        Field(
            description="Numbers of the corrections that were not in effect yet when the part was cut; of more than a "
            "hundred the first. All of them count."
        ),
    ]
    zone: Annotated[str, Field(description="zero, average, full, oversize, undersize, wear or probe_fault.")]
    results: Annotated[
        VariantResults | None, Field(description="Results of the variant beside the value, where points were sent.")
    ]
    average_before: Annotated[float, Field(description="Running average M before this reading.")]
    average_after: Annotated[float, Field(description="M after it; 0 after a correction.")]
    action: Annotated[
        str, Field(description="none; correct: apply the correction; hold: a person decides; stop: stop the machine.")
    ]
    correction: Annotated[IssuedCorrection | None, Field(description="What this reading led to, if anything.")]
    alarms: Annotated[list[RaisedAlarm], Field(description="Alarms that it raised or repeated.")]
    reason: WhySo
    parameters_version: Annotated[int, Field(description="Which version of the parameters it was judged by.")]
    measure_next: Annotated[
        int | None,
        Field(
            description="By the control plan in force then, the part to measure next, counted from this one: 1 is the next part, 5 "
            "leaves out four. null: no plan counts parts, or the reading is late."
        ),
    ]


class Excluded(BaseModel):
    """The exclusion of a reading from the statistics."""

    at: datetime
    by: str
    reason: str


class ReadingContextOut(BaseModel):
    """The circumstances of a reading, as they were sent with it; null where nothing was said."""

    order: Annotated[str | None, Field(description="Number of the order.")] = None
    batch: Annotated[str | None, Field(description="Batch or heat of the material.")] = None
    nest: Annotated[int | None, Field(description="Number of the nest or cavity.")] = None
    spindle: Annotated[str | None, Field(description="The spindle that cut the part.")] = None
    fixture: Annotated[str | None, Field(description="The fixture, pallet or chuck in which it was cut.")] = None
    program: Annotated[str | None, Field(description="The program that cut it.")] = None
    operator: Annotated[str | None, Field(description="Who measured.")] = None
    machine: Annotated[str | None, Field(description="The machine that made the part, as the sender calls it.")] = None
    gauge: Annotated[str | None, Field(description="What it was measured with.")] = None
    by_hand: Annotated[
        bool | None,
        Field(description="true: a person measured it with a gauge; the empirical value (R11) is not taken off."),
    ] = None
    comment: Annotated[str | None, Field(description="Remark.")] = None
    events: Annotated[list[str] | None, Field(description="What happened at the part or before it.")] = None
    process: Annotated[dict[str, float] | None, Field(description="Process parameters by name.")] = None
    part_temperature: Annotated[float | None, Field(description="Temperature of the part, °C, as it was sent.")] = None
    machine_temperature: Annotated[
        float | None, Field(description="Temperature of the machine, °C, as it was sent.")
    ] = None
    fields: Annotated[
        dict[str, str] | None, Field(description="Further fields of a value in an AQDEF file, by their K number.")
    ] = None


class AtTwenty(BaseModel):
    """The size of a reading at 20 °C, the reference temperature of ISO 1; mm. The reading was decided by the size as it was measured."""

    size: Annotated[float | None, Field(description="Size at 20 °C; null: there is none, see `missing`.")]
    correction: Annotated[float | None, Field(description="Size at 20 °C less the measured one.")]
    uncertainty: Annotated[
        float | None,
        Field(
            description="Standard uncertainty of the correction, from temperatures and coefficients; null: none is stated."
        ),
    ]
    missing: Annotated[
        Missing | None,
        Field(
            description="The reason why there is no size at 20 °C: no `coefficient` is stated, one of the temperatures was not sent, or one "
            "cannot be true (`not_believed`: below −30 or above 150 °C)."
        ),
    ]

    text: Annotated[str, Field(description="The same in words.")]

    @classmethod
    def of(cls, found: AtReference | Missing | None) -> Self | None:
        """As it is answered; None of a reading without any temperature."""
        if found is None:
            return None
        text = at_20_words(found)
        if isinstance(found, Missing):
            return cls(size=None, correction=None, uncertainty=None, missing=found, text=text)
        return cls(**found._asdict(), missing=None, text=text)


class ReadingRow(ReadingAnswer):
    """A stored reading."""

    excluded: Annotated[Excluded | None, Field(description="If it was taken out of the statistics.")]
    at_20: Annotated[
        AtTwenty | None,
        Field(
            description="Its size at 20 °C, beside the measured one; null: no temperature was sent with it, or it is a probe fault."
        ),
    ]


class ReadingDetail(ReadingRow):
    """A stored reading with everything about it."""

    by_hand: Annotated[list[HandMeasurementOut], Field(description="What people measured on this part.")]
    touches: Annotated[
        list[list[float | None] | None] | None,
        Field(
            description="One list per point, each with its repeats, as they were sent; null for one that is missing."
        ),
    ]
    machined_at: Annotated[datetime | None, Field(description="When the part was cut; null: not said.")]
    correction_in_effect: Annotated[
        int | None,
        Field(
            description="Number of the last correction that was in the offset when the part was cut; null: not said."
        ),
    ]
    context: Annotated[ReadingContextOut | None, Field(description="Its circumstances, if any were sent.")]
