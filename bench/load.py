"""The load: connections that each push single readings over HTTP, one after the other. A process of its own.

``python -m bench.load PORT KEY CONNECTIONS SECONDS SPREAD RUN`` prints one line of JSON: how many were answered 201 and
the latencies in µs at some quantiles. SPREAD is the number of characteristics; RUN makes the keys of the readings unique.
"""

import asyncio
import gc
import json
import sys
import time
from typing import cast

import uvloop

TARGET = 39.992


class Client(asyncio.Protocol):
    """One connection: sends a reading, waits for its answer, sends the next."""

    def __init__(self, number: int, head: bytes, spread: int, run: str, until: float) -> None:
        self.number, self.head, self.spread, self.run, self.until = number, head, spread, run, until
        self.sent = 0
        self.latencies: list[int] = []
        self.done: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self.buffer = b""
        self.transport: asyncio.Transport | None = None
        self.begun = 0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = cast("asyncio.Transport", transport)  # uvloop's own class
        self.push()

    def push(self) -> None:
        assert self.transport is not None
        self.sent += 1
        place = (self.number * 37 + self.sent * 7) % self.spread + 1
        # Within the zero range, as most readings of a process in control are.
        measured = TARGET + 0.0001 * ((self.sent * 31 + self.number) % 19 - 9)
        body = (
            f'{{"characteristic":"c{place}","measured":{measured:.4f},"part":"SN-{self.sent}",'
            f'"key":"{self.run}:{self.number}:{self.sent}","measured_at":"2026-11-21T08:15:02.120+01:00"}}'
        ).encode()
        self.begun = time.perf_counter_ns()
        self.transport.write(self.head % len(body) + body)

    def data_received(self, data: bytes) -> None:
        self.buffer = self.buffer + data if self.buffer else data
        end = self.buffer.find(b"\r\n\r\n")
        if end < 0:
            return
        at = self.buffer.find(b"content-length: ")
        length = int(self.buffer[at + 16 : self.buffer.find(b"\r\n", at)])
        if len(self.buffer) < end + 4 + length:
            return
        if not self.buffer.startswith(b"HTTP/1.1 201"):
            self.done.set_exception(RuntimeError(self.buffer.decode()))
            return
        self.buffer = b""
        self.latencies.append(time.perf_counter_ns() - self.begun)
        if time.monotonic() < self.until:
            self.push()
        elif not self.done.done():
            assert self.transport is not None
            self.transport.close()
            self.done.set_result(None)

    def connection_lost(self, error: Exception | None) -> None:
        if not self.done.done():
            self.done.set_exception(error or ConnectionError("the server closed the connection"))


async def load(port: int, key: str, connections: int, seconds: float, spread: int, run: str) -> None:
    head = (
        f"POST /api/v1/readings HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer {key}\r\n"
        "Content-Type: application/json\r\nContent-Length: %d\r\n\r\n"
    ).encode()
    loop = asyncio.get_running_loop()
    begun = time.monotonic()
    clients: list[Client] = []
    for number in range(connections):
        client = Client(number, head, spread, run, begun + seconds)
        await loop.create_connection(lambda client=client: client, "127.0.0.1", port)  # type: ignore[misc]
        clients.append(client)
    await asyncio.gather(*(client.done for client in clients))
    took = time.monotonic() - begun
    latencies = sorted(value for client in clients for value in client.latencies)
    at = {str(q): latencies[min(len(latencies) - 1, int(len(latencies) * q))] / 1000 for q in (0.5, 0.9, 0.99, 0.999)}
    print(json.dumps({"count": len(latencies), "seconds": took, "rate": len(latencies) / took, "quantiles": at}))


if __name__ == "__main__":
    gc.disable()
    port, key, connections, seconds, spread, run = sys.argv[1:]
    uvloop.run(load(int(port), key, int(connections), float(seconds), int(spread), run))
