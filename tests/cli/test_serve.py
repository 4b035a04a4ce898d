import os
import platform
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from pathlib import Path

import httpx
import psycopg
import pytest

from app import HOUSE, __version__
from app.db import migrate
from app.db.embedded import EmbeddedServer
from tests import keeper
from tests.databases import NewDatabase, copied, in_database, short_folder
from tests.db.clusters import wait_for
from tests.forked import Forked, inband
from tests.servers import TLS, RunServer, Server, free_port, wait_ready


@pytest.fixture
def data_dir() -> Iterator[Path]:
    with short_folder(in_memory=True) as home:
        yield home / "data"


def test_a_fresh_start_on_the_embedded_database(data_dir: Path, tmp_path: Path) -> None:
    port, stderr = free_port(), tmp_path / "stderr"
    command = [sys.executable, "-m", "app", "serve", "--port", str(port), "--data-dir", str(data_dir)]
    with (
        stderr.open("wb") as log,
        subprocess.Popen(command, cwd=HOUSE, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=log) as process,
        ExitStack() as end,
    ):
        end.callback(process.kill)
        wait_ready(f"http://127.0.0.1:{port}", process, stderr)
        link = re.search(r"http://127\.0\.0\.1:\d+/invitation/\S+", stderr.read_text())
        assert link is not None, "no administrator yet, so there is an invitation"
        assert httpx.get(link.group(), follow_redirects=True, timeout=60, verify=TLS).status_code == 200

        postgres = EmbeddedServer(data_dir).pid
        process.send_signal(signal.SIGTERM)
        out, _ = process.communicate(timeout=60)
        assert (process.returncode, out) == (0, b"")
        assert postgres is not None
        assert EmbeddedServer(data_dir).pid is None
        assert "Traceback" not in stderr.read_text()


def test_commands_work_while_a_server_runs_on_the_embedded_database(
    data_dir: Path, whole_cluster: Path, tmp_path: Path
) -> None:
    """What is meant for programs is alone on standard output."""
    port, stderr, where = free_port(), tmp_path / "stderr", ["--data-dir", str(copied(whole_cluster, data_dir))]
    server = Forked(["serve", "--port", str(port), *where], stderr)
    try:
        wait_ready(f"http://127.0.0.1:{port}", server, stderr)
        added = inband(
            "user", "add", "anna", "--role", "admin", "--password-stdin", *where, typed="horse battery staple\n"
        )
        assert (added.returncode, added.stdout) == (0, "")
        assert "anna may sign in" in added.stderr
        key = inband("key", "add", "--role", "viewer", "--name", "a screen", *where)
        assert (key.returncode, key.stderr) == (0, "")
        headers = {"Authorization": f"Bearer {key.stdout.rstrip()}"}
        machines = httpx.get(f"http://127.0.0.1:{port}/api/v1/machines", headers=headers, timeout=60, verify=TLS)
        assert machines.json()["items"] == []
    finally:
        server.terminate()
        assert server.wait(60) == 0

    checked = inband("check", *where)
    assert checked.returncode == 0, checked.stderr
    assert "embedded in" in checked.stderr


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.long)])
def test_it_ends_in_order(run_server: RunServer, workers: int, number: signal.Signals) -> None:
    with run_server(workers=workers, forked=workers == 1) as server:
        server.process.send_signal(number)
        assert server.process.wait(60) == 0
        assert "Traceback" not in server.stderr.read_text()


@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.long)])
def test_open_live_pages_neither_delay_the_end_nor_leave_a_traceback(run_server: RunServer, workers: int) -> None:
    with run_server(workers=workers) as server, ExitStack() as pages:
        client = server.client(server.key("viewer"))
        for _ in range(3):
            page = pages.enter_context(client.stream("GET", "/api/v1/events"))
            assert next(page.iter_lines()) == "retry: 2000"
        server.process.send_signal(signal.SIGINT)
        assert server.process.wait(60) == 0
        said = server.stderr.read_text()
        assert "Traceback" not in said
        assert "Cancel" not in said


