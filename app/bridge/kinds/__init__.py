"""Kinds of controls, by the name that the configuration gives them.

Each module has ``Settings`` (a msgspec Struct: the kind's own table), ``link(machine)``, and ``NUMBERED = True`` where the
control knows characteristics by numbers, ``REGISTER_OF``: what of a location its register belongs to besides its name (tool and
edge, if nothing is said), and ``MEANING``: names of settings that change the meaning of a register, which a touch test has to
prove again. It is imported when a machine needs it: some need a library that is an extra.
"""

from importlib import import_module
from types import ModuleType
from typing import Final

from app.bridge.links import LIBRARIES

KINDS: Final[dict[str, str]] = {
    "dprnt": "app.bridge.kinds.dprnt",
    "folder": "app.bridge.kinds.folder",
    "haas": "app.bridge.kinds.haas",
    "heidenhain": "app.bridge.kinds.heidenhain",
    "mqtt": "app.bridge.kinds.mqtt",
    "opcua": "app.bridge.kinds.opcua",
    "text": "app.bridge.kinds.text",
}
"""Names and modules."""
EXTRAS: Final = {"opcua", "mqtt", "heidenhain"}
"""Kinds that need a library of an extra."""


class KindError(ValueError):
    """A kind that does not exist, or whose library is not installed."""


def kind_named(name: str) -> ModuleType:
    """The module of a kind.

    Raises `KindError`.
    """
    if name == "mtconnect":
        raise KindError(
            'kind = "mtconnect" brings no readings; it tells the part of readings as [machine.KEY.context] beside another kind.'
        )
    if name not in KINDS:
        raise KindError(f"kind = {name!r} is not known; known are {', '.join(sorted(KINDS))}.")
    try:
        return import_module(KINDS[name])
    except ModuleNotFoundError as error:
        if name not in EXTRAS:
            raise
        raise KindError(f"kind = {name!r} needs {error.name}, which is not installed: {LIBRARIES}") from error
