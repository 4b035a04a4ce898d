"""Whatever breaks in the middle: what was answered is stored once, what was not can be sent again with its key."""

import os
import random
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import psycopg
import pytest

from app.core.parameters import read
from app.db.embedded import EmbeddedServer
from tests.databases import copied
from tests.db.clusters import commits_wait_for
from tests.loop.readings.load import Sender, all_at_once, scattered
from tests.loop.readings.record import history, must_be_stored, must_hold, must_replay, rows
from tests.servers import RunServer, Server
from tests.shop import PARAMETERS, Shop

pytestmark = pytest.mark.own_server  # it is stopped, and its database made to fail

WRITERS = "FROM pg_stat_activity WHERE application_name = 'inband-readings' AND datname = current_database()"


def crew(shop: Shop, server: Server) -> list[Sender]:
    """Machines that send until they are told to stop: two characteristics on one tool, and one on a tool of its own."""
    shared, alone = f"{shop.characteristic}-s", f"{shop.characteristic}-a"
    shop.add(shared)
    shop.add(alone, tool_memory=4, average_memory=6)
    key = shop.server.key(machine=shop.machine)
    return [
        Sender(server.url, key, scattered(name, 1_000_000, seed), pause=0.002)
        for seed, name in enumerate([shop.characteristic, shared, alone] * 3)
    ]


def at_work(senders: list[Sender], disturb: Callable[[], None]) -> list[Sender]:
    """Let them send while something is done to the server, and until it serves them again."""
    stop = threading.Event()
    with ThreadPoolExecutor(1) as pool:
        working = pool.submit(all_at_once, senders, stop)
        try:
            disturb()
            until_answered(senders, working)
        finally:
            stop.set()
        return working.result(60)


def until_answered(senders: list[Sender], working: Future[Any] | None = None) -> None:
    """Wait until each of them has got one more answer."""
    before = [len(sender.answers) for sender in senders]
    deadline = time.monotonic() + 60
    while any(len(s.answers) <= count for s, count in zip(senders, before, strict=True)):
        assert time.monotonic() < deadline, "not everybody is served"
        assert working is None or not working.done(), "they have ended"
        time.sleep(0.02)


def nothing_lost_or_doubled(shop: Shop, senders: list[Sender]) -> None:
    """Each reading that was answered is in the record once, and there is no other: whoever was not answered sent again."""
    dsn = shop.server.database.dsn
    must_be_stored(dsn, [answer for sender in senders for answer in sender.answers])
    names = {answer["characteristic"] for sender in senders for answer in sender.answers}
    assert sum(len(history(dsn, name)) for name in names) == sum(len(sender.answers) for sender in senders)
    must_hold(dsn)
    assert must_replay(read(PARAMETERS)[0], history(dsn, f"{shop.characteristic}-a")) > 0


class TestServer:
    @pytest.mark.parametrize("kills", [1, pytest.param(6, marks=pytest.mark.long)])
    def test_killed_under_load_again_and_again(self, shop: Shop, server: Server, kills: int) -> None:
        chance = random.Random(3)
        senders = crew(shop, server)

        def disturb() -> None:
            for _kill in range(kills):
                until_answered(senders)
                time.sleep(chance.uniform(0.0, 0.4))  # at any moment
                server.kill()
                server.restart()

        at_work(senders, disturb)
        nothing_lost_or_doubled(shop, senders)
        assert sum(sender.again for sender in senders) >= kills
        assert sum(sender.repeated for sender in senders) <= sum(sender.again for sender in senders)

    def test_ended_in_order_under_load_it_answers_what_it_has_taken(self, shop: Shop, server: Server) -> None:
        senders = crew(shop, server)

        def disturb() -> None:
            until_answered(senders)
            assert server.stop() == 0
            server.restart()

        at_work(senders, disturb)
        nothing_lost_or_doubled(shop, senders)
        assert sum(sender.repeated for sender in senders) == 0

    def test_a_client_that_is_gone_before_the_answer_is_stored_once(self, shop: Shop) -> None:
        dsn, key = shop.server.database.dsn, shop.server.key(machine=shop.machine)
        reading = {"characteristic": shop.characteristic, "measured": 40.002, "key": "gone"}
        request = httpx.Request(
            "POST", f"{shop.server.url}/api/v1/readings", json=reading, headers={"Authorization": f"Bearer {key}"}
        )
        head = "".join(f"{name}: {value}\r\n" for name, value in request.headers.items())
        with psycopg.connect(dsn) as blocking:
            blocking.execute("SELECT 1 FROM machine_state FOR UPDATE")
            with socket.create_connection((request.url.host, request.url.port or 80)) as connection:
                connection.sendall(f"POST /api/v1/readings HTTP/1.1\r\n{head}\r\n".encode() + request.content)
                until(lambda: rows(dsn, f"SELECT 1 {WRITERS} AND wait_event_type = 'Lock'"))
        until(lambda: history(dsn, shop.characteristic))
        again = shop.machine_client.post("/api/v1/readings", json=reading)
        assert (again.status_code, again.json()["sequence"]) == (200, 1)
        assert len(history(dsn, shop.characteristic)) == 1

    def test_half_a_request_stores_nothing(self, shop: Shop) -> None:
        host, port = shop.server.url.removeprefix("http://").split(":")
        key = shop.server.key(machine=shop.machine)
        with socket.create_connection((host, int(port))) as connection:
            connection.sendall(
                f"POST /api/v1/readings HTTP/1.1\r\nHost: {host}\r\nAuthorization: Bearer {key}\r\n"
                f'Content-Length: 500\r\n\r\n{{"characteristic": "{shop.characteristic}", "measured": 40.0}}'.encode()
            )
        assert shop.read(0.0)["sequence"] == 1


