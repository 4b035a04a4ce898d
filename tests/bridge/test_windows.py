"""The bridge where modules and calls fail as on Windows: `tests.as_on_windows`. Nobody has run it on Windows itself."""

import asyncio
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from app.bridge.loops import run_selecting
from tests.loops import in_thread
from tests.shop import Shop
from tests.waits import until

PLANT = """
[server]
url = "{url}"
[store]
file = "bridge.sqlite3"
[machine.{machine}]
kind = "folder"
unit = "mm"
secret = "{key}"
corrections = "none"
[machine.{machine}.folder]
path = '{folder}'
format = "csv"
zone = "Europe/Belgrade"
every = 0.1
[machine.{machine}.characteristics]
D40 = "{characteristic}"
"""


def plant(shop: Shop, folder: Path) -> Path:
    """A configuration, and a file that waits to be fetched."""
    (folder / "cmm").mkdir()
    (folder / "cmm" / "part.csv").write_text("characteristic;measured;measured_at\nD40;40.006;23.11.2026 06:05:00\n")
    file = folder / "plant.toml"
    key = shop.server.key(machine=shop.machine)
    file.write_text(
        PLANT.format(
            url=shop.server.url,
            machine=shop.machine,
            key=key,
            folder=folder / "cmm",
            characteristic=shop.characteristic,
        )
    )
    return file


def stored(shop: Shop) -> list[float]:
    found = shop.admin.get("/api/v1/readings", params={"characteristic": shop.characteristic}).json()["items"]
    return [each["measured"] for each in found]


def test_every_module_is_imported_and_a_reading_arrives_and_ctrl_c_ends_it(shop: Shop, tmp_path: Path) -> None:
    rooms = "app.bridge,app.simulators.controls"
    command = [sys.executable, "-m", "tests.as_on_windows", rooms, "bridge", "--config", str(plant(shop, tmp_path))]
    with (tmp_path / "log").open("w") as log:
        bridge = subprocess.Popen(command, stderr=log)
    try:
        until(lambda: stored(shop) or bridge.poll() is not None, 180)  # it imports everything first
        assert stored(shop) == [40.006], (tmp_path / "log").read_text()
        until((tmp_path / "cmm" / "done" / "part.csv").exists)
        bridge.send_signal(signal.SIGINT)
        assert bridge.wait(60) == 0, (tmp_path / "log").read_text()
    finally:
        bridge.kill()
        bridge.wait()
    assert "Traceback" not in (tmp_path / "log").read_text()


def test_its_loop_waits_for_sockets_of_libraries_whatever_loop_the_system_prefers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class Proactor(asyncio.SelectorEventLoop):
        """As Windows' own: `add_reader` is what aiomqtt needs of a loop."""

        def add_reader(self, *_: object) -> None:
            raise NotImplementedError

    monkeypatch.setattr(asyncio, "new_event_loop", Proactor)
    monkeypatch.setattr(asyncio.events, "new_event_loop", Proactor)

    async def work() -> type:
        return type(asyncio.get_running_loop())

    assert in_thread(lambda: asyncio.run(work())) is Proactor
    assert in_thread(lambda: run_selecting(work())) is asyncio.SelectorEventLoop
