"""Alarm kinds about the offset of a tool and its life."""

from datetime import datetime

from app.language.formatting import as_read, mm, um, um_limit
from app.language.i18n import _, ngettext
from app.loop.alarms.kinds import AlarmKind, register
from app.loop.alarms.reading_kinds import uncorrected
from app.loop.tables.alarms import Alarm
from app.loop.tables.tools import UNTAKEN
from app.loop.tools.effect_alarm_kinds import (
    EARLY_EFFECT,
    OPPOSITE_EFFECT,
    STILL_OUT_OF_TOLERANCE,
    STRONG_EFFECT,
)


def _differs(alarm: Alarm) -> str:
    if alarm.data.get("assumed"):
        return _(
            "The machine holds {reported} in tool {tool}; {expected} was expected. No offset of this tool was entered before, and 0 "
            "was assumed. Which offset does the control hold? Nothing is corrected through this tool until that is said."
        ).format(
            reported=mm(alarm.data.get("reported")), expected=mm(alarm.data.get("expected")), tool=alarm.tool_memory
        )
    if alarm.data.get("correction") is None:
        return _(
            "The machine holds {reported} in tool {tool}; {expected} was expected. Who changed it at the control, and why? "
            "Nothing is corrected through this tool until that is said."
        ).format(
            reported=mm(alarm.data.get("reported")), expected=mm(alarm.data.get("expected")), tool=alarm.tool_memory
        )
    return _(
        "After correction {correction} the machine holds {reported} in tool {tool}; {expected} was expected. Who "
        "changed it at the control, and why? Nothing is corrected through this tool until that is said."
    ).format(
        correction=alarm.data.get("correction"),
        reported=mm(alarm.data.get("reported")),
        expected=mm(alarm.data.get("expected")),
        tool=alarm.tool_memory,
    )


def _life(alarm: Alarm) -> str:
    data = alarm.data
    if data.get("by") == "parts":
        return _("Tool {tool} has cut {parts} parts; its planned life is {planned_parts}.").format(
            tool=alarm.tool_memory, parts=data.get("parts"), planned_parts=data.get("planned_parts")
        )
    return _("The corrections of tool {tool} sum up to {total}; its planned wear life is {planned_total}.").format(
        tool=alarm.tool_memory, total=um(data.get("total")), planned_total=um_limit(data.get("planned_total") or 0.0)
    )


OFFSET_DIFFERS = register(
    AlarmKind(
        "offset_differs",
        concerns_parts=True,
        word=lambda: _("Offset differs"),
        sentence=uncorrected(_differs),
        what_to_do=lambda: _("Read the true offset at the control and report it."),
        actions=("offset_set", "tool_replaced"),
        comments={
            "offset_set": lambda: [
                _("First offset of this tool"),
                _("Part measured by hand"),
                _("Tool was changed"),
                _("Typed in by mistake"),
                _("Program was loaded"),
                _("Not known"),
            ]
        },
    )
)


def _not_taken(alarm: Alarm) -> str:
    data = alarm.data
    if data.get("reason"):
        return _("No correction of tool {tool} reaches the machine: {reason}").format(
            tool=alarm.tool_memory, reason=data["reason"]
        )
    count = int(data.get("waiting") or 1)
    since = as_read(datetime.fromisoformat(str(data["since"])), "minutes") if data.get("since") else "–"
    text = ngettext(
        "The machine does not take correction {first} of tool {tool}, which waits since {since}. Parts are cut with the offset "
        "of before.",
        "The machine does not take {n} corrections of tool {tool}, the first of which, {first}, waits since {since}. Parts are "
        "cut with the offset of before.",
        count,
    ).format(n=count, first=data.get("first"), tool=alarm.tool_memory, since=since)
    if not data.get("bridge"):
        return text
    if data.get("carried", True):
        return f"{text} " + _("Its bridge says: {said}").format(said=data["said"]) if data.get("said") else text
    return f"{text} " + _("Its bridge carries no corrections: enter them at the control and confirm them here.")


CORRECTIONS_NOT_TAKEN = register(
    AlarmKind(
        UNTAKEN,
        concerns_parts=True,
        word=lambda: _("Corrections are not taken"),
        sentence=uncorrected(_not_taken),
        what_to_do=lambda: _(
            "With a bridge: does the part program call the program that takes corrections, does the control hold them, has this "
            "tool memory a location in the bridge's configuration and a touch test? Else: does the machine ask for pending "
            "corrections and confirm them? The alarm ends when they are taken or rejected."
        ),
        icon="waiting",
        comments={"noted": lambda: [_("Part program corrected"), _("Location added"), _("Touch test made")]},
        outcomes={"corrections_taken": lambda _item: _("No correction waits too long any more.")},
    )
)
PAUSING = (
    OFFSET_DIFFERS.name,
    OPPOSITE_EFFECT.name,
    STRONG_EFFECT.name,
    STILL_OUT_OF_TOLERANCE.name,
    EARLY_EFFECT.name,
)  # nothing is corrected through the tool until they are answered
TOOL_LIFE = register(
    AlarmKind(
        "tool_life",
        word=lambda: _("Tool life reached"),
        sentence=_life,
        what_to_do=lambda: _("Change the tool, or go on with its sister."),
        tone="wear",
        icon="tool",
        actions=("tool_replaced", "sister_tool", "noted"),
        comments={
            "noted": lambda: [_("Edge looked at, still good"), _("Until the end of the batch")],
        },
    )
)
