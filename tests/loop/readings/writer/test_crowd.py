"""Many at once: 64 clients on one characteristic, two servers on one database, neighbours in one commit."""

import asyncio
import random
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import psycopg
import pytest

from app.core.parameters import Parameters, read
from app.loop.readings.writer.connection import GIVE_WAY
from tests.loop.readings.load import Sender, all_at_once, scattered
from tests.loop.readings.record import history, must_be_stored, must_hold, must_replay
from tests.loops import run
from tests.servers import TLS, RunServer, Server
from tests.shop import PARAMETERS, Shop

pytestmark = pytest.mark.own_server  # every machine's lock is held, and its threads are watched


@pytest.fixture(scope="module", autouse=True)
def _patient() -> Iterator[None]:
    """Machines are held here until many requests have gathered."""
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("INBAND_DATABASE_PATIENCE", "30")
        yield


@pytest.fixture
def parameters() -> Parameters:
    return read(PARAMETERS)[0]


@pytest.mark.parametrize("each", [4, pytest.param(12, marks=pytest.mark.long)])
def test_sixty_four_clients_on_one_characteristic_are_decided_one_after_the_other(
    shop: Shop, parameters: Parameters, each: int
) -> None:
    key, url = shop.server.key(machine=shop.machine), shop.server.url
    senders = all_at_once([Sender(url, key, scattered(shop.characteristic, each, seed)) for seed in range(64)])
    answers = [answer for sender in senders for answer in sender.answers]
    stored = history(shop.server.database.dsn, shop.characteristic)
    assert [reading["sequence"] for reading in stored] == list(range(1, 64 * each + 1))
    assert sorted(answer["sequence"] for answer in answers) == list(range(1, 64 * each + 1))
    assert not any(sender.again for sender in senders)
    for sender in senders:  # nobody's readings overtake each other
        assert [answer["sequence"] for answer in sender.answers] == sorted(a["sequence"] for a in sender.answers)
    corrections = must_replay(parameters, stored)
    assert corrections > 2
    assert {reading["zone"] for reading in stored} >= {"zero", "average", "full"}
    assert shop.average() == stored[-1]["average_after"]
    must_be_stored(shop.server.database.dsn, answers)
    must_hold(shop.server.database.dsn)


def test_readings_are_let_in_while_every_other_request_is_busy(shop: Shop) -> None:
    """More of them than the server has connections and threads; keys, a new characteristic, what was sent before are looked up."""
    other = f"{shop.characteristic}-n"
    shop.add(other)
    machine = shop.server.client(shop.server.key(machine=shop.machine))
    slow = [shop.server.client(shop.server.key()) for _ in range(48)]
    path = f"/api/v1/characteristics/{shop.characteristic}/baselines"
    with psycopg.connect(shop.server.database.dsn) as holding, ThreadPoolExecutor(len(slow)) as pool:
        holding.execute("LOCK TABLE baseline IN ACCESS EXCLUSIVE MODE")
        with gathering(shop.server, len(slow)):
            waiting = [pool.submit(client.get, path) for client in slow]
        assert not any(each.done() for each in waiting)
        for characteristic, status in ((shop.characteristic, 201), (other, 201), (other, 200)):
            reading = {"characteristic": characteristic, "measured": 40.001, "key": characteristic}
            answer = machine.post("/api/v1/readings", json=reading)
            assert answer.status_code == status, answer.text
        assert not any(each.done() for each in waiting)
        holding.rollback()
        assert {each.result().status_code for each in waiting} == {200}


def test_a_hundred_machines_that_ask_and_tell_at_once_do_not_hold_each_other_up(shop: Shop) -> None:
    """Each second request publishes, under a lock; the others hold a connection while their answer is written."""
    url, headers = shop.server.url, dict(shop.machine_client.headers)

    async def ask(client: httpx.AsyncClient, number: int) -> int:
        path = f"/api/v1/machines/{shop.machine}"
        if number % 2:
            return (await client.get(f"{path}/corrections")).status_code
        beat = {"version": "1", "state": "online" if number % 4 else "held", "waiting": 0}
        return (await client.post(f"{path}/heartbeat", json=beat)).status_code

    async def all_at_once() -> set[int]:
        limits = httpx.Limits(max_connections=200)
        async with httpx.AsyncClient(base_url=url, headers=headers, timeout=60, limits=limits, verify=TLS) as client:
            return set(await asyncio.gather(*(ask(client, number) for number in range(200))))

    assert run(all_at_once()) == {200}


