"""The five doors of the bar, and behind which of them a page stands."""

import re
from typing import Literal

from app.language.i18n import _

Door = Literal["plant", "todo", "quality", "machines", "setup"]

# The first that fits the whole address counts.
_BEHIND: dict[Door, re.Pattern[str]] = {
    "plant": re.compile(r"/|/characteristics/[^/]+(/readings/.*)?"),
    "todo": re.compile(r"/(todo|alarms|corrections|proposals)(/.*)?"),
    "quality": re.compile(r"/(overview|compare|characteristics|signals|gauges|reports|parts)(/.*)?"),
    "machines": re.compile(
        r"/(machines|connections|plant|tools|calibration|work-zeros|alignments|forms|kinematics|notes)(/.*)?"
        r"|/setup/machines/(?!new$)[^/]+(/.*)?"
    ),
    "setup": re.compile(r"/(setup|import)(/.*)?"),
}


def door_of(path: str) -> Door | None:
    """The door behind which the page of this path stands; None of a page that has none.

    >>> door_of("/characteristics/shaft-d40"), door_of("/characteristics/shaft-d40/control"), door_of("/account")
    ('plant', 'quality', None)
    """
    return next((door for door, pattern in _BEHIND.items() if pattern.fullmatch(path)), None)


def search_words() -> dict[str, str]:
    """The words of the kinds of things that search finds."""
    return {
        "machine": _("Machine"),
        "characteristic": _("Characteristic"),
        "tool": _("Tool"),
        "alarm": _("Alarm"),
        "report": _("Report"),
        "part": _("Part"),
        "note": _("Note"),
        "page": _("Page"),
    }
