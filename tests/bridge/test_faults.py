"""Thirty faults at random points, five with each kind: nothing lost, nothing doubled, no edit overwritten.

``python -m bench.bridge_faults`` does more.
"""

from pathlib import Path
from typing import Any

import pytest

from app.bridge.simulators.mqtt import mosquitto
from bench.bridge_faults import KINDS, Campaign
from tests.conftest import Server


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_nothing_is_lost_doubled_or_overwritten(server: Server, tmp_path: Path, kind: str) -> None:
    if kind == "mqtt" and mosquitto() is None:
        pytest.skip("mosquitto is not installed")
    client = server.client(server.key())

    def call(method: str, path: str, **body: Any) -> Any:
        answer = client.request(method, f"/api/v1{path}", json=body or None)
        answer.raise_for_status()
        return answer.json()

    found = Campaign(server, call, tmp_path, kind).run(5)
    assert found["readings"] > 15
