"""A disk that fills up is told of before it is full."""

import logging
from pathlib import Path

import pytest

from app.db import disk
from app.db.engine import Database
from tests.conftest import NewDatabase
from tests.loop.readings.importing.test_commands import inband


def test_a_disk_with_room_is_no_matter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(disk, "LEAST", 1)
    assert disk.shortage(tmp_path / "not" / "there" / "yet") is None


def test_one_that_is_nearly_full_is_warned_of_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    class Enough(Exception):
        """Ends the watch, which goes on for ever."""

    looks: list[float] = []

    def sleep(seconds: float) -> None:
        looks.append(seconds)
        if len(looks) == 3:
            raise Enough

    monkeypatch.setattr(disk, "LEAST", 2**62)
    monkeypatch.setattr("app.db.disk.time.sleep", sleep)
    with caplog.at_level(logging.WARNING), pytest.raises(Enough):
        disk._watch(tmp_path)
    (line,) = caplog.messages
    assert f"The disk of {tmp_path} is nearly full" in line
    assert "Make room" in line


def test_check_says_so_and_fails(new_database: NewDatabase, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    database = Database(new_database(), pool_size=1)
    done = inband("check", database=database, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "GB free" in done.stderr
    monkeypatch.setattr(disk, "LEAST", 2**62)
    full = inband("check", database=database, folder=tmp_path)
    assert full.returncode == 1
    assert "nearly full" in full.stderr
    assert "none to run" in full.stderr
    database.close()
