"""Zones as charts and pages show them: names, shapes, and the role of their colour.

ISA-101: quiet greys while all is well; colour only for what needs someone, and never colour alone – every zone and every
state has a shape and a word as well.
"""

from __future__ import annotations

from typing import cast

from app.charts import Role
from app.web.states import tone_of, word_of

# The same shapes for Plotly (its symbols) and for badges and small pictures (paths in a 24 × 24 box).
ZONE_SYMBOLS = {
    "zero": "circle",
    "average": "diamond",
    "full": "square",
    "oversize": "triangle-up",
    "undersize": "triangle-down",
    "wear": "hexagon2",
    "probe_fault": "x",
}
ZONE_OUTLINES = {
    "zero": "M12 6a6 6 0 1 0 0 12a6 6 0 0 0 0-12z",
    "average": "M12 3.5 20.5 12 12 20.5 3.5 12z",
    "full": "M5 5h14v14H5z",
    "oversize": "M12 3 22 20H2z",
    "undersize": "M12 21 2 4h20z",
    "wear": "M7 3h10l5 9-5 9H7l-5-9z",
    "probe_fault": "M7 2 12 7l5-5 5 5-5 5 5 5-5 5-5-5-5 5-5-5 5-5-5-5z",
}


def zone_name(zone: str) -> str:
    """The zone in one or two words."""
    return word_of(zone)


def zone_role(zone: str) -> Role:
    """Grey inside the tolerance; a colour where someone is needed."""
    return cast("Role", tone_of(zone))
