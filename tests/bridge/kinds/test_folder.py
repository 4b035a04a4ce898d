"""Folders of measuring machines: files that are half there, locked, empty, delivered twice, or that cannot be moved."""

import asyncio
import json
import os
import threading
import time
from pathlib import Path
from typing import Any

import msgspec
import pytest

from app.bridge.configuration import ConfigurationError
from app.bridge.file_content import Content, read_content
from app.bridge.file_rows import Fault
from app.bridge.kinds import folder
from app.bridge.kinds.folder import Folder
from app.bridge.links import ControlAway, Decided, Misconfigured, Position, Received, carries_decisions
from app.simulators.controls.folder import FolderSimulator
from app.simulators.controls.model import Model
from tests.bridge.kinds.measured_folder import HEAD, LINE, fetching, machine, read, sizes, write
from tests.bridge.kinds.test_folder_lines import DESCRIPTION, VALUES
from tests.bridge.plant import PATIENCE, store_in, until
from tests.loops import run


def test_a_file_is_stored_once_and_moved_then(tmp_path: Path) -> None:
    async def work() -> None:
        store = store_in(tmp_path / "store")
        inbox = tmp_path / "in"
        inbox.mkdir()
        async with fetching(machine(inbox), store):
            write(inbox / "a.csv", HEAD + LINE)
            await until((inbox / "done" / "a.csv").exists, "the first file is done")
            write(inbox / "a.csv", HEAD + LINE)
            await until((inbox / "done" / "a-2.csv").exists, "the same file again is done")
            write(inbox / "b.csv", HEAD + LINE)
            await until((inbox / "done" / "b.csv").exists, "the same under another name is done")
        assert await sizes(store) == [40.0123]
        store.close()

    run(work())


def test_nothing_is_moved_before_it_is_stored(tmp_path: Path) -> None:
    async def work() -> None:
        link = Folder(machine(tmp_path))
        path = write(tmp_path / "a.csv", HEAD + LINE)
        assert await link.connect() == str(tmp_path)
        received = await link.fetch(Position())
        assert [each.body["measured"] for each in received] == [40.0123]
        assert path.exists()
        assert not (tmp_path / "done").exists()
        await link.acknowledge(received)
        assert not path.exists()
        await link.close()

    run(work())


def test_a_file_that_cannot_be_read_fails_as_a_whole_and_says_why(tmp_path: Path) -> None:
    async def work() -> None:
        store = store_in(tmp_path / "store")
        async with fetching(machine(tmp_path), store):
            write(tmp_path / "a.csv", HEAD + LINE + LINE.replace("40,0123", "forty"))
            await until((tmp_path / "failed" / "a.csv").exists, "the file has failed")
            assert await store.waiting("cmm-1") == []
            [refused] = await store.quarantine("cmm-1")
            assert "line 3, actual: 'forty' is not a number" in refused.reason
            why = (tmp_path / "failed" / "a.csv.why.txt").read_text(encoding="utf-8")
            assert "line 3, actual: 'forty'" in why
            assert str(tmp_path) in why
            (tmp_path / "failed" / "a.csv").unlink()
            write(tmp_path / "a.csv", HEAD + LINE + LINE)  # put right
            await until((tmp_path / "done" / "a.csv").exists, "the file is done")
        assert await sizes(store) == [40.0123, 40.0123]
        store.close()

    run(work())


def test_a_reason_of_many_lines_is_said_once_and_that_of_the_whole_file_first(tmp_path: Path) -> None:
    rows = [*["23.11.2026 06:05:00;P1;D40;forty\n"] * 30, "23.11.2026 06:05:00;P1;D99;1\n" * 2, LINE.strip()]
    content = read(tmp_path, HEAD + "".join(rows))
    content.faults.append(Fault(None, "", "The file is too old."))
    seen = folder.Seen((tmp_path / "a.csv",), ((1, 1),))
    [first, second, third] = [line for line in folder._why(seen, content, tmp_path).splitlines() if line[:2] == "- "]
    assert first == "- The file is too old."
    assert second.startswith("- lines 2, 3, 4 and 27 more, actual: 'forty' is not a number")
    assert third.startswith("- lines 32, 33: 'D99' is not named in machine.cmm-1.characteristics")
    [refused] = content.received("cmm-1", "a.csv")
    assert str(refused.fault).endswith("The file is too old. (and 2 more)")


