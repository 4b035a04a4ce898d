"""The check of a configuration: what would go to the quarantine, and who does not answer."""

import asyncio
import os
import socket
import termios
from collections.abc import Sequence
from pathlib import Path
from threading import Thread

import pytest

from app.bridge import program
from app.bridge.checking import check
from app.bridge.configuration import configuration_from
from app.bridge.kinds.dprnt import PrintedLink
from app.bridge.links import Position, Received
from app.bridge.store import Store
from app.bridge.unit import ended
from app.core.printed_line import Printed, line_of
from app.core.ring import Slot, Unit
from tests.bridge.plant import until
from tests.forked import inband
from tests.loops import run
from tests.shop import Shop

SERVER = {"url": "http://127.0.0.1:9"}


def table(kind: str, **settings: object) -> dict[str, object]:
    return {
        "kind": kind,
        "unit": "inch",
        "secret": "key-of-the-machine",
        "corrections": "none",
        "characteristics": {"1": "shaft"},
        kind: settings,
    }


def findings(tmp_path: Path, machine: dict[str, object]) -> list[str]:
    content = {"server": SERVER, "machine": {"lathe-1": machine}}
    return [str(each) for each in run(check(configuration_from(content, tmp_path)))]


def test_readings_for_the_quarantine_and_remarks_are_reported(tmp_path: Path) -> None:
    lines = [line_of(Printed(7, Unit.MM, Slot(number, 1, 40.0, 0, number, 3, 0, None))) for number in (1, 2, 4)]
    file = tmp_path / "printed.txt"
    file.write_text("\n".join(lines) + "\n", encoding="ascii")
    said = findings(tmp_path, table("dprnt", file=str(file)))
    assert "✓ lathe-1: 3 readings can be fetched now" in said
    wanted = (
        "✗ lathe-1: 3 of them would go to the quarantine, the first because: The line is in mm, the configuration says"
    )
    assert [each for each in said if each.startswith(wanted)]
    assert [each for each in said if each.startswith("✗ lathe-1: Missing readings: 3.")]


def test_a_heartbeat_that_is_too_slow_is_sent_more_often_and_named(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "printed.txt").touch()
    machines = {"machine": {"lathe-1": table("dprnt", file=str(tmp_path / "printed.txt"))}}
    slow = configuration_from({"server": SERVER | {"heartbeat": 45}} | machines, tmp_path)
    good = configuration_from({"server": SERVER | {"heartbeat": 30}} | machines, tmp_path)
    assert (slow.server.heartbeat, good.server.heartbeat) == (30.0, 30.0)
    words = "server.heartbeat = 45 is more than 30: one is sent every 30 s"
    assert [words in str(each) for each in run(check(slow))][:2] == [True, False]
    assert not any("server.heartbeat" in str(each) for each in run(check(good)))

    async def work() -> None:
        store = Store(tmp_path / "store.sqlite3")
        running = asyncio.create_task(program.run(slow, store))
        await until(lambda: words in caplog.text, "the log says so")
        await ended([running])
        store.close()

    run(work())


def test_a_characteristic_of_another_machine_is_reported_as_that(shop: Shop, tmp_path: Path) -> None:
    other = Shop(shop.server)
    file = tmp_path / "printed.txt"
    file.write_text("", encoding="ascii")
    machine = table("dprnt", file=str(file)) | {"characteristics": {"1": other.characteristic}}
    machine["secret"] = shop.machine_key
    content = {"server": {"url": shop.server.url}, "machine": {shop.machine: machine}}
    said = [str(each) for each in run(check(configuration_from(content, tmp_path)))]
    assert f"✗ {shop.machine}: characteristic 1 = {other.characteristic!r} belongs to another machine" in said
    assert not [each for each in said if "refuses the key" in each]


def test_a_machine_or_a_server_that_is_silent_or_another_is_reported_with_what_to_do(tmp_path: Path) -> None:
    folder = table("folder", path=str(tmp_path), format="csv") | {"identity": "cmm-7"}
    said = findings(tmp_path, folder)
    assert [
        each
        for each in said
        if "does not answer (" in each and "Does it run, and is the address right, http or" in each
    ]
    assert [each for each in said if "answers, not 'cmm-7': look at address and network" in each]
    with socket.create_server(("127.0.0.1", 0)) as silent:
        haas = table("haas", address="127.0.0.1", port=silent.getsockname()[1]) | {"patience": 0.3}
        assert [each for each in findings(tmp_path, haas) if "is it on" in each or "has not answered" in each]


