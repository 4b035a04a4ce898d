"""Charts, statistics, reports and searches read a standby, as long as it has what they must show."""

import re
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import psycopg
import pytest
from fastapi.routing import APIRoute

from app.main import ROUTERS
from app.web.deps import FROM_REPLICA
from tests.databases import short_folder
from tests.db.clusters import Cluster, cluster
from tests.forked import inband
from tests.loop.readings.record import rows
from tests.servers import RunServer, Server
from tests.shop import PARAMETERS, Person, Shop
from tests.waits import until

MOST_BEHIND = 6.0  # s
BEHIND = "X-Inband-Behind"


@pytest.fixture(scope="module")
def servers(whole_cluster: Path) -> Iterator[Cluster]:
    """One that is written to, and its standby."""
    with short_folder(in_memory=True) as folder, cluster(folder, whole_cluster, ("one", "two")) as made:
        yield made


@pytest.fixture(scope="module")
def server(servers: Cluster, run_server: RunServer) -> Iterator[Server]:
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("INBAND_READ_DATABASE_URL", servers.nodes[1].url)
        environment.setenv("INBAND_READ_MOST_BEHIND", str(MOST_BEHIND))
        with run_server(servers.nodes[0].url) as running:
            yield running


@pytest.fixture
def followed(server: Server) -> Shop:
    """A machine and a characteristic of which the standby has all."""
    made = Shop(server)
    for deviation in (1.0, 6.0, 2.0, -3.0):
        made.read(deviation, part=f"P-{made.characteristic}")
    until(lambda: BEHIND in ask(made).headers)
    return made


def ask(shop: Shop, client: httpx.Client | None = None, **headers: str) -> httpx.Response:
    """Statistics of the characteristic."""
    path = f"/api/v1/characteristics/{shop.characteristic}/statistics"
    answer = (client or shop.admin).get(path, headers=headers)
    assert answer.status_code in {200, 404}, answer.text
    return answer


@contextmanager
def paused(servers: Cluster) -> Iterator[None]:
    """The standby receives, and shows nothing of it."""
    rows(servers.nodes[1].url, "SELECT pg_wal_replay_pause()")
    until(lambda: rows(servers.nodes[1].url, "SELECT pg_get_wal_replay_pause_state()") == [("paused",)])
    try:
        yield
    finally:
        rows(servers.nodes[1].url, "SELECT pg_wal_replay_resume()")


def addresses(shop: Shop) -> Iterator[str]:
    """Each address of heavy reading, with and without numbers of things that there are not."""
    known = {
        "characteristic": shop.characteristic,
        "machine": shop.machine,
        "part": f"P-{shop.characteristic}",
        "form": "pdf",
    }
    for router in ROUTERS:
        for route in router.routes if FROM_REPLICA in router.dependencies else ():
            if isinstance(route, APIRoute) and "GET" in (route.methods or ()):
                yield re.sub(r"\{(\w+)[^}]*\}", lambda name: known.get(name[1], "1"), route.path)


def test_every_heavy_reading_is_done_there(followed: Shop, server: Server) -> None:
    viewer = Person(server, "viewer")
    heavy = list(addresses(followed))
    assert len(heavy) > 20
    for address in heavy:
        query = {"q": "shaft", "characteristic": followed.characteristic, "level": "5", "format": "csv"}
        until(lambda: BEHIND in ask(followed, viewer.browser).headers)  # signing in was a change of theirs
        answer = viewer.browser.get(address, params=query)
        assert answer.status_code < 500, f"{address}: {answer.text}"
        assert BEHIND in answer.headers or answer.status_code in {401, 404, 422}, address


def test_what_is_to_be_acted_on_is_read_where_it_is_written(followed: Shop) -> None:
    for address in (f"/alarms?machine={followed.machine}", f"/machines/{followed.machine}"):
        answer = followed.admin.get(f"/api/v1{address}")
        assert (answer.status_code, BEHIND in answer.headers) == (200, False), address


def test_a_report_that_is_fetched_is_in_the_record_of_changes(followed: Shop, servers: Cluster) -> None:
    answer = followed.admin.get(f"/api/v1/characteristics/{followed.characteristic}/report.csv")
    assert (answer.status_code, BEHIND in answer.headers) == (200, True)
    written = "SELECT 1 FROM audit_entry WHERE action = 'report written' AND subject = %s"
    assert rows(servers.nodes[0].url, written, f"characteristic/{followed.characteristic}")


@pytest.mark.long
def test_a_person_sees_their_own_change_and_others_see_how_old_it_is(
    followed: Shop, server: Server, servers: Cluster
) -> None:
    author, reader = Person(server, "engineer"), Person(server, "viewer")
    until(lambda: all(BEHIND in ask(followed, person.browser).headers for person in (author, reader)))
    found = re.search(r'<meta name="csrf" content="([^"]+)"', author.open("/alarms"))
    assert found is not None
    token = found[1]
    address = f"/api/v1/search?q={followed.characteristic}-new"
    with paused(servers):
        added = {
            "key": f"{followed.characteristic}-new",
            "name": "New",
            "machine": followed.machine,
            "parameters": PARAMETERS,
        }
        made = author.browser.post("/api/v1/characteristics", json=added, headers={"X-CSRF-Token": token})
        assert made.status_code == 201, made.text
        assert BEHIND in reader.browser.get(address).headers
        assert f"{followed.characteristic}-new" not in reader.browser.get(address).text
        answer = author.browser.get(address)
        assert BEHIND not in answer.headers or f"{followed.characteristic}-new" in answer.text
        fresh = reader.browser.get(address, headers={"Cache-Control": "no-cache"})
        assert BEHIND not in fresh.headers
        assert f"{followed.characteristic}-new" in fresh.text
        after = reader.browser.get(address, headers={"X-Inband-Event": str(newest_event(servers))})
        assert f"{followed.characteristic}-new" in after.text, "the page looks again because of an event"
        until(lambda: "of the database that they are read from is behind" in reader.open("/overview"))
    until(lambda: BEHIND in ask(followed, author.browser).headers)
    until(lambda: "of the database that they are read from is behind" not in reader.open("/overview"))