def test_a_file_that_is_being_written_is_waited_for(tmp_path: Path) -> None:
    """Cut in the middle of a number, with its size unchanged over several looks: never 40.0 in place of 40.0123."""

    async def work() -> None:
        chosen = machine(tmp_path, settle=3600.0)
        link = Folder(chosen)
        whole = HEAD + LINE
        path = write(tmp_path / "a.csv", whole[:-4])
        await link.connect()
        for _ in range(4):
            assert await link.fetch(Position()) == []
            await asyncio.sleep(0.06)
        write(path, whole)
        received = await fetched(link)
        assert [each.body["measured"] for each in received] == [40.0123]
        await link.close()

    run(work())


def test_later_files_wait_for_one_that_is_being_written(tmp_path: Path) -> None:
    """Readings come in the order in which they were measured; a file that is never whole holds nothing up for long."""

    async def work() -> None:
        link = Folder(machine(tmp_path, settle=3600.0))
        write(tmp_path / "a.csv", HEAD + LINE[:-4])
        write(tmp_path / "b.csv", HEAD + LINE.replace("P1", "P2"))
        os.utime(tmp_path / "b.csv", (time.time() + 1, time.time() + 1))
        await link.connect()
        for _ in range(4):
            assert await link.fetch(Position()) == []
            await asyncio.sleep(0.06)
        write(tmp_path / "a.csv", HEAD + LINE)
        os.utime(tmp_path / "a.csv", (time.time() - 1, time.time() - 1))
        parts = []
        for _ in range(2):
            received = await fetched(link)
            parts += [each.body["part"] for each in received]
            await link.acknowledge(received)
        assert parts == ["P1", "P2"]
        await link.close()
        link = Folder(machine(tmp_path, settle=0.3))
        await link.connect()
        for number in range(40):  # a file that grows all the time, with an old time of modification
            write(tmp_path / "log.csv", HEAD + LINE[:-4] + "0" * number)
            os.utime(tmp_path / "log.csv", (1, 1))
            if number == 1:
                write(tmp_path / "d.csv", HEAD + LINE.replace("P1", "P3"))
            if found := await link.fetch(Position()):
                break
            await asyncio.sleep(0.06)
        assert [each.body["part"] for each in found] == ["P3"]
        await link.close()

    run(work())


async def fetched(link: Folder) -> list[Received]:
    found: list[Received] = []

    async def some() -> bool:
        found.extend(await link.fetch(Position()))
        return bool(found)

    await until(some, "readings")
    return found


def test_empty_files_and_single_halves_of_a_pair_fail_after_a_time(tmp_path: Path) -> None:
    async def work() -> None:
        store = store_in(tmp_path / "store")
        chosen = machine(tmp_path, format="aqdef", empty_after=0.5, names={"D40": "shaft-1", "D20": "bore-1"})
        async with fetching(chosen, store):
            write(tmp_path / "pair.dfx", VALUES)
            write(tmp_path / "pair.DFD", DESCRIPTION)
            await until((tmp_path / "done" / "pair.dfx").exists, "the pair is done")
            assert (tmp_path / "done" / "pair.DFD").exists()
            write(tmp_path / "empty.dfq", "")
            write(tmp_path / "single.dfx", VALUES)
            await until((tmp_path / "failed" / "empty.dfq").exists, "the empty file has failed")
            await until((tmp_path / "failed" / "single.dfx").exists, "the single file has failed")
        reasons = " ".join(each.reason for each in await store.quarantine("cmm-1"))
        assert "The file is empty" in reasons
        assert "one file is missing" in reasons
        assert await sizes(store) == [40.0123, 20.02, 20.021]
        store.close()

    run(work())