@pytest.mark.parametrize("each", [10, pytest.param(25, marks=pytest.mark.long)])
def test_two_servers_on_one_database_decide_like_one(
    server: Server, run_server: RunServer, parameters: Parameters, each: int
) -> None:
    one, said = server, len(server.stderr.read_text())
    with run_server(one.database.dsn) as other:
        shop = Shop(one)
        shared = f"{shop.characteristic}-s"  # on the same tool and the same average
        shop.add(shared)
        alone = f"{shop.characteristic}-a"
        shop.add(alone, tool_memory=4, average_memory=6)
        key = one.key(machine=shop.machine)
        senders = [
            Sender(server.url, key, _confirming(shop, characteristic, each, 10 * seed + at))
            for seed in range(3)
            for at, server in enumerate((one, other))
            for characteristic in (shop.characteristic, shared, alone)
        ]
        all_at_once(senders)
        dsn = one.database.dsn
        must_be_stored(dsn, [answer for sender in senders for answer in sender.answers])
        must_hold(dsn)
        stored = history(dsn, alone)
        assert [reading["sequence"] for reading in stored] == list(range(1, 6 * each + 1))
        assert must_replay(parameters, stored) > 2
        assert any(reading["outstanding"] for reading in stored)
        # Of the two that share a tool, each correction is counted by all that came after it.
        mixed = sorted(
            history(dsn, shop.characteristic) + history(dsn, shared), key=lambda reading: reading["received_at"]
        )
        assert len({reading["correction"] for reading in mixed if reading["correction"]}) > 2
        # Each waited for the other's lock; neither ran into what the other had written.
        assert "could not be stored" not in one.stderr.read_text()[said:] + other.stderr.read_text()


def _confirming(shop: Shop, characteristic: str, count: int, seed: int) -> Iterator[dict[str, Any]]:
    """Readings of which some tell which correction was in effect, whatever the machine has by then."""
    chance = random.Random(seed)
    client = httpx.Client(base_url=shop.server.url, headers=dict(shop.admin.headers), timeout=60, verify=TLS)
    for reading in scattered(characteristic, count, seed):
        if chance.random() < 0.4:
            listed = client.get(f"/api/v1/machines/{shop.machine}/corrections?limit=1000").json()["items"]
            reading["correction_in_effect"] = chance.choice([0, *(correction["number"] for correction in listed)])
        yield reading
    client.close()


@pytest.mark.long
def test_workers_of_one_server_decide_like_one(run_server: RunServer, parameters: Parameters) -> None:
    with run_server(workers=2) as server:
        shop = Shop(server)
        key = server.key(machine=shop.machine)
        senders = all_at_once([Sender(server.url, key, scattered(shop.characteristic, 25, seed)) for seed in range(12)])
        stored = history(server.database.dsn, shop.characteristic)
        assert [reading["sequence"] for reading in stored] == list(range(1, 301))
        must_replay(parameters, stored)
        must_be_stored(server.database.dsn, [answer for sender in senders for answer in sender.answers])
        must_hold(server.database.dsn)
        assert "could not be stored" not in server.stderr.read_text()


def test_what_cannot_be_taken_fails_alone_in_its_commit(shop: Shop) -> None:
    name, dsn = shop.characteristic, shop.server.database.dsn
    shop.read(1.0, key="taken")
    good = [{"characteristic": name, "measured": 40.0, "key": f"good {number}"} for number in range(20)]
    bad: list[tuple[dict[str, Any], int]] = [
        ({"characteristic": name, "measured": 40.0005, "key": "taken"}, 409),
        ({"characteristic": name, "measured": 40.0, "correction_in_effect": 99, "key": "bad"}, 422),
        ({"characteristic": name, "touches": [[40.0, 40.0]], "key": "bad"}, 422),
    ]
    repeated = [({"characteristic": name, "measured": 40.001, "key": "taken"}, 200)]
    wanted: list[tuple[dict[str, Any], int]] = [(reading, 201) for reading in good] + bad + repeated
    random.Random(1).shuffle(wanted)
    with locked(dsn), ThreadPoolExecutor(len(wanted) + 1) as pool:
        first = pool.submit(shop.read, 0.0)  # takes the writer, so that the others gather behind it
        until_locked_out(dsn)
        with gathering(shop.server, len(wanted)):
            answers = [pool.submit(_status, shop, reading) for reading, _status_ in wanted]
        release.set()
        assert first.result()["sequence"] == 2
        assert [answer.result() for answer in answers] == [status for _reading, status in wanted]
    stored = history(dsn, name)
    assert len(stored) == 22
    assert len({reading["received_at"] for reading in stored[2:]}) == 1, "they were not in one commit"
    must_hold(dsn)


def test_one_key_sent_by_many_at_once_is_new_once(shop: Shop) -> None:
    reading = {"characteristic": shop.characteristic, "measured": 40.006, "key": "one"}
    with locked(shop.server.database.dsn), ThreadPoolExecutor(9) as pool:
        first = pool.submit(shop.read, 0.0)  # takes the writer, so that the others gather behind it
        until_locked_out(shop.server.database.dsn)
        with gathering(shop.server, 7):  # one of the eight may go over the open connection
            sent = [pool.submit(shop.machine_client.post, "/api/v1/readings", json=reading) for _client in range(8)]
        release.set()
        assert first.result()["sequence"] == 1
        answers = [each.result() for each in sent]
    assert sorted(answer.status_code for answer in answers) == [200] * 7 + [201]
    assert all(answer.json() == answers[0].json() for answer in answers)
    assert len(history(shop.server.database.dsn, shop.characteristic)) == 2


