"""Several plants in one installation: each with tables, people, keys and events of its own."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import httpx
import psycopg
import pytest
from playwright.sync_api import Page, expect
from sqlalchemy.orm import Session

from app.access import actions as people
from app.access.keys import add_key
from app.cli import plants as commands
from app.db import migrate
from app.db.connections import in_schema
from app.db.engine import Database
from app.errors import Conflict, Invalid, NotFound
from app.plants import registry
from tests.databases import NewDatabase, drop_database
from tests.forked import inband
from tests.pages.looks import violations
from tests.servers import TLS, RunServer, Server
from tests.shop import PARAMETERS
from tests.waits import until

PASSWORD = "correct horse battery"
get = partial(httpx.get, timeout=60, verify=TLS)


def is_ready(server: Server, key: str) -> bool:
    return bool(get(f"{server.url}/p/{key}/health/ready").status_code == httpx.codes.OK)


@pytest.fixture(scope="module")
def server(new_database: NewDatabase, run_server: RunServer) -> Iterator[Server]:
    """A server with a plant at its root, which was there before, and two more: `north` in Kolkata's time, `south`."""
    url = new_database()
    add(url, "north", timezone="Asia/Kolkata")
    add(url, "south", timezone="Europe/Belgrade")
    with run_server(url) as running:
        for key in ("north", "south"):
            with in_plant(running, key) as session:
                people.add_person(session, name="Mira", role="engineer", password=PASSWORD, actor="tests")
            until(partial(is_ready, running, key))
        yield running


def add(url: str, key: str, **options: Any) -> None:
    usual = {"name": key.capitalize(), "schema": None, "host": None, "timezone": None, "shifts": None}
    commands.add_plant(key, **usual | options, data_dir=None, database_url=url)


@contextmanager
def in_plant(server: Server, key: str | None) -> Iterator[Session]:
    """A transaction in the schema of a plant; None: in the server's own."""
    database = Database(in_schema(server.database.dsn, key or "public"), pool_size=1)
    try:
        with database.begin() as session:
            yield session
    finally:
        database.close()


def client_of(server: Server, key: str | None) -> httpx.Client:
    """A client of a plant's API, with a key of that plant; None: the plant at the root."""
    with in_plant(server, key) as session:
        secret = add_key(session, role="admin", machine=None, name="tests", actor="tests").secret
    below = f"/p/{key}" if key else ""
    client = server.client(secret)
    client.base_url = httpx.URL(f"{server.url}{below}")
    return client


def set_up(client: httpx.Client, characteristic: str = "shaft", machine: str = "lathe-1") -> None:
    for path, body in (
        ("machines", {"key": machine, "name": "Lathe", "control": "sinumerik"}),
        ("characteristics", {"key": characteristic, "name": "Seat", "machine": machine, "parameters": PARAMETERS}),
    ):
        answer = client.post(f"/api/v1/{path}", json=body)
        assert answer.status_code in {201, 409}, answer.text


def read(client: httpx.Client, micrometres: float, characteristic: str = "shaft") -> dict[str, Any]:
    answer = client.post(
        "/api/v1/readings", json={"characteristic": characteristic, "measured": round(40 + micrometres / 1000, 6)}
    )
    assert answer.status_code == 201, answer.text
    body: dict[str, Any] = answer.json()
    return body


class TestOnePlantKnowsNothingOfAnother:
    def test_the_same_keys_mean_other_things(self, server: Server) -> None:
        root, north, south = (client_of(server, key) for key in (None, "north", "south"))
        for client in (root, north, south):
            set_up(client, "seat")
        assert [read(north, 2, "seat")["sequence"] for _ in range(3)] == [1, 2, 3]
        assert [read(south, 4, "seat")["sequence"] for _ in range(2)] == [1, 2]
        assert read(root, 7, "seat")["sequence"] == 1
        counts = [
            len(client.get("/api/v1/readings", params={"characteristic": "seat"}).json()["items"])
            for client in (root, north, south)
        ]
        assert counts == [1, 3, 2]

    @pytest.mark.long
    def test_nor_does_a_key_of_one_open_the_other(self, server: Server) -> None:
        north = client_of(server, "north")
        assert north.get("/api/v1/machines").status_code == 200
        secret = north.headers["authorization"]
        refused = get(f"{server.url}/p/south/api/v1/machines", headers={"Authorization": secret})
        assert refused.status_code == 401

    def test_events_stay_in_their_plant(self, server: Server) -> None:
        north, south = client_of(server, "north"), client_of(server, "south")
        set_up(north, "bore-north", "mill-1")
        set_up(south, "bore-south", "mill-1")
        with south.stream("GET", "/api/v1/events") as events:
            lines = events.iter_lines()
            assert any(line == "event: hello" for line in lines)
            read(north, 3, "bore-north")
            read(south, 5, "bore-south")
            heard = []
            for line in lines:
                heard.append(line)
                if "bore-south" in line:
                    break
        assert "bore-north" not in "".join(heard)

    def test_times_are_those_of_the_plant(self, server: Server) -> None:
        pages = [get(f"{server.url}/p/{key}/sign-in").text for key in ("north", "south")]
        assert "Asia/Kolkata" in pages[0]
        assert "Europe/Belgrade" in pages[1]


