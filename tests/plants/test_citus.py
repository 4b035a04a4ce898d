"""A plant on a node of Citus: readings, summaries, live events, a migration, a move.

Run where `INBAND_TEST_CITUS` names the folder of PostgreSQL's programs with the extension citus built for them.
"""

import os
import threading
from collections.abc import Iterator
from typing import Any

import httpx
import psycopg
import pytest

from app.access.keys import add_key
from app.cli import plants as commands
from app.db import citus, migrate
from app.db.connections import in_schema
from app.db.embedded import EmbeddedServer
from app.db.engine import Database
from app.errors import Invalid, NotFound
from tests.conftest import RunServer, Server
from tests.shop import PARAMETERS

PROGRAMS = os.environ.get("INBAND_TEST_CITUS", "")
needs_citus = pytest.mark.skipif(not PROGRAMS, reason="INBAND_TEST_CITUS names no PostgreSQL with Citus")
OPTIONS = {
    "fsync": "off",
    "shared_preload_libraries": "citus",
    "wal_level": "logical",
    "max_prepared_transactions": "200",
    "citus.node_conninfo": "sslmode=disable",
}


@pytest.fixture(scope="module")
def coordinator(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Address of the coordinator of three nodes, of which it is one."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("INBAND_POSTGRES_BIN", PROGRAMS)
        nodes = [EmbeddedServer(tmp_path_factory.mktemp(name), dict(OPTIONS)) for name in ("c", "one", "two")]
        for node in nodes:  # they are reached by their sockets, by themselves too
            node.options["citus.local_hostname"] = str(psycopg.conninfo.conninfo_to_dict(node.url)["host"])
        try:
            urls = [node.start() for node in nodes]
            for url in urls:
                with psycopg.connect(url, autocommit=True) as connection:
                    connection.execute("CREATE EXTENSION citus")
            places = [psycopg.conninfo.conninfo_to_dict(url) for url in urls]
            with psycopg.connect(urls[0], autocommit=True) as connection:
                connection.execute(
                    "SELECT citus_set_coordinator_host(%s, %s)", (places[0]["host"], int(str(places[0]["port"])))
                )
                for place in places[1:]:
                    connection.execute("SELECT citus_add_node(%s, %s)", (place["host"], int(str(place["port"]))))
            yield urls[0]
        finally:
            for node in nodes:
                node.stop()


@pytest.fixture(scope="module")
def server(run_server: RunServer, coordinator: str) -> Iterator[Server]:
    """A server with the plant `far`, which lies on the second node."""
    usual: dict[str, Any] = {"name": None, "schema": None, "host": None, "timezone": None, "shifts": None}
    commands.add_plant("far", **usual, data_dir=None, database_url=coordinator)
    with psycopg.connect(coordinator) as connection:
        node = citus.nodes(connection)[1]
    commands.move_plant("far", str(node), data_dir=None, database_url=coordinator)
    with run_server(coordinator) as running:
        yield running


@pytest.fixture(scope="module")
def client(server: Server, coordinator: str) -> httpx.Client:
    database = Database(in_schema(coordinator, "far"), pool_size=1)
    with database.begin() as session:
        secret = add_key(session, role="admin", machine=None, name="tests", actor="tests").secret
    database.close()
    made = server.client(secret)
    made.base_url = httpx.URL(f"{server.url}/p/far")
    for path, body in (
        ("machines", {"key": "lathe-1", "name": "Lathe", "control": "sinumerik"}),
        ("characteristics", {"key": "shaft", "name": "Seat", "machine": "lathe-1", "parameters": PARAMETERS}),
    ):
        assert made.post(f"/api/v1/{path}", json=body).status_code == 201
    return made


def push(client: httpx.Client, micrometres: float) -> int:
    body = {"characteristic": "shaft", "measured": round(40 + micrometres / 1000, 6)}
    answer = client.post("/api/v1/readings", json=body)
    assert answer.status_code == 201, answer.text
    return int(answer.json()["sequence"])


@needs_citus
class TestPlantOnANode:
    def test_readings_are_decided_and_summarised_there(self, client: httpx.Client, coordinator: str) -> None:
        assert [push(client, number % 7) for number in range(140)] == list(range(1, 141))
        batch = [{"characteristic": "shaft", "measured": 40.002, "key": f"k{number}"} for number in range(100)]
        assert client.post("/api/v1/readings/batch", json=batch).status_code in {200, 201}
        with psycopg.connect(coordinator) as connection:
            assert connection.execute("SELECT count(*), max(sequence) FROM far.reading").fetchone() == (240, 240)
            assert connection.execute("SELECT count(*) FROM far.reading_summary WHERE level = 5").fetchone() == (7,)
            assert citus.node_of(connection, "far") == citus.nodes(connection)[1]

    @pytest.mark.parametrize(
        "path",
        [
            "/", "/characteristics/shaft", "/machines", "/todo", "/overview", "/setup/machines", "/search?q=shaft", "/reports",
            "/api/v1/characteristics/shaft/capability", "/api/v1/readings", "/api/v1/alarms", "/metrics",
        ],
    )  # fmt: skip
    def test_pages_are_read_from_it(self, client: httpx.Client, path: str) -> None:
        assert client.get(path).status_code == 200

    def test_a_heartbeat_hears_of_the_node_that_holds_the_plant(self, client: httpx.Client, coordinator: str) -> None:
        push(client, 1)
        beat = {"version": "1", "state": "online", "waiting": 0}
        told = [client.post("/api/v1/machines/lathe-1/heartbeat", json=beat).json()["server"] for _ in range(2)]
        with psycopg.connect(coordinator) as connection:
            (newest,) = connection.execute("SELECT max(id) FROM far.event").fetchone() or (0,)
            (own,) = connection.execute("SELECT (pg_control_system()).system_identifier::text").fetchone() or ("",)
        assert told[0]["last_event"] >= newest
        assert told[0]["system"] == told[1]["system"] != own

    def test_live_events_are_told_at_once(self, client: httpx.Client) -> None:
        threading.Timer(1, push, (client, 3)).start()
        with client.stream("GET", "/api/v1/events") as events:
            for line in events.iter_lines():
                if line.startswith("data:") and "shaft" in line:
                    break

    def test_it_is_migrated_where_it_lies_and_moves_with_what_it_has(
        self, client: httpx.Client, coordinator: str
    ) -> None:
        url = in_schema(coordinator, "far")
        migrate.downgrade(url, "0103")
        assert len(migrate.upgrade(url)) >= 1
        before = push(client, 2)
        with psycopg.connect(coordinator) as connection:
            other = citus.nodes(connection)[2]
        commands.move_plant("far", str(other), data_dir=None, database_url=coordinator)
        assert push(client, 2) == before + 1
        with psycopg.connect(coordinator) as connection:
            assert citus.node_of(connection, "far") == other
            assert "this plant lies on the coordinator" in citus.in_words(connection)
        with psycopg.connect(url) as connection:
            assert f"this plant lies on {other}" in citus.in_words(connection)
        with pytest.raises(NotFound, match="no node"):
            commands.move_plant("far", "nowhere:5432", data_dir=None, database_url=coordinator)


def test_without_citus_a_plant_does_not_move(database: Database) -> None:
    commands.add_plant(
        "near", name=None, schema=None, host=None, timezone=None, shifts=None, data_dir=None, database_url=database.dsn
    )
    with pytest.raises(Invalid, match="no Citus"):
        commands.move_plant("near", "127.0.0.1:5432", data_dir=None, database_url=database.dsn)
    with psycopg.connect(database.dsn) as connection:
        assert citus.in_words(connection) == ""