def test_an_error_of_one_machine_does_not_end_the_check_of_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def odd(link: object) -> str:
        raise termios.error(22, "Invalid argument")

    monkeypatch.setattr(PrintedLink, "connect", odd)
    machines = {"lathe-1": table("dprnt", listen=9), "cmm-1": table("folder", path=str(tmp_path), format="csv")}
    machines["cmm-1"]["secret"] = "another"
    content = {"server": SERVER, "machine": machines}
    said = [str(each) for each in run(check(configuration_from(content, tmp_path)))]
    assert [each for each in said if each.startswith("✗ lathe-1: the check of the control ended with an error")]
    assert "✓ cmm-1: 0 readings can be fetched now" in said


def test_the_rights_of_a_folder_are_tried_out_and_nothing_is_left(tmp_path: Path) -> None:
    folder = tmp_path / "watched"
    folder.mkdir()
    machine = table("folder", path=str(folder), format="csv")
    assert "✓ lathe-1: what the bridge will write there can be written" in findings(tmp_path, machine)
    assert list(folder.iterdir()) == []
    (folder / "failed").write_text("a file where the folder should be")
    said = findings(tmp_path, machine)
    assert [each for each in said if each.startswith(f"✗ lathe-1: A file cannot be written and moved in {folder}")]
    assert [path.name for path in folder.iterdir()] == ["failed"]


def test_nothing_is_tried_out_beside_a_bridge_that_runs(tmp_path: Path) -> None:
    folder = tmp_path / "watched"
    folder.mkdir()
    store = Store(tmp_path / "inband-bridge.sqlite3")
    with store.alone():
        said = findings(tmp_path, table("folder", path=str(folder), format="csv"))
    store.close()
    assert "✓ lathe-1: a bridge runs with this store, so nothing was tried out that writes" in said


def test_the_check_takes_no_line_from_a_bridge_that_runs(tmp_path: Path) -> None:
    with (
        socket.create_server(("127.0.0.1", 0)) as printing,
        Store(tmp_path / "inband-bridge.sqlite3").alone(),
    ):
        machine = table("dprnt", connect=f"127.0.0.1:{printing.getsockname()[1]}")
        said = findings(tmp_path, machine)
        assert [each for each in said if each.startswith("✓ lathe-1: a bridge runs with this store and reads here")]
        printing.setblocking(False)
        with pytest.raises(BlockingIOError):
            printing.accept()


def test_lines_that_the_check_itself_has_taken_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fetch = PrintedLink.fetch

    async def arrived(link: PrintedLink, stored: Position) -> Sequence[Received]:
        while True:
            if found := await fetch(link, stored):
                return found
            await asyncio.sleep(0.01)

    monkeypatch.setattr(PrintedLink, "fetch", arrived)
    with socket.create_server(("127.0.0.1", 0)) as printing:

        def prints() -> None:
            there, _ = printing.accept()
            with there:
                there.sendall(f"{line_of(Printed(7, Unit.INCH, Slot(1, 1, 1.5, 0, 1, 3, 0, None)))}\r\n".encode())
                there.recv(1)

        thread = Thread(target=prints)
        thread.start()
        said = findings(tmp_path, table("dprnt", connect=f"127.0.0.1:{printing.getsockname()[1]}"))
        thread.join()
    assert [each for each in said if each.startswith("✗ lathe-1: 1 readings can be fetched now, and are gone")]


def test_a_store_that_this_user_may_not_write_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "access", lambda *_: False)
    said = findings(tmp_path, table("dprnt", listen=9))
    assert said[0].startswith(f"✗ store {tmp_path / 'inband-bridge.sqlite3'}: this user may not write {tmp_path};")


@pytest.mark.parametrize(("size", "url", "words"), [
    ("-0.002", None, "x: every size lies more than 1 mm (R36) from the target 40 mm, the first in line 2 with -0.002 mm."),
    ("40.001", None, ""),
    ("40.001", SERVER["url"], "The sizes are not compared with their targets"),
])  # fmt: skip
def test_a_preview_compares_sizes_with_their_targets(
    shop: Shop, tmp_path: Path, size: str, url: str | None, words: str
) -> None:
    key = shop.another("seat", target=40.0, confidence_limit=1.0)
    (tmp_path / "a.csv").write_text(f"measured;part\n{size};P1\n")
    config = tmp_path / "plant.toml"
    config.write_text(
        f'server.url = "{url or shop.server.url}"\n[machine.{shop.machine}]\nkind = "folder"\nunit = "mm"\n'
        f'secret = "{shop.machine_key}"\ncorrections = "none"\nfolder = {{ path = "{tmp_path}", format = "csv" }}\n'
        f'characteristics = {{ "*" = "{key}" }}\n'
    )
    done = inband("bridge", "preview", shop.machine, tmp_path / "a.csv", "--config", config)
    said = done.stdout + done.stderr
    assert done.returncode == (size == "-0.002")
    assert words.replace("x:", f"{key}:") in " ".join(said.split())
    assert ("not compared" in said) == (url is not None)
