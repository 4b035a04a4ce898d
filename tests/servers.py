"""Fixtures of the server: real processes of ``inband serve``, one for most files of a worker, and the people who use it."""

import itertools
import os
import signal
import socket
import ssl
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import psycopg
import pytest

from app import HOUSE
from app.db.engine import Database
from tests.databases import NewDatabase, drop_database
from tests.forked import Forked
from tests.server_logs import follow
from tests.shop import KEY, Person, Shop

TLS = ssl.create_default_context()
"""For every client: to read the certificates takes longer than most tests."""
Process = subprocess.Popen[bytes] | Forked


def begun(command: list[str], stderr: Path) -> Process:
    """``inband …`` that starts from nothing, as people start it."""
    with stderr.open("ab") as log:
        return subprocess.Popen(
            [sys.executable, "-m", "app", *command], cwd=HOUSE, stdout=log, stderr=log, stdin=subprocess.DEVNULL
        )


@dataclass
class Server:
    """A running ``inband serve`` with a database of its own."""

    url: str
    database: Database
    process: Process
    start: Callable[[], Process]
    stderr: Path
    _clients: list[httpx.Client] = field(default_factory=list)
    _kept: list[httpx.Client] = field(default_factory=list)

    def client(self, key: str | None = None, **headers: str) -> httpx.Client:
        """An HTTP client of this server; with ``key`` it calls as that key's owner."""
        if key is not None:
            headers["Authorization"] = f"Bearer {key}"
        client = httpx.Client(base_url=self.url, headers=headers, timeout=60, verify=TLS)
        self._clients.append(client)
        return client

    def key(self, role: str | None = "admin", machine: str | None = None) -> str:
        """The secret of a new key, for a role or for a machine."""
        from app.access.keys import add_key

        with self.database.begin() as session:
            return add_key(session, role=None if machine else role, machine=machine, name=KEY, actor="tests").secret

    def person(self, name: str, role: str, password: str = "correct horse battery") -> str:
        """A new person who may sign in; the answer is the password."""
        from app.access import actions

        with self.database.begin() as session:
            actions.add_person(session, name=name, role=role, password=password, actor="tests")
        return password

    def kill(self) -> None:
        """SIGKILL: no time to finish anything."""
        self.process.kill()
        self.process.wait()

    def stop(self) -> int:
        """SIGTERM, as a service manager ends it; the exit status."""
        self.process.terminate()
        return self.process.wait(60)

    def restart(self) -> None:
        """After ``kill`` or ``stop``: the same address, the same database."""
        self.process = self.start()

    def keep(self, *clients: httpx.Client) -> None:
        """These are of all files: `hang_up` leaves them open."""
        self._kept += clients

    def hang_up(self) -> None:
        """Close the clients that were given out."""
        for client in self._clients:
            if client not in self._kept:
                client.close()
        self._clients = list(self._kept)

    def close(self) -> None:
        self._kept.clear()
        self.hang_up()
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(15)
            except (TimeoutError, subprocess.TimeoutExpired):
                self.kill()


def _ports() -> Iterator[int]:
    """Ports below those that the system gives out by itself; each worker of a run has some of its own."""
    worker, each = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:]) % 8, 2_000
    for number in itertools.count(os.getpid()):
        yield 16_000 + worker * each + number % each


_next_ports = _ports()


def free_port() -> int:
    """A loopback port that nobody listens on, and that nobody is given before the server for it has started."""
    for port in _next_ports:
        with socket.socket() as probe, suppress(OSError):
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(("127.0.0.1", port))
            return port
    raise AssertionError


