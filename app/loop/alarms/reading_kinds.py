"""Alarm kinds that a reading raises: the signals of the decision (`app.core.decision.decide.ReadingAlarm`)."""

from collections.abc import Callable, Mapping
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import object_session

from app.core.probing import TouchError
from app.language.formatting import NOTHING, age, as_read, read_um, tolerance_um
from app.language.i18n import _
from app.loop.alarms.kinds import AlarmKind, register
from app.loop.readings.wording import first_move_sentence, touch_problem
from app.loop.tables.alarms import Alarm
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.connections import Connection


def _deviation(alarm: Alarm, text: str) -> str:
    values = {
        "deviation": read_um(alarm.data.get("deviation"), alarm.data.get("limit")),
        "decided": read_um(alarm.data.get("decided"), alarm.data.get("limit")),
        "limit": tolerance_um(alarm.data.get("limit") or 0.0, alarm.data.get("natural_limit")),
    }
    return f"{text.format(tool=alarm.tool_memory, **values)}{_against(alarm)}"


def moved_by(step: Mapping[str, Any], half: float | None = None) -> str:
    """Word what corrections asked and did, as it stands in the values of an alarm. half: as of `deserved`, mm."""
    return _("correction {numbers} of {amount} asked for {asked} and the size changed by {done}").format(
        numbers="+".join(map(str, step.get("numbers") or ())) or NOTHING,
        amount=read_um(step.get("amount"), half),
        asked=read_um(step.get("asked"), half),
        done=read_um(step.get("done"), half),
    )


def _against(alarm: Alarm) -> str:
    """A sentence where the edge is not the cause, perhaps: the newest correction moved the size the wrong way, or a clock is behind."""
    if "lag" in alarm.data:
        text = _(
            "By the time of cutting that the machine sends, the part was cut {lag} before the reading came in, without corrections that "
            "are applied by now: if it was cut later, the clock of the machine is behind."
        )
        return " " + text.format(lag=age(alarm.data["lag"]))
    if "against" not in alarm.data:
        return ""
    text = _("The size went the wrong way: {step}. Check the sign of the factor and the offset register.")
    return " " + text.format(step=moved_by(alarm.data["against"], alarm.data.get("limit")))


def called(alarm: Alarm) -> str:
    """The name of the characteristic that an alarm of a tool or machine speaks of; its key where nobody can look."""
    key, session = str(alarm.data.get("characteristic")), object_session(alarm)
    name = select(Characteristic.name).where(Characteristic.machine_id == alarm.machine_id, Characteristic.key == key)
    return (None if session is None else session.scalar(name)) or key


def _so_far(alarm: Alarm) -> str:
    """A sentence that counts the parts, where it was more than one: nobody need have seen the first."""
    if (alarm.count or 1) < 2:
        return ""
    return " " + _("{n} parts so far, the last at {at}.").format(n=alarm.count, at=as_read(alarm.last_at, "minutes"))


def _tool_worn(alarm: Alarm) -> str:
    return f"{_worn(alarm)}{_went_on(alarm)}{cannot_be_stopped(alarm)}"


def _went_on(alarm: Alarm) -> str:
    """A sentence where `hold` has not stopped the machine, with the number of parts."""
    if (alarm.count or 1) < 2:
        return ""
    text = _("The machine went on cutting: {n} parts like this so far, the last at {at}.")
    return " " + text.format(n=alarm.count, at=as_read(alarm.last_at, "minutes"))


def _worn(alarm: Alarm) -> str:
    data = alarm.data
    if "decided" in data and abs(data["deviation"]) < data["limit"] <= abs(data["decided"]):
        text = _(
            "Deviation {deviation} counts as {decided}, which has reached the wear limit {limit}: corrections that are not confirmed are "
            "counted in. Either one of them is in the offset already, or the tool is worn or broken."
        )
        return _deviation(alarm, text)
    text = _("Deviation {deviation} has reached the wear limit {limit}: tool {tool} is worn or broken.")
    if alarm.tool_memory is None:
        text = _("Deviation {deviation} has reached the wear limit {limit}: the tool is worn or broken.")
    return _deviation(alarm, text)


def _not_accepted(alarm: Alarm) -> str:
    if "m" not in alarm.data:  # raised before sections were named
        return _("Too many sections of the part are out of tolerance: it is not accepted.")
    return _("At least {least} of {m} sections lie outside the tolerance: the part is not accepted.").format(
        least=alarm.data.get("least"), m=alarm.data["m"]
    )


def _set_aside() -> str:
    return _("Set the part aside and look at tool and clamping.")