def newest_event(servers: Cluster) -> int:
    return int(rows(servers.nodes[0].url, "SELECT max(id) FROM event")[0][0])


def state(server: Server) -> tuple[Any, bool]:
    """What health says of the replica, and whether the metrics say that it is read."""
    text = server.client().get("/metrics").text
    return server.client().get("/health/ready").json()["replica"], "\ninband_replica_used 1.0" in text


@pytest.mark.long
def test_one_that_lags_too_far_is_not_read(followed: Shop, server: Server, servers: Cluster) -> None:
    assert state(server)[1]
    with paused(servers):
        followed.read(1.0)
        until(lambda: not state(server)[1])
        assert "the server that is written to is read" in state(server)[0]
        assert BEHIND not in ask(followed).headers
        assert "inband_replica_behind_seconds" in server.client().get("/metrics").text
    until(lambda: BEHIND in ask(followed).headers)
    assert state(server) == ("0.0 s behind", True)


def test_one_that_is_away_is_not_missed(followed: Shop, server: Server, servers: Cluster) -> None:
    servers.kill(servers.nodes[1])
    try:
        for _again in range(5):
            assert BEHIND not in ask(followed).headers
        until(lambda: state(server) == ("away; the server that is written to is read", False))
        assert "not the replica" in server.stderr.read_text()
    finally:
        servers.nodes[1].start()
    until(lambda: BEHIND in ask(followed).headers)


@pytest.mark.long
def test_a_query_that_it_ends_is_answered_by_the_other(followed: Shop, servers: Cluster) -> None:
    """As when what it reads is about to be cleaned away (a conflict with recovery)."""
    waiting = "FROM pg_stat_activity WHERE wait_event_type = 'Lock' AND application_name = 'inband'"
    with ThreadPoolExecutor(1) as pool, psycopg.connect(servers.nodes[0].url) as locking:
        locking.execute("LOCK TABLE reading IN ACCESS EXCLUSIVE MODE")
        locked = "SELECT 1 FROM pg_locks WHERE mode = 'AccessExclusiveLock' AND relation = 'reading'::regclass"
        until(lambda: rows(servers.nodes[1].url, locked))
        answer = pool.submit(followed.admin.get, f"/api/v1/readings?characteristic={followed.characteristic}")
        until(lambda: rows(servers.nodes[1].url, f"SELECT 1 {waiting}"))
        rows(servers.nodes[1].url, f"SELECT pg_terminate_backend(pid) {waiting}")
        locking.rollback()
        answered = answer.result()
    assert answered.status_code == 200, answered.text
    assert BEHIND not in answered.headers
    assert len(answered.json()["items"]) == 4


class TestReportsInTheBackground:
    def make(self, shop: Shop) -> Any:
        job = shop.call("POST", "/reports", 201, characteristics=[shop.characteristic], format="csv")
        until(lambda: shop.call("GET", f"/reports/{job['id']}")["state"] not in {"queued", "running"})
        return shop.call("GET", f"/reports/{job['id']}")

    @pytest.mark.long  # the process that makes them gives way to all others: seconds alone, a quarter of a minute beside a run
    def test_lack_nothing_that_was_stored_when_they_were_asked_for(self, followed: Shop, servers: Cluster) -> None:
        with paused(servers):
            followed.add(f"{followed.characteristic}-late")
            followed.read(1.0, f"{followed.characteristic}-late")
            followed.characteristic = f"{followed.characteristic}-late"
            made = self.make(followed)
        assert (made["state"], made["problems"]) == ("done", 0)

    @pytest.mark.long
    def test_are_read_there_and_by_the_other_where_the_standby_ends_the_query(
        self, followed: Shop, servers: Cluster
    ) -> None:
        waiting = "FROM pg_stat_activity WHERE wait_event_type = 'Lock' AND application_name = 'inband'"
        with ThreadPoolExecutor(1) as pool, psycopg.connect(servers.nodes[0].url) as locking:
            locking.execute("LOCK TABLE reading IN ACCESS EXCLUSIVE MODE")
            locked = "SELECT 1 FROM pg_locks WHERE mode = 'AccessExclusiveLock' AND relation = 'reading'::regclass"
            until(lambda: rows(servers.nodes[1].url, locked))
            making = pool.submit(self.make, followed)
            until(lambda: rows(servers.nodes[1].url, f"SELECT 1 {waiting}"))
            rows(servers.nodes[1].url, f"SELECT pg_terminate_backend(pid) {waiting}")
            locking.rollback()
            made = making.result()
        assert (made["state"], made["problems"]) == ("done", 0)


@pytest.mark.usefixtures("followed")
def test_the_check_tells_how_far_it_is_behind(servers: Cluster) -> None:
    def check(replica: str) -> str:
        done = inband("check", "--database-url", servers.nodes[0].url, INBAND_READ_DATABASE_URL=replica)
        return " ".join(done.stderr.split())

    words = r"replica: (it has everything|[\d.]+ MB behind); it is read while it is at most \d+ s behind"
    told = check(servers.nodes[1].url)
    assert re.search(words, told)
    assert "is no standby" in check(servers.nodes[0].url)
