"""The sentences about alarms: what is wrong, what to do, what each action brings about, and what followed."""

from collections.abc import Mapping
from typing import Any

from app.alarms.queries import MEASURED_BY_HAND, AlarmRow
from app.alarms.tables import Alarm
from app.calibration.wording import refusal
from app.control.signals_wording import alarm_sentence, page_of
from app.kinematics.wording import alarm_sentence as kinematics_sentence
from app.wear.wording import hunting_sentence, remedy_sentence
from app.web.i18n import _, ngettext
from app.web.numbers import mm, um, um_limit
from app.zeros.wording import shifted


def kind_word(kind: str) -> str:
    """What the alarm is called."""
    return {
        "oversize": _("Oversize"),
        "undersize": _("Undersize"),
        "tool_worn": _("Tool worn"),
        "probe_fault": _("Probe fault"),
        "acceptance": _("Not accepted"),
        "offset_limit": _("Offset limit"),
        "offset_differs": _("Offset differs"),
        "calibration_overdue": _("Calibration overdue"),
        "calibration_refused": _("Calibration refused"),
        "fixture_shifted": _("Fixture shifted"),
        "kinematics_drift": _("Rotary axis drifted"),
        "implausible": _("Implausible jump"),
        "tool_life": _("Tool life reached"),
        "hunting": _("Hunting"),
        "signal": _("Signal"),
    }.get(kind, kind)


def sentence(row: AlarmRow) -> str:
    """What is wrong."""
    data, alarm = row.alarm.data, row.alarm
    deviation = data.get("deviation")
    values = {
        "deviation": um(deviation),
        "limit": um_limit(data.get("limit") or 0.0),
        "tool": alarm.tool_memory,
        "expected": mm(data.get("expected")),
        "reported": mm(data.get("reported")),
        "correction": data.get("correction"),
        "least": data.get("least"),
        "m": data.get("m"),
        "parts": data.get("parts"),
        "planned_parts": data.get("planned_parts"),
        "total": um(data.get("total")),
        "planned_total": um_limit(data.get("planned_total") or 0.0),
        "place": place(data),
        "passed": _passed(data),
        "why": refusal(data) if alarm.kind == "calibration_refused" else "",
    }
    match alarm.kind:
        case "oversize":
            text = _("The part is too large: deviation {deviation}, tolerance {limit}.")
        case "undersize":
            text = _("The part is too small: deviation {deviation}, tolerance {limit}.")
        case "tool_worn":
            text = _("Deviation {deviation} has reached the wear limit {limit}: tool {tool} is worn or broken.")
            if alarm.tool_memory is None:
                text = _("Deviation {deviation} has reached the wear limit {limit}: the tool is worn or broken.")
        case "probe_fault":
            text = _(
                "Deviation {deviation} cannot be: it has reached the confidence limit {limit}. The probe or the program "
                "is wrong; compensation is paused."
            )
        case "acceptance":
            text = _("At least {least} of {m} sections lie outside the tolerance: the part is not accepted.")
            if "m" not in data:  # raised before sections were told
                text = _("Too many sections of the part are out of tolerance: it is not accepted.")
        case "offset_limit":
            text = _(
                "The corrections of tool {tool} have come to their limit {limit} in all: nothing more is corrected that would "
                "exceed it."
            )
        case "offset_differs":
            text = _(
                "After correction {correction} the machine holds {reported} in tool {tool}; {expected} was expected. Who "
                "changed it at the control, and why? Nothing is corrected through this tool until that is said."
            )
        case "implausible":
            text = _(
                "Deviation {deviation} lies more than {limit} from the level of the readings before: neither wear nor scatter "
                "explains it. Wrong part, wrong tool, or a chip on the stylus?"
            )
        case "tool_life" if data.get("by") == "parts":
            text = _("Tool {tool} has cut {parts} parts; its planned life is {planned_parts}.")
        case "tool_life":
            text = _("The corrections of tool {tool} sum up to {total}; its planned wear life is {planned_total}.")
        case "calibration_overdue":
            text = _("The probe has not been calibrated for {passed}: {place}.")
        case "calibration_refused":
            text = _("A calibration was refused and changes nothing: {place}. {why}")
        case "fixture_shifted":
            text = shifted(data)
        case "kinematics_drift":
            text = kinematics_sentence(data)
        case "hunting":
            text = f"{hunting_sentence(data)} {remedy_sentence(data, data['settings'])}"
        case "signal" if data.get("signals"):
            text = alarm_sentence(data)
        case _:
            text = str(data.get("text") or kind_word(alarm.kind))
    return text.format(**values) if alarm.kind in _KNOWN else text


_KNOWN = frozenset(
    {
        "oversize",
        "undersize",
        "tool_worn",
        "probe_fault",
        "acceptance",
        "offset_limit",
        "offset_differs",
        "implausible",
        "tool_life",
        "calibration_overdue",
        "calibration_refused",
    }
)


