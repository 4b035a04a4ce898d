"""The server that is written to is killed, and a standby takes its place: what was answered is in the record, once."""

from collections.abc import Iterator
from pathlib import Path

import psycopg
import pytest

from app.core.parameters import read
from bench import failover
from tests.databases import short_folder
from tests.db.clusters import Cluster, cluster
from tests.loop.readings.record import history, must_hold, must_replay, rows
from tests.loop.readings.writer.test_broken import push, until
from tests.servers import RunServer, Server
from tests.shop import PARAMETERS, Shop, unique

PATIENCE = "1"  # s
WAITING = "FROM pg_stat_activity WHERE wait_event = 'SyncRep' AND application_name LIKE 'inband%'"


@pytest.fixture(scope="module", autouse=True)
def _impatient() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("INBAND_DATABASE_PATIENCE", PATIENCE)
        yield


@pytest.fixture(scope="module")
def three(whole_cluster: Path) -> Iterator[Cluster]:
    with short_folder() as folder, cluster(folder, whole_cluster) as made:
        yield made


@pytest.fixture
def servers(three: Cluster) -> Iterator[Cluster]:
    """Three servers that run; who was killed in a test comes back after it."""
    yield three
    three.mend()


@pytest.fixture(scope="module")
def inband(three: Cluster, run_server: RunServer) -> Iterator[Server]:
    with run_server(three.url) as running:
        yield running


@pytest.fixture(scope="module")
def other(three: Cluster, run_server: RunServer) -> Iterator[Server]:
    """A second process on the same database."""
    with run_server(three.url) as running:
        yield running


@pytest.mark.parametrize(
    ("quorum", "rounds"),
    [(True, 1), pytest.param(True, 2, marks=pytest.mark.long), pytest.param(False, 2, marks=pytest.mark.long)],
)
def test_killed_under_load_nothing_that_was_answered_is_lost_or_doubled(
    servers: Cluster, inband: Server, other: Server, quorum: bool, rounds: int
) -> None:
    """Without a quorum, a machine that sees its numbers go back sends again what was answered."""
    servers.ask_for(quorum=quorum)
    result = failover.play(
        servers, [inband.url, other.url], rounds, at_work=0.5, run=unique("m").replace("-", "")
    )  # a machine is known by what stands before the hyphen
    assert len({each.promoted for each in result.rounds}) == rounds
    assert result.answered == result.stored > 0
    assert result.corrections > 0
    assert (result.lost == 0) == quorum


@pytest.mark.long
class TestHole:
    """A commit that was seen on a server which is gone."""

    def test_what_no_standby_has_is_not_said_to_be_stored(self, servers: Cluster, inband: Server) -> None:
        servers.ask_for(quorum=True)
        shop = Shop(inband)
        assert push(shop, key="before").status_code == 201
        first, standbys = servers.primary, servers.standbys
        for standby in standbys:
            servers.kill(standby)
        problem = push(shop, key="hole")
        assert (problem.status_code, problem.json()["type"]) == (503, "urn:inband:problem:outcome-unknown")
        with psycopg.connect(first.url, autocommit=True) as connection:

            def nobody_waits() -> bool:
                connection.execute(f"SELECT pg_terminate_backend(pid) {WAITING}")
                return not connection.execute(f"SELECT 1 {WAITING}").fetchall()

            until(nobody_waits)
        assert [reading["key"] for reading in history(first.url, shop.characteristic)] == ["before", "hole"]
        assert push(shop, key="hole").status_code == 503, "it is on this server alone"
        servers.kill(first)
        for standby in standbys:
            standby.start()
        servers.promote()
        until(lambda: inband.client().get("/health/ready").status_code == 200)
        until(lambda: (answer := push(shop, key="hole")).status_code in {200, 201} and answer.json()["sequence"] == 2)
        new = servers.primary.url
        assert [reading["key"] for reading in history(new, shop.characteristic)] == ["before", "hole"]
        must_hold(new)
        assert must_replay(read(PARAMETERS)[0], history(new, shop.characteristic)) > 0

    def test_what_is_remembered_of_it_decides_nothing(self, servers: Cluster, inband: Server, other: Server) -> None:
        """Another process stores another reading under the same number: the machine is at the version that is remembered."""
        servers.ask_for(quorum=False)
        shop = Shop(inband)
        key = inband.key(machine=shop.machine)
        assert push(shop, key="before", measured=40.002).status_code == 201
        until(lambda: all(history(node.url, shop.characteristic) for node in servers.standbys))
        version = "SELECT version FROM machine_state JOIN machine ON machine.id = machine_id WHERE key = %s"
        servers.fall_behind()
        assert push(shop, key="gone", measured=40.004).json()["sequence"] == 2
        remembered = rows(servers.primary.url, version, shop.machine)
        servers.kill(servers.primary)
        new = servers.promote().url
        reading = {"characteristic": shop.characteristic, "measured": 39.998, "key": "other"}
        elsewhere = other.client(key)
        until(lambda: elsewhere.post("/api/v1/readings", json=reading).status_code in {200, 201})
        assert rows(new, version, shop.machine) == remembered, "it is not the case that is to be looked at"
        until(lambda: push(shop, key="after", measured=40.003).status_code in {200, 201})
        assert [reading["key"] for reading in history(new, shop.characteristic)] == ["before", "other", "after"]
        must_hold(new)
        must_replay(read(PARAMETERS)[0], history(new, shop.characteristic))

    def test_anyone_who_listens_is_let_go_and_loads_again(self, servers: Cluster, inband: Server) -> None:
        """The journal of the new server lacks what was told last: its numbers name other events."""
        servers.ask_for(quorum=False)
        shop = Shop(inband)
        with shop.admin.stream("GET", "/api/v1/events") as stream:
            parts = stream.iter_bytes()
            assert any(b"hello" in part for part in parts)
            servers.fall_behind()
            for number in range(50):
                assert push(shop, key=f"gone {number}").status_code == 201
            servers.kill(servers.primary)
            servers.promote()
            assert list(parts)  # to its end
        until(lambda: push(shop, key="k").status_code in {200, 201})

        def hears() -> bool:
            """As a page that comes back whenever its stream ends."""
            with shop.admin.stream("GET", "/api/v1/events") as again:
                shop.read(0.0)
                return any(b"event: reading" in part for part in again.iter_bytes())

        until(hears, 30)