def until(condition: Callable[[], object], seconds: float = 60) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "it did not come to that"
        time.sleep(0.01)


class TestConnection:
    @pytest.mark.parametrize("cuts", [8, pytest.param(40, marks=pytest.mark.long)])
    def test_cut_off_by_the_database_again_and_again(self, shop: Shop, server: Server, cuts: int) -> None:
        chance = random.Random(4)
        senders = crew(shop, server)
        cut = 0

        def answered() -> int:
            return sum(len(sender.answers) for sender in senders)

        def until_more(answers: int) -> None:
            until(lambda: answered() > answers)

        with psycopg.connect(server.database.dsn, autocommit=True) as connection:

            def disturb() -> None:
                nonlocal cut
                while cut < cuts:
                    until_more(answered())  # a busy computer gets nothing done between cuts that follow one another
                    time.sleep(chance.uniform(0.01, 0.1))  # at any moment
                    cut += len(connection.execute(f"SELECT pg_terminate_backend(pid) {WRITERS}").fetchall())

            at_work(senders, disturb)
        nothing_lost_or_doubled(shop, senders)
        assert sum(sender.again for sender in senders) == 0, "the server was there all the time"

    @pytest.mark.parametrize("batch", [False, True])
    def test_cut_off_in_the_middle_of_the_commit_it_is_done_again(
        self, shop: Shop, server: Server, batch: bool
    ) -> None:
        with psycopg.connect(server.database.dsn, autocommit=True) as connection, ThreadPoolExecutor(1) as pool:
            connection.execute(SLOW_COMMIT)
            answer = pool.submit(push, shop, batch=batch)
            cut = f"SELECT pg_terminate_backend(pid) {WRITERS} AND wait_event = 'PgSleep'"
            until(lambda: connection.execute(cut).fetchall())
            connection.execute(QUICK_COMMIT)
            assert answer.result().status_code == 201
        assert [reading["key"] for reading in history(server.database.dsn, shop.characteristic)] == ["k"]
        must_hold(server.database.dsn)

    def test_a_commit_that_fails_is_not_answered_as_one(self, shop: Shop, server: Server) -> None:
        """Readings that are decided from memory are a transaction without BEGIN and COMMIT: it ends by itself."""
        assert push(shop).status_code == 201
        with psycopg.connect(server.database.dsn, autocommit=True) as connection:
            connection.execute(FAILING_COMMIT)
            try:
                problem = push(shop, key="l", measured=40.0065)
            finally:
                connection.execute(WORKING_COMMIT)
        assert problem.status_code == 500, problem.text
        assert "It was not stored" in problem.json()["detail"]
        assert push(shop, key="l", measured=40.0065).json()["sequence"] == 2
        assert [reading["key"] for reading in history(server.database.dsn, shop.characteristic)] == ["k", "l"]
        must_hold(server.database.dsn)


FAILING_COMMIT = """
CREATE FUNCTION fail() RETURNS trigger LANGUAGE plpgsql AS 'BEGIN RAISE ''not today''; END';
CREATE CONSTRAINT TRIGGER fail AFTER INSERT ON reading DEFERRABLE INITIALLY DEFERRED
    FOR EACH ROW EXECUTE FUNCTION fail()
"""
WORKING_COMMIT = "DROP TRIGGER fail ON reading; DROP FUNCTION fail"
SLOW_COMMIT = """
CREATE FUNCTION slow() RETURNS trigger LANGUAGE plpgsql AS 'BEGIN PERFORM pg_sleep(3); RETURN NULL; END';
CREATE CONSTRAINT TRIGGER slow AFTER INSERT ON reading DEFERRABLE INITIALLY DEFERRED
    FOR EACH ROW EXECUTE FUNCTION slow()
"""
QUICK_COMMIT = "DROP TRIGGER slow ON reading; DROP FUNCTION slow"


def push(shop: Shop, *, batch: bool = False, **more: Any) -> httpx.Response:
    """A reading that leads to a correction."""
    reading = {"characteristic": shop.characteristic, "measured": 40.006, "key": "k"} | more
    path = "/api/v1/readings/batch" if batch else "/api/v1/readings"
    return shop.machine_client.post(path, json=[reading] if batch else reading)


