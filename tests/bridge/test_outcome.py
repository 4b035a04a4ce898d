"""Parts in tolerance on a machine with six tools, and the alarm that names what went wrong."""

from pathlib import Path
from typing import Any

import pytest

from app.bridge.simulators.model import UNMAPPED, Steps
from app.bridge.simulators.mqtt import mosquitto
from app.jobs.actions import run_jobs
from app.loop.tools.untaken import Watch
from bench.outcome import KINDS, WORST, Outcome, Play, Process
from tests.conftest import TLS, Server
from tests.loop.tools.test_untaken import age_corrections
from tests.shop import unique


def play(server: Server, kind: str, parts: int) -> Play:
    client = server.client(server.key())

    def call(method: str, path: str, **body: Any) -> Any:
        answer = client.request(method, f"/api/v1{path}", json=body or None)
        answer.raise_for_status()
        return answer.json()

    return Play(call, unique(f"outcome-{kind}"), kind, parts)


def at_once(server: Server, parts: int) -> Outcome:
    ideal = play(server, "rest", parts)
    ideal.set_up()
    return ideal.at_once()


def bridged(server: Server, folder: Path, kind: str, parts: int) -> tuple[Play, Outcome]:
    one = play(server, kind, parts)
    return one, one.over_bridge(server.url, one.set_up(), folder, TLS)


def compare(found: Outcome, ideal: Outcome) -> None:
    assert found.faults(ideal) == []
    assert found.worst <= WORST * ideal.worst
    assert found.applied


def test_no_part_of_six_tools_is_out_by_the_loops_fault(server: Server, tmp_path: Path) -> None:
    """Of one kind, and few parts; the long one goes through all."""
    _, found = bridged(server, tmp_path, "heidenhain", 6)
    compare(found, at_once(server, 6))


@pytest.mark.long
@pytest.mark.parametrize("kind", ["rest", *sorted(KINDS)])
def test_no_part_is_out_over_any_way_in(server: Server, tmp_path: Path, kind: str) -> None:
    if kind == "mqtt" and mosquitto() is None:
        pytest.skip("mosquitto is not installed")
    if kind == "rest":
        one = play(server, kind, 60)
        one.set_up()
        found = one.at_once(wait=1)
    else:
        _, found = bridged(server, tmp_path, kind, 60)
    compare(found, at_once(server, 60))


def test_a_mailbox_that_nobody_takes_is_named_for_each_tool(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The call is missing in the part program. One tool has no location: its alarm says that."""

    def nobody(self: Process) -> Steps:
        yield

    monkeypatch.setattr(Process, "take_corrections", nobody)
    one, found = bridged(server, tmp_path, "heidenhain", 9)
    assert (found.applied, found.issued > 5) == (0, True)
    age_corrections(server.database.dsn, one.machine, 50)
    clock = iter(range(0, 10_000, 240))
    watch = Watch(1800.0, 5, lambda: float(next(clock)))
    for _ in range(10):
        run_jobs(server.database, [watch.job()])
    alarms = one.call("GET", f"/alarms?state=active&machine={one.machine}")["items"]
    said = {each["tool_memory"]: each["text"] for each in alarms if each["kind"] == "corrections_not_taken"}
    pending = one.call("GET", f"/machines/{one.machine}/corrections?status=pending")["items"]
    assert sorted(said) == sorted({each["tool_memory"] for each in pending})
    assert "has no [[machine." in said.pop(UNMAPPED)
    assert said
    assert all("does not take" in text for text in said.values())
