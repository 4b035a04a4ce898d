"""The tool in a location of the tool memory: edge, name, planned life and sister tool."""

from typing import Any

from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.db.events import publish
from app.errors import Invalid
from app.language.i18n import _
from app.loop.machines.queries import lock_machines
from app.loop.tables.machines import Machine
from app.loop.tables.tools import Tool
from app.loop.tools import queries
from app.loop.tools.edge_schemas import ToolSettings
from app.loop.tools.events import tool_changed


def describe_tool(session: Session, machine: Machine, number: int, settings: ToolSettings, caller: Caller) -> Tool:
    """Say what is in this location; what is left out stays. A new plan is reported again when it is reached.

    Raises `NotFound`, and `Invalid` for a tool that is its own sister, or that the machine has not.
    """
    lock_machines(session, [machine.id])
    tool = queries.tool(session, machine, number)
    changes = settings.model_dump(exclude_unset=True)
    if changes.get("sister") == number:
        raise Invalid.at(
            "sister", _("must be another location: tool {tool} cannot be its own sister").format(tool=number)
        )
    if (changes.get("sister") or 0) > machine.tool_locations:
        raise Invalid.at(
            "sister",
            _("the machine has {last} tool locations; R10 = {tool} is none of them").format(
                last=machine.tool_locations, tool=changes["sister"]
            ),
        )
    before: dict[str, Any] = {name: getattr(tool, name) for name in changes}
    if before == changes:
        return tool
    for name, value in changes.items():
        setattr(tool, name, value)
    if {"planned_parts", "planned_total"} & {name for name in changes if changes[name] != before[name]}:
        tool.life_alarm_raised = False
    record(session, caller.name, "tool described", f"tool/{machine.key}/{number}", before, changes)
    publish(session, tool_changed(machine, number))
    return tool
