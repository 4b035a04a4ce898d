"""The sentences about alarms: what is wrong, what to do, what each action brings about, and what followed."""

from collections.abc import Sequence
from typing import Any

from app.alarms.queries import AlarmRow
from app.alarms.tables import Alarm
from app.web.i18n import _, ngettext
from app.web.numbers import mm, um, um_limit

MOST_NUMBERS = 5  # in one sentence


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
            text = _("Too many sections of the part are out of tolerance: it is not accepted.")
        case "offset_limit":
            text = _(
                "The corrections of tool {tool} have come to their limit {limit} in all: nothing more is corrected."
            )
        case "offset_differs":
            text = _(
                "After correction {correction} the machine holds {reported} in tool {tool}; {expected} was expected. "
                "Was it changed at the control?"
            )
        case _:
            text = str(data.get("text") or kind_word(alarm.kind))
    return text.format(**values) if alarm.kind in _KNOWN else text


_KNOWN = frozenset(
    {"oversize", "undersize", "tool_worn", "probe_fault", "acceptance", "offset_limit", "offset_differs"}
)


def what_to_do(kind: str) -> str:
    """What the operator looks at first."""
    return {
        "oversize": _("Set the part aside and look at tool and clamping."),
        "undersize": _("Set the part aside and look at tool and clamping."),
        "tool_worn": _("Look at the cutting edge."),
        "probe_fault": _("Clean the stylus, look at chips, coolant and the program. Then say what it was."),
        "acceptance": _("Measure the part by hand and confirm."),
        "offset_limit": _("Change the tool, or look for what drifts."),
        "offset_differs": _("Look at the control which offset is right. The reported one counts from now on."),
    }.get(kind, _("Look at it and say what it was."))


def action_word(action: str) -> str:
    """An action as it stands on its button."""
    return {
        "tool_replaced": _("Tool replaced"),
        "keep_cutting": _("Keep cutting"),
        "false_reading": _("False reading"),
        "noted": _("Noted"),
    }.get(action, action)


def offered(row: AlarmRow) -> list[str]:
    """The actions that make sense for this alarm, the likeliest first."""
    alarm = row.alarm
    order = {
        "tool_worn": ["tool_replaced", "keep_cutting", "false_reading", "noted"],
        "probe_fault": ["false_reading", "noted", "tool_replaced"],
        "offset_limit": ["tool_replaced", "noted"],
        "offset_differs": ["noted"],
    }.get(alarm.kind, ["noted", "tool_replaced", "false_reading"])
    return [
        action
        for action in order
        if not (action == "tool_replaced" and alarm.tool_memory is None)
        and not (action == "keep_cutting" and row.held is None)
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
        case "keep_cutting" if held is not None:
            said.append(
                _("Correction {number} of {amount} is released: the machine applies it to tool {tool}.").format(
                    number=held.number, amount=um(held.amount), tool=held.tool_memory
                )
            )
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
            said.append(_("Nothing else changes."))
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
        "noted": [_("Seen"), _("Part set aside"), _("Measured by hand, part is good"), _("Measured by hand, scrap")],
    }
    special = {
        ("probe_fault", "noted"): [_("Stylus replaced"), _("Program corrected"), _("Probe calibrated")],
        ("offset_differs", "noted"): [_("Offset at the control is right"), _("Offset was typed in by hand"), _("Seen")],
        ("offset_limit", "noted"): [_("Seen"), _("Limit is looked at")],
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


def numbers(values: Sequence[int]) -> str:
    """Numbers in a sentence, not more than one reads: `4, 5, 6 … 812`."""
    if len(values) <= MOST_NUMBERS:
        return ", ".join(map(str, values))
    return f"{', '.join(map(str, values[: MOST_NUMBERS - 1]))} … {values[-1]}"


def outcomes(outcome: Sequence[dict[str, Any]] | None) -> list[dict[str, Any]]:
    """What followed, each with its sentence."""
    if outcome is None:
        return []
    if not outcome:
        return [{"code": "nothing_else", "text": _("Nothing else was changed.")}]
    return [{**item, "text": _followed(item)} for item in outcome]


def _followed(item: dict[str, Any]) -> str:
    values = {
        **item,
        "offset": mm(item.get("offset")),
        "amount": um(item.get("amount")),
        "numbers": numbers(item.get("numbers", ())),
        "sequences": numbers(item.get("sequences", ())),
        "locations": numbers(item.get("locations", ())),
    }
    count = len(item.get("numbers", ())) or len(item.get("sequences", ())) or len(item.get("locations", ()))
    match item["code"]:
        case "tool_restarted":
            text = ngettext(
                "Tool {tool} begins anew with offset {offset}; the old one cut {parts} part.",
                "Tool {tool} begins anew with offset {offset}; the old one cut {parts} parts.",
                item["parts"],
            )
        case "tool_changed_already":
            text = _("Tool {tool} had been changed since, so nothing was restarted a second time.")
        case "corrections_superseded":
            text = ngettext("Correction {numbers} was dropped.", "Corrections {numbers} were dropped.", count)
        case "averages_restarted":
            text = ngettext(
                "The running average R11 = {locations} begins at 0.",
                "The running averages R11 = {locations} begin at 0.",
                count,
            )
        case "correction_released":
            text = _("Correction {number} of {amount} was released to the machine.")
        case "nothing_held":
            text = _("No correction was held any more.")
        case "still_held":
            text = _("Correction {number} is still held.")
        case "readings_excluded":
            text = ngettext(
                "Reading {sequences} of {characteristic} was excluded.",
                "Readings {sequences} of {characteristic} were excluded.",
                count,
            )
        case "readings_excluded_before":
            text = ngettext(
                "Reading {sequences} of {characteristic} had been excluded before.",
                "Readings {sequences} of {characteristic} had been excluded before.",
                count,
            )
        case "correction_withdrawn":
            text = _("Correction {number} of {amount} was withdrawn.")
        case "correction_applied":
            text = _("Correction {number} of {amount} is in the offset already; the next readings correct it.")
        case "resumed":
            text = _("Compensation of {characteristic} goes on.")
        case _:
            return str(item["code"])
    return text.format(**values)
