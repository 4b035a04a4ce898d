"""Live events over SSE, on a real server: what is told, to whom, and that nothing is missed."""

import asyncio
import itertools
import json
import threading
import time
from collections.abc import AsyncIterator, Callable, Collection, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path
from queue import Empty, Queue
from typing import Any, NamedTuple
from urllib.parse import urlsplit

import httpx
import psycopg
import pytest

from app.access import actions as people
from app.access.sign_in import sign_out
from app.db.connections import Connections
from app.db.embedded import EmbeddedServer
from app.db.engine import Database
from app.db.events import publish
from app.loop.machines import keys
from app.web.live import MOST_MISSED, Access, Live
from tests.databases import copied, in_database
from tests.loops import run
from tests.servers import RunServer, Server
from tests.shop import Shop, unique

pytestmark = pytest.mark.own_server
"""Of its events all are heard; it is ended and its database away."""


PASSED_OVER = {"hello", "heartbeat", "mark"}
_marks = itertools.count(1)


class Event(NamedTuple):
    kind: str
    id: int | None
    data: dict[str, Any]


class Listener:
    """An open stream, read by a thread as an EventSource reads it."""

    def __init__(self, response: httpx.Response) -> None:
        self.response = response
        self.queue: Queue[Event | None] = Queue()
        self.last_id: int | None = None  # what an EventSource would come back with
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        fields: dict[str, str] = {}
        try:
            for line in self.response.iter_lines():
                if line:
                    name, _colon, value = line.partition(": ")
                    fields[name] = value
                elif "event" in fields:
                    number = int(fields["id"]) if "id" in fields else None
                    self.queue.put(Event(fields["event"], number, json.loads(fields["data"])))
                    fields = {}
                else:
                    fields = {}
        except (httpx.HTTPError, httpx.StreamError):
            pass
        self.queue.put(None)

    def next(self, kind: str | None = None, seconds: float = 60) -> Event:
        """The next event (of this kind); heartbeats, marks and the greeting are passed over."""
        deadline = time.monotonic() + seconds
        while True:
            event = self.queue.get(timeout=max(0.01, deadline - time.monotonic()))
            assert event is not None, "the stream ended"
            self.last_id = self.last_id if event.id is None else event.id
            if event.kind == kind or (kind is None and event.kind not in PASSED_OVER):
                return event

    def until(self, number: int) -> list[Event]:
        """What is told until this mark."""
        told: list[Event] = []
        while (event := self.queue.get(timeout=60)) is not None:
            if event.kind == "mark" and event.data["number"] == number:
                return told
            told += [event] if event.kind not in PASSED_OVER else []
        raise AssertionError("the stream ended")

    def tells(self, kind: str) -> bool:
        """Tell if an event of this kind comes before the server ends the stream."""
        return any(event.kind == kind for event in iter(lambda: self.queue.get(timeout=60), None))

    def ends(self, seconds: float = 60) -> bool:
        """Tell if the server ends the stream; messages until then are skipped."""
        deadline = time.monotonic() + seconds
        try:
            while self.queue.get(timeout=max(0.01, deadline - time.monotonic())) is not None:
                pass
        except Empty:
            return False
        return True


def mark(database: Database) -> int:
    """The number of an event that everybody hears and that means nothing: all that was done before is told before."""
    number = next(_marks)
    with database.begin() as session:
        publish(session, {"kind": "mark", "number": number})
    return number


@contextmanager
def stream(client: httpx.Client, last_event_id: int | str | None = None) -> Iterator[Listener]:
    """Live events as they come, also of what was done just before."""
    headers = {} if last_event_id is None else {"Last-Event-ID": str(last_event_id)}
    with client.stream("GET", "/api/v1/events", headers=httpx.Headers(headers, encoding="utf-8")) as response:
        assert response.status_code == 200
        assert response.headers["content-type"].startswith("text/event-stream")
        assert response.headers["cache-control"] == "no-store"
        listener = Listener(response)
        listener.next("hello")
        yield listener


