"""A plant on a node of Citus: readings, summaries, live events, a migration, a move.

Run where `INBAND_TEST_CITUS` names the folder of PostgreSQL's programs with the extension citus built for them.
"""

import ast
import re
import threading
import time
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing, contextmanager
from typing import Any

import httpx
import psycopg
import pytest

from app import HOUSE
from app.access.keys import add_key
from app.cli import plants as commands
from app.core.parameters import read
from app.db import citus, migrate
from app.db.connections import in_schema
from app.db.embedded import EmbeddedServer
from app.db.engine import Database
from app.errors import Invalid, NotFound
from tests.databases import short_folder
from tests.db.clusters import kill, wait_for
from tests.loop.readings.load import Sender, all_at_once, scattered
from tests.loop.readings.record import history, must_replay
from tests.plants.nodes import PROGRAMS, nodes, place
from tests.servers import TLS, RunServer, Server
from tests.shop import PARAMETERS
from tests.web.test_live import stream

needs_citus = pytest.mark.skipif(not PROGRAMS, reason="INBAND_TEST_CITUS names no PostgreSQL with Citus")


@pytest.fixture(scope="module")
def cluster() -> Iterator[list[EmbeddedServer]]:
    """A coordinator and two workers."""
    with short_folder() as folder:
        folder.chmod(0o711)
        with nodes(folder, options={"fsync": "off"}) as made:
            yield made


@pytest.fixture(scope="module")
def coordinator(cluster: list[EmbeddedServer]) -> str:
    return cluster[0].url


@pytest.fixture(scope="module")
def server(run_server: RunServer, coordinator: str) -> Iterator[Server]:
    """A server with the plant `far`, which lies on the second node, and `near` on the coordinator."""
    usual: dict[str, Any] = {"name": None, "schema": None, "host": None, "timezone": None, "shifts": None}
    for key in ("far", "near"):
        commands.add_plant(key, **usual, data_dir=None, database_url=coordinator)
    with psycopg.connect(coordinator) as connection:
        node = citus.nodes(connection)[1]
    commands.move_plant("far", str(node), data_dir=None, database_url=coordinator)
    with run_server(coordinator) as running:
        yield running


@pytest.fixture(scope="module")
def client(server: Server, coordinator: str) -> Iterator[httpx.Client]:
    with closing(client_of(server, coordinator, "far")) as made:
        yield made


def client_of(server: Server, coordinator: str, plant: str) -> httpx.Client:
    """A client of a plant in which a machine and its characteristic are set up."""
    made = server.client(key_of(coordinator, plant, role="admin"))
    made.base_url = httpx.URL(f"{server.url}/p/{plant}")
    for path, body in (
        ("machines", {"key": "lathe-1", "name": "Lathe", "control": "sinumerik"}),
        ("characteristics", {"key": "shaft", "name": "Seat", "machine": "lathe-1", "parameters": PARAMETERS}),
    ):
        assert made.post(f"/api/v1/{path}", json=body).status_code in {201, 409}
    return made


def machines_at(server: Server, client: httpx.Client) -> int:
    """Status of the same caller's request to the plant `far` at another server."""
    url = f"{server.url}/p/far/api/v1/machines"
    return httpx.get(url, headers=client.headers, timeout=60, verify=TLS).status_code


def key_of(coordinator: str, plant: str, *, role: str | None = None, machine: str | None = None) -> str:
    database = Database(in_schema(coordinator, plant), pool_size=1)
    with database.begin() as session:
        secret = add_key(session, role=role, machine=machine, name="tests", actor="tests").secret
    database.close()
    return secret


