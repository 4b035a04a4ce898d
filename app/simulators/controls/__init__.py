"""Simulated controls: one model of a machine, behind each protocol. For trying, for the demonstration plant, and for tests.

Each module has ``serve(model, port)``, which answers a `Simulator`, and may have ``FEATURES``: characteristics of a model in the
words of that control. Where it has ``AT``, a sentence, ``serve`` takes a third word: a place that the simulator needs.
"""

from importlib import import_module
from types import ModuleType
from typing import Final, Protocol

SIMULATORS: Final[dict[str, str]] = {
    "dprnt": "app.simulators.controls.dprnt",
    "folder": "app.simulators.controls.folder",
    "haas": "app.simulators.controls.haas",
    "heidenhain": "app.simulators.controls.heidenhain",
    "mtconnect": "app.simulators.controls.mtconnect",
    "mqtt": "app.simulators.controls.mqtt",
    "opcua": "app.simulators.controls.opcua",
    "text": "app.simulators.controls.text",
}
"""Kinds that can be simulated, and the module of each."""


class NoPlace(Exception):
    """A simulator cannot begin: the place that it needs is missing. The words say what to do."""


class Simulator(Protocol):
    """A simulated control that is running."""

    port: int

    def table(self) -> dict[str, object]:
        """A machine's table of the configuration to reach it: ``kind``, the kind's own table, and more."""

    async def stop(self) -> None:
        """End it."""


def simulator_named(name: str) -> ModuleType:
    """The module of a simulator.

    Raises `LookupError` for a kind that has none; `ModuleNotFoundError` where a library is not installed.
    """
    if name not in SIMULATORS:
        raise LookupError(f"No simulated control of kind {name!r}; there are {', '.join(sorted(SIMULATORS))}.")
    return import_module(SIMULATORS[name])
