"""The five doors of the bar, behind which of them a page stands, and the machine that is carried through them."""

import re
from typing import Literal

from app.language.i18n import _
from app.web.fields import is_slug

Door = Literal["plant", "todo", "quality", "machines", "setup"]

# The first that fits the whole address counts.
_BEHIND: dict[Door, re.Pattern[str]] = {
    "plant": re.compile(r"/|/characteristics/[^/]+(/readings/.*)?"),
    "todo": re.compile(r"/(todo|alarms|corrections|proposals|quarantines)(/.*)?"),
    "quality": re.compile(r"/(overview|compare|characteristics|signals|gauges|reports|parts|ledger|shift)(/.*)?"),
    "machines": re.compile(
        r"/(machines|connections|plant|tools|calibration|work-zeros|alignments|forms|kinematics|notes)(/.*)?"
        r"|/setup/machines/(?!new$)[^/]+(/.*)?"
    ),
    "setup": re.compile(r"/(setup|import)(/.*)?"),
}
_WHOLE: dict[Door, str] = {
    "plant": "/",
    "todo": "/todo",
    "quality": "/overview",
    "machines": "/machines",
    "setup": "/setup",
}
_OF_MACHINE: dict[Door, str] = {
    "todo": "/todo?machine={}",
    "quality": "/overview?machine={}",
    "machines": "/machines/{}",
    "setup": "/setup/characteristics?machine={}",
}
_MACHINE = re.compile(r"/(?:machines|plant|station|setup/machines|kinematics/machines)/([^/]+)(?:/.*)?")


def machine_of(path: str, named: str | None) -> str | None:
    """The key of the machine that was chosen on the page of this path; named: the one of its query.

    >>> machine_of("/machines/lathe-1/tools", None), machine_of("/alarms", "mill-1"), machine_of("/setup/machines/new", None)
    ('lathe-1', 'mill-1', None)
    """
    found = _MACHINE.fullmatch(path)
    key = found[1] if found else named or ""
    return key if is_slug(key) and key != "new" else None


def way_to(door: Door, here: Door | None, machine: str | None) -> str:
    """The address of a door, with the machine that was chosen; from behind the doors of machines and set-up the whole list.

    >>> way_to("todo", "machines", "lathe-1"), way_to("machines", "todo", "lathe-1"), way_to("machines", "machines", "lathe-1")
    ('/todo?machine=lathe-1', '/machines/lathe-1', '/machines')
    """
    if machine and door != "plant" and not (door == here and door in ("machines", "setup")):
        return _OF_MACHINE[door].format(machine)
    return _WHOLE[door]


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
        "person": _("Person"),
        "part": _("Part"),
        "note": _("Note"),
        "page": _("Page"),
        "help": _("Help"),
    }
