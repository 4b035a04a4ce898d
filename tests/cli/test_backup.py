"""A backup is restored whole, and never over existing data."""

import os
import stat
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import psycopg
import pytest

from app import HOUSE
from app.db import migrate
from tests.conftest import NewDatabase, Server, drop_database, in_database
from tests.db.first_program import make_first_program
from tests.shop import Shop

Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def inband() -> Run:
    def run(*words: object, expect: int = 0) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "app", *map(str, words)]
        done = subprocess.run(command, cwd=HOUSE, capture_output=True, text=True, env=dict(os.environ))
        assert done.returncode == expect, done.stderr
        return done

    return run


def test_a_backup_of_a_running_server_comes_back_whole(
    server: Server, postgres: str, inband: Run, tmp_path: Path
) -> None:
    shop = Shop(server)
    shop.read(6.1, key="part-1")
    file, empty = tmp_path / "inband.dump", in_database(postgres, "restored_backup")
    inband("backup", file, "--database-url", server.database.dsn)
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    with psycopg.connect(postgres, autocommit=True) as connection:
        connection.execute("CREATE DATABASE restored_backup")
    try:
        inband("restore", file, "--database-url", empty)
        readings = "SELECT measured, key, correction FROM reading"
        with psycopg.connect(server.database.dsn) as before, psycopg.connect(empty) as after:
            assert after.execute(readings).fetchall() == before.execute(readings).fetchall() == [(40.0061, "part-1", 1)]
        entries = "SELECT action, subject, after ->> 'file' FROM audit_entry WHERE action LIKE 'backup %' ORDER BY id"
        made, restored = ((f"backup {what}", "database", "inband.dump") for what in ("made", "restored"))
        with psycopg.connect(server.database.dsn) as before, psycopg.connect(empty) as after:
            assert before.execute(entries).fetchall() == [made]
            assert after.execute(entries).fetchall() == [restored], "a backup is noted after it is made"
        again = inband("restore", file, "--database-url", empty, expect=1)
        assert "empty one only" in again.stderr
    finally:
        drop_database(empty)


def test_a_backup_of_the_first_program_is_made_and_comes_back_at_the_head(
    new_database: NewDatabase, inband: Run, tmp_path: Path
) -> None:
    file, old, empty = tmp_path / "inband.dump", new_database(), new_database()
    make_first_program(old)
    with psycopg.connect(empty, autocommit=True) as connection:
        connection.execute("DROP SCHEMA public CASCADE")
        connection.execute("CREATE SCHEMA public")
    assert "not in the record of changes" in inband("backup", file, "--database-url", old).stderr
    assert migrate.current(old) == migrate.SQUASHED
    inband("restore", file, "--database-url", empty)
    assert migrate.current(empty) == migrate.head()
    readings = "SELECT sequence, measured, correction FROM reading ORDER BY sequence"
    with psycopg.connect(old) as before, psycopg.connect(empty) as after:
        assert after.execute(readings).fetchall() == before.execute(readings).fetchall() != []


def test_a_backup_replaces_no_file(server: Server, inband: Run, tmp_path: Path) -> None:
    file = tmp_path / "inband.dump"
    file.write_text("an older backup")
    refused = inband("backup", file, "--database-url", server.database.dsn, expect=1)
    assert "is there already" in refused.stderr
    assert file.read_text() == "an older backup"


def test_a_backup_that_fails_leaves_nothing_half_done(server: Server, inband: Run, tmp_path: Path) -> None:
    nowhere = in_database(server.database.dsn, "no_such_database")
    refused = inband("backup", tmp_path / "inband.dump", "--database-url", nowhere, expect=1)
    assert "no_such_database" in refused.stderr
    assert list(tmp_path.iterdir()) == []


def test_what_is_no_backup_is_refused_in_words(inband: Run, tmp_path: Path) -> None:
    refused = inband("restore", tmp_path / "nothing.dump", expect=1)
    assert "There is no file" in refused.stderr
