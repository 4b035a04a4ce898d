"""A database that says nothing any more: stopped, or behind a network that swallows packets. Nobody waits for ever."""

import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import httpx
import psycopg
import pytest
from psycopg.errors import OperationalError

from app.db import migrate
from app.db.binaries import binary
from app.db.connections import Connections
from app.db.embedded import EmbeddedServer
from app.db.engine import Database
from tests.db.clusters import commits_wait_for
from tests.db.network import Way
from tests.loop.readings.record import history, must_hold, rows
from tests.loop.readings.writer.test_broken import at_work, crew, nothing_lost_or_doubled, push, until, until_taken
from tests.servers import RunServer, Server
from tests.shop import Person, Shop

PATIENCE = "2"  # s


@pytest.fixture(scope="module", autouse=True)
def _impatient() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("INBAND_DATABASE_PATIENCE", PATIENCE)
        yield


@pytest.fixture(scope="module")
def ours(tmp_path_factory: pytest.TempPathFactory) -> Iterator[EmbeddedServer]:
    """A database server that may be stopped."""
    server = EmbeddedServer(tmp_path_factory.mktemp("silent") / "inband", {"fsync": "off"})
    migrate.upgrade(server.start())
    yield server
    server.stop()


def socket_of(server: EmbeddedServer) -> Path:
    return Path(server.url.partition("host=")[2].partition("&")[0]) / ".s.PGSQL.5432"


@pytest.fixture(scope="module")
def way(ours: EmbeddedServer) -> Iterator[Way]:
    with Way(socket_of(ours)) as made:
        yield made


@pytest.fixture(scope="module")
def inband(way: Way, run_server: RunServer) -> Iterator[Server]:
    with run_server(f"postgresql://inband@127.0.0.1:{way.port}/inband") as running:
        yield running


def processes(server: EmbeddedServer) -> list[int]:
    """All of a PostgreSQL, the one first that starts the others."""
    assert server.pid is not None
    children = Path(f"/proc/{server.pid}/task/{server.pid}/children").read_text().split()
    return [server.pid, *map(int, children)]


@contextmanager
def stopped(ours: EmbeddedServer, _way: Way) -> Iterator[None]:
    """SIGSTOP: the kernel goes on taking what is sent."""
    assert ours.pid is not None
    os.kill(ours.pid, signal.SIGSTOP)  # the first of all: it begins no other from here on
    sent = processes(ours)
    for process in sent:
        os.kill(process, signal.SIGSTOP)
    try:
        yield
    finally:
        for process in reversed(sent):  # that one last: until then one that has ended still has its number
            os.kill(process, signal.SIGCONT)


@contextmanager
def swallowed(_ours: EmbeddedServer, way: Way) -> Iterator[None]:
    way.swallow()
    try:
        yield
    finally:
        way.forward()


Silence = Callable[[EmbeddedServer, Way], Any]


@pytest.mark.parametrize("silence", [swallowed, pytest.param(stopped, marks=pytest.mark.long)])
def test_everybody_is_answered_503_and_served_again_afterwards(
    inband: Server, ours: EmbeddedServer, way: Way, silence: Silence
) -> None:
    shop, person = Shop(inband), Person(inband, "viewer")
    assert until_taken(shop).status_code in {200, 201}
    stranger = inband.client("inband_nobody-knows-this")
    asked: list[Callable[[], httpx.Response]] = [
        lambda: push(shop, key="one by one"),
        lambda: push(shop, key="batch", batch=True),
        lambda: stranger.post("/api/v1/readings", json={"characteristic": shop.characteristic, "measured": 40.0}),
        lambda: stranger.get("/api/v1/alarms"),
        lambda: shop.admin.get("/api/v1/alarms"),
        lambda: person.browser.get("/"),
        lambda: shop.admin.post("/api/v1/machines", json={"key": "late", "name": "Late", "control": "other"}),
        lambda: inband.client().get("/health/ready"),
        lambda: inband.client().get("/metrics"),
    ]
    with silence(ours, way), ThreadPoolExecutor(100) as pool:
        # More than there are threads and connections: none of them may keep the others waiting.
        answers = [pool.submit(ask) for _again in range(10) for ask in asked]
        for answer in answers:
            problem = answer.result()
            assert problem.status_code == 503, problem.text
            assert int(problem.headers["retry-after"]) > 0
        assert inband.client().get("/health/live").status_code == 200
    until(lambda: inband.client().get("/health/ready").status_code == 200)
    for key, batch in (("one by one", False), ("batch", True), ("k", False)):
        assert until_taken(shop, key=key, batch=batch).status_code in {200, 201}
    assert person.browser.get("/").status_code == 200
    stored = [reading["key"] for reading in history(ours.url, shop.characteristic)]
    assert sorted(stored) == ["batch", "k", "one by one"]
    must_hold(ours.url)


@pytest.mark.parametrize("silence", [stopped, pytest.param(swallowed, marks=pytest.mark.long)])
def test_live_events_end_so_that_no_page_calls_itself_live(
    inband: Server, ours: EmbeddedServer, way: Way, silence: Silence
) -> None:
    shop = Shop(inband)
    with shop.admin.stream("GET", "/api/v1/events") as stream, silence(ours, way):
        assert b"hello" in b"".join(stream.iter_bytes())  # to its end
    until(lambda: inband.client().get("/health/ready").status_code == 200)

    def heard() -> bool:
        with shop.admin.stream("GET", "/api/v1/events") as stream:
            until_taken(shop, key=None)
            return any(b"event: reading" in part for part in stream.iter_bytes())

    until(heard)  # a stream that ends at once is opened again, as browsers do