class TestAddresses:
    @pytest.mark.long
    def test_a_page_leads_to_pages_of_its_plant(self, server: Server, page: Page, complaints: list[str]) -> None:
        north = client_of(server, "north")
        set_up(north)
        read(north, 6)
        page.goto("/p/north/")
        expect(page).to_have_url(f"{server.url}/p/north/sign-in")
        page.fill("[name=name]", "Mira")
        page.fill("[name=password]", PASSWORD)
        page.click("button[type=submit]:has-text('Sign in')")
        expect(page).to_have_url(f"{server.url}/p/north/")
        page.click("nav >> text=Machines")
        expect(page).to_have_url(f"{server.url}/p/north/machines")
        page.goto("/p/north/characteristics/shaft")
        expect(page.locator("plotly-chart .plot-container").first).to_be_visible()
        page.locator("live-status", has_text="live").wait_for()
        page.fill("input[name=q]", "shaft")
        page.locator("[role=option] a").first.click()
        expect(page).to_have_url(f"{server.url}/p/north/characteristics/shaft")
        assert complaints == []

    def test_no_address_of_a_page_leaves_the_plant(self, server: Server) -> None:
        north = client_of(server, "north")
        set_up(north)
        for path in ("/", "/machines", "/characteristics/shaft", "/todo", "/overview", "/setup", "/api/docs"):
            text = north.get(path).text
            for name in ("href", "src", "action"):
                out = [part.split('"')[0] for part in text.split(f' {name}="/')[1:]]
                assert [each for each in out if not each.startswith(("p/north/", "plants", "static/"))] == [], path

    def test_what_is_created_is_found_where_the_answer_says(self, server: Server) -> None:
        north = client_of(server, "north")
        answer = north.post("/api/v1/machines", json={"key": "lathe-loc", "name": "L", "control": "sinumerik"})
        assert answer.headers["location"] == "/p/north/api/v1/machines/lathe-loc"
        assert get(f"{server.url}{answer.headers['location']}", headers=north.headers).status_code == 200

    @pytest.mark.long
    def test_a_plant_may_have_a_host_name_and_keeps_its_schema_when_it_is_removed(self, server: Server) -> None:
        add(server.database.dsn, "hosted", host="hosted.example")
        at_host = {"Host": "hosted.example:8443"}
        until(lambda: "hosted" in get(f"{server.url}/plants").text)
        until(lambda: get(f"{server.url}/health/ready", headers=at_host).status_code == 200)
        with in_plant(server, "hosted") as session:
            secret = add_key(session, role="admin", machine=None, name="tests", actor="tests").secret
        headers = at_host | {"Authorization": f"Bearer {secret}"}
        assert get(f"{server.url}/api/v1/machines", headers=headers).json()["items"] == []
        assert get(f"{server.url}/sign-in", headers=at_host).status_code == 200
        assert get(f"{server.url}/p/hosted/sign-in").status_code == 404
        self._try_a_simulated_machine(server, headers)

        commands.remove_plant("hosted", data_dir=None, database_url=server.database.dsn)
        until(lambda: "hosted" not in get(f"{server.url}/plants").text)
        assert migrate.current(in_schema(server.database.dsn, "hosted")) == migrate.head()

    @staticmethod
    def _try_a_simulated_machine(server: Server, headers: dict[str, str]) -> None:
        """It measures in the plant of this host name, whose address it calls from the same computer."""
        assert httpx.post(f"{server.url}/simulated", headers=headers, verify=TLS, timeout=60).status_code == 303
        until(lambda: get(f"{server.url}/api/v1/readings?limit=1", headers=headers).json()["items"])
        assert httpx.post(f"{server.url}/simulated/remove", headers=headers, verify=TLS, timeout=60).status_code == 303


