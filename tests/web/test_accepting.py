"""Connections are taken some in each turn of the event loop."""

import asyncio
import errno
import socket
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack

import pytest

from app.web import accepting
from app.web.accepting import AT_ONCE, Loop
from tests.loops import in_thread

MANY = 10 * AT_ONCE


class Turns(asyncio.Protocol):
    """Counts the connections made in each turn of the loop."""

    def __init__(self) -> None:
        self.turn = 0
        self.made: Counter[int] = Counter()
        self.sockets: list[socket.socket] = []
        self.all_made = asyncio.Event()

    def next_turn(self) -> None:
        self.turn += 1
        asyncio.get_running_loop().call_soon(self.next_turn)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.made[self.turn] += 1
        self.sockets.append(transport.get_extra_info("socket"))
        if self.made.total() == MANY:
            self.all_made.set()


@pytest.fixture
def listening() -> Iterator[socket.socket]:
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        yield sock


async def all_connected(listening: socket.socket) -> Turns:
    """So many clients connect in one instant; the turns in which they were taken."""
    turns = Turns()
    server = await asyncio.get_running_loop().create_server(lambda: turns, sock=listening, backlog=2 * MANY)
    with ExitStack() as clients:
        for _client in range(MANY):
            clients.enter_context(socket.create_connection(listening.getsockname()))
        turns.next_turn()
        async with asyncio.timeout(60):
            await turns.all_made.wait()
        assert all(sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY) for sock in turns.sockets)
    server.close()
    await server.wait_closed()
    return turns


def in_loop(listening: socket.socket) -> Turns:
    def on_loop() -> Turns:
        with asyncio.Runner(loop_factory=Loop) as runner:
            return runner.run(all_connected(listening))

    return in_thread(on_loop)


def test_connections_of_one_instant_are_many_turns(listening: socket.socket) -> None:
    address = listening.getsockname()
    turns = in_loop(listening)
    assert max(turns.made.values()) <= AT_ONCE
    assert len(turns.made) >= MANY // AT_ONCE
    with pytest.raises(ConnectionRefusedError):  # the port is closed with the server
        socket.create_connection(address)


def test_connections_are_taken_again_once_there_are_files(
    listening: socket.socket, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    class Full(socket.socket):
        """A socket whose process has no more files at first."""

        refused = False

        def accept(self) -> tuple[socket.socket, object]:
            if not self.refused:
                self.refused = True
                raise OSError(errno.EMFILE, "Too many open files")
            return super().accept()

    monkeypatch.setattr(accepting, "REST", 0.05)
    turns = in_loop(Full(fileno=listening.detach()))
    assert turns.made.total() == MANY
    assert [record.message for record in caplog.records] == [
        "no connection can be taken for 0.05 s: Too many open files"
    ]
