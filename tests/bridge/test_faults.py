"""Faults at random points while parts are made: nothing lost, nothing doubled, no edit overwritten."""

import random
from pathlib import Path
from typing import Any

import pytest

from app.simulators.controls.mqtt import mosquitto
from bench.bridge_faults import KINDS, Campaign
from tests.servers import Server
from tests.shop import unique

pytestmark = pytest.mark.own_server


def campaign(server: Server, folder: Path, kind: str, **more: Any) -> Campaign:
    client = server.client(server.key())

    def call(method: str, path: str, **body: Any) -> Any:
        answer = client.request(method, f"/api/v1{path}", json=body or None)
        answer.raise_for_status()
        return answer.json()

    return Campaign(server, call, folder, kind, name=unique("faults"), **more)


def test_the_loop_outlives_bridge_server_and_links(server: Server, tmp_path: Path) -> None:
    """One kind, and each fault once. What other kinds do when their link is cut, tests/bridge/kinds shows."""
    faults = [
        "bridge killed",
        "link to the control cut",
        "edited by hand",
        "server killed",
        "power of the control lost",
    ]
    found = campaign(server, tmp_path, "heidenhain", pause=0.1).go_through(faults)
    assert found["corrections"]


@pytest.mark.long
@pytest.mark.parametrize("kind", sorted(KINDS))
def test_nothing_is_lost_doubled_or_overwritten(server: Server, tmp_path: Path, kind: str) -> None:
    if kind == "mqtt" and mosquitto() is None:
        pytest.skip("mosquitto is not installed")
    found = campaign(server, tmp_path, kind, seed=random.SystemRandom().randrange(10**6)).run(10)
    assert found["readings"] > 15