@contextmanager
def under_load(server: Server, client: httpx.Client, coordinator: str, run: str) -> Iterator[list[Sender]]:
    """Machines of the plant `far` send readings meanwhile; then everything that was answered is there once, without gaps."""
    senders = []
    for number in range(4):
        machine, name = f"{run}-{number}", f"{run}-{number}-seat"
        assert seat_of(client, machine) == name
        secret = key_of(coordinator, "far", machine=machine)
        readings = scattered(name, 1_000_000, number)
        senders.append(Sender(f"{server.url}/p/far", secret, readings, patience=120, pause=0.01))
    stop = threading.Event()
    with ThreadPoolExecutor(1) as pool:
        working = pool.submit(all_at_once, senders, stop)
        try:
            answered(senders, working)
            yield senders
            answered(senders, working)
        finally:
            stop.set()
        working.result(180)
    url = in_schema(coordinator, "far")
    for sender in senders:
        assert sender.lost == 0
        stored = history(url, sender.answers[0]["characteristic"])
        assert [reading["key"] for reading in stored] == [answer["key"] for answer in sender.answers]
        assert [reading["sequence"] for reading in stored] == list(range(1, len(stored) + 1))
        must_replay(read(PARAMETERS)[0], stored)


def answered(senders: list[Sender], working: Future[Any]) -> None:
    """Until every machine has had two more answers: the first may have been on its way."""
    before = [len(sender.answers) for sender in senders]
    wait_for(
        lambda: working.done() or all(len(s.answers) > count + 1 for s, count in zip(senders, before, strict=True)),
        "every machine is answered",
        120,
    )


def seat_of(client: httpx.Client, machine: str) -> str:
    """Set up a machine and its characteristic, which has no reading yet."""
    body: dict[str, Any] = {"key": machine, "name": "Lathe", "control": "other"}
    assert client.post("/api/v1/machines", json=body).status_code == 201
    body = {"key": f"{machine}-seat", "name": "Seat", "machine": machine, "parameters": PARAMETERS}
    assert client.post("/api/v1/characteristics", json=body).status_code == 201
    return f"{machine}-seat"


def push(client: httpx.Client, micrometres: float, characteristic: str = "shaft") -> int:
    body = {"characteristic": characteristic, "measured": round(40 + micrometres / 1000, 6)}
    answer = client.post("/api/v1/readings", json=body)
    assert answer.status_code == 201, answer.text
    return int(answer.json()["sequence"])