OVERSIZE = register(
    AlarmKind(
        "oversize",
        concerns_parts=True,
        word=lambda: _("Oversize"),
        sentence=lambda alarm: (
            _deviation(alarm, _("The part is too large: deviation {deviation}, tolerance {limit}.")) + _so_far(alarm)
        ),
        what_to_do=_set_aside,
        icon="oversize",
        actions=("noted", "measured_by_hand", "tool_replaced", "false_reading"),
    )
)
UNDERSIZE = register(
    AlarmKind(
        "undersize",
        concerns_parts=True,
        word=lambda: _("Undersize"),
        sentence=lambda alarm: (
            _deviation(alarm, _("The part is too small: deviation {deviation}, tolerance {limit}.")) + _so_far(alarm)
        ),
        what_to_do=_set_aside,
        icon="undersize",
        actions=("noted", "measured_by_hand", "tool_replaced", "false_reading"),
    )
)
TOOL_WORN = register(
    AlarmKind(
        "tool_worn",
        concerns_parts=True,
        word=lambda: _("Tool worn"),
        sentence=_tool_worn,
        what_to_do=lambda: _("Look at the cutting edge."),
        tone="wear",
        icon="wear",
        actions=("tool_replaced", "keep_cutting", "sister_tool", "false_reading", "noted"),
    )
)


def _probe_fault(alarm: Alarm) -> str:
    paused = " " + _("Compensation is paused.")
    if alarm.data.get("first_move_triggered"):
        return first_move_sentence(alarm.data.get("feature")) + paused + cannot_be_stopped(alarm)
    if "touch" in alarm.data:
        return touch_problem(TouchError(**alarm.data["touch"])) + paused + cannot_be_stopped(alarm)
    if alarm.data.get("beyond_natural_limit"):
        text = _(
            "Deviation {deviation} lies beyond the natural limit, where no part can be: the probe, the zero or the sign is wrong. "
            "Compensation is paused."
        )
        return f"{_deviation(alarm, text)}{cannot_be_stopped(alarm)}"
    text = _(
        "Deviation {deviation} cannot be: it has reached the confidence limit {limit}. The probe or the program "
        "is wrong; compensation is paused."
    )
    return f"{_deviation(alarm, text)}{cannot_be_stopped(alarm)}"


def cannot_be_stopped(alarm: Alarm) -> str:
    """A sentence where the machine has a bridge that does not carry the decision to stop."""
    session = object_session(alarm)
    carries = select(Connection.carries_decisions).where(Connection.machine_id == alarm.machine_id)
    row = None if session is None else session.execute(carries).one_or_none()
    if row is None or row.carries_decisions:
        return ""
    return " " + _("This machine cannot be stopped by Inband: stop it by hand.")


def uncorrected(sentence: Callable[[Alarm], str]) -> Callable[[Alarm], str]:
    """The sentence of an alarm that lets nothing be corrected, with what becomes of the machine meanwhile."""

    def worded(alarm: Alarm) -> str:
        meanwhile = _("Meanwhile a part out of tolerance asks the machine to stop.")
        return f"{sentence(alarm)} {meanwhile}{cannot_be_stopped(alarm)}"

    return worded


PROBE_FAULT = register(
    AlarmKind(
        "probe_fault",
        concerns_parts=True,
        word=lambda: _("Probe fault"),
        sentence=_probe_fault,
        what_to_do=lambda: _("Clean the stylus, check chips, coolant and the program. Then report what it was."),
        tone="stop",
        icon="probe_fault",
        actions=("false_reading", "noted", "tool_replaced"),
        comments={"noted": lambda: [_("Stylus replaced"), _("Program corrected"), _("Probe calibrated")]},
    )
)
ACCEPTANCE = register(
    AlarmKind(
        "acceptance",
        concerns_parts=True,
        word=lambda: _("Not accepted"),
        sentence=_not_accepted,
        what_to_do=lambda: _("Measure it by hand and confirm."),
        actions=("measured_by_hand", "noted", "tool_replaced", "false_reading"),
    )
)
OFFSET_LIMIT = register(
    AlarmKind(
        "offset_limit",
        concerns_parts=True,
        word=lambda: _("Offset limit"),
        sentence=uncorrected(
            lambda alarm: _deviation(
                alarm,
                _(
                    "The corrections of tool {tool} have come to their limit {limit} in all: nothing more is corrected that would "
                    "exceed it."
                ),
            )
        ),
        what_to_do=lambda: _(
            "Change the tool, or look for what drifts. If the limit is too narrow, an engineer raises the largest sum in Set-up."
        ),
        actions=("tool_replaced", "sister_tool", "noted"),
        comments={"noted": lambda: [_("Limit is looked at")]},
    )
)
IMPLAUSIBLE = register(
    AlarmKind(
        "implausible",
        concerns_parts=True,
        word=lambda: _("Implausible jump"),
        sentence=lambda alarm: _deviation(
            alarm,
            _(
                "Deviation {deviation} lies more than {limit} from the level of the readings before: neither wear nor scatter "
                "explains it. Wrong part, wrong tool, or a chip on the stylus?"
            ),
        ),
        what_to_do=lambda: _(
            "Check the part and the stylus, and that the right tool has cut it. Then report what it was."
        ),
        icon="jump",
        actions=("false_reading", "keep_cutting", "tool_replaced", "sister_tool", "noted"),
        comments={
            "false_reading": lambda: [
                _("Chip on the stylus"),
                _("Wrong part"),
                _("Part not clamped right"),
                _("Coolant on the part"),
            ],
            "keep_cutting": lambda: [
                _("Part measured, agrees"),
                _("Edge looked at, still good"),
                _("New material"),
            ],
        },
    )
)
HOLDING = (TOOL_WORN.name, IMPLAUSIBLE.name)  # a correction is held until they are answered