class TestOverview:
    def test_one_sign_in_for_all_plants_that_know_one(self, server: Server, page: Page) -> None:
        north = client_of(server, "north")
        set_up(north)
        read(north, 60)  # oversize: an alarm
        page.goto("/plants")
        expect(page.locator("tbody tr").first).to_contain_text("not signed in")
        page.fill("[name=name]", "Mira")
        page.fill("[name=password]", PASSWORD)
        page.click("button:has-text('Sign in')")
        row = page.locator("tr", has_text="North")
        expect(row.locator("td").nth(1)).to_contain_text("1")
        page.wait_for_load_state()
        assert violations(page) == {}
        expect(page.locator("tr", has_text="South")).not_to_contain_text("not signed in")
        row.get_by_role("link").click()
        expect(page).to_have_url(f"{server.url}/p/north/")
        page.locator(".who", has_text="Mira").wait_for()
        expect(page.locator("header .brand").last).to_have_text("North")

    def test_a_wrong_password_is_refused_and_recorded(self, server: Server) -> None:
        answer = server.client().post("/plants/sign-in", data={"name": "Mira", "password": "guessed"})
        assert answer.status_code == 401
        assert "Wrong name or password" in answer.text
        assert "set-cookie" not in answer.headers
        with in_plant(server, "north") as session:
            failed = session.connection().exec_driver_sql(
                "SELECT count(*) FROM audit_entry WHERE action = 'sign-in failed'"
            )
            assert failed.scalar()

    def test_a_plant_of_another_version_takes_no_other_along(self, server: Server) -> None:
        with psycopg.connect(server.database.dsn, autocommit=True) as connection:
            connection.execute("CREATE SCHEMA odd")
            registry.add(connection, registry.Plant("odd", "Odd", "odd"))
            try:
                until(lambda: "The plant Odd cannot be served" in get(f"{server.url}/plants").text)
                assert get(f"{server.url}/p/odd/").headers["location"] == "/plants"
                refused = get(f"{server.url}/p/odd/api/v1/machines")
                assert (refused.status_code, refused.headers["retry-after"]) == (503, "2")
                assert get(f"{server.url}/p/north/sign-in").status_code == 200
            finally:
                registry.remove(connection, "odd")


def test_without_a_plant_at_the_root_everything_leads_to_the_overview(
    run_server: RunServer, postgres: str, new_database: NewDatabase
) -> None:
    url = new_database()
    with psycopg.connect(url, autocommit=True) as connection:
        connection.execute("DROP SCHEMA public CASCADE; CREATE SCHEMA public")
    commands.add_plant(
        "only", name="Only", schema=None, host=None, timezone=None, shifts=None, data_dir=None, database_url=url
    )
    with run_server(url) as server:
        assert get(f"{server.url}/machines").headers["location"] == "/plants"
        refused = get(f"{server.url}/api/v1/machines")
        assert (refused.status_code, "/p/PLANT/api/v1/machines" in refused.text) == (404, True)
        assert get(f"{server.url}/p/only").headers["location"] == "/p/only/"
        refused = get(f"{server.url}/p/nope/api/v1/machines")
        assert (refused.status_code, "There is no plant 'nope'" in refused.json()["detail"]) == (404, True)
        assert migrate.current(url) is None
    drop_database(url)


