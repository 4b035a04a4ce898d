"""A decided reading as the contract words it: the same for the first answer, a repeated one, and a look into the record."""

from collections.abc import Iterable
from datetime import datetime
from typing import Any

from pydantic import BaseModel

from app.core.compensation import Action, needs_approval
from app.core.parameters import Parameters
from app.readings.records import Record
from app.readings.wording import reason


def answer(
    characteristic: str,
    record: Record,
    parameters: Parameters,
    *,
    correction: tuple[int, float] | None,
    alarms: Iterable[tuple[int, str]],
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
        "decided_deviation": record.decided,
        "outstanding": record.outstanding or [],
        "zone": record.zone,
        "average_before": record.average_before,
        "average_after": record.average_after,
        "action": record.action,
        "correction": issued,
        "alarms": [{"id": number, "kind": kind} for number, kind in alarms],
        "reason": reason(record, parameters, correction[1] if correction else None),
        "parameters_version": record.parameters_version,
    }


class IssuedCorrection(BaseModel):
    """The correction that a reading led to, as it was issued; `amount` is in offset units, mm."""

    number: int
    tool_memory: int
    amount: float
    status: str


class RaisedAlarm(BaseModel):
    """An alarm that a reading raised, or repeated while it was active."""

    id: int
    kind: str


class WhySo(BaseModel):
    """Why it was decided so: a code for programs, sentences for people, and codes of what else was considered."""

    code: str
    text: str
    notes: list[str]


class ReadingAnswer(BaseModel):
    """The answer to one reading. Lengths in mm; `deviation` is raw, `decided_deviation` counts outstanding corrections."""

    characteristic: str
    sequence: int
    key: str | None
    part: str | None
    measured: float
    measured_at: datetime
    received_at: datetime
    late: bool
    deviation: float
    decided_deviation: float
    outstanding: list[int]
    zone: str
    average_before: float
    average_after: float
    action: str
    correction: IssuedCorrection | None
    alarms: list[RaisedAlarm]
    reason: WhySo
    parameters_version: int


class Excluded(BaseModel):
    """Who took a reading out of the statistics, when and why."""

    at: datetime
    by: str
    reason: str


class ReadingRow(ReadingAnswer):
    """A stored reading."""

    excluded: Excluded | None


class ReadingDetail(ReadingRow):
    """A stored reading with everything about it."""

    touches: list[list[float]] | None
    machined_at: datetime | None
    correction_in_effect: int | None