WAITING = """SELECT 1 FROM pg_locks JOIN pg_database ON pg_database.oid = database
    WHERE datname = current_database() AND NOT granted"""


def test_a_request_that_the_end_does_not_wait_for_learns_so(run_server: RunServer) -> None:
    with run_server(workers=1) as server, psycopg.connect(server.database.dsn) as holding:
        client = server.client(server.key("viewer"))
        holding.execute("LOCK TABLE machine")
        with ThreadPoolExecutor(1) as pool:
            asking = pool.submit(client.get, "/api/v1/machines")
            wait_for(lambda: holding.execute(WAITING).fetchone(), "the request waits")
            server.process.send_signal(signal.SIGTERM)
            answer = asking.result(60)
        assert (answer.status_code, answer.headers["Retry-After"]) == (503, "5")
        assert answer.json()["type"] == "urn:inband:problem:server-ending"
        holding.rollback()
        assert server.process.wait(60) == 0


STUBBORN = {
    "a thread": "threading.Thread(target=time.sleep, args=(3600,), name='a long import').start()",
    "a pool of threads": "asyncio.get_running_loop().run_in_executor(None, time.sleep, 3600)",
    "an end that does not come": "Writer.stop = lambda self: asyncio.sleep(3600)",
}
PROGRAM = """
import asyncio, importlib, threading, time
importlib.import_module("app.cli.serve").END_WITHIN = 1.0
from app.cli import main
from app.loop.readings.writer.group_commit import Writer
start = Writer.start
def stubborn(self):
    {what}
    start(self)
Writer.start = stubborn
if __name__ == "__main__":
    main()
"""


@pytest.mark.parametrize(
    ("what", "workers"),
    [
        pytest.param(
            what, workers, marks=[] if (what, workers) == ("an end that does not come", 1) else pytest.mark.long
        )
        for what in STUBBORN
        for workers in (1, 2)
    ],
)
def test_it_ends_whatever_works_on(
    data_dir: Path, whole_cluster: Path, tmp_path: Path, what: str, workers: int
) -> None:
    """And with it the database, in order."""
    program, port, stderr = tmp_path / "stubborn.py", free_port(), tmp_path / "stderr"
    program.write_text(PROGRAM.format(what=STUBBORN[what]))
    command = [sys.executable, str(program), "serve", "--port", str(port)]
    command += ["--data-dir", str(copied(whole_cluster, data_dir)), "--workers", str(workers)]
    with (
        stderr.open("wb") as log,
        subprocess.Popen(command, cwd=HOUSE, env=os.environ | {"PYTHONPATH": str(HOUSE)}, stderr=log) as process,
        ExitStack() as end,
    ):
        end.callback(process.kill)
        wait_ready(f"http://127.0.0.1:{port}", process, stderr)
        process.send_signal(signal.SIGTERM)
        assert process.wait(60) == 0
    assert EmbeddedServer(data_dir).pid is None
    if workers == 1 or "end" in what:  # a worker whose application has ended is ended by its signal
        assert "still at work" in stderr.read_text()


def test_two_workers_serve_and_end_when_their_parent_is_killed(run_server: RunServer) -> None:
    with run_server(workers=2) as server:
        assert server.client(server.key("viewer")).get("/api/v1/machines").status_code == 200
        server.kill()
        where, deadline = ("127.0.0.1", int(server.url.rpartition(":")[2])), time.monotonic() + 60
        with pytest.raises(ConnectionRefusedError):
            while time.monotonic() < deadline:
                with suppress(ConnectionResetError):  # by one that ends in this moment
                    socket.create_connection(where, timeout=5).close()
                time.sleep(0.05)


NOBODY = ["there is no", "--data-dir", "--database-url", "inband serve"]