def wait_ready(url: str, process: Process, stderr: Path, seconds: float = 600) -> None:
    """Until ``/health/ready`` says 200."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if process.poll() is not None:
            pytest.fail(f"the server ended with {process.returncode}:\n{stderr.read_text()}")
        try:
            if httpx.get(f"{url}/health/ready", timeout=5, verify=TLS).status_code == 200:
                return
        except httpx.TransportError:
            pass
        time.sleep(0.05)
    process.send_signal(signal.SIGKILL)
    process.wait()
    pytest.fail(f"the server was not ready after {seconds} s:\n{stderr.read_text()}")


RunServer = Callable[..., AbstractContextManager[Server]]


@pytest.fixture(scope="session")
def run_server(postgres: str, new_database: NewDatabase, tmp_path_factory: pytest.TempPathFactory) -> RunServer:
    """``with run_server() as server``: a server on a fresh database; ``run_server(url, log_format="json")`` on one that exists.

    It has the environment of the moment at which it starts. With ``forked=False`` it starts from nothing, as people start it.
    With the PostgreSQL of all tests, which nobody kills, it is patient: that one is slow where the computer is.
    """

    @contextmanager
    def run(database_url: str | None = None, *, forked: bool = True, **options: object) -> Iterator[Server]:
        own = database_url is None
        url = new_database() if database_url is None else database_url
        stderr, port = tmp_path_factory.mktemp("server") / "stderr", free_port()
        options = {"data_dir": stderr.parent / "data"} | options  # no test may write to a real installation
        follow(stderr)
        command = ["serve", "--port", str(port), "--database-url", url]
        for option, value in options.items():
            command += [f"--{option.replace('_', '-')}", str(value)]

        patient = {"INBAND_DATABASE_PATIENCE": "30"} if urlsplit(url).query == urlsplit(postgres).query else {}

        def start() -> Process:
            process = Forked(command, stderr, environment=patient | os.environ) if forked else begun(command, stderr)
            wait_ready(f"http://127.0.0.1:{port}", process, stderr)
            return process

        server = Server(f"http://127.0.0.1:{port}", Database(url, pool_size=2), start(), start, stderr)
        try:
            yield server
        finally:
            server.close()
            server.database.close()
            if own:
                drop_database(url)

    return run


@pytest.fixture(scope="session")
def common_server(new_database: NewDatabase, run_server: RunServer) -> Iterator[Server]:
    """The server that most files of a worker share. What a test makes there has names of its own: `unique`.

    No periodic job begins by itself, which it would once a minute, in the middle of any test: `run_jobs`.
    """
    url = new_database()
    with psycopg.connect(url, autocommit=True) as rounds:
        rounds.execute("SELECT pg_advisory_lock(7291, 'job_run'::regclass::oid::int4)")  # app.jobs.runner takes it
        with run_server(url) as running:
            yield running
    drop_database(url)


@pytest.fixture(scope="module")
def server(request: pytest.FixtureRequest, run_server: RunServer) -> Iterator[Server]:
    """A running server: the worker's, or with ``pytestmark = pytest.mark.own_server`` one for this file alone.

    One of its own needs whoever looks at lists or settings of the whole plant, or stops the server.
    """
    if request.node.get_closest_marker("own_server") is None:
        common: Server = request.getfixturevalue("common_server")
        yield common
        common.hang_up()  # a worker that runs all files would hold more files open than `select` can count
        return
    with run_server() as running:
        yield running


@pytest.fixture
def shop(server: Server) -> Shop:
    """A machine and a characteristic of this test alone."""
    return Shop(server)


@pytest.fixture(scope="module")
def common_shop(server: Server) -> Shop:
    """A machine and a characteristic for the tests of one file that leave no trace that another one would see."""
    return Shop(server)


@pytest.fixture(scope="module")
def operator(server: Server) -> Person:
    return Person(server, "operator")


@pytest.fixture(scope="module")
def engineer(server: Server) -> Person:
    return Person(server, "engineer")


@pytest.fixture(scope="module")
def viewer(server: Server) -> Person:
    return Person(server, "viewer")


@pytest.fixture(scope="module")
def admin(server: Server) -> Person:
    return Person(server, "admin")