def test_what_the_database_refuses_fails_alone_in_its_commit(shop: Shop) -> None:
    """Nothing that passes our own checks should be refused there; if it is, it is not its neighbours' fault."""
    name, dsn = shop.characteristic, shop.server.database.dsn
    wanted: list[tuple[dict[str, Any], int]] = [
        ({"characteristic": name, "measured": 40.0, "key": str(number)}, 201) for number in range(10)
    ]
    wanted.insert(5, ({"characteristic": name, "measured": 40.0, "part": "unforeseen", "key": "u"}, 500))
    with psycopg.connect(dsn, autocommit=True) as connection:
        connection.execute("ALTER TABLE reading ADD CONSTRAINT unforeseen CHECK (part <> 'unforeseen')")
        try:
            with locked(dsn), ThreadPoolExecutor(12) as pool:
                first = pool.submit(shop.read, 0.0)
                until_locked_out(dsn)
                with gathering(shop.server, len(wanted)):
                    answers = [pool.submit(_status, shop, reading) for reading, _status_ in wanted]
                release.set()
                assert first.result()["sequence"] == 1
                assert [answer.result() for answer in answers] == [status for _reading, status in wanted]
        finally:
            connection.execute("ALTER TABLE reading DROP CONSTRAINT unforeseen")
    assert [reading["sequence"] for reading in history(dsn, name)] == list(range(1, 12))
    must_hold(dsn)


release = threading.Event()


class locked:  # noqa: N801 - reads as a verb
    """Hold every machine's lock until `release` is set."""

    def __init__(self, dsn: str) -> None:
        self.dsn = dsn
        self.held = threading.Event()
        self.thread = threading.Thread(target=self._hold)

    def _hold(self) -> None:
        with psycopg.connect(self.dsn) as connection:
            connection.execute("SELECT 1 FROM machine_state FOR UPDATE")
            self.held.set()
            release.wait(180)

    def __enter__(self) -> None:
        release.clear()
        self.thread.start()
        assert self.held.wait(60)

    def __exit__(self, *_: object) -> None:
        release.set()
        self.thread.join()


def until_locked_out(dsn: str) -> None:
    """Wait until somebody waits for a lock in this database, and longer than readings of several machines would together."""
    waiting = f"""SELECT count(*) FROM pg_stat_activity WHERE wait_event_type = 'Lock' AND datname = current_database()
        AND query_start < clock_timestamp() - {2 * GIVE_WAY} * interval '1 second'"""  # noqa: S608 - a number of ours
    deadline = time.monotonic() + 60
    with psycopg.connect(dsn, autocommit=True) as connection:
        while not connection.execute(waiting).fetchone()[0]:  # type: ignore[index] # count(*) has a row
            assert time.monotonic() < deadline, "nobody waits for the lock"
            time.sleep(0.02)


@contextmanager
def gathering(server: Server, requests: int) -> Iterator[None]:
    """After what is sent within, wait until the server has read so many requests of new connections and sleeps."""
    before = {peer for peer, _unread in _connections(server)}
    yield
    deadline, awake = time.monotonic() + 60, _threads(server)
    while awake:
        time.sleep(0.05)
        new = [unread for peer, unread in _connections(server) if peer not in before]
        assert time.monotonic() < deadline, f"the requests did not gather: unread {new}, at work {sorted(awake)}"
        if len(new) < requests or any(new):
            awake = _threads(server)
        else:  # each has been seen asleep since then: on a busy computer one or another always waits for the processor
            awake = {thread for thread in awake & _threads(server) if _state(thread) == "R"}


def _connections(server: Server) -> list[tuple[str, int]]:
    """Peer and unread bytes of each connection to the server."""
    rows = [line.split() for line in Path("/proc/net/tcp").read_text().splitlines()[1:]]
    here = f":{urlsplit(server.url).port:04X}"
    return [(row[2], int(row[4].partition(":")[2], 16)) for row in rows if row[1].endswith(here) and row[3] == "01"]


def _threads(server: Server) -> set[Path]:
    return set(Path(f"/proc/{server.process.pid}/task").glob("*/stat"))


def _state(thread: Path) -> str:
    try:
        return thread.read_text().rpartition(")")[2].split()[0]
    except OSError:  # it has ended
        return "X"


def _status(shop: Shop, reading: dict[str, Any]) -> int:
    return httpx.post(
        f"{shop.server.url}/api/v1/readings", json=reading, headers=dict(shop.admin.headers), timeout=60, verify=TLS
    ).status_code
