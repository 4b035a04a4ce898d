"""A backup is restored whole, and never over existing data."""

import stat
from functools import partial
from pathlib import Path

import psycopg

from app.db import migrate
from tests import forked
from tests.databases import in_database
from tests.servers import RunServer
from tests.shop import Shop

inband = partial(forked.inband, expect=0)


def test_a_backup_of_a_running_server_comes_back_whole(
    run_server: RunServer, empty_database: str, tmp_path: Path
) -> None:
    file = tmp_path / "inband.dump"
    with run_server() as server:
        Shop(server).read(6.1, key="part-1")
        inband("backup", file, "--database-url", server.database.dsn)
        assert stat.S_IMODE(file.stat().st_mode) == 0o600
        inband("restore", file, "--database-url", empty_database)
        readings = "SELECT measured, key, correction FROM reading"
        entries = "SELECT action, subject, after ->> 'file' FROM audit_entry WHERE action LIKE 'backup %' ORDER BY id"
        made, restored = ((f"backup {what}", "database", "inband.dump") for what in ("made", "restored"))
        with psycopg.connect(server.database.dsn) as before, psycopg.connect(empty_database) as after:
            assert after.execute(readings).fetchall() == before.execute(readings).fetchall() == [(40.0061, "part-1", 1)]
            assert before.execute(entries).fetchall() == [made]
            assert after.execute(entries).fetchall() == [restored], "a backup is noted after it is made"
    again = inband("restore", file, "--database-url", empty_database, expect=1)
    assert "empty one only" in again.stderr


def test_a_backup_of_the_first_program_is_made_and_comes_back_at_the_head(
    first_program: str, empty_database: str, tmp_path: Path
) -> None:
    file = tmp_path / "inband.dump"
    assert "not in the record of changes" in inband("backup", file, "--database-url", first_program).stderr
    assert migrate.current(first_program) == migrate.SQUASHED
    inband("restore", file, "--database-url", empty_database)
    assert migrate.current(empty_database) == migrate.head()
    readings = "SELECT sequence, measured, correction FROM reading ORDER BY sequence"
    with psycopg.connect(first_program) as before, psycopg.connect(empty_database) as after:
        assert after.execute(readings).fetchall() == before.execute(readings).fetchall() != []


def test_a_backup_replaces_no_file(postgres: str, tmp_path: Path) -> None:
    file = tmp_path / "inband.dump"
    file.write_text("an older backup")
    refused = inband("backup", file, "--database-url", postgres, expect=1)
    assert "is there already" in refused.stderr
    assert file.read_text() == "an older backup"


def test_a_backup_that_fails_leaves_nothing_half_done(postgres: str, tmp_path: Path) -> None:
    nowhere = in_database(postgres, "no_such_database")
    refused = inband("backup", tmp_path / "inband.dump", "--database-url", nowhere, expect=1)
    assert "no_such_database" in refused.stderr
    assert list(tmp_path.iterdir()) == []


def test_what_is_no_backup_is_refused_in_words(tmp_path: Path) -> None:
    refused = inband("restore", tmp_path / "nothing.dump", expect=1)
    assert "There is no file" in refused.stderr
