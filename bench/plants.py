"""How many plants a cluster of Citus carries: a coordinator and two workers on this computer, and one `inband serve`.

Plants are added and distributed up to each of the given numbers; each has a machine that sends one reading after the other.
Printed are the seconds that adding and distributing one takes, the seconds until a server serves all of them, its memory, the
connections and memory of the coordinator and of the fullest worker, and the readings of all plants together.
`INBAND_TEST_CITUS` names the folder of PostgreSQL's programs with Citus. ``python -m bench.plants [--plants 10 20 40]``
"""

import argparse
import contextlib
import io
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import httpx
import psycopg

from app.access.keys import add_key
from app.cli import plants as commands
from app.db import citus
from app.db.connections import in_schema
from app.db.embedded import EmbeddedServer, _children
from app.db.engine import Database
from bench.plant import free_port
from tests.loop.readings.load import Sender, all_at_once, scattered
from tests.plants.nodes import PROGRAMS, nodes
from tests.shop import PARAMETERS

USUAL = {"name": None, "schema": None, "host": None, "timezone": None, "shifts": None, "data_dir": None}
POOL = "3"
CONNECTIONS = "SELECT count(*) FROM pg_stat_activity WHERE backend_type = 'client backend' AND pid <> pg_backend_pid()"


def add(url: str, key: str) -> tuple[float, float]:
    """Add a plant and distribute it; the seconds of both."""
    begun = time.perf_counter()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        commands.add_plant(key, **USUAL, database_url=url)
    added = time.perf_counter()
    with psycopg.connect(url, autocommit=True) as connection:
        citus.distribute(connection, key)
    return added - begun, time.perf_counter() - added


def memory(*processes: int) -> float:
    """MB of processes, with their share of what they have in common."""
    total = 0
    for process in processes:
        try:
            text = Path(f"/proc/{process}/smaps_rollup").read_text()
        except OSError:  # it has ended meanwhile
            continue
        total += int((re.search(r"^Pss:\s+(\d+)", text, re.MULTILINE) or [0, 0])[1])
    return total / 1024


def of_node(node: EmbeddedServer) -> tuple[int, float]:
    """Connections and MB of a node."""
    assert node.pid is not None
    with psycopg.connect(node.url, autocommit=True) as connection:
        (count,) = connection.execute(CONNECTIONS).fetchone() or (0,)
    return count, memory(node.pid, *_children(node.pid))


def key_of(url: str, plant: str, machine: str | None) -> str:
    database = Database(in_schema(url, plant), pool_size=1)
    with database.begin() as session:
        role = None if machine else "admin"
        secret = add_key(session, role=role, machine=machine, name="bench", actor="bench").secret
    database.close()
    return secret


def set_up(url: str, address: str, plant: str) -> Sender:
    """A machine with a characteristic in a plant; whoever sends its readings."""
    headers = {"Authorization": f"Bearer {key_of(url, plant, None)}"}
    with httpx.Client(base_url=f"{address}/p/{plant}/api/v1", headers=headers, timeout=120) as client:
        for path, body in (
            ("machines", {"key": "m", "name": "M", "control": "other"}),
            ("characteristics", {"key": "s", "name": "S", "machine": "m", "parameters": PARAMETERS}),
        ):
            answer = client.post(f"/{path}", json=body)
            assert answer.status_code in {201, 409}, answer.text
    return Sender(f"{address}/p/{plant}", key_of(url, plant, "m"), scattered("s", 10**7, time.time_ns()), patience=120)


def served(address: str, plants: list[str], process: subprocess.Popen[bytes]) -> None:
    for plant in plants:
        while True:
            assert process.poll() is None, "the server has ended"
            try:
                if httpx.get(f"{address}/p/{plant}/health/ready", timeout=60).status_code == 200:
                    break
            except httpx.HTTPError:
                pass
            time.sleep(0.2)


def stage(cluster: list[EmbeddedServer], folder: Path, plants: list[str], seconds: float) -> str:
    """One line of the table: a server of these plants, readings into all of them for a while."""
    url, port = cluster[0].url, free_port()
    command = [sys.executable, "-m", "app", "serve", "--port", str(port)]
    environment = {"INBAND_DATABASE_URL": url, "INBAND_DATA_DIR": str(folder / "serve"), "INBAND_POOL_SIZE": POOL}
    begun = time.perf_counter()
    with (folder / "serve.log").open("ab") as log:
        process = subprocess.Popen(command, env=os.environ | environment, stdout=log, stderr=log)
    address = f"http://127.0.0.1:{port}"
    try:
        served(address, plants, process)
        ready = time.perf_counter() - begun
        senders = [set_up(url, address, plant) for plant in plants]
        stop = threading.Event()
        with ThreadPoolExecutor(1) as pool:
            working = pool.submit(all_at_once, senders, stop)
            time.sleep(seconds / 2)
            before, from_ = sum(len(sender.answers) for sender in senders), time.perf_counter()
            time.sleep(seconds)
            rate = (sum(len(sender.answers) for sender in senders) - before) / (time.perf_counter() - from_)
            coordinator, *workers = [of_node(node) for node in cluster]
            own = memory(process.pid)
            stop.set()
            try:
                working.result(180)
            except AssertionError as error:
                error.add_note(f"The server's log is {folder / 'serve.log'}.")
                raise
    finally:
        process.terminate()
        process.wait(60)
    full = max(workers)
    return (
        f"{len(plants):>6}  {ready:>14.1f}  {own:>9.0f}  {coordinator[0]:>11}  {coordinator[1]:>8.0f}"
        f"  {full[0]:>11}  {full[1]:>8.0f}  {rate:>10.0f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plants", type=int, nargs="+", default=[10, 20, 40])
    parser.add_argument("--seconds", type=float, default=20)
    arguments = parser.parse_args()
    if not PROGRAMS:
        parser.error("INBAND_TEST_CITUS has to name the folder of PostgreSQL's programs with Citus.")
    folder = Path(tempfile.mkdtemp(prefix="inband-"))
    folder.chmod(0o711)
    with nodes(folder, options={"max_connections": "1000"}) as cluster:
        plants: list[str] = []
        took: list[tuple[float, float]] = []
        print("        inband serve:              coordinator:           fullest worker:        together:")
        print("plants  s until served  MB         connections  MB        connections  MB        readings/s", flush=True)
        for count in sorted(arguments.plants):
            while len(plants) < count:
                plants.append(f"plant{len(plants):03}")
                took.append(add(cluster[0].url, plants[-1]))
            print(stage(cluster, folder, plants, arguments.seconds), flush=True)
    shutil.rmtree(folder)
    for what, seconds in zip(("add", "distribute"), zip(*took, strict=True), strict=True):
        print(f"to {what} a plant: {statistics.median(seconds):.1f} s in the middle, {max(seconds):.1f} s at most")


if __name__ == "__main__":
    main()
