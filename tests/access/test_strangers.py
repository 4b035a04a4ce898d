"""What strangers send holds up nobody: every route gets large bodies, while /health/live is asked beside it."""

import pytest

from bench.bodies import WANTED, Request, addresses, bodies, held, requests
from tests.servers import Server


@pytest.mark.long
def test_large_bodies_of_strangers_hold_up_nobody(server: Server) -> None:
    found = held(server.url, requests(1_000_000), {})
    assert found.more < WANTED, found.beside


@pytest.mark.long
def test_sixty_four_megabytes_of_a_stranger_hold_up_nobody(server: Server) -> None:
    """At the routes that take as much of those who may import, and at one that does not."""
    sent = [
        Request("POST", path, name, kind, body)
        for name, kind, body in bodies(64_000_000)
        for path in ("/api/v1/readings/aqdef", "/import", "/api/v1/notes", "/sign-in")
    ]
    found = held(server.url, sent, {})
    assert found.more < WANTED, found.beside


def test_there_is_something_to_walk() -> None:
    assert len(addresses()) > 150
    assert 900_000 < max(len(body) for _name, _kind, body in bodies(1_000_000)) <= 1_000_000