def test_a_file_that_has_grown_since_it_was_stored_is_not_moved_unread(tmp_path: Path) -> None:
    async def work() -> None:
        store = store_in(tmp_path / "store")
        link = Folder(machine(tmp_path))
        path = write(tmp_path / "a.csv", HEAD + LINE)
        await link.connect()
        received = await link.fetch(Position())
        await store.add("cmm-1", received)
        write(path, HEAD + LINE + LINE.replace("P1", "P2"))
        await link.acknowledge(received)
        assert path.exists()
        again = await fetched(link)
        await store.add("cmm-1", again)
        await link.acknowledge(again)
        assert not path.exists()
        assert [row.body["part"] for row in await store.waiting("cmm-1")] == ["P1", "P2"]
        await link.close()
        store.close()

    run(work())


def test_a_file_that_goes_on_growing_brings_its_new_lines_only(tmp_path: Path) -> None:
    """Nothing tells its readings apart but the file, and the bridge has not moved it yet."""

    async def work() -> None:
        store = store_in(tmp_path / "store")
        columns = {"measured": "actual", "characteristic": "feature"}
        link = Folder(machine(tmp_path, columns=columns))
        text = "feature;actual\n"
        await link.connect()
        for size in ("40,01", "40,02", "40,02"):
            text += f"D40;{size}\n"
            path = write(tmp_path / "a.csv", text)
            received = await fetched(link)
            await store.add("cmm-1", received)
            write(path, text + "D40;40,03\n")  # before it can be moved
            await link.acknowledge(received)
        again = await fetched(link)
        await store.add("cmm-1", again)
        await link.acknowledge(again)
        assert await sizes(store) == [40.01, 40.02, 40.02, 40.03]
        write(tmp_path / "a.csv", text)  # another file under the same name
        await store.add("cmm-1", await fetched(link))
        assert len(await sizes(store)) == 7
        await link.close()
        store.close()

    run(work())


def test_a_file_that_takes_longer_than_a_call_is_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read_in_time, began, go_on = read_content, [], threading.Event()

    def slow(*given: Any) -> Content:
        began.append(given)
        go_on.wait(PATIENCE)
        return read_in_time(*given)

    monkeypatch.setattr(folder, "read_content", slow)

    async def work() -> None:
        store = store_in(tmp_path / "store")
        write(tmp_path / "a.csv", HEAD + LINE)
        async with fetching(msgspec.structs.replace(machine(tmp_path), patience=0.3), store) as unit:
            await until(lambda: "a.csv is still being read" in unit.detail, "the bridge says so")
            go_on.set()
            await until((tmp_path / "done" / "a.csv").exists, "the file is done")
        assert await sizes(store) == [40.0123]
        assert len(began) == 1
        store.close()

    run(work())


def test_a_folder_that_is_away_is_reported_and_comes_back(tmp_path: Path) -> None:
    async def work() -> None:
        store = store_in(tmp_path / "store")
        inbox = tmp_path / "in"
        async with fetching(machine(inbox), store) as unit:
            await until(lambda: "is the share mounted" in unit.detail, "the bridge says so")
            assert unit.state == "control_away"
            inbox.mkdir()
            write(inbox / "a.csv", HEAD + LINE)
            await until((inbox / "done" / "a.csv").exists, "the file is done")
        store.close()

    run(work())


def test_a_file_in_the_folder_names_it(tmp_path: Path) -> None:
    async def work() -> None:
        write(tmp_path / "inband-identity.txt", "CMM-4711\n")
        link = Folder(machine(tmp_path))
        assert await link.connect() == "CMM-4711"
        await link.close()

    run(work())


def test_files_that_cannot_be_moved_hold_up_no_others_and_are_reported(tmp_path: Path) -> None:
    async def work() -> None:
        write(tmp_path / "done", "a file where the folder should be")
        link = Folder(machine(tmp_path))
        await link.connect()
        for name in ("a.csv", "b.csv"):
            write(tmp_path / name, HEAD + LINE.replace("P1", name))
        parts = set()
        for _ in range(2):
            received = await fetched(link)
            parts.add(received[0].body["part"])
            await link.acknowledge(received)
        assert parts == {"a.csv", "b.csv"}
        with pytest.raises(Misconfigured, match=r"is stored, but cannot be moved"):
            await fetched(link)
        (tmp_path / "done").unlink()
        await asyncio.sleep(0.06)
        await link.fetch(Position())
        assert {path.name for path in (tmp_path / "done").iterdir()} == parts
        await link.close()

    run(work())


