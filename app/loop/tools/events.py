"""Events of corrections, tools and averages for live pages and event listeners."""

from typing import Any

from app.loop.tables.alarms import Alarm
from app.loop.tables.machines import Machine


def tool_changed(machine: Machine, number: int) -> dict[str, Any]:
    return {"kind": "tool", "machine": machine.key, "tool": number}


def average_changed(machine: Machine, location: int) -> dict[str, Any]:
    return {"kind": "average", "machine": machine.key, "average_memory": location}


def alarm_raised(machine: Machine, alarm: Alarm) -> dict[str, Any]:
    return {
        "kind": "alarm",
        "machine": machine.key,
        "characteristic": None,
        "tool": alarm.tool_memory,
        "id": alarm.id,
        "alarm": alarm.kind,
        "state": "active",
    }
