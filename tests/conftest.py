"""Fixtures of all tests: a real PostgreSQL with the schema by migrations, real server processes, a real browser.

One embedded server serves the whole run, xdist's workers too: each enters it as any process of Inband would, and the last
one out stops it. A test that commits has a database of its own (``database``), made from a migrated template in some
hundredths of a second; a test that only looks at what a transaction does takes ``session``, which is rolled back.
"""

import fcntl
import gc
import itertools
import os
import shutil
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
from tempfile import mkdtemp
from typing import Any
from urllib.parse import urlsplit

import httpx
import psycopg
import pytest
from playwright.sync_api import Browser, Page, Playwright, Request, expect, sync_playwright
from sqlalchemy.orm import Session
from xdist import plugin as xdist_plugin

from app import HOUSE
from app.db import migrate
from app.db.embedded import EmbeddedServer, make_data_dir
from app.db.engine import Database
from tests import chance, forked, keeper, one_connection, quick_passwords  # noqa: F401 - the last two replace what they are about
from tests.db.first_program import make_first_program
from tests.forked import Forked
from tests.server_logs import follow, pytest_runtest_makereport, pytest_runtest_setup  # noqa: F401 - hooks of pytest
from tests.shop import KEY, Person, Shop

for name in [name for name in os.environ if name.startswith(("INBAND_", "PG")) and name != "INBAND_TEST_CITUS"]:
    del os.environ[name]  # no test may meet a real installation
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # hundreds of servers start; each would compile the whole house anew

expect.set_options(timeout=60_000)  # ms; what is expected comes at once where the computer has nothing else to do


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """One more than usual: a third of the time tests wait, for a browser or for a server that starts."""
    return int(xdist_plugin.pytest_xdist_auto_num_workers(config)) + 1


def pytest_configure(config: pytest.Config) -> None:
    chance.load(long=config.getoption("--long"))
    gc.disable()  # until all tests are collected
    if config.getoption("--one-connection"):
        os.environ |= {"INBAND_POOL_SIZE": "1", "INBAND_POOL_OVERFLOW": "0"}
    if hasattr(config, "workerinput"):
        forked.share(config.workerinput["fork_server"])


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: Any) -> None:
    """One fork server reads the program for all workers, while they collect."""
    node.workerinput["fork_server"] = forked.begin()


def pytest_collection_finish() -> None:
    """Thousands of tests were collected to stay; no round of garbage collection need look at them again, nor often at others."""
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)  # by default, a tenth of the processor of a whole run went into it
    gc.enable()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Say how to have the same order and the same chance again."""
    seed = config.getoption("randomly_seed", None)
    if seed is not None and (terminalreporter.stats.get("failed") or terminalreporter.stats.get("error")):
        long = "--long " if config.getoption("--long") else ""
        terminalreporter.write_line(f"to repeat it: {long}--randomly-seed={seed}")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """`make test` leaves out what is slow by nature; `make test-long` runs that, and all that is tried at random."""
    long, one = config.getoption("--long"), config.getoption("--one-connection")
    left_out = [each for each in items if not _runs(each, long=long, one=one)]
    items[:] = [each for each in items if _runs(each, long=long, one=one)]
    config.hook.pytest_deselected(items=left_out)


def _runs(item: pytest.Item, *, long: bool, one: bool) -> bool:
    if one and item.get_closest_marker("several_connections"):
        return False
    if item.get_closest_marker("long"):
        return long
    return not long or item.get_closest_marker("hypothesis") is not None


TEMPLATE = "template_inband"
BROWSER_OPTIONS = [
    "--no-sandbox",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]


# --- the database

OF_ALL = {
    # No test pulls the plug: nobody waits for a disk that others write to, and as little as possible is written to it.
    "fsync": "off",
    "synchronous_commit": "off",
    "full_page_writes": "off",
    "wal_level": "minimal",
    "max_wal_senders": "0",
    "max_connections": "500",  # of the servers of several workers, each with its pool
    "log_lock_waits": "on",  # who waited for whose lock is in its log
}
"""Settings of the PostgreSQL of this run."""


@pytest.fixture(scope="session")
def shared_dir(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One folder for all workers of this run."""
    base = tmp_path_factory.getbasetemp()
    return base.parent if "PYTEST_XDIST_WORKER" in os.environ else base


