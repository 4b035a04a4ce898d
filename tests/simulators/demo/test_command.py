"""`inband demo` as a person starts it, and as they end it."""

import re
import signal
from collections.abc import Callable
from pathlib import Path

import httpx
import pytest

from tests.databases import NewDatabase, drop_database
from tests.forked import Forked
from tests.servers import TLS, Process, begun, free_port, wait_ready
from tests.waits import until


def signed_in(port: int, log: Path, before: list[int]) -> list[int]:
    """Sign in with what is printed, see readings come, those of the bridged machine too; how many there are of both."""
    found = re.search(r"engineer\s+(\S{14})", log.read_text())
    assert found, log.read_text()
    with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=60, verify=TLS) as client:
        body = {"name": "engineer", "password": found[1]}
        assert client.post("/sign-in", data=body).is_redirect

        def newest(characteristic: str) -> int:
            answer = client.get("/api/v1/readings", params={"characteristic": characteristic, "limit": 1000})
            return max((each["sequence"] for each in answer.json()["items"]), default=0) if answer.is_success else 0

        def both() -> list[int]:
            return [newest("plate-d30"), newest("spigot-d30")]

        until(lambda: all(now > then for now, then in zip(both(), before, strict=True)), 120)
        return both()


@pytest.mark.parametrize(
    ("start", "ends"),
    [
        (Forked, [signal.SIGTERM]),
        pytest.param(begun, [signal.SIGTERM, signal.SIGINT], marks=pytest.mark.long),
    ],
)
def test_it_prints_how_to_sign_in_runs_and_ends_in_order_and_the_second_start_goes_on(
    new_database: NewDatabase,
    tmp_path: Path,
    start: Callable[[list[str], Path], Process],
    ends: list[signal.Signals],
) -> None:
    port, url = free_port(), new_database()
    command = ["demo", "--bridge", "--port", str(port), "--database-url", url, "--data-dir", str(tmp_path / "data")]
    said, newest = set[tuple[str, ...]](), [0, 0]
    for how in ends:
        log = tmp_path / how.name
        process = start(command, log)
        try:
            wait_ready(f"http://127.0.0.1:{port}", process, log)
            newest = signed_in(port, log, newest)
            process.send_signal(how)
            assert process.wait(60) in {0, 130}
        finally:
            process.kill()
            process.wait()
        assert "Traceback" not in log.read_text()
        assert "PostgreSQL has ended" not in log.read_text()
        said.add(tuple(re.findall(r"(?:engineer|operator|admin)\s+\S{14}", log.read_text())))
    (passwords,) = said  # the second start prints the same
    assert len(passwords) == 3
    drop_database(url)