@pytest.mark.parametrize(
    "command",
    [
        ["key", "add", "--role", "viewer"],
        ["user", "add", "anna", "--role", "admin", "--password-stdin"],
        ["export", "--characteristic", "c"],
        ["import", "{file}", "--characteristic", "c"],
        ["report", "c", "-o", "c.pdf"],
        ["program", "write", "c"],
        ["program", "corrections", "m"],
        ["backup", "nothing.dump"],
        ["check"],
        ["migrate"],
    ],
    ids=lambda words: " ".join(words[:2]),
)
def test_a_folder_without_inband_is_refused_and_stays_as_it_is(
    postgres: str, shared_dir: Path, data_dir: Path, command: list[str]
) -> None:
    """A slip of the pen in --data-dir would otherwise make a database, and a key that no server knows."""
    file = data_dir.with_name("readings.csv")
    file.write_text("measured\n39.998\n")
    typo = inband(
        *(word.format(file=file) for word in command), "--data-dir", str(data_dir), typed="horse battery staple\n"
    )
    assert typo.returncode == 1, typo.stderr
    assert all(words in typo.stderr.lower() for words in NOBODY)
    assert str(data_dir) in typo.stderr
    assert str((keeper.in_memory() or shared_dir) / "inband") in typo.stderr, "there is one, which runs"
    assert not data_dir.exists()
    assert not (HOUSE / "nothing.dump").exists()


def test_a_database_without_inband_is_refused_and_stays_empty(postgres: str) -> None:
    nothing = in_database(postgres, "postgres")
    done = inband("key", "add", "--role", "viewer", "--database-url", nothing)
    assert (done.returncode, done.stdout) == (1, "")
    assert "no Inband in this database" in done.stderr
    with psycopg.connect(nothing) as connection:
        assert connection.execute("SELECT 1 FROM pg_tables WHERE schemaname = 'public'").fetchone() is None


def test_an_older_schema_is_not_brought_up_to_date_by_the_way(first_program: str) -> None:
    """A server of that age may be running on it."""
    done = inband("key", "add", "--role", "viewer", "--database-url", first_program)
    assert (done.returncode, done.stdout) == (1, "")
    assert "inband migrate" in done.stderr
    assert migrate.current(first_program) == migrate.SQUASHED
    done = inband("migrate", "--database-url", first_program)
    assert (done.returncode, migrate.current(first_program)) == (0, migrate.head())


@pytest.mark.long
def test_an_older_program_gets_its_schema_back_when_somebody_says_what_may_be_lost(first_program: str) -> None:
    assert inband("migrate", "--database-url", first_program).returncode == 0
    back = ["migrate", "--back-to", migrate.SQUASHED, "--database-url", first_program]
    asked = inband(*back)
    assert asked.returncode == 1
    assert "0106 Stations, wall screens, bridges and what a machine runs: loses devices, PINs, badges" in asked.stderr
    assert "make a backup" in asked.stderr
    assert migrate.current(first_program) == migrate.head()
    done = inband(*back, "--yes")
    assert (done.returncode, migrate.current(first_program)) == (0, migrate.SQUASHED), done.stderr
    assert "undone: 0101 After the review" in done.stderr


def test_an_early_schema_is_refused_with_the_way_on(new_database: NewDatabase) -> None:
    url = new_database()
    with psycopg.connect(url, autocommit=True) as connection:
        connection.execute("UPDATE alembic_version SET version_num = '0012'")
    for command in (["serve", "--port", str(free_port())], ["key", "add", "--role", "viewer"], ["check"], ["migrate"]):
        done = inband(*command, "--database-url", url)
        assert done.returncode == 1
        assert f"check out commit {migrate.CARRIERS[migrate.SQUASHED]}" in " ".join(done.stderr.split())
    assert migrate.current(url) == "0012"


def test_a_newer_schema_is_left_alone(new_database: NewDatabase) -> None:
    url = new_database()
    with psycopg.connect(url, autocommit=True) as connection:
        connection.execute("UPDATE alembic_version SET version_num = 'tomorrow'")
    for command in (["serve", "--port", str(free_port())], ["key", "add", "--role", "viewer"], ["check"], ["migrate"]):
        done = inband(*command, "--database-url", url)
        assert done.returncode == 1
        assert "a newer one has used it" in done.stderr