def until_live_again(shop: Shop) -> None:
    """Open a stream until one tells of a reading, as browsers do: before the server hears again, it ends each at once."""
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        with stream(shop.admin) as listener:
            shop.read(6.0)
            if listener.tells("reading"):
                return
    raise AssertionError("no stream told of a reading")


Listening = Callable[[httpx.Client], AbstractContextManager[Listener]]
Quiet = Callable[[Listener], bool]


@pytest.fixture
def listening(server: Server) -> Listening:
    """``with listening(client) as listener``: live events from now on."""

    @contextmanager
    def begin(client: httpx.Client) -> Iterator[Listener]:
        with stream(client) as listener:
            listener.until(mark(server.database))
            yield listener

    return begin


@pytest.fixture
def quiet(server: Server) -> Quiet:
    """``quiet(listener)``: nothing more was told than has been read."""
    return lambda listener: listener.until(mark(server.database)) == []


def test_a_reading_is_reported_with_what_it_led_to(shop: Shop, listening: Listening, quiet: Quiet) -> None:
    with listening(shop.admin) as listener:
        shop.read(350.0)
        told = {event.kind: event for event in (listener.next(), listener.next(), listener.next())}
        about = {"machine": shop.machine, "characteristic": shop.characteristic}
        assert told["reading"].data == about | {"kind": "reading", "sequence": 1}
        assert told["correction"].data.items() >= (about | {"number": 1, "status": "held", "tool": 3}).items()
        assert told["alarm"].data.items() >= (about | {"alarm": "tool_worn", "state": "active"}).items()
        # One transaction, one number, and it comes last.
        assert [event.id is None for event in told.values()] == [True, True, False]
        shop.acknowledge(told["alarm"].data["id"], "keep_cutting")
        kinds = {listener.next().kind, listener.next().kind}
        assert kinds == {"correction", "alarm"}
        shop.correction(1, "applied")
        assert {listener.next().kind, listener.next().kind} == {"correction", "tool"}
        assert quiet(listener)