def until_taken(shop: Shop, **more: Any) -> httpx.Response:
    """Send it again as long as the answer is 503, as machines do: it takes its time until the database is back for all."""
    answers: list[httpx.Response] = []

    def taken() -> bool:
        answers.append(push(shop, **more))
        return answers[-1].status_code != 503

    until(taken)
    return answers[-1]


def is_ready(server: Server) -> bool:
    return server.client().get("/health/ready").status_code == 200


@pytest.fixture(scope="module")
def away(whole_cluster: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[EmbeddedServer]:
    """A database server of our own, which may be stopped."""
    postgres = EmbeddedServer(copied(whole_cluster, tmp_path_factory.mktemp("away") / "inband"), {"fsync": "off"})
    postgres.start()
    yield postgres
    postgres.stop()


@pytest.fixture(scope="module")
def inband(away: EmbeddedServer, run_server: RunServer) -> Iterator[Server]:
    with run_server(away.url) as running:
        yield running


class TestDatabase:
    @pytest.fixture
    def far(self, inband: Server) -> Shop:
        """Its database is the one that may be stopped."""
        until(lambda: is_ready(inband))
        return Shop(inband)

    def test_away_is_503_and_nothing_is_stored_until_it_is_back(self, far: Shop, away: EmbeddedServer) -> None:
        assert push(far).status_code == 201
        assert away.pid is not None
        os.kill(away.pid, signal.SIGINT)  # the fast end, as by a service manager
        until(lambda: away.pid is None)
        for batch in (False, True):
            problem = push(far, key="l", batch=batch)
            assert problem.status_code == 503, problem.text
            assert problem.headers["content-type"] == "application/problem+json"
            assert int(problem.headers["retry-after"]) > 0
            assert problem.json()["type"] == "urn:inband:problem:database-away"
            assert "Nothing of this request was stored" in problem.json()["detail"]
        # Who comes later is not kept waiting, however many they are: each in its turn would take minutes.
        with ThreadPoolExecutor(20) as pool:
            answers = [pool.submit(push, far, key=f"w{number}") for number in range(20)]
            assert {answer.result(40).status_code for answer in answers} == {503}
        assert far.machine_client.get("/api/v1/alarms").status_code == 503
        assert far.server.client().get("/health/ready").status_code == 503
        assert far.server.client().get("/health/live").status_code == 200
        away.start()
        assert until_taken(far, key="l").json()["sequence"] == 2
        assert until_taken(far).status_code == 200
        must_hold(away.url)

    def test_crashed_in_the_middle_of_the_commit(self, far: Shop, away: EmbeddedServer) -> None:
        with psycopg.connect(away.url, autocommit=True) as connection:
            connection.execute(SLOW_COMMIT)
        assert away.pid is not None
        with ThreadPoolExecutor(1) as pool:
            answer: Future[httpx.Response] = pool.submit(push, far)
            until(lambda: rows(away.url, f"SELECT 1 {WRITERS} AND wait_event = 'PgSleep'"))
            os.kill(away.pid, signal.SIGQUIT)  # ends at once and forgets what was not on disk
            until(lambda: away.pid is None)
            away.start()
            with psycopg.connect(away.url, autocommit=True) as connection:
                # Others take the number that the lost transaction had.
                connection.execute(QUICK_COMMIT)
                connection.execute("SELECT pg_current_xact_id()")
            answer.result()
        assert until_taken(far).json()["sequence"] == 1
        assert [reading["key"] for reading in history(away.url, far.characteristic)] == ["k"]
        must_hold(away.url)

    @pytest.mark.parametrize("batch", [False, pytest.param(True, marks=pytest.mark.long)])
    def test_cut_off_after_the_commit_it_is_not_done_again(self, far: Shop, away: EmbeddedServer, batch: bool) -> None:
        """A commit that waits for a standby has happened here; cut off now, nobody hears of it."""
        with psycopg.connect(away.url, autocommit=True) as connection:
            commits_wait_for(away.url, "nobody")
            with ThreadPoolExecutor(1) as pool:
                answer = pool.submit(push, far, batch=batch)
                until(lambda: rows(away.url, f"SELECT 1 {WRITERS} AND wait_event = 'SyncRep'"))
                connection.execute(f"SELECT pg_terminate_backend(pid) {WRITERS} AND wait_event = 'SyncRep'")
                connection.execute("ALTER SYSTEM RESET synchronous_standby_names")
                connection.execute("SELECT pg_reload_conf()")
                answered = answer.result()
        assert answered.status_code == 201, answered.text
        if not batch:
            assert answered.json()["correction"]["number"] == 1
        assert [reading["key"] for reading in history(away.url, far.characteristic)] == ["k"]
        must_hold(away.url)
