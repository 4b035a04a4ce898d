"""The gain of a tool's corrections, from the readings of each characteristic on it. Never writes. Lengths in mm."""

from typing import NamedTuple

import numpy as np
from sqlalchemy import func, literal_column, select
from sqlalchemy.orm import Session

from app.core.measured_gain import Gain, GainVerdict, gain_of
from app.core.opposite_effect import expected_scatter, overdone
from app.core.parameters import Parameters
from app.loop.tables.alarms import Alarm
from app.loop.tables.characteristics import Characteristic, ParametersVersion
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Exclusion, Reading, Stream
from app.loop.tables.tools import OPPOSITE, STRONG, Tool
from app.loop.tools.effect_alarm_kinds import UNUSUAL_GAIN

NEWEST = 200  # readings that are looked at
VERDICTS = {
    OPPOSITE: GainVerdict.OPPOSITE,
    STRONG: GainVerdict.STRONG,
}  # by the alarm that pauses the tool for its gain
NOT_OF_GAIN = ("implausible", "imported")  # codes of readings that say nothing of it


class ToolGain(NamedTuple):
    """The gain of the corrections of a tool, as one characteristic shows it; None where it does not tell."""

    characteristic_id: int
    characteristic: str
    factor: float
    gain: Gain | None


def gains(session: Session, machine: Machine, number: int) -> list[ToolGain]:
    """The gain of this tool's corrections by each characteristic on it, since the tool was changed or the pause before ended."""
    streams = session.execute(
        select(Stream, Characteristic.key, ParametersVersion.parameters)
        .join(
            Characteristic,
            (Characteristic.machine_id == Stream.machine_id) & (Characteristic.id == Stream.characteristic_id),
        )
        .join(
            ParametersVersion,
            (ParametersVersion.machine_id == Stream.machine_id)
            & (ParametersVersion.characteristic_id == Stream.characteristic_id)
            & (ParametersVersion.version == Stream.parameters_version),
        )
        .where(Stream.machine_id == machine.id, Stream.tool_memory == number)
        .order_by(Characteristic.key)
    ).all()
    found = []
    for stream, key, stored in streams:
        parameters = Parameters.from_dict(stored)
        found.append(ToolGain(stream.characteristic_id, key, parameters.factor, _gain(session, stream, parameters)))
    return found


def shown_gains(session: Session, machine: Machine, number: int) -> list[ToolGain]:
    """The same for people. While the tool is paused for what corrections did, that is the gain known last."""
    found, pausing = gains(session, machine, number), paused_for(session, machine.id, number)
    if pausing is None:
        return found
    gain, half = pausing.data["gain"], 2 * pausing.data["error"]
    known = Gain(gain, gain - half, gain + half, len(pausing.data["corrections"]), 0, VERDICTS[pausing.kind])
    of = pausing.data["characteristic"]
    return [each._replace(gain=each.gain or known) if each.characteristic == of else each for each in found]


def paused_for(session: Session, machine_id: int, number: int) -> Alarm | None:
    """The alarm that has paused the tool for its gain, if one has."""
    return session.scalars(
        select(Alarm)
        .join(Tool, (Tool.machine_id == Alarm.machine_id) & (Tool.paused_by == Alarm.id))
        .where(Tool.machine_id == machine_id, Tool.number == number, Alarm.kind.in_(VERDICTS))
    ).one_or_none()


def _gain(session: Session, stream: Stream, parameters: Parameters) -> Gain | None:
    at = (Reading.machine_id == stream.machine_id, Reading.characteristic_id == stream.characteristic_id)
    answered = (
        select(func.max(Alarm.acknowledged_at))
        .where(
            Alarm.machine_id == stream.machine_id,
            Alarm.characteristic_id == stream.characteristic_id,
            Alarm.kind == UNUSUAL_GAIN.name,
        )
        .scalar_subquery()
    )
    excluded = select(Exclusion.sequence).where(
        Exclusion.machine_id == stream.machine_id, Exclusion.characteristic_id == stream.characteristic_id
    )
    rows = session.execute(
        select(Reading.deviation, Reading.compensated)
        .where(
            *at,
            Reading.sequence > max(stream.gain_from, stream.sequence - NEWEST),
            Reading.compensated.is_not(None),
            ~Reading.late,
            Reading.zone != "probe_fault",
            Reading.code.not_in(NOT_OF_GAIN),
            Reading.sequence.not_in(excluded),
            Reading.received_at > func.coalesce(answered, literal_column("'-infinity'::timestamptz")),
        )
        .order_by(Reading.sequence)
    ).all()
    table = np.array([tuple(row) for row in rows], np.float64).reshape(-1, 2)
    deviation, compensated = table[:, 0], table[:, 1]
    expected = expected_scatter(parameters.zero_range, parameters.averaging_limit)
    if len(table) and (found := overdone(deviation, compensated, parameters.factor, expected)):
        gain, half = found[0], 2 * found[1]
        return Gain(gain, gain - half, gain + half, 2, len(table), GainVerdict.STRONG)
    return gain_of(deviation, compensated, parameters.factor)