def test_a_page_opened_during_the_check_of_accesses_stays_open(
    database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.web.live.LOOK", 0.1)
    first, second = Access(None, 1, "viewer"), Access(None, 2, "viewer")

    async def check() -> None:
        opened: asyncio.Queue[AsyncIterator[bytes]] = asyncio.Queue()

        async def still_granted(_conn: object, accesses: Collection[Access]) -> Collection[Access]:
            if len(accesses) == 1:  # the second page is opened while the database looks after the first
                page = live.stream(second, None)
                await anext(page)
                opened.put_nowait(page)
            return accesses

        live = Live(Connections(database.dsn), still_granted)
        live.start()
        try:
            open_page = live.stream(first, None)
            await anext(open_page)
            page = await asyncio.wait_for(opened.get(), 30)
            assert b"event: hello" in await anext(page)
            await asyncio.to_thread(mark, database)
            assert b"event: mark" in await anext(page)
        finally:
            await live.stop()

    run(check())


def test_what_people_set_up_is_reported(shop: Shop, listening: Listening) -> None:
    with listening(shop.admin) as listener:
        other = Shop(shop.server)
        kinds = {listener.next().kind, listener.next().kind}
        assert kinds == {"machine", "characteristic"}
        other.call(
            "PUT", f"/machines/{other.machine}/averages/5", empirical_value=0.001, reason="Compared with a micrometer"
        )
        event = listener.next("average")
        assert (event.data["machine"], event.data["average_memory"]) == (other.machine, 5)


def test_two_averages_of_one_transaction_are_both_reported(shop: Shop, listening: Listening) -> None:
    second = f"{shop.characteristic}-b"
    shop.add(second, average_memory=6)
    with listening(shop.admin) as listener:
        shop.call("POST", f"/machines/{shop.machine}/tools/3/change", offset=0.0, reason="Worn")
        told = {listener.next("average").data["average_memory"], listener.next("average").data["average_memory"]}
        assert told == {5, 6}


def test_an_exclusion_is_not_lost_among_readings(shop: Shop, listening: Listening) -> None:
    shop.read(0.0)
    with listening(shop.admin) as listener:
        shop.call("POST", f"/readings/{shop.characteristic}/1/exclude", reason="Chip")
        shop.read(0.0)
        told = [listener.next("reading").data, listener.next("reading").data]
        assert {(data["sequence"], data.get("excluded", False)) for data in told} == {(1, True), (2, False)}


def test_of_many_readings_at_once_the_last_is_reported(shop: Shop, listening: Listening, quiet: Quiet) -> None:
    with listening(shop.admin) as listener:
        readings = [{"characteristic": shop.characteristic, "measured": 40.0} for _ in range(2000)]
        assert shop.admin.post("/api/v1/readings/batch", json=readings).json()["stored"] == 2000
        assert listener.next("reading").data["sequence"] == 2000
        assert quiet(listener)


def test_a_heartbeat_comes_while_all_is_quiet(shop: Shop, listening: Listening) -> None:
    with listening(shop.admin) as listener:
        shop.read(0.0)
        number = listener.next("reading").id
        assert listener.next("heartbeat").id == number


class TestResuming:
    def test_nothing_is_missed(self, shop: Shop, listening: Listening) -> None:
        with listening(shop.admin) as listener:
            shop.read(6.0)
            listener.next("correction")
            here = listener.last_id
        assert here is not None
        for _each in range(3):
            shop.read(350.0)
        with stream(shop.admin, here) as listener:
            told = [listener.next()]
            while told[-1].data.get("number") != 4:
                told.append(listener.next())
            assert listener.next().kind == "alarm"
            assert [event.data["sequence"] for event in told if event.kind == "reading"] == [2, 3, 4]
            assert {event.data["number"] for event in told if event.kind == "correction"} == {2, 3, 4}
            shop.read(0.0)
            assert listener.next("reading").data["sequence"] == 5

    def test_cut_off_within_a_transaction_it_is_sent_whole_again(self, shop: Shop, listening: Listening) -> None:
        with listening(shop.admin) as listener:
            shop.read(0.0)
            assert listener.next("reading").id is not None
            shop.read(350.0)
            first = listener.next()
            assert first.id is None
            here = listener.last_id  # gone before the rest of it
        with stream(shop.admin, here) as listener:
            assert {listener.next().kind for _event in range(3)} == {"reading", "correction", "alarm"}

    @pytest.mark.parametrize(("crowd", "count"), [(4, 20), pytest.param(8, 40, marks=pytest.mark.long)])
    def test_a_crowd_that_comes_and_goes_misses_nothing(self, shop: Shop, crowd: int, count: int) -> None:
        """While readings arrive, clients break off at any place and come back; each sees every correction."""

        def follow(seed: int) -> set[int]:
            seen: set[int] = set()
            client = shop.server.client(shop.admin.headers["Authorization"].removeprefix("Bearer "))
            last = begin
            while len(seen) < count:
                with stream(client, last) as listener:
                    listener.last_id = last
                    for _event in range(6 + seed):
                        event = listener.next()
                        assert event.kind != "resync"
                        if event.kind == "correction" and event.data["machine"] == shop.machine:
                            seen.add(event.data["number"])
                            if len(seen) == count:
                                break
                    assert listener.last_id is not None
                    last = listener.last_id
            return seen

        with stream(shop.admin) as listener:
            shop.read(0.0)
            begin = listener.next("reading").id or 0
        with ThreadPoolExecutor(crowd) as pool:
            followers = [pool.submit(follow, seed) for seed in range(crowd)]
            for number in range(count):
                shop.read(6.0, correction_in_effect=number)
            for follower in followers:
                assert follower.result(120) == set(range(1, count + 1))

    def test_too_much_missed_is_a_resync(self, shop: Shop) -> None:
        with psycopg.connect(shop.server.database.dsn, autocommit=True) as connection:
            (last,) = connection.execute("SELECT max(id) FROM event").fetchone() or (0,)
            connection.execute(
                'INSERT INTO event (changes) SELECT \'[{"kind": "reading", "machine": "x"}]\''
                " FROM generate_series(1, %s)",
                [MOST_MISSED + 1],
            )
            (newest,) = connection.execute("SELECT max(id) FROM event").fetchone() or (0,)
        with stream(shop.admin, last) as listener:
            assert listener.next() == Event("resync", newest, {})
            shop.read(0.0)
            assert listener.next("reading").data["characteristic"] == shop.characteristic
        with stream(shop.admin, newest - 5) as listener:
            assert listener.next("reading").data["machine"] == "x"

    @pytest.mark.parametrize("missed", [MOST_MISSED - 1, MOST_MISSED])
    def test_as_much_as_is_reported_is_reported_one_by_one(self, shop: Shop, missed: int) -> None:
        with psycopg.connect(shop.server.database.dsn, autocommit=True) as connection:
            connection.execute("DELETE FROM event")
            connection.execute(
                "INSERT INTO event (changes) SELECT jsonb_build_array(jsonb_build_object("
                "'kind', 'reading', 'machine', 'x', 'sequence', n)) FROM generate_series(0, %s) AS n",
                [missed],
            )
            (first,) = connection.execute("SELECT min(id) FROM event").fetchone() or (0,)
        with stream(shop.admin, first) as listener:
            assert [listener.next("reading").data["sequence"] for _ in range(missed)] == list(range(1, missed + 1))

    def test_a_number_that_is_not_known_is_a_resync(self, shop: Shop) -> None:
        with stream(shop.admin, 10**15) as listener:
            assert listener.next().kind == "resync"

    @pytest.mark.parametrize("number", ["", "x", "-1", "9" * 40, "٣"])
    def test_a_number_that_is_none_begins_now(
        self, shop: Shop, listening: Listening, quiet: Quiet, number: str
    ) -> None:
        with listening(shop.admin), stream(shop.admin, number) as listener:
            assert quiet(listener)


class TestWhoHearsWhat:
    def test_a_machine_hears_of_itself_alone(self, shop: Shop, listening: Listening, quiet: Quiet) -> None:
        other = Shop(shop.server)
        with listening(shop.admin) as listener:
            shop.read(0.0)
            begin = listener.next("reading").id
        with (
            listening(shop.machine_client) as listener,
            listening(shop.server.client(shop.server.key("viewer"))) as all_,
        ):
            other.read(6.0)
            shop.read(0.0)
            assert listener.next("reading").data["machine"] == shop.machine
            assert all_.next("reading").data["machine"] == other.machine
        with stream(shop.machine_client, begin) as listener:
            assert listener.next().data["machine"] == shop.machine
            assert quiet(listener)

    def test_nobody_hears_without_a_key(self, server: Server) -> None:
        answer = server.client().get("/api/v1/events")
        assert answer.status_code == 401
        assert answer.headers["content-type"] == "application/problem+json"

    def test_a_cursor_out_of_range_is_refused(self, shop: Shop) -> None:
        for after in ("-1", "x", "1" * 30):
            answer = shop.admin.get("/api/v1/events", params={"after": after})
            assert answer.status_code == 422, answer.text


def test_many_clients_all_hear_of_it(shop: Shop) -> None:
    key = shop.server.key("viewer")
    with ExitStack() as stack:
        listeners = [stack.enter_context(stream(shop.server.client(key))) for _ in range(40)]
        shop.read(6.0)
        for listener in listeners:
            assert listener.next("correction").data["machine"] == shop.machine


def test_the_stream_goes_on_after_the_database_cut_the_listener_off(shop: Shop, listening: Listening) -> None:
    with listening(shop.admin) as listener, psycopg.connect(shop.server.database.dsn, autocommit=True) as connection:
        connection.execute(
            "SELECT pg_terminate_backend(pid) FROM pg_stat_activity"
            " WHERE application_name = 'inband-live' AND datname = current_database()"
        )
        for number in range(4):
            shop.read(6.0, correction_in_effect=number)
            time.sleep(0.1)
        numbers: set[int] = set()
        while len(numbers) < 4:
            numbers.add(listener.next("correction").data["number"])
        assert numbers == {1, 2, 3, 4}


@contextmanager
def refusing(server: Server) -> Iterator[None]:
    """The database ends every connection and takes no other."""
    server.database.engine.dispose()
    name = urlsplit(server.database.dsn).path[1:]
    with psycopg.connect(in_database(server.database.dsn, "postgres"), autocommit=True) as connection:
        connection.execute(f"ALTER DATABASE {name} ALLOW_CONNECTIONS false")
        try:
            connection.execute("SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = %s", [name])
            yield
        finally:
            connection.execute(f"ALTER DATABASE {name} ALLOW_CONNECTIONS true")


def test_no_stream_calls_itself_live_in_an_outage_which_the_log_tells_once(shop: Shop) -> None:
    server = shop.server
    before = len(server.stderr.read_text())
    with stream(shop.admin) as listener, refusing(server):
        assert listener.ends()
        time.sleep(2.5)  # so long that it is tried again and again
    until_live_again(shop)
    log = server.stderr.read_text()[before:]
    assert log.count("live events are interrupted") == 1
    assert log.count("live events go on after an interruption of") == 1


@pytest.mark.long
def test_no_stream_calls_itself_live_while_the_whole_postgresql_is_away(
    run_server: RunServer, whole_cluster: Path, tmp_path: Path
) -> None:
    postgres = EmbeddedServer(copied(whole_cluster, tmp_path / "inband"), {"fsync": "off"})
    postgres.start()
    try:
        with run_server(postgres.url) as server:
            shop = Shop(server)
            with stream(shop.admin) as listener:
                postgres.stop()
                assert listener.ends()
            time.sleep(2.5)
            postgres.start()
            until_live_again(shop)
            log = server.stderr.read_text()
            assert log.count("live events are interrupted") == 1
            assert log.count("live events go on after an interruption of") == 1
    finally:
        postgres.stop()


def test_streams_end_when_the_server_ends(server: Server) -> None:
    with stream(server.client(server.key())) as listener:
        assert server.stop() == 0
        try:
            assert listener.ends()
        finally:
            server.restart()


class TestTheRightToHear:
    """It is taken away here, in another process than the server's: streams end within a second or two all the same."""

    @pytest.fixture
    def person(self, server: Server) -> tuple[int, httpx.Client]:
        name = unique("Listener")
        password = server.person(name, "engineer")
        browser = server.client()
        assert browser.post("/sign-in", data={"name": name, "password": password}).status_code == 303
        number: int = browser.get("/api/v1/people/me").json()["id"]
        return number, browser

    @pytest.mark.parametrize("ended", ["disabled", "another role", "signed out", "password reset"])
    def test_of_a_person(
        self, server: Server, person: tuple[int, httpx.Client], ended: str, listening: Listening
    ) -> None:
        number, browser = person
        with listening(browser) as listener:
            with server.database.begin() as session:
                match ended:
                    case "disabled":
                        people.disable_person(session, number, "tests")
                    case "another role":
                        people.change_role(session, number, "viewer", "tests")
                    case "signed out":
                        sign_out(session, browser.cookies["inband_session"], "tests")
                    case "password reset":
                        people.reset_password(session, number, "tests")
            assert listener.ends()
        again = browser.get("/api/v1/machines").status_code
        assert again == (200 if ended == "another role" else 401)

    @pytest.mark.parametrize("of_machine", [True, False])
    def test_of_a_key(self, server: Server, shop: Shop, of_machine: bool, listening: Listening) -> None:
        with server.database.begin() as session:
            key = (
                people.add_key(session, name="listener", actor="tests", machine=shop.machine)
                if of_machine
                else people.add_key(session, name="listener", actor="tests", role="viewer")
            )
        with listening(server.client(key.secret)) as listener, listening(shop.admin) as other:
            with server.database.begin() as session:
                if of_machine:
                    keys.revoke_machine_key(session, shop.machine, key.id, "tests")
                else:
                    people.revoke_key(session, key.id, "tests")
            assert listener.ends()
            shop.read(1.0)
            assert other.next().kind == "reading", "who may still hear goes on"
