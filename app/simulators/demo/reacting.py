"""Reaction plans of the demonstration plant with pictures at their steps, and the cause that its operator chooses at each kind of alarm."""

from typing import Any

from app.simulators.demo import drawing
from inband_client import Client

NAME = "Demonstration: "
CAUSES = {
    "tool_worn": "Edge chipped",
    "offset_limit": "Edge worn",
    "tool_life": "Planned life reached",
    "implausible": "Chip on the stylus",
    "probe_fault": "Coolant on the stylus",
    "oversize": "Edge worn",
    "undersize": "Warm-up of the spindle",
}
STEPS = {
    "tool_worn": (
        "Stop the machine after this part.",
        "Look at the cutting edge with the loupe.",
        "Chipped or worn: turn the insert, then touch Tool changed. Still good: Keep cutting.",
    ),
    "probe_fault": (
        "Wipe the stylus and the seat of the part.",
        "Measure the part again.",
        "The same size again: measure it by hand and call the shift leader.",
    ),
}
PICTURES = {
    "tool_worn": (1, drawing.chipped_edge, "An insert in its seat; a chip is out of its edge, marked in red"),
    "probe_fault": (0, drawing.dirty_stylus, "The ball of a stylus with a drop of coolant on it, marked in red"),
}
"""A picture for one step of a plan: its place, what draws it, and what it shows."""


def set_up(admin: Client) -> dict[str, int]:
    """Write catalogue and plans as far as they are not there; the number of the cause by kind of alarm."""
    there = {each["name"]: each["id"] for each in admin.items("/reactions/catalogue") if each["sort"] == "cause"}
    for name in dict.fromkeys(CAUSES.values()):
        if name not in there:
            there[name] = admin.post("/reactions/catalogue", {"sort": "cause", "name": name})["id"]
    planned = {(each["characteristic"], each["kind"], each["rule"]) for each in admin.items("/reactions/plans")}
    for kind, steps in STEPS.items():
        if (None, kind, None) not in planned:
            body: dict[str, Any] = {"name": NAME + kind.replace("_", " "), "kind": kind}
            described: list[dict[str, Any]] = [{"text": step} for step in steps]
            place, draw, alt = PICTURES[kind]
            described[place]["picture"] = {"digest": _picture(admin, draw()), "alt": alt}
            body |= {"steps": described, "reason": "First version"}
            admin.post("/reactions/plans", body)
    return {kind: there[name] for kind, name in CAUSES.items()}


def _picture(admin: Client, content: str) -> str:
    """Store a picture. The first of a server takes long; the same one stored twice is one, so it may be tried again."""
    digest: str = admin.post("/reactions/pictures", {"content": content}, repeat=True)["digest"]
    return digest
