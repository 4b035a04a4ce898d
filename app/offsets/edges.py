"""What is in a location of the tool memory: edge, name, planned life and sister tool."""

from typing import Any

from sqlalchemy.orm import Session

from app.audit.actions import record
from app.db.events import publish
from app.errors import FieldError, Invalid
from app.machines.queries import lock_machines
from app.machines.tables import Machine
from app.offsets import queries
from app.offsets.edge_schemas import ToolSettings
from app.offsets.news import tool_changed
from app.offsets.tables import Tool
from app.people.callers import Caller
from app.web.i18n import _


def describe_tool(session: Session, machine: Machine, number: int, settings: ToolSettings, caller: Caller) -> Tool:
    """Say what is in this location; what is left out stays. A new plan is told again when it is reached.

    Raises `NotFound`, and `Invalid` for a tool that is its own sister.
    """
    lock_machines(session, [machine.id])
    tool = queries.tool(session, machine, number)
    wanted = settings.model_dump(exclude_unset=True)
    if wanted.get("sister") == number:
        wrong = _("must be another location: tool {tool} cannot be its own sister").format(tool=number)
        raise Invalid(f"sister: {wrong}.", errors=[FieldError("sister", wrong)])
    before: dict[str, Any] = {name: getattr(tool, name) for name in wanted}
    if before == wanted:
        return tool
    for name, value in wanted.items():
        setattr(tool, name, value)
    if {"planned_parts", "planned_total"} & {name for name in wanted if wanted[name] != before[name]}:
        tool.life_told = False
    record(session, caller.name, "tool described", f"tool/{machine.key}/{number}", before, wanted)
    publish(session, tool_changed(machine, number))
    return tool