TEMPERATURES = {"characteristic": "feature", "measured": "actual", "part": "part", "part_temperature": "temp"}


def test_a_temperature_that_is_left_out_is_logged_once_and_reported_until_a_good_one_comes(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    head = "feature;actual;part;temp\n"
    words = "File a.csv, lines 2, 3, temp: '21.5' is not a number of °C, with decimal = \",\"; left out."

    async def work() -> None:
        store = store_in(tmp_path)
        watched = tmp_path / "watched"
        watched.mkdir()

        def measure(name: str, *lines: str) -> None:
            write(watched / name, "\n".join([head.strip(), *lines, ""]))

        async with fetching(machine(watched, columns=TEMPERATURES), store) as unit:
            measure("a.csv", "D40;40,0123;P1;21.5", "D40;40,0124;P2;21.6", "D40;40,0125;P3;21,7")
            await until(lambda: unit.detail == words, "the temperature is named")
            measure("b.csv", "D40;40,0126;P4;")
            await until((watched / "done" / "b.csv").exists, "a file without a temperature")
            assert unit.detail == words
            measure("c.csv", "D40;40,0127;P5;21,8")
            await until(lambda: not unit.detail, "a good temperature")
        assert len(await sizes(store)) == 5
        store.close()

    with caplog.at_level("INFO"):
        run(work())
    assert sum(words in each.getMessage() for each in caplog.records) == 1


SECRET = "inband_the-key-of-the-machine;x\nmore;of it\n"


def test_links_are_neither_read_nor_quoted_and_files_beside_them_are_taken(tmp_path: Path) -> None:
    async def work() -> None:
        watched = tmp_path / "watched"
        watched.mkdir()
        secret = write(tmp_path / "m.key", SECRET)
        (watched / "p_k.csv").symlink_to(secret)
        (watched / "inband-identity.txt").symlink_to(secret)
        os.mkfifo(watched / "pipe.csv")
        write(watched / "a.csv", HEAD + LINE)
        link = Folder(machine(watched))
        with pytest.raises(Misconfigured) as caught:
            await link.connect()
        assert "inband_" not in str(caught.value)
        (watched / "inband-identity.txt").unlink()
        await link.connect()
        received = await fetched(link)
        assert [each.body["part"] for each in received] == ["P1"]
        assert "p_k.csv is a link, which is not followed" in link.remark
        await link.acknowledge(received)
        assert [path.name for path in (watched / "done").iterdir()] == ["a.csv"]
        assert (watched / "p_k.csv").is_symlink()
        await link.close()

    run(work())


@pytest.mark.parametrize("other", ["link", "pipe"])
def test_a_file_that_becomes_a_link_or_a_pipe_before_it_is_opened_is_not_read(tmp_path: Path, other: str) -> None:
    secret = write(tmp_path / "m.key", SECRET)
    watched = tmp_path / "watched"
    watched.mkdir()
    file = write(watched / "a.csv", HEAD + LINE)
    link = Folder(machine(watched))
    [seen] = link._files()
    file.unlink()
    if other == "link":
        file.symlink_to(secret)
    else:
        os.mkfifo(file)
    assert link._read(seen, unchanged=1000.0) is None


def test_the_reason_of_a_failed_file_is_not_written_through_a_link(tmp_path: Path) -> None:
    async def work() -> None:
        watched = tmp_path / "watched"
        (watched / "failed").mkdir(parents=True)
        victim = write(tmp_path / "victim", "untouched")
        (watched / "failed" / "a.csv.why.txt").symlink_to(victim)
        write(watched / "a.csv", HEAD + LINE.replace("40,0123", "x"))
        link = Folder(machine(watched))
        await link.connect()
        await link.acknowledge(await fetched(link))
        assert "'x' is not a number" in (watched / "failed" / "a.csv.why.txt").read_text()
        assert victim.read_text() == "untouched"
        (watched / "failed" / "a.csv").unlink()
        (watched / "failed").rename(tmp_path / "elsewhere")
        (watched / "failed").symlink_to(tmp_path / "elsewhere")
        write(watched / "b.csv", HEAD + LINE.replace("40,0123", "y"))
        await link.acknowledge(await fetched(link))
        assert (watched / "b.csv").exists()
        with pytest.raises(Misconfigured, match=r"failed is a link"):
            await fetched(link)
        await link.close()

    run(work())


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read every file")
def test_a_locked_file_is_reported_after_a_while(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.bridge.kinds.folder.LOCKED_FOR", 0.0)

    async def work() -> None:
        write(tmp_path / "a.csv", HEAD + LINE).chmod(0)
        link = Folder(machine(tmp_path))
        await link.connect()
        with pytest.raises(ControlAway, match=r"a\.csv cannot be read"):
            await fetched(link)
        (tmp_path / "a.csv").chmod(0o600)
        assert len(await fetched(link)) == 1
        await link.close()

    run(work())


def test_every_part_of_the_simulated_machine_arrives_once(tmp_path: Path) -> None:
    """With halves and repeats, and the bridge cut and begun anew in between."""

    async def work() -> None:
        store = store_in(tmp_path / "store")
        model = Model()
        inbox = tmp_path / "in"
        simulator = FolderSimulator(model, inbox, pause=0.2)
        await simulator.start()
        table = simulator.table()
        settings: Any = table["folder"]
        chosen = machine(inbox, names={"D1": "shaft-1"}, **settings | {"every": 0.05, "settle": 3600.0})
        parts = 15
        for _ in range(3):
            async with fetching(chosen, store):
                for _ in range(parts // 3):
                    for _ in model.part():
                        await asyncio.sleep(0.01)
                await asyncio.sleep(0.2)
        async with fetching(chosen, store):
            await until(lambda: simulator.files == parts and not list(inbox.glob("*.csv")), "every file is moved")
        await simulator.stop()
        rows = await store.waiting("cmm-1", 1000)
        assert sorted(row.body["part"] for row in rows) == sorted(f"P{number}" for number in range(1, parts + 1))
        assert sorted(row.body["measured"] for row in rows) == pytest.approx(sorted(model.truth().values()))
        assert not (inbox / "failed").exists()
        store.close()

    run(work())


def test_a_stop_that_could_not_be_written_is_found_before(tmp_path: Path) -> None:
    place = tmp_path / "andon" / "stop.json"
    link = Folder(machine(tmp_path, decisions=str(place)))
    [wrong] = run(link.try_out())
    assert f"cannot be written to {place}" in wrong
    place.parent.mkdir()
    assert run(link.try_out()) == []
    assert list(place.parent.iterdir()) == []


def test_a_stop_lies_in_a_file_until_somebody_removes_it(tmp_path: Path) -> None:
    place = tmp_path / "cell" / "decision.json"
    place.parent.mkdir()

    def told(*actions: str) -> str | None:
        run(link.decide([Decided(f"k{n}", "shaft-1", action, "x") for n, action in enumerate(actions)]))
        return json.loads(place.read_text())["action"] if place.exists() else None

    link = Folder(machine(tmp_path, decisions=str(place)))
    assert carries_decisions(link)
    assert [told("none"), told("hold"), told("none", "stop", "hold"), told("hold")] == [None, "hold", "stop", "stop"]
    assert json.loads(place.read_text()).keys() == {"key", "characteristic", "action", "reason"}
    place.unlink()
    assert told("hold") == "hold"
    assert not carries_decisions(Folder(machine(tmp_path)))
    with pytest.raises(ConfigurationError, match="in another folder than path"):
        machine(tmp_path, decisions=str(tmp_path / "decision.json"))
