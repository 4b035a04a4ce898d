"""A machine of the model behind registers in memory, and the bridge's tasks around it."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager
from datetime import datetime
from pathlib import Path
from typing import Any

from app.bridge import control_side, proving_by_page, server_side
from app.bridge.configuration import Location, Machine, Server
from app.bridge.links import ControlAway
from app.bridge.registers import RegisterLink
from app.bridge.store import Store
from app.bridge.unit import Unit, ended
from app.core.ring import Register
from app.simulators.controls.model import Feature, Model
from inband_client import AsyncClient
from tests.servers import TLS
from tests.shop import Shop

PATIENCE = 60.0  # s: of a machine under load


class ModelRegisters:
    """The registers of a model, read and written without a protocol. away: the cable is out."""

    def __init__(self, model: Model, *, whole: bool = True, on_read: Callable[[], None] | None = None) -> None:
        self.model = model
        self.whole = whole
        self.on_read = on_read
        self.away = False
        self.may_write: str | None = None
        self.writes: list[tuple[int, float]] = []

    def _there(self) -> None:
        if self.away:
            raise ControlAway("The cable is out.")

    async def connect(self) -> str:
        self._there()
        return self.model.serial

    async def close(self) -> None:
        pass

    async def shown_time(self) -> datetime | None:
        return self.model.clock()

    async def read(self, places: Sequence[int]) -> list[float]:
        self._there()
        if self.on_read:
            self.on_read()
        return [self.model.registers[place] for place in places]

    async def write(self, place: int, value: float) -> None:
        self._there()
        self.writes.append((place, value))
        self.model.registers[place] = value

    async def shown(self, place: int, value: float) -> None:
        pass

    async def read_offset(self, location: Location) -> float | None:
        self._there()
        return self.model.offsets[location.tool, location.edge, location.register]

    async def write_offset(self, location: Location, value: float) -> None:
        self._there()
        self.model.offsets[location.tool, location.edge, location.register] = value

    async def against_writing(self, location: Location) -> str | None:
        self._there()
        return self.may_write


def location(feature: Feature, tool_memory: int = 3, **other: Any) -> Location:
    return Location(
        tool_memory=tool_memory,
        tool=feature.tool,
        edge=feature.edge,
        register=feature.register,
        holds=feature.holds,  # type: ignore[arg-type]
        sign=feature.sign,  # type: ignore[arg-type]
        **other,
    )


def machine(model: Model, **other: Any) -> Machine:
    fields: dict[str, Any] = {
        "key": "lathe-1",
        "kind": "haas",
        "unit": "mm" if model.unit == 1 else "inch",
        "secret": "secret",
        "settings": None,
        "characteristics": {"1": "shaft-1"},
        "location": (location(model.features[0]),),
        "interval": 0.02,
        "proof_needed": False,
    }
    return Machine(**fields | other)


async def parts(model: Model, count: int) -> None:
    """Make parts; the ring is waited for."""
    for _ in range(count):
        for _ in model.part():
            full = model.registers[Register.WRITTEN] - model.registers[Register.ACK] >= 8
            await asyncio.sleep(0.01 if full or model.idle else 0)


async def until(met: Callable[[], Awaitable[Any] | Any], what: str) -> None:
    """Wait until something is so."""
    for _ in range(int(PATIENCE / 0.05)):
        found = met()
        if await found if isinstance(found, Awaitable) else found:
            return
        await asyncio.sleep(0.05)
    raise AssertionError(f"{what}: not within {PATIENCE:g} s")


@asynccontextmanager
async def controlled(unit: Unit) -> AsyncIterator[Unit]:
    """The task that talks to the control, for as long as the block runs."""
    task = asyncio.create_task(control_side.run(unit))
    try:
        yield unit
    finally:
        await ended([task])


@asynccontextmanager
async def bridge(shop: Shop, unit: Unit, *, heartbeat: bool = False) -> AsyncIterator[Unit]:
    """The tasks of one machine, for as long as the block runs."""
    server = Server(url=shop.server.url, ask=0.2, heartbeat=0.1)
    async with AsyncClient(server.url, shop.machine_key, patience=0.0, verify=TLS) as client:
        work = [control_side.run(unit), server_side.run(unit, client, server), proving_by_page.run(unit, client)]
        if heartbeat:
            work.append(server_side.beat(unit, client, server))
        tasks = [asyncio.create_task(each) for each in work]
        try:
            yield unit
        finally:
            await ended(tasks)


def unit_of(model: Model, store: Store, registers: ModelRegisters | None = None, **fields: Any) -> Unit:
    chosen = machine(model, **fields)
    return Unit(chosen, RegisterLink(chosen, registers or ModelRegisters(model)), store)


def store_in(folder: Path) -> Store:
    return Store(folder / "bridge.sqlite3")