def chart_of(row: AlarmRow) -> str:
    """The control chart about the last signal that an alarm names; empty for other alarms."""
    signals = row.alarm.data.get("signals")
    return page_of(row.characteristic.key, signals[-1]) if signals and row.characteristic else ""


def place(data: Mapping[str, Any]) -> str:
    """The location of a memory that an alarm is about."""
    if data.get("memory") == "tool":
        return _("offset of the probe, R10 = {location}").format(location=data.get("location"))
    return _("empirical value R11 = {location}").format(location=data.get("location"))


def _passed(data: Mapping[str, Any]) -> str:
    parts, days = data.get("parts"), data.get("days")
    if parts is not None:
        return ngettext("{n} part", "{n} parts", parts).format(n=parts)
    return ngettext("{n} day", "{n} days", int(days or 0)).format(n=int(days or 0))


def what_to_do(kind: str) -> str:
    """What the operator looks at first."""
    return {
        "oversize": _("Set the part aside and look at tool and clamping."),
        "undersize": _("Set the part aside and look at tool and clamping."),
        "tool_worn": _("Look at the cutting edge."),
        "probe_fault": _("Clean the stylus, look at chips, coolant and the program. Then say what it was."),
        "acceptance": _("Measure it by hand and confirm."),
        "offset_limit": _(
            "Change the tool, or look for what drifts. If the limit is too narrow, an engineer raises the largest sum in Set-up."
        ),
        "offset_differs": _("Look at the control which offset is true, and say so."),
        "implausible": _(
            "Look at the part and the stylus, and whether the right tool has cut it. Then say what it was."
        ),
        "tool_life": _("Change the tool, or go on with its sister."),
        "hunting": _("An engineer chooses a setting on the map of what if, and proposes it from there."),
        "signal": _("Look at the chart and at the parts; then say what it was. The parts need not be bad."),
        "calibration_overdue": _("Calibrate it; that ends this alarm."),
        "fixture_shifted": _(
            "Look for chips under the part and at the bolts of the fixture. The next work zero within the limit ends this alarm."
        ),
        "kinematics_drift": _(
            "Look at the run: enter what it asks for on the control, or look for what has moved. The next run within the limit "
            "ends this alarm."
        ),
        "calibration_refused": _("Clean stylus and gauge and look at the program, then calibrate again."),
    }.get(kind, _("Look at it and say what it was."))


def action_word(action: str, kind: str = "") -> str:
    """An action as it stands on its button; at a rejected part the hand decides."""
    if (action, kind) == ("noted", "acceptance"):
        return _("Measured by hand")
    return {
        "tool_replaced": _("Tool replaced"),
        "keep_cutting": _("Keep cutting"),
        "false_reading": _("False reading"),
        "sister_tool": _("Switch to sister tool"),
        "offset_set": _("Say which offset is true"),
        "noted": _("Noted"),
    }.get(action, action)


def offered(row: AlarmRow) -> list[str]:
    """The actions that make sense for this alarm, the likeliest first."""
    alarm = row.alarm
    order = {
        "tool_worn": ["tool_replaced", "keep_cutting", "sister_tool", "false_reading", "noted"],
        "probe_fault": ["false_reading", "noted", "tool_replaced"],
        "offset_limit": ["tool_replaced", "sister_tool", "noted"],
        "offset_differs": ["offset_set", "tool_replaced"],
        "implausible": ["false_reading", "keep_cutting", "tool_replaced", "sister_tool", "noted"],
        "tool_life": ["tool_replaced", "sister_tool", "noted"],
        "hunting": ["noted"],
        "signal": ["noted", "tool_replaced", *(["false_reading"] if alarm.data.get("readings") else [])],
        "calibration_overdue": ["noted"],
        "fixture_shifted": ["noted"],
        "kinematics_drift": ["noted"],
        "calibration_refused": ["noted"],
    }.get(alarm.kind, ["noted", "tool_replaced", "false_reading"])
    return [
        action
        for action in order
        if not (action == "tool_replaced" and alarm.tool_memory is None)
        and not (action == "keep_cutting" and row.held is None and alarm.kind != "implausible")
        and not (action == "sister_tool" and row.sister is None)
    ]


