"""Alarm kinds about the offset of a tool and its life."""

from app.language.i18n import _
from app.language.numbers import mm, um, um_limit
from app.loop.alarms.kinds import AlarmKind, register
from app.loop.tables.alarms import Alarm


def _differs(alarm: Alarm) -> str:
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
        word=lambda: _("Offset differs"),
        sentence=_differs,
        what_to_do=lambda: _("Look at the control which offset is true, and say so."),
        actions=("offset_set", "tool_replaced"),
        comments={
            "offset_set": lambda: [
                _("Part measured by hand"),
                _("Tool was changed"),
                _("Typed in by mistake"),
                _("Program was loaded"),
                _("Nobody knows"),
            ]
        },
    )
)
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
