"""Thirty faults at random points: nothing lost, nothing doubled, no edit overwritten. ``python -m bench.bridge_faults`` does more."""

from pathlib import Path
from typing import Any

import pytest

from bench.bridge_faults import Campaign
from tests.conftest import Server


@pytest.mark.slow
def test_nothing_is_lost_doubled_or_overwritten(server: Server, tmp_path: Path) -> None:
    client = server.client(server.key())

    def call(method: str, path: str, **body: Any) -> Any:
        answer = client.request(method, f"/api/v1{path}", json=body or None)
        answer.raise_for_status()
        return answer.json()

    found = Campaign(server, call, tmp_path).run(30)
    assert found["readings"] > 30
