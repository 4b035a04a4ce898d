"""Sister tools: another location of the same machine that goes on when a tool is worn.

Inband turns no turret. Switching means that the characteristics which corrected the one location correct the other from
now on: each gets a new version of its parameters with the sister as its tool memory (R10). The machine selects the tool.
"""

from datetime import UTC, datetime
from typing import NamedTuple

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.db.events import publish
from app.errors import Conflict
from app.language.i18n import _
from app.loop.characteristics import actions as characteristics
from app.loop.characteristics.actions import CharacteristicChange
from app.loop.characteristics.correction_actions import supersede
from app.loop.characteristics.correction_queries import correction_changed, open_corrections
from app.loop.machines.queries import lock_machines
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Stream
from app.loop.tools import queries
from app.loop.tools.events import tool_changed


class Switched(NamedTuple):
    """Result of the change to the sister tool. averages: locations (R11) whose M began again at 0."""

    tool: int
    sister: int
    characteristics: list[str]
    superseded: list[int]
    averages: list[int]


def on_tool(session: Session, machine: Machine, number: int) -> list[str]:
    """The keys of the characteristics that correct this location."""
    return list(
        session.scalars(
            select(Characteristic.key)
            .join(
                Stream,
                (Stream.machine_id == Characteristic.machine_id) & (Stream.characteristic_id == Characteristic.id),
            )
            .where(Stream.machine_id == machine.id, Stream.tool_memory == number)
            .order_by(Characteristic.key)
        )
    )


def switch_to_sister(session: Session, machine: Machine, number: int, reason: str, caller: Caller) -> Switched:
    """From now on the characteristics of this tool correct its sister.

    Open corrections of the tool fall, the averages begin at 0, and parts cut before say nothing about the sister.
    Raises `NotFound`; `Conflict` when no sister is named, or nothing is corrected through the tool any more.
    """
    lock_machines(session, [machine.id])
    tool = queries.tool(session, machine, number)
    if tool.sister is None:
        raise Conflict(
            _("Tool {tool} of {machine} has no sister tool. Nothing was changed.").format(
                tool=number, machine=machine.key
            ),
            _("Name the location of its sister in the settings of the tool first."),
        )
    keys = on_tool(session, machine, number)
    if not keys:
        raise Conflict(
            _("No characteristic corrects tool {tool} of {machine} any more. Nothing was changed.").format(
                tool=number, machine=machine.key
            ),
            _("Look at tool {sister}, its sister: it may have been switched already.").format(sister=tool.sister),
        )
    sister, now = tool.sister, datetime.now(UTC)
    fallen = supersede(session, open_corrections(session, machine, number), now, caller.name, reason)
    for key in keys:
        session.flush()
        characteristics.change_characteristic(
            session, key, CharacteristicChange(parameters={"tool_memory": sister}, reason=reason), caller.name
        )
    queries.tool(session, machine, sister).reset_at = now
    averages = sorted(
        set(
            session.scalars(
                select(Stream.average_memory).where(
                    Stream.machine_id == machine.id, Stream.tool_memory == sister, Stream.average_memory > 0
                )
            )
        )
    )
    numbers = [correction.number for correction in fallen]
    record(
        session,
        caller.name,
        "switched to sister tool",
        f"tool/{machine.key}/{number}",
        {"tool_memory": number},
        {"tool_memory": sister, "characteristics": keys} | ({"superseded": numbers} if numbers else {}),
        reason,
    )
    publish(
        session,
        tool_changed(machine, number),
        tool_changed(machine, sister),
        *(correction_changed(session, machine, correction) for correction in fallen),
    )
    return Switched(number, sister, keys, numbers, averages)