@pytest.mark.parametrize("silence", [swallowed, pytest.param(stopped, marks=pytest.mark.long)])
def test_the_server_ends_in_order_while_the_database_says_nothing(
    inband: Server, ours: EmbeddedServer, way: Way, silence: Silence
) -> None:
    shop = Shop(inband)
    with ThreadPoolExecutor(3) as pool, silence(ours, way):
        for ask in (lambda: push(shop), lambda: push(shop, batch=True), lambda: shop.admin.get("/api/v1/alarms")):
            pool.submit(ask)
        assert inband.stop() == 0
    inband.restart()
    assert until_taken(shop).status_code in {200, 201}


def test_a_host_that_is_gone_before_the_first_look_keeps_nobody_waiting(ours: EmbeddedServer) -> None:
    with Way(socket_of(ours)) as first, Way(socket_of(ours)) as second:
        connections = Connections(f"postgresql://inband@127.0.0.1:{first.port},127.0.0.1:{second.port}/inband", 2)
        with connections.connect() as connection:
            assert connection.info.port == first.port
            first.swallow()
            with connections, pytest.raises(OperationalError, match="was replaced by another"):
                connection.execute("SELECT 1")


def test_a_commit_that_waits_for_its_standby_is_not_waited_for_and_not_cancelled(
    inband: Server, ours: EmbeddedServer
) -> None:
    shop = Shop(inband)
    waiting = "SELECT 1 FROM pg_stat_activity WHERE wait_event = 'SyncRep' AND application_name = 'inband'"
    with psycopg.connect(ours.url, autocommit=True) as connection:
        try:
            commits_wait_for(ours.url, "nobody")
            made = shop.admin.post("/api/v1/machines", json={"key": "waits", "name": "Waits", "control": "other"})
            assert (made.status_code, made.json()["type"]) == (503, "urn:inband:problem:outcome-unknown")
            problem = push(shop)
            assert problem.status_code == 503, problem.text
            assert connection.execute(waiting).fetchall(), "it was cancelled, which PostgreSQL tells as success"
            assert shop.admin.get("/api/v1/alarms").status_code == 200
        finally:
            connection.execute("ALTER SYSTEM RESET synchronous_standby_names")
            connection.execute("SELECT pg_reload_conf()")
    assert until_taken(shop).json()["sequence"] == 1
    assert len(history(ours.url, shop.characteristic)) == 1
    must_hold(ours.url)


@pytest.mark.long
class TestStandby:
    """Two servers, each behind a way of its own: one that is written to, and its synchronous standby."""

    @pytest.fixture
    def standby(self, ours: EmbeddedServer, tmp_path: Path) -> Iterator[EmbeddedServer]:
        server = EmbeddedServer(tmp_path / "standby", {"fsync": "off"})
        server.data_dir.mkdir(mode=0o711)
        copy = subprocess.run(
            [
                *ours._as(ours._owner()), str(binary("pg_basebackup")), "--write-recovery-conf",
                "--checkpoint=fast", "--pgdata=-", "--format=tar", "--wal-method=fetch",
                f"--dbname={ours.url}&application_name=standby",
            ],
            capture_output=True, check=False,
        )  # fmt: skip
        assert copy.returncode == 0, copy.stderr.decode()
        server.cluster.mkdir(mode=0o700)
        subprocess.run(["tar", "-x", "-C", str(server.cluster)], input=copy.stdout, check=True)
        server.start()
        yield server
        server.stop()

    def test_promoted_is_used_and_has_every_reading_that_was_answered(
        self, ours: EmbeddedServer, standby: EmbeddedServer, run_server: RunServer
    ) -> None:
        with ExitStack() as stack:
            first, second = (stack.enter_context(Way(socket_of(server))) for server in (ours, standby))
            with psycopg.connect(ours.url, autocommit=True) as connection:
                until(lambda: rows(ours.url, "SELECT 1 FROM pg_stat_replication WHERE state = 'streaming'"))
                connection.execute("ALTER SYSTEM SET synchronous_standby_names = '*'")
                connection.execute("SELECT pg_reload_conf()")
                until(lambda: rows(ours.url, "SELECT 1 FROM pg_stat_replication WHERE sync_state = 'sync'"))
            url = f"postgresql://inband@127.0.0.1:{first.port},127.0.0.1:{second.port}/inband"
            server = stack.enter_context(run_server(url))
            shop = Shop(server)
            senders = crew(shop, server)

            def disturb() -> None:
                first.swallow()  # the host is gone, and nobody is told
                with psycopg.connect(standby.url, autocommit=True) as connection:
                    connection.execute("SELECT pg_promote()")

            try:
                at_work(senders, disturb)
            finally:
                with psycopg.connect(ours.url, autocommit=True) as connection:
                    connection.execute("ALTER SYSTEM RESET synchronous_standby_names")
                    connection.execute("SELECT pg_reload_conf()")
            shop.server.database.close()
            shop.server.database = Database(standby.url, pool_size=1)
            nothing_lost_or_doubled(shop, senders)
            shop.server.database.close()
            assert rows(standby.url, "SELECT pg_is_in_recovery()") == [(False,)]
