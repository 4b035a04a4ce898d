"""The bridge's processor time for each of its steps, and what follows for many machines.

Control and server are processes of their own that answer at once; measured is the bridge's side alone, the best of several
rounds, so that a busy computer spoils little. ``python -m bench.bridge_steps``
"""

import asyncio
import json
import multiprocessing
import ssl
import subprocess
import sys
import tempfile
import time
from collections.abc import Awaitable, Callable
from pathlib import Path

from app.bridge import offering, server_side
from app.bridge.configuration import configuration_from
from app.bridge.links import Position, Received
from app.bridge.program import link_of
from app.bridge.store import Store
from app.bridge.unit import Unit
from app.bridge.wire import Wire
from app.core.ring import Register
from inband_client import AsyncClient

DECISION = {
    "characteristic": "c0",
    "sequence": 812,
    "key": "m0:140892:812",
    "measured": 39.9981,
    "deviation": 0.0004,
    "zone": "zero",
    "average_before": 0.0012,
    "average_after": 0.0012,
    "action": "none",
    "alarms": [],
    "reason": {"code": "in_zero_range", "text": "Deviation 0.4 µm is within the zero range 1 µm: nothing to do."},
    "parameters_version": 4,
    "measured_at": "2026-11-21T08:15:02.120+01:00",
    "received_at": "2026-11-21T08:15:02.140+01:00",
}
ROUNDS, CALLS = 12, 40


class Answers(asyncio.Protocol):
    """A server that answers each request at once with what fits its path."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self.transport = transport

    def data_received(self, data: bytes) -> None:
        body = {"items": [], "next": None} if data.startswith(b"GET") else DECISION
        content = json.dumps(body).encode()
        head = f"HTTP/1.1 200 OK\r\ncontent-type: application/json\r\ncontent-length: {len(content)}\r\n\r\n"
        self.transport.write(head.encode() + content)


def answer(ports: "multiprocessing.Queue[int]") -> None:
    """Be the server."""

    async def run() -> None:
        server = await asyncio.get_running_loop().create_server(Answers, "127.0.0.1", 0)
        ports.put(server.sockets[0].getsockname()[1])
        await server.serve_forever()

    asyncio.run(run())


async def cost(call: Callable[[], Awaitable[object]]) -> float:
    """Microseconds of processor for one call."""
    found = []
    for _ in range(ROUNDS):
        began = time.process_time()
        for _ in range(CALLS):
            await call()
        found.append((time.process_time() - began) / CALLS * 1e6)
    return min(found)


async def measure(table: dict[str, object], port: int, folder: Path) -> dict[str, float]:
    """Each step's cost, µs."""
    url = f"http://127.0.0.1:{port}"
    content = {"server": {"url": url}, "machine": {"m0": table}}
    [machine] = configuration_from(content, folder).machines
    store = Store(folder / "store.sqlite3")
    unit = Unit(machine, link_of(machine), store)
    client = AsyncClient(url, "key", transport=Wire(ssl.create_default_context()))
    plain = AsyncClient(url, "key")
    await unit.link.connect()
    stored = Position()
    while not (received := await unit.link.fetch(stored)):  # noqa: ASYNC110 - the control's first part
        await asyncio.sleep(0.1)
    stored = received[-1].position or stored
    body = received[0].body | {"key": received[0].key}
    numbers = iter(range(10_000_000))

    async def keep() -> None:
        await store.add("m0", [Received(f"m0:1:{next(numbers)}", received[0].body, stored)])
        rows = await store.waiting("m0")
        await store.sent("m0", [row.id for row in rows])

    async def full() -> None:
        await offering.tell(unit, client)
        await offering.ask(unit, client)

    async def beat() -> None:
        await client.heartbeat("m0", **await server_side.heartbeat(unit))

    registers = unit.link.registers  # type: ignore[attr-defined]
    steps: dict[str, Callable[[], Awaitable[object]]] = {
        "poll that finds nothing (opcua)": lambda: unit.link.fetch(stored),
        "acknowledgement (opcua)": lambda: registers.write(Register.ACK, float(stored.sequence)),
        "offset read (opcua)": unit.link.offsets,
        "store: kept, looked up, noted as sent": keep,
        "reading pushed": lambda: client.push(body),
        "… with httpx's own connections": lambda: plain.push(body),
        "corrections asked for, answers looked up": full,
        "heartbeat": beat,
    }
    found = {name: await cost(step) for name, step in steps.items()}
    await unit.link.close()
    await client.close()
    await plain.close()
    store.close()
    return found


def main() -> None:
    ports: multiprocessing.Queue[int] = multiprocessing.Queue()
    server = multiprocessing.Process(target=answer, args=(ports,), daemon=True)
    server.start()
    command = [sys.executable, "-m", "bench.bridge", "--simulate", "--kind", "opcua", "--machines", "1"]
    controls = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert controls.stdin is not None
    assert controls.stdout is not None
    [table] = json.loads(controls.stdout.readline())
    table |= {"secret": "key", "characteristics": {"1": "c0"}, "proof_needed": False}
    with tempfile.TemporaryDirectory(prefix="inband-bench-steps-") as folder:
        found = asyncio.run(measure(table, ports.get(), Path(folder)))
    controls.stdin.close()
    controls.stdout.read()
    server.terminate()
    for name, microseconds in found.items():
        print(f"{name:44} {microseconds:7.0f} µs")
    poll, acknowledged, offset, kept, pushed, _, asked, beaten = found.values()
    reading = acknowledged + kept + pushed + poll  # one poll more finds another block, and reads it anew
    for interval in (0.25, 0.5, 1.0):
        each = poll / interval + reading + asked / 5 + (beaten + offset) / 10
        print(f"a machine with a reading a second, polled every {interval:g} s: {each / 1e4:.2f} % of one core")


if __name__ == "__main__":
    main()
