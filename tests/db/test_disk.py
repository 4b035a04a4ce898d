"""A disk that fills up is told of before it is full."""

import contextlib
import logging
import sys
from pathlib import Path

import pytest

from app.cli import main
from app.db import disk
from tests.databases import NewDatabase


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


def test_check_says_so_and_fails(
    new_database: NewDatabase, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["inband", "check", "--database-url", new_database()])
    with contextlib.suppress(SystemExit):
        main()
    assert "GB free" in capfd.readouterr().err
    monkeypatch.setattr(disk, "LEAST", 2**62)
    with pytest.raises(SystemExit) as full:
        main()
    assert full.value.code == 1
    said = capfd.readouterr().err
    assert "nearly full" in said
    assert "none to run" in said
