"""Several plants with a standby: each reads its own tables there, and sees its own changes."""

import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import httpx
import pytest

from app.access import actions as people
from tests.databases import short_folder
from tests.db.clusters import Cluster, cluster
from tests.plants.test_plants import PASSWORD, add, client_of, get, in_plant, is_ready, read, set_up
from tests.servers import RunServer, Server
from tests.shop import PARAMETERS
from tests.waits import until
from tests.web.test_replica import BEHIND, paused

KEYS = ("north", "south")


@pytest.fixture(scope="module")
def servers(whole_cluster: Path) -> Iterator[Cluster]:
    """One that is written to, and its standby."""
    with short_folder(in_memory=True) as folder, cluster(folder, whole_cluster, ("one", "two")) as made:
        yield made


@pytest.fixture(scope="module")
def server(servers: Cluster, run_server: RunServer) -> Iterator[Server]:
    """Two plants, beside the one at the root."""
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("INBAND_READ_DATABASE_URL", servers.nodes[1].url)
        for key in KEYS:
            add(servers.nodes[0].url, key)
        with run_server(servers.nodes[0].url) as running:
            for key in KEYS:
                with in_plant(running, key) as session:
                    people.add_person(session, name="Mira", role="engineer", password=PASSWORD, actor="tests")
                until(partial(is_ready, running, key))
            yield running


def count(client: httpx.Client) -> tuple[int, bool]:
    """Readings of the shaft, and if the standby told."""
    answer = client.get("/api/v1/readings", params={"characteristic": "shaft"})
    assert answer.status_code == 200, answer.text
    return len(answer.json()["items"]), BEHIND in answer.headers


def test_each_reads_its_own_tables_there(server: Server) -> None:
    clients = [client_of(server, key) for key in (*KEYS, None)]
    for sent, client in enumerate(clients, 1):
        set_up(client)
        for _reading in range(sent):
            read(client, 2)
    until(lambda: [count(client) for client in clients] == [(1, True), (2, True), (3, True)])
    for key in KEYS:
        ready = get(f"{server.url}/p/{key}/health/ready").json()
        assert "s behind" in ready["replica"]


@pytest.mark.long
def test_a_person_sees_their_own_change_in_the_plant_where_they_made_it(server: Server, servers: Cluster) -> None:
    set_up(client_of(server, "north"))
    browser = server.client()
    answer = browser.post("/p/north/sign-in", data={"name": "Mira", "password": PASSWORD})
    assert answer.status_code == 303, answer.text
    address = "/p/north/api/v1/search?q=fresh"
    until(lambda: BEHIND in browser.get(address).headers)
    token = found(r'<meta name="csrf" content="([^"]+)"', browser.get("/p/north/alarms").text)
    with paused(servers):
        body = {"key": "fresh", "name": "Fresh", "machine": "lathe-1", "parameters": PARAMETERS}
        made = browser.post("/p/north/api/v1/characteristics", json=body, headers={"X-CSRF-Token": token})
        assert made.status_code == 201, made.text
        assert {name for name in made.cookies if "written" in name} == {"inband_written.north"}
        answer = browser.get(address)
        assert BEHIND not in answer.headers
        assert "fresh" in answer.text
    until(lambda: BEHIND in browser.get(address).headers)


def found(pattern: str, text: str) -> str:
    match = re.search(pattern, text)
    assert match is not None, text
    return match[1]