@needs_citus
@pytest.mark.long
class TestPlantOnANode:
    def test_readings_are_decided_and_summarised_there(self, client: httpx.Client, coordinator: str) -> None:
        seat = seat_of(client, "counted")
        assert [push(client, number % 7, seat) for number in range(140)] == list(range(1, 141))
        batch = [{"characteristic": seat, "measured": 40.002, "key": f"k{number}"} for number in range(100)]
        assert client.post("/api/v1/readings/batch", json=batch).status_code in {200, 201}
        with psycopg.connect(in_schema(coordinator, "far")) as connection:
            (of_seat,) = connection.execute("SELECT id FROM characteristic WHERE key = %s", (seat,)).fetchone() or (0,)
            query = "SELECT count(*), max(sequence) FROM reading WHERE characteristic_id = %s"
            assert connection.execute(query, (of_seat,)).fetchone() == (240, 240)
            query = "SELECT count(*) FROM reading_summary WHERE characteristic_id = %s AND level = 5"
            assert connection.execute(query, (of_seat,)).fetchone() == (7,)
        with psycopg.connect(coordinator) as connection:
            assert citus.node_of(connection, "far") in citus.nodes(connection)[1:]

    def test_alarms_are_raised_and_repeated_there(self, client: httpx.Client) -> None:
        seat = seat_of(client, "out")
        for sequence in (1, 2):
            answer = client.post("/api/v1/readings", json={"characteristic": seat, "measured": 41.0})
            assert (answer.status_code, answer.json()["sequence"]) == (201, sequence), answer.text
        (alarm,) = client.get(f"/api/v1/alarms?characteristic={seat}").json()["items"]
        assert (alarm["count"], alarm["last_sequence"]) == (2, 2)
        assert alarm["raised_at"] < alarm["last_at"] == answer.json()["received_at"]

    def test_context_is_kept_there_and_filled_in(self, client: httpx.Client, server: Server) -> None:
        seat = seat_of(client, "work")
        machine = client.get(f"/api/v1/characteristics/{seat}").json()["machine"]
        for sent in ({"order": "A-1"}, {"part_temperature": 21.5}, None):
            assert client.put(f"/api/v1/machines/{machine}/context", json={"order": "A-2"}).status_code == 200
            body = {"characteristic": seat, "measured": 40.001} | ({"context": sent} if sent else {})
            assert client.post("/api/v1/readings", json=body).status_code == 201
        client.put(f"/api/v1/machines/{machine}/context", json={}).raise_for_status()  # the old one is put on first
        found = [client.get(f"/api/v1/readings/{seat}/{sequence}").json()["context"] for sequence in (1, 2, 3)]
        assert [context["order"] for context in found] == ["A-1", "A-2", "A-2"]
        assert found[1]["part_temperature"] == 21.5

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
        with psycopg.connect(coordinator) as connection:  # before: the bridge that comes online is an event as well
            (newest,) = connection.execute("SELECT max(id) FROM far.event").fetchone() or (0,)
            (own,) = connection.execute("SELECT (pg_control_system()).system_identifier::text").fetchone() or ("",)
        beat = {"version": "1", "state": "online", "waiting": 0}
        marks = [client.post("/api/v1/machines/lathe-1/heartbeat", json=beat).json()["server"] for _ in range(2)]
        assert marks[0]["last_event"] >= newest
        assert marks[0]["system"] == marks[1]["system"] != own

    def test_live_events_come_as_they_happen(self, client: httpx.Client) -> None:
        with stream(client) as events:  # its greeting has come: it listens
            pushed = {"characteristic": "shaft", "sequence": push(client, 3)}
            while not pushed.items() <= events.next("reading").data.items():
                pass  # what was done just before comes first

    def test_a_key_that_comes_again_is_answered_as_before(self, client: httpx.Client) -> None:
        def send(number: int) -> tuple[int, int]:
            body = {"characteristic": "shaft", "measured": 40.001, "key": f"again-{number // 8}"}
            answer = client.post("/api/v1/readings", json=body)
            return answer.status_code, answer.json().get("sequence", 0)

        with ThreadPoolExecutor(8) as pool:
            found = list(pool.map(send, range(160)))
        assert {status for status, _ in found} == {200, 201}
        for first in range(0, 160, 8):
            assert len({sequence for _, sequence in found[first : first + 8]}) == 1

    def test_a_held_machine_holds_up_no_other_there(self, client: httpx.Client, coordinator: str) -> None:
        """The node waits for the lock, by a patience that it has to be told of."""
        other, held_seat = seat_of(client, "free"), seat_of(client, "held")

        def send(name: str) -> tuple[int, str, float]:
            begun = time.monotonic()
            answer = client.post("/api/v1/readings", json={"characteristic": name, "measured": 40.0})
            return answer.status_code, answer.json().get("type", ""), time.monotonic() - begun

        assert [send(name)[0] for name in (held_seat, other)] == [201, 201]
        with psycopg.connect(in_schema(coordinator, "far")) as holder, ThreadPoolExecutor(8) as pool:
            (machine,) = holder.execute("SELECT id FROM machine WHERE key = 'held'").fetchone() or (0,)
            holder.execute("SELECT 1 FROM machine_state WHERE machine_id = %s FOR UPDATE", (machine,))
            held = pool.submit(send, held_seat)
            others = [pool.submit(send, other) for _time in range(6)]
            assert [each.result()[0] for each in others] == [201] * 6
            assert not held.done(), "the others have waited for it"
            status, kind, seconds = held.result()
            assert (status, kind) == (503, "urn:inband:problem:busy")
            assert seconds < 6
        assert send(held_seat)[0] == 201

    def test_it_is_migrated_where_it_lies_and_moves_with_what_it_has(
        self, client: httpx.Client, coordinator: str
    ) -> None:
        url = in_schema(coordinator, "far")
        migrate.downgrade(url, "0101")
        assert len(migrate.upgrade(url)) >= 1
        with psycopg.connect(url, autocommit=True) as connection:  # facts in tables that were made there, too
            assert citus.unprotected(connection) == []
            for command in ("DELETE FROM reading", "DELETE FROM note", "DELETE FROM reading_context"):
                with pytest.raises(psycopg.errors.RaiseException, match=r"append-only|is a fact"):
                    connection.execute(command)
        before = push(client, 2)
        with psycopg.connect(coordinator) as connection:
            other = citus.nodes(connection)[2]
        commands.move_plant("far", str(other), data_dir=None, database_url=coordinator)
        assert push(client, 2) == before + 1
        with psycopg.connect(coordinator) as connection:
            assert citus.node_of(connection, "far") == other
            assert "this plant lies on the coordinator" in citus.in_words(connection)
            assert citus.missing(connection, ["far", "near"]) == [
                "not distributed: near. `inband plant move PLANT HOST:PORT` takes a plant to a node"
            ]
        with psycopg.connect(url) as connection:
            assert f"this plant lies on {other}" in citus.in_words(connection)
        with pytest.raises(NotFound, match="no node"):
            commands.move_plant("far", "nowhere:5432", data_dir=None, database_url=coordinator)

    def test_a_protection_that_a_node_lacks_is_given_by_the_next_migrate(
        self, client: httpx.Client, coordinator: str, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        url = in_schema(coordinator, "far")
        migrate.downgrade(url, "0101")
        with monkeypatch.context() as ended:  # the migration ended before it came to that
            ended.setattr(citus, "protect", lambda _connection: None)
            migrate.upgrade(url)
        with psycopg.connect(url) as connection:
            assert "note" in citus.unprotected(connection)
        assert migrate.upgrade(url) == []
        with psycopg.connect(url) as connection:
            assert citus.unprotected(connection) == []

    def test_moved_under_load_nothing_is_lost_and_numbers_have_no_gaps(
        self, server: Server, client: httpx.Client, coordinator: str
    ) -> None:
        with psycopg.connect(coordinator) as connection:
            before, places = citus.node_of(connection, "far"), citus.nodes(connection)[1:]
        (other,) = (each for each in places if each != before)
        with under_load(server, client, coordinator, "moved"):
            commands.move_plant("far", str(other), data_dir=None, database_url=coordinator)
        with psycopg.connect(coordinator) as connection:
            assert citus.node_of(connection, "far") == other

    def test_a_node_that_is_killed_stops_its_plant_alone_and_loses_nothing(
        self,
        server: Server,
        client: httpx.Client,
        cluster: list[EmbeddedServer],
        coordinator: str,
        run_server: RunServer,
    ) -> None:
        with psycopg.connect(coordinator) as connection:
            place_of_far = citus.node_of(connection, "far")
        (node,) = (each for each in cluster if place(each) == place_of_far)
        near = client_of(server, coordinator, "near")
        with closing(near), under_load(server, client, coordinator, "killed"):
            kill(node)
            refused = client.post(
                "/api/v1/readings", json={"characteristic": "shaft", "measured": 40.001, "key": "away"}
            )
            assert refused.status_code == 503, refused.text
            assert [push(near, 1), push(near, 2)] == [1, 2]
            assert client.get("/characteristics/shaft").status_code == 503
            with psycopg.connect(coordinator) as connection:
                (told,) = (each for each in citus.missing(connection, []) if "answer" in each)
            assert told.startswith(f"{place_of_far} does not answer, so its plants are stopped; the others go on")
            with run_server(coordinator) as begun:  # it serves the others; the plant as soon as its node is there
                near.base_url = httpx.URL(f"{begun.url}/p/near")
                assert push(near, 3) == 3
                assert machines_at(begun, client) == 503
                node.start()
                wait_for(lambda: machines_at(begun, client) == 200, "it is served again")


MOVING = re.compile(r"\b(clock_timestamp|random|gen_random_uuid|timeofday|nextval)\(")
UPDATE = re.compile(r"\bUPDATE\s+\w")


def moving_changes(source: str) -> Iterator[int]:
    """Lines of a module that change rows by a function whose value moves on, in SQL or by SQLAlchemy."""
    module = ast.parse(source)
    named = {}
    for each in module.body:
        match each:
            case (
                ast.Assign(targets=[ast.Name(id=name)], value=value)
                | ast.AnnAssign(target=ast.Name(id=name), value=value)
            ):
                named[name] = value

    def text(node: ast.AST | None) -> str:
        """The text that an expression makes, with texts of the module that are named in it."""
        match node:
            case ast.Constant(value=str(words)):
                return words
            case ast.JoinedStr(values=parts):
                return "".join(map(text, parts))
            case ast.BinOp(left=left, op=ast.Add(), right=right):
                return text(left) + text(right)
            case ast.FormattedValue(value=ast.Name(id=name)) | ast.Name(id=name) if name in named:
                return text(named[name])
        return " x "

    def moves(node: ast.AST) -> bool:
        return MOVING.search(ast.unparse(node)) is not None

    for node in ast.walk(module):
        match node:
            case ast.Constant(value=str()) | ast.JoinedStr() | ast.BinOp(op=ast.Add()):
                changes = all(pattern.search(text(node)) for pattern in (UPDATE, MOVING))
            case ast.Assign(targets=targets, value=value):
                to_a_row = any(isinstance(part, ast.Attribute) for each in targets for part in ast.walk(each))
                changes = to_a_row and moves(value) and "func." in ast.unparse(value)
            case ast.Call(func=ast.Attribute(attr="values")):
                changes = moves(node)
            case ast.keyword(arg="set_" | "onupdate", value=value):
                changes = moves(value)
            case _:
                changes = False
        if changes:
            yield node.lineno  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    "source",
    [
        'text("UPDATE tool SET at = clock_timestamp()")',
        'text(f"UPDATE {table} SET number = {number}, " f"at = clock_timestamp()")',
        'text("UPDATE tool SET" + " at = clock_timestamp()")',
        'NOW = "clock_timestamp()"\ntext(f"UPDATE tool SET at = {NOW}")',
        "tool.at = func.clock_timestamp()",
        "update(Tool).values(at=func.clock_timestamp())",
        "insert(Tool).on_conflict_do_update(index_elements=[Tool.id], set_={Tool.at: func.clock_timestamp()})",
        'insert(Tool).on_conflict_do_update(set_=dict(at=text("clock_timestamp()")))',
        "at: Mapped[datetime] = mapped_column(onupdate=func.clock_timestamp())",
    ],
)
def test_a_row_that_is_changed_by_a_clock_that_moves_on_is_found(source: str) -> None:
    assert list(moving_changes(source))
    assert not list(moving_changes(source.replace("clock_timestamp", "now")))


def test_no_row_is_changed_by_a_clock_that_moves_on() -> None:
    """Citus refuses an UPDATE of a distributed table with a volatile function, whatever PostgreSQL thinks of it."""
    modules = (HOUSE / "app").rglob("*.py")
    assert not [
        f"{path.relative_to(HOUSE)}:{line}" for path in modules for line in moving_changes(path.read_text("utf-8"))
    ]


def test_without_citus_a_plant_does_not_move(database: Database) -> None:
    commands.add_plant(
        "near", name=None, schema=None, host=None, timezone=None, shifts=None, data_dir=None, database_url=database.dsn
    )
    with pytest.raises(Invalid, match="no Citus"):
        commands.move_plant("near", "127.0.0.1:5432", data_dir=None, database_url=database.dsn)
    with psycopg.connect(database.dsn) as connection:
        assert citus.in_words(connection) == ""
