"""The server where modules and calls fail as on Windows: `tests.as_on_windows`. Nobody has run it on Windows itself."""

import subprocess
import sys
from pathlib import Path

import pytest

from app.db.engine import Database
from tests.databases import NewDatabase, drop_database
from tests.servers import Process, Server, free_port, wait_ready
from tests.shop import Shop
from tests.test_installed import run


def test_it_says_that_no_postgresql_comes_with_it(tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "tests.as_on_windows",
        "app.db,app.files",
        "serve",
        "--data-dir",
        tmp_path / "data",
    ]
    done = run(command, Path.cwd(), PYTHONPATH=":".join(sys.path), NUMBA_DISABLE_JIT="1")
    assert done.returncode == 1
    assert done.stderr.startswith("On Windows no PostgreSQL comes with Inband."), done.stderr


@pytest.mark.long
def test_every_module_is_imported_and_a_reading_is_decided(new_database: NewDatabase, tmp_path: Path) -> None:
    url, port, log = new_database(), free_port(), tmp_path / "log"
    words = ["serve", "--database-url", url, "--port", str(port), "--data-dir", str(tmp_path / "data")]

    def start() -> Process:
        with log.open("ab") as stderr:
            command = [sys.executable, "-m", "tests.as_on_windows", "app", *words]
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=stderr, stderr=stderr)
        wait_ready(f"http://127.0.0.1:{port}", process, log)
        return process

    database = Database(url, pool_size=1)
    server = Server(f"http://127.0.0.1:{port}", database, start(), start, log)
    try:
        shop = Shop(server)
        assert shop.read(6.0)["action"] == "correct"
        table = {"name": "a.csv", "content": "measured\n40.001\n", "characteristic": shop.characteristic}
        answer = shop.admin.post("/api/v1/readings/table", json=table)
        assert answer.is_success, answer.text  # read in a process of its own
    finally:
        server.close()
        database.close()
        drop_database(url)