def consequences(row: AlarmRow, action: str) -> list[str]:
    """What will follow when this action is confirmed."""
    alarm, held = row.alarm, row.held
    said: list[str] = []
    match action:
        case "tool_replaced":
            said.append(
                _("Tool {tool} begins a new life: offset, sum of corrections, parts and average start anew.").format(
                    tool=alarm.tool_memory
                )
            )
            said.append(_("Corrections computed for the old tool are dropped."))
        case "keep_cutting":
            if alarm.kind == "implausible":
                said.append(_("The reading was true: the next ones are expected at its level."))
            if held is not None:
                said.append(
                    _("Correction {number} of {amount} is released: the machine applies it to tool {tool}.").format(
                        number=held.number, amount=um(held.amount), tool=held.tool_memory
                    )
                )
                said.append(_("If readings since then say that nothing is to be corrected, it is dropped instead."))
        case "sister_tool":
            said += [
                _(
                    "What corrected tool {tool} corrects tool {sister} from now on: a new version of the parameters."
                ).format(tool=alarm.tool_memory, sister=row.sister),
                _("Corrections computed for tool {tool} are dropped; the running averages begin at 0.").format(
                    tool=alarm.tool_memory
                ),
                _("Select tool {sister} at the machine before the next part.").format(sister=row.sister),
            ]
        case "offset_set":
            said += [
                _("It is handled as a manual edit of tool {tool}: the running averages begin at 0.").format(
                    tool=alarm.tool_memory
                ),
                _("Parts cut until now say nothing about it; then correcting goes on."),
            ]
        case "false_reading":
            said.append(
                ngettext(
                    "The reading is taken out of the statistics; it stays on record.",
                    "The {n} readings of this alarm are taken out of the statistics; they stay on record.",
                    alarm.count,
                ).format(n=alarm.count)
            )
            said.append(_("What it asked for is withdrawn, unless the machine has applied it already."))
        case "noted":
            said.append(
                _("What you have measured stands beside the machine's value; the reading is not excluded.")
                if alarm.kind in MEASURED_BY_HAND
                else _("Nothing else changes.")
            )
            if held is not None:
                said.append(
                    _("Correction {number} stays held; it can be released or rejected in the tool memory.").format(
                        number=held.number
                    )
                )
    if alarm.kind == "probe_fault":
        said.append(_("Compensation of this characteristic goes on."))
    return said


def comments(kind: str, action: str) -> list[str]:
    """Comments to choose from with one touch; the first is chosen already."""
    common = {
        "tool_replaced": [_("Insert turned"), _("New insert"), _("New tool"), _("Insert chipped")],
        "keep_cutting": [_("Edge looked at, still good"), _("Until the end of the batch"), _("Replaced at next stop")],
        "false_reading": [_("Chip on the stylus"), _("Coolant on the part"), _("Part not clamped right")],
        "sister_tool": [_("Edge worn"), _("Insert chipped"), _("Planned life reached")],
        "noted": [_("Seen"), _("Part set aside"), _("Measured by hand, part is good"), _("Measured by hand, scrap")],
    }
    special = {
        ("probe_fault", "noted"): [_("Stylus replaced"), _("Program corrected"), _("Probe calibrated")],
        ("offset_differs", "offset_set"): [
            _("Part measured by hand"),
            _("Tool was changed"),
            _("Typed in by mistake"),
            _("Program was loaded"),
            _("Nobody knows"),
        ],
        ("implausible", "false_reading"): [
            _("Chip on the stylus"),
            _("Wrong part"),
            _("Part not clamped right"),
            _("Coolant on the part"),
        ],
        ("implausible", "keep_cutting"): [
            _("Part measured, agrees"),
            _("Edge looked at, still good"),
            _("New material"),
        ],
        ("tool_life", "noted"): [_("Edge looked at, still good"), _("Until the end of the batch"), _("Seen")],
        ("fixture_shifted", "noted"): [
            _("Chips under the part"),
            _("Fixture bolted anew"),
            _("Vice aligned anew"),
            _("Seen"),
        ],
        ("kinematics_drift", "noted"): [
            _("Machine was cold"),
            _("After a collision"),
            _("Ball clamped anew"),
            _("Seen"),
        ],
        ("calibration_overdue", "noted"): [_("At the end of the batch"), _("At the change of shift"), _("Seen")],
        ("calibration_refused", "noted"): [_("Stylus cleaned"), _("Gauge cleaned"), _("Wrong gauge"), _("Seen")],
        ("offset_limit", "noted"): [_("Seen"), _("Limit is looked at")],
        ("signal", "noted"): [
            _("Seen"),
            _("New batch of material"),
            _("Warmed up"),
            _("Looked for, nothing found"),
        ],
        ("acceptance", "noted"): [_("Measured by hand"), _("Plug gauge"), _("Part set aside"), _("Seen")],
    }
    return special.get((kind, action), common.get(action, [_("Seen")]))


def was_first(alarm: Alarm) -> str:
    """Who acknowledged the alarm before."""
    return _("{who} acknowledged alarm {number} on {at} already: {action}, “{comment}”.").format(
        who=alarm.acknowledged_by,
        number=alarm.id,
        at=alarm.acknowledged_at.isoformat(timespec="seconds") if alarm.acknowledged_at else "?",
        action=action_word(alarm.action or ""),
        comment=alarm.comment,
    )
