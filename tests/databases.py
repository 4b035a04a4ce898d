"""Fixtures of the database: a real PostgreSQL with the schema by migrations.

One embedded server serves the whole run, xdist's workers too: each enters it as any process of Inband would, and the last
one out stops it. A test that commits has a database of its own (``database``), made from a migrated template in some
hundredths of a second; a test that only looks at what a transaction does takes ``session``, which is rolled back.
"""

import fcntl
import itertools
import os
import shutil
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import mkdtemp
from urllib.parse import urlsplit

import psycopg
import pytest
from sqlalchemy.orm import Session

from app.db import migrate
from app.db.embedded import EmbeddedServer, make_data_dir
from app.db.engine import Database
from tests import keeper
from tests.db.first_program import make_first_program
from tests.server_logs import follow

TEMPLATE = "template_inband"
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
