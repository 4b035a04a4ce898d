"""Two processes of Inband behind one address: either may be killed, and the other goes on with all that people and machines did."""

import contextlib
import itertools
import shutil
import socket
import subprocess
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Self
from urllib.parse import urlsplit

import httpx
import pytest

from app import HOUSE
from app.db.engine import Database
from tests.databases import NewDatabase
from tests.loop.readings.writer.test_broken import at_work, crew, nothing_lost_or_doubled
from tests.servers import TLS, RunServer, Server, free_port
from tests.shop import Person, Shop
from tests.waits import until
from tests.web.test_live import Listener

HOW_TO = HOUSE / "docs" / "how-to" / "high-availability.md"


class Front:
    """One address for several servers, as a proxy gives it: each connection to the next of them that takes it."""

    def __init__(self, servers: Sequence[Server]) -> None:
        self._turns = itertools.cycle(
            [(urlsplit(server.url).hostname, urlsplit(server.url).port) for server in servers]
        )
        self._count = len(servers)
        self._listening = socket.create_server(("127.0.0.1", 0))
        self._ends: list[socket.socket] = []
        self.url = f"http://127.0.0.1:{self._listening.getsockname()[1]}"
        threading.Thread(target=self._accept, daemon=True).start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for end in (self._listening, *self._ends):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                client, _address = self._listening.accept()
                for _try in range(self._count):
                    with contextlib.suppress(OSError):
                        server = socket.create_connection(next(self._turns))
                        break
                else:
                    client.close()
                    continue
                self._ends += [client, server]
                for source, sink in ((client, server), (server, client)):
                    threading.Thread(target=_pass_on, args=(source, sink), daemon=True).start()


def _pass_on(source: socket.socket, sink: socket.socket) -> None:
    with contextlib.suppress(OSError):
        while data := source.recv(65536):
            sink.sendall(data)
    for end in (source, sink):
        with contextlib.suppress(OSError):
            end.shutdown(socket.SHUT_RDWR)


@pytest.fixture(scope="module")
def both(new_database: NewDatabase, run_server: RunServer) -> Iterator[list[Server]]:
    url = new_database()
    with ExitStack() as stack:
        yield [stack.enter_context(run_server(url)) for _process in range(2)]


@pytest.fixture(scope="module")
def front(both: list[Server]) -> Iterator[Server]:
    """What people and machines see: one address."""
    with Front(both) as made:
        database = Database(both[0].database.dsn, pool_size=2)
        seen = Server(made.url, database, both[0].process, both[0].start, both[0].stderr)
        yield seen
        seen.hang_up()
        database.close()


def page(person: Person) -> int:
    """As a browser: a connection that broke is made anew."""
    try:
        return person.browser.get("/alarms").status_code
    except httpx.TransportError:
        return 0


@pytest.mark.parametrize("which", [0, pytest.param(1, marks=pytest.mark.long)])
def test_either_may_be_killed_under_load(front: Server, both: list[Server], which: int) -> None:
    shop, person = Shop(front), Person(front, "engineer")
    senders = crew(shop, front)

    def disturb() -> None:
        time.sleep(0.5)
        both[which].kill()

    try:
        at_work(senders, disturb)
        until(lambda: page(person) == 200)  # signed in still, and served
        shop.admin = front.client(front.key())
        nothing_lost_or_doubled(shop, senders)
    finally:
        both[which].restart()


def test_live_events_go_on_where_they_were(front: Server, both: list[Server]) -> None:
    shop = Shop(front)
    with both[0].client(front.key()).stream("GET", "/api/v1/events") as stream:
        listener = Listener(stream)
        listener.next("hello")
        shop.read(1.0)
        seen = listener.next("reading").id
        both[0].kill()
        assert listener.ends()
    try:
        elsewhere = both[1].client(front.key(machine=shop.machine))
        reading = {"characteristic": shop.characteristic, "measured": 40.002, "key": "missed"}
        assert elsewhere.post("/api/v1/readings", json=reading).status_code == 201
        with (
            both[1].client(front.key()).stream("GET", "/api/v1/events", headers={"Last-Event-ID": str(seen)}) as stream
        ):
            assert Listener(stream).next("reading").data["sequence"] == 2
    finally:
        both[0].restart()


@pytest.mark.skipif(shutil.which("haproxy") is None, reason="HAProxy is not installed")
def test_the_proxy_of_the_how_to_goes_on_with_the_other(both: list[Server], front: Server, tmp_path: Path) -> None:
    """Its configuration, with these servers and without https."""
    _before, _mark, rest = HOW_TO.read_text().partition("    defaults\n")
    words = "    defaults\n" + "".join(
        itertools.takewhile(lambda line: line.startswith("    ") or line == "\n", rest.splitlines(True))
    )
    port = free_port()
    words = words.replace(":443 ssl crt /etc/haproxy/inband.pem", f"127.0.0.1:{port}")
    for address, server in zip(("10.0.4.11:8000", "10.0.4.12:8000"), both, strict=True):
        assert address in words
        words = words.replace(address, urlsplit(server.url).netloc)
    configuration = tmp_path / "haproxy.cfg"
    configuration.write_text("".join(line.removeprefix("    ") for line in words.splitlines(True)))
    proxy = subprocess.Popen(
        ["haproxy", "-db", "-f", str(configuration)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=10, verify=TLS) as client:

            def answers() -> bool:
                with contextlib.suppress(httpx.TransportError):
                    return client.get("/health/ready").status_code == 200
                return False

            until(answers)
            both[0].kill()
            until(lambda: all(answers() for _again in range(5)))
            assert front.client().get("/health/live").status_code == 200
    finally:
        proxy.terminate()
        proxy.wait(10)
        both[0].restart()
