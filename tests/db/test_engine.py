from datetime import UTC, datetime, timedelta, timezone
from typing import Any

import psycopg
import pytest
from sqlalchemy import text
from sqlalchemy.exc import StatementError

from app.db import engine
from app.db.connections import parameters_of
from app.db.engine import Database
from app.db.types import UtcTime


@pytest.mark.parametrize("scheme", ["postgresql", "postgres", "postgresql+psycopg"])
def test_every_way_of_writing_an_address_means_psycopg(scheme: str) -> None:
    database = Database(f"{scheme}://me:p%40ss@db.example:5433/inband?sslmode=require")
    assert database.dsn == "postgresql://me:p%40ss@db.example:5433/inband?sslmode=require"


def test_of_several_hosts_the_one_is_taken_that_can_be_written_to() -> None:
    parameters = parameters_of("postgresql://me:secret@a:5432,b:5433/inband")
    assert (parameters["host"], parameters["port"]) == ("a,b", "5432,5433")
    assert parameters["target_session_attrs"] == "read-write"
    told = parameters_of("postgresql://me@a,b/inband?target_session_attrs=any&connect_timeout=9")
    assert (told["target_session_attrs"], told["connect_timeout"]) == ("any", "9")


def test_what_a_block_does_is_committed_or_undone_as_one(database: Database) -> None:
    with database.begin() as session:
        session.execute(text("CREATE TABLE slip (words text)"))
        session.execute(text("INSERT INTO slip VALUES ('kept')"))
    with pytest.raises(ZeroDivisionError), database.begin() as session:
        session.execute(text("INSERT INTO slip VALUES ('undone')"))
        raise ZeroDivisionError
    with psycopg.connect(database.dsn) as connection:
        assert connection.execute("SELECT words FROM slip").fetchall() == [("kept",)]


def test_times_come_back_in_utc_and_need_an_offset(database: Database) -> None:
    from sqlalchemy import bindparam, select

    noon = datetime(2026, 11, 21, 12, tzinfo=timezone(timedelta(hours=1)))
    with database.begin() as session:
        back = session.scalar(select(bindparam("at", noon, UtcTime)))
        assert back == noon
        assert back is not None
        assert back.tzinfo is UTC
        with pytest.raises(StatementError, match="without offset"):
            session.scalar(select(bindparam("at", noon.replace(tzinfo=None), UtcTime)))


def test_a_connection_that_broke_is_replaced(database: Database) -> None:
    with database.begin() as session:
        session.execute(text("SELECT 1"))
    with psycopg.connect(database.dsn, autocommit=True) as other:
        other.execute(
            "SELECT pg_terminate_backend(pid, 60000) FROM pg_stat_activity WHERE pid <> pg_backend_pid() AND datname = current_database()"
        )
    with database.begin() as session:
        assert session.scalar(text("SELECT 1")) == 1


def test_a_connection_used_a_moment_ago_is_taken_without_a_question(
    database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[object] = []
    ask = database.engine.dialect.do_ping

    def counted(connection: Any) -> bool:
        asked.append(connection)
        return ask(connection)

    monkeypatch.setattr(database.engine.dialect, "do_ping", counted)
    for _time in range(3):
        with database.begin() as session:
            session.execute(text("SELECT 1"))
    assert not asked
    monkeypatch.setattr(engine, "LATELY", 0)
    with database.begin() as session:
        session.execute(text("SELECT 1"))
    assert len(asked) == 1


def test_a_connection_given_back_after_the_end_is_closed(database: Database) -> None:
    connection = database.engine.connect()
    driver = connection.connection.driver_connection
    assert isinstance(driver, psycopg.Connection)
    database.close()
    assert not driver.closed
    connection.close()
    assert driver.closed
