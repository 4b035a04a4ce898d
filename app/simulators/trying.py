"""One simulated lathe inside a plant that is empty otherwise: the page's button starts it, and it ends when it is removed.

It calls the public API with a key of its own as a real machine does. Alarms and tools are for the person who tries it: no simulated
operator steps in.
"""

import logging
import secrets
import threading
from dataclasses import replace
from datetime import UTC, datetime
from random import Random
from typing import Any

import httpx

from app.simulators.demo import plant
from app.simulators.demo.running import Line, Pace
from app.simulators.demo.simulation import Machine
from inband_client import Client, Forbidden, NotFound, Stopped, Unauthorized, Unavailable

log = logging.getLogger(__name__)
SPEED = 30.0  # times faster than life
PATIENCE = 30.0  # s without an answer of the server

_LATHE = replace(
    plant.LATHE_1,
    key="simulated",
    name="Simulated lathe",
    part="simulated-shaft",
    tools=(
        plant.Tool(3, "finishing tool, outside", wear=0.000_2, run_in=0.004, life=1_000_000),
        plant.Tool(4, "boring bar", wear=0.000_15, run_in=0.003, life=1_000_000),
    ),
    features=(
        replace(plant.LATHE_1.features[0], name="Bearing seat Ø40 h6, simulated"),
        plant.Feature(
            "bore-d25", "Bore Ø25 H7, simulated", 4, plant.LATHE_INSIDE, 25.0, 0.021, 0.0, factor=-1,
            average_memory=4, zero_range=0.002, scatter=0.0014, warmth=-0.004, more={"feature": "inside"},
        ),
    ),
    first_chip=(25, 3),
)  # fmt: skip


def lathe(mark: str) -> plant.Machine:
    """The lathe under keys that nothing had before: those of one that was removed are not given again."""
    features = tuple(replace(each, key=f"simulated-{mark}-{each.key}") for each in _LATHE.features)
    return replace(_LATHE, key=f"simulated-{mark}", features=features)


def fresh() -> plant.Machine:
    """A lathe that was never here."""
    return lathe(secrets.token_hex(3))


def settings(machine: plant.Machine) -> dict[str, str]:
    """The machine as the API takes it."""
    return {"key": machine.key, "name": machine.name, "control": machine.control, "type": machine.type}


def characteristics(machine: plant.Machine) -> list[dict[str, Any]]:
    """Its characteristics, as the API takes them."""
    return [
        {
            "key": each.key,
            "name": each.name,
            "machine": machine.key,
            "part": machine.part,
            "parameters": each.parameters,
        }
        for each in machine.features
    ]


def simulation(machine: plant.Machine) -> Machine:
    """The lathe as it cuts. Whatever its keys are, everybody sees the same: a correction of each tool within eight parts, then a chip."""
    return Machine(machine, seed=1, drawn_as=_LATHE.key)


class OneLine(Line):
    """The lathe without an operator."""

    def _look_after(self, alarms: list[dict[str, Any]]) -> None:
        """Leave them to the person who tries it."""

    def _cycle(self) -> None:
        try:
            super()._cycle()
        except (Unauthorized, Forbidden, NotFound, Unavailable) as end:  # it was removed, or its server has ended
            raise Stopped from end


_running: dict[str, threading.Event] = {}


def is_running(machine: str) -> bool:
    """Tell if this process simulates the machine with this key."""
    return machine in _running


class Named(httpx.HTTPTransport):
    """Calls an address under another host name: by it a server of several plants knows whose request it is."""

    def __init__(self, host: str) -> None:
        super().__init__(trust_env=False)
        self._host = host

    def handle_request(self, request: httpx.Request) -> httpx.Response:
        """Send it."""
        request.headers["Host"] = self._host
        return super().handle_request(request)


def start(url: str, host: str, secret: str, machine: str) -> None:
    """Let the machine with this key run in a thread of its own until it is removed or the process ends.

    url: of this server as this computer reaches it. host: the name under which a browser reached it.
    """
    if (other := _running.pop(machine, None)) is not None:
        other.set()
    ending = _running[machine] = threading.Event()
    arguments = url, host, secret, machine, ending
    threading.Thread(target=_run, args=arguments, name=f"simulated {machine}", daemon=True).start()


def stop(machine: str) -> None:
    """End the machine with this key, where this process simulates it."""
    if (ending := _running.pop(machine, None)) is not None:
        ending.set()


def _run(url: str, host: str, secret: str, machine: str, ending: threading.Event) -> None:
    try:
        with Client(url, secret, patience=PATIENCE, stop=ending, transport=Named(host)) as gateway:
            spec = lathe(machine.removeprefix("simulated-"))
            run = datetime.now(UTC).strftime("%y%m%d%H%M%S")
            rng = Random(machine)  # noqa: S311 - a simulated machine, not cryptography
            line = OneLine(simulation(spec), gateway, gateway, run, rng, ending)
            if line.has_history():
                line.settle()
            line.live(Pace(SPEED, datetime.now(UTC), line.machine.at))
    except Stopped:
        pass
    except Exception:
        log.exception("the simulated machine %s has ended", machine)
    finally:
        if _running.get(machine) is ending:
            del _running[machine]
