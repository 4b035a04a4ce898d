"""A server of its own for one benchmark: embedded PostgreSQL with fsync on, `inband serve`, and a plant to measure on."""

import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx
import psycopg

from app.access import actions
from app.db.binaries import binary
from app.db.embedded import EmbeddedServer
from app.db.engine import Database

PARAMETERS = {
    "nominal": 40.0,
    "upper_deviation": 0.0,
    "lower_deviation": -0.016,
    "zero_range": 0.001,
    "averaging_limit": 0.0053,
    "wear_limit": 0.3,
    "confidence_limit": 1.0,
    "weighting_factor": 2,
    "factor": -1,
}
TARGET = 39.992


@dataclass
class Plant:
    """Plant of a benchmark."""

    url: str
    port: int
    dsn: str
    key: str
    process: subprocess.Popen[bytes]
    binaries: Path


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextmanager
def plant(characteristics: int = 0, machine: str = "bench") -> Iterator[Plant]:
    """A running server with one machine and so many characteristics ``c1``, ``c2`` … that measure without a tool."""
    with tempfile.TemporaryDirectory(prefix="inband-bench-") as folder:
        server = EmbeddedServer(Path(folder) / "data")
        dsn = server.start()
        port = free_port()
        process = subprocess.Popen(
            [sys.executable, "-m", "app", "serve", "--port", str(port)],
            env=os.environ | {"INBAND_DATABASE_URL": dsn},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        running: Plant | None = None
        try:
            url = f"http://127.0.0.1:{port}"
            wait_until_ready(url, process)
            database = Database(dsn, pool_size=1)
            with database.begin() as session:
                key = actions.add_key(session, role="admin", machine=None, name="bench", actor="bench").secret
            database.close()
            _set_up(url, key, machine, characteristics)
            with psycopg.connect(dsn, autocommit=True) as connection:
                connection.execute("VACUUM ANALYZE")
            running = Plant(url, port, dsn, key, process, binary("pgbench").parent)
            yield running
        finally:
            if running is not None:
                process = running.process  # another one, where the server was killed and started again
            process.terminate()
            process.wait(30)
            server.stop()


def wait_until_ready(url: str, process: subprocess.Popen[bytes]) -> None:
    """Until it answers, at most three minutes: the computer may be busy."""
    for _attempt in range(1800):
        if process.poll() is not None:
            raise SystemExit("the server ended before it was ready")
        try:
            if httpx.get(f"{url}/health/ready").status_code == httpx.codes.OK:
                return
        except httpx.HTTPError:
            pass
        time.sleep(0.1)
    raise SystemExit("the server was not ready within three minutes")


def _set_up(url: str, key: str, machine: str, characteristics: int) -> None:
    with httpx.Client(base_url=f"{url}/api/v1", headers={"Authorization": f"Bearer {key}"}, timeout=60) as client:
        client.post("/machines", json={"key": machine, "name": "Bench", "control": "other"}).raise_for_status()
        for number in range(1, characteristics + 1):
            client.post(
                "/characteristics",
                json={"key": f"c{number}", "name": f"Bench {number}", "machine": machine, "parameters": PARAMETERS},
            ).raise_for_status()


def median(values: list[float]) -> float:
    ordered = sorted(values)
    middle = len(ordered) // 2
    return ordered[middle] if len(ordered) % 2 else (ordered[middle - 1] + ordered[middle]) / 2