def test_the_version_is_reported() -> None:
    """By the program as people start it."""
    done = subprocess.run([sys.executable, "-m", "app", "--version"], cwd=HOUSE, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (
        0,
        f"inband {__version__} (Python {platform.python_version()}, schema {migrate.head()})\n",
    )


def test_help_and_keys_read_no_more_of_the_program_than_they_need(new_database: NewDatabase) -> None:
    """The time that a command takes is the time of reading what it imports."""
    heavy = {"numba", "numpy", "fastapi", "alembic", "uvicorn", "reportlab", "app.main"}
    add = ["key", "add", "--role", "viewer", "--database-url", new_database()]
    for words, more in ((["--help"], {"sqlalchemy", "psycopg", "pydantic"}), (add, {"sqlalchemy"})):
        program = f"import sys; sys.argv = ['inband', *{words!r}]\nfrom app.cli import main\ntry: main()\nexcept SystemExit: pass\n"
        program += "print(sorted(set(sys.modules)), file=sys.stderr)"
        done = subprocess.run([sys.executable, "-c", program], cwd=HOUSE, capture_output=True, text=True)
        assert [name for name in heavy | more if f"'{name}'" in done.stderr] == []


def test_a_taken_port_is_said_before_anything_is_begun(server: Server, data_dir: Path) -> None:
    done = inband("serve", "--port", server.url.rpartition(":")[2], "--data-dir", str(data_dir))
    assert done.returncode == 1
    assert "taken by another program" in done.stderr
    assert not data_dir.exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--host", "0.0.0.0"], "INBAND_PUBLIC_URL"),
        (["--port", "70000"], "--port / INBAND_PORT"),
        (["--workers", "0"], "--workers / INBAND_WORKERS"),
        (["--data-dir", "/"], "--data-dir / INBAND_DATA_DIR"),
        (["--database-url", "sqlite:///inband.db"], "PostgreSQL only"),
        (["--database-url", "postgresql://me:hunter2@db.example"], "names no database"),
        (["--wrong"], "No such option"),
    ],
)
def test_wrong_use_is_refused_with_status_2(arguments: list[str], words: str) -> None:
    done = inband("serve", *arguments)
    assert done.returncode == 2
    assert words in done.stderr
    assert done.stdout == ""
    assert "hunter2" not in done.stderr


def test_words_of_rotary_axes_that_contradict_are_refused_before_anything_is_begun(tmp_path: Path) -> None:
    (tmp_path / "words.toml").write_text('[backlash]\nlabels = ["Startwinkel"]')
    for name, words in (
        ("words.toml", "[backlash] “Startwinkel” is known as [start_angle] already"),
        ("x", "cannot be read"),
    ):
        path = str(tmp_path / name)
        done = inband("serve", "--data-dir", str(tmp_path / "data"), INBAND_ROTARY_WORDS=path)
        assert (done.returncode, done.stdout) == (1, "")
        assert f"INBAND_ROTARY_WORDS: {path}: {words}" in done.stderr
        assert "Traceback" not in done.stderr
        assert not (tmp_path / "data").exists()


def test_every_option_has_its_variable(new_database: NewDatabase) -> None:
    url = new_database()
    done = inband("check", INBAND_DATABASE_URL=url, INBAND_PORT="8123")
    assert done.returncode == 0, done.stderr
    assert "your own server" in done.stderr
    assert "8123" in done.stderr


def test_check_says_what_is_wrong() -> None:
    done = inband("check", "--database-url", f"postgresql://me@127.0.0.1:{free_port()}/inband")
    assert done.returncode == 1
    assert "INBAND_DATABASE_URL" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_key_is_for_a_role_or_a_machine(new_database: NewDatabase) -> None:
    url = new_database()
    assert inband("key", "add", "--database-url", url).returncode == 2
    assert inband("key", "add", "--database-url", url, "--role", "admin", "--machine", "lathe-1").returncode == 2
    missing = inband("key", "add", "--database-url", url, "--machine", "lathe-1")
    assert (missing.returncode, missing.stdout) == (1, "")
    assert "lathe-1" in missing.stderr


def test_a_password_is_never_invented(new_database: NewDatabase) -> None:
    done = inband("user", "add", "anna", "--role", "admin", "--database-url", new_database())
    assert done.returncode == 2
    assert "--password-stdin" in done.stderr