@pytest.fixture(scope="session")
def postgres(shared_dir: Path) -> Iterator[str]:
    """The server of this run; the URL of a database that no test uses."""
    server = EmbeddedServer((keeper.in_memory() or shared_dir) / "inband", OF_ALL)
    url = server.start()
    follow(server.log)
    try:
        with (shared_dir / "template.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            _make_template(url)
        yield url
    finally:
        if server.stop():
            shutil.rmtree(server.data_dir / "postgres")


def _make_template(url: str) -> None:
    with psycopg.connect(url, autocommit=True) as connection:
        if connection.execute("SELECT 1 FROM pg_database WHERE datname = %s", [TEMPLATE]).fetchone():
            return
        connection.execute(f"CREATE DATABASE {TEMPLATE}_new")
        migrate.upgrade(in_database(url, f"{TEMPLATE}_new"))
        connection.execute(f"ALTER DATABASE {TEMPLATE}_new RENAME TO {TEMPLATE}")


def in_database(url: str, name: str) -> str:
    """The same server, another database."""
    return urlsplit(url)._replace(path=f"/{name}").geturl()


NewDatabase = Callable[[], str]


@pytest.fixture(scope="session")
def new_database(postgres: str) -> Iterator[NewDatabase]:
    """Makes migrated, empty databases; the answer is the URL. They go when the run ends, or by ``drop_database``."""
    numbers = itertools.count(1)
    worker = os.environ.get("PYTEST_XDIST_WORKER", "main")
    with psycopg.connect(postgres, autocommit=True) as connection:

        def make() -> str:
            name = f"{worker}_{next(numbers)}"
            connection.execute(f"CREATE DATABASE {name} TEMPLATE {TEMPLATE}")
            return in_database(postgres, name)

        yield make


def drop_database(url: str) -> None:
    """Drop it, whoever is still connected."""
    with psycopg.connect(in_database(url, "postgres"), autocommit=True) as connection:
        connection.execute(f'DROP DATABASE IF EXISTS "{urlsplit(url).path[1:]}" WITH (FORCE)')


MANY = 100_000


@pytest.fixture(scope="session")
def many_template(postgres: str, shared_dir: Path) -> str:
    """The name of a database in which the characteristic ``long`` of the machine ``lathe-long`` has `MANY` readings.

    Made once in a run, by the server itself, and copied from then on; `many_readings` is such a copy.
    """
    name = f"{TEMPLATE}_many"
    with (shared_dir / "template.lock").open("w") as lock, psycopg.connect(postgres, autocommit=True) as connection:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not connection.execute("SELECT 1 FROM pg_database WHERE datname = %s", [name]).fetchone():
            connection.execute(f"CREATE DATABASE {name}_new TEMPLATE {TEMPLATE}")
            _fill(in_database(postgres, f"{name}_new"))
            connection.execute(f"ALTER DATABASE {name}_new RENAME TO {name}")
    return name


def _fill(url: str) -> None:
    from app.loop.characteristics import actions as characteristics
    from app.loop.characteristics.schemas import CharacteristicIn
    from app.loop.machines import actions as machines
    from app.loop.machines.schemas import MachineIn
    from bench.plant import PARAMETERS
    from bench.readings import fill

    database = Database(url, pool_size=1)
    with database.begin() as session:
        machines.add_machine(session, MachineIn(key="lathe-long", name="Lathe", control="sinumerik"), "tests")
        parameters = PARAMETERS | {"tool_memory": 3}
        added = CharacteristicIn(key="long", name="Long", machine="lathe-long", parameters=parameters)
        characteristics.add_characteristic(session, added, "tests")
    database.close()
    with psycopg.connect(url, autocommit=True) as connection:
        fill(connection, "long", MANY)
        connection.execute("VACUUM ANALYZE")


@pytest.fixture(scope="module")
def many_readings(postgres: str, many_template: str) -> Iterator[Database]:
    """A database of the tests of one file with a characteristic of `MANY` readings, ``long``."""
    name = f"{many_template}_{os.environ.get('PYTEST_XDIST_WORKER', 'main')}"
    url = in_database(postgres, name)
    drop_database(url)
    with psycopg.connect(postgres, autocommit=True) as connection:
        connection.execute(f"CREATE DATABASE {name} TEMPLATE {many_template} STRATEGY file_copy")
    made = Database(url, pool_size=2)
    yield made
    made.close()
    drop_database(url)


@pytest.fixture
def database(new_database: NewDatabase) -> Iterator[Database]:
    """An empty, migrated database of this test alone; what it commits is gone afterwards."""
    made = Database(new_database(), pool_size=2)
    yield made
    made.close()
    drop_database(made.dsn)


@pytest.fixture
def empty_database(postgres: str) -> Iterator[str]:
    """The URL of a database of this test alone in which there is nothing."""
    name = f"empty_{os.environ.get('PYTEST_XDIST_WORKER', 'main')}"
    url = in_database(postgres, name)
    drop_database(url)
    with psycopg.connect(postgres, autocommit=True) as connection:
        connection.execute(f"CREATE DATABASE {name}")
    yield url
    drop_database(url)


@pytest.fixture(scope="session")
def first_program_template(new_database: NewDatabase) -> str:
    """The name of a database as the first published program left it."""
    url = new_database()
    make_first_program(url)
    return urlsplit(url).path[1:]


@pytest.fixture
def first_program(postgres: str, first_program_template: str) -> Iterator[str]:
    """The URL of a database of this test alone as the first published program left it."""
    url = in_database(postgres, f"{first_program_template}_copy")
    drop_database(url)
    with psycopg.connect(postgres, autocommit=True) as connection:
        connection.execute(f"CREATE DATABASE {first_program_template}_copy TEMPLATE {first_program_template}")
    yield url
    drop_database(url)


@pytest.fixture(scope="session")
def whole_cluster(shared_dir: Path) -> Path:
    """A data folder with a PostgreSQL of its own that has Inband's schema, and has ended in order: for `copied`."""
    folder = (keeper.in_memory() or shared_dir) / "whole"
    with (shared_dir / "whole.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not folder.exists():
            make_whole(folder)
    return folder


def make_whole(folder: Path) -> None:
    """Make a data folder as `whole_cluster` gives."""
    made = EmbeddedServer(folder.with_name("whole.new"), {"fsync": "off"})
    migrate.upgrade(made.start())
    made.stop()
    made.data_dir.rename(folder)


def copied(whole: Path, data_dir: Path) -> Path:
    """A data folder as that one: to make a PostgreSQL and its schema takes ten times as long as to start it."""
    make_data_dir(data_dir)
    subprocess.run(["cp", "-a", whole / "postgres", data_dir], check=True)
    return data_dir


@pytest.fixture(scope="session")
def rolled_back_database(new_database: NewDatabase) -> Iterator[Database]:
    made = Database(new_database(), pool_size=1)
    yield made
    made.close()
    drop_database(made.dsn)


@pytest.fixture
def session(rolled_back_database: Database) -> Iterator[Session]:
    """A session in a transaction that is rolled back; ``commit()`` inside ends a savepoint only."""
    with rolled_back_database.engine.connect() as connection:
        outer = connection.begin()
        with Session(connection, join_transaction_mode="create_savepoint", expire_on_commit=False) as made:
            yield made
        outer.rollback()


# --- folders


@contextmanager
def short_folder(*, in_memory: bool = False) -> Iterator[Path]:
    """A folder that nobody else may enter, with a path as short as that of a socket has to be.

    in_memory: if there is room, for what waits for the disk again and again.

    A PostgreSQL that still runs in it is ended by its number. The folder is locked as pytest locks its own: see
    `tests.keeper.CLUSTER`.
    """
    made = Path(mkdtemp(prefix="inband-test-", dir=keeper.in_memory() if in_memory else None))
    (made / ".lock").write_text(str(os.getpid()))
    try:
        yield made
    finally:
        for file in made.rglob("postmaster.pid"):
            if (pid := EmbeddedServer(file.parent.parent).pid) is not None:
                os.kill(pid, signal.SIGKILL)
        shutil.rmtree(made)


# --- the server

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


# --- the browser


@pytest.fixture(scope="session")
def playwright() -> Iterator[Playwright]:
    with sync_playwright() as running:
        yield running


@pytest.fixture(scope="session")
def browser(playwright: Playwright) -> Iterator[Browser]:
    """Chromium: Debian's where there is one, best without the windows that nobody sees, else Playwright's own."""
    found = next(
        filter(
            _works,
            filter(
                None, map(shutil.which, ["chromium-headless-shell", "chromium", "chromium-browser", "google-chrome"])
            ),
        ),
        None,
    )
    running = playwright.chromium.launch(executable_path=found, args=BROWSER_OPTIONS, timeout=180_000)
    yield running
    running.close()


def _works(program: str) -> bool:
    """Some systems have a stand-in that only says how to get the real thing."""
    return subprocess.run([program, "--version"], capture_output=True).returncode == 0


@pytest.fixture
def complaints() -> list[str]:
    """Faults of the page that no page may have. A test that provokes an error on purpose looks at it and clears it."""
    return []


@pytest.fixture
def screen() -> dict[str, Any]:
    """What a page is seen on, as the browser's context names it; a class of tests may have another one."""
    return {"viewport": {"width": 1280, "height": 800}}


@contextmanager
def new_page(browser: Browser, url: str, complaints: list[str], **screen: Any) -> Iterator[Page]:
    """A page of the server at `url`, in a context of its own; console errors and requests to any other host are complaints."""
    host = urlsplit(url).netloc

    def look(request: Request) -> None:
        parts = urlsplit(request.url)
        if parts.scheme not in {"data", "blob", "about"} and parts.netloc != host:
            complaints.append(f"request to a foreign host: {request.url}")

    context = browser.new_context(base_url=url, locale="en-GB", **screen)
    context.on("request", look)
    opened = context.new_page()
    opened.set_default_timeout(60_000)
    opened.on("pageerror", lambda error: complaints.append(f"uncaught in {opened.url}: {error}"))
    opened.on(
        "console",
        lambda message: (
            complaints.append(f"console in {opened.url}: {message.text}") if message.type == "error" else None
        ),
    )
    yield opened
    context.close()


@pytest.fixture
def page(browser: Browser, server: Server, complaints: list[str], screen: dict[str, Any]) -> Iterator[Page]:
    """A page of the server; what it complains about fails the test."""
    with new_page(browser, server.url, complaints, **screen) as opened:
        yield opened
    assert not complaints, "\n".join(complaints)
