"""A machine of the plant that cannot speak REST: a simulated Haas control, and the bridge beside it."""

import asyncio
import contextlib
import logging
import shutil
import threading
from pathlib import Path
from typing import Any

from app.bridge import program
from app.bridge.configuration import Configuration, configuration_from
from app.bridge.store import Store
from app.simulators.controls import haas
from app.simulators.controls.model import Feature, Model, live
from app.simulators.demo.installing import KEY_NAME, new_key
from inband_client import Client, NotFound

log = logging.getLogger(__name__)
MACHINE, CHARACTERISTIC, TOOL = "mill-2", "spigot-d30", 4
FEATURE = Feature(nominal=30.0, tool=TOOL, register="wear_diameter", parameter=2600, bias=0.002, wear=0.0003)
PARAMETERS = {
    "tool_memory": TOOL,
    "average_memory": 1,
    "nominal": FEATURE.nominal,
    "upper_deviation": 0.01,
    "lower_deviation": -0.01,
    "zero_range": 0.0015,
    "wear_limit": 0.3,
    "confidence_limit": 1.0,
    "weighting_factor": 2,
    "factor": -1,
}
CYCLE = 120.0  # s of life per part


def start(url: str, admin_key: str, speed: float, folder: Path) -> None:
    """Set the machine up, and let its control and the bridge run in a thread until the server's process ends.

    folder: of the bridge's store, begun again each time as the control's counters are.
    """
    with Client(url, admin_key) as admin:
        _set_up(admin)
        secret = new_key(admin, f"/machines/{MACHINE}/keys", {"name": KEY_NAME})
        offset = admin.get(f"/machines/{MACHINE}/tools/{TOOL}")["offset"]
    threading.Thread(target=_run, args=(url, secret, offset, speed, folder), name="demo bridge", daemon=True).start()


def _set_up(admin: Client) -> None:
    try:
        admin.get(f"/machines/{MACHINE}")
    except NotFound:
        machine = {"key": MACHINE, "name": "Milling machine 2 (bridge)", "control": "other", "type": "mill"}
        admin.post("/machines", machine)
        body = {"key": CHARACTERISTIC, "name": "Spigot Ø30", "machine": MACHINE, "part": "flange-2200"}
        admin.post("/characteristics", body | {"parameters": PARAMETERS})


def _run(url: str, secret: str, offset: float, speed: float, folder: Path) -> None:
    try:
        shutil.rmtree(folder, ignore_errors=True)
        asyncio.run(_machine_and_bridge(url, secret, offset, speed, folder))
    except Exception:
        log.exception("the bridge of the demonstration plant has ended")


async def _machine_and_bridge(url: str, secret: str, offset: float, speed: float, folder: Path) -> None:
    """A fresh control each time: its counters begin a new epoch, its offset is the one that the server knows."""
    model = Model((FEATURE,), seed=None)
    model.offsets[FEATURE.tool, FEATURE.edge, FEATURE.register] = offset
    simulator = await haas.serve(model, 0)
    parts = asyncio.create_task(live(model, max(CYCLE / speed, 0.5)))
    chosen = _configuration(url, secret, simulator.table(), folder)
    store = Store(Path(chosen.store.file))
    try:
        machine = chosen.machines[0]
        await store.prove(machine.key, TOOL, machine.mapping_hash(machine.location[0]))
        await program.run(chosen, store)
    finally:
        parts.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await parts
        await simulator.stop()
        store.close()


def _configuration(url: str, secret: str, simulated: dict[str, Any], folder: Path) -> Configuration:
    table = {name: value for name, value in simulated.items() if name != "secret_file"}
    table |= {"secret": secret, "characteristics": {"1": CHARACTERISTIC}}
    return configuration_from({"server": {"url": url}, "machine": {MACHINE: table}}, folder)