def test_one_server_for_one_schema(
    run_server: RunServer, new_database: NewDatabase, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("INBAND_SCHEMA", "plant_east")
    url = new_database()
    with run_server(url) as server:
        with in_plant(server, "plant_east") as session:
            secret = add_key(session, role="admin", machine=None, name="tests", actor="tests").secret
        client = server.client(secret)
        set_up(client)
        assert read(client, 5)["sequence"] == 1
    with psycopg.connect(url) as connection:
        counts = connection.execute(
            "SELECT (SELECT count(*) FROM public.reading), (SELECT count(*) FROM plant_east.reading)"
        )
        assert counts.fetchone() == (0, 1)
    drop_database(url)


def test_migrate_and_check_look_at_every_plant(new_database: NewDatabase) -> None:
    """Also where there is none at the root; what is wrong with one does not keep them from the others."""
    url = new_database()
    with psycopg.connect(url, autocommit=True) as connection:
        connection.execute("DROP SCHEMA public CASCADE; CREATE SCHEMA public")
        for key in ("east", "north", "west"):
            commands.add_plant(
                key, name=None, schema=None, host=None, timezone=None, shifts=None, data_dir=None, database_url=url
            )
        migrate.downgrade(in_schema(url, "west"), "0112")
        connection.execute("UPDATE east.alembic_version SET version_num = '9999'")
    pending, checked = migrate.pending(in_schema(url, "west")), inband("check", "--database-url", url)
    assert checked.returncode == 1
    assert "wrong plant east: the database is at revision 9999, which this Inband does not know" in checked.stderr
    assert f"ok    plant north: migrations: at {migrate.head()}, none to run" in checked.stderr
    assert f"wrong plant west: {len(pending)} migration(s) to run: {', '.join(pending)}." in checked.stderr
    migrated = inband("migrate", "--database-url", url)
    assert migrated.returncode == 1
    assert "plant east: the database is at revision 9999, which this Inband does not know" in migrated.stderr
    assert f"plant north: nothing to do: the database is at {migrate.head()}" in migrated.stderr
    assert all(f"plant west: migrated: {each}" in migrated.stderr for each in pending)
    assert [migrate.current(in_schema(url, schema)) for schema in ("west", "public")] == [migrate.head(), None]
    drop_database(url)


class TestList:
    @pytest.fixture
    def connection(self, database: Database) -> Iterator[psycopg.Connection[Any]]:
        with psycopg.connect(database.dsn) as made:
            yield made

    def test_there_is_none_before_the_first(self, connection: psycopg.Connection[Any]) -> None:
        assert registry.plants(connection) == []
        with pytest.raises(NotFound, match="no plant north"):
            registry.plant_named(connection, "north")

    def test_key_schema_and_host_belong_to_one(self, connection: psycopg.Connection[Any]) -> None:
        registry.add(connection, registry.Plant("a", "A", "a", "a.example"))
        connection.commit()
        for other, said in (
            (registry.Plant("a", "A", "b"), "key a"),
            (registry.Plant("b", "B", "a"), "schema a"),
            (registry.Plant("b", "B", "b", "a.example"), "host name a.example"),
        ):
            with pytest.raises(Conflict, match=said):
                registry.add(connection, other)
            connection.rollback()
        assert [plant.key for plant in registry.plants(connection)] == ["a"]

    @pytest.mark.parametrize(
        "plant",
        [
            registry.Plant("Novi Sad", "N", "n"),
            registry.Plant("../x", "N", "n"),
            registry.Plant("n", "N", "n", "https://n.example"),
            registry.Plant("n", " ", "n"),
        ],
    )
    def test_what_no_address_can_hold_is_refused(self, plant: registry.Plant) -> None:
        with pytest.raises(Invalid):
            registry.check(plant)

    @pytest.mark.parametrize("schema", ["inband", "information_schema", "pg_own", "2nd"])
    def test_schemas_of_others_are_refused(self, database: Database, schema: str) -> None:
        with pytest.raises(ValueError, match="cannot be the schema of a plant"):
            commands.add_plant(
                "x", None, schema, None, timezone=None, shifts=None, data_dir=None, database_url=database.dsn
            )

    def test_a_refused_plant_leaves_nothing(self, database: Database) -> None:
        with pytest.raises(ValueError, match="no time zone"):
            commands.add_plant(
                "x",
                name=None,
                schema=None,
                host=None,
                timezone="Mars/Base",
                shifts=None,
                data_dir=None,
                database_url=database.dsn,
            )
        with psycopg.connect(database.dsn) as connection:
            assert registry.plants(connection) == []
            assert migrate.current(in_schema(database.dsn, "x")) is None


def test_a_backup_of_one_plant_comes_back_alone(
    database: Database, new_database: NewDatabase, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from app.cli.backup import backup, restore

    migrate.upgrade(in_schema(database.dsn, "west"))
    west = Database(in_schema(database.dsn, "west"), pool_size=1)
    with west.begin() as session:
        people.add_person(session, name="Ana", role="admin", password=PASSWORD, actor="tests")
    west.close()
    monkeypatch.setenv("INBAND_SCHEMA", "west")
    backup(tmp_path / "west.backup", data_dir=None, database_url=database.dsn)
    other = new_database()
    restore(tmp_path / "west.backup", data_dir=None, database_url=other)
    with psycopg.connect(other) as connection:
        assert connection.execute("SELECT name FROM west.person").fetchall() == [("Ana",)]
        assert connection.execute("SELECT count(*) FROM public.person").fetchone() == (0,)
    drop_database(other)
