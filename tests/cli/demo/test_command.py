"""`inband demo` as a person starts it, and as they end it."""

import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import httpx
import pytest

from app import HOUSE
from tests.conftest import NewDatabase, free_port, wait_ready


def begin(port: int, url: str, folder: Path, log: Path) -> "subprocess.Popen[bytes]":
    with log.open("wb") as file:
        process = subprocess.Popen(
            [
                sys.executable,
                "-m",
                "app",
                "demo",
                "--bridge",
                "--port",
                str(port),
                "--database-url",
                url,
                "--data-dir",
                str(folder),
            ],
            cwd=HOUSE,
            stdout=subprocess.DEVNULL,
            stderr=file,
            stdin=subprocess.DEVNULL,
        )
    wait_ready(f"http://127.0.0.1:{port}", process, log)
    return process


def signed_in(port: int, log: Path) -> None:
    """Sign in with what is printed, and see readings come, those of the bridged machine too."""
    found = re.search(r"engineer\s+(\S{14})", log.read_text())
    assert found, log.read_text()
    with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=10) as client:
        body = {"name": "engineer", "password": found[1]}
        assert client.post("/sign-in", data=body).is_redirect
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:
            answer = client.get("/api/v1/readings", params={"characteristic": "plate-d30", "limit": 50})
            bridged = client.get("/api/v1/readings", params={"characteristic": "spigot-d30"})
            if (
                answer.is_success
                and len(answer.json()["items"]) == 50
                and bridged.is_success
                and bridged.json()["items"]
            ):
                return
            time.sleep(0.2)
    pytest.fail(log.read_text())


def test_it_prints_how_to_sign_in_runs_and_ends_in_order_and_the_second_start_goes_on(
    new_database: NewDatabase, tmp_path: Path
) -> None:
    port, url, log = free_port(), new_database(), tmp_path / "log"
    said = []
    for how in (signal.SIGTERM, signal.SIGINT):
        process = begin(port, url, tmp_path / "data", log)
        try:
            signed_in(port, log)
            process.send_signal(how)
            assert process.wait(20) in {0, 130}
        finally:
            process.kill()
            process.wait()
        assert "Traceback" not in log.read_text()
        assert "PostgreSQL has ended" not in log.read_text()
        said.append(re.findall(r"(?:engineer|operator|admin)\s+\S{14}", log.read_text()))
    assert len(said[0]) == 3
    assert said[0] == said[1], "the second start prints the same passwords"
